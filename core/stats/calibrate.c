/*
 * calibrate.c - leave-one-out values of the subjects of a model.
 *
 * With the scores z_i of all subjects on all components (not only those that the model keeps), from
 * the Gram matrix of the centred SRNFs, downdate.c gives of each subject the eigenvalues mu_k of
 * the others' scatter matrix and its scores s_k about their mean. Then, K components kept and m of
 * them counted (srnf_mahalanobis_components),
 *
 *     residual^2 = sum over k > K of s_k^2,        distance = n / (n - 1) |z_i|,
 *     mahalanobis^2 = (n - 2) sum over k <= m of s_k^2 / mu_k.
 *
 * A component of the others that rounding made (mu at most n eps of the largest) counts as none.
 */
#include "downdate.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>

#define SUBTRACTION_MARGIN 8.0 /* as in pca.c */
/* A root that is 0 but for rounding is off by this many times the roundings of one. */
#define ROOT_ROUNDING 64.0
#define RESIDUAL_ROUNDING 1e-9

struct calibration {
    size_t n, rank;
    double norm;    /* of the mean */
    double *gram;   /* [n][n], then its eigenvectors, one a row */
    double *values; /* [n] increasing, then [rank] decreasing */
    double *z;      /* [n][rank] */
    double *root, *score;
};

void srnf_calibration_clear(struct srnf_calibration *calibration)
{
    srnf_free(calibration->values);
    *calibration = (struct srnf_calibration){0};
}

static int decompose(struct calibration *c)
{
    lapack_int n = (lapack_int)c->n;
    lapack_int work_size;
    lapack_int iwork_size = 0;
    lapack_int *iwork;
    double size = 0.0;
    double *work;
    int status = SRNF_ENOMEM;

    if (LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, 'V', 'L', n, NULL, n, NULL, &size, -1, &iwork_size,
                            -1)) {
        return SRNF_ENUMERIC;
    }
    work_size = (lapack_int)size;
    work = srnf_alloc((size_t)work_size, sizeof(double));
    iwork = srnf_alloc((size_t)iwork_size, sizeof *iwork);
    if (work && iwork) {
        status = LAPACKE_dsyevd_work(LAPACK_COL_MAJOR, 'V', 'L', n, c->gram, n, c->values, work,
                                     work_size, iwork, iwork_size)
                     ? SRNF_ENUMERIC
                     : SRNF_OK;
    }
    srnf_free(work);
    srnf_free(iwork);
    return status;
}

/* Eigenvalues and scores above rounding, by the rule of pca.c. */
static void keep_sound(struct calibration *c)
{
    size_t n = c->n;
    double noise = SUBTRACTION_MARGIN * DBL_EPSILON * c->norm;
    double floor =
        (double)n * fmax(DBL_EPSILON * c->values[n - 1], (double)(n - 1) * noise * noise);

    while (c->rank < n - 1 && c->values[n - 1 - c->rank] > floor) {
        c->rank++;
    }
    for (size_t k = 0; k < c->rank; k++) {
        double root = sqrt(c->values[n - 1 - k]);

        for (size_t i = 0; i < n; i++) {
            c->z[i * c->rank + k] = root * c->gram[(n - 1 - k) * n + i];
        }
    }
    for (size_t k = 0; k < n / 2; k++) {
        double value = c->values[k];

        c->values[k] = c->values[n - 1 - k];
        c->values[n - 1 - k] = value;
    }
}

static int find_spectrum(struct calibration *c, const struct srnf_grid *grid, const double *mean_q,
                         const double *registered_q)
{
    size_t size = 3 * stats_points(grid);
    double *weighted = srnf_alloc(c->n, size * sizeof(double));
    int status = SRNF_ENOMEM;

    if (weighted) {
        stats_weight(grid, c->n, registered_q, mean_q, weighted);
        status = stats_gram(c->n, size, weighted, c->gram, NULL);
    }
    srnf_free(weighted);
    status = status ? status : decompose(c);
    if (status == SRNF_OK) {
        c->norm = sqrt(srnf_inner_product(grid, mean_q, mean_q));
        keep_sound(c);
    }
    return status;
}

static void leave_out(const struct calibration *c, size_t i, size_t kept, size_t counted,
                      double *values)
{
    double scale = (double)c->n / (double)(c->n - 1);
    double floor = ROOT_ROUNDING * (double)c->n * DBL_EPSILON * c->values[0];
    double rest = 0.0;
    double distance = 0.0;
    double mahalanobis = 0.0;

    stats_downdate(c->n, c->rank, c->values, c->z + i * c->rank, c->root, c->score);
    for (size_t k = c->rank; k-- > 0;) {
        double square = c->score[k] * c->score[k];
        bool none = !(c->root[k] > floor); /* the others do not differ that way */

        rest += k >= kept || none ? square : 0.0;
        mahalanobis += k < counted && !none ? square / c->root[k] : 0.0;
        distance += c->z[i * c->rank + k] * c->z[i * c->rank + k];
    }
    values[SRNF_TRAIT_RESIDUAL * c->n + i] = fmax(sqrt(rest), RESIDUAL_ROUNDING * c->norm);
    values[SRNF_TRAIT_DISTANCE * c->n + i] = scale * sqrt(distance);
    values[SRNF_TRAIT_MAHALANOBIS * c->n + i] = sqrt((double)(c->n - 2) * mahalanobis);
}

static bool open_calibration(struct calibration *c)
{
    c->gram = srnf_alloc(c->n, c->n * sizeof(double));
    c->z = srnf_alloc(c->n, c->n * sizeof(double));
    c->values = srnf_alloc(c->n, sizeof(double));
    c->root = srnf_alloc(c->n, sizeof(double));
    c->score = srnf_alloc(c->n, sizeof(double));
    return c->gram && c->z && c->values && c->root && c->score;
}

static void close_calibration(struct calibration *c)
{
    srnf_free(c->gram);
    srnf_free(c->z);
    srnf_free(c->values);
    srnf_free(c->root);
    srnf_free(c->score);
}

int srnf_calibrate(const struct srnf_grid *grid, const struct srnf_pca *pca, const double *mean_q,
                   const double *registered_q, struct srnf_calibration *calibration)
{
    struct calibration c = {.n = pca->n};
    struct srnf_calibration found = {.n = pca->n};
    size_t counted = srnf_mahalanobis_components(pca->n, pca->components, pca->eigenvalues);
    int status = SRNF_ENOMEM;

    if (pca->n < 3) {
        return SRNF_EINVAL;
    }
    found.values = srnf_alloc(pca->n, SRNF_CALIBRATION_TRAITS * sizeof(double));
    if (open_calibration(&c) && found.values) {
        status = find_spectrum(&c, grid, mean_q, registered_q);
    }
    if (status == SRNF_OK) {
        size_t kept = pca->components < c.rank ? pca->components : c.rank;

        stats_downdate_prepare(c.n, c.rank, c.values, c.z);
        for (size_t i = 0; i < c.n; i++) {
            leave_out(&c, i, kept, counted, found.values);
        }
        status = srnf_pose_angles(grid, c.n, registered_q, found.values + SRNF_TRAIT_ANGLE * c.n);
    }
    close_calibration(&c);
    if (status) {
        srnf_calibration_clear(&found);
        return status;
    }
    *calibration = found;
    return SRNF_OK;
}
