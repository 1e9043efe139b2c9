/*
 * test_train.c - classifiers that are kept: that nested validation sees nothing of whom it leaves
 * out, that what is kept says of its own members what it was made of, and what is refused.
 */
#include "group.h"

#define CLASS ((size_t)6)
#define N (2 * CLASS)
#define DEGREE 5

static size_t labels[N];

/* Stars, the second half of them flattened a little. */
static void open_classes(struct group *g)
{
    group_open_stars(g, DEGREE, N, 0.25);
    for (size_t i = 0; i < N; i++) {
        labels[i] = i >= CLASS;
        for (size_t k = 0; k < g->each && labels[i]; k++) {
            g->f[i][2 * g->each + k] *= 0.75;
        }
    }
}

static struct srnf_train_options options_of(bool gauss)
{
    struct srnf_train_options options = srnf_train_options_defaults();

    options.gauss = gauss;
    options.registration.degree = 2;
    options.registration.common_pose = true; /* which is faster */
    return options;
}

static int train(const struct group *g, const size_t *given, const struct srnf_train_options *o,
                 struct srnf_trained *trained, struct srnf_error *error)
{
    return srnf_train(g->sht, g->n, g->surfaces, given, 2, o, NULL, trained, error);
}

static struct srnf_frozen freeze(const struct srnf_trained *trained)
{
    return (struct srnf_frozen){.classifier = &trained->classifier,
                                .pca = &trained->pca,
                                .target = trained->target,
                                .mean_q = trained->mean_q,
                                .labels = labels,
                                .subjects = N};
}

/* Members are known again, with the scores they were trained by; another one of a class is told. */
static void check_predictions(const struct group *g, const struct srnf_train_options *options,
                              const struct srnf_trained *trained)
{
    const struct srnf_frozen frozen = freeze(trained);
    const double equal[2] = {0.5, 0.5}, first[2] = {0.999999, 0.000001};
    struct srnf_class_prediction predictions[N];
    double evidence[2 * N], probabilities[2 * N], others[2 * N];

    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, &options->registration, NULL,
                                  NULL, predictions, evidence, probabilities, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_true(predictions[i].nearest < 1e-6);
        assert_true(predictions[i].residual < 1e-6);
        assert_true(fabs(predictions[i].distance - trained->distances[i]) < 1e-6);
        assert_true(fabs(probabilities[2 * i] + probabilities[2 * i + 1] - 1.0) < 1e-14);
        assert_int_equal(srnf_platt_choose(2, probabilities + 2 * i, evidence + 2 * i), labels[i]);
    }
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, &options->registration, equal,
                                  NULL, predictions, evidence, others, NULL),
                     SRNF_OK);
    assert_true(compare_difference(2 * N, probabilities, others) < 1e-12);
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, &options->registration, first,
                                  NULL, predictions, evidence, others, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        double odds = probabilities[2 * i + 1] / probabilities[2 * i] * first[1] / first[0];

        assert_true(fabs(others[2 * i + 1] / others[2 * i] / odds - 1.0) < 1e-9);
    }
}

static void check_trained(const struct group *g, bool gauss)
{
    struct srnf_train_options options = options_of(gauss);
    struct srnf_trained trained;

    assert_int_equal(train(g, labels, &options, &trained, NULL), SRNF_OK);
    assert_true(trained.assessment.accuracy.value >= 10.0 / 12.0);
    assert_true(fabs(trained.assessment.balanced.value - trained.assessment.accuracy.value) <
                1e-12);
    assert_true(trained.classifier.platt.slope > 0.0);
    assert_true(trained.classifier.priors[0] == 0.5);
    assert_true((trained.components != NULL) == gauss && trained.classifier.gauss == gauss);
    for (size_t i = 0; i < N; i++) {
        const double *p = trained.probabilities + 2 * i;

        assert_true(p[0] > 0.0 && p[1] > 0.0 && fabs(p[0] + p[1] - 1.0) < 1e-14);
        assert_true(trained.nearest[i] > 0.0 && trained.residuals[i] < 1e-6);
    }
    check_predictions(g, &options, &trained);
    srnf_trained_clear(&trained);
}

