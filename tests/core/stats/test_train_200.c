/*
 * test_train_200.c - 200 cohorts whose labels say nothing: how often a classifier that is trained
 * on them, of one structure or of two, claims by the intervals of its nested accuracy, balanced
 * accuracy or area under the curve to be better than chance; and its Brier score beside that of
 * always saying the priors.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "nulls.h"
#include "stats/compare.h"

#define COHORTS ((size_t)200)
#define PARTS ((size_t)2)

struct claims {
    size_t accuracy, balanced, auc; /* intervals that lie above .5 */
    size_t below[3];                /* the same, that lie below */
    double brier, reference;        /* mean over cohorts */
};

static void train(const struct nulls *parts, size_t n_parts, bool gauss, const size_t *labels,
                  struct claims *claims)
{
    struct srnf_train_options options = srnf_train_options_defaults();
    const double *surfaces[PARTS * NULLS_MEMBERS];
    struct srnf_trained trained;
    const struct srnf_assessment *a = &trained.assessment;

    options.gauss = gauss;
    options.registration.degree = 2;
    options.registration.common_pose = true;
    options.n_parts = n_parts;
    for (size_t i = 0; i < n_parts * NULLS_MEMBERS; i++) {
        surfaces[i] = parts[i / NULLS_MEMBERS].g.surfaces[i % NULLS_MEMBERS];
    }
    assert_int_equal(srnf_train(parts[0].g.sht, NULLS_MEMBERS, surfaces, labels, 2, &options, NULL,
                                &trained, NULL),
                     SRNF_OK);
    claims->accuracy += a->accuracy.interval[0] > 0.5;
    claims->balanced += a->balanced.interval[0] > 0.5;
    claims->auc += a->auc[1].interval[0] > 0.5;
    claims->below[0] += a->accuracy.interval[1] < 0.5;
    claims->below[1] += a->balanced.interval[1] < 0.5;
    claims->below[2] += a->auc[1].interval[1] < 0.5;
    claims->brier += a->scores.brier / (double)COHORTS;
    claims->reference += a->scores.brier_reference / (double)COHORTS;
    srnf_trained_clear(&trained);
}

static void check(size_t n_parts, bool gauss)
{
    struct claims claims = {.accuracy = 0};

    for (size_t k = 0; k < COHORTS; k++) {
        struct nulls parts[PARTS];
        size_t labels[NULLS_MEMBERS];
        uint32_t order[NULLS_MEMBERS];

        compare_permutation(77, k + 1, NULLS_MEMBERS, order);
        for (size_t i = 0; i < NULLS_MEMBERS; i++) {
            labels[i] = order[i] % 2;
        }
        for (size_t p = 0; p < n_parts; p++) {
            nulls_open(&parts[p], 1, 8000 + PARTS * k + p);
        }
        train(parts, n_parts, gauss, labels, &claims);
        for (size_t p = 0; p < n_parts; p++) {
            nulls_close(&parts[p]);
        }
    }
    printf(
        "# %zu structures, %s: above and below chance by the interval of the accuracy %zu and %zu "
        "of %zu, of the balanced accuracy %zu and %zu, of the area under the curve %zu and %zu; "
        "Brier score %.3f, of the priors %.3f\n",
        n_parts, gauss ? "Gauss" : "nearest", claims.accuracy, claims.below[0], COHORTS,
        claims.balanced, claims.below[1], claims.auc, claims.below[2], claims.brier,
        claims.reference);
    /* In 95 % of such series up to 10 of 200 are missed on a side. */
    assert_true(claims.accuracy <= 10 && claims.balanced <= 10 && claims.auc <= 10);
    for (size_t k = 0; k < 3; k++) {
        assert_true(claims.below[k] <= 10);
    }
    assert_true(claims.brier >= claims.reference);
}

static void labels_that_say_nothing(void **state)
{
    (void)state;
    for (size_t n_parts = 1; n_parts <= PARTS; n_parts++) {
        check(n_parts, true);
        check(n_parts, false);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(labels_that_say_nothing),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
