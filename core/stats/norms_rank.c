/*
 * norms_rank.c - where a value stands among those of others.
 *
 * With m subjects of the same kind as the surface, its rank among the m + 1 values is uniform: the
 * share of them that are below, taken in the middle of its own step, is the percentile. The p-value
 * (1 + as large) / (1 + m) is that of a test by permutation, and of conformal prediction (V. Vovk,
 * A. Gammerman, G. Shafer, "Algorithmic learning in a random world", 2005).
 */
#include "norms.h"

#include "subjects.h"

#include <math.h>

#define TIE 1e-12 /* relative: what counts as the same value */

static int check(size_t n, const double *values, const double *weights, double value)
{
    if (n == 0 || !isfinite(value)) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(values[i]) || (weights && !(weights[i] > 0.0 && weights[i] <= 1.0))) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

int srnf_norm_rank(size_t n, const double *values, const double *weights, double value,
                   struct srnf_norm_rank *rank)
{
    int status = check(n, values, weights, value);
    double all = 0.0;
    double below = 0.0;
    double equal = 0.0;

    if (status) {
        return status;
    }
    for (size_t i = 0; i < n; i++) {
        double weight = weights ? weights[i] : 1.0;
        double room = TIE * fmax(fabs(value), fabs(values[i]));

        all += weight;
        below += values[i] < value - room ? weight : 0.0;
        equal += fabs(values[i] - value) <= room ? weight : 0.0;
    }
    *rank = (struct srnf_norm_rank){
        .value = value,
        .percentile = 100.0 * (below + 0.5 * equal + 0.5) / (all + 1.0),
        .as_odd = fmax(all - below, 0.0),
    };
    rank->p_value = (1.0 + rank->as_odd) / (1.0 + all);
    subjects_percentile(below + 0.5 * equal, all, rank->interval);
    rank->interval[0] = fmin(rank->interval[0], rank->percentile);
    rank->interval[1] = fmax(rank->interval[1], rank->percentile);
    return SRNF_OK;
}

/* The share of all n + 1 that do not have more; the surface weighs as one subject. */
static double rank_of(size_t n, const double *values, const double *weights, double own,
                      double value)
{
    double rank = own <= value + TIE * fabs(value) ? 1.0 : 0.0;

    for (size_t i = 0; i < n; i++) {
        rank += values[i] <= value + TIE * fabs(value) ? (weights ? weights[i] : 1.0) : 0.0;
    }
    return rank;
}

int srnf_norm_rank_together(size_t n, size_t traits, const double *values, const double *weights,
                            const double *own, struct srnf_norm_rank *rank)
{
    double *ranks;
    double largest = 0.0;
    int status = SRNF_OK;

    for (size_t t = 0; t < traits && status == SRNF_OK; t++) {
        status = check(n, values + t * n, weights, own[t]);
    }
    if (status || traits == 0) {
        return SRNF_EINVAL;
    }
    ranks = srnf_alloc(n, sizeof *ranks);
    if (!ranks) {
        return SRNF_ENOMEM;
    }
    for (size_t t = 0; t < traits; t++) {
        const double *of = values + t * n;

        largest = fmax(largest, rank_of(n, of, weights, own[t], own[t]));
        for (size_t i = 0; i < n; i++) {
            ranks[i] = fmax(ranks[i], rank_of(n, of, weights, own[t], of[i]));
        }
    }
    status = srnf_norm_rank(n, ranks, weights, largest, rank);
    srnf_free(ranks);
    return status;
}

/* The chance of a distance beyond x / sqrt(n): 2 sum of (-1)^(k-1) exp(-2 k^2 x^2). */
static double kolmogorov(double x)
{
    double sum = 0.0;

    if (!(x > 0.2)) {
        return 1.0; /* to 1e-12; the series needs many terms there */
    }
    for (int k = 1; k <= 40; k++) {
        sum += (k % 2 ? 2.0 : -2.0) * exp(-2.0 * k * k * x * x);
    }
    return fmin(fmax(sum, 0.0), 1.0);
}

int srnf_norm_uniform(size_t n, const double *percentiles, double *distance, double *p_value)
{
    double *sorted = n ? srnf_alloc(n, sizeof *sorted) : NULL;
    double root = sqrt((double)n);

    if (!sorted) {
        return n ? SRNF_ENOMEM : SRNF_EINVAL;
    }
    *distance = 0.0;
    for (size_t i = 0; i < n; i++) {
        sorted[i] = percentiles[i] / 100.0;
    }
    stats_sort(n, sorted);
    for (size_t i = 0; i < n; i++) {
        *distance = fmax(*distance, fabs((double)(i + 1) / (double)n - sorted[i]));
        *distance = fmax(*distance, fabs(sorted[i] - (double)i / (double)n));
    }
    *p_value = kolmogorov(*distance * (root + 0.12 + 0.11 / root));
    srnf_free(sorted);
    return SRNF_OK;
}

int norms_rank(const struct norms *norms, const double *values, size_t left_out, double value,
               struct srnf_norm_rank *rank)
{
    double *others = srnf_alloc(2 * norms->n, sizeof *others);
    size_t count = 0;
    int status;

    if (!others) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < norms->n; i++) {
        if (norms->subjects.of[i] != left_out) {
            others[norms->n + count] = norms->weights[i];
            others[count++] = values[i];
        }
    }
    status = srnf_norm_rank(count, others, others + norms->n, value, rank);
    srnf_free(others);
    return status;
}
