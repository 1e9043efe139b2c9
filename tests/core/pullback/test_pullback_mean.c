/*
 * test_pullback_mean.c - Karcher means of the pulled-back metric: the midpoint of two, the average
 * of copies, stationary, the same in any order and on any number of threads; the paper's steps
 * come to the same, or say that they do not; cancellation and wrong arguments.
 */
#include "pullbacks.h"

#include <fftw3.h>

#define DEGREE 8

static struct srnf_pullback_mean mean_of(const struct group *g,
                                         const struct srnf_pullback_mean_options *options)
{
    struct srnf_pullback_mean mean;

    assert_int_equal(srnf_pullback_mean(g->sht, g->n, g->surfaces, options, NULL, &mean, NULL),
                     SRNF_OK);
    assert_true(mean.converged && mean.n == g->n);
    return mean;
}

/* A star of two chains of m segments is a chain of 2 m. */
static void mean_of_two_is_the_midpoint(void **state)
{
    struct srnf_pullback_mean_options options =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    struct srnf_pullback_options path_options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic path;
    struct srnf_pullback_mean mean;
    struct group g;
    (void)state;

    group_open_stars(&g, DEGREE, 2, 1.0);
    options.segments = 4;
    options.tolerance = 1e-11;
    mean = mean_of(&g, &options);
    path_options.segments = 8;
    path_options.gradient = 1e-9;
    path_options.compare = false;
    assert_int_equal(
        srnf_pullback_geodesic(g.sht, g.f[0], g.f[1], &path_options, NULL, &path, NULL), SRNF_OK);
    figure_below("mean of two to midpoint",
                 shapes_distance(DEGREE, mean.coefficients, path.coefficients + 4 * g.count), 1e-5);
    figure_below("half the way", fabs(mean.distances[0] / (0.5 * path.path.length) - 1.0), 1e-5);
    figure_below("variance", fabs(mean.variance / (0.25 * path.path.energy) - 1.0), 1e-8);
    srnf_pullback_geodesic_clear(&path);
    srnf_pullback_mean_clear(&mean);
    group_close(&g);
}

/* c_i f lie on one straight line of Q. */
static void averages_copies(void **state)
{
    struct srnf_pullback_mean mean;
    struct group g;
    double worst = 0.0;
    (void)state;

    group_open_stars(&g, DEGREE, 3, 0.3);
    for (size_t i = 0; i < g.count; i++) {
        g.f[1][i] = 1.5 * g.f[0][i];
        g.f[2][i] = 3.5 * g.f[0][i];
    }
    g.f[2][0] += 3.0;
    mean = mean_of(&g, NULL);
    for (size_t i = 0; i < g.count; i++) {
        double truth = (g.f[0][i] + g.f[1][i] + g.f[2][i]) / 3.0;

        worst = compare_max(worst, fabs(mean.coefficients[i] - truth));
    }
    figure_below("mean of copies", worst, 1e-6);
    figure_below("its distances", fabs(mean.distances[2] - 1.5), 1e-6); /* unit area: ||q|| = 1 */
    srnf_pullback_mean_clear(&mean);
    memcpy(g.f[1], g.f[0], g.count * sizeof(double));
    memcpy(g.f[2], g.f[0], g.count * sizeof(double));
    mean = mean_of(&g, NULL);
    figure_below("mean of equals", compare_difference(g.count, mean.coefficients, g.f[0]), 1e-6);
    srnf_pullback_mean_clear(&mean);
    g.n = 1;
    mean = mean_of(&g, NULL);
    figure_below("mean of one", compare_difference(g.count, mean.coefficients, g.f[0]), 1e-6);
    srnf_pullback_mean_clear(&mean);
    g.n = 3;
    group_close(&g);
}

