/*
 * folds_scores.c - principal components and distances of one fold, from inner products alone.
 *
 * With K_ab = <q_a, q_b> over all n subjects and the mean of the n - 1 training subjects,
 *
 *   G_ab = <q_a - mean, q_b - mean> = K_ab - m_a - m_b + m,
 *
 * m_a the mean of K_ab over training b, m the mean of m_a over training a. The eigenvectors v_k of
 * G over the training subjects give their scores sqrt(lambda_k) v_k, and those of any subject
 * <q - mean, mode_k> = sum over training b of v_kb G_b / sqrt(lambda_k): the one left out takes no
 * part in either. Distances are sqrt(G_aa + G_bb - 2 G_ab).
 *
 * Cost O(n^3), and O(n^2 P) for the inner products.
 */
#include "folds.h"

#include <cblas.h>
#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

void fold_products(const struct srnf_grid *grid, size_t n, const double *q, double *scaled,
                   double *products)
{
    size_t points = stats_points(grid);
    size_t size = 3 * points;

    for (size_t m = 0; m < n * size; m++) {
        scaled[m] = sqrt(grid->weight[m % points / grid->n_phi]) * q[m];
    }
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasNoTrans, (int)n, (int)size, 1.0, scaled, (int)size,
                0.0, products, (int)n);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            products[j * n + i] = products[i * n + j];
        }
    }
}

/* G from K, in place of a copy of it. */
static void center(size_t n, size_t left_out, double *g, double *means)
{
    double mean = 0.0;

    for (size_t a = 0; a < n; a++) {
        means[a] = 0.0;
        for (size_t b = 0; b < n; b++) {
            means[a] += b == left_out ? 0.0 : g[a * n + b] / (double)(n - 1);
        }
        mean += a == left_out ? 0.0 : means[a] / (double)(n - 1);
    }
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b < n; b++) {
            g[a * n + b] += mean - means[a] - means[b];
        }
    }
}

/* Rows of the training subjects without the column of the one left out. */
static void gather(size_t n, size_t left_out, const double *g, double *training)
{
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b < n && a != left_out; b++) {
            if (b != left_out) {
                training[(a - (a > left_out)) * (n - 1) + b - (b > left_out)] = g[a * n + b];
            }
        }
    }
}

static double measure(size_t n, size_t left_out, const double *g, double *distances)
{
    double sum = 0.0;
    size_t pairs = 0;

    for (size_t a = 0; a < n; a++) {
        distances[a] =
            sqrt(fmax(0.0, g[a * n + a] + g[left_out * n + left_out] - 2.0 * g[a * n + left_out]));
        for (size_t b = 0; b < a && a != left_out; b++) {
            if (b != left_out) {
                sum += fmax(0.0, g[a * n + a] + g[b * n + b] - 2.0 * g[a * n + b]);
                pairs++;
            }
        }
    }
    distances[left_out] = 0.0;
    return pairs ? sqrt(sum / (double)pairs) : 0.0;
}

int fold_describe(size_t n, size_t left_out, const double *products, size_t components,
                  double *scores, double *distances, double *spread)
{
    size_t t = n - 1;
    lapack_int size = (lapack_int)t;
    double *memory = srnf_alloc(n * n + t * t + 2 * n + 64 * n, sizeof(double));
    double *g = memory;
    double *vectors;
    double *values;
    double *means;
    double *work;
    int status = SRNF_OK;

    if (!memory) {
        return SRNF_ENOMEM;
    }
    vectors = g + n * n;
    values = vectors + t * t;
    means = values + n;
    work = means + n;
    memcpy(g, products, n * n * sizeof(double));
    center(n, left_out, g, means);
    *spread = measure(n, left_out, g, distances);
    gather(n, left_out, g, vectors);
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', size, vectors, size, values, work,
                           (lapack_int)(64 * n)) != 0) {
        status = SRNF_ENUMERIC;
        goto out;
    }
    for (size_t k = 0; k < components; k++) {
        double value = k < t ? values[t - 1 - k] : 0.0;
        bool sound = value > (double)n * DBL_EPSILON * products[0] && value > 0.0;

        for (size_t a = 0; a < n; a++) {
            double sum = 0.0;

            for (size_t b = 0; sound && b < t; b++) {
                sum += vectors[(t - 1 - k) * t + b] * g[a * n + b + (b >= left_out)];
            }
            scores[a * components + k] = sound ? sum / sqrt(value) : 0.0;
        }
    }
out:
    srnf_free(memory);
    return status;
}
