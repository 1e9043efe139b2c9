/*
 * shapes.c - surfaces whose truth is known. The bodies with arms are the hardest of them: thin
 * limbs that leave their common plane, so that no point sees them whole.
 */
#include "support/shapes.h"
#include "support/compare.h"
#include "support/meshes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

#define CAPSULE_RADIUS 0.5
#define CAPSULE_HALF_LENGTH 2.2

#define ARM_CORE 0.35
#define ARM_SHARPNESS_MIN 8.0 /* the higher, the thinner the arms */
#define ARM_LIFT \
    1.0 /* the smaller, the more of the body some point sees; all of it below 0.7 or so */

const struct shapes_case shapes_cases[] = {
    {"bumpy star", shapes_bumpy, 0.0, 15, true, false},
    {"bumpy star", shapes_bumpy, 0.0, 31, true, false},
    {"sphere", shapes_ellipsoid, 1.0, 15, true, false},
    {"ellipsoid", shapes_ellipsoid, 1.7, 15, true, false},
    {"ellipsoid", shapes_ellipsoid, 1.7, 22, true, false},
    {"bent capsule", shapes_capsule, 4.0, 15, false, false},
    {"bent capsule", shapes_capsule, 4.0, 22, false, false},
    {"bent capsule", shapes_capsule, 4.5, 31, false, false},
    {"3 arms", shapes_arms, 3.0, 22, false, true},
    {"4 arms", shapes_arms, 4.0, 22, false, true},
    {"5 arms", shapes_arms, 5.0, 22, false, true},
    {"6 arms", shapes_arms, 6.0, 22, false, true},
    {"7 arms", shapes_arms, 7.0, 22, false, true},
    {"8 arms", shapes_arms, 8.0, 22, false, true},
    {"10 arms", shapes_arms, 10.0, 22, false, true},
    {"12 arms", shapes_arms, 12.0, 22, false, true},
};
const size_t shapes_case_count = sizeof shapes_cases / sizeof shapes_cases[0];

static void must(bool good, const char *what)
{
    if (!good) {
        (void)fprintf(stderr, "shapes: %s\n", what);
        abort();
    }
}

double *shapes_doubles(size_t n)
{
    double *x = srnf_alloc(n, sizeof *x);

    must(x != NULL, "out of memory");
    return x;
}

const struct shapes_case *shapes_find(const char *name)
{
    for (size_t i = 0; i < shapes_case_count; i++) {
        if (strcmp(shapes_cases[i].name, name) == 0) {
            return &shapes_cases[i];
        }
    }
    must(false, name);
    return NULL;
}

/* ---- Formulas -------------------------------------------------------------------------------- */

/* r = 1 + .2 cos 2u sin^2 v + .15 cos^3 v + .1 sin 3u sin^3 v, as polynomials in e. */
void shapes_bumpy(const double e[3], double parameter, double x[3])
{
    double two = e[0] * e[0] - e[1] * e[1];
    double three = (3.0 * e[0] * e[0] - e[1] * e[1]) * e[1];
    double r = 1.0 + 0.2 * two + 0.15 * e[2] * e[2] * e[2] + 0.1 * three;

    (void)parameter;
    for (size_t c = 0; c < 3; c++) {
        x[c] = r * e[c];
    }
}

void shapes_ellipsoid(const double e[3], double parameter, double x[3])
{
    x[0] = e[0];
    x[1] = parameter == 1.0 ? e[1] : 1.3 * e[1];
    x[2] = parameter * e[2];
}

/* A slender ellipsoid along an arc of the given angle in the xz plane. */
void shapes_capsule(const double e[3], double parameter, double x[3])
{
    double radius = 2.0 * CAPSULE_HALF_LENGTH / parameter;
    double angle = CAPSULE_HALF_LENGTH * e[2] / radius;
    double along = radius + CAPSULE_RADIUS * e[0];

    x[0] = along * cos(angle) - radius;
    x[1] = CAPSULE_RADIUS * e[1];
    x[2] = along * sin(angle);
}

/* A small ball with arms in the xy plane, then lifted by a bowl that is steeper on one
   side: the arms curve upwards and the body hides their outer ends from one another. */
