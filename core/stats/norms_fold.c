/*
 * norms_fold.c - a linear model of the members that are in a fold, by an orthonormal basis U of its
 * design: X = U R with the constant first, by Gram and Schmidt, twice for each column, all columns
 * less a number that the constant tells. What is predicted at a row x is a sum of the members'
 * values with the weights
 *
 *     a = U u,    R'u = x,    and the leverage is |u|^2.
 */
#include "norms.h"

#include <cblas.h>
#include <math.h>

#define DEPENDENT 1e-8 /* of a column's length: rounding */

void norms_fold_clear(struct norms_fold *fold)
{
    srnf_free(fold->inside);
    srnf_free(fold->basis);
    srnf_free(fold->r);
    srnf_free(fold->shift);
    *fold = (struct norms_fold){0};
}

/* Whether column k differs among the members inside. Its first entry is taken off all of them, as
   stats_center does: a column far from 0 keeps its digits. */
static bool open_column(struct norms_fold *fold, const struct norms *norms, size_t k, double *v)
{
    size_t first = 0;

    while (!fold->inside[first]) {
        first++;
    }
    fold->shift[k] = k == 0 ? 0.0 : norms_row(norms, first)[k - 1];
    for (size_t i = 0; i < fold->n; i++) {
        v[i] = k == 0 ? 1.0 : norms_row(norms, fold->inside[i] ? i : first)[k - 1];
    }
    if (k > 0 && !stats_center(fold->n, NULL, v)) {
        return false;
    }
    for (size_t i = 0; i < fold->n; i++) {
        v[i] = !fold->inside[i] ? 0.0 : k == 0 ? 1.0 : norms_row(norms, i)[k - 1] - fold->shift[k];
    }
    return true;
}

/* Adds column k; false where it follows from those before it. */
static bool add_column(struct norms_fold *fold, const struct norms *norms, size_t k)
{
    int n = (int)fold->n;
    double *v = fold->basis + k * fold->n;
    double before = 0.0;
    double after;

    if (!open_column(fold, norms, k, v)) {
        return false;
    }
    for (int pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < k; j++) {
            double along = cblas_ddot(n, fold->basis + j * fold->n, 1, v, 1);

            fold->r[j * fold->p + k] += along;
            cblas_daxpy(n, -along, fold->basis + j * fold->n, 1, v, 1);
            before = pass == 0 && j == 0 ? cblas_dnrm2(n, v, 1) : before;
        }
    }
    after = cblas_dnrm2(n, v, 1);
    fold->r[k * fold->p + k] = after;
    if (k > 0 && !(after > DEPENDENT * before)) {
        return false;
    }
    cblas_dscal(n, 1.0 / after, v, 1);
    return true;
}

int norms_fold_open(struct norms_fold *fold, const struct norms *norms, size_t group,
                    size_t subject, struct srnf_error *error)
{
    size_t p = norms->model->columns + 1;

    *fold = (struct norms_fold){.n = norms->n, .p = p};
    fold->inside = srnf_alloc(norms->n, sizeof *fold->inside);
    fold->basis = srnf_alloc(p, norms->n * sizeof(double));
    fold->r = srnf_alloc(p, p * sizeof(double));
    fold->shift = srnf_alloc(p, sizeof *fold->shift);
    if (!fold->inside || !fold->basis || !fold->r || !fold->shift) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < norms->n; i++) {
        size_t s = norms->subjects.of[i];

        fold->inside[i] = s != subject && (group == NORMS_NONE || norms_group(s) != group);
        fold->members += fold->inside[i];
    }
    if (fold->members < p + 2) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu members are too few for %zu coefficients",
                         fold->members, p);
    }
    for (size_t k = 0; k < p; k++) {
        if (!add_column(fold, norms, k)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)k - 1,
                             "column %zu is constant or follows from those before it in %zu of %zu "
                             "members",
                             k - 1, fold->members, fold->n);
        }
    }
    return SRNF_OK;
}

double norms_fold_predict(const struct norms_fold *fold, const double *x, double *u, double *a)
{
    double leverage = 0.0;

    for (size_t k = 0; k < fold->p; k++) {
        u[k] = k == 0 ? 1.0 : x[k - 1] - fold->shift[k];
        for (size_t j = 0; j < k; j++) {
            u[k] -= fold->r[j * fold->p + k] * u[j];
        }
        u[k] /= fold->r[k * fold->p + k];
        leverage += u[k] * u[k];
    }
    cblas_dgemv(CblasRowMajor, CblasTrans, (int)fold->p, (int)fold->n, 1.0, fold->basis,
                (int)fold->n, u, 1, 0.0, a, 1);
    return leverage;
}
