/*
 * test_assess.c - calibrated probabilities and what predictions are worth, against the numbers that
 * numpy and scipy give (assess_reference.py prints them), and what is refused.
 */
#include "group.h"

#define N ((size_t)24)

/* Evidence in quarters, and labels that it tells of, mostly. */
static void fill(size_t classes, double *evidence, size_t *labels)
{
    for (size_t i = 0; i < N; i++) {
        labels[i] = (i * i + i / 3) % classes;
        for (size_t c = 0; c < classes; c++) {
            evidence[i * classes + c] =
                (double)((37 * i + 11 * c * c + 5 * i * c) % 29) / 4.0 - 3.0;
        }
        evidence[i * classes + labels[i]] += 2.5;
    }
}

struct expected {
    size_t classes;
    bool pairs;
    double slope, offsets[3], targets[3], brier, log_loss, auc[3], intervals[3][2];
};
static const struct expected all[] = {
    {2,
     false,
     0.471764216,
     {0.0, -0.767071301},
     {0.662962962963, 0.337037037037},
     0.10980897401,
     0.35191249190,
     {0.9296875, 0.9296875},
     {{0.7056423362, 0.9845967031}, {0.7056423362, 0.9845967031}}},
    {3,
     false,
     0.374598465,
     {0.0, 0.124222945, 0.059138711},
     {0.294886363636, 0.371969696970, 0.333143939394},
     0.17598619008,
     0.63138427383,
     {0.915966386555, 0.922222222222, 0.9296875},
     {{0.6763018579, 0.9803345044}, {0.7035301853, 0.9812415256}, {0.7056423362, 0.9845967031}}},
    {3,
     true,
     0.144235187,
     {0.0, -0.064790362, -0.037792604},
     {0.333333333333, 0.333333333333, 0.333333333333},
     0.29235154016,
     0.97872921288,
     {0.66015625, 0.71484375, 0.83984375},
     {{0.3257241954, 0.8809741968}, {0.3689031253, 0.9090208462}, {0.4795726432, 0.9635485922}}},
};

static void check(const struct expected *e)
{
    size_t labels[N], subjects[N];
    double evidence[3 * N], probabilities[3 * N];
    double priors[3];
    const size_t *given = e->pairs ? subjects : NULL;
    struct srnf_platt platt;
    struct srnf_assessment a;

    fill(e->classes, evidence, labels);
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i / 2;
        labels[i] = e->pairs ? labels[i / 2 * 2] : labels[i];
    }
    for (size_t c = 0; c < e->classes; c++) {
        priors[c] = 1.0 / (double)e->classes;
    }
    assert_int_equal(srnf_platt_fit(N, e->classes, evidence, labels, given, &platt), SRNF_OK);
    assert_true(fabs(platt.slope - e->slope) < 1e-7);
    assert_true(compare_difference(e->classes, platt.offsets, e->offsets) < 1e-7);
    assert_true(compare_difference(e->classes, platt.targets, e->targets) < 1e-11);
    for (size_t i = 0; i < N; i++) {
        srnf_platt_apply(&platt, priors, evidence + i * e->classes, probabilities + i * e->classes);
    }
    assert_int_equal(
        srnf_assess(N, e->classes, labels, given, evidence, probabilities, priors, NULL, &a),
        SRNF_OK);
    assert_true(fabs(a.scores.brier - e->brier) < 1e-7);
    assert_true(fabs(a.scores.log_loss - e->log_loss) < 1e-7);
    assert_true(fabs(a.scores.log_loss_reference - log((double)e->classes)) < 1e-12);
    assert_int_equal(a.subjects, e->pairs ? N / 2 : N);
    for (size_t c = 0; c < e->classes; c++) {
        size_t members = 0;

        assert_true(fabs(a.auc[c].value - e->auc[c]) < 1e-11);
        assert_true(compare_difference(2, a.auc[c].interval, e->intervals[c]) < 1e-9);
        assert_true(a.sensitivity[c].value >= a.sensitivity[c].interval[0] &&
                    a.sensitivity[c].value <= a.sensitivity[c].interval[1]);
        for (size_t b = 0; b < SRNF_RELIABILITY_BINS; b++) {
            members += a.reliability[c * SRNF_RELIABILITY_BINS + b].members;
        }
        assert_int_equal(members, N);
    }
    srnf_assessment_clear(&a);
    srnf_platt_clear(&platt);
}

