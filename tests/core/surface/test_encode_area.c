/*
 * test_encode_area.c - from meshes to surfaces by the route area: real meshes and made ones, with
 * no flip and as close as the method reached when it was found; the choice that auto makes; the
 * same surface in any pose and numbering; known bodies; threads and cancellation.
 *
 * srnfd-test: timeout 300
 * srnfd-test: slow
 * srnfd-test: release-only
 * Under the sanitizers test_encode_adversarial.c takes the same route, over worse meshes.
 */
#include "core/figures.h"
#include "sphere_map/sphere_map.h"
#include "support/bodies.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/parallel.h"
#include "support/triangulations.h"

#include <stdlib.h>

#define DEGREE 31
/* How the map is turned against the grid moves an error by a percent or so. */
#define TURN_OF_THE_GRID 1.02
#define AAL "tests/data/aal_subcortex"

static struct srnf_encode_options by_route(enum srnf_parameterization route)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    options.parameterization = route;
    return options;
}

static int encode(struct srnf_mesh *mesh, const struct srnf_encode_options *options,
                  const struct srnf_context *context, struct srnf_encoded *encoded)
{
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    assert_int_equal(report.n_problems, 0);
    return srnf_encode(mesh, &report, options, context, encoded, NULL);
}

/* ---- Real meshes, and such ------------------------------------------------------------------- */

/* Distance between points of equal parameter, rms over the sphere, relative to the diagonal: the
   mesh through the map against the surface, on a grid that the encoding did not use. */
static double parametric_error(const struct srnf_mesh *mesh, const struct srnf_encoded *encoded,
                               const struct srnf_sht *sht, void *workspace)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = grid->n_theta * grid->n_phi;
    double *truth = shapes_doubles(3 * points);
    double *values = shapes_doubles(3 * points);
    struct srnf_spherical_map map;
    double sum = 0.0;

    assert_int_equal(srnf_spherical_map(mesh, NULL, &map, NULL), SRNF_OK);
    assert_int_equal(spherical_sample(mesh, map.points, grid, NULL, truth), SRNF_OK);
    srnf_sht_synthesis(sht, 3, encoded->coefficients, values, workspace);
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < points; i++) {
            double d = encoded->scale * values[c * points + i] + encoded->origin[c] -
                       truth[c * points + i];

            sum += grid->weight[i / grid->n_phi] * d * d;
        }
    }
    srnf_free(map.points);
    srnf_free(values);
    srnf_free(truth);
    return sqrt(sum / 12.566370614359172954) / encoded->fit.diagonal;
}

/* What the method reached when it was found, in 1e-4 of the diagonal, rounded. */
struct expectation {
    const char *what; /* as in bodies_list */
    size_t made;
    double median, most;
};

static void check_meshes(const struct expectation *expected)
{
    static char *names[FOLDERS_FILES_MAX];
    static double errors[FOLDERS_FILES_MAX];
    struct srnf_encode_options options = by_route(SRNF_PARAMETERIZATION_AREA);
    size_t n = bodies_list(expected->what, expected->made, names);
    size_t stride = FIGURES_SLOW && n > 20 ? 20 : 1;
    size_t count = 0;
    struct srnf_sht *sht;
    double fit = 0.0;
    void *workspace;

    assert_true(n > 0);
    assert_int_equal(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 77, 0), SRNF_OK);
    workspace = srnf_alloc(srnf_sht_workspace_size(sht, 3), 1);
    for (size_t i = 0; i < n; i += stride) {
        struct srnf_mesh mesh;
        struct srnf_encoded encoded;

        assert_true(bodies_load(names[i], &mesh));
        assert_int_equal(encode(&mesh, &options, NULL, &encoded), SRNF_OK);
        assert_int_equal(encoded.route, SRNF_PARAMETERIZATION_AREA);
        assert_int_equal(encoded.distortion.flipped, 0);
        assert_true(encoded.distortion.symmetric_dirichlet >= 4.0 - 1e-6);
        assert_true(fabs(encoded.measures.area - 1.0) < 1e-9);
        assert_true(figure_norm(3, encoded.measures.centroid) < 1e-9);
        assert_true(encoded.measures.volume > 0.0);
        errors[count] = 1e4 * parametric_error(&mesh, &encoded, sht, workspace);
        fit = compare_max(fit, 1e4 * encoded.fit.rms / encoded.fit.diagonal);
        if (n <= 20) {
            printf("# %-20s E %.3f, sd %.3f; rms %.1f parametric, %.1f both ways\n",
                   folders_name(names[i]), encoded.distortion.symmetric_dirichlet,
                   encoded.distortion.log_area_deviation, errors[count],
                   1e4 * encoded.fit.rms / encoded.fit.diagonal);
        }
        count++;
        srnf_free(encoded.coefficients);
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < n; i++) {
        free(names[i]);
    }
    qsort(errors, count, sizeof *errors, compare_order);
    printf(
        "# %s: %zu meshes, no flips; rms in 1e-4 of the diagonal: parametric median %.1f (%.1f), "
        "at most %.1f (%.1f); both ways at most %.1f\n",
        expected->what, count, errors[count / 2], expected->median, errors[count - 1],
        expected->most, fit);
    assert_true(errors[count - 1] < expected->most + 0.5);
    assert_true(stride > 1 || errors[count / 2] < expected->median * TURN_OF_THE_GRID);
    assert_true(fit < 20.0);
    srnf_free(workspace);
    srnf_sht_destroy(sht);
}

