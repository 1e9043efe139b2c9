/*
 * test_star.c - the star kernel: the centre satisfies every constraint with the margin, no other
 * centre does better, known kernels come out, and nothing depends on scale, place, pose or threads.
 *
 * srnfd-test: no-asan (core/surface/test_encode_adversarial.c runs its code)
 * srnfd-test: slow
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "support/bodies.h"
#include "support/compare.h"
#include "support/meshes.h"
#include "support/random.h"

static double diagonal_of(const struct srnf_mesh *mesh)
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;

        for (size_t i = 0; i < mesh->n_vertices; i++) {
            low = compare_min(low, mesh->vertices[3 * i + k]);
            high = compare_max(high, mesh->vertices[3 * i + k]);
        }
        sum += (high - low) * (high - low);
    }
    return sqrt(sum);
}

/* Margin by its definition, in extended precision. */
static double margin_at(const struct srnf_mesh *mesh, const double c[3])
{
    long double margin = INFINITY;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        const double *a = mesh->vertices + 3 * mesh->faces[3 * f];
        const double *b = mesh->vertices + 3 * mesh->faces[3 * f + 1];
        const double *d = mesh->vertices + 3 * mesh->faces[3 * f + 2];
        long double n[3], length = 0.0L, slack = 0.0L;

        for (size_t k = 0; k < 3; k++) {
            size_t i = (k + 1) % 3, j = (k + 2) % 3;

            n[k] = ((long double)b[i] - a[i]) * ((long double)d[j] - a[j]) -
                   ((long double)b[j] - a[j]) * ((long double)d[i] - a[i]);
            length += n[k] * n[k];
            slack += n[k] * ((long double)a[k] - c[k]);
        }
        slack /= sqrtl(length);
        margin = isnan(margin) || margin <= slack ? margin : slack; /* compare_min, but longer */
    }
    return (double)margin;
}

/* The margin is what it says at the centre, and, being concave, the largest: no step from there
   improves it. */
static void assert_optimal(const struct srnf_mesh *mesh, const struct srnf_star *star)
{
    double diagonal = diagonal_of(mesh);
    struct test_random random = test_random_seed(1);

    assert_true(fabs(margin_at(mesh, star->center) - star->margin) < 1e-12 * diagonal);
    assert_int_equal(star->value, star->margin > 1e-9 * diagonal);
    assert_int_equal(star->violating_area_fraction > 0.0, star->margin < 0.0);
    for (double step = 0.3; step > 1e-8; step *= 0.1) {
        for (size_t i = 0; i < 40; i++) {
            double direction[3], other[3];

            test_random_direction(&random, direction);
            for (size_t k = 0; k < 3; k++) {
                other[k] = star->center[k] + step * diagonal * direction[k];
            }
            assert_true(margin_at(mesh, other) <= star->margin + 1e-11 * diagonal);
        }
    }
}