void shapes_arms(const double e[3], double parameter, double x[3])
{
    int arms = (int)parameter;
    double sharpness = compare_max(ARM_SHARPNESS_MIN, 1.5 * parameter);
    double r = ARM_CORE;
    double square;

    for (int k = 0; k < arms; k++) {
        double angle = 2.0 * PI * k / arms;

        r += exp(sharpness * (e[0] * cos(angle) + e[1] * sin(angle) - 1.0));
    }
    for (size_t c = 0; c < 3; c++) {
        x[c] = r * e[c];
    }
    square = x[0] * x[0] + x[1] * x[1];
    x[2] += ARM_LIFT * (square + 0.3 * x[0] * sqrt(square));
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

void shapes_open(struct shapes_surface *s, size_t degree)
{
    must(srnf_sht_create(&s->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0) == SRNF_OK, "transform");
    s->grid = srnf_sht_grid(s->sht);
    s->degree = degree;
    s->points = s->grid->n_theta * s->grid->n_phi;
    s->each = srnf_coefficient_count(degree);
    s->count = 3 * s->each;
    s->f = shapes_doubles(s->count);
    s->q = shapes_doubles(3 * s->points);
    s->workspace = shapes_doubles(srnf_surface_workspace_size(s->sht) / sizeof(double) + 1);
}

void shapes_open_case(struct shapes_surface *s, const struct shapes_case *which)
{
    shapes_open(s, which->degree);
    shapes_fill(s, which->formula, which->parameter);
}

void shapes_close(struct shapes_surface *s)
{
    srnf_free(s->workspace);
    srnf_free(s->q);
    srnf_free(s->f);
    srnf_sht_destroy(s->sht);
}

void shapes_update(struct shapes_surface *s)
{
    srnf_field(s->sht, s->f, s->q, s->workspace);
}

/* Unit area, no translation; returns the factor. */
static double normalize(struct shapes_surface *s)
{
    struct srnf_surface_measures measures;
    double factor;

    srnf_surface_measure(s->sht, s->f, &measures, s->workspace);
    factor = 1.0 / sqrt(measures.area);
    for (size_t i = 0; i < s->count; i++) {
        s->f[i] = i % s->each == 0 ? 0.0 : factor * s->f[i];
    }
    shapes_update(s);
    return factor;
}

static void direction(const struct srnf_grid *grid, size_t i, double e[3])
{
    size_t row = i / grid->n_phi;
    double phi = 2.0 * PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

    e[0] = grid->sin_theta[row] * cos(phi);
    e[1] = grid->sin_theta[row] * sin(phi);
    e[2] = grid->cos_theta[row];
}

void shapes_fill(struct shapes_surface *s,
                 void (*formula)(const double e[3], double parameter, double x[3]),
                 double parameter)
{
    double *values = shapes_doubles(3 * s->points);

    for (size_t i = 0; i < s->points; i++) {
        double e[3];
        double x[3];

        direction(s->grid, i, e);
        formula(e, parameter, x);
        for (size_t c = 0; c < 3; c++) {
            values[c * s->points + i] = x[c];
        }
    }
    srnf_sht_analysis(s->sht, 3, values, s->f, s->workspace);
    (void)normalize(s);
    srnf_free(values);
}

/* Coefficients of r, at degree L with the last degree 0, whose largest deviation from 1 on the grid
   is 0.4. */
static void random_radius(struct shapes_surface *s, uint64_t seed, double *radius, double *values)
{
    struct test_random random = test_random_seed(seed);
    double largest = 0.0;

    for (size_t l = 1; l < s->degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            radius[i] = test_random_normal(&random) / ((double)l * (double)(l + 1));
        }
    }
    srnf_sht_synthesis(s->sht, 1, radius, values, s->workspace);
    for (size_t i = 0; i < s->points; i++) {
        largest = compare_max(largest, fabs(values[i]));
    }
    for (size_t i = 0; i < s->each; i++) {
        radius[i] *= 0.4 / largest;
    }
    radius[0] = sqrt(4.0 * PI);
    srnf_sht_synthesis(s->sht, 1, radius, values, s->workspace);
}

void shapes_fill_random_star(struct shapes_surface *s, uint64_t seed, double *radius)
{
    double *values = shapes_doubles(4 * s->points);
    double *r = shapes_doubles(s->each);
    double factor;

    random_radius(s, seed, r, values + 3 * s->points);
    for (size_t i = 0; i < s->points; i++) {
        double e[3];

        direction(s->grid, i, e);
        for (size_t c = 0; c < 3; c++) {
            values[c * s->points + i] = values[3 * s->points + i] * e[c];
        }
    }
    srnf_sht_analysis(s->sht, 3, values, s->f, s->workspace);
    factor = normalize(s);
    for (size_t i = 0; radius && i < s->degree * s->degree; i++) {
        radius[i] = factor * r[i];
    }
    srnf_free(r);
    srnf_free(values);
}