static void brain_structures(void **state)
{
    const struct expectation expected = {AAL, 0, 7.1, 12.0};
    (void)state;

    check_meshes(&expected);
}

static void ventricles(void **state)
{
    const struct expectation expected = {"ventricle", 100, 3.9, 4.2};
    (void)state;

    check_meshes(&expected);
}

static void contracted_ventricles(void **state)
{
    const struct expectation expected = {"contracted", 20, 4.0, 4.3};
    (void)state;

    check_meshes(&expected);
}

static void small_bodies(void **state)
{
    const struct expectation expected = {"asteroid", BODIES_ASTEROIDS, 2.1, 4.3};
    (void)state;

    check_meshes(&expected);
}

/* ---- The choice ------------------------------------------------------------------------------ */

static void auto_is_area_whatever_the_mesh(void **state)
{
    static char *paths[FOLDERS_FILES_MAX];
    size_t n = folders_list(AAL, paths);
    size_t with_room = 0;
    (void)state;

    assert_int_equal(n, 12);
    for (size_t i = 0; i < n; i++) {
        struct srnf_mesh mesh;
        struct srnf_encoded encoded;

        assert_true(meshes_load(paths[i], &mesh));
        assert_int_equal(encode(&mesh, NULL, NULL, &encoded), SRNF_OK);
        printf("# %-18s %s: %s\n", folders_name(paths[i]),
               srnf_parameterization_name(encoded.route), encoded.reason);
        assert_int_equal(encoded.route, SRNF_PARAMETERIZATION_AREA);
        assert_int_equal(encoded.distortion.flipped, 0);
        assert_true(strlen(encoded.reason) > 10);
        assert_true(encoded.fit.rms < 2e-3 * encoded.fit.diagonal);
        with_room += encoded.star.value && encoded.star.margin > 0.02 * encoded.fit.diagonal;
        srnf_free(encoded.coefficients);
        srnf_mesh_clear(&mesh);
        free(paths[i]);
    }
    assert_int_equal(with_room, 5); /* some of them are star-shaped, well within */
}

static void options_decide(void **state)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    (void)state;

    assert_int_equal(srnf_encode_route(&options), SRNF_PARAMETERIZATION_AREA);
    options.center_given = true;
    assert_int_equal(srnf_encode_route(&options), SRNF_PARAMETERIZATION_STAR);
    options = by_route(SRNF_PARAMETERIZATION_STAR);
    assert_int_equal(srnf_encode_route(&options), SRNF_PARAMETERIZATION_STAR);
    options = by_route(SRNF_PARAMETERIZATION_GIVEN);
    assert_int_equal(srnf_encode_route(&options), SRNF_PARAMETERIZATION_GIVEN);
    assert_string_equal(srnf_parameterization_name(SRNF_PARAMETERIZATION_AUTO), "auto");
    assert_string_equal(srnf_parameterization_name(SRNF_PARAMETERIZATION_GIVEN), "given");
}

