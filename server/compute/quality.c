/*
 * quality.c - how good a model is, and whether two groups differ: both begin with the mean
 * of the surfaces, registered to it.
 *
 * A stored model holds its subjects as scores. Where it keeps all components they are the
 * registered SRNFs themselves; where some were cut off, leaving one out would measure the cut.
 */
#include "compute/quality.h"

#include <stdio.h>

/* What may be missing of the variance of a model that keeps all components. */
#define VARIANCE_CUT 1e-9
/* Percent of the job that the mean is. */
#define SHARE_MEAN 40.0

/* subjects: [n] or NULL, as in srnf_quality_options. */
static size_t limit_components(size_t asked, size_t n, const size_t *subjects)
{
    size_t largest = 1, most;

    for (size_t i = 0; subjects && i < n; i++) {
        size_t own = 0;

        for (size_t j = 0; j < n; j++) {
            own += subjects[j] == subjects[i];
        }
        largest = own > largest ? own : largest;
    }
    most = n > largest + 1 ? n - largest - 1 : 1;

    if (asked) {
        return asked;
    }
    return COMPUTE_QUALITY_COMPONENTS < most ? COMPUTE_QUALITY_COMPONENTS : most;
}

static int acquire(struct jobs_run *run, size_t degree, size_t n_theta, size_t n_phi,
                   const struct srnf_sht **sht, struct jobs_result *result)
{
    int status = jobs_transform_acquire(jobs_run_jobs(run), degree, SRNF_GRID_GAUSS_LEGENDRE,
                                        n_theta, n_phi, sht);

    return status ? compute_fail(result, status, NULL, "preparing the harmonic transform") : 0;
}

/* The mean, as the first part of the job. */
static int begin(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                 struct compute_mean_outputs *mean, struct jobs_result *result)
{
    struct compute_mean_inputs part = *inputs;
    int status;

    part.share = SHARE_MEAN;
    status = compute_mean(run, &part, mean, result);
    jobs_run_phase(run, 100.0);
    return status;
}

int compute_quality_group(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                          const struct srnf_quality_options *options,
                          struct compute_mean_outputs *mean, struct srnf_quality *quality,
                          struct jobs_result *result)
{
    struct srnf_quality_options limited = *options;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = begin(run, inputs, mean, result);

    if (status) {
        return status;
    }
    jobs_run_keep_parts(run);
    limited.components = limit_components(options->components, mean->mean.n, options->subjects);
    status = acquire(run, mean->group.degree, mean->n_theta, mean->n_phi, &sht, result);
    if (status == 0) {
        status = srnf_model_quality(sht, mean->mean.n, mean->mean.coefficients, mean->mean.mean_q,
                                    mean->mean.registered_q, &limited, jobs_run_context(run),
                                    quality, &error);
        if (status) {
            (void)compute_fail(result, status, &error, "evaluating the model");
        }
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    if (status) {
        compute_mean_clear(mean);
    }
    return status;
}

/* The SRNFs of the subjects of a model, double[n][3][P], srnf_free; NULL without memory. */
static double *rebuild(const struct compute_model *model, const struct srnf_sht *sht)
{
    size_t n = model->pca.n;
    size_t size = store_model_count(&model->stored, STORE_MODEL_MEAN_Q);
    double *q = srnf_alloc(n, size * sizeof(double));

    for (size_t i = 0; q && i < n; i++) {
        srnf_pca_reconstruct(srnf_sht_grid(sht), &model->pca,
                             model->stored.arrays[STORE_MODEL_MEAN_Q],
                             model->pca.scores + i * model->pca.components, q + i * size);
    }
    return q;
}

static int check_complete(const struct compute_model *model, double total_variance,
                          struct jobs_result *result)
{
    struct srnf_error error = {.status = SRNF_EINVAL, .element = -1};
    double kept = 0.0;

    for (size_t k = 0; k < model->pca.components; k++) {
        kept += model->pca.eigenvalues[k];
    }
    if (kept >= total_variance * (1.0 - VARIANCE_CUT)) {
        return 0;
    }
    (void)snprintf(error.message, sizeof error.message,
                   "the model keeps %.6g of a variance of %.6g: evaluate the group it was made of",
                   kept, total_variance);
    return compute_fail(result, SRNF_EINVAL, &error, "evaluating the model");
}

int compute_quality_model(struct jobs_run *run, const char *id, double total_variance,
                          const struct srnf_quality_options *options, struct srnf_quality *quality,
                          struct jobs_result *result)
{
    struct srnf_quality_options limited = *options;
    struct compute_model model;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    double *q = NULL;
    int status = compute_model_load(run, id, &model, result);

    if (status) {
        return status;
    }
    jobs_run_keep_parts(run);
    limited.components = limit_components(options->components, model.pca.n, options->subjects);
    status = check_complete(&model, total_variance, result);
    if (status == 0) {
        status = acquire(run, (size_t)model.stored.lmax, (size_t)model.stored.n_theta,
                         (size_t)model.stored.n_phi, &sht, result);
    }
    if (status) {
        goto out;
    }
    q = rebuild(&model, sht);
    status = q ? srnf_model_quality(sht, model.pca.n, model.mean.coefficients,
                                    model.stored.arrays[STORE_MODEL_MEAN_Q], q, &limited,
                                    jobs_run_context(run), quality, &error)
               : SRNF_ENOMEM;
    if (status) {
        (void)compute_fail(result, status, &error, "evaluating the model");
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
out:
    srnf_free(q);
    compute_model_clear(&model);
    return status;
}

int compute_comparison(struct jobs_run *run, const struct compute_comparison_inputs *inputs,
                       struct compute_mean_outputs *mean, struct srnf_comparison *comparison,
                       struct jobs_result *result)
{
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = begin(run, &inputs->mean, mean, result);

    if (status) {
        return status;
    }
    status = acquire(run, mean->group.degree, mean->n_theta, mean->n_phi, &sht, result);
    if (status == 0) {
        status =
            srnf_compare_groups(sht, mean->mean.n, mean->mean.coefficients, mean->mean.registered_q,
                                inputs->group, inputs->n_covariates, inputs->covariates,
                                &inputs->options, jobs_run_context(run), comparison, &error);
        if (status) {
            (void)compute_fail(result, status, &error, "comparing the groups");
        }
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    if (status) {
        compute_mean_clear(mean);
    }
    return status;
}
