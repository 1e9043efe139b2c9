/*
 * covariates.c - see srnf/covariates.h.
 *
 * Columns are made orthogonal one after another (Gram and Schmidt, twice each). What is left of a
 * column, over what it had about its mean, is the root of its tolerance.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

#include "srnf/covariates.h"

#define DEPENDENT 1e-8 /* of a column's length: rounding */
#define CONSTANT 1e-10 /* of a column's largest entry: what differs by less has no digits left */

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Takes the parts along m orthonormal columns away from a column. Returns the length left. */
static double reduce(size_t n, const double *basis, size_t m, double *column)
{
    for (int pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < m; j++) {
            double along = dot(n, basis + j * n, column);

            for (size_t i = 0; i < n; i++) {
                column[i] -= along * basis[j * n + i];
            }
        }
    }
    return sqrt(dot(n, column, column));
}

static void scale(size_t n, double factor, double *column)
{
    for (size_t i = 0; i < n; i++) {
        column[i] *= factor;
    }
}

bool stats_center(size_t n, const double *lead, double *column)
{
    double part = lead ? column[0] / lead[0] : column[0], largest = 0.0, spread = 0.0;

    for (size_t i = 0; i < n; i++) {
        largest = fmax(largest, fabs(column[i]));
        column[i] -= lead ? part * lead[i] : part;
        spread = fmax(spread, fabs(column[i]));
    }
    if (!(spread > CONSTANT * largest)) {
        return false;
    }
    scale(n, 1.0 / spread, column);
    return true;
}

/* Room for m columns of n; NULL with *status. */
static double *columns(size_t m, size_t n, int *status)
{
    size_t count;
    double *array = NULL;

    *status = SRNF_OK;
    if (n == 0) {
        *status = SRNF_EINVAL;
    } else if (__builtin_mul_overflow(m, n, &count) ||
               !(array = srnf_alloc(count, sizeof *array))) {
        *status = SRNF_ENOMEM;
    }
    return array;
}

int srnf_covariates_check(size_t m, size_t n, const double *values, enum srnf_covariate *verdicts)
{
    size_t kept = 1;
    int status;
    double *basis = columns(m + 1, n, &status);

    for (size_t i = 0; basis && i < n; i++) {
        basis[i] = 1.0 / sqrt((double)n);
    }
    for (size_t j = 0; basis && j < m; j++) {
        double *column = basis + kept * n, left, about_mean;
        bool differs;

        memcpy(column, values + j * n, n * sizeof *column);
        differs = stats_center(n, NULL, column);
        about_mean = reduce(n, basis, 1, column);
        left = reduce(n, basis, kept, column);
        verdicts[j] = SRNF_COVARIATE_FREE;
        if (!differs) {
            verdicts[j] = SRNF_COVARIATE_CONSTANT;
        } else if (!(left > DEPENDENT * about_mean)) {
            verdicts[j] = SRNF_COVARIATE_FOLLOWS;
        } else {
            scale(n, 1.0 / left, column);
            kept++;
        }
    }
    srnf_free(basis);
    return status;
}

/* Columns of subjects: the mean of covariate j less that of member 0, or the group where j is m,
   over the members of each. Those of members that are not the first of their subject stay 0. */
static void fill_column(size_t n, size_t m, size_t j, const size_t *subjects, const int *group,
                        const double *covariates, double *count, double *column)
{
    memset(column, 0, n * sizeof *column);
    memset(count, 0, n * sizeof *count);
    for (size_t i = 0; i < n; i++) {
        column[subjects[i]] += j == m ? (double)group[i] : covariates[i * m + j] - covariates[j];
        count[subjects[i]] += 1.0;
    }
    for (size_t i = 0; i < n; i++) {
        column[i] = count[i] > 0.0 ? column[i] / count[i] : 0.0;
    }
}

