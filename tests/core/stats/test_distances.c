/*
 * test_distances.c - the matrix of distances between surfaces: a metric where nothing is
 * registered, symmetric where it is; the same however the pairs are spread; cancellation, progress
 * and wrong arguments.
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE 9
#define N ((size_t)11)

static void is_the_distance_of_the_fields(void **state)
{
    struct group g;
    double matrix[N * N];
    double *q[2];
    void *workspace;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    workspace = shapes_doubles(srnf_surface_workspace_size(g.sht) / sizeof(double) + 1);
    q[0] = shapes_doubles(3 * g.points);
    q[1] = shapes_doubles(3 * g.points);
    assert_int_equal(srnf_distances(g.sht, N, g.surfaces, NULL, NULL, matrix, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < N; j++) {
            double square;

            srnf_field(g.sht, g.f[i], q[0], workspace);
            srnf_field(g.sht, g.f[j], q[1], workspace);
            for (size_t k = 0; k < 3 * g.points; k++) {
                q[0][k] -= q[1][k];
            }
            square = srnf_inner_product(g.grid, q[0], q[0]);
            assert_true(fabs(matrix[i * N + j] - sqrt(square)) <= 1e-14);
            assert_true((matrix[i * N + j] > 0.0) == (i != j));
        }
    }
    srnf_free(q[0]);
    srnf_free(q[1]);
    srnf_free(workspace);
    group_close(&g);
}

static void is_a_metric(void **state)
{
    struct group g;
    double matrix[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    assert_int_equal(srnf_distances(g.sht, N, g.surfaces, NULL, NULL, matrix, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_true(matrix[i * N + i] == 0.0);
        for (size_t j = 0; j < N; j++) {
            assert_true(matrix[i * N + j] == matrix[j * N + i]);
            for (size_t k = 0; k < N; k++) {
                assert_true(matrix[i * N + k] <=
                            (matrix[i * N + j] + matrix[j * N + k]) * (1.0 + 1e-15));
            }
        }
    }
    group_close(&g);
}

static void does_not_depend_on_threads(void **state)
{
    struct group g;
    double expected[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    assert_int_equal(srnf_distances(g.sht, N, g.surfaces, NULL, NULL, expected, NULL), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        double matrix[N * N];

        assert_int_equal(srnf_distances(g.sht, N, g.surfaces, NULL, &context, matrix, NULL),
                         SRNF_OK);
        assert_memory_equal(matrix, expected, sizeof matrix);
        assert_int_equal(atomic_load(&watch.reports), N * (N - 1) / 2); /* one for each pair */
        assert_true(atomic_load(&watch.highest) == 1.0);
    }
    group_close(&g);
}

static void of_one_surface(void **state)
{
    struct group g;
    double matrix = NAN;

    (void)state;
    group_open_stars(&g, DEGREE, 1, 0.5);
    assert_int_equal(srnf_distances(g.sht, 1, g.surfaces, NULL, NULL, &matrix, NULL), SRNF_OK);
    assert_true(matrix == 0.0);
    group_close(&g);
}

static void can_be_canceled(void **state)
{
    struct group g;
    double matrix[N * N];

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.5);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        for (size_t after = 0; after < N + 20; after += 10) {
            struct group_watch watch;
            struct srnf_context context = group_context(&watch, group_threads[s]);
            struct srnf_error error = {0};

            watch.cancel_after = after;
            assert_int_equal(srnf_distances(g.sht, N, g.surfaces, NULL, &context, matrix, &error),
                             SRNF_ECANCELED);
            assert_int_equal(error.status, SRNF_ECANCELED);
            assert_true(error.message[0] != '\0');
        }
    }
    group_close(&g);
}

static void refuses_what_it_cannot_take(void **state)
{
    struct group g;
    double matrix[N * N];
    struct srnf_error error = {0};

    (void)state;
    group_open_stars(&g, DEGREE, 3, 0.5);
    assert_int_equal(srnf_distances(g.sht, 0, g.surfaces, NULL, NULL, matrix, &error), SRNF_EINVAL);
    assert_int_equal(error.status, SRNF_EINVAL);
    g.f[2][7] = NAN;
    assert_int_equal(srnf_distances(g.sht, 3, g.surfaces, NULL, NULL, matrix, &error), SRNF_EINVAL);
    assert_int_equal(error.element, 2);
    assert_int_equal(srnf_distances(g.sht, 2, g.surfaces, NULL, NULL, matrix, NULL), SRNF_OK);
    group_close(&g);
}

/* Registered: symmetric to the bit, below the unregistered, and on any threads nearly the same when
   the surfaces are given in another order. */
