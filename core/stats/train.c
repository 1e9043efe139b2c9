/*
 * train.c - a classifier with its nested validation (srnf/train.h).
 *
 * The outer folds are those of srnf_folds_compare, each of one subject, with the evidence that
 * srnf_classify_gauss or srnf_classify_nearest has for it. Each is calibrated by classifiers within
 * it (train_calibrate.c), and the classifier of all members likewise (train_freeze.c). Of several
 * structures each is compared in folds of its own (folds_join.c); all that follows works on the
 * weighted sums of their inner products and on stacked fields.
 */
#include "train.h"

#include <math.h>
#include <string.h>

#define COMPONENTS 20
#define COST_COMPARISON 0.9 /* of the progress; the validation has the rest */

struct srnf_train_options srnf_train_options_defaults(void)
{
    return (struct srnf_train_options){.relabellings = SRNF_RELABELLINGS,
                                       .gauss = true,
                                       .registration = srnf_register_options_defaults(),
                                       .feature_weight = 1.0,
                                       .n_parts = 1,
                                       .position_weight = 1.0};
}

void srnf_trained_clear(struct srnf_trained *t)
{
    srnf_free(t->medoids);
    srnf_free(t->pairs);
    srnf_free(t->target);
    srnf_free(t->mean_q);
    srnf_pca_clear(&t->pca);
    srnf_calibration_clear(&t->calibration);
    srnf_free(t->distances);
    srnf_free(t->residuals);
    srnf_free(t->nearest);
    srnf_classifier_clear(&t->classifier);
    srnf_free(t->evidence);
    srnf_free(t->probabilities);
    srnf_free(t->components);
    srnf_assessment_clear(&t->assessment);
    dispersions_clear(&t->dispersions);
    *t = (struct srnf_trained){0};
}

double *train_products(const struct training *t, size_t member)
{
    double *products = srnf_alloc(t->n, t->n * sizeof(double));

    if (products) {
        folds_sum_products(&t->sum, member, products);
    }
    return products;
}

/* ---- Nested validation ----------------------------------------------------------------------- */

static int fold_body(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct training *t = argument;
    const struct subjects *s = &t->subjects;
    size_t first = s->members[s->start[subject]];
    struct srnf_platt platt = {0};
    double *products = train_products(t, first);
    int status =
        products ? train_calibrate(t, products, subject, context, &platt, error) : SRNF_ENOMEM;

    srnf_free(products);
    for (size_t m = s->start[subject]; m < s->start[subject + 1] && status == SRNF_OK; m++) {
        size_t at = s->members[m] * t->classes;

        srnf_platt_apply(&platt, t->priors, t->out->evidence + at, t->out->probabilities + at);
    }
    srnf_platt_clear(&platt);
    return status;
}

/* The evidence of the outer folds, from the classifiers that classify has. */
static int judge_outer(const struct training *t, const struct srnf_context *context,
                       struct srnf_error *error)
{
    struct srnf_classification found;
    int status = (t->options->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
        t->folds, t->labels, t->classes, &t->classifier, context, &found, error);

    if (status == SRNF_OK) {
        t->out->evidence = found.evidence;
        t->out->components = found.components;
        found.evidence = NULL;
        t->out->dispersions = found.dispersions;
        found.components = NULL;
        found.dispersions = (struct srnf_dispersions){0};
    }
    srnf_classification_clear(&found);
    return status;
}

static int validate(struct training *t, const struct srnf_context *context,
                    struct srnf_error *error)
{
    struct srnf_context quiet = srnf_quiet(context);
    struct stats_progress progress = {0.0, 1.0, "validating"};
    int status = judge_outer(t, &quiet, error);

    t->out->probabilities = srnf_alloc(t->n, t->classes * sizeof(double));
    if (status == SRNF_OK && !t->out->probabilities) {
        status = SRNF_ENOMEM;
    }
    status = status ? status : stats_run(context, t->subjects.count, fold_body, t, progress, error);
    return status ? status
                  : srnf_assess(t->n, t->classes, t->labels, t->subjects.of, t->out->evidence,
                                t->out->probabilities, t->priors, &t->out->dispersions,
                                &t->out->assessment);
}

/* ---- All of it ------------------------------------------------------------------------------- */

/* Each part by folds of its own. */
static int compare_parts(const struct srnf_sht *sht, const struct training *t,
                         const double *const *surfaces, struct stats_part *progress,
                         struct srnf_error *error)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();
    size_t n_parts = t->options->n_parts;
    int status = SRNF_OK;

    options.registration = t->options->registration;
    options.max_components = t->components;
    options.subjects = t->options->subjects;
    options.keep = true;
    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        struct srnf_context own = stats_part_enter(progress, COST_COMPARISON / (double)n_parts);

        status = srnf_folds_compare(sht, SRNF_METRIC_SRNF, t->n, surfaces + p * t->n, &options,
                                    &own, &t->parts[p], error);
    }
    return status;
}

/* The comparison of all parts together; joint: room for it where they are several. */
static int join_parts(struct training *t, const struct srnf_context *context,
                      struct srnf_folds *joint, struct srnf_error *error)
{
    struct srnf_context quiet = srnf_quiet(context);
    int status = SRNF_OK;

