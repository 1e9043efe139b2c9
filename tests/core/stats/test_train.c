/*
 * test_train.c - classifiers that are kept: that nested validation sees nothing of whom it leaves
 * out, that what is kept says of its own members what it was made of, and what is refused.
 *
 * srnfd-test: slow
 */
#include "classes.h"

#include "stats/frozen.h"

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
                                .n_parts = trained->n_parts,
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

    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_true(predictions[i].nearest < 1e-6);
        assert_true(predictions[i].residual < 1e-6);
        assert_true(fabs(predictions[i].distance - trained->distances[i]) < 1e-6);
        assert_true(fabs(probabilities[2 * i] + probabilities[2 * i + 1] - 1.0) < 1e-14);
        assert_int_equal(srnf_platt_choose(2, probabilities + 2 * i, evidence + 2 * i), labels[i]);
    }
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, equal, NULL, predictions, evidence,
                                  others, NULL),
                     SRNF_OK);
    assert_true(compare_difference(2 * N, probabilities, others) < 1e-12);
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, first, NULL, predictions, evidence,
                                  others, NULL),
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

/* ---- Numbers beside shape -------------------------------------------------------------------- */

/* One that tells the classes well and one that tells nothing, in very different units. */
static void fill_numbers(double numbers[2 * N])
{
    struct test_random random = test_random_seed(11);

    for (size_t i = 0; i < N; i++) {
        numbers[2 * i] = 500.0 + 40.0 * (double)labels[i] + 4.0 * test_random_normal(&random);
        numbers[2 * i + 1] = 1e-3 * test_random_normal(&random);
    }
}

/* rms distance over rms difference of a number, of all pairs. */
static double factor_of(const struct srnf_pca *pca, const double *numbers, size_t k)
{
    double shape = 0.0;
    double number = 0.0;

    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < i; j++) {
            for (size_t c = 0; c < pca->components; c++) {
                double d =
                    pca->scores[i * pca->components + c] - pca->scores[j * pca->components + c];

                shape += d * d;
            }
            number += (numbers[2 * i + k] - numbers[2 * j + k]) *
                      (numbers[2 * i + k] - numbers[2 * j + k]);
        }
    }
    return sqrt(shape / number);
}

