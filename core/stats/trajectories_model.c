/*
 * trajectories_model.c - the second stage: the mean slope with its sign flips (paired_flip.c), the
 * model of slopes (regress.c), and the surfaces that both stages predict.
 */
#include "trajectories.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

/* ---- The mean slope -------------------------------------------------------------------------- */

/* Gram matrices of slopes, as SRNFs and as displacements, and of places at the time of
   reference. */
static int fill_grams(const struct trajectory_run *run, struct paired_run *paired,
                      struct srnf_error *error)
{
    size_t size = 3 * run->points;
    double *y = srnf_alloc(run->n, size * sizeof(double));
    int status = y ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        stats_weight(srnf_sht_grid(run->sht), run->n, run->slope_q, NULL, y);
        status = stats_gram(run->n, size, y, paired->gram[0], error);
    }
    srnf_free(y);
    status = status ? status : stats_gram(run->n, size, run->slope_v, paired->gram[1], error);
    return status ? status : stats_gram(run->n, size, run->level_v, paired->gram[2], error);
}

/* Slopes times their weights, and along the normal. */
static void fill_vectors(const struct trajectory_run *run, struct paired_run *paired)
{
    size_t points = run->points;
    size_t n = run->n;

    for (size_t k = 0; k < n * 3 * points; k++) {
        paired->vectors[k] = run->weights[k / (3 * points)] * run->slope_v[k];
    }
    for (size_t p = 0; p < points; p++) {
        double root = paired->embedding.root[p];
        double mean = 0.0;

        for (size_t i = 0; i < n; i++) {
            double sum = 0.0;

            for (size_t c = 0; c < 3; c++) {
                sum += paired->normal[c * points + p] * run->slope_v[(3 * i + c) * points + p];
            }
            paired->along[i * points + p] = sum;
            paired->out->normals[i * points + p] = root > 0.0 ? sum / root : 0.0;
            mean += run->weights[i] * sum / (double)n;
        }
        for (size_t i = 0; i < n; i++) {
            double *along = &paired->along[i * points + p];

            *along = run->weights[i] * (*along - mean);
        }
    }
}

int trajectory_mean(struct trajectory_run *run, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct srnf_paired_options options = {.permutations = run->options->permutations,
                                                .bootstraps = run->options->bootstraps,
                                                .seed = run->options->seed};
    struct paired_run paired = {.sht = run->sht,
                                .mean = run->visits->mean,
                                .weights = run->weighted ? run->weights : NULL,
                                .options = &options,
                                .context = context,
                                .n = run->n,
                                .points = run->points,
                                .out = &run->out->slope};
    int status = stats_embedding_create(run->sht, paired.mean, &paired.embedding);

    paired.out->n = run->n;
    status = status ? status : paired_open(&paired);
    status = status ? status : paired_normal(&paired);
    status = status ? status : fill_grams(run, &paired, error);
    if (status == SRNF_OK) {
        const double *const gram[2] = {paired.gram[0], paired.gram[1]};

        fill_vectors(run, &paired);
        run->normals = paired.out->normals;
        status = trajectory_subjects(run, gram, error);
    }
    status = status
                 ? status
                 : paired_flip(&paired, (struct stats_progress){0.0, 1.0, "flipping signs"}, error);
    status = status ? status : paired_bootstrap(&paired, error);
    paired_close(&paired);
    return status;
}

/* ---- The model of slopes --------------------------------------------------------------------- */

struct second {
    struct regress_run run;
    double *q; /* [n][3][P], of the run */
    struct srnf_regression out;
};

/* A run of regress on places at a time, a_i + shift * b_i, or on slopes alone. */
static int open_second(const struct trajectory_run *run, const struct srnf_regress_design *design,
                       bool slopes, double shift, const struct srnf_context *context,
                       struct second *second)
{
    size_t size = 3 * run->points;
    double *vectors = srnf_alloc(run->n, size * sizeof(double));

    *second = (struct second){.q = srnf_alloc(run->n, size * sizeof(double))};
    second->run = (struct regress_run){.sht = run->sht,
                                       .n = run->n,
                                       .points = run->points,
                                       .permutations = run->options->permutations,
                                       .bootstraps = run->options->bootstraps,
                                       .seed = run->options->seed,
                                       .context = context,
                                       .design = design,
                                       .lead = run->weighted ? run->roots : NULL,
                                       .values = run->scaled,
                                       .q = second->q,
                                       .vectors = vectors,
                                       .embedded = true,
                                       .no_surfaces = slopes,
                                       .out = &second->out};
    if (!second->q || !vectors) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < run->n * size; k++) {
        double root = run->roots[k / size];

        second->q[k] =
            root * (slopes ? run->slope_q[k] : run->level_q[k] + shift * run->slope_q[k]);
        vectors[k] = root * (slopes ? run->slope_v[k] : run->level_v[k] + shift * run->slope_v[k]);
    }
    return SRNF_OK;
}

