/*
 * test_mean.c - the group mean: the midpoint of two, plain averages where nothing is registered;
 * with registration a fixed point that is centred, keeps the distances, and does not depend on
 * threads or on the start; cancellation and wrong arguments.
 *
 * srnfd-test: no-asan (api/test_landmarks_mean.sh and api/test_standard.sh run its code)
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE 9

static struct srnf_register_options quick(bool common_pose)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.degree = 4;
    options.start = SRNF_START_RIGID;
    options.common_pose = common_pose;
    return options;
}

/* ---- Nothing registered ---------------------------------------------------------------------- */

static void of_two_is_the_midpoint_of_their_geodesic(void **state)
{
    struct group g;
    struct srnf_geodesic_options options = srnf_geodesic_options_defaults();
    struct srnf_geodesic path;
    struct srnf_mean mean;
    double energy;

    (void)state;
    group_open_stars(&g, DEGREE, 2, 0.5);
    options.steps = 3;
    assert_int_equal(srnf_geodesic(g.sht, g.f[0], g.f[1], &options, NULL, &path, NULL), SRNF_OK);
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, NULL, NULL, &mean, NULL), SRNF_OK);
    energy = path.energy_geodesic[1] / srnf_inner_product(g.grid, mean.mean_q, mean.mean_q);
    printf("# relative energy: mean %.3e, geodesic %.3e\n", mean.relative_energy, energy);
    assert_true(fabs(mean.relative_energy - energy) <= 1e-2 * energy);
    figure_below("distance of the surfaces",
                 shapes_distance(DEGREE, mean.coefficients, path.coefficients + g.count), 1e-3);
    assert_true(fabs(mean.distances[0] / path.distance - 0.5) <= 1e-14);
    assert_true(fabs(mean.distances[1] / path.distance - 0.5) <= 1e-14);
    srnf_mean_clear(&mean);
    srnf_geodesic_clear(&path);
    group_close(&g);
}

static void of_one_is_itself(void **state)
{
    struct group g;
    struct srnf_mean mean;

    (void)state;
    group_open_stars(&g, DEGREE, 1, 0.5);
    for (size_t l = 0; l < 3; l++) { /* a translation does not change an SRNF */
        g.f[0][l * g.each] = 0.0;
    }
    assert_int_equal(srnf_karcher_mean(g.sht, 1, g.surfaces, NULL, NULL, &mean, NULL), SRNF_OK);
    assert_true(mean.converged && mean.iterations == 1 && mean.distances[0] == 0.0);
    figure_below("relative energy", mean.relative_energy, 1e-12);
    figure_below("distance", shapes_distance(DEGREE, mean.coefficients, g.f[0]), 1e-6);
    srnf_mean_clear(&mean);
    group_close(&g);
}

static void unregistered_is_the_average_of_the_fields(void **state)
{
    struct group g;
    struct srnf_mean mean;
    double sum = 0.0;
    double *q;
    void *workspace;

    (void)state;
    group_open_stars(&g, DEGREE, 5, 0.3);
    q = shapes_doubles(3 * g.points);
    workspace = shapes_doubles(srnf_surface_workspace_size(g.sht) / sizeof(double) + 1);
    assert_int_equal(srnf_karcher_mean(g.sht, 5, g.surfaces, NULL, NULL, &mean, NULL), SRNF_OK);
    assert_int_equal(mean.n, 5);
    for (size_t i = 0; i < 5; i++) {
        srnf_field(g.sht, g.f[i], q, workspace);
        assert_memory_equal(q, mean.registered_q + i * 3 * g.points, 3 * g.points * sizeof(double));
        assert_true(fabs(mean.distances[i] - sqrt(stats_distance2(g.grid, q, mean.mean_q))) <=
                    1e-15);
        sum += mean.distances[i] * mean.distances[i] / 5.0;
    }
    for (size_t i = 0; i < 5; i++) {
        for (size_t k = 0; k < 3 * g.points; k++) {
            mean.mean_q[k] -= mean.registered_q[i * 3 * g.points + k] / 5.0;
        }
    }
    assert_true(sqrt(srnf_inner_product(g.grid, mean.mean_q, mean.mean_q)) <= 1e-15);
    assert_true(fabs(sum / mean.history[0].variance - 1.0) <= 1e-13);
    srnf_mean_clear(&mean);
    srnf_free(workspace);
    srnf_free(q);
    group_close(&g);
}

/* ---- Registered ------------------------------------------------------------------------------ */

/* Registered fields are O sqrt(J) q o gamma: their norms are those of the surfaces; the mean is
   their average; the variance does not grow, and ends below that of the unregistered. */