/* Surfaces that are all of one class but for their numbers. */
static void check_numbers(const struct group *g, bool gauss)
{
    struct srnf_train_options options = options_of(gauss);
    struct srnf_frozen frozen;
    struct srnf_trained trained;
    struct srnf_class_prediction predictions[N];
    double numbers[2 * N];
    double evidence[2 * N];
    double probabilities[2 * N];

    fill_numbers(numbers);
    options.features = numbers;
    options.n_features = 2;
    options.components = 1;
    options.covariance = SRNF_COVARIANCE_POOLED;
    options.feature_weight = 2.0;
    assert_int_equal(train(g, labels, &options, &trained, NULL), SRNF_OK);
    assert_int_equal(trained.classifier.features, 2);
    printf("# %s: %zu of %zu right\n", gauss ? "Gaussians" : "nearest", trained.assessment.correct,
           N);
    assert_true(trained.assessment.correct >= (gauss ? 12 : 10));
    frozen = freeze(&trained);
    frozen.numbers = numbers;
    for (size_t i = 0; i < N; i++) { /* each with the numbers of one of the other class */
        size_t other = (i + CLASS) % N;

        assert_int_equal(srnf_predict(g->sht, &frozen, 1, g->surfaces + i, NULL, numbers + 2 * i,
                                      &options.registration, NULL, NULL, predictions, evidence,
                                      probabilities, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_platt_choose(2, probabilities, evidence), labels[i]);
        assert_true(gauss || fabs(evidence[labels[i]]) < 1e-6); /* it is its own neighbour */
        assert_int_equal(srnf_predict(g->sht, &frozen, 1, g->surfaces + i, NULL,
                                      numbers + 2 * other, &options.registration, NULL, NULL,
                                      predictions, evidence, probabilities, NULL),
                         SRNF_OK);
        assert_true(!gauss || srnf_platt_choose(2, probabilities, evidence) == labels[other]);
        assert_true(gauss || evidence[labels[i]] < -1e-3);
        assert_true(predictions->nearest < 1e-6); /* which is of shape alone */
    }
    for (size_t k = 0; k < 2 && !gauss; k++) {
        figure_below(
            "factor off, relative",
            fabs(trained.classifier.factors[k] / (2.0 * factor_of(&trained.pca, numbers, k)) - 1.0),
            1e-8);
    }
    assert_int_equal(srnf_predict(g->sht, &frozen, 1, g->surfaces, NULL, NULL,
                                  &options.registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_EINVAL);
    srnf_trained_clear(&trained);
}

static void numbers_count_beside_shape(void **state)
{
    struct group g;
    (void)state;

    group_open_stars(&g, DEGREE, N, 0.25); /* no class differs in shape */
    for (size_t i = 0; i < N; i++) {
        labels[i] = i >= CLASS;
    }
    check_numbers(&g, true);
    check_numbers(&g, false);
    group_close(&g);
}

/* What is said of a member rests on its numbers and the others: its label changes no bit of it. */
static void numbers_are_nested_too(void **state)
{
    struct srnf_trained before, after;
    struct group g;
    double numbers[2 * N];
    size_t other[N];
    (void)state;

    open_classes(&g);
    fill_numbers(numbers);
    memcpy(other, labels, sizeof labels);
    other[N - 1] = 0;
    for (int gauss = 0; gauss < (FIGURES_SLOW ? 1 : 2); gauss++) { /* as nested above */
        struct srnf_train_options options = options_of(gauss);

        options.priors = SRNF_PRIORS_EQUAL;
        options.components = 1;
        options.covariance = SRNF_COVARIANCE_POOLED;
        options.features = numbers;
        options.n_features = 2;
        assert_int_equal(train(&g, labels, &options, &before, NULL), SRNF_OK);
        assert_int_equal(train(&g, other, &options, &after, NULL), SRNF_OK);
        assert_true(compare_difference(2, before.evidence + 2 * (N - 1),
                                       after.evidence + 2 * (N - 1)) == 0.0);
        assert_true(compare_difference(2, before.probabilities + 2 * (N - 1),
                                       after.probabilities + 2 * (N - 1)) == 0.0);
        assert_true(before.probabilities[0] != after.probabilities[0]);
        srnf_trained_clear(&after);
        srnf_trained_clear(&before);
    }
    group_close(&g);
}

/* Without the one member that has another value a number is the same in all, and says nothing of
   that member: rounding of it must not either. */
static void a_number_of_one_member_alone_in_folds(void **state)
{
    static const double others[] = {1.0, 0.1, 1.0 / 3.0};
    const size_t odd = 3;
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_classification with, without;
    double numbers[N];
    struct srnf_folds c;

    (void)state;
    classes_two(N, CLASS, labels);
    c = classes_open(N, 4, 0.5, labels, 9);
    assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &without, NULL), SRNF_OK);
    options.features = numbers;
    options.n_features = 1;
    for (size_t t = 0; t < sizeof others / sizeof others[0]; t++) {
        for (size_t i = 0; i < N; i++) {
            numbers[i] = i == odd ? 0.0 : others[t];
        }
        assert_int_equal(srnf_classify_nearest(&c, labels, 2, &options, NULL, &with, NULL),
                         SRNF_OK);
        assert_memory_equal(with.evidence + 2 * odd, without.evidence + 2 * odd,
                            2 * sizeof(double));
        assert_int_equal(with.predicted[odd], without.predicted[odd]);
        srnf_classification_clear(&with);
        assert_int_equal(srnf_classify_gauss(&c, labels, 2, &options, NULL, &with, NULL),
                         SRNF_ENUMERIC);
    }
    srnf_classification_clear(&without);
    classes_clear(&c);
}

/* Minus distances to the nearest of each class, of members with one number or none. */
static void judge_nearest(const double *products, const double *numbers, size_t left_out,
                          double evidence[2 * N])
{
    const struct frozen_numbers beside = {numbers != NULL, numbers, 1.0};
    struct subjects subjects;

    assert_int_equal(subjects_open(&subjects, N, NULL, NULL), SRNF_OK);
    assert_int_equal(
        frozen_judge_nearest(&subjects, products, &beside, labels, 2, left_out, evidence), SRNF_OK);
    subjects_clear(&subjects);
}

