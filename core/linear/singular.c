/*
 * singular.c - the singular value decomposition of a 3 x 3 matrix.
 */
#include "linear.h"

#include <lapacke.h>
#include <math.h>
#include <stdbool.h>

int linear_singular(const double a[9], double s[3], double u[9], double vt[9])
{
    double copy[9];
    double work[64];
    bool finite = true;

    for (size_t i = 0; i < 9; i++) {
        copy[i] = a[i];
        finite = finite && isfinite(a[i]);
    }
    /* Of a matrix with an infinite number dgesvd does not end. */
    if (!finite) {
        return SRNF_ENUMERIC;
    }
    return LAPACKE_dgesvd_work(LAPACK_COL_MAJOR, 'A', 'A', 3, 3, copy, 3, s, u, 3, vt, 3, work,
                               64) == 0
               ? SRNF_OK
               : SRNF_ENUMERIC;
}
