/*
 * test_nulls_200.c - 200 cohorts without a difference, with every subject scanned twice and with
 * none: rejections at the level .05 lie in the binomial interval, accuracies at chance; the same of
 * groups of other ages, which are regressed out.
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
    /* Where nothing is to be found, any discovery is a false one. Nodes move together, so that maps
       have fewer; McNemar's p, of few subjects that only one method gets right, is coarse. */
    assert_in_range(c->fdr, 0, 17);
    assert_in_range(c->mcnemar, 0, 17);
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

/* Members of other ages in each group, which says nothing of shape. */
static void ages_regressed_out(void **state)
{
    struct nulls_counts counts = {.cohorts = COHORTS};

    (void)state;
    for (size_t k = 0; k < COHORTS; k++) {
        struct nulls a;

        nulls_open(&a, 1, 6000 + k);
        nulls_compare(&a, a.subjects, true, PERMUTATIONS, k, &counts);
        nulls_close(&a);
    }
    printf("# %zu cohorts, ages regressed out: p <= .05 of the groups %zu, their map %zu, by false "
           "discovery rate %zu\n",
           COHORTS, counts.global, counts.map, counts.fdr);
    assert_in_range(counts.global, 4, 17);
    assert_in_range(counts.map, 4, 17);
    assert_in_range(counts.fdr, 0, 17);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repeated_subjects),
        cmocka_unit_test(subjects_once_each),
        cmocka_unit_test(ages_regressed_out),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
