/*
 * frozen.c - the Gaussians of a classifier that is kept: fitted to all members at hand, with
 * components and covariance chosen by leaving each subject out of them in turn (classify_fold.c),
 * and then nothing but means and covariances.
 */
#include "frozen.h"

#include <math.h>
#include <string.h>

#define LOG_2PI 1.83787706640934548356

void srnf_classifier_clear(struct srnf_classifier *classifier)
{
    srnf_free(classifier->means);
    srnf_free(classifier->covariances);
    srnf_free(classifier->factors);
    srnf_free(classifier->priors);
    srnf_platt_clear(&classifier->platt);
    *classifier = (struct srnf_classifier){0};
}

/* L L' / freedom of the first k features. */
static void take_covariance(const struct classify_fold *fold, size_t which, double freedom,
                            size_t k, double *covariance)
{
    const double *l = fold->factor + which * fold->d * fold->d;

    for (size_t i = 0; i < k; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = 0.0;

            for (size_t m = 0; m <= j; m++) {
                sum += l[i * fold->d + m] * l[j * fold->d + m];
            }
            covariance[i * k + j] = covariance[j * k + i] = sum / freedom;
        }
    }
}

static int take(const struct classify_fold *fold, struct classify_choice choice,
                struct srnf_classifier *classifier, struct srnf_error *error)
{
    size_t k = choice.features;
    size_t blocks = choice.kind == CLASSIFY_POOLED ? 1 : fold->classes;
    double pooled = 0.0;

    classifier->features = fold->offset;
    classifier->components = k - fold->offset;
    classifier->pooled = choice.kind == CLASSIFY_POOLED;
    classifier->means = srnf_alloc(fold->classes * k, sizeof(double));
    classifier->covariances = srnf_alloc(blocks * k * k, sizeof(double));
    if (!classifier->means || !classifier->covariances) {
        return SRNF_ENOMEM;
    }
    for (size_t c = 0; c < fold->classes; c++) {
        pooled += classify_freedom(&fold->class[c]);
        memcpy(classifier->means + c * k, fold->mean + c * fold->d, k * sizeof(double));
    }
    for (size_t b = 0; b < blocks; b++) {
        size_t which = classifier->pooled ? fold->classes : b;
        double freedom = classifier->pooled ? pooled : classify_freedom(&fold->class[b]);

        if (fold->rank[which] < k || !(freedom > 0.0)) {
            return srnf_fail(error, SRNF_ENUMERIC, -1,
                             "the covariance of %zu features, %zu of them numbers beside shape, is "
                             "singular",
                             k, fold->offset);
        }
        take_covariance(fold, which, freedom, k, classifier->covariances + b * k * k);
    }
    return SRNF_OK;
}

int frozen_fit_gauss(const struct frozen_members *members,
                     const struct srnf_classify_options *options,
                     struct srnf_classifier *classifier, struct srnf_error *error)
{
    struct srnf_folds view = {.n = members->n, .components = members->components};
    struct srnf_classify_options own = *options;
    struct study study = {.comparison = &view, .options = &own, .n_classes = members->classes};
    struct classify_fold fold = {.n = 0};
    size_t *scratch = NULL;
    int status = subjects_open(&study.subjects, members->n, members->subjects, error);

    own.features = members->features;
    own.n_features = members->n_features;
    *classifier = (struct srnf_classifier){.classes = members->classes, .gauss = true};
    status = status ? status : classify_fold_create(&fold, &study);
    scratch = status == SRNF_OK ? srnf_alloc(study.subjects.largest, sizeof *scratch) : NULL;
    status = status == SRNF_OK && !scratch ? SRNF_ENOMEM : status;
    if (status == SRNF_OK) {
        classify_fold_fit_scores(&fold, &study, members->scores, SIZE_MAX, members->labels);
        status = take(&fold, classify_fold_choose(&fold, &own, scratch), classifier, error);
    }
    classify_fold_clear(&fold);
    subjects_clear(&study.subjects);
    srnf_free(scratch);
    return status;
}

/* Lower factor of a, [k][k], in place; false where it is not positive. */
static bool factorize(size_t k, double *a)
{
    for (size_t i = 0; i < k; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * k + j];

            for (size_t m = 0; m < j; m++) {
                sum -= a[i * k + m] * a[j * k + m];
            }
            if (i == j && !(sum > 0.0)) {
                return false;
            }
            a[i * k + j] = i == j ? sqrt(sum) : sum / a[j * k + j];
        }
    }
    return true;
}

int srnf_classifier_check(const struct srnf_classifier *classifier, struct srnf_error *error)
{
    size_t k = classifier->features + classifier->components;
    size_t blocks = !classifier->gauss ? 0 : classifier->pooled ? 1 : classifier->classes;
    double *l = srnf_alloc(k * k + 1, sizeof(double));
    int status = l ? SRNF_OK : SRNF_ENOMEM;

    for (size_t b = 0; b < blocks && status == SRNF_OK; b++) {
        memcpy(l, classifier->covariances + b * k * k, k * k * sizeof(double));
        if (!factorize(k, l)) {
            status = srnf_fail(error, SRNF_ENUMERIC, (int64_t)b,
                               "covariance %zu is not positive definite", b);
        }
    }
    srnf_free(l);
    return status;
}

int frozen_likelihoods(const struct srnf_classifier *classifier, const double *x, double *memory,
                       double *evidence)
{
    size_t k = classifier->features + classifier->components;
    double *l = memory;
    double *z = memory + k * k;

    for (size_t c = 0; c < classifier->classes; c++) {
        const double *mean = classifier->means + c * k;
        double square = 0.0;
        double log_det = 0.0;

        if (c == 0 || !classifier->pooled) {
            memcpy(l, classifier->covariances + (classifier->pooled ? 0 : c * k * k),
                   k * k * sizeof(double));
            if (!factorize(k, l)) {
                return SRNF_ENUMERIC;
            }
        }
        for (size_t i = 0; i < k; i++) {
            double sum = x[i] - mean[i];

            for (size_t m = 0; m < i; m++) {
                sum -= l[i * k + m] * z[m];
            }
            z[i] = sum / l[i * k + i];
            square += z[i] * z[i];
            log_det += 2.0 * log(l[i * k + i]);
        }
        evidence[c] = -0.5 * ((double)k * LOG_2PI + log_det + square);
    }
    return SRNF_OK;
}
