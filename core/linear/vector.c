/*
 * vector.c - the few operations on long vectors that the solvers need. They sum in four lanes and
 * then across, in a fixed order: the same on every thread and for every number of threads.
 */
#include "linear.h"
#include "harmonics/simd.h"

#include <math.h>

SIMD_INLINE double sum_lanes(const simd *sum)
{
    return ((*sum)[0] + (*sum)[1]) + ((*sum)[2] + (*sum)[3]);
}

SRNF_HOT double linear_dot(size_t n, const double *a, const double *b)
{
    simd sum = SIMD_SET(0.0);
    size_t i = 0;
    double tail = 0.0;

    for (; i + SRNF_LANES <= n; i += SRNF_LANES) {
        simd x;
        simd y;

        SIMD_LOAD(x, a + i);
        SIMD_LOAD(y, b + i);
        sum += x * y;
    }
    for (; i < n; i++) {
        tail += a[i] * b[i];
    }
    return sum_lanes(&sum) + tail;
}

SRNF_HOT double linear_dot_weighted(size_t n, const double *weight, const double *a,
                                    const double *b)
{
    simd sum = SIMD_SET(0.0);
    size_t i = 0;
    double tail = 0.0;

    for (; i + SRNF_LANES <= n; i += SRNF_LANES) {
        simd w;
        simd x;
        simd y;

        SIMD_LOAD(w, weight + i);
        SIMD_LOAD(x, a + i);
        SIMD_LOAD(y, b + i);
        sum += w * x * y;
    }
    for (; i < n; i++) {
        tail += weight[i] * a[i] * b[i];
    }
    return sum_lanes(&sum) + tail;
}

SRNF_HOT void linear_axpy(size_t n, double factor, const double *restrict x, double *restrict y)
{
    for (size_t i = 0; i < n; i++) {
        y[i] += factor * x[i];
    }
}

void linear_scale(size_t n, double factor, double *x)
{
    for (size_t i = 0; i < n; i++) {
        x[i] *= factor;
    }
}

void linear_copy(size_t n, const double *from, double *to)
{
    memcpy(to, from, n * sizeof(double));
}

void linear_diagonal(size_t degree, double a, double b, double *diagonal)
{
    size_t count = srnf_coefficient_count(degree);

    for (size_t l = 0; l <= degree; l++) {
        double value = l > 0 ? a + b * (double)l * (double)(l + 1) : 0.0;

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            diagonal[i] = value;
            diagonal[count + i] = value;
            diagonal[2 * count + i] = value;
        }
    }
}