/* A number that one member alone has otherwise says nothing of it, nor of the others without it. */
static void a_number_of_one_member_alone(void **state)
{
    static const double others[] = {1.0, 0.1, 1.0 / 3.0, 1e6 / 3.0};
    const size_t odd = 5;
    struct test_random random = test_random_seed(3);
    double points[N][3], products[N * N], numbers[N], with[2 * N], without[2 * N];
    (void)state;

    for (size_t i = 0; i < N; i++) {
        labels[i] = i >= CLASS;
        for (size_t k = 0; k < 3; k++) {
            points[i][k] = test_random_normal(&random);
        }
        for (size_t j = 0; j <= i; j++) {
            products[i * N + j] = products[j * N + i] =
                1.0 + 0.01 * (points[i][0] * points[j][0] + points[i][1] * points[j][1] +
                              points[i][2] * points[j][2]);
        }
    }
    for (size_t t = 0; t < sizeof others / sizeof others[0]; t++) {
        for (size_t i = 0; i < N; i++) {
            numbers[i] = i == odd ? 0.0 : others[t];
        }
        judge_nearest(products, NULL, SIZE_MAX, without);
        judge_nearest(products, numbers, SIZE_MAX, with);
        assert_true(compare_difference(2, with + 2 * odd, without + 2 * odd) < 1e-12);
        judge_nearest(products, NULL, odd, without);
        judge_nearest(products, numbers, odd, with);
        assert_true(compare_difference(2 * odd, with, without) < 1e-12);
    }
}

/* ---- Several structures ---------------------------------------------------------------------- */

static const double part_weights[2] = {1.0, 3.0};

/* Two stars of each subject, part after part; the second of one class is flattened a little. */
static void open_two_parts(struct group *g)
{
    group_open_stars(g, DEGREE, 2 * N, 0.25);
    for (size_t i = 0; i < N; i++) {
        labels[i] = i >= CLASS;
        for (size_t k = 0; k < g->each && labels[i]; k++) {
            g->f[N + i][2 * g->each + k] *= 0.75;
        }
    }
}

static void train_parts(const struct group *g, const size_t *given,
                        const struct srnf_train_options *options, struct srnf_trained *trained)
{
    struct srnf_error error = {0};

    if (srnf_train(g->sht, N, g->surfaces, given, 2, options, NULL, trained, &error)) {
        fail_msg("training: %s", error.message);
    }
}

/* The evidence of Gaussians that the joint folds have for whom they leave out. */
static void judge_joint(const struct group *g, const struct srnf_train_options *options,
                        double evidence[2 * N])
{
    struct srnf_folds_options folds = srnf_folds_options_defaults();
    struct srnf_classify_options classify = srnf_classify_options_defaults();
    struct srnf_folds parts[2], joint;
    struct srnf_classification found;

    folds.registration = options->registration;
    folds.keep = true;
    for (size_t p = 0; p < 2; p++) {
        assert_int_equal(srnf_folds_compare(g->sht, SRNF_METRIC_SRNF, N, g->surfaces + p * N,
                                            &folds, NULL, &parts[p], NULL),
                         SRNF_OK);
    }
    assert_int_equal(srnf_folds_join(2, parts, part_weights, NULL, 0.0, folds.max_components, NULL,
                                     &joint, NULL),
                     SRNF_OK);
    assert_int_equal(srnf_classify_gauss(&joint, labels, 2, &classify, NULL, &found, NULL),
                     SRNF_OK);
    memcpy(evidence, found.evidence, 2 * N * sizeof(double));
    srnf_classification_clear(&found);
    srnf_folds_clear(&joint);
    srnf_folds_clear(&parts[0]);
    srnf_folds_clear(&parts[1]);
}

/* Its own subjects are known again; what the parts have adds up to what all have. */
static void check_known(const struct group *g, const struct srnf_train_options *options,
                        const struct srnf_trained *trained)
{
    struct srnf_frozen frozen = freeze(trained);
    struct srnf_class_prediction predictions[N];
    double evidence[2 * N], probabilities[2 * N];

    frozen.weights = part_weights;
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        const struct srnf_class_prediction *p = &predictions[i];

        assert_true(p->nearest < 1e-6 && p->residual < 1e-6);
        assert_true(fabs(p->distance - trained->distances[i]) < 1e-6);
        assert_true(fabs(hypot(p->parts[0].distance, p->parts[1].distance) - p->distance) < 1e-12);
        assert_true(p->parts[0].distance > 0.01 && p->parts[1].distance > 0.01);
        assert_int_equal(srnf_platt_choose(2, probabilities + 2 * i, evidence + 2 * i), labels[i]);
    }
    for (size_t k = 0; k < g->each; k++) { /* one part of the first is another star */
        g->f[0][k] *= 1.5;
    }
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_OK);
    for (size_t k = 0; k < g->each; k++) {
        g->f[0][k] /= 1.5;
    }
    assert_true(predictions[0].residual > 0.01 && predictions[1].residual < 1e-6);
    assert_true(fabs(hypot(predictions[0].parts[0].residual, predictions[0].parts[1].residual) -
                     predictions[0].residual) < 1e-12);
}

