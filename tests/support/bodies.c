/*
 * bodies.c - ventricles and small bodies from a seed.
 *
 * A cup is r(e) e over the geodesic sphere: half an ellipsoid towards the apex, half a rounded
 * cylinder towards the base, and modes that are polynomials of the place on it. An asteroid is an
 * ellipsoid's radius times a sum of plane waves, whose amplitudes fall with their wave number as on
 * a rough body, less a few craters.
 */
#include "support/bodies.h"
#include "support/meshes.h"
#include "support/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CUP_FREQUENCY ((size_t)9)
#define APEX 69.0   /* mm from the middle of the cup */
#define BASE 32.0   /* the same, to the cap */
#define RADIUS 28.0 /* mm */
#define CAP_POWER 6.0
#define MODE_LENGTH 50.0 /* mm that are 1 in the polynomials of the modes */

#define ASTEROID_FREQUENCY ((size_t)16)
#define WAVES ((size_t)60)
#define CRATERS ((size_t)10)
#define ROUGHNESS 0.06 /* amplitude of a wave of wave number 2 */
#define ROUGHNESS_POWER 1.0
#define BEND 3.6 /* radians: more than half a turn */

/* ---- Cups ------------------------------------------------------------------------------------ */

static void place_on_cup(double *e)
{
    double across = hypot(e[1], e[2]);
    double power = e[0] < 0.0 ? CAP_POWER : 2.0;
    double length = e[0] < 0.0 ? BASE : APEX;
    double r = pow(pow(fabs(e[0]) / length, power) + pow(across / RADIUS, power), -1.0 / power);

    for (size_t k = 0; k < 3; k++) {
        e[k] *= r;
    }
}

/* What a vertex at p moves by for each mode, in mm. */
static void modes_at(const double p[3], double modes[BODIES_MODES][3])
{
    double x = p[0] / MODE_LENGTH;
    double y = p[1] / RADIUS;
    double z = p[2] / RADIUS;
    double lobes = y * y * y - 3.0 * y * z * z;
    const double all[BODIES_MODES][3] = {
        {0.06 * p[0], 0.06 * p[1], 0.06 * p[2]},                 /* size */
        {4.0 * x, 0.0, 0.0},                                     /* length */
        {0.0, 1.5 * y, 1.5 * z},                                 /* width */
        {0.0, 2.5 * (x * x - 0.4), 0.0},                         /* bend */
        {0.0, 0.0, 2.5 * (x * x - 0.4)},                         /* bend */
        {0.0, 1.2 * y, -1.2 * z},                                /* cross-section */
        {0.0, 1.2 * z, 1.2 * y},                                 /* cross-section */
        {0.0, 1.5 * x * y, 1.5 * x * z},                         /* taper */
        {0.0, 1.2 * y * (x * x - 0.5), 1.2 * z * (x * x - 0.5)}, /* waist */
        {0.0, 0.9 * lobes * y, 0.9 * lobes * z},                 /* three lobes */
        {0.0, x * y, -x * z},              /* cross-section towards the apex */
        {1.5 * (y * y - z * z), 0.0, 0.0}, /* saddle of the base */
    };

    memcpy(modes, all, sizeof all);
}

struct srnf_mesh bodies_cup(const double scores[BODIES_MODES])
{
    struct srnf_mesh mesh = meshes_sphere(CUP_FREQUENCY);

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double modes[BODIES_MODES][3];
        double *p = mesh.vertices + 3 * i;

        place_on_cup(p);
        modes_at(p, modes);
        for (size_t k = 0; k < 3 * BODIES_MODES; k++) {
            p[k % 3] += scores[k / 3] * modes[k / 3][k % 3];
        }
    }
    return mesh;
}

struct srnf_mesh bodies_ventricle(uint64_t seed)
{
    struct test_random random = test_random_seed(seed + 1);
    double scores[BODIES_MODES];

    test_random_normals(&random, BODIES_MODES, scores);
    return bodies_cup(scores);
}

struct srnf_mesh bodies_contracted(uint64_t seed)
{
    struct srnf_mesh mesh = bodies_ventricle(seed);

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *p = mesh.vertices + 3 * i;
        double turn = 0.2 * p[0] / MODE_LENGTH;
        double y = p[1];
        double narrow = 0.62 - 0.08 * p[0] / MODE_LENGTH;

        p[1] = narrow * (cos(turn) * y - sin(turn) * p[2]);
        p[2] = narrow * (sin(turn) * y + cos(turn) * p[2]);
        p[0] *= 0.86;
    }
    return mesh;
}

