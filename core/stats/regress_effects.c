/*
 * regress_effects.c - the coefficients of a linear model of shape: as fields, as displacements of
 * the nodes, and as predicted surfaces.
 *
 * Coefficient k is the sum of weights[k][i] q_i, and as a displacement the same sum of those of the
 * subjects. Along the normal its standard error at a node is s |weights[k]|, s^2 the sum of squared
 * residuals there over the degrees of freedom.
 */
#include "intervals.h"
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

/* Displacements along the normal, still times the roots of the areas: [n][P]. */
static int fill_along(struct regress_run *run, const double *mean)
{
    size_t points = run->points;
    double *q = srnf_alloc(3 * points, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(run->sht));
    int status = q && workspace ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_field(run->sht, mean, q, workspace);
    }
    for (size_t p = 0; p < points && status == SRNF_OK; p++) {
        double length = sqrt(q[p] * q[p] + q[points + p] * q[points + p] +
                             q[2 * points + p] * q[2 * points + p]);

        for (size_t c = 0; c < 3; c++) {
            q[c * points + p] = length > 0.0 ? q[c * points + p] / length : 0.0;
        }
    }
    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        const double *v = run->vectors + i * 3 * points;

        for (size_t p = 0; p < points; p++) {
            run->along[i * points + p] =
                v[p] * q[p] + v[points + p] * q[points + p] + v[2 * points + p] * q[2 * points + p];
        }
    }
    srnf_free(q);
    srnf_free(workspace);
    return status;
}

/* Root of the residual variance of `along` at each node: double[P]. */
static int find_spread(const struct regress_run *run, double *spread)
{
    const struct regress_basis *basis = &run->fit.basis;
    size_t points = run->points;
    double *z = srnf_alloc(basis->count, points * sizeof(double));

    if (!z) {
        return SRNF_ENOMEM;
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)basis->count, (int)points,
                (int)run->n, 1.0, basis->vectors, (int)run->n, run->along, (int)points, 0.0, z,
                (int)points);
    for (size_t p = 0; p < points; p++) {
        double sum = 0.0;

        for (size_t i = 0; i < run->n; i++) {
            sum += run->along[i * points + p] * run->along[i * points + p];
        }
        for (size_t k = 0; k < basis->count; k++) {
            sum -= z[k * points + p] * z[k * points + p];
        }
        spread[p] = sqrt(fmax(sum, 0.0) / (double)run->out->freedom);
    }
    srnf_free(z);
    return SRNF_OK;
}

static int fill_displacements(struct regress_run *run)
{
    struct srnf_regression *out = run->out;
    size_t points = run->points;
    size_t columns = run->design->columns;
    double *b = srnf_alloc(columns + 1, 3 * points * sizeof(double));
    double *spread = srnf_alloc(points, sizeof(double));
    int status = b && spread ? find_spread(run, spread) : SRNF_ENOMEM;

    if (status == SRNF_OK && columns > 0) {
        const double *weights = run->fit.weights + run->n;

        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)columns, (int)(3 * points),
                    (int)run->n, 1.0, weights, (int)run->n, run->vectors, (int)(3 * points), 0.0, b,
                    (int)(3 * points));
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)columns, (int)points,
                    (int)run->n, 1.0, weights, (int)run->n, run->along, (int)points, 0.0,
                    out->normal, (int)points);
    }
    for (size_t k = 0; status == SRNF_OK && k < columns * points; k++) {
        double root = run->embedding.root[k % points];
        const double *v = b + k / points * 3 * points + k % points;
        const double *w = run->fit.weights + (k / points + 1) * run->n;
        double length = sqrt(v[0] * v[0] + v[points] * v[points] + v[2 * points] * v[2 * points]);

        out->effect[k] = root > 0.0 ? length / root : 0.0;
        out->normal[k] = root > 0.0 ? out->normal[k] / root : 0.0;
        out->standard_error[k] =
            root > 0.0 ? spread[k % points] * cblas_dnrm2((int)run->n, w, 1) / root : 0.0;
    }
    srnf_free(b);
    srnf_free(spread);
    return status;
}

/* ---- Intervals ------------------------------------------------------------------------------- */

/* Products of the subjects' SRNFs with coefficient k. */
static void fill_products(const struct regress_run *run, size_t k, double *products)
{
    size_t size = 3 * run->points;

    for (size_t i = 0; i < run->n; i++) {
        products[i] = srnf_inner_product(srnf_sht_grid(run->sht), run->q + i * size,
                                         run->out->coefficients + k * size);
    }
}