int srnf_covariates_inflation(size_t n, const size_t *subjects, const int *group, size_t m,
                              const double *covariates, double *inflation, size_t *closest)
{
    size_t kept = 1, n_subjects = 0;
    int status;
    double *basis = columns(m + 4, n, &status);
    double *target = basis ? basis + (m + 1) * n : NULL, *count = basis ? target + n : NULL;
    double *centred = basis ? count + n : NULL, largest = 0.0, length, left;

    if (!basis) {
        return status;
    }
    *closest = 0;
    for (size_t i = 0; i < n; i++) {
        n_subjects += subjects[i] == i;
    }
    for (size_t i = 0; i < n; i++) {
        basis[i] = subjects[i] == i ? 1.0 / sqrt((double)n_subjects) : 0.0;
    }
    fill_column(n, m, m, subjects, group, covariates, count, centred);
    length = reduce(n, basis, 1, centred);
    memcpy(target, centred, n * sizeof *target);
    for (size_t j = 0; j < m; j++) {
        double *column = basis + kept * n, about_mean, alike;

        fill_column(n, m, j, subjects, group, covariates, count, column);
        about_mean = reduce(n, basis, 1, column);
        alike = about_mean > 0.0 ? fabs(dot(n, column, centred)) / about_mean : 0.0;
        *closest = alike > largest ? j : *closest;
        largest = fmax(largest, alike);
        left = reduce(n, basis, kept, column);
        if (left > DEPENDENT * about_mean) {
            scale(n, 1.0 / left, column);
            kept++;
        }
    }
    left = reduce(n, basis, kept, target);
    *inflation = left > 0.0 ? (length / left) * (length / left) : INFINITY;
    srnf_free(basis);
    return SRNF_OK;
}

/* Adds column j to *kept orthonormal columns, the first of them the constant, if it says anything
   that they do not. Returns the length it has left, of 1 about its mean. count: [n], scratch. */
static double add_column(size_t n, size_t m, size_t j, const size_t *subjects, const double *values,
                         double *count, double *basis, size_t *kept)
{
    double *column = basis + *kept * n, largest = 0.0, about_mean, left;

    fill_column(n, m, j, subjects, NULL, values, count, column);
    for (size_t i = 0; i < n; i++) {
        largest = fmax(largest, fabs(column[i]));
    }
    scale(n, largest > 0.0 ? 1.0 / largest : 1.0, column);
    about_mean = reduce(n, basis, 1, column);
    left = reduce(n, basis, *kept, column);
    if (!(about_mean > DEPENDENT) || !(left > DEPENDENT * about_mean)) {
        return 0.0;
    }
    scale(n, 1.0 / left, column);
    ++*kept;
    return left / about_mean;
}

int srnf_term_inflation(size_t n, const size_t *subjects, size_t m, const double *values,
                        const enum srnf_column *roles, double *inflation)
{
    size_t own = 1, all = 1, n_subjects = 0, freedom;
    int status;
    double *alone = columns(2 * m + 3, n, &status); /* its columns; the others, then its columns */
    double *beside = alone ? alone + (m + 1) * n : NULL, *count = alone ? beside + (m + 1) * n : 0;
    double lost = 0.0;

    for (size_t i = 0; alone && i < n; i++) {
        n_subjects += subjects[i] == i;
    }
    for (size_t i = 0; alone && i < n; i++) {
        alone[i] = beside[i] = subjects[i] == i ? 1.0 / sqrt((double)n_subjects) : 0.0;
    }
    for (size_t j = 0; alone && j < m; j++) {
        if (roles[j] == SRNF_COLUMN_BESIDE) {
            (void)add_column(n, m, j, subjects, values, count, beside, &all);
        }
    }
    for (size_t j = 0; alone && j < m; j++) {
        double left = roles[j] == SRNF_COLUMN_OF_TERM
                          ? add_column(n, m, j, subjects, values, count, alone, &own)
                          : 0.0;

        if (left > 0.0) {
            lost += log(left / add_column(n, m, j, subjects, values, count, beside, &all));
        }
    }
    freedom = own - 1;
    *inflation = alone && freedom > 0 ? exp(2.0 * lost / (double)freedom) : 1.0;
    srnf_free(alone);
    return status;
}
