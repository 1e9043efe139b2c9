/*
 * classify_gauss.c - the classifier by normal distributions: how many components and which
 * covariance, chosen inside the fold, and the class of the largest likelihood.
 *
 * Likelihoods for all candidates, and of training subjects as if they had been left out too, are
 * those of classify_fold.c. What is maximized is the sum over training members of the log posterior
 * probability of their own class, equal priors: a proper scoring rule, where counts of right
 * answers are too coarse to choose by.
 */
#include "classify_fold.h"

#include <math.h>
#include <string.h>

/* ---- Choosing -------------------------------------------------------------------------------- */

/* log of the posterior probability of class c, equal priors; -INFINITY where one is not defined. */
static double log_posterior(size_t classes, const double *likelihood, size_t c)
{
    double largest = -INFINITY;
    double sum = 0.0;

    for (size_t k = 0; k < classes; k++) {
        if (!(likelihood[k] > -INFINITY)) {
            return -INFINITY;
        }
        largest = fmax(largest, likelihood[k]);
    }
    for (size_t k = 0; k < classes; k++) {
        sum += exp(likelihood[k] - largest);
    }
    return likelihood[c] - largest - log(sum);
}

static void score_inner(struct classify_fold *fold, size_t *members)
{
    const struct subjects *s = fold->subjects;
    size_t candidates = CLASSIFY_KINDS * fold->d;

    memset(fold->score, 0, candidates * sizeof(double));
    for (size_t k = 0; k < s->count; k++) {
        if (k == fold->left_out) {
            continue;
        }
        classify_fold_judge(fold, k, members);
        for (size_t m = 0; m < s->size[k] * candidates; m++) {
            size_t i = s->members[s->start[k] + m / candidates];

            fold->score[m % candidates] +=
                log_posterior(fold->classes, fold->table + m * fold->classes, fold->labels[i]);
        }
    }
}

struct classify_choice classify_fold_choose(struct classify_fold *fold,
                                            const struct srnf_classify_options *options,
                                            size_t *members)
{
    size_t least = options->components ? fold->d : fold->offset + 1;
    struct classify_choice best = {
        options->covariance == SRNF_COVARIANCE_CLASS ? CLASSIFY_OWN : CLASSIFY_POOLED, least};
    double highest = -INFINITY;

    if (options->components && options->covariance != SRNF_COVARIANCE_AUTO) {
        return best;
    }
    score_inner(fold, members);
    for (size_t features = least; features <= fold->d; features++) {
        for (size_t kind = 0; kind < CLASSIFY_KINDS; kind++) {
            bool wanted = options->covariance == SRNF_COVARIANCE_AUTO ||
                          (kind == CLASSIFY_OWN) == (options->covariance == SRNF_COVARIANCE_CLASS);
            double score = fold->score[kind * fold->d + features - 1];

            if (wanted && score > highest) {
                highest = score;
                best = (struct classify_choice){kind, features};
            }
        }
    }
    return best;
}

/* ---- All folds ------------------------------------------------------------------------------- */

static int fail_singular(const struct classify_fold *fold, size_t features, size_t i,
                         struct srnf_error *error)
{
    if (fold->offset == 0) {
        return srnf_fail(error, SRNF_ENUMERIC, (int64_t)i,
                         "the covariance of %zu features is singular in the fold of subject %zu",
                         features, i);
    }
    return srnf_fail(error, SRNF_ENUMERIC, (int64_t)i,
                     "the covariance of %zu features, sizes and covariates (%zu) counted, is "
                     "singular in the fold of subject %zu: without it one of these follows from "
                     "the others",
                     features, fold->offset, i);
}

/* Member m of the subject left out, from the table. */
static int predict_one(struct classify_fold *fold, struct classify_choice choice, size_t m,
                       const struct outcome *outcome, struct srnf_error *error)
{
    size_t i = fold->subjects->members[fold->subjects->start[fold->left_out] + m];
    const double *likelihood =
        fold->table +
        ((m * CLASSIFY_KINDS + choice.kind) * fold->d + choice.features - 1) * fold->classes;
    size_t best = 0;

    for (size_t c = 0; c < fold->classes; c++) {
        if (!isfinite(likelihood[c])) {
            return fail_singular(fold, choice.features, i, error);
        }
        best = likelihood[c] > likelihood[best] ? c : best;
    }
    outcome->predicted[i] = best;
    if (outcome->evidence) {
        memcpy(outcome->evidence + i * fold->classes, likelihood, fold->classes * sizeof(double));
        outcome->components[i] = choice.features - fold->offset;
        outcome->pooled[i] = choice.kind == CLASSIFY_POOLED;
    }
    return SRNF_OK;
}

static int predict(const struct study *study, const size_t *labels, const struct outcome *outcome,
                   struct srnf_error *error)
{
    const struct subjects *s = &study->subjects;
    struct classify_fold fold;
    size_t *members = srnf_alloc(s->largest, sizeof *members);
    int status = classify_fold_create(&fold, study);

    status = status == SRNF_OK && !members ? SRNF_ENOMEM : status;
    for (size_t k = 0; k < s->count && status == SRNF_OK; k++) {
        struct classify_choice choice;

        classify_fold_fit(&fold, study, k, labels);
        choice = classify_fold_choose(&fold, study->options, members);
        classify_fold_judge(&fold, k, members);
        for (size_t m = 0; m < s->size[k] && status == SRNF_OK; m++) {
            status = predict_one(&fold, choice, m, outcome, error);
        }
    }
    classify_fold_clear(&fold);
    srnf_free(members);
    return status;
}

/* Components that were asked for must be there, and determined by the training subjects. */
static int check_components(const struct study *study, struct srnf_error *error)
{
    const struct srnf_folds *c = study->comparison;
    size_t features = study->options->components + (study->options->log_scale != NULL) +
                      study->options->n_features;
    /* that one without the subject left out determines, which is of the class or not */
    size_t freedom = study->options->covariance == SRNF_COVARIANCE_CLASS ? study->smallest - 2
                                                                         : study->determined;

    if (!c->scores) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the comparison has no scores: its metric registers nothing");
    }
    if (study->options->components > c->components) {
        return srnf_fail(error, SRNF_EINVAL, -1, "components is %zu, and there are %zu",
                         study->options->components, c->components);
    }
    if ((study->options->components ? features : features + 1) > freedom) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu features are more than the training subjects determine: %zu",
                         study->options->components ? features : features + 1, freedom);
    }
    return SRNF_OK;
}

int srnf_classify_gauss(const struct srnf_folds *comparison, const size_t *labels, size_t n_classes,
                        const struct srnf_classify_options *options,
                        const struct srnf_context *context, struct srnf_classification *result,
                        struct srnf_error *error)
{
    struct srnf_classify_options defaults = srnf_classify_options_defaults();
    struct study study;
    int status;

    *result = (struct srnf_classification){0};
    status =
        study_open(&study, comparison, labels, n_classes, options ? options : &defaults, error);
    study.predict = predict;
    status = status ? status : check_components(&study, error);
    status = status ? status : study_assess(&study, labels, true, context, result, error);
    study_close(&study);
    return status;
}
