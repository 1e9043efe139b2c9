/*
 * classify.c - what is the same for all classifiers: checks, confusion, the interval of the
 * accuracy, and the p-value by permutation of the labels.
 *
 * p = (1 + b) / (1 + m), b the number of m relabellings under which at least as many members are
 * predicted right (srnf/subjects.h). Whole subjects exchange their labels: members of one are alike
 * whatever their label, and a null distribution that tears them apart is too narrow. Everything
 * that depends on labels is repeated under each relabelling: fits, and the choice of components
 * inside the folds. What does not, registration and principal components, is not.
 *
 * Permutations come from Philox keyed by the seed: permutation b is the same on every machine,
 * whatever thread draws it, and however many are drawn.
 */
#include "classify.h"

#include <math.h>
#include <string.h>

#define COUNTER_PERMUTATION UINT32_C(0xFFFFFFFF) /* sample.c counts attempts here, to 64 */
#define PERMUTATIONS_MAX ((size_t)1000000)
#define RELABELLINGS_MAX ((size_t)10000)
#define WEIGHT_MAX 1000.0
#define CLASS_MIN 3

struct srnf_classify_options srnf_classify_options_defaults(void)
{
    return (struct srnf_classify_options){.size_weight = 1.0, .relabellings = SRNF_RELABELLINGS};
}

void srnf_classification_clear(struct srnf_classification *c)
{
    srnf_free(c->predicted);
    srnf_free(c->evidence);
    srnf_free(c->components);
    srnf_free(c->pooled);
    srnf_free(c->confusion);
    srnf_free(c->auc);
    dispersions_clear(&c->dispersions);
    *c = (struct srnf_classification){0};
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
    if (options->relabellings > RELABELLINGS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "relabellings is %zu, not 0 to %zu",
                         options->relabellings, RELABELLINGS_MAX);
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
    if (options->n_features > SRNF_FEATURES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu features are more than %zu",
                         options->n_features, SRNF_FEATURES_MAX);
    }
    for (size_t k = 0; k < c->n * options->n_features; k++) {
        if (!isfinite(options->features[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / options->n_features),
                             "a feature of member %zu is not finite", k / options->n_features);
        }
    }
    return SRNF_OK;
}

/* As srnf_class_subjects; counts: [n_classes] zeros. */
static size_t count_subjects(const struct subjects *s, const size_t *labels, size_t n_classes,
                             size_t *counts)
{
    size_t all = 0;
    size_t most = 0; /* classes that one subject is in */

    for (size_t k = 0; k < s->count; k++) {
        size_t classes = 0;

        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            bool again = false;

            for (size_t l = s->start[k]; l < m; l++) {
                again = again || labels[s->members[l]] == labels[s->members[m]];
            }
            classes += !again;
            counts[labels[s->members[m]]] += !again;
        }
        all += classes;
        most = classes > most ? classes : most;
    }
    return all > n_classes + most ? all - n_classes - most : 0;
}

int srnf_class_subjects(size_t n, const size_t *labels, const size_t *subjects, size_t n_classes,
                        size_t *counts, size_t *determined)
{
    struct subjects s;
    int status = subjects_open(&s, n, subjects, NULL);

    for (size_t k = 0; k < n_classes; k++) {
        counts[k] = 0;
    }
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        status = labels[i] < n_classes ? SRNF_OK : SRNF_EINVAL;
    }
    if (status == SRNF_OK) {
        *determined = count_subjects(&s, labels, n_classes, counts);
    }
    subjects_clear(&s);
    return status;
}

/* Subjects of each class, counts: [n_classes] zeros, and what they determine. */
static int count_classes(struct study *study, const size_t *labels, size_t *counts,
                         struct srnf_error *error)
{
    study->determined = count_subjects(&study->subjects, labels, study->n_classes, counts);
    study->smallest = study->subjects.n;
    for (size_t k = 0; k < study->n_classes; k++) {
        study->smallest = counts[k] < study->smallest ? counts[k] : study->smallest;
        if (counts[k] < CLASS_MIN) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)k,
                             "class %zu has %zu subjects; each needs %d at least", k, counts[k],
                             CLASS_MIN);
        }
    }
    return SRNF_OK;
}

int study_open(struct study *study, const struct srnf_folds *c, const size_t *labels,
               size_t n_classes, const struct srnf_classify_options *options,
               struct srnf_error *error)
{
    size_t *counts = NULL;
    int status = check_options(c, options, error);

    *study = (struct study){.comparison = c, .options = options, .n_classes = n_classes};
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
    status = subjects_open(&study->subjects, c->n, c->subjects, error);
    counts = srnf_alloc(n_classes, sizeof *counts);
    if (status == SRNF_OK && !counts) {
        status = SRNF_ENOMEM;
    }
    status = status ? status : count_classes(study, labels, counts, error);
    srnf_free(counts);
    return status == SRNF_ENOMEM ? srnf_fail(error, status, -1, "%s", srnf_strerror(status))
                                 : status;
}

void study_close(struct study *study)
{
    subjects_clear(&study->subjects);
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
    const struct exchange *exchange;
    const size_t *labels; /* [subjects] */
    size_t *correct;      /* [permutations] */
};