/* Nothing near has less variance; in any order of the surfaces. */
static void is_stationary_in_any_order(void **state)
{
    struct srnf_pullback_mean_options options =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    struct srnf_pullback_options path_options = srnf_pullback_options_defaults();
    struct srnf_pullback_mean mean;
    struct srnf_pullback_mean other;
    struct group g;
    double extrinsic = 0.0;
    (void)state;

    group_open_stars(&g, DEGREE, 5, 1.0);
    options.segments = 4;
    mean = mean_of(&g, &options);
    printf("# variance %.6f, mean velocity %.1e, moved %.1e, %zu steps, %.0f U\n", mean.variance,
           mean.mean_velocity, mean.moved, mean.iterations, mean.transforms);
    figure_below("mean velocity", mean.mean_velocity / sqrt(mean.variance), 1e-3);
    path_options.segments = 4;
    path_options.compare = false;
    for (size_t i = 0; i < g.n; i++) {
        struct srnf_pullback_geodesic path;

        assert_int_equal(
            srnf_pullback_geodesic(g.sht, mean.extrinsic, g.f[i], &path_options, NULL, &path, NULL),
            SRNF_OK);
        extrinsic += path.path.length * path.path.length / (double)g.n;
        srnf_pullback_geodesic_clear(&path);
    }
    printf("# variance about the extrinsic mean: %.6f\n", extrinsic);
    assert_true(mean.variance < extrinsic && extrinsic < 1.05 * mean.variance);
    for (size_t i = 0; i < 2; i++) {
        const double *swap = g.surfaces[i];

        g.surfaces[i] = g.surfaces[4 - i];
        g.surfaces[4 - i] = swap;
    }
    other = mean_of(&g, &options);
    figure_below("order of the surfaces",
                 shapes_distance(DEGREE, mean.coefficients, other.coefficients), 1e-4);
    for (size_t i = 0; i < 5; i++) {
        assert_true(fabs(mean.distances[i] / other.distances[4 - i] - 1.0) < 1e-3);
    }
    srnf_pullback_mean_clear(&other);
    srnf_pullback_mean_clear(&mean);
    group_close(&g);
}

/* The paper's iteration ends near the minimum of the graph, off by the error of its logarithms. */
static void steps_come_near(void **state)
{
    struct srnf_pullback_mean_options options =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_LOG_EXP);
    struct srnf_pullback_mean graph;
    struct srnf_pullback_mean steps;
    struct group g;
    (void)state;

    group_open_stars(&g, 6, 3, 0.6);
    options.segments = 4;
    steps = mean_of(&g, &options);
    assert_non_null(steps.history);
    assert_true(steps.history[steps.iterations - 1] == steps.mean_velocity);
    assert_true(steps.iterations > 1 && steps.mean_velocity < 0.5 * steps.history[0]);
    assert_true(steps.mean_velocity <= 1e-3 * sqrt(steps.variance));
    graph =
        mean_of(&g, &(struct srnf_pullback_mean_options){SRNF_PULLBACK_MEAN_GRAPH, 4, 1e-7, 100});
    assert_null(graph.history);
    printf("# log-exp: %zu steps, mean velocity %.1e, %.0f U; graph: %zu steps, %.1e, %.0f U\n",
           steps.iterations, steps.mean_velocity, steps.transforms, graph.iterations,
           graph.mean_velocity, graph.transforms);
    figure_below("the two apart, of the root of the variance",
                 shapes_distance(6, steps.coefficients, graph.coefficients) / sqrt(graph.variance),
                 0.1);
    figure_below("their variances", fabs(steps.variance / graph.variance - 1.0), 1e-2);
    srnf_pullback_mean_clear(&graph);
    srnf_pullback_mean_clear(&steps);

    options = srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    options.segments = 4;
    options.max_iterations = 1;
    assert_int_equal(srnf_pullback_mean(g.sht, g.n, g.surfaces, &options, NULL, &graph, NULL),
                     SRNF_WNOT_CONVERGED);
    assert_true(!graph.converged && graph.iterations == 1);
    srnf_pullback_mean_clear(&graph);

    options = srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_LOG_EXP);
    options.segments = 4;
    options.tolerance = 0.0; /* which rounding keeps it from: it must say so */
    options.max_iterations = 12;
    assert_int_equal(srnf_pullback_mean(g.sht, g.n, g.surfaces, &options, NULL, &steps, NULL),
                     SRNF_WNOT_CONVERGED);
    printf("# tolerance 0: %zu steps, mean velocity %.1e, stalled %d\n", steps.iterations,
           steps.mean_velocity, steps.stalled);
    assert_true(!steps.converged && (steps.stalled || steps.iterations == 12));
    srnf_pullback_mean_clear(&steps);
    group_close(&g);
}

