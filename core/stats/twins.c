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
 * Cost: n^2 3 P / 2 multiply-adds, and n^2 log n.
 */
#include "stats.h"

#include <cblas.h>
#include <math.h>
#include <stdlib.h>

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

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

static double median_of(const double *sorted, size_t count)
{
    return count % 2 ? sorted[count / 2] : 0.5 * (sorted[count / 2 - 1] + sorted[count / 2]);
}

/* Pairs of different subjects that are nearer than the limit. */
static size_t count_below(size_t n, const double *distances, const size_t *subjects, double limit)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n; j++) {
            bool same = subjects && subjects[i] == subjects[j];

            count += !same && distances[i * n + j] < limit;
        }
    }
    return count;
}

int srnf_twins_find(size_t n, const double *distances, const size_t *subjects,
                    const size_t *classes, struct srnf_twins *twins)
{
    double *others;
    size_t count = 0;
    size_t alike = 0;

    *twins = (struct srnf_twins){0};
    if (n > N_MAX) {
        return SRNF_EINVAL;
    }
    others = srnf_alloc(n * n + 1, sizeof(double));
    if (!others) {
        return SRNF_ENOMEM;
    }
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
            count++;
            if (!classes || classes[i] == classes[j]) {
                others[alike++] = d;
            }
        }
    }
    if (alike >= SRNF_TWINS_PAIRS) {
        qsort(others, alike, sizeof *others, compare_doubles);
        twins->median = median_of(others, alike);
        twins->quartile = others[alike / 4];
        twins->count = count_below(n, distances, subjects, SRNF_TWINS_SHARE * twins->quartile);
    }
    srnf_free(others);
    return SRNF_OK;
}
