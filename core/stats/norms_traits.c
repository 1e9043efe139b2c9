/*
 * norms_traits.c - how far a surface is from what a fold of the members predicts for it.
 *
 * With the scores Z of the members of the fold on all components of the model, one row each, their
 * deviations E = (1 - U U') Z (norms_fold.c), f = members - coefficients, and the eigenvalues mu_k
 * and vectors v_k of E'E, a surface with the scores z, and o beside them, is e = z - a'Z off its
 * prediction, has the scores s_k = <e, v_k>, and
 *
 *     residual^2 = o^2 + sum over mu_k = 0 of s_k^2,    distance^2 = o^2 + |e|^2,
 *     mahalanobis^2 = f sum over the first c of s_k^2 / mu_k * (1 + 1 / members) / (1 + h),
 *
 * where h is the leverage: a prediction far from the members' covariates is known less well, and
 * with the constant alone the last factor is 1. All deviations of the members of a fold lie in the
 * span of E, those of others do not: what the members have, each left out, and what another surface
 * has, are the same numbers of the same kind. With the constant alone they are those of
 * calibrate.c, by an eigenproblem for each fold.
 */
#include "norms.h"
#include "linear/linear.h"

#include <cblas.h>
#include <float.h>
#include <math.h>
#include <string.h>

#define ROOT_ROUNDING 64.0 /* as in calibrate.c */
#define RESIDUAL_ROUNDING 1e-9

/* E'E, its upper triangle as C sees it, of the model's scores. */
static int fill_scatter(const struct norms *norms, const struct norms_fold *fold, double *scatter)
{
    size_t k = norms->model->pca->components;
    int kk = (int)k;
    int p = (int)fold->p;
    double *e = srnf_alloc(norms->n + fold->p, k * sizeof(double));
    double *b = e ? e + norms->n * k : NULL;

    if (!e) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < norms->n; i++) {
        if (fold->inside[i]) {
            memcpy(e + i * k, norms->model->pca->scores + i * k, k * sizeof(double));
        }
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, p, kk, (int)norms->n, 1.0, fold->basis,
                (int)norms->n, e, kk, 0.0, b, kk);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)norms->n, kk, p, -1.0, fold->basis,
                (int)norms->n, b, kk, 1.0, e, kk);
    cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, kk, (int)norms->n, 1.0, e, kk, 0.0,
                scatter, kk);
    srnf_free(e);
    return SRNF_OK;
}

int norms_count(const struct norms *norms, const struct norms_fold *fold, size_t *counted)
{
    size_t k = norms->model->pca->components;
    double *scatter = srnf_alloc(k + 2, k * sizeof(double));
    double *values = scatter ? scatter + k * k : NULL;
    int status = scatter ? fill_scatter(norms, fold, scatter) : SRNF_ENOMEM;

    status = status ? status : linear_eigenvalues(k, false, scatter, values);
    if (status == SRNF_OK) {
        for (size_t j = 0; j < k; j++) {
            values[k + j] = fmax(values[k - 1 - j], 0.0);
        }
        *counted = srnf_mahalanobis_components(norms->subjects.count - norms->model->columns, k,
                                               values + k);
    }
    srnf_free(scatter);
    return status;
}

struct spectrum {
    size_t k, counted;
    double freedom, members, floor;
    const double *mu, *vectors; /* increasing; [k][k], one a row */
};

static void describe(const struct spectrum *s, const double *e, double outside2, double leverage,
                     double noise, size_t stride, double *values)
{
    double rest = outside2;
    double distance2 = outside2;
    double mahalanobis = 0.0;

    for (size_t j = 0; j < s->k; j++) {
        size_t row = s->k - 1 - j;
        double score = cblas_ddot((int)s->k, s->vectors + row * s->k, 1, e, 1);
        bool none = !(s->mu[row] > s->floor);

        distance2 += e[j] * e[j];
        rest += none ? score * score : 0.0;
        mahalanobis += j < s->counted && !none ? score * score / s->mu[row] : 0.0;
    }
    values[(size_t)SRNF_TRAIT_RESIDUAL * stride] = fmax(sqrt(rest), noise);
    values[(size_t)SRNF_TRAIT_DISTANCE * stride] = sqrt(distance2);
    values[(size_t)SRNF_TRAIT_MAHALANOBIS * stride] =
        sqrt(s->freedom * mahalanobis * (1.0 + 1.0 / s->members) / (1.0 + leverage));
}

int norms_describe(const struct norms *norms, const struct norms_fold *fold, size_t counted,
                   size_t count, const struct norms_target *targets, size_t stride, double *values)
{
    size_t k = norms->model->pca->components;
    double noise = RESIDUAL_ROUNDING * sqrt(srnf_inner_product(norms->grid, norms->model->mean_q,
                                                               norms->model->mean_q));
    double *memory = srnf_alloc(k * k + 2 * k + norms->n + fold->p, sizeof(double));
    double *mu = memory ? memory + k * k : NULL;
    double *e = memory ? mu + k : NULL;
    double *a = memory ? e + k : NULL;
    int status = memory ? fill_scatter(norms, fold, memory) : SRNF_ENOMEM;

    status = status ? status : linear_eigenvalues(k, true, memory, mu);
    if (status == SRNF_OK) {
        struct spectrum spectrum = {
            .k = k,
            .counted = counted,
            .freedom = (double)norms_fold_freedom(fold),
            .members = (double)fold->members,
            .floor = ROOT_ROUNDING * (double)norms->n * DBL_EPSILON * mu[k - 1],
            .mu = mu,
            .vectors = memory,
        };

        for (size_t i = 0; i < count; i++) {
            double leverage = norms_fold_predict(fold, targets[i].x, a + norms->n, a);

            memcpy(e, targets[i].scores, k * sizeof(double));
            cblas_dgemv(CblasRowMajor, CblasTrans, (int)norms->n, (int)k, -1.0,
                        norms->model->pca->scores, (int)k, a, 1, 1.0, e, 1);
            describe(&spectrum, e, targets[i].outside2, leverage, noise, stride, values + i);
        }
    }
    srnf_free(memory);
    return status;
}

int norms_describe_subject(const struct norms *norms, size_t group, size_t subject, size_t counted,
                           double *values, struct srnf_error *error)
{
    const struct subjects *s = &norms->subjects;
    size_t k = norms->model->pca->components;
    size_t count = s->size[subject];
    struct norms_target *targets = srnf_alloc(count, sizeof *targets);
    double *found = srnf_alloc(count, SRNF_NORM_TRAITS * sizeof(double));
    struct norms_fold fold = {0};
    int status =
        targets && found ? norms_fold_open(&fold, norms, group, subject, error) : SRNF_ENOMEM;

    for (size_t m = 0; m < count && status == SRNF_OK; m++) {
        size_t i = s->members[s->start[subject] + m];

        targets[m] = (struct norms_target){
            .scores = norms->model->pca->scores + i * k,
            .x = norms_row(norms, i),
        };
    }
    status = status ? status : norms_describe(norms, &fold, counted, count, targets, count, found);
    for (size_t m = 0; m < count && status == SRNF_OK; m++) {
        for (size_t t = 0; t < SRNF_NORM_TRAITS; t++) {
            values[t * norms->n + s->members[s->start[subject] + m]] = found[t * count + m];
        }
    }
    norms_fold_clear(&fold);
    srnf_free(targets);
    srnf_free(found);
    return status;
}
