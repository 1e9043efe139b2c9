/*
 * test_neighbours.c - nearest neighbours are those of the whole matrix of distances, to the bit, of
 * whatever pairs are registered; the bound is below what registration finds, unchanged by rotations
 * and warps, and rules pairs out where surfaces differ.
 * srnfd-test: slow
 * srnfd-test: no-asan (test_stats_allocation.c and api/test_standard.sh run its code)
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE 5
#define N ((size_t)6)
#define NEAR ((size_t)4) /* the first ones are alike, the others are not */

struct attempt {
    size_t measured, recalled, alive;
    double values[N * N];
};

static bool recall(void *user, uint64_t series, uint64_t index, size_t count, double *value)
{
    struct attempt *attempt = user;

    (void)series;
    if (count != 1 || attempt->values[index] == 0.0) {
        return false;
    }
    *value = attempt->values[index];
    attempt->recalled++;
    return true;
}

static void keep(void *user, uint64_t series, uint64_t index, size_t count, const double *value)
{
    struct attempt *attempt = user;

    (void)series;
    assert_int_equal(count, 1);
    attempt->values[index] = *value;
    attempt->measured++;
}

static struct srnf_register_options quick(void)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.degree = 3;
    options.start = SRNF_START_RIGID;
    return options;
}

/* Stars; those after NEAR are drawn out, more and more. */
static void open_shapes(struct group *g)
{
    group_open_stars(g, DEGREE, N, 0.3);
    for (size_t i = NEAR; i < N; i++) {
        for (size_t k = 0; k < srnf_coefficient_count(DEGREE); k++) {
            g->f[i][k] *= 1.0 + 1.5 * (double)(i - NEAR + 1);
        }
    }
}

/* Of all pairs of the shapes, registered once for all tests. */
static const double *all_distances(const struct group *g,
                                   const struct srnf_register_options *options)
{
    static double matrix[N * N];

    if (matrix[1] == 0.0) {
        assert_int_equal(srnf_distances(g->sht, N, g->surfaces, options, NULL, matrix, NULL),
                         SRNF_OK);
        assert_true(matrix[1] > 0.0);
    }
    return matrix;
}

/* Entry m of the row of surface i, sorted by distance and then by index. */
static size_t rank(const double *matrix, size_t i, size_t m)
{
    bool taken[N] = {false};
    size_t best = N;

    taken[i] = true;
    for (size_t place = 0; place <= m; place++) {
        best = N;
        for (size_t j = 0; j < N; j++) {
            if (!taken[j] && (best == N || matrix[i * N + j] < matrix[i * N + best])) {
                best = j;
            }
        }
        taken[best] = true;
    }
    return best;
}

static void are_those_of_all_distances(void **state)
{
    struct srnf_register_options options = quick();
    struct group_watch watch;
    struct srnf_context threads = group_context(&watch, 3);
    struct srnf_neighbours neighbours;
    const double *matrix;
    struct group g;

    (void)state;
    open_shapes(&g);
    matrix = all_distances(&g, &options);
    for (size_t k = 1; k < 4; k += 2) {
        assert_int_equal(srnf_nearest_neighbours(g.sht, N, g.surfaces, k, &options,
                                                 k == 3 ? &threads : NULL, &neighbours, NULL),
                         SRNF_OK);
        printf("# k = %zu: %zu of %zu pairs registered\n", k, neighbours.registered,
               neighbours.pairs);
        assert_int_equal(neighbours.pairs, N * (N - 1) / 2);
        assert_true(neighbours.registered <= neighbours.pairs);
        assert_true(k > 1 || neighbours.registered < neighbours.pairs);
        for (size_t i = 0; i < N; i++) {
            for (size_t m = 0; m < k; m++) {
                size_t j = rank(matrix, i, m);

                assert_int_equal(neighbours.indices[i * k + m], j);
                assert_true(neighbours.distances[i * k + m] == matrix[i * N + j]);
            }
        }
        srnf_neighbours_clear(&neighbours);
    }
    group_close(&g);
}

/* The bound of each pair is below its distance; of a surface with itself turned and warped it is
   nothing, with the slack left out. */
static void the_bound_is_one(void **state)
{
    struct srnf_register_options options = quick();
    double features[N][STATS_NEIGHBOUR_FEATURES];
    const double *matrix;
    double tightest = 0.0, worst = 0.0, slack = 0.0;
    struct group g;

    (void)state;
    open_shapes(&g);
    matrix = all_distances(&g, &options);
    for (size_t i = 0; i < N; i++) {
        assert_int_equal(stats_neighbour_features(g.sht, g.surfaces[i], features[i]), SRNF_OK);
    }
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < i; j++) {
            double bound = stats_neighbour_bound(features[i], features[j]);

            assert_true(bound <= matrix[i * N + j]);
            assert_true(bound == stats_neighbour_bound(features[j], features[i]));
            tightest = compare_max(tightest, bound / matrix[i * N + j]);
        }
    }
    for (size_t i = 1; i < N; i++) {
        struct srnf_registration found;
        double moved[STATS_NEIGHBOUR_FEATURES];
        double norm;

        assert_true(
            srnf_register(g.sht, g.f[0], NULL, g.f[i], &options, NULL, NULL, &found, NULL) >= 0);
        assert_int_equal(stats_neighbour_features(g.sht, found.coefficients, moved), SRNF_OK);
        for (size_t k = 0; k < STATS_NEIGHBOUR_FEATURES; k++) {
            worst = compare_max(worst, fabs(moved[k] - features[i][k]) /
                                           features[i][STATS_NEIGHBOUR_FEATURES - 1]);
        }
        norm = sqrt(srnf_inner_product(g.grid, found.q, found.q));
        slack = compare_max(slack, fabs(norm / features[i][STATS_NEIGHBOUR_FEATURES - 1] - 1.0));
        srnf_registration_clear(&found);
    }
    printf("# bounds up to %.2f of the distance; a turned and warped surface differs by %.1e, the "
           "norm "
           "of its field by %.1e\n",
           tightest, worst, slack);
    assert_true(slack < 2e-3); /* that is taken off the bounds */
    assert_true(tightest > 0.2);
    assert_true(worst < 2e-2); /* what analysis to the degree leaves out, too */
    group_close(&g);
}

