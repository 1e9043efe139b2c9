/*
 * compare_design.c - the linear model behind a comparison of two groups, and its permutations.
 *
 * With U an orthonormal basis of the constant and the covariates (the nuisance) and R = 1 - U U',
 * the adjusted difference of the groups in data y is b = <g~, y> / <g~, g~>, g~ = R g, for the
 * indicator g of group 1: the coefficient of g in the least-squares fit of y by g and the nuisance
 * (R. Frisch, F. V. Waugh 1933; without covariates the difference of the means).
 *
 * Permutations are those of D. Freedman and D. Lane (1983), which keep the nuisance in place: the
 * residuals R y are permuted.
 *
 * Modified Gram-Schmidt in two passes on covariates that are first moved and scaled
 * (stats_center), so that units do not matter.
 */
#include "compare.h"

#include <math.h>
#include <string.h>

/* A covariate, or the group, of which the others leave no more than this part depends on them. */
#define DEPENDENT 1e-8
#define DIMENSIONS 3 /* of a displacement, whose covariance must be regular */

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Takes the columns so far out of v; returns the norm that is left over the one before. */
static double reduce(const struct compare_design *design, double *v)
{
    double before = sqrt(dot(design->n, v, v));

    for (int pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < design->nuisance; j++) {
            const double *u = design->basis + j * design->n;
            double along = dot(design->n, u, v);

            for (size_t i = 0; i < design->n; i++) {
                v[i] -= along * u[i];
            }
        }
    }
    return before > 0.0 ? sqrt(dot(design->n, v, v)) / before : 0.0;
}

static int add_covariate(struct compare_design *design, size_t column, size_t n_covariates,
                         const double *covariates, struct srnf_error *error)
{
    double *v = design->basis + design->nuisance * design->n;
    double mean = 0.0;
    double norm;
    bool differs;

    for (size_t i = 0; i < design->n; i++) {
        v[i] = covariates[i * n_covariates + column];
        if (!isfinite(v[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "covariate %zu of subject %zu is not finite", column, i);
        }
    }
    differs = stats_center(design->n, NULL, v);
    for (size_t i = 0; i < design->n; i++) {
        mean += v[i] / (double)design->n;
    }
    for (size_t i = 0; i < design->n; i++) {
        v[i] -= mean;
    }
    if (!differs || !(reduce(design, v) > DEPENDENT)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "covariate %zu is constant or follows from those before it", column);
    }
    norm = sqrt(dot(design->n, v, v));
    for (size_t i = 0; i < design->n; i++) {
        v[i] /= norm;
    }
    design->nuisance++;
    return SRNF_OK;
}

static int check_groups(size_t n, const int *group, size_t n_covariates, struct srnf_error *error)
{
    size_t count[2] = {0, 0};

    for (size_t i = 0; i < n; i++) {
        if (group[i] != 0 && group[i] != 1) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "group of subject %zu is %d, not 0 or 1", i, group[i]);
        }
        count[group[i]]++;
    }
    if (count[0] < 2 || count[1] < 2) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the groups have %zu and %zu subjects; each needs two", count[0],
                         count[1]);
    }
    /* The constant, the group, the covariates, and what a covariance of displacements needs. */
    if (n_covariates > n || n < n_covariates + 2 + DIMENSIONS) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu subjects are too few for %zu covariates: %zu are needed", n,
                         n_covariates, n_covariates + 2 + DIMENSIONS);
    }
    return SRNF_OK;
}

int compare_design_create(struct compare_design *design, size_t n, const int *group,
                          size_t n_covariates, const double *covariates, struct srnf_error *error)
{
    int status = check_groups(n, group, n_covariates, error);

    *design = (struct compare_design){.n = n};
    if (status) {
        return status;
    }
    design->basis = srnf_alloc(n_covariates + 1, n * sizeof(double));
    design->contrast = srnf_alloc(n, sizeof(double));
    if (!design->basis || !design->contrast) {
        status = SRNF_ENOMEM;
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        design->basis[i] = 1.0 / sqrt((double)n);
        design->contrast[i] = group[i];
    }
    design->nuisance = 1;
    for (size_t j = 0; j < n_covariates && status == SRNF_OK; j++) {
        status = add_covariate(design, j, n_covariates, covariates, error);
    }
    if (status == SRNF_OK && !(reduce(design, design->contrast) > DEPENDENT)) {
        status = srnf_fail(error, SRNF_EINVAL, -1,
                           "the covariates determine the group: no difference can be told apart "
                           "from theirs");
    }
    design->squared = dot(n, design->contrast, design->contrast);
out:
    if (status) {
        compare_design_clear(design);
    }
    return status;
}

void compare_design_clear(struct compare_design *design)
{
    srnf_free(design->basis);
    srnf_free(design->contrast);
    *design = (struct compare_design){0};
}

void compare_design_residuals(const struct compare_design *design, size_t m, double *data)
{
    for (size_t k = 0; k < m; k++) {
        for (size_t j = 0; j < design->nuisance; j++) {
            const double *u = design->basis + j * design->n;
            double along = 0.0;

            for (size_t i = 0; i < design->n; i++) {
                along += u[i] * data[i * m + k];
            }
            for (size_t i = 0; i < design->n; i++) {
                data[i * m + k] -= along * u[i];
            }
        }
    }
}

/* A number below bound, every one with the same chance: 32 random bits, refused where they would
   favour some (D. Lemire 2019). */
uint32_t stats_below(uint64_t seed, uint64_t number, uint32_t draw, uint32_t bound)
{
    uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t refused = (uint32_t)(-bound) % bound;
    uint64_t product = 0;

    for (uint32_t attempt = 0;; attempt++) {
        uint32_t counter[4] = {(uint32_t)number, (uint32_t)(number >> 32), draw, attempt};
        uint32_t bits[4];

        stats_philox(counter, key, bits);
        for (int i = 0; i < 4; i++) {
            product = (uint64_t)bits[i] * bound;
            if ((uint32_t)product >= refused) {
                return (uint32_t)(product >> 32);
            }
        }
    }
}

void compare_permutation(uint64_t seed, uint64_t number, size_t n, uint32_t *order)
{
    for (size_t i = 0; i < n; i++) {
        order[i] = (uint32_t)i;
    }
    for (size_t i = n - 1; number > 0 && i > 0; i--) {
        uint32_t j = stats_below(seed, number, (uint32_t)i, (uint32_t)i + 1);
        uint32_t swap = order[i];

        order[i] = order[j];
        order[j] = swap;
    }
}

void compare_relabel(const struct exchange *exchange, uint64_t seed, uint64_t number, size_t n,
                     size_t *source, uint32_t *order)
{
    if (!exchange->test.exact) {
        compare_permutation(seed, number, n, order);
        return;
    }
    exchange_arrange(exchange, number, source + n, source);
    for (size_t i = 0; i < n; i++) {
        order[source[i]] = (uint32_t)i;
    }
}