static void registered_distances(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct group g;
    double plain[9];
    double expected[9];

    (void)state;
    group_open_stars(&g, DEGREE, 3, 0.5);
    options.degree = 4;
    options.common_pose = true;
    assert_int_equal(srnf_distances(g.sht, 3, g.surfaces, NULL, NULL, plain, NULL), SRNF_OK);
    assert_int_equal(srnf_distances(g.sht, 3, g.surfaces, &options, NULL, expected, NULL), SRNF_OK);
    assert_false(options.symmetric); /* set in a copy */
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            assert_true(expected[3 * i + j] == expected[3 * j + i]);
            assert_true(i == j ? expected[3 * i + j] == 0.0
                               : expected[3 * i + j] < plain[3 * i + j]);
        }
    }
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        const double *turned[3] = {g.f[2], g.f[0], g.f[1]};
        double matrix[9];
        double worst = 0.0;

        assert_int_equal(srnf_distances(g.sht, 3, turned, &options, &context, matrix, NULL),
                         SRNF_OK);
        for (size_t i = 0; i < 3; i++) {
            for (size_t j = 0; j < 3; j++) {
                double other = expected[3 * ((i + 2) % 3) + (j + 2) % 3];

                worst = compare_max(worst, fabs(matrix[3 * i + j] - other));
            }
        }
        /* The two directions of a pair are measured on the grids of two templates. */
        figure_below("distances given in another order", worst, 1e-3 * expected[1]);
    }
    options.degree = 1000;
    assert_int_equal(srnf_distances(g.sht, 3, g.surfaces, &options, NULL, plain, NULL),
                     SRNF_EINVAL);
    group_close(&g);
}

/* Surfaces are prepared for many pairs, and more of them than are held come tile by tile: the same
   bits as of each pair alone, of the pairs that are asked for. */
static void prepared_surfaces_change_nothing(void **state)
{
    enum { MANY = FIGURES_SLOW ? 4 : 5, PAIRS = MANY * (MANY - 1) / 2 };
    const size_t some[] = {FIGURES_SLOW ? 3 : 7, 1, 4, PAIRS - 1};
    struct srnf_register_options options = srnf_register_options_defaults();
    double expected[MANY * MANY], pair[4];
    struct group g;

    (void)state;
    group_open_stars(&g, 5, MANY, 0.5);
    options.degree = 4;
    options.symmetric = true;
    for (size_t k = 0; k < PAIRS; k++) {
        const double *ends[2];
        size_t i, j;

        srnf_pair(k, &i, &j);
        ends[0] = g.f[i];
        ends[1] = g.f[j];
        assert_int_equal(srnf_distances(g.sht, 2, ends, &options, NULL, pair, NULL), SRNF_OK);
        expected[i * MANY + j] = pair[1];
    }
    for (size_t held = 2; held <= MANY; held++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[held % GROUP_SPREADS]);
        struct stats_registered asked = {g.sht, MANY, g.surfaces, &options, 0, held};
        bool listed = held % 2 == 0;
        size_t count = listed ? sizeof some / sizeof some[0] : PAIRS;
        double matrix[MANY * MANY];

        assert_int_equal(stats_registered_distances(&asked, count, listed ? some : NULL,
                                                    (struct stats_progress){0.0, 1.0, "testing"},
                                                    &context, matrix, NULL),
                         SRNF_OK);
        for (size_t k = 0; k < count; k++) {
            size_t i, j;

            srnf_pair(listed ? some[k] : k, &i, &j);
            assert_true(matrix[i * MANY + j] == expected[i * MANY + j]);
        }
        assert_int_equal(atomic_load(&watch.reports), count);
        assert_true(atomic_load(&watch.highest) == 1.0);
    }
    assert_true(srnf_distances_memory(3, 15) < srnf_distances_memory(30, 15));
    assert_true(srnf_distances_memory(1000, 15) < 1e8);
    group_close(&g);
}

/* ---- The loop itself: the failure of the lowest index, whatever the order -------------------- */

static int fails_at_some(void *argument, size_t index, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const size_t *first = argument;

    assert_null(context->progress);
    assert_null(context->parallel_for);
    if (index < *first || index % 3 == 1) {
        return index % 2 ? SRNF_OK : SRNF_WNOT_CONVERGED;
    }
    return srnf_fail(error, index % 2 ? SRNF_EINVAL : SRNF_ENUMERIC, (int64_t)index, "body %zu",
                     index);
}

static void tells_the_first_failure(void **state)
{
    (void)state;
    for (size_t first = 0; first < 40; first++) {
        size_t lowest = first % 3 == 1 ? first + 1 : first;

        for (size_t s = 0; s < GROUP_SPREADS; s++) {
            struct group_watch watch;
            struct srnf_context context = group_context(&watch, group_threads[s]);
            struct srnf_error error = {0};
            int status = stats_run(&context, 40, fails_at_some, &first,
                                   (struct stats_progress){0.0, 1.0, "testing"}, &error);

            if (lowest >= 40) {
                assert_int_equal(status, SRNF_OK);
                continue;
            }
            assert_int_equal(status, lowest % 2 ? SRNF_EINVAL : SRNF_ENUMERIC);
            assert_int_equal(error.status, status);
            assert_int_equal(error.element, lowest);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_the_distance_of_the_fields),
        cmocka_unit_test(is_a_metric),
        cmocka_unit_test(does_not_depend_on_threads),
        cmocka_unit_test(of_one_surface),
        cmocka_unit_test(can_be_canceled),
        cmocka_unit_test(refuses_what_it_cannot_take),
        cmocka_unit_test(registered_distances),
        cmocka_unit_test(prepared_surfaces_change_nothing),
        cmocka_unit_test(tells_the_first_failure),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
