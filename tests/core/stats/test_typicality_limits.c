/*
 * test_typicality_limits.c - limits and percentiles of typicality: the share of members beyond
 * their limits, few and repeated references, and how often intervals of percentiles hold.
 *
 * srnfd-test: slow
 */
#include "group.h"
#include "stats/folds.h"
#include "support/compare.h"

#define SETS ((size_t)4000) /* of references, and members that are judged by each */
#define OF_A_SET ((size_t)5)

/* Normal data, which the transformation of the trait makes of these: share beyond the limit. */
static double share_far(enum srnf_trait trait, size_t n, double alpha)
{
    struct test_random random = test_random_seed(n);
    size_t far = 0;
    size_t all = 0;

    for (size_t set = 0; set < SETS; set++) {
        double values[GROUP_MAX];

        for (size_t i = 0; i < n + OF_A_SET; i++) {
            double z = test_random_normal(&random);

            values[i] = trait == SRNF_TRAIT_ANGLE ? pow(compare_max(3.0 + 0.5 * z, 0.0), 1.5)
                                                  : exp(-4.0 + 0.7 * z);
        }
        for (size_t i = n; i < n + OF_A_SET; i++) {
            struct srnf_typicality t;

            assert_int_equal(srnf_typicality_of(trait, n, values, NULL, values[i], alpha, &t),
                             SRNF_OK);
            assert_true(t.far == (t.value > t.limit));
            far += t.far;
            all++;
        }
    }
    return (double)far / (double)all;
}

/* Of 20,000 members what is promised, from six references on and at either rate, within what chance
   leaves room for; of four not more. */
static void members_are_beyond_their_limits_at_the_rate_that_is_promised(void **state)
{
    static const enum srnf_trait traits[] = {SRNF_TRAIT_RESIDUAL, SRNF_TRAIT_ANGLE};
    static const size_t counts[] = {4, 6, 14, 50};

    (void)state;
    for (size_t t = 0; t < 2; t++) {
        double wide = share_far(traits[t], 50, 0.05);

        for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
            double one = share_far(traits[t], counts[k], SRNF_TYPICAL_ALPHA);
            double group = share_far(traits[t], counts[k], SRNF_TYPICAL_ALPHA_GROUP);

            printf("# of %zu beyond the limit of .005: %.4f, of .001: %.4f\n", counts[k], one,
                   group);
            assert_true(one <= 0.0065 && group <= 0.0016);
            assert_true(counts[k] < 6 || (one >= 0.0035 && group >= 0.0004));
        }
        printf("# of 50 beyond the limit of .05: %.4f\n", wide);
        assert_true(wide >= 0.04 && wide <= 0.06);
    }
}

/* Twice of what references that agree within 5 % are: far of twenty, and of three not yet. */
static void few_references_make_wide_limits(void **state)
{
    double values[20];
    double last = INFINITY;

    (void)state;
    for (size_t i = 0; i < 20; i++) {
        values[i] = 1.0 + 0.05 * (double)((7 * i) % 20) / 20.0;
    }
    for (size_t n = 3; n <= 20; n++) {
        struct srnf_typicality t;

        assert_int_equal(
            srnf_typicality_of(SRNF_TRAIT_RESIDUAL, n, values, NULL, 2.0, SRNF_TYPICAL_ALPHA, &t),
            SRNF_OK);
        assert_true(t.limit < last);
        assert_true(t.percentile == 100.0);
        assert_true(n > 3 || !t.far);
        assert_true(n < 20 || t.far);
        last = t.limit;
    }
}

static void percentiles_count_what_is_below(void **state)
{
    const double values[] = {4.0, 1.0, 3.0, 2.0};
    struct srnf_typicality t;

    (void)state;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 4, values, NULL, 2.5, 0.01, &t),
                     SRNF_OK);
    assert_true(t.value == 2.5 && t.percentile == 50.0 && !t.far);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 4, values, NULL, 1.0, 0.01, &t),
                     SRNF_OK);
    assert_true(t.percentile == 0.0);
    /* Wilson's of none and of two of four: z^2 / (4 + z^2), and half of 1 -+ its root. */
    assert_true(t.percentile_interval[0] == 0.0);
    assert_true(fabs(t.percentile_interval[1] - 48.98908) < 1e-4);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 4, values, NULL, 2.5, 0.01, &t),
                     SRNF_OK);
    assert_true(fabs(t.percentile_interval[0] - 15.00390) < 1e-4);
    assert_true(fabs(t.percentile_interval[1] - 84.99610) < 1e-4);
}

/* Of 400 groups of twelve subjects, with one measurement or of several that hardly differ, the
   interval holds the share of all subjects that are below. Twelve make 13 different ones, so that
   it holds some shares more often than others. */
