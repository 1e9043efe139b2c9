/*
 * test_slivers.c - what long thin faces cost: a ray and a distance in a mesh of slivers take no
 * more than a bounded multiple of what they take in one of even triangles, and are right; and
 * ordinary meshes have the tree that they would have if no mesh had slivers.
 *
 * Times are processor times of this thread, and only their ratios are judged.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>

#include "mesh/index.h"
#include "support/compare.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/slivers.h"
#include "support/timing.h"

#define FACES ((size_t)40000)
#define QUERIES ((size_t)1000)

/* Of what the even triangles take, 18 at most are measured; with boxes along the axes of space
   alone blades took 100 times as much, and twice that for twice the faces. */
#define RATIO_MAX 40.0

struct cost {
    double ray, distance; /* processor seconds of one */
};

/* Rays from the centroid, as encoding casts them, and distances of points near the surface. */
static struct cost measure(const struct srnf_mesh *mesh)
{
    struct srnf_index *index = NULL;
    struct srnf_mesh_measures measures;
    struct test_random random = test_random_seed(2);
    struct cost cost;
    size_t hits = 0;
    double start, sum = 0.0;

    srnf_mesh_measure(mesh, NULL, &measures);
    assert_int_equal(srnf_index_create(&index, mesh), SRNF_OK);
    start = timing_cpu();
    for (size_t i = 0; i < QUERIES; i++) {
        double direction[3], t = 0.0;

        test_random_direction(&random, direction);
        hits += srnf_index_ray(index, measures.centroid, direction, &t, NULL);
    }
    cost.ray = (timing_cpu() - start) / (double)QUERIES;
    assert_int_equal(hits, QUERIES);
    start = timing_cpu();
    for (size_t i = 0; i < QUERIES; i++) {
        const double *corner = mesh_corner(mesh, test_random_below(&random, mesh->n_faces), 0);
        double point[3];

        for (size_t k = 0; k < 3; k++) {
            double part = test_random_uniform(&random, 0.0, 1.0);

            point[k] = corner[k] + 0.01 * measures.diagonal * test_random_normal(&random) -
                       part * (corner[k] - measures.centroid[k]);
        }
        sum += srnf_index_distance2(index, point, NULL, NULL);
    }
    cost.distance = (timing_cpu() - start) / (double)QUERIES;
    assert_true(isfinite(sum));
    srnf_index_destroy(index);
    return cost;
}

static void test_queries_are_bounded(void **state)
{
    struct cost even = {0.0, 0.0};
    (void)state;

    for (const struct sliver_family *family = sliver_families; family->name; family++) {
        struct srnf_mesh mesh = family->make(FACES);
        struct cost cost = measure(&mesh);

        even = family == sliver_families ? cost : even;
        print_message("# %-12s ray %6.2f us, distance %6.2f us\n", family->name, 1e6 * cost.ray,
                      1e6 * cost.distance);
        assert_true(cost.ray <= RATIO_MAX * even.ray);
        assert_true(cost.distance <= RATIO_MAX * even.distance);
        srnf_mesh_clear(&mesh);
    }
}

/* The index over all faces against one over each part of them that is too small to be crowded. */
static void test_answers_are_those_of_all_faces(void **state)
{
    (void)state;
    for (const struct sliver_family *family = sliver_families; family->name; family++) {
        struct srnf_mesh mesh = family->make(1200);
        struct test_random random = test_random_seed(4);
        struct srnf_index *whole = NULL, *parts[64];
        struct srnf_mesh part = mesh;
        size_t n_parts = 0;

        assert_int_equal(srnf_index_create(&whole, &mesh), SRNF_OK);
        for (size_t first = 0; first < mesh.n_faces; first += 32) {
            struct srnf_mesh *own = test_malloc(sizeof *own);

            part.faces = mesh.faces + 3 * first;
            part.n_faces = mesh.n_faces - first < 32 ? mesh.n_faces - first : 32;
            *own = part;
            assert_true(n_parts < 64);
            assert_int_equal(srnf_index_create(&parts[n_parts], own), SRNF_OK);
            assert_int_equal(parts[n_parts++]->n_boxes, 0);
        }
        for (size_t i = 0; i < 200; i++) {
            double origin[3], direction[3], t = -1.0, best = -1.0, nearest = INFINITY;

            test_random_direction(&random, direction);
            for (size_t k = 0; k < 3; k++) {
                origin[k] = test_random_uniform(&random, -1.2, 1.2);
            }
            for (size_t p = 0; p < n_parts; p++) {
                double own = -1.0;

                if (srnf_index_ray(parts[p], origin, direction, &own, NULL)) {
                    best = compare_max(best, own);
                }
                nearest = compare_min(nearest, srnf_index_distance2(parts[p], origin, NULL, NULL));
            }
            assert_int_equal(srnf_index_ray(whole, origin, direction, &t, NULL), best >= 0.0);
            assert_true(t == best);
            assert_true(srnf_index_distance2(whole, origin, NULL, NULL) == nearest);
        }
        while (n_parts > 0) {
            test_free((void *)(uintptr_t)parts[n_parts - 1]->mesh);
            srnf_index_destroy(parts[--n_parts]);
        }
        srnf_index_destroy(whole);
        srnf_mesh_clear(&mesh);
    }
}

static void test_ordinary_meshes_are_not_crowded(void **state)
{
    static const char *const files[] = {"L_amygdala", "L_caudate", "L_hippocampus", "R_thalamus"};
    struct srnf_index *index = NULL;
    struct srnf_mesh mesh;
    (void)state;

    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        char path[128];

        snprintf(path, sizeof path, "tests/data/aal_subcortex/%s.ply", files[i]);
        assert_true(meshes_load(path, &mesh));
        assert_int_equal(srnf_index_create(&index, &mesh), SRNF_OK);
        assert_int_equal(index->n_boxes, 0);
        srnf_index_destroy(index);
        srnf_mesh_clear(&mesh);
    }
    mesh = sliver_families[1].make(FACES);
    assert_int_equal(srnf_index_create(&index, &mesh), SRNF_OK);
    assert_true(index->n_boxes > 0);
    srnf_index_destroy(index);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_queries_are_bounded),
        cmocka_unit_test(test_answers_are_those_of_all_faces),
        cmocka_unit_test(test_ordinary_meshes_are_not_crowded),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
