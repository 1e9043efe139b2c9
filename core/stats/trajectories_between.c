/*
 * trajectories_between.c - how much slopes differ between subjects, T, and how far that is known.
 *
 * With the weights w_i = 1 / (T + V / S_i) and r_i what the p columns of the design, fitted with
 * them, leave of the slopes, the sum
 *
 *     Q(T) = sum of w_i |r_i|^2
 *
 * falls with T, and its expectation at the true T is n - p, whatever S_i: weighted slopes have the
 * variance 1, and P, the projection off the weighted columns, the trace n - p. T is where Q(T) is
 * that, and 0 where Q(0) is less (R. Paule, J. Mandel, "Consensus values and weighting factors",
 * Journal of Research of the National Bureau of Standards 87, 1982). A slope that is known badly,
 * of two visits close together, has little weight in it; squares that all weigh the same would be
 * its own
 * alone. Where all slopes are known as well, this is what is left over n - p, less V / S.
 *
 * 1 / Q is concave: with Y the slopes off the columns, Q = tr Y' (T + D)^(-1) Y, D fixed, a sum of
 * terms g_k / (T + d_k). Newton's steps for 1 / Q come up from below without ever passing T. They
 * begin at a bound: squares that weigh the same, R, have (n - p) (T + V / S_i) = R for no larger T
 * than the worst known i says.
 *
 * The interval is where Q lies between its quantiles (W. Viechtbauer, "Confidence intervals for the
 * amount of heterogeneity in meta-analysis", Statistics in Medicine 26, 2007). Squares of fields
 * are not those of one number each: the quantiles are those of intervals.c for the variance of
 * the weighted slopes about their model. That V is an estimate adds to it: with L and U the ends
 * for that V, and T(v) the root for another, the lower end is T less the root of (T - L)^2 + (T -
 * T(upper V))^2, above it likewise (G. Zou, A. Donner, Statistics in Medicine 27, 2008). Roots
 * below 0 count as they are until then; ends are cut to 0.
 */
#include "intervals.h"
#include "trajectories.h"

#include <math.h>

#define TOLERANCE 1e-13 /* of T + V / S_i of the best known slope */
#define STEPS 300
/* Of V / S_i of the best known slope: T comes no nearer to where it has no variance. */
#define NEAREST 1e-6

struct profile {
    const struct trajectory_run *run;
    const double *gram;         /* [n][n] of the slopes */
    double *roots;              /* [n] of weights that are 1 on average */
    double *values;             /* [n][columns] of the design times the roots */
    double *weighted;           /* [n][n] of slopes times the roots */
    double least, most;         /* 1 / S_i */
    double freedom, unweighted; /* n - p, R */
};

/* Q at a T, its slope downwards, and the interval of Q / (n - p) over that, if asked for. */
struct look {
    double q, fall, interval[2];
};

/* Roots of the weights, and what the weights are on average. */
static double set_roots(const struct profile *p, double between, double within)
{
    const struct trajectory_run *run = p->run;
    size_t columns = run->design->columns;
    double mean = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        mean += 1.0 / (between + within / run->spread[i]) / (double)run->n;
    }
    for (size_t i = 0; i < run->n; i++) {
        p->roots[i] = sqrt(1.0 / (between + within / run->spread[i]) / mean);
    }
    for (size_t c = 0; c < columns; c++) { /* as long as before: few may weigh anything */
        double square = 0.0;

        for (size_t i = 0; i < run->n; i++) {
            double value = p->roots[i] * run->values[i * columns + c];

            p->values[i * columns + c] = value;
            square += value * value / (double)run->n;
        }
        for (size_t i = 0; i < run->n && square > 0.0; i++) {
            p->values[i * columns + c] /= sqrt(square);
        }
    }
    return mean;
}

static int look_at(const struct profile *p, double between, double within, bool interval,
                   struct look *look, struct srnf_error *error)
{
    const struct trajectory_run *run = p->run;
    size_t n = run->n;
    struct regress_fit fit = {0};
    struct intervals residuals = {0};
    double mean = set_roots(p, between, within);
    int status = regress_fit_create(&fit, n, p->roots, run->design->columns, p->values, error);

    for (size_t k = 0; k < n * n; k++) {
        p->weighted[k] = p->gram[k] * p->roots[k / n] * p->roots[k % n];
    }
    if (status == SRNF_OK) {
        status = intervals_open(&residuals, n, fit.basis.count, fit.basis.vectors, p->weighted);
    }
    *look = (struct look){0};
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        double square = fmax(residuals.gram[i * n + i], 0.0) * mean;