static void several_structures_together(void **state)
{
    struct group g;
    double evidence[2 * N];
    (void)state;

    open_two_parts(&g);
    for (int gauss = FIGURES_SLOW; gauss < 2; gauss++) { /* the other with positions, below */
        struct srnf_train_options options = options_of(gauss);
        struct srnf_trained trained;

        options.n_parts = 2;
        options.weights = part_weights;
        train_parts(&g, labels, &options, &trained);
        if (gauss) {
            judge_joint(&g, &options, evidence);
            assert_true(compare_difference(2 * N, trained.evidence, evidence) == 0.0);
        }
        assert_true(trained.assessment.correct >= 9);
        assert_true(trained.classifier.platt.slope > 0.0);
        check_known(&g, &options, &trained);
        srnf_trained_clear(&trained);
    }
    group_close(&g);
}

/* Whom a fold leaves out is told by the others alone, in its second structure as in its label. */
static void parts_are_nested_too(void **state)
{
    struct srnf_train_options options = options_of(true);
    struct srnf_trained before, after;
    size_t other[N];
    struct group g;
    (void)state;

    if (FIGURES_SLOW) { /* which would see in it what it sees above */
        skip();
    }
    open_two_parts(&g);
    options.priors = SRNF_PRIORS_EQUAL;
    options.n_parts = 2;
    memcpy(other, labels, sizeof labels);
    other[N - 1] = 0;
    train_parts(&g, labels, &options, &before);
    train_parts(&g, other, &options, &after);
    assert_true(compare_difference(2, before.probabilities + 2 * (N - 1),
                                   after.probabilities + 2 * (N - 1)) == 0.0);
    assert_true(before.probabilities[0] != after.probabilities[0]);
    srnf_trained_clear(&after);
    srnf_trained_clear(&before);
    group_close(&g);
}

/* Two structures that are alike in both classes, the second farther from the first in one. */
static void open_places(struct group *g, double positions[6 * N])
{
    struct test_random random = test_random_seed(6);

    group_open_stars(g, DEGREE, 2 * N, 0.05);
    for (size_t i = 0; i < N; i++) {
        labels[i] = i >= CLASS;
        for (size_t c = 0; c < 3; c++) {
            double apart =
                (c == 2 ? 0.5 + 0.2 * (double)labels[i] : 0.0) + 0.01 * test_random_normal(&random);

            positions[6 * i + c] = 0.5 * apart;
            positions[6 * i + 3 + c] = -0.5 * apart;
        }
    }
}

static void check_places(const struct group *g, const struct srnf_train_options *options,
                         const struct srnf_trained *trained)
{
    struct srnf_frozen frozen = freeze(trained);
    double evidence[2 * N], probabilities[2 * N];
    struct srnf_class_prediction predictions[N];

    frozen.weights = part_weights;
    frozen.position_weight = options->position_weight;
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, options->positions, NULL,
                                  &options->registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        const struct srnf_class_prediction *p = &predictions[i];
        double parts = hypot(p->parts[0].distance, p->parts[1].distance);

        assert_true(p->nearest < 1e-6 && p->residual < 1e-6 && p->position.residual < 1e-6);
        assert_true(fabs(p->distance - trained->distances[i]) < 1e-6);
        assert_true(p->position.distance > 0.1);
        assert_true(fabs(hypot(parts, p->position.distance) - p->distance) < 1e-12);
        assert_int_equal(srnf_platt_choose(2, probabilities + 2 * i, evidence + 2 * i), labels[i]);
    }
    assert_int_equal(srnf_predict(g->sht, &frozen, N, g->surfaces, NULL, NULL,
                                  &options->registration, NULL, NULL, predictions, evidence,
                                  probabilities, NULL),
                     SRNF_EINVAL);
}