bool shapes_fill_structure(struct shapes_surface *s, const char *structure,
                           enum srnf_parameterization route)
{
    char path[128];
    struct srnf_mesh mesh = {0};
    struct srnf_mesh_report report;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded = {0};
    int length = snprintf(path, sizeof path, "tests/data/aal_subcortex/%s.ply", structure);

    must(length > 0 && (size_t)length < sizeof path, "name of a structure");
    if (!meshes_load(path, &mesh)) {
        return false;
    }
    options.degree = s->degree;
    options.parameterization = route;
    must(srnf_mesh_prepare(&mesh, false, &report) == SRNF_OK, "preparing a structure");
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL) == SRNF_OK, "encoding");
    memcpy(s->f, encoded.coefficients, s->count * sizeof *s->f);
    (void)normalize(s);
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    return true;
}

/* ---- What is done to them -------------------------------------------------------------------- */

/* A uniform unit quaternion as a matrix. */
void shapes_random_rotation(struct test_random *random, double rotation[9])
{
    double p[4];
    double norm = 0.0;

    test_random_normals(random, 4, p);
    for (size_t i = 0; i < 4; i++) {
        norm += p[i] * p[i];
    }
    for (size_t i = 0; i < 4; i++) {
        p[i] /= sqrt(norm);
    }
    rotation[0] = 1.0 - 2.0 * (p[2] * p[2] + p[3] * p[3]);
    rotation[1] = 2.0 * (p[1] * p[2] - p[0] * p[3]);
    rotation[2] = 2.0 * (p[1] * p[3] + p[0] * p[2]);
    rotation[3] = 2.0 * (p[1] * p[2] + p[0] * p[3]);
    rotation[4] = 1.0 - 2.0 * (p[1] * p[1] + p[3] * p[3]);
    rotation[5] = 2.0 * (p[2] * p[3] - p[0] * p[1]);
    rotation[6] = 2.0 * (p[1] * p[3] - p[0] * p[2]);
    rotation[7] = 2.0 * (p[2] * p[3] + p[0] * p[1]);
    rotation[8] = 1.0 - 2.0 * (p[1] * p[1] + p[2] * p[2]);
}

void shapes_rotate(const double rotation[9], size_t n, double *x)
{
    for (size_t i = 0; i < n; i++) {
        double v[3] = {x[i], x[n + i], x[2 * n + i]};

        for (size_t c = 0; c < 3; c++) {
            const double *row = rotation + 3 * c;

            x[c * n + i] = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        }
    }
}

void shapes_move(struct shapes_surface *s, struct test_random *random)
{
    double rotation[9];

    shapes_random_rotation(random, rotation);
    shapes_rotate(rotation, s->each, s->f);
    for (size_t c = 0; c < 3; c++) {
        s->f[c * s->each] += test_random_normal(random);
    }
    shapes_update(s);
}

void shapes_add_noise(struct shapes_surface *s, double amplitude, struct test_random *random)
{
    double *noise = shapes_doubles(3 * s->points);
    double factor;

    test_random_normals(random, 3 * s->points, noise);
    factor = amplitude * sqrt(srnf_inner_product(s->grid, s->q, s->q) /
                              srnf_inner_product(s->grid, noise, noise));
    for (size_t i = 0; i < 3 * s->points; i++) {
        s->q[i] += factor * noise[i];
    }
    srnf_free(noise);
}

double shapes_distance(size_t degree, const double *a, const double *b)
{
    size_t each = srnf_coefficient_count(degree);
    double sum = 0.0;

    for (size_t i = 0; i < 3 * each; i++) {
        double difference = i % each == 0 ? 0.0 : a[i] - b[i];

        sum += difference * difference;
    }
    return sqrt(sum);
}

struct srnf_star shapes_star(size_t degree, const double *f)
{
    struct srnf_mesh mesh = {0};
    struct srnf_star star;

    must(srnf_surface_triangulate(degree, f, 24, &mesh, NULL) == SRNF_OK, "triangulating");
    must(srnf_star_kernel(&mesh, &star) == SRNF_OK, "star kernel");
    srnf_mesh_clear(&mesh);
    return star;
}
