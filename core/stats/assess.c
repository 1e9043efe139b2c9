/*
 * assess.c - what predictions are worth: accuracies, areas under curves, and how far probabilities
 * can be believed. Formulae and sources stand in srnf/train.h.
 */
#include "subjects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NORMAL_975 1.959963984540054
#define BISECTIONS 100

void srnf_assessment_clear(struct srnf_assessment *a)
{
    srnf_free(a->predicted);
    srnf_free(a->confusion);
    srnf_free(a->sensitivity);
    srnf_free(a->auc);
    srnf_free(a->reliability);
    *a = (struct srnf_assessment){0};
}

/* ---- Areas under curves ---------------------------------------------------------------------- */

static double auc_deviation(double a, double positives, double negatives)
{
    double h = 0.5 * (positives + negatives) - 1.0;

    return sqrt(fmax(0.0, a * (1.0 - a) * (1.0 + h * (1.0 - a) / (2.0 - a) + h * a / (1.0 + a)) /
                              (positives * negatives)));
}

/* The end of the interval between auc, which is inside, and an end of [0, 1]. */
static double auc_bound(double auc, double end, double positives, double negatives)
{
    double inside = auc;

    for (int i = 0; i < BISECTIONS; i++) {
        double middle = 0.5 * (inside + end);

        if (fabs(auc - middle) <= NORMAL_975 * auc_deviation(middle, positives, negatives)) {
            inside = middle;
        } else {
            end = middle;
        }
    }
    return inside;
}

void srnf_auc_interval(double auc, double positives, double negatives, double interval[2])
{
    interval[0] = auc_bound(auc, 0.0, positives, negatives);
    interval[1] = auc_bound(auc, 1.0, positives, negatives);
}

/* ---- One class ------------------------------------------------------------------------------- */

struct given {
    size_t n, classes;
    const size_t *labels;
    const struct subjects *subjects;
    const double *evidence, *probabilities, *priors;
};

/* What a member is ranked by. */
static double lead_of(const struct given *g, size_t i, size_t c)
{
    const double *s = g->evidence + i * g->classes;
    double others = -INFINITY;

    for (size_t d = 0; d < g->classes; d++) {
        others = d == c ? others : fmax(others, s[d]);
    }
    return s[c] - others;
}

/* Subjects with members of the class, and with others; seen: [subjects] of scratch. */
static void count_sides(const struct given *g, size_t c, bool *seen, double sides[2])
{
    for (size_t side = 0; side < 2; side++) {
        memset(seen, 0, g->subjects->count * sizeof *seen);
        sides[side] = 0.0;
        for (size_t i = 0; i < g->n; i++) {
            size_t s = g->subjects->of[i];

            if ((g->labels[i] == c) == (side == 0) && !seen[s]) {
                seen[s] = true;
                sides[side] += 1.0;
            }
        }
    }
}

/* lead: [n], seen: [subjects] of scratch. */
static void measure_auc(const struct given *g, size_t c, double *lead, bool *seen,
                        struct srnf_rate *auc)
{
    double sides[2];
    double sum = 0.0;
    double pairs = 0.0;

    for (size_t i = 0; i < g->n; i++) {
        lead[i] = lead_of(g, i, c);
    }
    for (size_t i = 0; i < g->n; i++) {
        for (size_t j = 0; g->labels[i] == c && j < g->n; j++) {
            if (g->labels[j] != c) {
                sum += lead[i] > lead[j] ? 1.0 : lead[i] == lead[j] ? 0.5 : 0.0;
                pairs += 1.0;
            }
        }
    }
    auc->value = sum / pairs;
    count_sides(g, c, seen, sides);
    srnf_auc_interval(auc->value, sides[0], sides[1], auc->interval);
}

/* The share of a class that is told. memory: [n] of scratch. */
static int measure_sensitivity(const struct given *g, size_t c, const size_t *predicted,
                               size_t *memory, bool *right, struct srnf_rate *rate)
{
    size_t count = 0;
    double effective;
    int status;

    for (size_t i = 0; i < g->n; i++) {
        if (g->labels[i] == c) {
            size_t first = i;

            for (size_t j = 0; j < i; j++) {
                if (g->labels[j] == c && g->subjects->of[j] == g->subjects->of[i]) {
                    first = j < first ? j : first;
                }
            }
            right[count] = predicted[i] == c;
            memory[count++] = first;
        }
    }
    /* Numbers of subjects must be below the count: those of their first members, in order. */
    for (size_t i = 0; i < count; i++) {
        size_t rank = 0;

        for (size_t j = 0; j < g->n && j < memory[i]; j++) {
            rank += g->labels[j] == c;
        }
        memory[g->n + i] = rank;
    }
    status = srnf_cluster_interval(count, memory + g->n, right, &effective, rate->interval, NULL);
    rate->value = 0.0;
    for (size_t i = 0; i < count; i++) {
        rate->value += right[i] ? 1.0 / (double)count : 0.0;
    }
    return status;
}

