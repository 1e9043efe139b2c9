/*
 * trajectories_weights.c - what each slope weighs in the second stage: formulae in trajectories.c.
 * V is found in trajectories_within.c, T in trajectories_between.c.
 */
#include "trajectories.h"

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
    int status = average_design(run);

    status = status ? status : trajectory_within(run, error);
    status = status ? status : trajectory_between(run, error);
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