static void test_optimality(void **state)
{
    struct srnf_mesh meshes[] = {meshes_star(10),       meshes_bumpy(8, 1),
                                 meshes_bumpy(12, 2),   meshes_bumpy(16, 3),
                                 meshes_tetrahedron(),  meshes_capsule(5, 1, 20, 15),
                                 meshes_box(3, 2, 1),   meshes_bent_capsule(10, 1, 4, 40, 12),
                                 meshes_sphere(20),     meshes_torus(3, 1, 20, 12),
                                 meshes_two_spheres(4), meshes_bent_capsule(10, 1, 1, 30, 12)};
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_star star, again;

        meshes_turn(&meshes[i], i);
        assert_int_equal(srnf_star_kernel(&meshes[i], &star), SRNF_OK);
        assert_optimal(&meshes[i], &star);
        assert_int_equal(srnf_star_at(&meshes[i], star.center, &again), SRNF_OK);
        assert_true(fabs(again.margin - star.margin) < 1e-13 * diagonal_of(&meshes[i]));
        assert_int_equal(again.value, star.value);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* The largest ball inside a convex body: half the shortest edge of a box, (3 - sqrt 3) / 6 for the
   corner of a cube. */
static void test_chebyshev_radius(void **state)
{
    const double edges[][3] = {{1, 1, 1}, {3, 2, 1}, {1, 100, 7}, {1e-3, 1, 1}};
    struct srnf_mesh mesh = meshes_tetrahedron();
    struct srnf_star star;
    (void)state;

    assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
    assert_true(fabs(star.margin - (3.0 - sqrt(3.0)) / 6.0) < 1e-12);
    for (size_t k = 0; k < 3; k++) {
        assert_true(fabs(star.center[k] - star.margin) < 1e-12);
    }
    srnf_mesh_clear(&mesh);
    for (size_t i = 0; i < 4; i++) {
        const double *e = edges[i];

        mesh = meshes_box(e[0], e[1], e[2]);
        meshes_turn(&mesh, i);
        assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
        assert_true(fabs(star.margin - 0.5 * compare_min(e[0], compare_min(e[1], e[2]))) <
                    1e-12 * diagonal_of(&mesh));
        srnf_mesh_clear(&mesh);
    }
}

/* A bent tube sees itself while it is bent little. */
static void test_bent_tube(void **state)
{
    const double angles[] = {0.3, 3.5};
    (void)state;

    for (size_t i = 0; i < 2; i++) {
        struct srnf_mesh mesh = meshes_bent_capsule(8, 1, angles[i], 60, 16);
        struct srnf_star star;

        assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
        assert_int_equal(star.value, i == 0);
        assert_true(i == 0 ? star.margin > 0.5 : star.margin < -0.1);
        assert_true(i == 0 ? star.violating_area_fraction == 0.0
                           : star.violating_area_fraction > 0.05);
        srnf_mesh_clear(&mesh);
    }
}

/* Two tetrahedra that share a corner and nothing else see each other from that corner only. The
   margin is zero up to rounding, and must not be taken for a kernel. */
static void test_kernel_of_one_point(void **state)
{
    struct srnf_mesh mesh = meshes_bowtie();
    struct srnf_star star;
    (void)state;

    meshes_turn(&mesh, 4);
    assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
    assert_false(star.value);
    assert_true(fabs(star.margin) < 1e-12);
    for (size_t k = 0; k < 3; k++) {
        assert_true(fabs(star.center[k]) < 1e-12);
    }
    srnf_mesh_clear(&mesh);
}

static void test_scale_and_place(void **state)
{
    const double scales[] = {1e-9, 1e-3, 1e9, 1e60, 1e-60};
    struct srnf_mesh mesh = meshes_bumpy(9, 8);
    struct srnf_star star, moved;
    (void)state;

    assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
    for (size_t i = 0; i < 5; i++) {
        struct srnf_mesh copy = meshes_copy(&mesh);

        meshes_move(&copy, 100, -50, 20);
        meshes_scale(&copy, scales[i]);
        assert_int_equal(srnf_star_kernel(&copy, &moved), SRNF_OK);
        assert_true(moved.value);
        assert_true(fabs(moved.margin / scales[i] - star.margin) < 1e-11);
        assert_true(fabs(moved.center[0] / scales[i] - 100.0 - star.center[0]) < 1e-9);
        srnf_mesh_clear(&copy);
    }
    srnf_mesh_clear(&mesh);
}

/* Faces without area, repeated vertices and needles neither count nor disturb. */
static void test_slivers(void **state)
{
    struct srnf_mesh mesh = meshes_star(8), soup = meshes_soup(&mesh),
                     both = meshes_join(&mesh, &soup);
    struct srnf_star star, other;
    (void)state;

    for (size_t f = mesh.n_faces; f < both.n_faces;
         f++) { /* flatten each copied face onto one of its edges */
        double *v[3];

        for (size_t k = 0; k < 3; k++) {
            v[k] = both.vertices + 3 * both.faces[3 * f + k];
        }
        for (size_t k = 0; k < 3; k++) {
            v[2][k] = f % 2 ? v[1][k] : v[0][k] + 0.375 * (v[1][k] - v[0][k]);
        }
    }
    assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
    assert_int_equal(srnf_star_kernel(&both, &other), SRNF_OK);
    assert_true(fabs(star.margin - other.margin) < 1e-11);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&soup);
    meshes_stretch(&mesh, 0, 0, 1);
    assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_EDEGENERATE);
    srnf_mesh_clear(&mesh);
}

static void test_given_center(void **state)
{
    struct srnf_mesh mesh = meshes_box(2, 2, 2);
    const double inside[3] = {0.9, 0, 0}, outside[3] = {1.5, 0, 0}, nowhere[3] = {NAN, 0, 0};
    struct srnf_star star;
    (void)state;

    assert_int_equal(srnf_star_at(&mesh, inside, &star), SRNF_OK);
    assert_true(star.value && fabs(star.margin - 0.1) < 1e-14 &&
                star.violating_area_fraction == 0.0);
    assert_int_equal(srnf_star_at(&mesh, outside, &star), SRNF_OK);
    assert_true(!star.value && fabs(star.margin + 0.5) < 1e-14);
    assert_true(fabs(star.violating_area_fraction - 1.0 / 6.0) < 1e-14);
    assert_int_equal(srnf_star_at(&mesh, nowhere, &star), SRNF_EINVAL);
    srnf_mesh_clear(&mesh);
}

