/*
 * eigenvalues.c - all eigenvalues and eigenvectors of a symmetric matrix.
 */
#include "linear/linear.h"

#include <lapacke.h>

int linear_eigenvalues(size_t size_of, bool vectors, double *matrix, double *values)
{
    lapack_int n = (lapack_int)size_of;
    lapack_int work_size;
    lapack_int iwork_size = 0;
    lapack_int *iwork;
    double size = 0.0;
    double *work;
    char job = vectors ? 'V' : 'N';
    int status = SRNF_ENOMEM;

    if (LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, job, 'L', n, NULL, n, NULL, &size, -1, &iwork_size,
                            -1)) {
        return SRNF_ENUMERIC;
    }
    work_size = (lapack_int)size;
    work = srnf_alloc((size_t)work_size, sizeof(double));
    iwork = srnf_alloc((size_t)iwork_size, sizeof *iwork);
    if (work && iwork) {
        status = LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, job, 'L', n, matrix, n, values, work,
                                     work_size, iwork, iwork_size)
                     ? SRNF_ENUMERIC
                     : SRNF_OK;
    }
    srnf_free(work);
    srnf_free(iwork);
    return status;
}
