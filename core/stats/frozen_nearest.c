/*
 * frozen_nearest.c - nearest neighbours of the training members of a fold, by shape and numbers.
 *
 * As in classify_nearest.c the squared distance is d_ij^2 + sum_k (w s / r_k)^2 (z_ik - z_jk)^2, s
 * the rms distance and r_k the rms difference of the number k of two members. A member is judged
 * without its subject, which has no part in s and r_k either. Of t members
 *
 *     s^2 = 2 / (t - 1) [sum_i K_ii - sum_ij K_ij / t],
 *
 * K their inner products, and r_k^2 is the same of z_k. Sums without a subject follow from those of
 * all: O(n) for each of its members.
 */
#include "frozen.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define NOBODY SIZE_MAX
#define ROUNDING 8.0 /* times epsilon and members: what a sum is off by when some are taken out */

struct sums {
    size_t n, count;
    const struct subjects *subjects;
    const double *products;
    double members, trace, whole;
    double *rows;    /* [n] of the products with the training members */
    double *z;       /* [n][count] numbers, less their means */
    double *sum;     /* [count] of these */
    double *squares; /* [count] */
};

/* Of all members but those of a subject. */
static int sums_open(struct sums *s, const struct subjects *subjects, const double *products,
                     const struct frozen_numbers *numbers, size_t left_out)
{
    size_t n = subjects->n;
    size_t count = numbers->count;
    size_t about = 0; /* what is the same in all leaves no rounding beside a training member */

    *s = (struct sums){.n = n, .count = count, .subjects = subjects, .products = products};
    s->rows = srnf_alloc(n + (n + 2) * count, sizeof(double));
    if (!s->rows) {
        return SRNF_ENOMEM;
    }
    s->z = s->rows + n;
    s->sum = s->z + n * count;
    s->squares = s->sum + count;
    while (subjects->of[about] == left_out) {
        about++;
    }
    for (size_t i = 0; i < n; i++) {
        bool out = subjects->of[i] == left_out;

        s->members += out ? 0.0 : 1.0;
        for (size_t j = 0; j < n; j++) {
            s->rows[i] += subjects->of[j] == left_out ? 0.0 : products[i * n + j];
        }
        s->trace += out ? 0.0 : products[i * n + i];
        s->whole += out ? 0.0 : s->rows[i];
        for (size_t k = 0; k < count && !out; k++) {
            s->sum[k] += numbers->values[i * count + k] - numbers->values[about * count + k];
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < count; k++) {
            double *z = &s->z[i * count + k];

            *z = numbers->values[i * count + k] - numbers->values[about * count + k] -
                 s->sum[k] / s->members;
            s->squares[k] += subjects->of[i] == left_out ? 0.0 : *z * *z;
        }
    }
    memset(s->sum, 0, count * sizeof(double));
    return SRNF_OK;
}

static void sums_close(struct sums *s)
{
    srnf_free(s->rows);
}

/* w s / r_k without a subject more, or with all. */
static void factors_without(const struct sums *s, size_t subject, double weight, double *factors)
{
    const struct subjects *all = s->subjects;
    size_t first = subject == NOBODY ? 0 : all->start[subject];
    size_t end = subject == NOBODY ? 0 : all->start[subject + 1];
    double members = s->members - (double)(end - first);
    double trace = s->trace;
    double whole = s->whole;
    double spread;

    for (size_t a = first; a < end; a++) {
        size_t i = all->members[a];

        trace -= s->products[i * s->n + i];
        whole -= 2.0 * s->rows[i];
        for (size_t b = first; b < end; b++) {
            whole += s->products[i * s->n + all->members[b]];
        }
    }
    spread = fmax(trace - whole / members, 0.0);
    for (size_t k = 0; k < s->count; k++) {
        double sum = s->sum[k];
        double squares = s->squares[k];
        double least = ROUNDING * DBL_EPSILON * s->members * squares;

        for (size_t a = first; a < end; a++) {
            double z = s->z[all->members[a] * s->count + k];

            sum -= z;
            squares -= z * z;
        }
        squares -= sum * sum / members;
        factors[k] = squares > least ? weight * sqrt(spread / squares) : 0.0;
    }
}

double frozen_apart2(size_t count, const double *factors, const double *a, const double *b)
{
    double sum = 0.0;

    for (size_t k = 0; k < count; k++) {
        double d = factors[k] * (a[k] - b[k]);

        sum += d * d;
    }
    return sum;
}

int frozen_factors(const struct subjects *subjects, const double *products,
                   const struct frozen_numbers *numbers, double *factors)
{
    struct sums sums;
    int status = sums_open(&sums, subjects, products, numbers, NOBODY);

    if (status == SRNF_OK) {
        factors_without(&sums, NOBODY, numbers->weight, factors);
    }
    sums_close(&sums);
    return status;
}

int frozen_judge_nearest(const struct subjects *subjects, const double *products,
                         const struct frozen_numbers *numbers, const size_t *labels, size_t classes,
                         size_t left_out, double *evidence)
{
    const size_t *of = subjects->of;
    size_t n = subjects->n;
    size_t count = numbers->count;
    double *factors = srnf_alloc(count + 1, sizeof(double));
    struct sums sums;
    int status = sums_open(&sums, subjects, products, numbers, left_out);

    status = factors ? status : SRNF_ENOMEM;
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        double *e = evidence + i * classes;

        for (size_t c = 0; c < classes; c++) {
            e[c] = -INFINITY;
        }
        if (of[i] != left_out) {
            factors_without(&sums, of[i], numbers->weight, factors);
        }
        for (size_t j = 0; j < n && of[i] != left_out; j++) {
            if (of[j] != of[i] && of[j] != left_out) {
                double square =
                    products[i * n + i] + products[j * n + j] - 2.0 * products[i * n + j];

                square = fmax(0.0, square) +
                         frozen_apart2(count, factors, sums.z + i * count, sums.z + j * count);
                e[labels[j]] = fmax(e[labels[j]], -sqrt(square));
            }
        }
    }
    sums_close(&sums);
    srnf_free(factors);
    return status;
}