static void options_that_do_not_go_together(void **state)
{
    struct srnf_mesh mesh = meshes_star(8);
    struct srnf_encode_options options = by_route(SRNF_PARAMETERIZATION_AREA);
    struct srnf_encoded encoded;
    (void)state;

    options.center_given = true;
    assert_int_equal(encode(&mesh, &options, NULL, &encoded), SRNF_EINVAL);
    options.parameterization = SRNF_PARAMETERIZATION_AUTO;
    assert_int_equal(encode(&mesh, &options, NULL, &encoded), SRNF_OK);
    assert_int_equal(encoded.route, SRNF_PARAMETERIZATION_STAR);
    srnf_free(encoded.coefficients);
    options = by_route(SRNF_PARAMETERIZATION_GIVEN);
    assert_int_equal(encode(&mesh, &options, NULL, &encoded), SRNF_EINVAL);
    assert_null(encoded.coefficients);
    srnf_mesh_clear(&mesh);
}

/* ---- Known bodies ---------------------------------------------------------------------------- */

/* A bent capsule that no point sees whole: area and volume are those of the mesh. */
static void capsule_is_encoded(void **state)
{
    struct srnf_mesh mesh = meshes_bent_capsule(6.0, 0.4, 4.0, 120, 48);
    struct srnf_mesh_report report;
    struct srnf_encode_options options = by_route(SRNF_PARAMETERIZATION_AUTO);
    struct srnf_encoded encoded;
    double scale2;
    (void)state;

    options.degree = 47;
    assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
    assert_int_equal(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL), SRNF_OK);
    assert_int_equal(encoded.route, SRNF_PARAMETERIZATION_AREA);
    scale2 = encoded.scale * encoded.scale;
    printf("# %s; E %.2f; area off by %.1e, volume by %.1e; rms %.1e of the diagonal\n",
           encoded.reason, encoded.distortion.symmetric_dirichlet, fabs(scale2 / report.area - 1.0),
           fabs(scale2 * encoded.scale * encoded.measures.volume / report.volume - 1.0),
           encoded.fit.rms / encoded.fit.diagonal);
    assert_true(fabs(scale2 / report.area - 1.0) < 5e-3);
    assert_true(fabs(scale2 * encoded.scale * encoded.measures.volume / report.volume - 1.0) <
                5e-3);
    assert_true(encoded.fit.rms < 1e-3 * encoded.fit.diagonal);
    for (size_t c = 0; c < 3; c++) {
        assert_true(fabs(encoded.origin[c] - report.centroid[c]) < 1e-2);
    }
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
}

static void smoothing_rounds(void **state)
{
    const double sigmas[] = {0.0, 1e-3, 1e-2, 1e-1};
    struct srnf_mesh mesh;
    struct srnf_encode_options options = by_route(SRNF_PARAMETERIZATION_AREA);
    double fit = 0.0;
    double roundness = 0.0;
    (void)state;

    assert_true(meshes_load(AAL "/L_caudate.ply", &mesh));
    for (size_t k = 0; k < 4; k++) {
        struct srnf_encoded encoded;

        options.smoothing = sigmas[k];
        assert_int_equal(encode(&mesh, &options, NULL, &encoded), SRNF_OK);
        printf("# sigma %g: rms %.2e, volume at area 1 %.4f\n", sigmas[k],
               encoded.fit.rms / encoded.fit.diagonal, encoded.measures.volume);
        assert_true(encoded.fit.rms > fit);
        assert_true(encoded.measures.volume > roundness);
        fit = encoded.fit.rms;
        roundness = encoded.measures.volume;
        srnf_free(encoded.coefficients);
    }
    srnf_mesh_clear(&mesh);
}

/* ---- Pose ------------------------------------------------------------------------------------ */

/* L2 norm of a surface, the l = 0 terms apart. */
static double surface_norm(const double *f)
{
    double *zero = shapes_doubles(3 * srnf_coefficient_count(DEGREE));
    double norm = shapes_distance(DEGREE, f, zero);

    srnf_free(zero);
    return norm;
}

/* Turned, moved, scaled and numbered anew: the same surface in that pose, up to how far the map's
   relaxation settles. */
