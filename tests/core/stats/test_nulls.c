/*
 * test_nulls.c - cohorts without a difference in which every subject was scanned twice: tests that
 * know the subjects keep their level, and those that do not are what they must not be mistaken for.
 * test_nulls_200.c has as many as figures take.
 *
 * srnfd-test: release-only
 * srnfd-test: slow
 */
#include "nulls.h"

#define COHORTS ((size_t)40)
#define PERMUTATIONS ((size_t)39)

static void repeated_subjects_keep_the_level(void **state)
{
    struct nulls_counts told = nulls_run(COHORTS, 2, true, PERMUTATIONS, SRNF_REFIT_SHARED);

    (void)state;
    /* Binomial(40, .05) exceeds 6 with a chance of 3e-3. */
    assert_true(told.global <= 6);
    assert_true(told.map <= 6);
    assert_true(told.gauss <= 6);
    assert_true(told.nearest <= 6);
    for (size_t nearest = 0; nearest < 2; nearest++) {
        double error;
        double mean = nulls_accuracy(&told, nearest, &error);

        assert_true(fabs(mean - 0.5) <= 3.0 * error);
    }
}

/* The same cohorts as if every scan were another subject: what the subjects are for. */
static void members_taken_for_subjects_do_not(void **state)
{
    struct nulls_counts naive = nulls_run(6, 2, false, PERMUTATIONS, SRNF_REFIT_SHARED);

    (void)state;
    assert_true(naive.global + naive.map > 4);
    assert_true(naive.nearest == 6);
    assert_true(naive.accuracy[1] == 6.0); /* the nearest is the other scan */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repeated_subjects_keep_the_level),
        cmocka_unit_test(members_taken_for_subjects_do_not),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