static void registers_without_loss(void **state)
{
    struct group g;
    struct srnf_mean plain;
    struct srnf_mean mean;
    struct srnf_register_options registration = quick(true);
    struct srnf_mean_options options = srnf_mean_options_defaults();
    double worst = 0.0;
    double *average;

    (void)state;
    group_open_stars(&g, DEGREE, 5, 0.3);
    options.registration = &registration;
    assert_int_equal(srnf_karcher_mean(g.sht, 5, g.surfaces, NULL, NULL, &plain, NULL), SRNF_OK);
    assert_int_equal(srnf_karcher_mean(g.sht, 5, g.surfaces, &options, NULL, &mean, NULL), SRNF_OK);
    assert_true(mean.converged);
    for (size_t i = 0; i < 5; i++) {
        const double *a = plain.registered_q + i * 3 * g.points;
        const double *b = mean.registered_q + i * 3 * g.points;

        worst = compare_max(
            worst, fabs(srnf_inner_product(g.grid, b, b) / srnf_inner_product(g.grid, a, a) - 1.0));
    }
    figure_below("norms off their surfaces' (quadrature)", worst, 1e-3);
    average = shapes_doubles(3 * g.points);
    stats_average(g.grid, 5, mean.registered_q, average);
    assert_memory_equal(average, mean.mean_q, 3 * g.points * sizeof(double));
    for (size_t k = 0; k < mean.iterations; k++) {
        printf("# iteration %zu: change %.2e, variance %.6e\n", k + 1, mean.history[k].change,
               mean.history[k].variance);
    }
    printf("# variance unregistered %.6e; relative energy %.2e\n", plain.history[0].variance,
           mean.relative_energy);
    assert_true(mean.history[mean.iterations - 1].variance < 0.9 * plain.history[0].variance);
    srnf_free(average);
    srnf_mean_clear(&mean);
    srnf_mean_clear(&plain);
    group_close(&g);
}

/* The objective falls from each iteration to the next, for surfaces that are very different as for
   those that are close, and close ones settle within a few. */
static void lowers_its_objective(void **state)
{
    static const struct {
        double spread;
        bool common_pose;
    } cases[] = {{1.0, true}, {1.0, false}, {0.1, true}};

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        struct group g;
        struct srnf_mean mean;
        struct srnf_register_options registration = srnf_register_options_defaults();
        struct srnf_mean_options options = srnf_mean_options_defaults();

        group_open_stars(&g, 6, 3, cases[k].spread);
        registration.start = SRNF_START_RIGID;
        registration.common_pose = cases[k].common_pose;
        options.registration = &registration;
        options.max_iterations = 8;
        if (cases[k].spread == 1.0) {
            options.tolerance = 0.0;
        }
        assert_true(srnf_karcher_mean(g.sht, 3, g.surfaces, &options, NULL, &mean, NULL) >= 0);
        for (size_t i = 0; i < mean.iterations; i++) {
            printf("# spread %.1f, iteration %zu: change %.2e, objective %.8e\n", cases[k].spread,
                   i + 1, mean.history[i].change, mean.history[i].objective);
            assert_true(i == 0 || mean.history[i].objective <= mean.history[i - 1].objective);
        }
        assert_true(cases[k].spread == 1.0 ||
                    mean.history[mean.iterations - 1].change <= options.tolerance);
        srnf_mean_clear(&mean);
        group_close(&g);
    }
}

/* f <- f o R: exact, because rotations keep the degree. */
static void turn_domain(const struct group *g, const double rotation[9], double *f)
{
    double *nodes = shapes_doubles(3 * g->points);
    double *turned = shapes_doubles(3 * g->points);
    double *values = shapes_doubles(3 * g->points);
    void *workspace = shapes_doubles(srnf_sht_workspace_size(g->sht, 3) / sizeof(double) + 1);

    stats_nodes(g->grid, nodes);
    for (size_t k = 0; k < g->points; k++) {
        for (size_t c = 0; c < 3; c++) {
            turned[3 * k + c] = figure_dot(3, rotation + 3 * c, nodes + 3 * k);
        }
    }
    assert_int_equal(srnf_harmonics_at_points(g->degree, 3, f, g->points, turned, values, NULL),
                     SRNF_OK);
    srnf_sht_analysis(g->sht, 3, values, f, workspace);
    srnf_free(workspace);
    srnf_free(values);
    srnf_free(turned);
    srnf_free(nodes);
}

