/*
 * pca.c - principal components of registered SRNFs about their mean.
 *
 * With x_i = q_i - mean and the inner product of L2 by the weights of the grid, the covariance
 * operator (1 / (n - 1)) sum_i x_i <x_i, .> has the non-zero eigenvalues of the n x n Gram matrix
 * G_ij = <x_i, x_j> / (n - 1) (method of snapshots, L. Sirovich 1987): for G a = lambda a, |a| = 1,
 * the mode is sum_i a_i x_i / sqrt(lambda (n - 1)). Since the Gram matrix squares the condition,
 * modes of small eigenvalues come out oblique by about the rounding of the largest over their own;
 * two passes of Gram-Schmidt make them orthonormal again. Scores are the products <x_i, mode>,
 * computed as srnf_pca_project does: a training subject that is projected gets its own scores back.
 *
 * "Above rounding": lambda > n eps lambda_1, what the eigensolver leaves of a zero, and lambda > n
 * (eps ||mean||)^2 with a margin, what subtracting the mean leaves of equal subjects.
 *
 * Cost: n^2 P 3 multiply-adds for G (one dsyrk), n^3 for its eigenvectors, n K P 3 for modes and
 * scores. Memory beside the result: the centred fields, weighted, and 3 n^2, of which the
 * eigensolver works in 2 (dsyevd).
 */
#include "stats.h"
#include "linear/linear.h"

#include <cblas.h>
#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

#define VARIANCE_CUT 1e-9 /* what may be missing of the variance of a model that keeps all */
#define SUBTRACTION_MARGIN 8.0
#define BLOCK ((size_t)64) /* points that are taken at a time */
/* Of a product that is done between two looks at cancellation. Rows come in whole units, which BLAS
   blocks them by anyway, and a rest shorter than a unit is not left for the end, where it would be
   halved: so the sums are those of a single call. */
#define ROWS_UNIT ((size_t)768)
#define PRODUCT_OPERATIONS ((size_t)1000000000)
#define N_MAX ((size_t)30000) /* subjects: n^2 is an int for BLAS */

/* ---- Fields ---------------------------------------------------------------------------------- */

/* <q - mean, mode>, a block of points at a time. */
static double product(const struct srnf_grid *grid, const double *q, const double *mean,
                      const double *mode)
{
    size_t points = stats_points(grid);
    double difference[BLOCK];
    double sum = 0.0;

    for (size_t c = 0; c < 3; c++) {
        for (size_t row = 0; row < grid->n_theta; row++) {
            size_t first = c * points + row * grid->n_phi;
            size_t end = first + grid->n_phi;

            for (; first < end; first += BLOCK) {
                size_t count = end - first < BLOCK ? end - first : BLOCK;

                for (size_t k = 0; k < count; k++) {
                    difference[k] = q[first + k] - mean[first + k];
                }
                sum += grid->weight[row] * linear_dot(count, difference, mode + first);
            }
        }
    }
    return sum;
}

/* ---- Fitting --------------------------------------------------------------------------------- */

struct fit {
    const struct srnf_grid *grid;
    const struct srnf_context *context;
    size_t n, size; /* size = 3 P */
    const double *mean_q, *q;
    double *weighted; /* [n][size]: sqrt(weight) x_i */
    double *gram;     /* [n][n], then its eigenvectors, one a row */
    double *values;   /* [n] increasing */
    double *work;
    lapack_int *iwork;
    lapack_int work_size, iwork_size;
};

static int create_fit(struct fit *fit)
{
    lapack_int n = (lapack_int)fit->n;
    double work_size = 0.0;
    size_t all;

    if (__builtin_mul_overflow(fit->n, fit->size, &all)) {
        return SRNF_ENOMEM;
    }
    if (LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, 'V', 'L', n, NULL, n, NULL, &work_size, -1,
                            &fit->iwork_size, -1)) {
        return SRNF_ENUMERIC;
    }
    fit->work_size = (lapack_int)work_size;
    fit->weighted = srnf_alloc(all, sizeof(double));
    fit->gram = srnf_alloc(fit->n * fit->n, sizeof(double));
    fit->values = srnf_alloc(fit->n, sizeof(double));
    fit->work = srnf_alloc((size_t)fit->work_size, sizeof(double));
    fit->iwork = srnf_alloc((size_t)fit->iwork_size, sizeof *fit->iwork);
    return fit->weighted && fit->gram && fit->values && fit->work && fit->iwork ? SRNF_OK
                                                                                : SRNF_ENOMEM;
}

static void clear_fit(struct fit *fit)
{
    srnf_free(fit->weighted);
    srnf_free(fit->gram);
    srnf_free(fit->values);
    srnf_free(fit->work);
    srnf_free(fit->iwork);
}

/* G, its lower triangle: as many rows of the fields at a time as take a few hundredths of a
   second. */
