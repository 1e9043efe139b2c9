/*
 * spreads.c - how far the subjects of each group scatter, and what that makes of a test by
 * permutation, which has one spread for all.
 */
#include "srnf/regress.h"

#include <math.h>

#define LEAST_FREEDOM 1e-9 /* of a group whose subjects the model fixes */

double srnf_spreads(size_t n, size_t groups, const size_t *group, const double *squares,
                    const double *freedom, const double *weights, double *spread)
{
    double all = 0.0, free = 0.0, weight = 0.0, own = 0.0, pooled;

    for (size_t i = 0; i < n; i++) {
        all += squares[i];
        free += freedom[i];
    }
    pooled = free > 0.0 ? fmax(all, 0.0) / free : 0.0;
    for (size_t k = 0; k < groups; k++) {
        double square = 0.0, of = 0.0, part = 0.0;

        for (size_t i = 0; i < n; i++) {
            square += group[i] == k ? squares[i] : 0.0;
            of += group[i] == k ? freedom[i] : 0.0;
            part += group[i] == k ? weights[i] : 0.0;
        }
        square = of > LEAST_FREEDOM ? fmax(square, 0.0) / of : pooled;
        own += part * square;
        weight += part;
        spread[k] = sqrt(square);
    }
    return pooled > 0.0 && weight > 0.0 ? own / (pooled * weight) : 1.0;
}