static void agrees_with_scipy(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
        check(&all[k]);
    }
}

static void intervals(void **state)
{
    const double given[3][3] = {{1.0, 10.0, 12.0}, {0.5, 30.0, 40.0}, {0.83, 25.0, 25.0}};
    const double expected[3][2] = {
        {0.8159170107, 1.0}, {0.3682329515, 0.6317670485}, {0.6815265717, 0.9135242191}};
    double interval[2];
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        srnf_auc_interval(given[k][0], given[k][1], given[k][2], interval);
        assert_true(compare_difference(2, interval, expected[k]) < 1e-9);
    }
}

static void compares_methods(void **state)
{
    const size_t counts[3][2] = {{1, 8}, {3, 4}, {0, 5}};
    const double expected[3] = {0.0390625, 1.0, 0.0625};
    bool first[N], second[N];
    size_t only[2], subjects[N];
    double p;
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < N; i++) {
            first[i] = i < counts[k][0] || i >= 20;
            second[i] = (i >= counts[k][0] && i < counts[k][0] + counts[k][1]) || i >= 20;
            subjects[i] = i / 2 * 2;
        }
        assert_int_equal(srnf_mcnemar(N, NULL, first, second, only, &p), SRNF_OK);
        assert_true(fabs(p - expected[k]) < 1e-14);
        assert_true(only[0] == counts[k][0] && only[1] == counts[k][1]);
    }
    /* Differences of 2, 2 and 1 members: |+-2 +-2 +-1| is 5 in two of eight cases. */
    assert_int_equal(srnf_mcnemar(N, subjects, first, second, only, &p), SRNF_OK);
    assert_true(fabs(p - 0.25) < 1e-14);
}

/* Evidence against the labels is none: the probabilities are the priors, whatever is asked. */
static void says_the_priors(void **state)
{
    double evidence[2 * N], p[2];
    const double priors[2] = {0.3, 0.7};
    size_t labels[N];
    struct srnf_platt platt;
    (void)state;

    for (size_t i = 0; i < N; i++) {
        labels[i] = i % 2;
        evidence[2 * i] = (double)(i % 2) + 0.01 * (double)i;
        evidence[2 * i + 1] = 0.0;
    }
    assert_int_equal(srnf_platt_fit(N, 2, evidence, labels, NULL, &platt), SRNF_OK);
    assert_true(platt.slope == 0.0);
    srnf_platt_apply(&platt, priors, evidence, p);
    assert_true(compare_difference(2, p, priors) < 1e-15);
    srnf_platt_clear(&platt);
}

static void weighs_classes(void **state)
{
    double evidence[2 * N], p[2 * N];
    const double priors[2] = {0.5, 0.5};
    size_t labels[N];
    struct srnf_assessment a;
    (void)state;

    for (size_t i = 0; i < N; i++) { /* always the first class, which has three of four */
        labels[i] = i >= 18;
        evidence[2 * i] = 1.0;
        evidence[2 * i + 1] = 0.0;
        p[2 * i] = 0.8;
        p[2 * i + 1] = 0.2;
    }
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_OK);
    assert_true(a.accuracy.value == 0.75 && a.majority == 0.75);
    assert_true(fabs(a.chance - 0.625) < 1e-15);
    assert_true(fabs(a.balanced.value - 0.5) < 1e-15);
    assert_true(a.balanced.interval[0] > 0.3 && a.balanced.interval[1] < 0.7);
    assert_true(a.auc[0].value == 0.5);
    assert_true(fabs(a.scores.brier - 0.5 * (0.04 + 0.64)) < 1e-14);
    assert_true(fabs(a.scores.brier_reference - 0.25) < 1e-14);
    assert_true(fabs(a.unweighted.brier - (0.75 * 0.04 + 0.25 * 0.64)) < 1e-14);
    assert_true(fabs(a.unweighted.log_loss + 0.75 * log(0.8) + 0.25 * log(0.2)) < 1e-14);
    assert_true(fabs(a.unweighted.brier_reference - 0.25) < 1e-14);
    srnf_assessment_clear(&a);
}

