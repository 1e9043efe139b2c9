/*
 * test_nulls_200.c - 200 cohorts without a difference, with every subject scanned twice and with
 * none: rejections at the level .05 lie in the binomial interval, accuracies at chance.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "nulls.h"

#define COHORTS ((size_t)200)
#define PERMUTATIONS ((size_t)199)

static void check(const struct nulls_counts *c)
{
    /* Binomial(200, .05) is from 4 to 17 with a chance of .95. Accuracies are whole numbers of
       right answers: ties make their test conservative, so that few are no fault. */
    assert_in_range(c->global, 4, 17);
    assert_in_range(c->map, 4, 17);
    assert_in_range(c->gauss, 0, 17);
    assert_in_range(c->nearest, 0, 17);
    for (size_t nearest = 0; nearest < 2; nearest++) {
        double error;
        double mean = nulls_accuracy(c, nearest, &error);

        assert_true(fabs(mean - 0.5) <= 1.96 * error);
    }
}

static void repeated_subjects(void **state)
{
    struct nulls_counts counts = nulls_run(COHORTS, 2, true, PERMUTATIONS, SRNF_REFIT_FOLD);

    (void)state;
    check(&counts);
}

static void subjects_once_each(void **state)
{
    struct nulls_counts counts = nulls_run(COHORTS, 1, true, PERMUTATIONS, SRNF_REFIT_FOLD);

    (void)state;
    check(&counts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repeated_subjects),
        cmocka_unit_test(subjects_once_each),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
