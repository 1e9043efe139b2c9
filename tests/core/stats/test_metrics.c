/*
 * test_metrics.c - distances by the other metrics: what each must not see (pose, and for some the
 * turn of the domain), what it must, symmetry, threads, and wrong arguments.
 *
 * srnfd-test: no-asan (api/test_standard.sh and server/tasks/test_pairs.c run its code)
 */
#include "core/registration/registrations.h"
#include "group.h"

#include <fftw3.h>

#define DEGREE 9
#define N ((size_t)4)

static struct srnf_register_options options;

static void measure(const struct group *g, enum srnf_metric metric, double *matrix)
{
    struct srnf_error error = {0};

    if (srnf_metric_distances(g->sht, metric, g->n, g->surfaces, &options, NULL, matrix, &error)) {
        fail_msg("%s: %s", srnf_metric_name(metric), error.message);
    }
}

/* Surface i moved to surface 1: values turned and moved, and the domain turned if asked for. */
static void turn(struct group *g, bool domain, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    struct shapes_surface s = {.sht = g->sht,
                               .grid = g->grid,
                               .degree = g->degree,
                               .points = g->points,
                               .each = g->each,
                               .count = g->count,
                               .f = g->f[0]};
    struct srnf_warp warp;
    double rotation[9];

    s.workspace = shapes_doubles(srnf_surface_workspace_size(g->sht) / sizeof(double) + 1);
    registrations_warp(domain ? &random : NULL, 1.0, &warp);
    shapes_random_rotation(&random, rotation);
    registrations_resample(&s, &warp, rotation, g->f[1]);
    for (size_t c = 0; c < 3; c++) {
        g->f[1][c * g->each] += 0.7 - (double)c;
    }
    srnf_warp_clear(&warp);
    srnf_free(s.workspace);
}

static void poses_are_not_seen(void **state)
{
    static const struct {
        enum srnf_metric metric;
        bool domain; /* nor turns of the domain */
        double limit;
    } cases[] = {{SRNF_METRIC_HARMONIC, false, 1e-7}, /* the root of a difference at rounding */
                 {SRNF_METRIC_SPHARM, true, 1e-12},
                 {SRNF_METRIC_ICP, false, 1e-3},
                 {SRNF_METRIC_SRM, true, 1e-5}};
    struct group g;
    double matrix[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        turn(&g, cases[k].domain, 30 + k);
        measure(&g, cases[k].metric, matrix);
        printf("# %s: other shapes are at %.2e and more\n", srnf_metric_name(cases[k].metric),
               compare_min(matrix[2], matrix[3]));
        figure_below(srnf_metric_name(cases[k].metric), matrix[1], cases[k].limit);
        assert_true(matrix[2] > 20.0 * matrix[1] && matrix[3] > 20.0 * matrix[1]);
        for (size_t i = 0; i < N * N; i++) {
            assert_true(matrix[i] == matrix[i % N * N + i / N]);
            assert_true(i % (N + 1) != 0 || matrix[i] == 0.0);
        }
        /* Neither is the moved copy of a surface nearer or farther to a third one. */
        assert_true(fabs(matrix[2] - matrix[N + 2]) <= 2e-2 * matrix[2]);
    }
    group_close(&g);
}