/* ---- Real meshes, and such ------------------------------------------------------------------- */

struct fact {
    const char *name; /* of a file in tests/data/aal_subcortex, or of a body */
    bool star_shaped;
};

static void check_facts(const struct fact *facts, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        struct srnf_mesh mesh;
        struct srnf_mesh_report report;
        struct srnf_star star;

        assert_true(bodies_load(facts[i].name, &mesh));
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
        assert_int_equal(star.value, facts[i].star_shaped);
        assert_optimal(&mesh, &star);
        srnf_mesh_clear(&mesh);
    }
}

#define AAL "tests/data/aal_subcortex/"

static void test_brain_structures(void **state)
{
    const struct fact facts[] = {
        {AAL "L_thalamus.ply", true},     {AAL "R_thalamus.ply", true},
        {AAL "L_pallidum.ply", true},     {AAL "R_pallidum.ply", true},
        {AAL "L_amygdala.ply", true},     {AAL "R_amygdala.ply", false},
        {AAL "L_caudate.ply", false},     {AAL "R_caudate.ply", false},
        {AAL "L_putamen.ply", false},     {AAL "R_putamen.ply", false},
        {AAL "L_hippocampus.ply", false}, {AAL "R_hippocampus.ply", false},
    };
    (void)state;

    check_facts(facts, sizeof facts / sizeof facts[0]);
}

/* Each but the bent one was made star-shaped. */
static void test_small_bodies(void **state)
{
    (void)state;

    for (size_t i = 0; i < BODIES_ASTEROIDS; i++) {
        char name[32];

        (void)snprintf(name, sizeof name, "asteroid %zu", i);
        check_facts(&(struct fact){name, i != BODIES_BENT}, 1);
    }
}

/* Cups: flat at one end, pointed at the other. */
static void test_ventricles(void **state)
{
    const struct fact facts[] = {
        {"ventricle 1", true}, {"ventricle 2", true}, {"contracted 3", true}};
    (void)state;

    check_facts(facts, sizeof facts / sizeof facts[0]);
}

/* ---- Threads --------------------------------------------------------------------------------- */

enum { THREADS = 8, MESHES = 6 };

struct worker {
    pthread_t thread;
    const struct srnf_mesh *meshes;
    const struct srnf_star *expected;
    size_t differing;
};

static void *work(void *argument)
{
    struct worker *worker = argument;

    for (size_t i = 0; i < 5 * MESHES; i++) {
        struct srnf_star star;

        memset(&star, 0, sizeof star);
        if (srnf_star_kernel(&worker->meshes[i % MESHES], &star) != SRNF_OK ||
            memcmp(&star, &worker->expected[i % MESHES], sizeof star) != 0) {
            worker->differing++;
        }
    }
    return NULL;
}

/* Many threads at once get, to the last bit, what one gets; under the address sanitizer, nothing is
   left of them either. */
static void test_threads(void **state)
{
    struct srnf_mesh meshes[MESHES];
    struct srnf_star expected[MESHES];
    struct worker workers[THREADS];
    (void)state;

    memset(expected, 0, sizeof expected);
    for (size_t i = 0; i < MESHES; i++) {
        meshes[i] =
            i % 2 ? meshes_bumpy(6 + i, i) : meshes_bent_capsule(9, 1, (double)i + 1, 30, 10 + i);
        assert_int_equal(srnf_star_kernel(&meshes[i], &expected[i]), SRNF_OK);
    }
    for (size_t t = 0; t < THREADS; t++) {
        workers[t] = (struct worker){.meshes = meshes, .expected = expected};
        assert_int_equal(pthread_create(&workers[t].thread, NULL, work, &workers[t]), 0);
    }
    for (size_t t = 0; t < THREADS; t++) {
        assert_int_equal(pthread_join(workers[t].thread, NULL), 0);
        assert_int_equal(workers[t].differing, 0);
    }
    for (size_t i = 0; i < MESHES; i++) {
        srnf_mesh_clear(&meshes[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_optimality),      cmocka_unit_test(test_chebyshev_radius),
        cmocka_unit_test(test_bent_tube),       cmocka_unit_test(test_kernel_of_one_point),
        cmocka_unit_test(test_scale_and_place), cmocka_unit_test(test_slivers),
        cmocka_unit_test(test_given_center),    cmocka_unit_test(test_brain_structures),
        cmocka_unit_test(test_small_bodies),    cmocka_unit_test(test_ventricles),
        cmocka_unit_test(test_threads),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