static int permute_body(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct permutations *p = argument;
    const struct subjects *subjects = &p->study->subjects;
    size_t n = p->study->comparison->n;
    size_t *memory = srnf_alloc(3 * n + p->study->n_classes, sizeof *memory);
    size_t *source = memory;
    size_t *labels;
    struct outcome outcome = {0};
    int status;

    (void)context;
    if (!memory) {
        return SRNF_ENOMEM;
    }
    labels = memory + n;
    outcome.predicted = memory + 2 * n;
    if (p->exchange->test.exact) {
        exchange_arrange(p->exchange, index + 1, memory + 3 * n, source);
    } else {
        srnf_permutation(p->study->options->seed, index, subjects->count, source);
    }
    for (size_t i = 0; i < n; i++) {
        labels[i] = p->labels[source[subjects->of[i]]];
    }
    status = p->study->predict(p->study, labels, &outcome, error);
    p->correct[index] = count_correct(n, labels, outcome.predicted);
    srnf_free(memory);
    return status;
}

/* In how many ways classes of equal size change names, which changes no count of right answers. */
static double count_renamings(const struct subjects *s, const size_t *labels, size_t n_classes)
{
    double ways = 1.0;

    for (size_t k = 0; k < n_classes; k++) {
        double alike = 1.0; /* classes up to k of its size */
        size_t own = 0;

        for (size_t i = 0; i < s->count; i++) {
            own += labels[i] == k;
        }
        for (size_t l = 0; l < k; l++) {
            size_t other = 0;

            for (size_t i = 0; i < s->count; i++) {
                other += labels[i] == l;
            }
            alike += other == own ? 1.0 : 0.0;
        }
        ways *= alike;
    }
    return ways;
}

static int permute(const struct study *study, const size_t *labels,
                   const struct srnf_context *context, struct srnf_classification *result,
                   struct srnf_error *error)
{
    const struct subjects *subjects = &study->subjects;
    struct exchange exchange = {0};
    size_t *own = srnf_alloc(subjects->count, sizeof *own);
    struct permutations p = {study, &exchange, own, NULL};
    struct stats_progress progress = {study_relabelling_part(study), 1.0, "permuting labels"};
    size_t as_good = 0;
    size_t m = 0;
    int status = own ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && !subjects_labels(subjects, labels, own)) {
        status = srnf_fail(error, SRNF_EINVAL, -1,
                           "labels differ within a subject: subjects cannot exchange them");
    }
    if (status == SRNF_OK) {
        status = exchange_open(&exchange, subjects->count, own, study->n_classes,
                               study->options->permutations,
                               count_renamings(subjects, own, study->n_classes));
    }
    if (status == SRNF_OK) {
        m = exchange.test.permutations;
        p.correct = srnf_alloc(m, sizeof *p.correct);
        status = p.correct ? stats_run(context, m, permute_body, &p, progress, error) : SRNF_ENOMEM;
    }
    for (size_t b = 0; b < m && status == SRNF_OK; b++) {
        as_good += p.correct[b] >= result->correct;
    }
    result->p_value = (double)(1 + as_good) / (double)(1 + m);
    result->test = exchange.test;
    exchange_clear(&exchange);
    srnf_free(own);
    srnf_free(p.correct);
    return status;
}

static int create_result(const struct study *study, bool gaussian,
                         struct srnf_classification *result)
{
    size_t n = study->comparison->n;

    *result = (struct srnf_classification){
        .n = n, .n_classes = study->n_classes, .subjects = study->subjects.count, .p_value = NAN};
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

/* Accuracy, what else the answers are worth, intervals, and what always naming the largest class
   gets right. */
static int count_results(const struct study *study, const size_t *labels,
                         const struct srnf_context *context, struct srnf_classification *result,
                         struct srnf_error *error)
{
    size_t n = result->n;
    size_t classes = result->n_classes;
    struct srnf_assessment a = {0};
    size_t most = 0;
    int status = study_disperse(study, labels, context, &result->dispersions, error);

    for (size_t i = 0; i < n; i++) {
        result->confusion[labels[i] * classes + result->predicted[i]]++;
    }
    for (size_t k = 0; k < classes; k++) {
        size_t size = 0;

        for (size_t l = 0; l < classes; l++) {
            size += result->confusion[k * classes + l];
        }
        most = size > most ? size : most;
    }
    result->correct = count_correct(n, labels, result->predicted);
    result->accuracy = (double)result->correct / (double)n;
    result->majority = (double)most / (double)n;
    status = status ? status
                    : assess_answers(n, classes, labels, study->subjects.of, result->evidence,
                                     result->predicted, &result->dispersions, &a);
    if (status == SRNF_OK) {
        memcpy(result->interval, a.accuracy.interval, sizeof result->interval);
        result->effective = a.effective;
        result->balanced = a.balanced;
        result->auc = a.auc;
        a.auc = NULL;
    }
    srnf_assessment_clear(&a);
    return status;
}

int study_assess(const struct study *study, const size_t *labels, bool gaussian,
                 const struct srnf_context *context, struct srnf_classification *result,
                 struct srnf_error *error)
{
    struct srnf_error first = {0};
    struct outcome outcome;
    int status = create_result(study, gaussian, result);

    outcome =
        (struct outcome){result->predicted, result->evidence, result->components, result->pooled};
    status = status ? status : study->predict(study, labels, &outcome, &first);
    status = status ? status : count_results(study, labels, context, result, &first);
    if (status == SRNF_OK && study->options->permutations > 0) {
        status = permute(study, labels, context, result, &first);
    }
    if (status) {
        bool explained = first.status == status;

        (void)srnf_fail(error, status, explained ? first.element : -1, "%s",
                        explained ? first.message : srnf_strerror(status));
        srnf_classification_clear(result);
    }
    return status;
}