static void goes_on_from_what_was_measured(void **state)
{
    struct srnf_register_options options = quick();
    struct attempt attempt = {.measured = 0};
    const struct srnf_context context = {.user = &attempt, .recall = recall, .keep = keep};
    struct srnf_neighbours whole, again;
    struct group g;

    (void)state;
    open_shapes(&g);
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options, &context, &whole, NULL),
        SRNF_OK);
    assert_int_equal(attempt.measured, whole.registered);
    attempt.measured = attempt.recalled = 0;
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options, &context, &again, NULL),
        SRNF_OK);
    assert_int_equal(attempt.recalled, whole.registered);
    assert_int_equal(attempt.measured, 0);
    assert_memory_equal(whole.indices, again.indices, 2 * N * sizeof(size_t));
    assert_memory_equal(whole.distances, again.distances, 2 * N * sizeof(double));
    srnf_neighbours_clear(&whole);
    srnf_neighbours_clear(&again);
    group_close(&g);
}

/* Another machine: it has the numbers of the pairs and nothing else. */
struct elsewhere {
    int answer; /* SRNF_OK: measures */
    size_t asked, measured;
};

static int measure(void *user, const struct srnf_pair_search *pairs, struct srnf_error *error)
{
    struct elsewhere *elsewhere = user;

    (void)error;
    elsewhere->asked++;
    assert_true(pairs->count > 0 && pairs->n == N);
    assert_true(pairs->from >= 0.0 && pairs->from < pairs->to && pairs->to <= 1.0);
    for (size_t c = pairs->count; c-- > 0 && elsewhere->answer == SRNF_OK;) {
        const double *ends[2] = {pairs->surfaces[pairs->pairs[c][0]],
                                 pairs->surfaces[pairs->pairs[c][1]]};
        double matrix[4];

        assert_true(pairs->pairs[c][0] < pairs->pairs[c][1]);
        assert_int_equal(srnf_distances(pairs->sht, 2, ends, pairs->options, NULL, matrix, NULL),
                         SRNF_OK);
        pairs->distances[c] = matrix[1];
        elsewhere->measured++;
    }
    return elsewhere->answer;
}

/* Pairs that are measured elsewhere: the same bits, and nothing is measured here; a caller who
   declines, and one who fails. */
static void asks_other_machines(void **state)
{
    struct srnf_register_options options = quick();
    struct srnf_neighbours here, there, declined;
    struct elsewhere elsewhere = {.answer = SRNF_OK};
    struct attempt attempt = {.measured = 0};
    struct srnf_context context = {.user = &elsewhere, .measure = measure};
    struct group g;

    (void)state;
    open_shapes(&g);
    assert_int_equal(srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options,
                                             &(struct srnf_context){.user = &attempt, .keep = keep},
                                             &here, NULL),
                     SRNF_OK);
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options, &context, &there, NULL),
        SRNF_OK);
    assert_true(elsewhere.asked > 0);
    assert_int_equal(elsewhere.measured, here.registered);
    assert_int_equal(there.registered, here.registered);
    assert_memory_equal(here.indices, there.indices, 2 * N * sizeof(size_t));
    assert_memory_equal(here.distances, there.distances, 2 * N * sizeof(double));
    elsewhere.answer = SRNF_SEARCH_HERE;
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options, &context, &declined, NULL),
        SRNF_OK);
    assert_memory_equal(here.distances, declined.distances, 2 * N * sizeof(double));
    srnf_neighbours_clear(&declined);
    elsewhere.answer = SRNF_ECANCELED;
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, N, g.surfaces, 2, &options, &context, &declined, NULL),
        SRNF_ECANCELED);
    assert_null(declined.distances);
    srnf_neighbours_clear(&here);
    srnf_neighbours_clear(&there);
    group_close(&g);
}

static void refuses_what_it_cannot(void **state)
{
    struct srnf_register_options options = quick();
    struct srnf_neighbours neighbours;
    struct srnf_error error;
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, 3, 0.3);
    for (size_t k = 0; k < 5; k += k ? 1 : 3) {
        assert_int_equal(
            srnf_nearest_neighbours(g.sht, 3, g.surfaces, k, &options, NULL, &neighbours, &error),
            SRNF_EINVAL);
    }
    options.representation = SRNF_REPRESENTATION_SRM;
    assert_int_equal(
        srnf_nearest_neighbours(g.sht, 3, g.surfaces, 1, &options, NULL, &neighbours, &error),
        SRNF_EINVAL);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(are_those_of_all_distances),     cmocka_unit_test(the_bound_is_one),
        cmocka_unit_test(goes_on_from_what_was_measured), cmocka_unit_test(asks_other_machines),
        cmocka_unit_test(refuses_what_it_cannot),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
