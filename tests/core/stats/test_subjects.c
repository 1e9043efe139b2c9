/*
 * test_subjects.c - proportions over members of subjects, relabellings taken in all ways, and what
 * a p-value says of those not taken.
 */
#include "group.h"
#include "stats/compare.h"
#include "stats/subjects.h"

static void counts_subjects(void **state)
{
    const size_t numbers[6] = {5, 2, 2, 0, 5, 2};

    (void)state;
    assert_int_equal(srnf_subject_count(6, numbers), 3);
    assert_int_equal(srnf_subject_count(1, numbers), 1);
    assert_int_equal(srnf_subject_count(6, NULL), 6);
    assert_int_equal(srnf_subject_count(0, numbers), 0);
}

static void intervals_count_subjects(void **state)
{
    enum { N = 24 };
    size_t subjects[N];
    bool success[N];
    double wilson[2];
    double interval[2];
    double effective;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i / 2;
        success[i] = true;
    }
    /* all right: as many as subjects */
    assert_int_equal(srnf_cluster_interval(N, subjects, success, &effective, interval, NULL),
                     SRNF_OK);
    srnf_wilson_interval(12, 12, wilson);
    assert_true(effective == 12.0);
    assert_true(fabs(interval[0] - wilson[0]) < 1e-15 && interval[1] == 1.0);
    /* members of a subject agree: as many as subjects, but for the S / (S - 1) that is cut off */
    for (size_t i = 0; i < N; i++) {
        success[i] = subjects[i] % 3 == 0;
    }
    assert_int_equal(srnf_cluster_interval(N, subjects, success, &effective, interval, NULL),
                     SRNF_OK);
    srnf_wilson_interval(4, 12, wilson);
    assert_true(effective == 12.0);
    assert_true(fabs(interval[0] - wilson[0]) < 1e-15 && fabs(interval[1] - wilson[1]) < 1e-15);
    /* members of a subject never agree, but for one: not more than all members */
    for (size_t i = 0; i < N; i++) {
        success[i] = i % 2 == 0 || i == 1;
    }
    assert_int_equal(srnf_cluster_interval(N, subjects, success, &effective, interval, NULL),
                     SRNF_OK);
    assert_true(effective == N);
    /* no subjects: Wilson's, to the last bit */
    assert_int_equal(srnf_cluster_interval(N, NULL, success, &effective, interval, NULL), SRNF_OK);
    srnf_wilson_interval(13, N, wilson);
    assert_true(effective == N && interval[0] == wilson[0] && interval[1] == wilson[1]);
    subjects[3] = N;
    assert_int_equal(srnf_cluster_interval(N, subjects, success, &effective, interval, NULL),
                     SRNF_EINVAL);
}

/* Subjects of unlike sizes: the formula, worked out by hand. Sizes 1, 2, 3, right 1, 0, 3. */
static void effective_count_is_that_of_the_formula(void **state)
{
    const size_t subjects[6] = {5, 2, 2, 0, 0, 0};
    const bool success[6] = {true, false, false, true, true, true};
    double p = 4.0 / 6.0;
    double squares = (1 - p) * (1 - p) + 4 * p * p + 9 * (1 - p) * (1 - p);
    double expected = p * (1 - p) / (1.5 * squares / 36.0);
    double interval[2];
    double effective;

    (void)state;
    assert_true(expected < 36.0 / 14.0); /* so that the least that it can be stands in */
    assert_int_equal(srnf_cluster_interval(6, subjects, success, &effective, interval, NULL),
                     SRNF_OK);
    assert_true(fabs(effective - 36.0 / 14.0) < 1e-14);
    assert_true(interval[0] >= 0.0 && interval[0] < p && interval[1] > p && interval[1] <= 1.0);
}

/* How often the interval holds the true proportion, for subjects whose members mostly agree: that
   of Wilson for members falls far short of 95 %. */
static void intervals_cover(void **state)
{
    enum { SUBJECTS = 30, N = 4 * SUBJECTS, RUNS = 2000 };
    struct test_random random = test_random_seed(6);
    size_t subjects[N];
    size_t covered = 0;
    size_t naive = 0;

    (void)state;
    for (size_t run = 0; run < RUNS; run++) {
        bool success[N];
        size_t count = 0;
        double interval[2];
        double effective;

        for (size_t i = 0; i < N; i++) {
            double kept = i % 4 ? test_random_normal(&random) : 9.0; /* 84 % go with the first */

            subjects[i] = i / 4;
            success[i] = i % 4 && kept > -1.0 ? success[i - i % 4]
                                              : test_random_normal(&random) > -0.5244; /* .7 */
            count += success[i];
        }
        assert_int_equal(srnf_cluster_interval(N, subjects, success, &effective, interval, NULL),
                         SRNF_OK);
        covered += interval[0] <= 0.7 && interval[1] >= 0.7;
        srnf_wilson_interval(count, N, interval);
        naive += interval[0] <= 0.7 && interval[1] >= 0.7;
    }
    printf("# the true proportion was covered %zu of %d times, by members %zu\n", covered, RUNS,
           naive);
    assert_true(covered >= (size_t)(0.92 * RUNS) && covered <= (size_t)(0.98 * RUNS));
    assert_true(naive <= (size_t)(0.85 * RUNS));
}

