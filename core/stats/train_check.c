/*
 * train_check.c - what train refuses (train.h).
 */
#include "train.h"

#include <math.h>

#define COMPONENTS_MAX 64

/* Subjects of each class, and the priors that follow. SRNF_EINVAL: a class has too few. */
int train_count_classes(const struct training *t, size_t *counts, double *priors,
                        struct srnf_error *error)
{
    for (size_t s = 0; s < t->subjects.count; s++) {
        counts[train_class_of(t, s)]++;
    }
    for (size_t c = 0; c < t->classes; c++) {
        if (counts[c] < SRNF_TRAIN_SUBJECTS_MIN) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)c,
                             "class %zu has %zu subjects; each needs %d at least", c, counts[c],
                             SRNF_TRAIN_SUBJECTS_MIN);
        }
        priors[c] = t->options->priors == SRNF_PRIORS_EQUAL
                        ? 1.0 / (double)t->classes
                        : (double)counts[c] / (double)t->subjects.count;
    }
    return SRNF_OK;
}

size_t srnf_train_determined(size_t classes, const size_t *counts, bool pooled, bool open)
{
    size_t least = SIZE_MAX;
    size_t all = 0;

    for (size_t c = 0; c < classes; c++) {
        /* One is left out, then a group of the rest, then, where a choice is open, one more; the
           mean takes another. */
        size_t used = 2 + (counts[c] + TRAIN_GROUPS - 2) / TRAIN_GROUPS + open;
        size_t left = counts[c] > used ? counts[c] - used : 0;

        all += left;
        least = left < least ? left : least;
    }
    return pooled ? all : least;
}

/* Whether the innermost training subjects determine the covariance. */
int train_check_components(const struct training *t, const size_t *counts, struct srnf_error *error)
{
    const struct srnf_train_options *o = t->options;
    bool open = o->components == 0 || o->covariance == SRNF_COVARIANCE_AUTO;
    size_t features = (o->components ? o->components : 1) + o->n_features;
    size_t most =
        srnf_train_determined(t->classes, counts, o->covariance != SRNF_COVARIANCE_CLASS, open);

    if (o->gauss && features > most) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu features, %zu of them numbers beside shape, are more than the "
                         "subjects of an inner fold determine: %zu",
                         features, o->n_features, most);
    }
    return SRNF_OK;
}

int train_check(size_t n, const size_t *labels, size_t n_classes,
                const struct srnf_train_options *options, struct srnf_error *error)
{
    if (n_classes < 2 || n_classes > n) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu classes of %zu members are not 2 or more",
                         n_classes, n);
    }
    for (size_t i = 0; i < n; i++) {
        if (labels[i] >= n_classes) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "label %zu of member %zu is not below %zu", labels[i], i, n_classes);
        }
    }
    if (options->components > COMPONENTS_MAX ||
        (size_t)options->covariance > SRNF_COVARIANCE_CLASS ||
        (size_t)options->priors > SRNF_PRIORS_EQUAL) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "components %zu, covariance %d and priors %d are not all known",
                         options->components, (int)options->covariance, (int)options->priors);
    }
    if (options->n_features > SRNF_FEATURES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu features are more than %zu",
                         options->n_features, SRNF_FEATURES_MAX);
    }
    for (size_t k = 0; k < n * options->n_features; k++) {
        if (!isfinite(options->features[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / options->n_features),
                             "a feature of member %zu is not finite", k / options->n_features);
        }
    }
    return SRNF_OK;
}

int train_check_parts(const struct srnf_train_options *options, size_t n, double *weights,
                      struct folds_sum *sum, struct srnf_error *error)
{
    if (options->n_parts < 1 || options->n_parts > SRNF_PARTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu parts are not 1 to %zu", options->n_parts,
                         SRNF_PARTS_MAX);
    }
    for (size_t p = 0; p < options->n_parts; p++) {
        weights[p] = options->weights ? options->weights[p] : 1.0;
        if (!(weights[p] > 0.0 && isfinite(weights[p]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)p,
                             "the weight of part %zu is not above 0", p);
        }
    }
    *sum = (struct folds_sum){.n_parts = options->n_parts,
                              .weights = weights,
                              .positions = options->positions,
                              .position_weight = options->position_weight};
    return folds_check_positions(n, sum, error);
}

/* A subject has one label. */
int train_check_labels(const struct training *t, struct srnf_error *error)
{
    size_t *own = srnf_alloc(t->subjects.count, sizeof *own);
    int status = own ? SRNF_OK : SRNF_ENOMEM;

    if (own && !subjects_labels(&t->subjects, t->labels, own)) {
        status = srnf_fail(error, SRNF_EINVAL, -1, "labels differ within a subject");
    }
    srnf_free(own);
    return status;
}