static int multiply(struct fit *fit)
{
    size_t n = fit->n;
    size_t step = ROWS_UNIT * (1 + PRODUCT_OPERATIONS / (ROWS_UNIT * n * n));
    size_t count;

    for (size_t first = 0; first < fit->size; first += count) {
        count = fit->size - first;
        count = count < step + ROWS_UNIT ? count : step;
        if (srnf_is_canceled(fit->context)) {
            return SRNF_ECANCELED;
        }
        cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)n, (int)count,
                    1.0 / (double)(n - 1), fit->weighted + first, (int)fit->size,
                    first > 0 ? 1.0 : 0.0, fit->gram, (int)n);
    }
    return SRNF_OK;
}

/* Eigenvalues and eigenvectors of G; the trace is what G has on its diagonal. */
static int decompose(struct fit *fit, double *trace)
{
    lapack_int n = (lapack_int)fit->n;
    int status;

    stats_weight(fit->grid, fit->n, fit->q, fit->mean_q, fit->weighted);
    status = multiply(fit);
    if (status) {
        return status;
    }
    *trace = 0.0;
    for (size_t i = 0; i < fit->n; i++) {
        *trace += fit->gram[i * fit->n + i];
    }
    if (!isfinite(*trace)) {
        return SRNF_EINVAL;
    }
    return LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, 'V', 'L', n, fit->gram, n, fit->values, fit->work,
                               fit->work_size, fit->iwork, fit->iwork_size)
               ? SRNF_ENUMERIC
               : SRNF_OK;
}

static size_t count_components(const struct fit *fit, size_t max_components)
{
    double norm = sqrt(srnf_inner_product(fit->grid, fit->mean_q, fit->mean_q));
    double noise = SUBTRACTION_MARGIN * DBL_EPSILON * norm;
    double floor = (double)fit->n * fmax(DBL_EPSILON * fit->values[fit->n - 1], noise * noise);
    size_t most = max_components ? max_components : fit->n;
    size_t count = 0;

    while (count < fit->n && count < most && fit->values[fit->n - 1 - count] > floor) {
        count++;
    }
    return count;
}

/* Mode k before it is made orthogonal to the ones before it. */
static void combine(const struct fit *fit, size_t k, double *mode)
{
    const double *a = fit->gram + (fit->n - 1 - k) * fit->n;

    for (size_t i = 0; i < fit->n && !srnf_is_canceled(fit->context); i++) {
        for (size_t m = 0; m < fit->size; m++) {
            mode[m] += a[i] * (fit->q[i * fit->size + m] - fit->mean_q[m]);
        }
    }
}

static void orthonormalize(const struct fit *fit, double *modes, size_t k)
{
    double *mode = modes + k * fit->size;

    for (int pass = 0; pass < 2; pass++) {
        double norm;

        for (size_t j = 0; j < k && !srnf_is_canceled(fit->context); j++) {
            double along = srnf_inner_product(fit->grid, mode, modes + j * fit->size);

            for (size_t m = 0; m < fit->size; m++) {
                mode[m] -= along * modes[j * fit->size + m];
            }
        }
        norm = sqrt(srnf_inner_product(fit->grid, mode, mode));
        for (size_t m = 0; m < fit->size; m++) {
            mode[m] /= norm;
        }
    }
}

/* Scores of mode k, its sign fixed: the score that is largest in magnitude, the first of equals, is
   positive. */
static void score(const struct fit *fit, struct srnf_pca *pca, size_t k)
{
    double *mode = pca->modes + k * fit->size;
    double largest = 0.0;

    for (size_t i = 0; i < fit->n && !srnf_is_canceled(fit->context); i++) {
        double s = product(fit->grid, fit->q + i * fit->size, fit->mean_q, mode);

        pca->scores[i * pca->components + k] = s;
        largest = fabs(s) > fabs(largest) ? s : largest;
    }
    if (largest < 0.0) {
        for (size_t m = 0; m < fit->size; m++) {
            mode[m] = -mode[m];
        }
        for (size_t i = 0; i < fit->n; i++) {
            pca->scores[i * pca->components + k] *= -1.0;
        }
    }
}

void stats_take_shares(struct srnf_pca *pca)
{
    double sum = 0.0;

    for (size_t k = 0; k < pca->components; k++) {
        sum += pca->eigenvalues[k];
    }
    pca->total_variance = fmax(pca->total_variance, sum);
    for (size_t k = 0; k < pca->components; k++) {
        pca->explained[k] = pca->eigenvalues[k] / pca->total_variance;
    }
}