/* One surface in many poses, of its values and of its domain: the mean is that surface. */
static void of_one_shape_in_many_poses_is_that_shape(void **state)
{
    struct test_random random = test_random_seed(21);
    struct group g;
    struct srnf_mean mean;
    struct srnf_register_options registration = quick(false);
    struct srnf_mean_options options = srnf_mean_options_defaults();

    (void)state;
    group_open_stars(&g, DEGREE, 4, 0.0);
    for (size_t i = 1; i < 4; i++) {
        double rotation[9];

        shapes_random_rotation(&random, rotation);
        shapes_rotate(rotation, g.each, g.f[i]);
        shapes_random_rotation(&random, rotation);
        turn_domain(&g, rotation, g.f[i]);
    }
    options.registration = &registration;
    assert_int_equal(srnf_karcher_mean(g.sht, 4, g.surfaces, &options, NULL, &mean, NULL), SRNF_OK);
    for (size_t i = 0; i < 4; i++) {
        figure_below("distance to the mean", mean.distances[i], 1e-5);
    }
    figure_below("relative energy", mean.relative_energy, 1e-10);
    srnf_mean_clear(&mean);
    group_close(&g);
}

static double mean_distance(const struct group *g, const struct srnf_mean *a,
                            const struct srnf_mean *b)
{
    return stats_distance2(g->grid, a->mean_q, b->mean_q) /
           srnf_inner_product(g->grid, a->mean_q, a->mean_q);
}

/* Centring makes the mean forget its first template, but for the local minima that each subject is
   registered into. */
static void does_not_depend_on_the_start(void **state)
{
    struct group g;
    struct srnf_mean first;
    struct srnf_register_options registration = quick(true);
    struct srnf_mean_options options = srnf_mean_options_defaults();

    (void)state;
    group_open_stars(&g, DEGREE, 5, 0.3);
    options.registration = &registration;
    assert_int_equal(srnf_karcher_mean(g.sht, 5, g.surfaces, &options, NULL, &first, NULL),
                     SRNF_OK);
    for (size_t start = 0; start < 5; start += 2) {
        struct srnf_mean other;
        double variance;

        assert_int_equal(stats_mean(g.sht, 5, g.surfaces, &options, start, NULL, &other, NULL),
                         SRNF_OK);
        variance = other.history[other.iterations - 1].variance;
        printf("# start %zu: %zu iterations, variance %.4e\n", start, other.iterations, variance);
        figure_below("squared distance of the means", mean_distance(&g, &first, &other), 9e-5);
        assert_true(fabs(variance / first.history[first.iterations - 1].variance - 1.0) <= 0.02);
        srnf_mean_clear(&other);
    }
    srnf_mean_clear(&first);
    group_close(&g);
}

static void does_not_depend_on_threads(void **state)
{
    (void)state;
    for (size_t pose = 0; pose < 3; pose++) {
        struct group g;
        struct srnf_register_options registration = quick(pose == 1);
        struct srnf_mean_options options = srnf_mean_options_defaults();
        struct srnf_mean first = {0};

        group_open_stars(&g, DEGREE, 5, 0.3);
        options.registration = pose == 2 ? NULL : &registration;
        options.max_iterations = 3;
        options.tolerance = 0.0;
        for (size_t s = 0; s < GROUP_SPREADS; s++) {
            struct group_watch watch;
            struct srnf_context context = group_context(&watch, group_threads[s]);
            struct srnf_mean mean;

            assert_true(srnf_karcher_mean(g.sht, 5, g.surfaces, &options, &context, &mean, NULL) >=
                        0);
            assert_true(pose == 2 || atomic_load(&watch.reports) > 3 * 5);
            if (s == 0) {
                first = mean;
                continue;
            }
            assert_int_equal(mean.iterations, first.iterations);
            assert_memory_equal(mean.mean_q, first.mean_q, 3 * g.points * sizeof(double));
            assert_memory_equal(mean.registered_q, first.registered_q,
                                5 * 3 * g.points * sizeof(double));
            assert_memory_equal(mean.coefficients, first.coefficients, g.count * sizeof(double));
            assert_memory_equal(mean.distances, first.distances, 5 * sizeof(double));
            srnf_mean_clear(&mean);
        }
        srnf_mean_clear(&first);
        group_close(&g);
    }
}

/* Tools that are made anew for each use make no difference, and neither does the size of a batch of
   subjects. */
static void does_not_depend_on_what_it_keeps(void **state)
{
    /* all; tools of 194 kB each without what was evaluated; nothing */
    static const size_t keep_bytes[] = {SIZE_MAX, 4 * 214000, 0};
    struct group g;
    struct srnf_register_options registration = quick(false);
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean[3];

    (void)state;
    group_open_stars(&g, DEGREE, 4, 0.3);
    options.registration = &registration;
    options.tolerance = 0.0;
    options.max_iterations = 4;
    for (size_t k = 0; k < 3; k++) {
        options.keep_bytes = keep_bytes[k];
        assert_int_equal(srnf_karcher_mean(g.sht, 4, g.surfaces, &options, NULL, &mean[k], NULL),
                         SRNF_WNOT_CONVERGED);
    }
    for (size_t k = 1; k < 3; k++) {
        assert_memory_equal(mean[0].history, mean[k].history, 4 * sizeof *mean[0].history);
        assert_memory_equal(mean[0].registered_q, mean[k].registered_q,
                            4 * 3 * g.points * sizeof(double));
        assert_memory_equal(mean[0].coefficients, mean[k].coefficients, g.count * sizeof(double));
    }
    for (size_t k = 0; k < 3; k++) {
        srnf_mean_clear(&mean[k]);
    }
    group_close(&g);
}