/* Members that depend on each other: shares count fewer, all other lengths grow by the roots. */
static void dispersions_widen(void **state)
{
    struct srnf_dispersion of_classes[4] = {{4.0, 2.0}, {4.0, 2.0}, {9.0, 4.0}, {9.0, 4.0}};
    const struct srnf_dispersions d = {.relabellings = 1,
                                       .accuracy = {4.0, 2.0},
                                       .balanced = {4.0, 1.0},
                                       .sensitivity = of_classes,
                                       .auc = of_classes + 2};
    const double priors[2] = {0.5, 0.5};
    double evidence[2 * N], p[2 * N], log_brier[2];
    size_t labels[N];
    struct srnf_assessment a, b;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        labels[i] = i % 2;
        evidence[2 * i] = (double)((i * 7) % 5) + (labels[i] ? 0.0 : 1.5);
        evidence[2 * i + 1] = 2.0;
        p[2 * i] = 0.1 + 0.15 * ((double)((i * 7) % 5) + (labels[i] ? 0.0 : 1.0));
        p[2 * i + 1] = 1.0 - p[2 * i];
    }
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_OK);
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, &d, &b), SRNF_OK);
    assert_true(b.accuracy.value == a.accuracy.value && b.scores.brier == a.scores.brier);
    assert_true(fabs(b.effective - (double)N / 4.0) < 1e-12);
    assert_true(b.accuracy.interval[0] < a.accuracy.interval[0]);
    assert_true(b.accuracy.interval[1] > a.accuracy.interval[1]);
    assert_true(b.auc[0].interval[0] < a.auc[0].interval[0]);
    assert_true(b.auc[0].interval[1] > a.auc[0].interval[1]);
    assert_true(b.balanced.interval[0] == a.balanced.interval[0]);
    assert_true(b.balanced.interval[1] > a.balanced.interval[1]);
    assert_true(a.scores.brier_interval[0] < a.scores.brier &&
                a.scores.brier < a.scores.brier_interval[1]);
    assert_true(a.scores.log_loss_interval[0] < a.scores.log_loss &&
                a.scores.log_loss < a.scores.log_loss_interval[1]);
    assert_true(a.unweighted.brier_interval[0] < a.unweighted.brier);
    assert_true(a.unweighted.brier_interval[1] > a.unweighted.brier);
    log_brier[0] = log(a.scores.brier_interval[1] / a.scores.brier);
    log_brier[1] = log(b.scores.brier_interval[1] / b.scores.brier);
    assert_true(fabs(log_brier[1] / log_brier[0] - 2.0) < 1e-9);
    srnf_assessment_clear(&a);
    srnf_assessment_clear(&b);
}

/* All are told: shares are 1, and no rounding beside it, whatever the number of members. */
static void perfect_shares_are_one(void **state)
{
    const double priors[2] = {0.5, 0.5};
    double evidence[2 * N], p[2 * N];
    size_t labels[N];

    (void)state;
    for (size_t first = 1; first < N; first++) {
        struct srnf_assessment a;

        for (size_t i = 0; i < N; i++) {
            labels[i] = i >= first;
            evidence[2 * i] = p[2 * i] = labels[i] ? 0.25 : 0.75;
            evidence[2 * i + 1] = p[2 * i + 1] = 1.0 - p[2 * i];
        }
        assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_OK);
        assert_true(a.sensitivity[0].value == 1.0 && a.sensitivity[1].value == 1.0);
        assert_true(a.balanced.value == 1.0 && a.accuracy.value == 1.0);
        srnf_assessment_clear(&a);
    }
}

/* One subject does not say how scores of its class vary: no interval, where one that knows nothing
   of it would be of no width or too narrow. Two subjects have one. */
