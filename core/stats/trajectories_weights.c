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
 *
 * Squared norms of whole surfaces are sums of very different squares, of unknown degrees of
 * freedom, so that their variance is taken from how subjects differ. V = sum l_i / sum f_i is a
 * ratio, with the standard error s,
 *
 *     s^2 = n / (n - 1) sum (l_i - V f_i)^2 / (sum f_i)^2,
 *
 * and the interval V exp(-+ t s / V), t of Student's distribution with n - 1 degrees of freedom.
 * G = |R|^2 / (n - p) likewise, from the r_i = |R_i|^2 with the expectation
 * G_i = (T + V / S_i) (1 - h_i), n - p degrees of freedom and terms (r_i - G_i) / (1 - h_i). That
 * of T = G - k V, k = sum (1 - h_i) / S_i / (n - p), follows from both (G. Zou, A. Donner,
 * Statistics in Medicine 27, 2008): below T by the root of (G - lower G)^2 + k^2 (upper V - V)^2,
 * above it likewise; no end is below 0. Of two visits of each V is not known, and has no interval.
 */
#include "intervals.h"
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

static void find_within(struct trajectory_run *run)
{
    struct srnf_trajectories *out = run->out;
    double freedom = (double)out->freedom;
    double left = 0.0;
    double squares = 0.0;

    out->within_interval[0] = out->within_interval[1] = NAN;
    for (size_t i = 0; i < run->n; i++) {
        left += run->left[i];
    }
    out->within = out->freedom > 0 ? left / freedom : 0.0;
    for (size_t i = 0; i < run->n; i++) {
        double off = run->left[i] - out->within * (double)(run->subjects.size[i] - 2);

        squares += off * off;
    }
    if (out->freedom > 0) {
        double n = (double)run->n;

        intervals_log(out->within, sqrt(n / (n - 1.0) * squares) / freedom, n - 1.0,
                      out->within_interval);
    }
}

/* From squares of residuals and 1 - h_i of the subjects. */
static void set_between(struct trajectory_run *run, const double *squares, const double *rest)
{
    struct srnf_trajectories *out = run->out;
    double freedom = 0.0;
    double left = 0.0;
    double noise = 0.0;
    double sum = 0.0;
    double excess;
    double lower[2], upper[2], whole[2];

    for (size_t i = 0; i < run->n; i++) {
        freedom += rest[i];
        left += squares[i];
        noise += rest[i] / run->spread[i];
    }
    freedom = round(freedom);
    left /= freedom;
    noise /= freedom;
    excess = left - out->within * noise;
    out->between = fmax(excess, 0.0);
    for (size_t i = 0; i < run->n; i++) {
        double expected = rest[i] * (excess + out->within / run->spread[i]);
        double off = rest[i] > SAME ? (squares[i] - expected) / rest[i] : 0.0;

        sum += off * off;
    }
    intervals_log(left, sqrt(sum) / freedom, freedom, whole);
    lower[0] = left - whole[0];
    upper[0] = whole[1] - left;
    lower[1] = out->freedom > 0 ? noise * (out->within_interval[1] - out->within) : 0.0;
    upper[1] = out->freedom > 0 ? noise * (out->within - out->within_interval[0]) : 0.0;
    out->between_interval[0] = fmax(excess - hypot(lower[0], lower[1]), 0.0);
    out->between_interval[1] = fmax(excess + hypot(upper[0], upper[1]), 0.0);
}

/* T, from the residuals of slopes that weigh the same. */
static int find_between(struct trajectory_run *run, struct srnf_error *error)
{
    size_t n = run->n;
    size_t size = 3 * run->points;
    struct regress_fit fit = {0};
    struct intervals residuals = {0};
    double *y = srnf_alloc(n, size * sizeof(double));
    double *gram = srnf_alloc(n, n * sizeof(double));
    double *squares = srnf_alloc(n, sizeof(double));
    int status = y && gram && squares
                     ? regress_fit_create(&fit, n, NULL, run->design->columns, run->values, error)
                     : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        stats_weight(srnf_sht_grid(run->sht), n, run->slope_q, NULL, y);
        status = stats_gram(n, size, y, gram, error);
    }
    if (status == SRNF_OK) {
        status = intervals_open(&residuals, n, fit.basis.count, fit.basis.vectors, gram);
    }
    if (status == SRNF_OK) {
        for (size_t i = 0; i < n; i++) {
            squares[i] = fmax(residuals.gram[i * n + i], 0.0);
        }
        set_between(run, squares, residuals.rest);
    }
    intervals_close(&residuals);
    regress_fit_clear(&fit);
    srnf_free(y);
    srnf_free(gram);
    srnf_free(squares);
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
    int status = average_design(run);

    find_within(run);
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
