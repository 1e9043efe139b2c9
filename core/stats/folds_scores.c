/*
 * folds_scores.c - principal components and distances of one fold, from inner products alone.
 *
 * With K_ab = <q_a, q_b> over all n members and the mean of the t training members,
 *
 *   G_ab = <q_a - mean, q_b - mean> = K_ab - m_a - m_b + m,
 *
 * m_a the mean of K_ab over training b, m the mean of m_a over training a. The eigenvectors v_k of
 * G over the training members give their scores sqrt(lambda_k) v_k, and those of any member
 * <q - mean, mode_k> = sum over training b of v_kb G_b / sqrt(lambda_k): those left out take no
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

/* G from K, in place of a copy of it. training: [t] members. */
static void center(size_t n, size_t t, const size_t *training, double *g, double *means)
{
    double mean = 0.0;

    for (size_t a = 0; a < n; a++) {
        means[a] = 0.0;
        for (size_t b = 0; b < t; b++) {
            means[a] += g[a * n + training[b]] / (double)t;
        }
    }
    for (size_t a = 0; a < t; a++) {
        mean += means[training[a]] / (double)t;
    }
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b < n; b++) {
            g[a * n + b] += mean - means[a] - means[b];
        }
    }
}

static double distance2(size_t n, const double *g, size_t a, size_t b)
{
    return fmax(0.0, g[a * n + a] + g[b * n + b] - 2.0 * g[a * n + b]);
}

/* rms distance between two training members. */
static double measure_spread(size_t n, size_t t, const size_t *training, const double *g)
{
    double sum = 0.0;

    for (size_t a = 0; a < t; a++) {
        for (size_t b = 0; b < a; b++) {
            sum += distance2(n, g, training[a], training[b]);
        }
    }
    return t > 1 ? sqrt(sum / (double)(t * (t - 1) / 2)) : 0.0;
}

/* Rows of the members of the subject left out. */
static void measure_distances(const struct subjects *subjects, size_t left_out, const double *g,
                              double *distances)
{
    size_t n = subjects->n;

    for (size_t m = subjects->start[left_out]; m < subjects->start[left_out + 1]; m++) {
        size_t i = subjects->members[m];

        for (size_t a = 0; a < n; a++) {
            distances[i * n + a] = a == i ? 0.0 : sqrt(distance2(n, g, a, i));
        }
    }
}

/* Scores of all members on the eigenvectors, [t][t] in increasing order of their values. smallest:
   a value that is rounding. */
static void project(size_t n, size_t t, const size_t *training, const double *g,
                    const double *vectors, const double *values, double smallest, size_t components,
                    double *scores)
{
    for (size_t k = 0; k < components; k++) {
        double value = k < t ? values[t - 1 - k] : 0.0;
        bool sound = value > smallest && value > 0.0;

        for (size_t a = 0; a < n; a++) {
            double sum = 0.0;

            for (size_t b = 0; sound && b < t; b++) {
                sum += vectors[(t - 1 - k) * t + b] * g[a * n + training[b]];
            }
            scores[a * components + k] = sound ? sum / sqrt(value) : 0.0;
        }
    }
}

int fold_describe(const struct subjects *subjects, size_t left_out, const double *products,
                  size_t components, double *scores, double *distances, double *spread)
{
    size_t n = subjects->n;
    size_t t = 0;
    size_t *training = srnf_alloc(n, sizeof *training);
    double *g = srnf_alloc(2 * n * n + 2 * n + 64 * n, sizeof(double));
    double *vectors;
    double *values;
    double *means;
    double *work;
    double smallest;
    int status = SRNF_OK;

    if (!training || !g) {
        status = SRNF_ENOMEM;
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        if (subjects->of[i] != left_out) {
            training[t++] = i;
        }
    }
    vectors = g + n * n;
    values = vectors + n * n;
    means = values + n;
    work = means + n;
    smallest = (double)n * DBL_EPSILON * products[training[0] * (n + 1)];
    memcpy(g, products, n * n * sizeof(double));
    center(n, t, training, g, means);
    *spread = measure_spread(n, t, training, g);
    measure_distances(subjects, left_out, g, distances);
    for (size_t a = 0; a < t; a++) {
        for (size_t b = 0; b < t; b++) {
            vectors[a * t + b] = g[training[a] * n + training[b]];
        }
    }
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', (lapack_int)t, vectors, (lapack_int)t,
                           values, work, (lapack_int)(64 * n)) != 0) {
        status = SRNF_ENUMERIC;
        goto out;
    }
    project(n, t, training, g, vectors, values, smallest, components, scores);
out:
    srnf_free(training);
    srnf_free(g);
    return status;
}