static void a_class_of_one_subject_has_no_interval(void **state)
{
    enum { MEMBERS = 7 };
    const double priors[2] = {0.5, 0.5};
    const size_t labels[3][MEMBERS] = {
        {0, 1, 1, 1, 1, 1, 1}, {0, 0, 1, 1, 1, 1, 1}, {0, 0, 1, 1, 1, 1, 1}};
    const size_t subjects[3][MEMBERS] = {
        {0, 1, 2, 3, 4, 5, 6}, {0, 0, 1, 2, 3, 4, 5}, {0, 1, 2, 3, 4, 5, 6}};
    double evidence[2 * MEMBERS], p[2 * MEMBERS];

    (void)state;
    for (size_t i = 0; i < MEMBERS; i++) {
        evidence[2 * i] = p[2 * i] = 0.2 + 0.07 * (double)i;
        evidence[2 * i + 1] = p[2 * i + 1] = 1.0 - p[2 * i];
    }
    for (size_t k = 0; k < 3; k++) {
        struct srnf_assessment a;
        const struct srnf_scores *scores[2] = {&a.scores, &a.unweighted};

        assert_int_equal(
            srnf_assess(MEMBERS, 2, labels[k], subjects[k], evidence, p, priors, NULL, &a),
            SRNF_OK);
        for (size_t j = 0; j < 2; j++) {
            const struct srnf_scores *of = scores[j];

            assert_true(of->brier > 0.0 && of->log_loss > 0.0);
            for (size_t end = 0; end < 2; end++) {
                assert_true(isnan(of->brier_interval[end]) == (k < 2));
                assert_true(isnan(of->log_loss_interval[end]) == (k < 2));
            }
        }
        assert_true(k < 2 || a.scores.brier_interval[0] < a.scores.brier);
        srnf_assessment_clear(&a);
    }
}

static void refuses(void **state)
{
    double evidence[3 * N] = {0}, p[2 * N], priors[2] = {0.5, 0.5};
    size_t labels[N], subjects[N] = {0}, only[2];
    bool right[N] = {false};
    struct srnf_platt platt;
    struct srnf_assessment a;
    (void)state;

    for (size_t i = 0; i < N; i++) {
        labels[i] = i % 2;
        p[2 * i] = p[2 * i + 1] = 0.5;
    }
    subjects[3] = N;
    assert_int_equal(srnf_platt_fit(N, 2, evidence, labels, subjects, &platt), SRNF_EINVAL);
    assert_int_equal(srnf_platt_fit(N, 3, evidence, labels, NULL, &platt), SRNF_EINVAL);
    assert_int_equal(srnf_platt_fit(N, 1, evidence, labels, NULL, &platt), SRNF_EINVAL);
    assert_int_equal(srnf_assess(N, 2, labels, subjects, evidence, p, priors, NULL, &a),
                     SRNF_EINVAL);
    assert_int_equal(srnf_assess(N, 1, labels, NULL, evidence, p, priors, NULL, &a), SRNF_EINVAL);
    assert_int_equal(srnf_mcnemar(N, subjects, right, right, only, p), SRNF_EINVAL);
    assert_int_equal(srnf_mcnemar(0, NULL, right, right, only, p), SRNF_EINVAL);
    evidence[5] = NAN;
    assert_int_equal(srnf_platt_fit(N, 2, evidence, labels, NULL, &platt), SRNF_EINVAL);
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_EINVAL);
    evidence[5] = 0.0;
    priors[1] = 0.0;
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_EINVAL);
    priors[1] = 0.5;
    for (size_t i = 0; i < N; i++) {
        labels[i] = 0;
    }
    assert_int_equal(srnf_assess(N, 2, labels, NULL, evidence, p, priors, NULL, &a), SRNF_EINVAL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_scipy),
        cmocka_unit_test(intervals),
        cmocka_unit_test(compares_methods),
        cmocka_unit_test(says_the_priors),
        cmocka_unit_test(weighs_classes),
        cmocka_unit_test(dispersions_widen),
        cmocka_unit_test(perfect_shares_are_one),
        cmocka_unit_test(a_class_of_one_subject_has_no_interval),
        cmocka_unit_test(refuses),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