/* Of the norms and variances. What is about the mean has the constant, or the lead, alone. */
static int find_intervals(struct regress_run *run)
{
    struct srnf_regression *out = run->out;
    const struct regress_basis *basis = &run->fit.basis;
    struct intervals whole = {0};
    struct intervals constant = {0};
    double *products = srnf_alloc(run->n, sizeof(double));
    int status = products ? intervals_open(&whole, run->n, basis->count, basis->vectors, run->gram)
                          : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        for (size_t k = 0; k < basis->count; k++) {
            fill_products(run, k, products);
            intervals_norm(&whole, run->fit.weights + k * run->n, products,
                           out->norms[k] * out->norms[k], out->norm_intervals + 2 * k);
        }
        intervals_variance(&whole, out->residual_variance, out->residual_interval);
        intervals_close(&whole);
        whole = (struct intervals){0};
        status = intervals_open(&constant, run->n, 1, basis->vectors, run->gram);
    }
    if (status == SRNF_OK) {
        intervals_variance(&constant, out->variance, out->variance_interval);
    }
    intervals_close(&constant);
    intervals_close(&whole);
    srnf_free(products);
    return status;
}

/* ---- Predictions ----------------------------------------------------------------------------- */

struct predicting {
    struct regress_run *run;
    const double *mean;
};

static int predict(void *argument, size_t index, const struct srnf_context *context,
                   struct srnf_error *error)
{
    const struct predicting *predicting = argument;
    struct regress_run *run = predicting->run;
    struct srnf_predicted_shape *to = &run->out->predicted[index];
    size_t size = 3 * run->points;
    size_t columns = run->design->columns;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion = {0};
    double *q = srnf_alloc(size, sizeof(double));
    int status;

    if (!q) {
        return SRNF_ENOMEM;
    }
    memcpy(q, run->out->coefficients, size * sizeof(double));
    for (size_t k = 0; k < columns; k++) {
        cblas_daxpy((int)size, run->design->at[index * columns + k],
                    run->out->coefficients + (k + 1) * size, 1, q, 1);
    }
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = predicting->mean;
    options.certify = false;
    status = srnf_invert(run->sht, q, &options, context, &inversion, error);
    if (status >= 0) {
        memcpy(to->coefficients, inversion.coefficients, count * sizeof(double));
        to->relative_energy = inversion.relative_energy;
        srnf_inversion_clear(&inversion);
        status = SRNF_OK;
    }
    srnf_free(q);
    return status;
}

static int open_effects(struct regress_run *run)
{
    struct srnf_regression *out = run->out;
    size_t columns = run->design->columns;
    size_t points = run->points;
    size_t degree = srnf_sht_degree(run->sht);
    double **maps[] = {&out->effect, &out->normal, &out->standard_error};

    for (size_t i = 0; i < sizeof maps / sizeof maps[0]; i++) {
        *maps[i] = srnf_alloc(columns + 1, points * sizeof(double));
        if (!*maps[i]) {
            return SRNF_ENOMEM;
        }
    }
    for (size_t k = 0; k < run->design->points; k++) {
        struct srnf_predicted_shape *to = &out->predicted[k];

        to->coefficients = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
        to->standard_error = srnf_alloc(points, sizeof(double));
        to->confidence = srnf_alloc(points, sizeof(double));
        if (!to->coefficients || !to->standard_error || !to->confidence) {
            return SRNF_ENOMEM;
        }
    }
    out->coefficients = srnf_alloc(columns + 1, 3 * points * sizeof(double));
    out->norms = srnf_alloc(columns + 1, sizeof(double));
    out->norm_intervals = srnf_alloc(columns + 1, 2 * sizeof(double));
    run->along = srnf_alloc(run->n, points * sizeof(double));
    return out->coefficients && out->norms && out->norm_intervals && run->along ? SRNF_OK
                                                                                : SRNF_ENOMEM;
}

int regress_effects(struct regress_run *run, const double *mean, struct stats_progress progress,
                    struct srnf_error *error)
{
    struct predicting predicting = {run, mean};
    struct srnf_regression *out = run->out;
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    size_t size = 3 * run->points;
    size_t count = run->fit.basis.count;
    int status = open_effects(run);

    if (status == SRNF_OK) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)size, (int)run->n,
                    1.0, run->fit.weights, (int)run->n, run->q, (int)size, 0.0, out->coefficients,
                    (int)size);
        for (size_t k = 0; k < count; k++) {
            const double *b = out->coefficients + k * size;

            out->norms[k] = sqrt(srnf_inner_product(grid, b, b));
        }
        status = fill_along(run, mean);
    }
    status = status ? status : find_intervals(run);
    status = status ? status : fill_displacements(run);
    return status ? status
                  : stats_run(run->context, run->no_surfaces ? 0 : run->design->points, predict,
                              &predicting, progress, error);
}