static void percentiles_hold_what_all_subjects_would_give(void **state)
{
    struct test_random random = test_random_seed(3);

    (void)state;
    for (size_t k = 0; k < 6; k++) {
        const double share = (double[]){0.5, 0.8, 0.95}[k / 2];
        size_t missed = 0;

        for (size_t study = 0; study < 400; study++) {
            double values[36], weights[36];
            size_t of = k % 2 ? 3 : 1;
            struct srnf_typicality t;

            for (size_t i = 0; i < 12 * of; i++) {
                double again = 1e-3 * test_random_uniform(&random, 0.0, 1.0);

                values[i] =
                    i % of ? values[i - i % of] + again : test_random_uniform(&random, 0.0, 1.0);
                weights[i] = 1.0 / (double)of;
            }
            assert_int_equal(
                srnf_typicality_of(SRNF_TRAIT_DISTANCE, 12 * of, values, weights, share, 0.01, &t),
                SRNF_OK);
            assert_true(t.percentile_interval[0] <= t.percentile &&
                        t.percentile <= t.percentile_interval[1]);
            missed += !(t.percentile_interval[0] <= 100.0 * share &&
                        100.0 * share <= t.percentile_interval[1]);
        }
        printf("# share %.2f, %s: missed in %zu of 400\n", share,
               k % 2 ? "three measurements" : "one", missed);
        assert_in_range(missed, 0, 36); /* one in twenty, exceeded by chance once in 3000 */
    }
}

/* Each subject counts once: repeated ones make neither the limit nor the percentile another. */
static void repeated_references_count_by_subject(void **state)
{
    enum { SUBJECTS = 12, COPIES = 5 };
    struct test_random random = test_random_seed(5);
    double once[SUBJECTS];
    double all[SUBJECTS * COPIES];
    double weights[SUBJECTS * COPIES];
    size_t n = 0;

    (void)state;
    for (size_t i = 0; i < SUBJECTS; i++) {
        size_t copies = i % COPIES + 1;

        once[i] = exp(0.2 * test_random_normal(&random));
        for (size_t k = 0; k < copies; k++) {
            all[n] = once[i];
            weights[n++] = 1.0 / (double)copies;
        }
    }
    for (size_t trait = 0; trait < SRNF_CALIBRATION_TRAITS; trait++) {
        struct srnf_typicality single;
        struct srnf_typicality repeated;

        assert_int_equal(
            srnf_typicality_of((enum srnf_trait)trait, SUBJECTS, once, NULL, 1.1, 0.01, &single),
            SRNF_OK);
        assert_int_equal(
            srnf_typicality_of((enum srnf_trait)trait, n, all, weights, 1.1, 0.01, &repeated),
            SRNF_OK);
        assert_true(fabs(repeated.limit / single.limit - 1.0) < 1e-9);
        assert_true(fabs(repeated.percentile - single.percentile) < 1e-9);
    }
}

/* Of three references that differ by orders of magnitude there may be no limit, and of two other
   subjects there is none: everything is within it. */
static void a_limit_may_be_infinite(void **state)
{
    const double values[] = {1e-8, 1.0, 1e8};
    double distances[] = {0.0, 1.0, 9.0, 9.0, 1.0, 0.0, 9.0, 9.0,
                          9.0, 9.0, 0.0, 2.0, 9.0, 9.0, 2.0, 0.0};
    size_t subjects[] = {0, 0, 1, 2};
    const struct srnf_folds folds = {.n = 4, .distances = distances, .subjects = subjects};
    struct srnf_folds_typicality verdicts;
    struct srnf_typicality t;

    (void)state;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_RESIDUAL, 3, values, NULL, 1e300,
                                        SRNF_TYPICAL_ALPHA_GROUP, &t),
                     SRNF_OK);
    assert_true(isinf(t.limit) && !t.far && t.percentile == 100.0);
    assert_true(t.percentile_interval[0] > 0.0 && t.percentile_interval[1] == 100.0);
    assert_int_equal(srnf_folds_typicality(&folds, SRNF_TYPICAL_ALPHA, &verdicts), SRNF_OK);
    for (size_t i = 0; i < 4; i++) {
        assert_true(isinf(verdicts.verdicts[i].limit) && !verdicts.verdicts[i].far);
        assert_true(verdicts.verdicts[i].percentile == 0.0);
        assert_true(verdicts.verdicts[i].percentile_interval[0] == 0.0);
        assert_true(verdicts.verdicts[i].percentile_interval[1] == 100.0);
    }
    srnf_folds_typicality_clear(&verdicts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(members_are_beyond_their_limits_at_the_rate_that_is_promised),
        cmocka_unit_test(few_references_make_wide_limits),
        cmocka_unit_test(percentiles_count_what_is_below),
        cmocka_unit_test(percentiles_hold_what_all_subjects_would_give),
        cmocka_unit_test(repeated_references_count_by_subject),
        cmocka_unit_test(a_limit_may_be_infinite),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
