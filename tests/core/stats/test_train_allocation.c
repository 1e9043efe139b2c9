/*
 * test_train_allocation.c - classifiers that are kept, when memory runs out: allocations in turn
 * are refused; the call fails cleanly and nothing leaks.
 * srnfd-test: slow
 */
#include "group.h"
#include "support/refusing.h"

#define N ((size_t)10)
#define DEGREE 5

static struct group g;
static size_t labels[N], subjects[N];
static double evidence[2 * N], probabilities[2 * N];
static bool right[N];
static struct srnf_train_options options;
static struct srnf_trained trained;

static int run_platt(void)
{
    struct srnf_platt platt = {.classes = 0};
    int status = srnf_platt_fit(N, 2, evidence, labels, subjects, &platt);

    assert_true((platt.offsets != NULL) == (status == SRNF_OK));
    srnf_platt_clear(&platt);
    return status;
}

static int run_assess(void)
{
    const double priors[2] = {0.5, 0.5};
    struct srnf_assessment a = {.n = 0};
    int status = srnf_assess(N, 2, labels, subjects, evidence, probabilities, priors, NULL, &a);

    assert_true((a.predicted != NULL) == (status == SRNF_OK));
    srnf_assessment_clear(&a);
    return status;
}

static int run_mcnemar(void)
{
    size_t only[2];
    double p;

    return srnf_mcnemar(N, subjects, right, right, only, &p);
}

static int run_train(void)
{
    struct srnf_trained t = {.n = 0};
    int status = srnf_train(g.sht, N, g.surfaces, labels, 2, &options, NULL, &t, NULL);

    assert_true((t.target != NULL) == (status == SRNF_OK));
    srnf_trained_clear(&t);
    return status;
}

static int run_predict(void)
{
    const struct srnf_frozen frozen = {.classifier = &trained.classifier,
                                       .pca = &trained.pca,
                                       .n_parts = trained.n_parts,
                                       .target = trained.target,
                                       .mean_q = trained.mean_q,
                                       .labels = labels,
                                       .subjects = N};
    struct srnf_class_prediction prediction;

    return srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &options.registration, NULL,
                        NULL, &prediction, evidence, probabilities, NULL);
}

static int run_check(void)
{
    return srnf_classifier_check(&trained.classifier, NULL);
}

static void numbers_survive(void **state)
{
    (void)state;
    refusing_sweep("calibration", run_platt, 100, 1);
    refusing_sweep("assessment", run_assess, 100, 1);
    refusing_sweep("comparison of methods", run_mcnemar, 100, 1);
}

static void training_survives(void **state)
{
    (void)state;
    options.gauss = false;
    refusing_sweep("training of neighbours", run_train, 3, 397);
    options.gauss = true;
    refusing_sweep("training of Gaussians", run_train, 3, 397);
}

static void predicting_survives(void **state)
{
    (void)state;
    assert_int_equal(srnf_train(g.sht, N, g.surfaces, labels, 2, &options, NULL, &trained, NULL),
                     SRNF_OK);
    refusing_sweep("predicting", run_predict, 10, 23);
    refusing_sweep("the check of a classifier", run_check, 1, 1);
    srnf_trained_clear(&trained);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_survive),
        cmocka_unit_test(training_survives),
        cmocka_unit_test(predicting_survives),
    };
    int failed;

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    group_open_stars(&g, DEGREE, N, 0.3);
    options = srnf_train_options_defaults();
    options.registration.degree = 2;
    options.relabellings = 2;
    options.registration.common_pose = true;
    for (size_t i = 0; i < N; i++) {
        labels[i] = i % 2;
        subjects[i] = i;
        right[i] = i > 3;
        evidence[2 * i] = (double)(i % 3);
        probabilities[2 * i] = probabilities[2 * i + 1] = 0.5;
    }
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    group_close(&g);
    return failed;
}
