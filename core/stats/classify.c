/*
 * classify.c - what is the same for all classifiers: checks, confusion, Wilson's interval, and the
 * p-value by permutation of the labels.
 *
 * p = (1 + b) / (1 + m), b the number of m random permutations under which at least as many
 * subjects are predicted right (B. Phipson, G. Smyth, "Permutation p-values should never be zero",
 * SAGMB 2010). Everything that depends on labels is repeated under each: fits, and the choice of
 * components inside the folds. What does not, registration and principal components, is not.
 *
 * Permutations come from Philox keyed by the seed: permutation b is the same on every machine,
 * whatever thread draws it, and however many are drawn.
 */
#include "classify.h"

#include <math.h>

#define NORMAL_975 1.959963984540054             /* quantile of the standard normal distribution */
#define COUNTER_PERMUTATION UINT32_C(0xFFFFFFFF) /* sample.c counts attempts here, to 64 */
#define PERMUTATIONS_MAX ((size_t)1000000)
#define WEIGHT_MAX 1000.0
#define CLASS_MIN 3

struct srnf_classify_options srnf_classify_options_defaults(void)
{
    return (struct srnf_classify_options){.size_weight = 1.0};
}

void srnf_classification_clear(struct srnf_classification *c)
{
    srnf_free(c->predicted);
    srnf_free(c->evidence);
    srnf_free(c->components);
    srnf_free(c->pooled);
    srnf_free(c->confusion);
    *c = (struct srnf_classification){0};
}

void srnf_wilson_interval(size_t successes, size_t n, double interval[2])
{
    double z2 = NORMAL_975 * NORMAL_975;
    double count = (double)n;
    double p = n ? (double)successes / count : 0.5;
    double center = n ? (p + z2 / (2.0 * count)) / (1.0 + z2 / count) : 0.5;
    double half = n ? NORMAL_975 / (1.0 + z2 / count) *
                          sqrt(p * (1.0 - p) / count + z2 / (4.0 * count * count))
                    : 0.5;

    interval[0] = successes == 0 ? 0.0 : fmax(0.0, center - half);
    interval[1] = successes >= n ? 1.0 : fmin(1.0, center + half);
}

void srnf_permutation(uint64_t seed, uint64_t index, size_t n, size_t *permutation)
{
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};

    for (size_t i = 0; i < n; i++) {
        permutation[i] = i;
    }
    for (size_t i = n; i-- > 1;) {
        const uint32_t counter[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)i,
                                     COUNTER_PERMUTATION};
        uint32_t bits[4];
        uint64_t word;
        size_t kept = permutation[i];
        size_t j;

        stats_philox(counter, key, bits);
        word = (uint64_t)bits[0] << 32 | bits[1];
        j = (size_t)((unsigned __int128)word * (i + 1) >> 64); /* uniform in 0 .. i */
        permutation[i] = permutation[j];
        permutation[j] = kept;
    }
}

/* ---- Checks ---------------------------------------------------------------------------------- */

static int check_options(const struct srnf_folds *c, const struct srnf_classify_options *options,
                         struct srnf_error *error)
{
    if (options->permutations > PERMUTATIONS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "permutations is %zu, not 0 to %zu",
                         options->permutations, PERMUTATIONS_MAX);
    }
    if (!(options->size_weight >= 0.0 && options->size_weight <= WEIGHT_MAX)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "size_weight %g is not from 0 to %g",
                         options->size_weight, WEIGHT_MAX);
    }
    if ((size_t)options->covariance > SRNF_COVARIANCE_CLASS) {
        return srnf_fail(error, SRNF_EINVAL, -1, "there is no covariance %d",
                         (int)options->covariance);
    }
    for (size_t i = 0; options->log_scale && i < c->n; i++) {
        if (!isfinite(options->log_scale[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "log_scale of subject %zu is not finite", i);
        }
    }
    return SRNF_OK;
}

int study_check(const struct srnf_folds *c, const size_t *labels, size_t n_classes,
                const struct srnf_classify_options *options, size_t *smallest,
                struct srnf_error *error)
{
    size_t *counts;
    int status = check_options(c, options, error);