/* ---- Asteroids ------------------------------------------------------------------------------- */

struct asteroid {
    double axes[3];
    double wave[WAVES][3], amplitude[WAVES], phase[WAVES];
    double crater[CRATERS][3], width[CRATERS];
};

static struct asteroid draw_asteroid(size_t index)
{
    struct test_random random = test_random_seed(1000 + index);
    struct asteroid a;

    a.axes[0] = 1.0;
    a.axes[1] = test_random_uniform(&random, 0.6, 1.0);
    a.axes[2] = test_random_uniform(&random, 0.5, 1.0) * a.axes[1];
    for (size_t w = 0; w < WAVES; w++) {
        double number = 2.0 * pow(8.0, (double)w / (double)(WAVES - 1)); /* 2 to 16 */

        test_random_direction(&random, a.wave[w]);
        for (size_t k = 0; k < 3; k++) {
            a.wave[w][k] *= number;
        }
        a.amplitude[w] = ROUGHNESS * pow(2.0 / number, ROUGHNESS_POWER);
        a.phase[w] = test_random_uniform(&random, 0.0, 6.283185307179586);
    }
    for (size_t c = 0; c < CRATERS; c++) {
        test_random_direction(&random, a.crater[c]);
        a.width[c] = test_random_uniform(&random, 0.15, 0.6);
    }
    return a;
}

static double asteroid_radius(const struct asteroid *a, const double e[3])
{
    double square = 0.0;
    double sum = 1.0;

    for (size_t k = 0; k < 3; k++) {
        square += e[k] / a->axes[k] * (e[k] / a->axes[k]);
    }
    for (size_t w = 0; w < WAVES; w++) {
        const double *k = a->wave[w];

        sum += a->amplitude[w] * cos(k[0] * e[0] + k[1] * e[1] + k[2] * e[2] + a->phase[w]);
    }
    for (size_t c = 0; c < CRATERS; c++) {
        double x = e[0] - a->crater[c][0];
        double y = e[1] - a->crater[c][1];
        double z = e[2] - a->crater[c][2];
        double s = (x * x + y * y + z * z) / (a->width[c] * a->width[c]);

        sum -= s < 1.0 ? 0.15 * a->width[c] * (1.0 - s) * (1.0 - s) : 0.0;
    }
    return fabs(sum) / sqrt(square);
}

/* Drawn out along x, slimmer in the middle, and rolled up in the xz plane. */
static void bend(struct srnf_mesh *mesh)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double *p = mesh->vertices + 3 * i;
        double slim = 0.45 + 0.08 * p[0] * p[0];
        double turn = BEND / 2.0 * p[0];
        double from_middle = 1.4 - slim * p[2];

        p[1] *= slim;
        p[0] = from_middle * sin(turn);
        p[2] = 1.4 - from_middle * cos(turn);
    }
}

struct srnf_mesh bodies_asteroid(size_t index)
{
    struct srnf_mesh mesh = meshes_sphere(ASTEROID_FREQUENCY);
    struct asteroid a = draw_asteroid(index);

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *e = mesh.vertices + 3 * i;
        double r = asteroid_radius(&a, e);

        for (size_t k = 0; k < 3; k++) {
            e[k] *= r;
        }
    }
    if (index == BODIES_BENT) {
        bend(&mesh);
    }
    meshes_turn(&mesh, index);
    meshes_move(&mesh, 0.3, -0.2, 0.1 * (double)index);
    return mesh;
}

bool bodies_make(const char *name, struct srnf_mesh *mesh)
{
    unsigned index;

    if (sscanf(name, "ventricle %u", &index) == 1) {
        *mesh = bodies_ventricle(index);
    } else if (sscanf(name, "contracted %u", &index) == 1) {
        *mesh = bodies_contracted(index);
    } else if (sscanf(name, "asteroid %u", &index) == 1 && index < BODIES_ASTEROIDS) {
        *mesh = bodies_asteroid(index);
    } else {
        return false;
    }
    return true;
}

size_t bodies_list(const char *what, size_t made, char *names[FOLDERS_FILES_MAX])
{
    if (strchr(what, '/')) {
        return folders_list(what, names);
    }
    for (size_t i = 0; i < made; i++) {
        names[i] = malloc(64);
        if (!names[i] || snprintf(names[i], 64, "%s %zu", what, i) >= 64) {
            abort();
        }
    }
    return made;
}

bool bodies_load(const char *name, struct srnf_mesh *mesh)
{
    return bodies_make(name, mesh) || (strchr(name, '/') && meshes_load(name, mesh));
}
