/*
 * intervals.h - how far lengths and variances of a linear model are known (intervals.c).
 */
#ifndef SRNF_STATS_INTERVALS_H
#define SRNF_STATS_INTERVALS_H

#include "stats.h"

/* Residuals of a model with an orthonormal basis U of n subjects. */
struct intervals {
    size_t n, count;
    const double *basis; /* [count][n] U, not owned */
    double *rest;        /* [n] 1 - h_i: the diagonal of R = 1 - U U' */
    double *gram;        /* [n][n] products of the residuals R y */
    double *scratch;     /* [2 n + count] */
};

/* gram: [n][n] of the data y, or of y less what U explains in part. SRNF_ENOMEM. intervals_close in
   any case. */
SRNF_CHECKED int intervals_open(struct intervals *of, size_t n, size_t count, const double *basis,
                                const double *gram);
void intervals_close(struct intervals *of);

/*
 * The 95 % interval of the norm of what b = sum of weights[i] y_i estimates.
 *   weights   [in]  [n] in the span of U
 *   along     [in]  [n] products <y_i, b>, y as for intervals_open
 *   square    [in]  |b|^2
 *   interval  [out] holds |b|, not negative; NAN where fewer than 3 degrees of freedom tell how far
 *                   b is known, and where subjects, or what b compares, are equal but for rounding
 */
void intervals_norm(const struct intervals *of, const double *weights, const double *along,
                    double square, double interval[2]);

/* The same of the ratio of the square of that norm to tr C, the mean square of what noise adds to
   it; not extended to hold |b|^2 over tr C, which is too large. */
void intervals_ratio(const struct intervals *of, const double *weights, const double *along,
                     double square, double interval[2]);

/* The same of the residual variance, value; NAN with fewer than 3 degrees of freedom, and of 0. */
void intervals_variance(const struct intervals *of, double value, double interval[2]);

/* The same from what is known otherwise: squares, tr M^2 over (tr M)^2 of the products M of the
   residuals; differ, the variance over the square, of how subjects differ. */
void intervals_of_variance(double value, double freedom, double squares, double differ,
                           double interval[2]);

/* The quantile of a mean of squares with the mean 1 and this variance, at `normal` of the normal
   distribution (E. Wilson, M. Hilferty, 1931); 1e-3 at least. */
double intervals_square(double variance, double normal);

#endif