    if (status) {
        return status;
    }
    if (n_classes < 2 || n_classes > c->n) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu classes of %zu subjects are not 2 or more",
                         n_classes, c->n);
    }
    for (size_t i = 0; i < c->n; i++) {
        if (labels[i] >= n_classes) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "label %zu of subject %zu is not below %zu", labels[i], i, n_classes);
        }
    }
    counts = srnf_alloc(n_classes, sizeof *counts);
    if (!counts) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    }
    for (size_t i = 0; i < c->n; i++) {
        counts[labels[i]]++;
    }
    *smallest = c->n;
    for (size_t k = 0; k < n_classes && status == SRNF_OK; k++) {
        *smallest = counts[k] < *smallest ? counts[k] : *smallest;
        if (counts[k] < CLASS_MIN) {
            status = srnf_fail(error, SRNF_EINVAL, (int64_t)k,
                               "class %zu has %zu subjects; each needs %d at least", k, counts[k],
                               CLASS_MIN);
        }
    }
    srnf_free(counts);
    return status;
}

/* ---- Assessment ------------------------------------------------------------------------------ */

static size_t count_correct(size_t n, const size_t *labels, const size_t *predicted)
{
    size_t correct = 0;

    for (size_t i = 0; i < n; i++) {
        correct += labels[i] == predicted[i];
    }
    return correct;
}

struct permutations {
    const struct study *study;
    const size_t *labels;
    size_t *correct; /* [permutations] */
};

static int permute_body(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct permutations *p = argument;
    size_t n = p->study->comparison->n;
    size_t *memory = srnf_alloc(n, 3 * sizeof *memory);
    struct outcome outcome = {.predicted = memory + 2 * n};
    int status;

    (void)context;
    if (!memory) {
        return SRNF_ENOMEM;
    }
    srnf_permutation(p->study->options->seed, index, n, memory);
    for (size_t i = 0; i < n; i++) {
        memory[n + i] = p->labels[memory[i]];
    }
    status = p->study->predict(p->study, memory + n, &outcome, error);
    p->correct[index] = count_correct(n, memory + n, outcome.predicted);
    srnf_free(memory);
    return status;
}

static int permute(const struct study *study, const size_t *labels,
                   const struct srnf_context *context, struct srnf_classification *result,
                   struct srnf_error *error)
{
    size_t m = study->options->permutations;
    struct permutations p = {study, labels, srnf_alloc(m, sizeof *p.correct)};
    struct stats_progress progress = {0.0, 1.0, "permuting labels"};
    size_t as_good = 0;
    int status = p.correct ? stats_run(context, m, permute_body, &p, progress, error) : SRNF_ENOMEM;

    for (size_t b = 0; b < m && status == SRNF_OK; b++) {
        as_good += p.correct[b] >= result->correct;
    }
    result->p_value = (double)(1 + as_good) / (double)(1 + m);
    srnf_free(p.correct);
    return status;
}

static int create_result(const struct study *study, bool gaussian,
                         struct srnf_classification *result)
{
    size_t n = study->comparison->n;

    *result = (struct srnf_classification){.n = n, .n_classes = study->n_classes, .p_value = NAN};
    result->predicted = srnf_alloc(n, sizeof *result->predicted);
    result->evidence = srnf_alloc(n, study->n_classes * sizeof *result->evidence);
    result->confusion = srnf_alloc(study->n_classes, study->n_classes * sizeof *result->confusion);
    if (gaussian) {
        result->components = srnf_alloc(n, sizeof *result->components);
        result->pooled = srnf_alloc(n, sizeof *result->pooled);
    }
    return result->predicted && result->evidence && result->confusion &&
                   (!gaussian || (result->components && result->pooled))
               ? SRNF_OK
               : SRNF_ENOMEM;
}

int study_assess(const struct study *study, const size_t *labels, bool gaussian,
                 const struct srnf_context *context, struct srnf_classification *result,
                 struct srnf_error *error)
{
    struct srnf_error first = {0};
    size_t n = study->comparison->n;
    struct outcome outcome;
    int status = create_result(study, gaussian, result);

    outcome =
        (struct outcome){result->predicted, result->evidence, result->components, result->pooled};
    status = status ? status : study->predict(study, labels, &outcome, &first);
    if (status == SRNF_OK) {
        result->correct = count_correct(n, labels, result->predicted);
        result->accuracy = (double)result->correct / (double)n;
        srnf_wilson_interval(result->correct, n, result->interval);
        for (size_t i = 0; i < n; i++) {
            result->confusion[labels[i] * study->n_classes + result->predicted[i]]++;
        }
    }
    if (status == SRNF_OK && study->options->permutations > 0) {
        status = permute(study, labels, context, result, &first);
    }
    if (status) {
        bool told = first.status == status;

        (void)srnf_fail(error, status, told ? first.element : -1, "%s",
                        told ? first.message : srnf_strerror(status));
        srnf_classification_clear(result);
    }
    return status;
}