/* The fixed parameterization is what harmonic stands on: a turn of the domain is a distance. */
static void harmonic_sees_the_parameterization(void **state)
{
    struct group g;
    double matrix[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    turn(&g, true, 3);
    measure(&g, SRNF_METRIC_HARMONIC, matrix);
    assert_true(matrix[1] > 0.1);
    group_close(&g);
}

/* No registration: L2 of the surfaces as they stand, translations apart; and a turned copy is at a
   distance by every metric that is not blind to pose by nature. */
static void nothing_is_turned_without_registration(void **state)
{
    struct group g;
    double matrix[N * N];
    double other[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    turn(&g, false, 4);
    assert_int_equal(
        srnf_metric_distances(g.sht, SRNF_METRIC_HARMONIC, N, g.surfaces, NULL, NULL, matrix, NULL),
        SRNF_OK);
    assert_int_equal(
        srnf_metric_distances(g.sht, SRNF_METRIC_SPHARM, N, g.surfaces, NULL, NULL, other, NULL),
        SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < N; j++) {
            double wanted = shapes_distance(DEGREE, g.f[i], g.f[j]);

            assert_true(fabs(matrix[i * N + j] - wanted) <= 1e-12);
            assert_true(fabs(other[i * N + j] - wanted) <= 1e-12);
        }
    }
    for (size_t m = 0; m <= SRNF_METRIC_SPHARM; m++) {
        assert_int_equal(srnf_metric_distances(g.sht, (enum srnf_metric)m, N, g.surfaces, NULL,
                                               NULL, matrix, NULL),
                         SRNF_OK);
        assert_true(matrix[1] > 0.05);
    }
    group_close(&g);
}

static void threads_do_not_matter(void **state)
{
    struct group g;
    double first[N * N];
    double matrix[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    for (size_t m = SRNF_METRIC_HARMONIC; m <= SRNF_METRIC_SPHARM; m++) {
        measure(&g, (enum srnf_metric)m, first);
        for (size_t t = 0; t < GROUP_SPREADS; t++) {
            struct group_watch watch;
            struct srnf_context context = group_context(&watch, group_threads[t]);

            assert_int_equal(srnf_metric_distances(g.sht, (enum srnf_metric)m, N, g.surfaces,
                                                   &options, &context, matrix, NULL),
                             SRNF_OK);
            assert_memory_equal(matrix, first, sizeof first);
            watch.cancel_after = 0;
            assert_int_equal(srnf_metric_distances(g.sht, (enum srnf_metric)m, N, g.surfaces,
                                                   &options, &context, matrix, NULL),
                             SRNF_ECANCELED);
        }
    }
    group_close(&g);
}

/* e -> U' f(V e) has its ellipsoid on the axes, longest first, and doing it twice changes no more
   than signs. */
static void ellipsoids_lie_on_the_axes(void **state)
{
    struct group g;
    double *aligned;
    double worst = 0.0;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    aligned = shapes_doubles(2 * g.count);
    for (size_t i = 0; i < N; i++) {
        /* coefficients of y, z, x stand at 1, 2, 3 */
        static const size_t axis[3] = {3, 1, 2};
        double before = INFINITY;

        assert_int_equal(srnf_align_ellipsoid(g.sht, g.f[i], aligned), SRNF_OK);
        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < 3; k++) {
                double x = fabs(aligned[c * g.each + axis[k]]);

                if (k == c) {
                    assert_true(x <= before * (1.0 + 1e-12));
                    before = x;
                } else {
                    worst = compare_max(worst, x);
                }
            }
        }
        assert_int_equal(srnf_align_ellipsoid(g.sht, aligned, aligned + g.count), SRNF_OK);
        for (size_t k = 0; k < g.count; k++) {
            worst = compare_max(worst, fabs(fabs(aligned[k]) - fabs(aligned[g.count + k])));
        }
    }
    figure_below("off the axes", worst, 1e-12);
    srnf_free(aligned);
    group_close(&g);
}

static void normalized_surfaces(void **state)
{
    struct group g;
    double *out;
    double *again;
    double log_scale;

    (void)state;
    group_open_stars(&g, DEGREE, 2, 0.5);
    out = shapes_doubles(g.count);
    again = shapes_doubles(g.count);
    assert_int_equal(srnf_normalize(g.sht, g.f[0], out, &log_scale), SRNF_OK);
    assert_true(fabs(log_scale) <= 1e-12);
    for (size_t k = 0; k < g.count; k++) {
        g.f[0][k] = 7.0 * g.f[0][k] + (k % g.each == 0 ? 2.0 : 0.0);
    }
    assert_int_equal(srnf_normalize(g.sht, g.f[0], again, &log_scale), SRNF_OK);
    assert_true(fabs(log_scale - log(7.0)) <= 1e-12);
    for (size_t k = 0; k < g.count; k++) {
        assert_true(fabs(out[k] - again[k]) <= 1e-12);
        g.f[0][k] = 0.0;
    }
    assert_int_equal(srnf_normalize(g.sht, g.f[0], again, NULL), SRNF_EDEGENERATE);
    srnf_free(again);
    srnf_free(out);
    group_close(&g);
}

static void wrong_arguments_are_refused(void **state)
{
    struct group g;
    double matrix[N * N];
    struct srnf_error error = {0};

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    assert_int_equal(srnf_metric_distances(g.sht, (enum srnf_metric)5, N, g.surfaces, NULL, NULL,
                                           matrix, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "metric 5"));
    assert_string_equal(srnf_metric_name((enum srnf_metric)5), "unknown");
    assert_int_equal(
        srnf_metric_distances(g.sht, SRNF_METRIC_ICP, 0, g.surfaces, NULL, NULL, matrix, &error),
        SRNF_EINVAL);
    for (size_t k = 0; k < g.count; k++) {
        g.f[2][k] = 0.0;
    }
    assert_int_equal(
        srnf_metric_distances(g.sht, SRNF_METRIC_ICP, N, g.surfaces, NULL, NULL, matrix, &error),
        SRNF_EDEGENERATE);
    assert_int_equal(
        srnf_metric_distances(g.sht, SRNF_METRIC_SRM, N, g.surfaces, NULL, NULL, matrix, &error),
        SRNF_EDEGENERATE);
    assert_int_equal(error.element, 2);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(poses_are_not_seen),
        cmocka_unit_test(harmonic_sees_the_parameterization),
        cmocka_unit_test(nothing_is_turned_without_registration),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(ellipsoids_lie_on_the_axes),
        cmocka_unit_test(normalized_surfaces),
        cmocka_unit_test(wrong_arguments_are_refused),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    options = srnf_register_options_defaults();
    options.degree = 4;
    options.start = SRNF_START_RIGID;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
