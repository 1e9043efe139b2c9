/*
 * downdate.c - principal components of a group without one of its subjects.
 *
 * Let x_i be the subjects about the mean of all n, and S = sum_i x_i x_i' = diag(lambda) in the
 * basis of their components, z the scores of the subject left out. About their own mean the others
 * have the scatter matrix of a rank-one downdate,
 *
 *     S' = diag(lambda) - c z z',     c = n / (n - 1),
 *
 * and the subject is y = c z from that mean. Eigenvalues mu of S' solve the secular equation
 * (G. Golub, "Some modified matrix eigenvalue problems", SIAM Review 1973)
 *
 *     f(mu) = 1 - c sum_j z_j^2 / (lambda_j - mu) = 0,
 *
 * one in each interval below a lambda and above the next (0 below the last). The eigenvector is
 * v = (diag(lambda) - mu)^-1 z up to its length, and as z'v = 1 / c there, the score of y on it is
 *
 *     <y, v> / |v| = 1 / sqrt(sum_j z_j^2 / (lambda_j - mu)^2) = sqrt(c / |f'(mu)|):
 *
 * no eigenvector is needed. Where rank is n - 1 the last mu is 0, and its score is the distance of
 * the subject from the plane through the others.
 *
 * Roots are sought as distances t from the nearer end of their interval, so that differences
 * lambda_j - mu lose no digits. f goes there like A - B / t: each step takes A and B from value and
 * slope, and stays between the bounds known so far. Cost: rank^2 times about eight divisions.
 */
#include "downdate.h"

#include <float.h>
#include <math.h>

#define STEPS_MAX 200
#define PART (8.0 * DBL_EPSILON) /* by which equal eigenvalues are parted, of themselves */
#define FIRST_CUT 0x1p-10        /* of the bound, while nothing is known below it */

void stats_downdate_prepare(size_t n, size_t rank, double *values, double *z)
{
    for (size_t k = rank; k-- > 1;) {
        values[k - 1] = fmax(values[k - 1], values[k] * (1.0 + PART));
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < rank; k++) {
            double *score = &z[i * rank + k];
            double least = DBL_EPSILON * sqrt(values[k]);

            *score = fmax(fabs(*score), least);
        }
    }
}

struct secular {
    size_t rank;
    const double *values, *z;
    double c;
    double origin; /* the end that t is counted from */
    double sign;   /* 1: it is the upper one */
};

/* sign f, which increases with t, and its slope there. */
static double evaluate(const struct secular *s, double t, double *slope)
{
    double sum = 0.0;
    double steep = 0.0;

    for (size_t j = 0; j < s->rank; j++) {
        double over = s->z[j] / (s->values[j] - s->origin + s->sign * t);

        sum += s->z[j] * over;
        steep += over * over;
    }
    *slope = s->c * steep;
    return s->sign * (1.0 - s->c * sum);
}

/* The root in (0, width], and the slope at it. */
static double solve(const struct secular *s, double width, double *slope)
{
    double low = 0.0;
    double high = width;
    double t = width;

    for (int step = 0; step < STEPS_MAX; step++) {
        double value = evaluate(s, t, slope);
        double b = *slope * t * t;
        double next = b / (value + *slope * t); /* A = value + B / t */

        if (value == 0.0 || !(high - low > 2.0 * DBL_EPSILON * high)) {
            break;
        }
        if (value < 0.0) {
            low = t;
        } else {
            high = t;
        }
        if (!(next > low && next < high)) {
            next = low > 0.0 ? sqrt(low) * sqrt(high) : FIRST_CUT * high;
        }
        if (next == t) {
            break;
        }
        t = next;
    }
    return t;
}

static double find(struct secular *s, size_t k, double *slope)
{
    double upper = s->values[k];
    double lower = k + 1 < s->rank ? s->values[k + 1] : 0.0;
    double half = 0.5 * (upper - lower);
    double t;

    s->origin = upper;
    s->sign = 1.0;
    if (evaluate(s, half, slope) < 0.0) { /* not within half of the upper end */
        s->origin = lower;
        s->sign = -1.0;
    }
    t = solve(s, half, slope);
    (void)evaluate(s, t, slope);
    return s->origin - s->sign * t;
}

void stats_downdate(size_t n, size_t rank, const double *values, const double *z, double *root,
                    double *score)
{
    struct secular s = {.rank = rank, .values = values, .z = z, .c = (double)n / (double)(n - 1)};

    for (size_t k = 0; k < rank; k++) {
        double slope;

        if (k + 1 == n - 1) {
            s.origin = root[k] = 0.0;
            (void)evaluate(&s, 0.0, &slope);
        } else {
            root[k] = find(&s, k, &slope);
        }
        score[k] = sqrt(s.c / slope);
    }
}