static void close_second(struct second *second)
{
    regress_close(&second->run);
    srnf_regression_clear(&second->out);
    srnf_free(second->q);
}

/* The slope at point k along the normal, with what the model knows of it. */
static int take_slope(struct trajectory_run *run, struct second *second, size_t k)
{
    struct srnf_predicted_slope *to = &run->out->slope_at[k];
    struct srnf_predicted_shape *from = &second->out.predicted[k];
    const struct regress_fit *fit = &second->run.fit;
    size_t columns = run->design->columns;
    double *weights = srnf_alloc(run->n, sizeof(double));

    to->normal = srnf_alloc(run->points, sizeof(double));
    if (!weights || !to->normal) {
        srnf_free(weights);
        return SRNF_ENOMEM;
    }
    memcpy(weights, fit->weights, run->n * sizeof(double));
    for (size_t c = 0; c < columns; c++) {
        cblas_daxpy((int)run->n, run->design->at[k * columns + c], fit->weights + (c + 1) * run->n,
                    1, weights, 1);
    }
    for (size_t i = 0; i < run->n; i++) {
        cblas_daxpy((int)run->points, weights[i] * run->roots[i], run->normals + i * run->points, 1,
                    to->normal, 1);
    }
    to->standard_error = from->standard_error;
    to->confidence = from->confidence;
    from->standard_error = from->confidence = NULL;
    srnf_free(weights);
    return SRNF_OK;
}

int trajectory_model(struct trajectory_run *run, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct second second;
    int status = open_second(run, run->design, true, 0.0, context, &second);

    status = status ? status : regress_compute(&second.run, run->visits->mean, run->nested, error);
    for (size_t k = 0; k < run->design->points && status == SRNF_OK; k++) {
        status = take_slope(run, &second, k);
    }
    if (status == SRNF_OK) {
        second.out.n = run->visits->n;
        second.out.subjects = run->n;
        run->out->model = second.out;
        second.out = (struct srnf_regression){0};
    }
    close_second(&second);
    return status;
}

/* ---- Predicted surfaces ---------------------------------------------------------------------- */

/* All predictions at the time of prediction `first`, the first one of it. rows: [points][columns]
   of scratch. */
static int predict_time(struct trajectory_run *run, size_t first, double *rows,
                        const struct srnf_context *context, struct srnf_error *error)
{
    const struct srnf_regress_design *whole = run->design;
    const double *times = run->visits->at_times;
    struct srnf_regress_design design = {.columns = whole->columns, .at = rows};
    struct second second;
    size_t columns = whole->columns;
    int status;

    for (size_t k = first; k < whole->points; k++) {
        if (!(times[k] < times[first] || times[k] > times[first])) {
            memcpy(rows + design.points++ * columns, whole->at + k * columns,
                   columns * sizeof(double));
        }
    }
    status = open_second(run, &design, false, times[first] - run->origin - run->out->reference,
                         context, &second);
    status = status ? status : regress_compute(&second.run, run->visits->mean, NULL, error);
    for (size_t k = first, at = 0; k < whole->points && status == SRNF_OK; k++) {
        if (!(times[k] < times[first] || times[k] > times[first])) {
            srnf_free(run->out->model.predicted[k].coefficients);
            run->out->model.predicted[k] = second.out.predicted[at];
            second.out.predicted[at++] = (struct srnf_predicted_shape){0};
        }
    }
    close_second(&second);
    return status;
}

int trajectory_predict(struct trajectory_run *run, const struct srnf_context *context,
                       struct srnf_error *error)
{
    const double *times = run->visits->at_times;
    size_t points = run->design->points;
    double *rows = srnf_alloc(points + 1, (run->design->columns + 1) * sizeof(double));
    int status = rows ? SRNF_OK : SRNF_ENOMEM;

    for (size_t k = 0; k < points && status == SRNF_OK; k++) {
        bool seen = false;

        for (size_t j = 0; j < k; j++) {
            seen = seen || !(times[j] < times[k] || times[j] > times[k]);
        }
        if (!seen) {
            status = predict_time(run, k, rows, context, error);
        }
    }
    srnf_free(rows);
    return status;
}
