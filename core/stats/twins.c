/*
 * twins.c - members of a group that are far nearer to each other than the others are: likely one
 * subject twice.
 *
 * Of registered SRNFs q_i, with the Gram matrix G_ij = <q_i, q_j> of the quadrature weights,
 *
 *     d_ij^2 = G_ii + G_jj - 2 G_ij.
 *
 * That loses what is below the root of the rounding of a norm, 1e-8 of it: distances so small
 * become 0, and two members so near are twins anyhow.
 *
 * A pair is one of twins where its distance is below SRNF_TWINS_SHARE of the lower quartile of all
 * pairs', or of all that are of one class. Not of the median: where a group falls into two kinds
 * far from each other, half of all pairs are of one kind, and no twins. A group in which every
 * member has a twin is found out as well as one with a single pair, since of n (n - 1) / 2 pairs no
 * more than n / 2 are of twins.
 *
 * In few dimensions, as samples of a model of a few components have, near pairs come by chance: of
 * N pairs about (N / 4) (t / quartile)^d are nearer than t. The dimension d is read off the pairs
 * from .25 to .5 quartiles, and the k nearest pairs are of twins only where chance would leave less
 * than k / 50.
 *
 * Cost: n^2 3 P / 2 multiply-adds, and n^2 log n.
 */
#include "stats.h"

#include <cblas.h>
#include <math.h>

#define CHANCE 0.02           /* pairs by chance for each that is taken for one of twins */
#define N_MAX ((size_t)30000) /* members: n^2 is an int for BLAS */

int srnf_twins_distances(const struct srnf_grid *grid, size_t n, const double *registered_q,
                         double *distances)
{
    size_t size = 3 * stats_points(grid);
    double *weighted;
    size_t all;

    if (n == 0 || n > N_MAX) {
        return SRNF_EINVAL;
    }
    if (__builtin_mul_overflow(n, size, &all)) {
        return SRNF_ENOMEM;
    }
    weighted = srnf_alloc(all, sizeof(double));
    if (!weighted) {
        return SRNF_ENOMEM;
    }
    stats_weight(grid, n, registered_q, NULL, weighted);
    cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)n, (int)size, 1.0, weighted, (int)size,
                0.0, distances, (int)n);
    for (size_t j = 0; j < n; j++) {
        for (size_t i = j + 1; i < n; i++) {
            double square =
                distances[i * n + i] + distances[j * n + j] - 2.0 * distances[j * n + i];

            distances[i * n + j] = distances[j * n + i] = square > 0.0 ? sqrt(square) : 0.0;
        }
    }
    for (size_t i = 0; i < n; i++) {
        distances[i * n + i] = 0.0;
    }
    srnf_free(weighted);
    return SRNF_OK;
}

static double median_of(const double *sorted, size_t count)
{
    return count % 2 ? sorted[count / 2] : 0.5 * (sorted[count / 2 - 1] + sorted[count / 2]);
}

/* d, from the n sorted distances: of a quarter of them, the share r (1 - r) lies from .25 to .5
   quartiles, r = 2^-d. One more is counted than there are, so that d is finite and few pairs
   speak for few dimensions. */
static double dimension_of(size_t n, const double *sorted, double quartile)
{
    size_t between = 0;
    double x;

    for (size_t k = 0; k < n; k++) {
        between += sorted[k] >= SRNF_TWINS_SHARE * quartile && sorted[k] < 0.5 * quartile;
    }
    x = fmin(0.25, 4.0 * (double)(between + 1) / (double)n);
    return -log2(0.5 * (1.0 - sqrt(1.0 - 4.0 * x)));
}

/* Of all `count` sorted distances between different subjects. */
static size_t count_twins(size_t count, const double *sorted, double quartile, double dimension)
{
    size_t twins = 0;

    for (size_t k = 0; k < count && sorted[k] < SRNF_TWINS_SHARE * quartile; k++) {
        double expected = 0.25 * (double)count * pow(sorted[k] / quartile, dimension);

        twins = expected < CHANCE * (double)(k + 1) ? k + 1 : twins;
    }
    return twins;
}

int srnf_twins_find(size_t n, const double *distances, const size_t *subjects,
                    const size_t *classes, struct srnf_twins *twins)
{
    double *others;
    double *all;
    size_t count = 0;
    size_t alike = 0;

    *twins = (struct srnf_twins){0};
    if (n > N_MAX) {
        return SRNF_EINVAL;
    }
    others = srnf_alloc(n * n + 1, 2 * sizeof(double));
    if (!others) {
        return SRNF_ENOMEM;
    }
    all = others + n * n;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n; j++) {
            double d = distances[i * n + j];

            if ((subjects && subjects[i] == subjects[j]) || !isfinite(d)) {
                continue;
            }
            if (count == 0 || d < twins->nearest) {
                twins->nearest = d;
                twins->first = i;
                twins->second = j;
            }
            all[count++] = d;
            if (!classes || classes[i] == classes[j]) {
                others[alike++] = d;
            }
        }
    }
    if (alike >= SRNF_TWINS_PAIRS) {
        stats_sort(alike, others);
        twins->median = median_of(others, alike);
        twins->quartile = others[alike / 4];
        stats_sort(count, all);
        twins->count =
            count_twins(count, all, twins->quartile, dimension_of(alike, others, twins->quartile));
    }
    srnf_free(others);
    return SRNF_OK;
}