/* All arrangements of 0 0 1 1 1 2, each once, the first of them the one that there is. */
static void all_relabellings_are_different(void **state)
{
    enum { ALL = 60 };
    const size_t kind[6] = {1, 0, 2, 1, 0, 1};
    size_t seen[ALL];
    struct exchange e;

    (void)state;
    assert_int_equal(exchange_open(&e, 6, kind, 3, 1000, 1.0), SRNF_OK);
    assert_true(e.test.exact && e.test.permutations == ALL - 1 && e.test.relabellings == ALL);
    for (uint64_t number = 0; number < ALL; number++) {
        size_t left[3];
        size_t source[6];
        size_t used = 0;

        exchange_arrange(&e, number, left, source);
        seen[number] = 0;
        for (size_t i = 0; i < 6; i++) {
            used |= (size_t)1 << source[i];
            seen[number] = 3 * seen[number] + kind[source[i]];
            assert_true(number > 0 || source[i] == i);
        }
        assert_int_equal(used, 63);
        for (size_t k = 0; k < number; k++) {
            assert_true(seen[k] != seen[number]);
        }
    }
    exchange_clear(&e);
    assert_int_equal(exchange_open(&e, 4, NULL, 0, 23, 1.0), SRNF_OK); /* all orders of four */
    assert_true(e.test.exact && e.test.permutations == 23);
    exchange_clear(&e);
    assert_int_equal(exchange_open(&e, 4, NULL, 0, 22, 1.0), SRNF_OK);
    assert_true(!e.test.exact && e.test.permutations == 22 && e.test.least == 1.0 / 23.0);
    exchange_clear(&e);
}

static void p_values_say_what_they_leave_open(void **state)
{
    struct srnf_permutation_test test = {
        .permutations = 999, .relabellings = INFINITY, .least = 1e-3};
    double interval[2];
    double wilson[2];

    (void)state;
    assert_true(srnf_permutation_at_floor(&test, 1e-3));
    assert_false(srnf_permutation_at_floor(&test, 2e-3));
    srnf_permutation_interval(&test, 1e-3, interval);
    assert_true(interval[0] == 0.0 && interval[1] > 1e-3 && interval[1] < 5e-3);
    srnf_permutation_interval(&test, 0.05, interval); /* 49 of 999 */
    srnf_wilson_interval(49, 999, wilson);
    assert_memory_equal(interval, wilson, sizeof wilson);
    srnf_permutation_interval(&test, 1.0, interval);
    assert_true(interval[0] > 0.99 && interval[1] == 1.0);
    test.exact = true;
    srnf_permutation_interval(&test, 0.3, interval);
    assert_true(interval[0] == 0.3 && interval[1] == 0.3);
    test = (struct srnf_permutation_test){0};
    assert_false(srnf_permutation_at_floor(&test, NAN));
    srnf_permutation_interval(&test, NAN, interval);
    assert_true(interval[0] == 0.0 && interval[1] == 1.0);
}

static void permutations_are_even(void **state)
{
    size_t count[24] = {0};
    const size_t draws = 24000;
    double chi = 0.0;

    (void)state;
    for (size_t k = 1; k <= draws; k++) {
        uint32_t order[4];
        size_t code;

        compare_permutation(3, k, 4, order);
        assert_int_equal((1u << order[0]) | (1u << order[1]) | (1u << order[2]) | (1u << order[3]),
                         15);
        code = order[0] * 6;
        code += (order[1] - (order[1] > order[0])) * 2;
        code += order[2] > order[3];
        count[code]++;
    }
    for (size_t i = 0; i < 24; i++) {
        chi += pow((double)count[i] - 1000.0, 2.0) / 1000.0;
    }
    figure_below("chi^2 of 24 orders (23 degrees of freedom)", chi, 49.7); /* chance 1e-3 */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(permutations_are_even),
        cmocka_unit_test(counts_subjects),
        cmocka_unit_test(intervals_count_subjects),
        cmocka_unit_test(effective_count_is_that_of_the_formula),
        cmocka_unit_test(intervals_cover),
        cmocka_unit_test(all_relabellings_are_different),
        cmocka_unit_test(p_values_say_what_they_leave_open),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
