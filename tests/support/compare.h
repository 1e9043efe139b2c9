/*
 * compare.h - the largest error of many, so that a NaN among them fails the test.
 *
 * fmax(3, NaN) is 3, `if (d > worst) worst = d` skips a NaN, and qsort with (x > y) - (x < y)
 * leaves one anywhere: a limit on what comes out of these cannot fail on a result that is no
 * number. Here a NaN, once met, is the answer, and `answer <= limit` is false. An assertion must
 * say it that way round: !(NaN > limit) is true. tests/lint forbids what drops a NaN in the tests,
 * so that nothing but this is used.
 */
#ifndef TESTS_COMPARE_H
#define TESTS_COMPARE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* The larger; NaN if either is. */
static inline double compare_max(double a, double b)
{
    return isnan(a) || a >= b ? a : b;
}

/* The smaller; NaN if either is. */
static inline double compare_min(double a, double b)
{
    return isnan(a) || a <= b ? a : b;
}

/* The largest |a|, 0 of none; NaN if there is one anywhere. */
static inline double compare_largest(size_t n, const double *a)
{
    double largest = 0.0;

    for (size_t i = 0; i < n; i++) {
        largest = compare_max(largest, fabs(a[i]));
    }
    return largest;
}

/* The largest |a - b|, 0 of none; NaN if there is one anywhere, and where both are infinite. */
static inline double compare_difference(size_t n, const double *a, const double *b)
{
    double largest = 0.0;

    for (size_t i = 0; i < n; i++) {
        largest = compare_max(largest, fabs(a[i] - b[i]));
    }
    return largest;
}

/* The same relative to the largest |expected|; not finite if that is 0 or NaN. */
static inline double compare_relative(size_t n, const double *actual, const double *expected)
{
    return compare_difference(n, actual, expected) / compare_largest(n, expected);
}

/* Neither NaN nor infinite. */
static inline bool compare_finite(size_t n, const double *a)
{
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(a[i])) {
            return false;
        }
    }
    return true;
}

/* For qsort: ascending doubles, NaNs last, so that the last one shows whether there are any. */
static inline int compare_order(const void *a, const void *b)
{
    double x = *(const double *)a;
    double y = *(const double *)b;

    if (isnan(x) || isnan(y)) {
        return isnan(x) - isnan(y);
    }
    return (x > y) - (x < y);
}

#endif
