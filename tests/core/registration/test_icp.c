/*
 * test_icp.c - rigid alignment by closest points: poses that are known come back, the residual
 * counts both ways and never exceeds that of the pose at hand, and wrong meshes are refused.
 */
#include "core/figures.h"
#include "support/meshes.h"

static double distance(const struct srnf_mesh *a, const struct srnf_mesh *b,
                       const struct srnf_icp_options *options)
{
    struct srnf_icp result;

    assert_int_equal(srnf_icp(a, b, options, NULL, &result, NULL), SRNF_OK);
    return result.distance;
}

/* The same mesh in another pose is laid on itself, vertex by vertex. */
static void poses_come_back(void **state)
{
    struct srnf_mesh fixed = meshes_star(6);
    double worst = 0.0;

    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        struct srnf_mesh moving = meshes_copy(&fixed);
        struct srnf_icp_options options = srnf_icp_options_defaults();
        struct srnf_icp r;

        meshes_turn(&moving, seed);
        meshes_move(&moving, 3.0, -1.0, 0.5 * (double)seed);
        options.tolerance = 1e-9;
        assert_int_equal(srnf_icp(&fixed, &moving, &options, NULL, &r, NULL), SRNF_OK);
        assert_true(r.converged);
        worst = compare_max(worst, r.distance);
        for (size_t i = 0; i < fixed.n_vertices; i++) {
            for (size_t k = 0; k < 3; k++) {
                const double *x = moving.vertices + 3 * i;
                double laid = r.rotation[3 * k] * x[0] + r.rotation[3 * k + 1] * x[1] +
                              r.rotation[3 * k + 2] * x[2] + r.translation[k];

                worst = compare_max(worst, fabs(laid - fixed.vertices[3 * i + k]));
            }
        }
        srnf_mesh_clear(&moving);
    }
    figure_below("distance of vertices from where they belong", worst, 1e-6);
    srnf_mesh_clear(&fixed);
}

static void the_distance_is_symmetric_and_rigidly_invariant(void **state)
{
    struct srnf_mesh a = meshes_star(6);
    struct srnf_mesh b = meshes_bumpy(6, 4);
    struct srnf_icp_options options = srnf_icp_options_defaults();
    double here;
    double worst;

    (void)state;
    options.tolerance = 1e-7;
    options.max_iterations = 2000;
    here = distance(&a, &b, &options);
    assert_true(here > 1e-3);
    worst = fabs(distance(&b, &a, &options) - here);
    meshes_turn(&b, 9);
    meshes_move(&b, -20.0, 4.0, 1.0);
    worst = compare_max(worst, fabs(distance(&a, &b, &options) - here));
    figure_below("relative change", worst / here, 1e-3);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

/* Two concentric spheres of n = 20 f^2 faces: the gap between them, up to the facets. */
static void the_gap_of_spheres(void **state)
{
    struct srnf_mesh a = meshes_sphere(12);
    struct srnf_mesh b = meshes_sphere(12);
    struct srnf_icp_options still = srnf_icp_options_defaults();

    (void)state;
    still.max_iterations = 0;
    meshes_scale(&b, 1.25);
    assert_true(fabs(distance(&a, &b, &still) - 0.25) <= 5e-3);
    meshes_move(&b, 0.5, 0.0, 0.0);
    assert_true(distance(&a, &b, &still) > 0.3);
    assert_true(fabs(distance(&a, &b, NULL) - 0.25) <= 1e-2);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

static void more_iterations_are_never_worse(void **state)
{
    struct srnf_mesh a = meshes_star(5);
    struct srnf_mesh b = meshes_bumpy(5, 7);
    struct srnf_icp_options options = srnf_icp_options_defaults();
    double before;

    (void)state;
    options.max_iterations = 0;
    options.tolerance = 0.0;
    meshes_turn(&b, 3);
    before = distance(&a, &b, &options);
    for (options.max_iterations = 3; options.max_iterations <= 48; options.max_iterations *= 2) {
        double now = distance(&a, &b, &options);

        assert_true(now <= before * (1.0 + 1e-12));
        before = now;
    }
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

static bool always(void *user)
{
    (void)user;
    return true;
}

static void wrong_meshes_are_refused(void **state)
{
    struct srnf_mesh a = meshes_star(3);
    struct srnf_mesh b = meshes_star(3);
    struct srnf_icp_options options = srnf_icp_options_defaults();
    struct srnf_context context = {.canceled = always};
    struct srnf_error error = {0};
    struct srnf_icp r;
    uint32_t kept = b.faces[4];

    (void)state;
    assert_int_equal(srnf_icp(&a, &b, NULL, &context, &r, &error), SRNF_ECANCELED);
    b.faces[4] = (uint32_t)b.n_vertices;
    assert_int_equal(srnf_icp(&a, &b, NULL, NULL, &r, &error), SRNF_EINVAL);
    assert_int_equal(error.element, 1);
    assert_non_null(strstr(error.message, "moving"));
    b.faces[4] = kept;
    a.vertices[7] = NAN;
    assert_int_equal(srnf_icp(&a, &b, NULL, NULL, &r, &error), SRNF_EINVAL);
    assert_int_equal(error.element, 2);
    assert_non_null(strstr(error.message, "fixed"));
    a.vertices[7] = 0.0;
    options.tolerance = NAN;
    assert_int_equal(srnf_icp(&a, &b, &options, NULL, &r, &error), SRNF_EINVAL);
    meshes_scale(&b, 0.0);
    assert_int_equal(srnf_icp(&a, &b, NULL, NULL, &r, &error), SRNF_EDEGENERATE);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(poses_come_back),
        cmocka_unit_test(the_distance_is_symmetric_and_rigidly_invariant),
        cmocka_unit_test(the_gap_of_spheres),
        cmocka_unit_test(more_iterations_are_never_worse),
        cmocka_unit_test(wrong_meshes_are_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
