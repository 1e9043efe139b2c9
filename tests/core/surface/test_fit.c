/*
 * test_fit.c - fit error: known distances, both sides, weights, quantile, symmetry and scale.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "surface/fit.h"
#include "support/meshes.h"

static struct srnf_fit measure(const struct srnf_mesh *mesh, const struct srnf_mesh *surface)
{
    struct srnf_index *index;
    struct srnf_fit fit;

    assert_int_equal(srnf_index_create(&index, mesh), SRNF_OK);
    assert_int_equal(srnf_fit_measure(mesh, index, surface, NULL, &fit), SRNF_OK);
    srnf_index_destroy(index);
    return fit;
}

static void test_same_surface(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(10, 1);
    struct srnf_fit fit = measure(&mesh, &mesh);
    (void)state;

    assert_true(fit.max == 0.0 && fit.rms == 0.0 && fit.p95 == 0.0);
    assert_true(fit.diagonal > 2.0 && fit.diagonal < 8.0);
    srnf_mesh_clear(&mesh);
}

/* Concentric spheres are their difference in radius apart, from both sides and everywhere; scale
   multiplies all. */
static void test_concentric_spheres(void **state)
{
    const double scales[] = {1e-9, 1.0, 1e9};
    (void)state;

    for (size_t i = 0; i < 3; i++) {
        struct srnf_mesh inner = meshes_sphere(30), outer = meshes_sphere(40);
        struct srnf_fit fit;
        double s = scales[i];

        meshes_scale(&inner, s);
        meshes_scale(&outer, 1.25 * s);
        fit = measure(&inner, &outer);
        assert_true(fabs(fit.rms / s - 0.25) < 1e-3);
        assert_true(fabs(fit.p95 / s - 0.25) < 1e-3);
        assert_true(fabs(fit.max / s - 0.25) < 1e-3);
        assert_true(fabs(fit.diagonal / s - 2.0 * sqrt(3.0)) < 2e-2);
        srnf_mesh_clear(&outer);
        srnf_mesh_clear(&inner);
    }
}

/* Part of the mesh that the surface does not have counts by its area. A second sphere of radius s
   holds the part w = s^2 / (1 + s^2) of its side, w / 2 of everything: p95 sees it when that is
   above 0.05, max always does. */
static void test_missing_part(void **state)
{
    const double radii[] = {0.2, 0.3, 0.4, 0.6};
    (void)state;

    for (size_t i = 0; i < 4; i++) {
        struct srnf_mesh one = meshes_sphere(12), part = meshes_sphere(10), both;
        double s = radii[i], weight = 0.5 * s * s / (1.0 + s * s);
        struct srnf_fit fit, other;

        meshes_scale(&part, s);
        meshes_move(&part, 11, 0, 0);
        both = meshes_join(&one, &part);
        fit = measure(&both, &one);
        assert_true(fabs(fit.max - (10.0 + s)) < 1e-2);
        assert_true(weight > 0.05 ? fit.p95 > 10.0 - s - 1e-2 : fit.p95 < 1e-12);
        assert_true(fabs(fit.rms / (10.0 * sqrt(weight)) - 1.0) < 3e-2);
        other = measure(&one, &both); /* the two sides change places */
        assert_true(fabs(fit.rms / other.rms - 1.0) < 1e-12);
        assert_true(fit.max == other.max && fit.p95 == other.p95);
        assert_true(other.diagonal < fit.diagonal);
        srnf_mesh_clear(&both);
        srnf_mesh_clear(&part);
        srnf_mesh_clear(&one);
    }
}

/* Crowding vertices in one place changes the count there, not the weight. */
static void test_density_does_not_matter(void **state)
{
    struct srnf_mesh even = meshes_sphere(40), uneven = meshes_sphere(40),
                     moved = meshes_sphere(40);
    struct srnf_fit fit, uneven_fit;
    (void)state;

    meshes_move(&moved, 0.1, 0, 0);
    for (size_t i = 0; i < uneven.n_vertices; i++) { /* drawn together towards +x */
        double *v = uneven.vertices + 3 * i, length;

        v[0] += 0.6;
        length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (size_t k = 0; k < 3; k++) {
            v[k] /= length;
        }
    }
    fit = measure(&even, &moved);
    uneven_fit = measure(&uneven, &moved);
    assert_true(fabs(uneven_fit.rms / fit.rms - 1.0) < 1e-2);
    assert_true(fabs(uneven_fit.p95 / fit.p95 - 1.0) < 1e-2);
    srnf_mesh_clear(&moved);
    srnf_mesh_clear(&uneven);
    srnf_mesh_clear(&even);
}

static void test_no_area(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(3), flat = meshes_sphere(3);
    struct srnf_index *index;
    struct srnf_fit fit;
    (void)state;

    meshes_stretch(&flat, 1, 0, 0);
    assert_int_equal(srnf_index_create(&index, &mesh), SRNF_OK);
    assert_int_equal(srnf_fit_measure(&mesh, index, &flat, NULL, &fit), SRNF_EDEGENERATE);
    srnf_index_destroy(index);
    srnf_mesh_clear(&flat);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_surface), cmocka_unit_test(test_concentric_spheres),
        cmocka_unit_test(test_missing_part), cmocka_unit_test(test_density_does_not_matter),
        cmocka_unit_test(test_no_area),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