int srnf_pca_fit_within(const struct srnf_grid *grid, size_t n, const double *mean_q,
                        const double *registered_q, size_t max_components,
                        const struct srnf_context *context, struct srnf_pca *pca)
{
    struct fit fit = {.grid = grid,
                      .context = context,
                      .n = n,
                      .size = 3 * stats_points(grid),
                      .mean_q = mean_q,
                      .q = registered_q};
    size_t count;
    int status;

    *pca = (struct srnf_pca){0};
    if (n < 2 || n > N_MAX) {
        return SRNF_EINVAL;
    }
    status = create_fit(&fit);
    status = status ? status : decompose(&fit, &pca->total_variance);
    if (status) {
        goto out;
    }
    count = count_components(&fit, max_components);
    pca->n = n;
    pca->components = count;
    pca->eigenvalues = srnf_alloc(count, sizeof(double));
    pca->explained = srnf_alloc(count, sizeof(double));
    pca->modes = srnf_alloc(count * fit.size, sizeof(double));
    pca->scores = srnf_alloc(n * count, sizeof(double));
    if (!pca->eigenvalues || !pca->explained || !pca->modes || !pca->scores) {
        status = SRNF_ENOMEM;
        goto out;
    }
    for (size_t k = 0; k < count; k++) {
        pca->eigenvalues[k] = fit.values[n - 1 - k];
        combine(&fit, k, pca->modes + k * fit.size);
        orthonormalize(&fit, pca->modes, k);
        score(&fit, pca, k);
        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
            break;
        }
    }
    stats_take_shares(pca);
out:
    clear_fit(&fit);
    if (status) {
        srnf_pca_clear(pca);
    }
    return status;
}

int srnf_pca_fit(const struct srnf_grid *grid, size_t n, const double *mean_q,
                 const double *registered_q, size_t max_components, struct srnf_pca *pca)
{
    return srnf_pca_fit_within(grid, n, mean_q, registered_q, max_components, NULL, pca);
}

void srnf_pca_clear(struct srnf_pca *pca)
{
    srnf_free(pca->eigenvalues);
    srnf_free(pca->explained);
    srnf_free(pca->modes);
    srnf_free(pca->scores);
    *pca = (struct srnf_pca){0};
}

/* ---- Using it -------------------------------------------------------------------------------- */

/* Sum of weight times the square of what the modes leave of q - mean, over [first, first + count)
   of one row and coordinate. */
static double leftover(const struct srnf_pca *pca, size_t size, size_t first, size_t count,
                       const double *mean_q, const double *q, const double *scores)
{
    double rest[BLOCK];
    double sum = 0.0;

    for (size_t k = 0; k < count; k++) {
        rest[k] = q[first + k] - mean_q[first + k];
    }
    for (size_t j = 0; j < pca->components; j++) {
        const double *mode = pca->modes + j * size + first;

        for (size_t k = 0; k < count; k++) {
            rest[k] -= scores[j] * mode[k];
        }
    }
    for (size_t k = 0; k < count; k++) {
        sum += rest[k] * rest[k];
    }
    return sum;
}

void srnf_pca_project(const struct srnf_grid *grid, const struct srnf_pca *pca,
                      const double *mean_q, const double *q, double *scores, double *residual)
{
    size_t points = stats_points(grid);
    double sum = 0.0;

    for (size_t k = 0; k < pca->components; k++) {
        scores[k] = product(grid, q, mean_q, pca->modes + k * 3 * points);
    }
    if (!residual) {
        return;
    }
    for (size_t c = 0; c < 3; c++) {
        for (size_t row = 0; row < grid->n_theta; row++) {
            size_t start = c * points + row * grid->n_phi;

            for (size_t j = 0; j < grid->n_phi; j += BLOCK) {
                size_t count = grid->n_phi - j < BLOCK ? grid->n_phi - j : BLOCK;

                sum += grid->weight[row] *
                       leftover(pca, 3 * points, start + j, count, mean_q, q, scores);
            }
        }
    }
    *residual = sqrt(sum);
}

double srnf_pca_kept_variance(const struct srnf_pca *pca, double total_variance, bool *complete)
{
    double kept = 0.0;

    for (size_t k = 0; k < pca->components; k++) {
        kept += pca->eigenvalues[k];
    }
    *complete = kept >= total_variance * (1.0 - VARIANCE_CUT);
    return kept;
}

int srnf_pca_residuals(const struct srnf_grid *grid, const struct srnf_pca *pca,
                       const double *mean_q, size_t n, const double *registered_q,
                       double *residuals)
{
    double *scores = srnf_alloc(pca->components ? pca->components : 1, sizeof *scores);

    for (size_t i = 0; scores && i < n; i++) {
        srnf_pca_project(grid, pca, mean_q, registered_q + i * 3 * stats_points(grid), scores,
                         &residuals[i]);
    }
    srnf_free(scores);
    return scores ? SRNF_OK : SRNF_ENOMEM;
}

void srnf_pca_reconstruct(const struct srnf_grid *grid, const struct srnf_pca *pca,
                          const double *mean_q, const double *scores, double *q)
{
    size_t size = 3 * stats_points(grid);

    for (size_t m = 0; m < size; m++) {
        q[m] = mean_q[m];
    }
    for (size_t k = 0; k < pca->components; k++) {
        const double *mode = pca->modes + k * size;

        for (size_t m = 0; m < size; m++) {
            q[m] += scores[k] * mode[m];
        }
    }
}