static void pose_and_numbering(void **state)
{
    static const char *const names[] = {"L_caudate", "L_hippocampus", "R_putamen", "L_amygdala"};
    struct test_random random = test_random_seed(5);
    struct srnf_encode_options options = by_route(SRNF_PARAMETERIZATION_AREA);
    (void)state;

    for (size_t k = 0; k < sizeof names / sizeof names[0]; k += FIGURES_SLOW ? 3 : 1) {
        char path[128];
        struct srnf_mesh mesh;
        struct srnf_mesh other;
        struct srnf_encoded still;
        struct srnf_encoded moved;
        double rotation[9];
        double back[9];
        double apart;

        (void)snprintf(path, sizeof path, "%s/%s.ply", AAL, names[k]);
        assert_true(meshes_load(path, &mesh));
        assert_int_equal(encode(&mesh, &options, NULL, &still), SRNF_OK);
        other = meshes_copy(&mesh);
        shapes_random_rotation(&random, rotation);
        for (size_t i = 0; i < other.n_vertices; i++) {
            shapes_rotate(rotation, 1, other.vertices + 3 * i);
        }
        meshes_scale(&other, 0.37);
        meshes_move(&other, 120.0, -55.0, 31.0);
        triangulations_renumber(&other, NULL, &random);
        assert_int_equal(encode(&other, &options, NULL, &moved), SRNF_OK);
        for (size_t i = 0; i < 9; i++) {
            back[i] = rotation[3 * (i % 3) + i / 3];
        }
        shapes_rotate(back, srnf_coefficient_count(DEGREE), moved.coefficients);
        apart = shapes_distance(DEGREE, still.coefficients, moved.coefficients) /
                surface_norm(still.coefficients);
        printf("# %-14s surfaces %.1e apart, scale off by %.1e, E by %.1e\n", names[k], apart,
               fabs(moved.scale / (0.37 * still.scale) - 1.0),
               fabs(moved.distortion.symmetric_dirichlet - still.distortion.symmetric_dirichlet));
        assert_true(apart < 0.02);
        assert_true(fabs(moved.scale / (0.37 * still.scale) - 1.0) < 1e-3);
        srnf_free(moved.coefficients);
        srnf_free(still.coefficients);
        srnf_mesh_clear(&other);
        srnf_mesh_clear(&mesh);
    }
}

/* ---- Context --------------------------------------------------------------------------------- */

/* Cancels from the n-th question on. */
static bool later(void *user)
{
    size_t *questions = user;

    return *questions == 0 || --*questions == 0;
}

static void same_result_on_any_threads(void **state)
{
    const struct srnf_context contexts[] = {{.parallel_for = parallel_backwards},
                                            {.parallel_for = parallel_threads}};
    struct srnf_mesh mesh;
    struct srnf_encoded alone;
    struct srnf_encoded encoded;
    (void)state;

    assert_true(meshes_load(AAL "/L_caudate.ply", &mesh));
    assert_int_equal(encode(&mesh, NULL, NULL, &alone), SRNF_OK);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(encode(&mesh, NULL, &contexts[k], &encoded), SRNF_OK);
        assert_memory_equal(encoded.coefficients, alone.coefficients,
                            3 * srnf_coefficient_count(DEGREE) * sizeof(double));
        assert_memory_equal(&encoded.fit, &alone.fit, sizeof alone.fit);
        assert_memory_equal(&encoded.distortion, &alone.distortion, sizeof alone.distortion);
        srnf_free(encoded.coefficients);
    }
    for (size_t n = 1; n <= 2; n++) {
        size_t questions = n;
        struct srnf_context context = {.user = &questions, .canceled = later};

        assert_int_equal(encode(&mesh, NULL, &context, &encoded), SRNF_ECANCELED);
        assert_null(encoded.coefficients);
    }
    srnf_free(alone.coefficients);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(brain_structures),
        cmocka_unit_test(ventricles),
        cmocka_unit_test(contracted_ventricles),
        cmocka_unit_test(small_bodies),
        cmocka_unit_test(auto_is_area_whatever_the_mesh),
        cmocka_unit_test(options_decide),
        cmocka_unit_test(options_that_do_not_go_together),
        cmocka_unit_test(capsule_is_encoded),
        cmocka_unit_test(smoothing_rounds),
        cmocka_unit_test(pose_and_numbering),
        cmocka_unit_test(same_result_on_any_threads),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