        look->q += square;
        look->fall += square * p->roots[i] * p->roots[i] * mean;
    }
    if (status == SRNF_OK && interval && look->q > 0.0) {
        double value = look->q / mean / p->freedom;

        intervals_variance(&residuals, value, look->interval);
        look->interval[0] /= value;
        look->interval[1] /= value;
    }
    intervals_close(&residuals);
    regress_fit_clear(&fit);
    return status;
}

/* The T at which Q is the target; below 0 as well, but for the best known slope's V / S_i. */
static int find_root(const struct profile *p, double target, double within, double *root,
                     struct srnf_error *error)
{
    double bound = p->unweighted / target;
    double lowest = within * p->least;
    int status = SRNF_OK;
    double at = fmax(bound - within * p->most, (NEAREST - 1.0) * lowest);

    for (size_t k = 0; k < STEPS && at + lowest > 0.0 && within > 0.0; k++) {
        struct look look;
        double step;

        status = look_at(p, at, within, false, &look, error);
        if (status || !(look.q > target)) {
            break;
        }
        step = (look.q - target) / target * look.q / look.fall;
        at += step;
        if (!(step > TOLERANCE * (at + lowest))) {
            break;
        }
    }
    *root = at;
    return status;
}

/* T for the upper and the lower end of V: where visits tell nothing of V, it may be 0 or so much
   that slopes need not differ. roots: as for all V on entry, where V is none. */
static int find_ends_of_within(const struct profile *p, double roots[2], struct srnf_error *error)
{
    const struct srnf_trajectories *out = p->run->out;
    bool known = isfinite(out->within_interval[0]);
    int status;

    if (out->freedom == 0) {
        return SRNF_OK;
    }
    roots[0] = -INFINITY;
    status = known ? find_root(p, p->freedom, out->within_interval[1], &roots[0], error) : SRNF_OK;
    return status
               ? status
               : find_root(p, p->freedom, known ? out->within_interval[0] : 0.0, &roots[1], error);
}

static int find_interval(const struct profile *p, double root, struct srnf_error *error)
{
    struct srnf_trajectories *out = p->run->out;
    double ends[2] = {root, root};
    double within[2] = {root, root}; /* for the upper and the lower end of V */
    struct look look;
    int status;

    out->between_interval[0] = out->between_interval[1] = NAN;
    if (!(out->between + out->within * p->least > 0.0)) {
        return SRNF_OK; /* slopes that do not differ at all */
    }
    status = look_at(p, out->between, out->within, true, &look, error);
    if (status == SRNF_OK && look.q > 0.0) {
        status = find_root(p, p->freedom / look.interval[0], out->within, &ends[0], error);
        status = status ? status
                        : find_root(p, p->freedom / look.interval[1], out->within, &ends[1], error);
    }
    status = status ? status : find_ends_of_within(p, within, error);
    out->between_interval[0] = fmax(root - hypot(root - ends[0], root - within[0]), 0.0);
    out->between_interval[1] = fmax(root + hypot(ends[1] - root, within[1] - root), 0.0);
    return status;
}

static int find_all(struct profile *p, struct srnf_error *error)
{
    const struct trajectory_run *run = p->run;
    double root;
    struct look look;
    int status;

    p->least = INFINITY;
    for (size_t i = 0; i < run->n; i++) {
        p->least = fmin(p->least, 1.0 / run->spread[i]);
        p->most = fmax(p->most, 1.0 / run->spread[i]);
    }
    p->freedom = (double)(run->n - run->design->columns - 1);
    status = look_at(p, 1.0, 0.0, false, &look, error);
    p->unweighted = look.q;
    status = status ? status : find_root(p, p->freedom, run->out->within, &root, error);
    if (status) {
        return status;
    }
    run->out->between = fmax(root, 0.0);
    return find_interval(p, root, error);
}

int trajectory_between(struct trajectory_run *run, struct srnf_error *error)
{
    size_t n = run->n;
    size_t size = 3 * run->points;
    double *y = srnf_alloc(n, size * sizeof(double));
    double *gram = srnf_alloc(n, n * sizeof(double));
    struct profile p = {.run = run,
                        .gram = gram,
                        .roots = srnf_alloc(n, sizeof(double)),
                        .values = srnf_alloc(run->design->columns + 1, n * sizeof(double)),
                        .weighted = srnf_alloc(n, n * sizeof(double))};
    int status = y && gram && p.roots && p.values && p.weighted ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        stats_weight(srnf_sht_grid(run->sht), n, run->slope_q, NULL, y);
        status = stats_gram(n, size, y, gram, error);
    }
    srnf_free(y);
    status = status ? status : find_all(&p, error);
    srnf_free(gram);
    srnf_free(p.roots);
    srnf_free(p.values);
    srnf_free(p.weighted);
    return status;
}
