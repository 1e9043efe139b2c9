/*
 * regress_design.c - orthonormal bases of the columns of linear models.
 *
 * Gram-Schmidt in two passes (L. Giraud et al. 2005: twice is enough) on columns that are moved and
 * scaled (stats_center), so that units do not matter. With X = U'R for the whole model the weights
 * of the coefficients are R^(-1) U.
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>

/* A column of which the others leave no more than this part about its mean follows from them. */
#define DEPENDENT 1e-8

void regress_reduce(const struct regress_basis *basis, size_t count, double *v)
{
    for (size_t j = 0; j < count; j++) {
        const double *u = basis->vectors + j * basis->n;
        double along = cblas_ddot((int)basis->n, u, 1, v, 1);

        cblas_daxpy((int)basis->n, -along, u, 1, v, 1);
    }
}

static int basis_open(struct regress_basis *basis, size_t n, const double *lead, size_t capacity)
{
    double length = lead ? cblas_dnrm2((int)n, lead, 1) : sqrt((double)n);

    *basis = (struct regress_basis){.n = n, .count = 1};
    basis->vectors = srnf_alloc(capacity, n * sizeof(double));
    for (size_t i = 0; basis->vectors && i < n; i++) {
        basis->vectors[i] = (lead ? lead[i] : 1.0) / length;
    }
    return basis->vectors ? SRNF_OK : SRNF_ENOMEM;
}

/* Adds what the basis leaves of a column; false: nothing. */
static bool basis_add(struct regress_basis *basis, const double *lead, size_t columns,
                      size_t column, const double *values)
{
    size_t n = basis->n;
    double *v = basis->vectors + basis->count * n;
    double before;
    double after;

    for (size_t i = 0; i < n; i++) {
        v[i] = values[i * columns + column];
    }
    if (!stats_center(n, lead, v)) {
        return false;
    }
    regress_reduce(basis, 1, v); /* about its mean */
    regress_reduce(basis, 1, v);
    before = cblas_dnrm2((int)n, v, 1);
    regress_reduce(basis, basis->count, v);
    regress_reduce(basis, basis->count, v);
    after = cblas_dnrm2((int)n, v, 1);
    if (!(after > DEPENDENT * before)) {
        return false;
    }
    cblas_dscal((int)n, 1.0 / after, v, 1);
    basis->count++;
    return true;
}

/* ---- Two models, one in the other ------------------------------------------------------------ */

int regress_model_create(struct regress_model *model, size_t n, const double *lead,
                         const struct srnf_nested *nested, size_t number, struct srnf_error *error)
{
    size_t most = nested->reduced + nested->tested + 1;
    int status;

    *model = (struct regress_model){0};
    status = basis_open(&model->basis, n, lead, most < n ? most : n);
    for (size_t j = 0; status == SRNF_OK && j < nested->reduced && model->basis.count < n; j++) {
        (void)basis_add(&model->basis, lead, nested->reduced, j, nested->nuisance);
    }
    model->reduced = model->basis.count;
    for (size_t j = 0; status == SRNF_OK && j < nested->tested && model->basis.count < n; j++) {
        model->tested += basis_add(&model->basis, lead, nested->tested, j, nested->columns);
    }
    if (status == SRNF_OK && model->tested == 0) {
        status = srnf_fail(error, SRNF_EINVAL, (int64_t)number,
                           "test %zu: what is tested follows from the rest of the model", number);
    }
    if (status == SRNF_OK && regress_model_freedom(model) < REGRESS_DIMENSIONS) {
        status =
            srnf_fail(error, SRNF_EINVAL, (int64_t)number,
                      "test %zu: %zu subjects are too few for %zu coefficients: %zu are needed",
                      number, n, model->basis.count, model->basis.count + REGRESS_DIMENSIONS);
    }
    return status;
}

void regress_model_clear(struct regress_model *model)
{
    srnf_free(model->basis.vectors);
    *model = (struct regress_model){0};
}

/* ---- The whole model ------------------------------------------------------------------------- */

/* weights = R^(-1) U, R[k][j] = <u_k, x_j>. */
static int fill_weights(struct regress_fit *fit, const double *lead, size_t columns,
                        const double *values)
{
    size_t n = fit->basis.n;
    size_t p = fit->basis.count;
    double *r = srnf_alloc(p, p * sizeof(double));

    if (!r) {
        return SRNF_ENOMEM;
    }
    r[0] = lead ? cblas_dnrm2((int)n, lead, 1) : sqrt((double)n);
    for (size_t k = 0; k < p; k++) {
        for (size_t j = 1; j < p; j++) {
            r[k * p + j] = k <= j ? cblas_ddot((int)n, fit->basis.vectors + k * n, 1,
                                               values + (j - 1), (int)columns)
                                  : 0.0;
        }
    }
    cblas_dcopy((int)(p * n), fit->basis.vectors, 1, fit->weights, 1);
    cblas_dtrsm(CblasRowMajor, CblasLeft, CblasUpper, CblasNoTrans, CblasNonUnit, (int)p, (int)n,
                1.0, r, (int)p, fit->weights, (int)n);
    srnf_free(r);
    return SRNF_OK;
}

int regress_fit_create(struct regress_fit *fit, size_t n, const double *lead, size_t columns,
                       const double *values, struct srnf_error *error)
{
    int status;

    *fit = (struct regress_fit){0};
    if (columns + 1 + REGRESS_DIMENSIONS > n) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu subjects are too few for %zu coefficients: %zu are needed", n,
                         columns + 1, columns + 1 + REGRESS_DIMENSIONS);
    }
    for (size_t i = 0; i < n * columns; i++) {
        if (!isfinite(values[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(i / columns),
                             "column %zu of subject %zu is not finite", i % columns, i / columns);
        }
    }
    status = basis_open(&fit->basis, n, lead, columns + 1);
    for (size_t j = 0; j < columns && status == SRNF_OK; j++) {
        if (!basis_add(&fit->basis, lead, columns, j, values)) {
            status = srnf_fail(error, SRNF_EINVAL, (int64_t)j,
                               "column %zu is constant or follows from those before it", j);
        }
    }
    if (status == SRNF_OK) {
        fit->weights = srnf_alloc(columns + 1, n * sizeof(double));
        status = fit->weights ? fill_weights(fit, lead, columns, values) : SRNF_ENOMEM;
    }
    return status;
}

void regress_fit_clear(struct regress_fit *fit)
{
    srnf_free(fit->basis.vectors);
    srnf_free(fit->weights);
    *fit = (struct regress_fit){0};
}