static void bits_do_not_depend_on_threads(void **state)
{
    struct srnf_pullback_mean first = {0};
    struct group g;
    (void)state;

    group_open_stars(&g, 5, 3, 0.5);
    for (size_t k = 0; k < GROUP_SPREADS; k++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[k]);
        struct srnf_pullback_mean mean;

        assert_int_equal(srnf_pullback_mean(g.sht, g.n, g.surfaces, NULL, &context, &mean, NULL),
                         SRNF_OK);
        assert_true(atomic_load(&watch.bodies) > 0 && atomic_load(&watch.highest) <= 1.0);
        if (k == 0) {
            first = mean;
            continue;
        }
        assert_memory_equal(first.coefficients, mean.coefficients, 2 * g.count * sizeof(double));
        assert_memory_equal(first.distances, mean.distances, g.n * sizeof(double));
        assert_true(first.mean_velocity == mean.mean_velocity);
        srnf_pullback_mean_clear(&mean);
    }
    srnf_pullback_mean_clear(&first);
    group_close(&g);
}

struct pullback_run {
    const struct group *g;
    struct srnf_pullback_mean_options options;
};

static int run_mean(void *argument, const struct srnf_context *context)
{
    const struct pullback_run *run = argument;
    struct srnf_pullback_mean mean;
    struct srnf_error error = {0};
    int status = srnf_pullback_mean(run->g->sht, run->g->n, run->g->surfaces, &run->options,
                                    context, &mean, &error);

    if (status < 0) {
        assert_int_equal(error.status, status);
        assert_null(mean.coefficients);
        assert_null(mean.history);
    }
    srnf_pullback_mean_clear(&mean);
    return status;
}

static void cancels(void **state)
{
    struct pullback_run run;
    struct group g;
    (void)state;

    group_open_stars(&g, 5, 3, 0.5);
    run = (struct pullback_run){&g, srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH)};
    run.options.segments = 3;
    pullback_check_cancellation(run_mean, &run);
    run.options = srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_LOG_EXP);
    run.options.segments = 3;
    run.options.max_iterations = 2;
    pullback_check_cancellation(run_mean, &run);
    group_close(&g);
}

static void expect_refusal(const struct group *g, const struct srnf_pullback_mean_options *options,
                           const char *what)
{
    struct srnf_error error = {0};
    struct srnf_pullback_mean mean;

    assert_int_equal(srnf_pullback_mean(g->sht, g->n, g->surfaces, options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, what));
    assert_null(mean.coefficients);
}

static void refuses_wrong_arguments(void **state)
{
    const struct srnf_pullback_mean_options good =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    struct srnf_pullback_mean_options options = good;
    struct group g;
    (void)state;

    group_open_stars(&g, 5, 2, 0.5);
    options.segments = 1;
    expect_refusal(&g, &options, "segments");
    options = good;
    options.tolerance = NAN;
    expect_refusal(&g, &options, "tolerance");
    options = good;
    options.max_iterations = 0;
    expect_refusal(&g, &options, "max_iterations");
    options = good;
    options.method = (enum srnf_pullback_mean_method)7;
    expect_refusal(&g, &options, "method");
    g.n = 0;
    expect_refusal(&g, NULL, "no surface");
    g.n = 2;
    g.f[1][4] = INFINITY;
    expect_refusal(&g, NULL, "surface 1");
    for (size_t i = 0; i < g.count; i++) { /* points: their average is no surface */
        g.f[0][i] = g.f[1][i] = 0.0;
    }
    expect_refusal(&g, NULL, "zero");
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_of_two_is_the_midpoint),   cmocka_unit_test(averages_copies),
        cmocka_unit_test(is_stationary_in_any_order),    cmocka_unit_test(steps_come_near),
        cmocka_unit_test(bits_do_not_depend_on_threads), cmocka_unit_test(cancels),
        cmocka_unit_test(refuses_wrong_arguments),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
