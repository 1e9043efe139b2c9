/*
 * bench_routes.c - what the choice between the routes area and star costs and gains, at degree 31,
 * the default, by symmetric registration with default options, as the process distances has it:
 *
 *   - a mesh against itself by both routes: as searched, and by the warp between the two maps,
 *     which the mesh gives (srnf_warp_between), beside the truncation floor
 *   - one structure against another by mixed routes: as searched, and through the moving one's
 *     encoding by the other route
 *   - a mesh with noise on its vertices, cut in four, and with edges flipped, against itself
 *   - seconds of encoding
 *
 * The truncation floor of an encoding is ||q_31 - q_127||: its SRNF against that of the same map
 * with the series taken to degree 127. The warp between two maps moves SRNFs isometrically, so two
 * encodings of one mesh lie no further apart than the sum of their floors, up to how well series
 * stand for the warp and the maps.
 *
 * Exit status: 1 if a mesh by two routes lies further from itself than that sum. ../shared/data
 * has the ventricles; without them the rows are left out.
 */
#include <stdio.h>
#include <stdlib.h>

#include "core/registration/registrations.h"
#include "support/timing.h"
#include "support/triangulations.h"

#define DEGREE 31
#define FINE 127
#define LEFT REGISTRATIONS_LOCAL "L_pallidum.ply"
#define RIGHT REGISTRATIONS_LOCAL "R_pallidum.ply"
#define THALAMUS REGISTRATIONS_LOCAL "L_thalamus.ply"
#define SHARED "../shared/data/"
#define VENTRICLE SHARED "lv_endocardium_ed/lv_asymp_0705.ply"
#define SYSTOLE SHARED "lv_pairs/lv_asymp_0705_es_endo.ply"

static void must(int status, const char *what)
{
    if (status < 0) {
        (void)fprintf(stderr, "bench_routes: %s: %s\n", what, srnf_strerror(status));
        exit(2);
    }
}

/* ---- Meshes and encodings -------------------------------------------------------------------- */

static bool open_mesh(const char *path, struct srnf_mesh *mesh)
{
    if (meshes_load(path, mesh)) {
        return true;
    }
    printf("%s is not there\n", path);
    return false;
}

static void mirror(struct srnf_mesh *mesh)
{
    meshes_stretch(mesh, -1.0, 1.0, 1.0);
    meshes_flip(mesh);
}

static struct srnf_encode_options by(enum srnf_parameterization route, size_t degree)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    options.degree = degree;
    options.parameterization = route;
    return options;
}

/* False where the route does not go with the mesh. */
static bool encode(struct srnf_mesh *mesh, enum srnf_parameterization route, size_t degree,
                   double *out)
{
    struct srnf_encode_options options = by(route, degree);
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    int status;

    must(srnf_mesh_prepare(mesh, false, &report), "prepare");
    status = srnf_encode(mesh, &report, &options, NULL, &encoded, NULL);
    if (status == SRNF_ENOT_STAR) {
        return false;
    }
    must(status, "encode");
    memcpy(out, encoded.coefficients, 3 * srnf_coefficient_count(degree) * sizeof(double));
    srnf_free(encoded.coefficients);
    return true;
}

static double floor_of(struct srnf_mesh *mesh, enum srnf_parameterization route)
{
    struct shapes_surface fine, coarse;
    size_t few = srnf_coefficient_count(DEGREE), many = srnf_coefficient_count(FINE);
    double *cut = shapes_doubles(3 * few);
    double sum = 0.0;

    shapes_open(&fine, FINE);
    shapes_open(&coarse, FINE);
    if (!encode(mesh, route, FINE, fine.f) || !encode(mesh, route, DEGREE, cut)) {
        sum = NAN;
    }
    memset(coarse.f, 0, coarse.count * sizeof(double));
    for (size_t k = 0; k < 3; k++) {
        memcpy(coarse.f + k * many, cut + k * few, few * sizeof(double));
    }
    shapes_update(&fine);
    shapes_update(&coarse);
    for (size_t k = 0; k < 3 * fine.points; k++) {
        fine.q[k] -= coarse.q[k];
    }
    sum += srnf_inner_product(fine.grid, fine.q, fine.q);
    shapes_close(&fine);
    shapes_close(&coarse);
    srnf_free(cut);
    return sqrt(sum);
}

/* ---- Distances ------------------------------------------------------------------------------- */

struct bench {
    struct shapes_surface a, b, c;
    bool good;
};

static double searched(const struct bench *x, const double *a, const double *b, double *before)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    double distance;

    options.symmetric = true;
    must(srnf_register(x->a.sht, a, NULL, b, &options, NULL, NULL, &r, NULL), "register");
    distance = r.distance;
    if (before) {
        *before = r.distance_before;
    }
    srnf_registration_clear(&r);
    return distance;
}

