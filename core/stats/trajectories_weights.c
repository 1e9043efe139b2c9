/*
 * trajectories_weights.c - what each slope weighs in the second stage: formulae in trajectories.c.
 *
 * The residuals R of slopes, each weighing the same, about the p columns of the design have the
 * expected square
 *
 *     E |R|^2 = T (n - p) + V sum over i of (1 - h_i) / S_i,
 *
 * h_i the diagonal of the projection on the design, from which T follows once V is known; where it
 * comes out negative it is 0.
 */
#include "trajectories.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define SAME 1e-9 /* relative: what counts as the same weight, as of times that are rounded */

/* The design of subjects, each the average of its members. */
static int average_design(struct trajectory_run *run)
{
    const struct srnf_regress_design *design = run->design;
    const struct subjects *s = &run->subjects;

    for (size_t i = 0; i < s->n; i++) {
        size_t of = s->of[i];

        for (size_t c = 0; c < design->columns; c++) {
            run->values[of * design->columns + c] +=
                design->values[i * design->columns + c] / (double)s->size[of];
        }
    }
    return regress_average_nested(design, s, run->nested, run->nested_values);
}

/* T, from the residuals of slopes that weigh the same. */
static int find_between(struct trajectory_run *run, struct srnf_error *error)
{
    size_t n = run->n;
    size_t size = 3 * run->points;
    struct regress_fit fit = {0};
    double *y = srnf_alloc(n, size * sizeof(double));
    double *gram = srnf_alloc(n, n * sizeof(double));
    double *scratch = srnf_alloc(n, sizeof(double));
    int status = y && gram && scratch
                     ? regress_fit_create(&fit, n, NULL, run->design->columns, run->values, error)
                     : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        stats_weight(srnf_sht_grid(run->sht), n, run->slope_q, NULL, y);
        status = stats_gram(n, size, y, gram, error);
    }
    if (status == SRNF_OK) {
        double left = 0.0;
        double noise = 0.0;

        for (size_t i = 0; i < n; i++) {
            left += gram[i * n + i];
            noise += 1.0 / run->spread[i];
        }
        for (size_t k = 0; k < fit.basis.count; k++) {
            const double *u = fit.basis.vectors + k * n;

            cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)n, 1.0, gram, (int)n, u, 1, 0.0,
                        scratch, 1);
            left -= cblas_ddot((int)n, u, 1, scratch, 1);
            for (size_t i = 0; i < n; i++) {
                noise -= u[i] * u[i] / run->spread[i];
            }
        }
        run->out->between =
            fmax(left - run->out->within * noise, 0.0) / (double)(n - fit.basis.count);
    }
    regress_fit_clear(&fit);
    srnf_free(y);
    srnf_free(gram);
    srnf_free(scratch);
    return status;
}

static void set_weights(struct trajectory_run *run)
{
    const struct srnf_trajectories *out = run->out;
    double sum = 0.0;
    double least = INFINITY;
    double most = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        double variance = out->between + out->within / run->spread[i];

        run->weights[i] = variance > 0.0 ? 1.0 / variance : 1.0;
        least = fmin(least, run->weights[i]);
        most = fmax(most, run->weights[i]);
        sum += run->weights[i];
    }
    run->weighted = most > least * (1.0 + SAME);
    for (size_t i = 0; i < run->n; i++) {
        run->weights[i] = run->weighted ? run->weights[i] * (double)run->n / sum : 1.0;
        run->roots[i] = sqrt(run->weights[i]);
        run->out->subject[i].weight = run->weights[i];
    }
    run->out->weighted = run->weighted;
}

static void scale_rows(size_t n, size_t columns, const double *roots, double *rows)
{
    for (size_t k = 0; k < n * columns; k++) {
        rows[k] *= roots[k / columns];
    }
}

int trajectory_weigh(struct trajectory_run *run, struct srnf_error *error)
{
    size_t columns = run->design->columns;
    double left = 0.0;
    int status = average_design(run);

    for (size_t i = 0; i < run->n; i++) {
        left += run->left[i];
    }
    run->out->within = run->out->freedom > 0 ? left / (double)run->out->freedom : 0.0;
    status = status ? status : find_between(run, error);
    if (status) {
        return status;
    }
    set_weights(run);
    memcpy(run->scaled, run->values, run->n * columns * sizeof(double));
    scale_rows(run->n, columns, run->roots, run->scaled);
    for (size_t t = 0; t < run->design->tests; t++) {
        size_t reduced = run->nested[t].reduced;

        scale_rows(run->n, reduced, run->roots, run->nested_values[t]);
        scale_rows(run->n, run->nested[t].tested, run->roots,
                   run->nested_values[t] + reduced * run->n);
    }
    return SRNF_OK;
}