/* The variance, which is found without a second look at the fields, is that of the fields. */
static void tells_the_variance_of_its_fields(void **state)
{
    struct group g;
    struct srnf_register_options registration = quick(false);
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    double sum = 0.0;

    (void)state;
    group_open_stars(&g, DEGREE, 5, 0.3);
    options.registration = &registration;
    assert_true(srnf_karcher_mean(g.sht, 5, g.surfaces, &options, NULL, &mean, NULL) >= 0);
    for (size_t i = 0; i < 5; i++) {
        sum += mean.distances[i] * mean.distances[i] / 5.0;
    }
    /* on another grid, and without tables */
    figure_below("variance off that of what is handed over",
                 fabs(mean.history[mean.iterations - 1].variance / sum - 1.0), 2e-3);
    srnf_mean_clear(&mean);
    group_close(&g);
}

/* ---- Contract -------------------------------------------------------------------------------- */

static void says_when_it_has_not_converged(void **state)
{
    struct group g;
    struct srnf_mean mean;
    struct srnf_register_options registration = quick(true);
    struct srnf_mean_options options = srnf_mean_options_defaults();

    (void)state;
    group_open_stars(&g, DEGREE, 3, 0.3);
    options.registration = &registration;
    options.max_iterations = 1;
    assert_int_equal(srnf_karcher_mean(g.sht, 3, g.surfaces, &options, NULL, &mean, NULL),
                     SRNF_WNOT_CONVERGED);
    assert_false(mean.converged);
    assert_int_equal(mean.iterations, 1);
    assert_non_null(mean.coefficients);
    srnf_mean_clear(&mean);
    group_close(&g);
}

static void can_be_canceled(void **state)
{
    struct group g;
    struct srnf_register_options registration = quick(true);
    struct srnf_mean_options options = srnf_mean_options_defaults();

    (void)state;
    group_open_stars(&g, DEGREE, 3, 0.3);
    options.registration = &registration;
    for (size_t after = 0; after < 16; after += 3) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 2);
        struct srnf_mean mean;
        struct srnf_error error = {0};

        watch.cancel_after = after;
        assert_int_equal(srnf_karcher_mean(g.sht, 3, g.surfaces, &options, &context, &mean, &error),
                         SRNF_ECANCELED);
        assert_int_equal(error.status, SRNF_ECANCELED);
        assert_null(mean.mean_q);
    }
    group_close(&g);
}

static void refuses_what_it_cannot_take(void **state)
{
    struct group g;
    struct srnf_register_options registration = quick(true);
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_error error = {0};
    struct srnf_mean mean;

    (void)state;
    group_open_stars(&g, DEGREE, 2, 0.3);
    assert_int_equal(srnf_karcher_mean(g.sht, 0, g.surfaces, NULL, NULL, &mean, &error),
                     SRNF_EINVAL);
    options.max_iterations = 0;
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    options.max_iterations = 2;
    options.tolerance = NAN;
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    options.tolerance = 1e-3;
    registration.degree = 1000;
    options.registration = &registration;
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "degree 1000"));
    registration = quick(true);
    registration.representation = SRNF_REPRESENTATION_SRM;
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "representation"));
    registration = quick(true);
    memset(g.f[1], 0, g.count * sizeof(double));
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "surface 1 is zero"));
    options.registration = NULL;
    g.f[1][5] = INFINITY;
    assert_int_equal(srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_int_equal(error.element, 1);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_two_is_the_midpoint_of_their_geodesic),
        cmocka_unit_test(of_one_is_itself),
        cmocka_unit_test(unregistered_is_the_average_of_the_fields),
        cmocka_unit_test(registers_without_loss),
        cmocka_unit_test(lowers_its_objective),
        cmocka_unit_test(of_one_shape_in_many_poses_is_that_shape),
        cmocka_unit_test(does_not_depend_on_the_start),
        cmocka_unit_test(does_not_depend_on_threads),
        cmocka_unit_test(does_not_depend_on_what_it_keeps),
        cmocka_unit_test(tells_the_variance_of_its_fields),
        cmocka_unit_test(says_when_it_has_not_converged),
        cmocka_unit_test(can_be_canceled),
        cmocka_unit_test(refuses_what_it_cannot_take),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