/* The warp from one route's sphere to the other's, or none where it folds. */
static bool between(struct srnf_mesh *mesh, enum srnf_parameterization from,
                    enum srnf_parameterization to, size_t degree, struct srnf_warp *warp)
{
    struct srnf_encode_options first = by(from, DEGREE), second = by(to, DEGREE);
    struct srnf_mesh_report report;
    double *points;
    int status;

    must(srnf_mesh_prepare(mesh, false, &report), "prepare");
    points = shapes_doubles(6 * mesh->n_vertices);
    must(srnf_encode_points(mesh, &report, &first, NULL, points, NULL), "map");
    must(srnf_encode_points(mesh, &report, &second, NULL, points + 3 * mesh->n_vertices, NULL),
         "map");
    status = srnf_warp_between(mesh, points, points + 3 * mesh->n_vertices, degree, NULL, warp);
    srnf_free(points);
    if (status == SRNF_ENUMERIC) {
        return false;
    }
    must(status, "between");
    return true;
}

static double known(const struct bench *x, const double *a, const double *b,
                    const struct srnf_warp *warp, double *least)
{
    struct srnf_registration r;
    double distance;

    must(srnf_register_known(x->a.sht, a, b, NULL, warp, NULL, &r, NULL), "known");
    distance = r.distance;
    *least = r.min_jacobian;
    srnf_registration_clear(&r);
    return distance;
}

static void two_routes(struct bench *x, const char *path)
{
    static const size_t degrees[] = {31, 63, 127}; /* of the warp; the service takes the first */
    const char *name = strrchr(path, '/') + 1;
    struct srnf_mesh mesh;
    double floors[2];

    if (!open_mesh(path, &mesh)) {
        return;
    }
    if (!encode(&mesh, SRNF_PARAMETERIZATION_AREA, DEGREE, x->a.f) ||
        !encode(&mesh, SRNF_PARAMETERIZATION_STAR, DEGREE, x->b.f)) {
        printf("%-22s is not star-shaped\n", name);
        srnf_mesh_clear(&mesh);
        return;
    }
    floors[0] = floor_of(&mesh, SRNF_PARAMETERIZATION_AREA);
    floors[1] = floor_of(&mesh, SRNF_PARAMETERIZATION_STAR);
    printf("%-22s searched %.4f; floor of area %.4f, of star %.4f", name,
           searched(x, x->a.f, x->b.f, NULL), floors[0], floors[1]);
    for (size_t k = 0; k < sizeof degrees / sizeof degrees[0]; k++) {
        for (size_t way = 0; way < 2; way++) {
            struct srnf_warp warp;
            double least, distance;

            if (!between(&mesh, way ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AREA,
                         way ? SRNF_PARAMETERIZATION_AREA : SRNF_PARAMETERIZATION_STAR, degrees[k],
                         &warp)) {
                printf("; degree %zu folds", degrees[k]);
                continue;
            }
            distance = way ? known(x, x->b.f, x->a.f, &warp, &least)
                           : known(x, x->a.f, x->b.f, &warp, &least);
            printf("; known, degree %zu: %.4f (J > %.2g)", degrees[k], distance, least);
            if (k == 0) {
                x->good = x->good && distance <= floors[0] + floors[1];
            }
            srnf_warp_clear(&warp);
        }
    }
    printf("\n");
    srnf_mesh_clear(&mesh);
}

/* ---- Pairs ----------------------------------------------------------------------------------- */

/* template by area; moving by star, registered by area and carried over. */
static void mixed(struct bench *x, const char *what, struct srnf_mesh *fixed,
                  struct srnf_mesh *moving)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    struct srnf_warp warp;
    double least, area;

    (void)encode(fixed, SRNF_PARAMETERIZATION_AREA, DEGREE, x->a.f);
    (void)encode(moving, SRNF_PARAMETERIZATION_AREA, DEGREE, x->c.f);
    area = searched(x, x->a.f, x->c.f, NULL);
    printf("%-34s area and area %.4f", what, area);
    if (encode(moving, SRNF_PARAMETERIZATION_STAR, DEGREE, x->b.f)) {
        printf(", area and star searched %.4f", searched(x, x->a.f, x->b.f, NULL));
        options.symmetric = true;
        must(srnf_register(x->a.sht, x->a.f, NULL, x->c.f, &options, NULL, NULL, &r, NULL),
             "register");
        if (between(moving, SRNF_PARAMETERIZATION_AREA, SRNF_PARAMETERIZATION_STAR, 31, &warp)) {
            must(srnf_warp_join(&warp, &r.warp), "join");
            printf(", through area %.4f", known(x, x->a.f, x->b.f, &r.warp, &least));
            srnf_warp_clear(&warp);
        }
        srnf_registration_clear(&r);
    }
    printf("\n");
    if (encode(fixed, SRNF_PARAMETERIZATION_STAR, DEGREE, x->a.f) &&
        encode(moving, SRNF_PARAMETERIZATION_STAR, DEGREE, x->b.f)) {
        printf("%-34s star and star %.4f\n", "", searched(x, x->a.f, x->b.f, NULL));
    }
}