static void is_kept_and_asked(void **state)
{
    struct group g;
    (void)state;

    open_classes(&g);
    check_trained(&g, true);
    check_trained(&g, false);
    group_close(&g);
}

/* What is said of a member rests on the others alone: its own label changes no bit of it, and all
   that is said of others. */
static void nested_means_nested(void **state)
{
    struct srnf_train_options options = options_of(true);
    size_t other[N];
    struct srnf_trained before, after;
    struct srnf_error error;
    struct group g;
    (void)state;

    open_classes(&g);
    options.priors = SRNF_PRIORS_EQUAL;
    assert_int_equal(train(&g, labels, &options, &before, NULL), SRNF_OK);
    memcpy(other, labels, sizeof labels);
    other[N - 1] = 0; /* five are left of its class, seven of the other */
    assert_int_equal(train(&g, other, &options, &after, &error), SRNF_OK);
    assert_true(
        compare_difference(2, before.evidence + 2 * (N - 1), after.evidence + 2 * (N - 1)) == 0.0);
    assert_true(compare_difference(2, before.probabilities + 2 * (N - 1),
                                   after.probabilities + 2 * (N - 1)) == 0.0);
    assert_true(before.evidence[0] != after.evidence[0]);
    srnf_trained_clear(&after);
    srnf_trained_clear(&before);
    group_close(&g);
}

static void refused(const struct group *g, const size_t *given, size_t classes,
                    const struct srnf_train_options *options, const char *why)
{
    struct srnf_trained trained;
    struct srnf_error error = {0};

    assert_int_equal(
        srnf_train(g->sht, g->n, g->surfaces, given, classes, options, NULL, &trained, &error),
        SRNF_EINVAL);
    assert_non_null(strstr(error.message, why));
}

static void refuses(void **state)
{
    struct srnf_train_options options = options_of(true);
    size_t few[N] = {0}, beyond[N] = {0}, subjects[N];
    struct group g;
    (void)state;

    open_classes(&g);
    for (size_t i = 0; i < N; i++) {
        few[i] = i >= N - 4;
        subjects[i] = i / 2;
    }
    beyond[3] = 2;
    refused(&g, few, 2, &options, "class 1 has 4 subjects");
    refused(&g, labels, 1, &options, "1 classes");
    refused(&g, beyond, 2, &options, "label 2 of member 3");
    options.subjects = subjects;
    refused(&g, labels, 2, &options, "class 0 has 3 subjects");
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i % CLASS;
    }
    refused(&g, labels, 2, &options, "labels differ within a subject");
    options.subjects = NULL;
    options.components = 8;
    refused(&g, labels, 2, &options, "8 components are more");
    options.components = 65;
    refused(&g, labels, 2, &options, "components 65");
    group_close(&g);
}

static void refuses_to_predict(void **state)
{
    struct srnf_platt platt = {.classes = 2, .slope = 1.0};
    double zeros[4] = {0}, means[2] = {0, 0}, ones[2] = {1, 1}, prior[2] = {0.5, 0.5};
    double wrong[2] = {1.0, 0.0};
    struct srnf_classifier classifier = {
        .classes = 2, .gauss = true, .components = 1, .means = means, .covariances = ones};
    size_t of[2] = {0, 5};
    struct srnf_pca pca = {.n = 2, .components = 0, .eigenvalues = zeros, .scores = zeros};
    struct srnf_frozen frozen = {.classifier = &classifier, .pca = &pca, .labels = of};
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_class_prediction prediction;
    struct srnf_error error;
    double evidence[2], p[2];
    struct group g;
    (void)state;

    group_open_stars(&g, DEGREE, 1, 0.2);
    classifier.platt = platt;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, &registration, prior, NULL,
                                  &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "1 components of 0"));
    pca.components = 1;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, &registration, prior, NULL,
                                  &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "label 5 of member 1"));
    of[1] = 1;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, &registration, wrong, NULL,
                                  &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "prior 1"));
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_kept_and_asked),
        cmocka_unit_test(nested_means_nested),
        cmocka_unit_test(refuses),
        cmocka_unit_test(refuses_to_predict),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