static void measure_reliability(const struct given *g, size_t c, struct srnf_reliability *bins)
{
    for (size_t i = 0; i < g->n; i++) {
        double p = g->probabilities[i * g->classes + c];
        size_t at = (size_t)(p * SRNF_RELIABILITY_BINS);
        struct srnf_reliability *bin =
            &bins[at < SRNF_RELIABILITY_BINS ? at : SRNF_RELIABILITY_BINS - 1];

        bin->members++;
        bin->of_class += g->labels[i] == c;
        bin->mean += p;
    }
    for (size_t b = 0; b < SRNF_RELIABILITY_BINS; b++) {
        struct srnf_reliability *bin = &bins[b];

        srnf_wilson_interval(bin->of_class, bin->members, bin->interval);
        if (bin->members > 0) {
            bin->mean /= (double)bin->members;
            bin->observed = (double)bin->of_class / (double)bin->members;
        }
    }
}

/* ---- All of them ----------------------------------------------------------------------------- */

/* Brier score and log loss, and those of the priors. sizes: [classes] members. */
static void measure_scores(const struct given *g, const size_t *sizes, struct srnf_assessment *a)
{
    for (size_t i = 0; i < g->n; i++) {
        const double *p = g->probabilities + i * g->classes;
        size_t label = g->labels[i];
        double weight = g->priors[label] / (double)sizes[label];

        for (size_t c = 0; c < g->classes; c++) {
            double own = c == label ? 1.0 : 0.0;

            a->brier += 0.5 * weight * (p[c] - own) * (p[c] - own);
            a->brier_reference += 0.5 * weight * (g->priors[c] - own) * (g->priors[c] - own);
        }
        a->log_loss -= weight * log(p[label]);
        a->log_loss_reference -= weight * log(g->priors[label]);
    }
}

static void count_answers(const struct given *g, size_t *sizes, bool *right,
                          struct srnf_assessment *a)
{
    size_t k = g->classes;

    for (size_t i = 0; i < g->n; i++) {
        a->predicted[i] = srnf_platt_choose(k, g->probabilities + i * k, g->evidence + i * k);
        a->confusion[g->labels[i] * k + a->predicted[i]]++;
        sizes[g->labels[i]]++;
        right[i] = a->predicted[i] == g->labels[i];
        a->correct += right[i];
    }
    a->accuracy.value = (double)a->correct / (double)g->n;
    for (size_t c = 0; c < k; c++) {
        double share = (double)sizes[c] / (double)g->n;

        a->chance += share * share;
        a->majority = fmax(a->majority, share);
    }
}

static int measure(const struct given *g, size_t *memory, bool *flags, double *lead,
                   struct srnf_assessment *a)
{
    double below = 0.0;
    double above = 0.0;
    size_t *sizes = memory + 2 * g->n;
    int status;

    count_answers(g, sizes, flags, a);
    for (size_t c = 0; c < g->classes; c++) {
        if (sizes[c] == 0) {
            return SRNF_EINVAL;
        }
    }
    status = srnf_cluster_interval(g->n, g->subjects->of, flags, &a->effective,
                                   a->accuracy.interval, NULL);
    for (size_t c = 0; c < g->classes && status == SRNF_OK; c++) {
        struct srnf_rate *rate = &a->sensitivity[c];

        status = measure_sensitivity(g, c, a->predicted, memory, flags, rate);
        a->balanced.value += rate->value / (double)g->classes;
        below += (rate->value - rate->interval[0]) * (rate->value - rate->interval[0]);
        above += (rate->interval[1] - rate->value) * (rate->interval[1] - rate->value);
        measure_auc(g, c, lead, flags, &a->auc[c]);
        measure_reliability(g, c, a->reliability + c * SRNF_RELIABILITY_BINS);
    }
    a->balanced.interval[0] = a->balanced.value - sqrt(below) / (double)g->classes;
    a->balanced.interval[1] = a->balanced.value + sqrt(above) / (double)g->classes;
    measure_scores(g, sizes, a);
    return status;
}

