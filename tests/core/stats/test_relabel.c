/*
 * test_relabel.c - intervals of classifiers whose members are left out of each other, where labels
 * say nothing: how often they lie on either side of chance.
 */
#include "classes.h"

struct claims {
    size_t above[3], below[3]; /* chance, by accuracy, balanced accuracy and area */
    size_t independent[2];     /* above and below by an interval for independent members */
};

static void claim(const struct srnf_rate *rate, size_t k, struct claims *claims)
{
    claims->above[k] += rate->interval[0] > 0.5;
    claims->below[k] += rate->interval[1] < 0.5;
    assert_true(rate->interval[0] <= rate->value && rate->value <= rate->interval[1]);
}

static struct claims claims_of(bool gauss, size_t studies)
{
    enum { MEMBERS = 24 };
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct claims claims = {.above = {0}};
    size_t labels[MEMBERS];

    options.components = gauss ? 3 : 0;
    options.covariance = SRNF_COVARIANCE_POOLED;
    for (size_t i = 0; i < MEMBERS; i++) {
        labels[i] = i % 2;
    }
    for (size_t s = 0; s < studies; s++) {
        struct srnf_folds c = classes_open(MEMBERS, 3, 0.0, labels, 500 + s);
        struct srnf_classification r;
        struct srnf_rate accuracy;
        double interval[2];

        assert_int_equal((gauss ? srnf_classify_gauss
                                : srnf_classify_nearest)(&c, labels, 2, &options, NULL, &r, NULL),
                         SRNF_OK);
        accuracy = (struct srnf_rate){r.accuracy, {r.interval[0], r.interval[1]}};
        claim(&accuracy, 0, &claims);
        claim(&r.balanced, 1, &claims);
        claim(&r.auc[1], 2, &claims);
        srnf_wilson_interval(r.correct, MEMBERS, interval);
        claims.independent[0] += interval[0] > 0.5;
        claims.independent[1] += interval[1] < 0.5;
        assert_int_equal(r.dispersions.relabellings, 100);
        assert_true(r.effective <= MEMBERS && r.effective > 2.0);
        srnf_classification_clear(&r);
        classes_clear(&c);
    }
    return claims;
}

/* Of 200 intervals of 95 % up to 10 lie on either side of what is true, in 95 % of such series. */
static void intervals_allow_for_members_left_out_of_each_other(void **state)
{
    (void)state;
    for (size_t gauss = 0; gauss < 2; gauss++) {
        struct claims claims = claims_of(gauss, 200);

        printf("# %s: of 200 intervals above .5 and below it, for independent members %zu and %zu",
               gauss ? "Gauss" : "nearest", claims.independent[0], claims.independent[1]);
        for (size_t k = 0; k < 3; k++) {
            printf("; %zu and %zu", claims.above[k], claims.below[k]);
            assert_true(claims.above[k] <= 10 && claims.below[k] <= 10);
        }
        printf("\n");
        assert_true(!gauss || claims.independent[0] + claims.independent[1] > 20);
    }
}

/* Where labels differ within subjects, they cannot be exchanged, and nothing is said of it. */
static void labels_within_subjects_are_not_exchanged(void **state)
{
    enum { MEMBERS = 12 };
    size_t labels[MEMBERS], subjects[MEMBERS];
    struct srnf_classification r;
    struct srnf_folds c;

    (void)state;
    for (size_t i = 0; i < MEMBERS; i++) {
        labels[i] = i % 2;
        subjects[i] = i / 2;
    }
    c = classes_open(MEMBERS, 2, 1.0, labels, 5);
    c.subjects = subjects;
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, NULL, NULL, &r, NULL), SRNF_OK);
    assert_int_equal(r.dispersions.relabellings, 0);
    assert_true(r.dispersions.accuracy.above == 1.0 && r.dispersions.auc[1].below == 1.0);
    srnf_classification_clear(&r);
    c.subjects = NULL;
    classes_clear(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(intervals_allow_for_members_left_out_of_each_other),
        cmocka_unit_test(labels_within_subjects_are_not_exchanged),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
