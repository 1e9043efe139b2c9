/*
 * figures.h - what the tests of the core share: assertions that print what they measured, as
 * diagnostics of TAP.
 */
#ifndef TESTS_SHAPE_FIGURES_H
#define TESTS_SHAPE_FIGURES_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "support/compare.h"
#include "support/shapes.h"

/* Sanitizers, or a counter for each line, and -O1 cost a factor of five to ten: the longest tests
   then take every n-th shape. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(TESTS_COUNT_LINES)
#define FIGURES_SLOW 1
#else
#define FIGURES_SLOW 0
#endif

/* First in a test that counts how often something happens in many studies: a sanitizer sees in them
   what it sees in one, as other tests of the program have it. */
static inline void figures_count_unsanitized(void)
{
    if (FIGURES_SLOW) {
        skip();
    }
}

/* OpenBLAS has no header of its own for this on every distribution. */
extern void openblas_set_num_threads(int threads);

/* value <= limit, which no NaN passes. */
static inline void figure_below(const char *what, double value, double limit)
{
    printf("# %s: %.2e (limit %.0e)\n", what, value, limit);
    assert_true(value <= limit);
}

/*
 * errors[k] belongs to a width divided by ratio^k. Between neighbours above floor the order of
 * convergence must be the wanted one up to slack, and there must be at least `least` such pairs.
 */
static inline void figure_order(const char *what, size_t n, const double *errors, double ratio,
                                double order, double slack, double floor, size_t least)
{
    size_t pairs = 0;

    printf("# %s: error (order)", what);
    for (size_t k = 0; k < n; k++) {
        double measured = k > 0 ? log(errors[k - 1] / errors[k]) / log(ratio) : 0.0;

        printf(k > 0 ? " %.1e (%.2f)" : " %.1e", errors[k], measured);
        if (k > 0 && errors[k] > floor) {
            pairs += fabs(measured - order) <= slack;
        }
    }
    printf("\n");
    assert_true(compare_finite(n, errors)); /* a NaN would end the loop as one below floor does */
    for (size_t k = 1; k < n && errors[k] > floor; k++) {
        assert_true(fabs(log(errors[k - 1] / errors[k]) / log(ratio) - order) <= slack);
    }
    assert_true(pairs >= least);
}

static inline double figure_dot(size_t n, const double *a, const double *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static inline double figure_norm(size_t n, const double *a)
{
    return sqrt(figure_dot(n, a, a));
}

#endif