static void pairs(struct bench *x)
{
    struct test_random random = test_random_seed(11);
    struct srnf_mesh a, b;

    printf("\nPairs\n");
    if (open_mesh(LEFT, &a) && open_mesh(RIGHT, &b)) {
        mirror(&b);
        mixed(x, "L pallidum, mirrored R", &a, &b);
        srnf_mesh_clear(&a);
        srnf_mesh_clear(&b);
    }
    if (open_mesh(VENTRICLE, &a)) {
        b = meshes_copy(&a);
        triangulations_jitter(&b, 0.3, &random);
        mixed(x, "ventricle with 0.3 mm, itself", &b, &a);
        srnf_mesh_clear(&b);
        if (open_mesh(SYSTOLE, &b)) {
            mixed(x, "ventricle, its end systole", &a, &b);
            srnf_mesh_clear(&b);
        }
        srnf_mesh_clear(&a);
    }
}

/* ---- Noise and remeshing --------------------------------------------------------------------- */

static void changed(struct bench *x, const char *what, struct srnf_mesh *mesh,
                    struct srnf_mesh *again)
{
    static const enum srnf_parameterization routes[] = {SRNF_PARAMETERIZATION_AREA,
                                                        SRNF_PARAMETERIZATION_STAR};

    printf("  %-20s", what);
    for (size_t k = 0; k < 2; k++) {
        const char *name = srnf_parameterization_name(routes[k]);
        double before, distance;

        if (encode(mesh, routes[k], DEGREE, x->a.f) && encode(again, routes[k], DEGREE, x->b.f)) {
            distance = searched(x, x->a.f, x->b.f, &before);
            printf("  %s %.4f (%.4f unregistered)", name, distance, before);
        } else {
            printf("  %s -", name);
        }
    }
    printf("\n");
    srnf_mesh_clear(again);
}

static void changes(struct bench *x, const char *path, double millimetre)
{
    struct test_random random = test_random_seed(5);
    struct srnf_mesh mesh, again;

    if (!open_mesh(path, &mesh)) {
        return;
    }
    printf("%s\n", strrchr(path, '/') + 1);
    again = meshes_copy(&mesh);
    triangulations_jitter(&again, 0.1 * millimetre, &random);
    changed(x, "noise of 0.1 mm", &mesh, &again);
    again = meshes_copy(&mesh);
    triangulations_jitter(&again, 0.3 * millimetre, &random);
    changed(x, "noise of 0.3 mm", &mesh, &again);
    again = triangulations_subdivided(&mesh);
    changed(x, "each face in four", &mesh, &again);
    again = triangulations_subdivided(&mesh);
    triangulations_flip_edges(&again, again.n_faces * 3 / 20, &random);
    changed(x, "and edges flipped", &mesh, &again);
    srnf_mesh_clear(&mesh);
}

/* ---- Time ------------------------------------------------------------------------------------ */

static void times(struct bench *x, const char *path)
{
    struct srnf_mesh mesh;

    if (!open_mesh(path, &mesh)) {
        return;
    }
    printf("%-22s %6zu faces:", strrchr(path, '/') + 1, mesh.n_faces);
    for (size_t k = 0; k < 2; k++) {
        enum srnf_parameterization route =
            k ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AREA;
        double seconds[5];

        for (size_t i = 0; i < 5; i++) {
            double start = timing_cpu();

            (void)encode(&mesh, route, DEGREE, x->a.f);
            seconds[i] = timing_cpu() - start;
        }
        printf("  %s %.0f ms", srnf_parameterization_name(route), 1e3 * timing_minimum(5, seconds));
    }
    printf("\n");
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    static const char *const two[] = {RIGHT, LEFT, THALAMUS, VENTRICLE,
                                      SHARED "lv_endocardium_ed/lv_asymp_0083.ply"};
    struct bench x = {.good = true};

    openblas_set_num_threads(1);
    (void)setvbuf(stdout, NULL, _IOLBF, 0);
    shapes_open(&x.a, DEGREE);
    shapes_open(&x.b, DEGREE);
    shapes_open(&x.c, DEGREE);
    printf("A mesh against itself, area and star\n");
    for (size_t k = 0; k < sizeof two / sizeof two[0]; k++) {
        two_routes(&x, two[k]);
    }
    pairs(&x);
    printf("\nA mesh changed, against itself\n");
    changes(&x, VENTRICLE, 1.0);
    changes(&x, RIGHT, 1.0);
    printf("\nEncoding, processor time\n");
    times(&x, RIGHT);
    times(&x, VENTRICLE);
    shapes_close(&x.a);
    shapes_close(&x.b);
    shapes_close(&x.c);
    return x.good ? EXIT_SUCCESS : EXIT_FAILURE;
}