static void positions_tell(void **state)
{
    double positions[6 * N];
    struct group g;
    (void)state;

    open_places(&g, positions);
    for (int gauss = 0; gauss < (FIGURES_SLOW ? 1 : 2); gauss++) {
        struct srnf_train_options options = options_of(gauss);
        struct srnf_trained trained;

        options.n_parts = 2;
        options.weights = part_weights;
        if (!FIGURES_SLOW) {
            train_parts(&g, labels, &options, &trained);
            assert_true(trained.assessment.correct < N);
            srnf_trained_clear(&trained);
        }
        options.positions = positions;
        options.position_weight = 4.0;
        train_parts(&g, labels, &options, &trained);
        assert_int_equal(trained.assessment.correct, N);
        check_places(&g, &options, &trained);
        srnf_trained_clear(&trained);
    }
    group_close(&g);
}

/* One part of weight 4 is the part, twice as far. */
static void weights_are_of_squares(void **state)
{
    static const double four = 4.0;
    struct srnf_train_options options = options_of(false);
    struct srnf_trained plain, heavy;
    struct group g;
    (void)state;

    open_classes(&g);
    assert_int_equal(train(&g, labels, &options, &plain, NULL), SRNF_OK);
    options.weights = &four;
    assert_int_equal(train(&g, labels, &options, &heavy, NULL), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_true(fabs(heavy.distances[i] - 2.0 * plain.distances[i]) < 1e-12);
        assert_true(fabs(heavy.nearest[i] - 2.0 * plain.nearest[i]) < 1e-9);
        assert_int_equal(heavy.assessment.predicted[i], plain.assessment.predicted[i]);
    }
    srnf_trained_clear(&plain);
    srnf_trained_clear(&heavy);
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
    refused(&g, labels, 2, &options, "8 features, 0 of them");
    options.components = 0;
    options.features = (const double[3 * N]){[7] = NAN};
    options.n_features = 3;
    refused(&g, labels, 2, &options, "a feature of member 2 is not finite");
    options.n_features = 65;
    refused(&g, labels, 2, &options, "65 features are more than 64");
    options.n_features = 0;
    options.components = 65;
    refused(&g, labels, 2, &options, "components 65");
    options.components = 0;
    options.n_parts = 0;
    refused(&g, labels, 2, &options, "0 parts are not 1 to 32");
    options.n_parts = 33;
    refused(&g, labels, 2, &options, "33 parts are not 1 to 32");
    options.n_parts = 2;
    options.weights = (const double[2]){1.0, 0.0};
    refused(&g, labels, 2, &options, "the weight of part 1 is not above 0");
    options.weights = NULL;
    options.positions = (const double[6 * N]){[13] = NAN};
    refused(&g, labels, 2, &options, "a position of member 2 is not finite");
    options.position_weight = 0.0;
    refused(&g, labels, 2, &options, "the weight of the positions is not above 0");
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
    struct srnf_frozen frozen = {
        .classifier = &classifier, .pca = &pca, .n_parts = 1, .labels = of};
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_class_prediction prediction;
    struct srnf_error error;
    double evidence[2], p[2];
    struct group g;
    (void)state;

    group_open_stars(&g, DEGREE, 1, 0.2);
    classifier.platt = platt;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &registration, prior,
                                  NULL, &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "1 components of 0"));
    pca.components = 1;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &registration, prior,
                                  NULL, &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "label 5 of member 1"));
    of[1] = 1;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &registration, wrong,
                                  NULL, &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "prior 1"));
    frozen.n_parts = 0;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &registration, prior,
                                  NULL, &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "0 parts"));
    frozen.n_parts = 1;
    frozen.weights = zeros;
    assert_int_equal(srnf_predict(g.sht, &frozen, 1, g.surfaces, NULL, NULL, &registration, prior,
                                  NULL, &prediction, evidence, p, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "weights of the parts"));
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_kept_and_asked),
        cmocka_unit_test(numbers_count_beside_shape),
        cmocka_unit_test(numbers_are_nested_too),
        cmocka_unit_test(nested_means_nested),
        cmocka_unit_test(a_number_of_one_member_alone),
        cmocka_unit_test(a_number_of_one_member_alone_in_folds),
        cmocka_unit_test(several_structures_together),
        cmocka_unit_test(parts_are_nested_too),
        cmocka_unit_test(positions_tell),
        cmocka_unit_test(weights_are_of_squares),
        cmocka_unit_test(refuses),
        cmocka_unit_test(refuses_to_predict),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