    t->folds = t->parts;
    if (t->options->n_parts > 1 || t->weights[0] != 1.0) {
        status = srnf_folds_join(t->options->n_parts, t->parts, t->weights, t->sum.positions,
                                 t->sum.position_weight, t->components, &quiet, joint, error);
        t->folds = joint;
    }
    t->components = t->folds->components;
    return status;
}

/* The templates of the classifier of all. */
static int take_templates(const struct srnf_sht *sht, const struct training *t,
                          const double *const *surfaces)
{
    struct srnf_trained *out = t->out;
    size_t n_parts = t->options->n_parts;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    int status = SRNF_OK;

    out->medoids = srnf_alloc(n_parts, sizeof *out->medoids);
    out->target = srnf_alloc(n_parts, count * sizeof(double));
    if (!out->medoids || !out->target) {
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        out->medoids[p] = t->parts[p].medoid;
        status = srnf_normalize(sht, surfaces[p * t->n + t->parts[p].medoid],
                                out->target + p * count, NULL);
    }
    return status;
}

/* The distances between the members of each part, from the products of its comparison. */
static int take_pairs(const struct training *t)
{
    size_t n = t->n;

    t->out->pairs = srnf_alloc(t->options->n_parts * n, n * sizeof(double));
    for (size_t p = 0; t->out->pairs && p < t->options->n_parts; p++) {
        double *pairs = t->out->pairs + p * n * n;
        const double weight = 1.0;
        const struct folds_sum own = {1, t->parts + p, &weight, NULL, 0.0};

        folds_sum_products(&own, SIZE_MAX, pairs);
        /* In place: the squares of the norms stand on the diagonal until all others are done. */
        for (size_t k = 0; k < n * n; k++) {
            size_t i = k / n, j = k % n;

            if (i != j) {
                pairs[k] = sqrt(fmax(0.0, pairs[i * n + i] + pairs[j * n + j] - 2.0 * pairs[k]));
            }
        }
        for (size_t i = 0; i < n; i++) {
            pairs[i * n + i] = 0.0;
        }
    }
    return t->out->pairs ? SRNF_OK : SRNF_ENOMEM;
}

static int train(const struct srnf_sht *sht, struct training *t, const double *const *surfaces,
                 const struct srnf_context *context, struct srnf_error *error)
{
    struct stats_part progress = {.whole = context, .all = 1.0};
    struct srnf_folds joint = {0};
    struct srnf_context own;
    int status;

    t->parts = srnf_alloc(t->options->n_parts, sizeof *t->parts);
    t->sum.parts = t->parts;
    status = t->parts ? compare_parts(sht, t, surfaces, &progress, error) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        own = stats_part_enter(&progress, 1.0 - COST_COMPARISON);
        status = join_parts(t, &own, &joint, error);
        status = status ? status : take_templates(sht, t, surfaces);
        status = status ? status : take_pairs(t);
        status = status ? status : validate(t, &own, error);
        own.progress = NULL;
        status = status ? status : train_fit_components(t, srnf_sht_grid(sht), &own);
        status = status ? status : train_freeze(t, &own, error);
    }
    srnf_folds_clear(&joint);
    for (size_t p = 0; t->parts && p < t->options->n_parts; p++) {
        srnf_folds_clear(&t->parts[p]);
    }
    srnf_free(t->parts);
    return status;
}

int srnf_train(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
               const size_t *labels, size_t n_classes, const struct srnf_train_options *options,
               const struct srnf_context *context, struct srnf_trained *trained,
               struct srnf_error *error)
{
    struct srnf_train_options defaults = srnf_train_options_defaults();
    struct srnf_trained out = {.n = n};
    struct srnf_error first = {0};
    struct training t = {.n = n, .classes = n_classes, .labels = labels, .out = &out};
    double *priors = NULL;
    size_t *counts = NULL;
    int status;

    t.options = options ? options : &defaults;
    out.n_parts = t.options->n_parts;
    t.classifier = srnf_classify_options_defaults();
    t.classifier.components = t.options->components;
    t.classifier.relabellings = t.options->relabellings;
    t.classifier.covariance = t.options->covariance;
    t.classifier.features = t.options->features;
    t.classifier.n_features = t.options->n_features;
    t.classifier.size_weight = t.options->feature_weight;
    t.components = t.options->components > COMPONENTS ? t.options->components : COMPONENTS;
    status = train_check(n, labels, n_classes, t.options, &first);
    status = status ? status : train_check_parts(t.options, n, t.weights, &t.sum, &first);
    status = status ? status : subjects_open(&t.subjects, n, t.options->subjects, &first);
    status = status ? status : train_check_labels(&t, &first);
    if (status == SRNF_OK) {
        counts = srnf_alloc(n_classes, sizeof *counts);
        t.priors = priors = srnf_alloc(n_classes, sizeof *priors);
        status = counts && priors ? train_count_classes(&t, counts, priors, &first) : SRNF_ENOMEM;
    }
    status = status ? status : train_check_components(&t, counts, &first);
    status = status ? status : train(sht, &t, surfaces, context, &first);
    subjects_clear(&t.subjects);
    srnf_free(counts);
    srnf_free(priors);
    if (status) {
        srnf_trained_clear(&out);
        return stats_fail(error, status, &first);
    }
    *trained = out;
    return SRNF_OK;
}