static int check(const struct given *g)
{
    if (g->n < 2 || g->classes < 2 || g->classes > g->n) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < g->n; i++) {
        if (g->labels[i] >= g->classes) {
            return SRNF_EINVAL;
        }
    }
    for (size_t c = 0; c < g->classes; c++) {
        if (!(g->priors[c] > 0.0)) {
            return SRNF_EINVAL;
        }
    }
    for (size_t i = 0; i < g->n * g->classes; i++) {
        if (!(g->probabilities[i] >= 0.0 && g->probabilities[i] <= 1.0) ||
            !isfinite(g->evidence[i])) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

int srnf_assess(size_t n, size_t classes, const size_t *labels, const size_t *subjects,
                const double *evidence, const double *probabilities, const double *priors,
                struct srnf_assessment *assessment)
{
    struct subjects of = {0};
    const struct given g = {n, classes, labels, &of, evidence, probabilities, priors};
    struct srnf_assessment a = {.n = n, .classes = classes};
    size_t *memory = NULL;
    bool *flags = NULL;
    double *lead = NULL;
    int status = check(&g);

    status = status ? status : subjects_open(&of, n, subjects, NULL);
    if (status == SRNF_OK) {
        a.subjects = of.count;
        a.predicted = srnf_alloc(n, sizeof *a.predicted);
        a.confusion = srnf_alloc(classes * classes, sizeof *a.confusion);
        a.sensitivity = srnf_alloc(classes, sizeof *a.sensitivity);
        a.auc = srnf_alloc(classes, sizeof *a.auc);
        a.reliability = srnf_alloc(classes * SRNF_RELIABILITY_BINS, sizeof *a.reliability);
        memory = srnf_alloc(2 * n + classes, sizeof *memory);
        flags = srnf_alloc(n, sizeof *flags);
        lead = srnf_alloc(n, sizeof *lead);
        status = a.predicted && a.confusion && a.sensitivity && a.auc && a.reliability && memory &&
                         flags && lead
                     ? measure(&g, memory, flags, lead, &a)
                     : SRNF_ENOMEM;
    }
    subjects_clear(&of);
    srnf_free(memory);
    srnf_free(flags);
    srnf_free(lead);
    if (status) {
        srnf_assessment_clear(&a);
        return status;
    }
    *assessment = a;
    return SRNF_OK;
}

/* ---- Two methods ----------------------------------------------------------------------------- */

/* P(|sum of e_s d_s| >= |sum of d_s|), from the distribution of the sum, subject by subject. */
static int flip_signs(const struct subjects *s, const long *differences, double *p_value)
{
    long total = 0;
    long reach = 0;
    double *now, *next;

    for (size_t k = 0; k < s->count; k++) {
        total += differences[k];
        reach += labs(differences[k]);
    }
    now = srnf_alloc(2 * (2 * (size_t)reach + 1), sizeof(double));
    if (!now) {
        return SRNF_ENOMEM;
    }
    next = now + 2 * reach + 1;
    now[reach] = 1.0;
    for (size_t k = 0; k < s->count; k++) {
        long d = labs(differences[k]);

        for (long v = -reach; d > 0 && v <= reach; v++) {
            next[reach + v] = 0.5 * ((v - d >= -reach ? now[reach + v - d] : 0.0) +
                                     (v + d <= reach ? now[reach + v + d] : 0.0));
        }
        if (d > 0) {
            memcpy(now, next, (size_t)(2 * reach + 1) * sizeof(double));
        }
    }
    *p_value = 0.0;
    for (long v = -reach; v <= reach; v++) {
        *p_value += labs(v) >= labs(total) ? now[reach + v] : 0.0;
    }
    *p_value = fmin(*p_value, 1.0);
    srnf_free(now);
    return SRNF_OK;
}

int srnf_mcnemar(size_t n, const size_t *subjects, const bool *first, const bool *second,
                 size_t only[2], double *p_value)
{
    struct subjects s = {0};
    int status = n > 0 ? subjects_open(&s, n, subjects, NULL) : SRNF_EINVAL;
    long *differences = status == SRNF_OK ? srnf_alloc(s.count, sizeof *differences) : NULL;

    status = status == SRNF_OK && !differences ? SRNF_ENOMEM : status;
    if (status == SRNF_OK) {
        only[0] = only[1] = 0;
        for (size_t i = 0; i < n; i++) {
            only[0] += first[i] && !second[i];
            only[1] += second[i] && !first[i];
            differences[s.of[i]] += (long)first[i] - (long)second[i];
        }
        status = flip_signs(&s, differences, p_value);
    }
    srnf_free(differences);
    subjects_clear(&s);
    return status;
}
