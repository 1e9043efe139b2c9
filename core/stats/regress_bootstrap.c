/*
 * regress_bootstrap.c - how far the predictions are known.
 *
 * Residuals of the whole model are drawn anew (B. Efron 1979; D. Freedman 1981): with H the
 * projection on the design and h_i its diagonal, and S the choice of n subjects with replacement,
 *
 *     Y* = H Y + S E Y,     E = (1 - 1 1'/n) diag(1 - h_i)^(-1/2) (1 - H),
 *
 * in which the division gives residuals the variance of the errors. The design stays, so that no
 * sample lacks a level.
 *
 * The confidence region of a prediction, w'Y for weights w, along the normal: at each node w'(S E)Y
 * over |w| s*, with s*^2 = |(1 - H) S E Y|^2 / (n - p) of the sample itself at the node, as the
 * spread of few subjects is not well known (the bootstrap-t; A. Davison, D. Hinkley, "Bootstrap
 * methods and their application", 1997, 5.2). The largest over the map is below its 95 % quantile
 * all over the surface in 95 % of the samples. With the orthonormal basis u_k of the design the
 * squares left are |S E Y|^2 less all (u_k'S E Y)^2.
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define BLOCK ((size_t)16)
#define CERTAIN 1e-10 /* 1 - h of a subject whose value the design fixes: it has no residual */
#define LEVEL 0.95
#define ROUNDING 1e-12 /* of the squares that a sample leaves at a node */

struct drawing {
    struct regress_run *run;
    double *residuals; /* [n][P] E times the displacements along the normal */
    double *squares;   /* [n][P] of the same */
    double *deviation; /* [P] of the same: root of the mean square */
    double *weights;   /* [points][n] of the predictions */
    double *farthest;  /* [points][bootstraps] */
};

struct sample {
    uint32_t *drawn;       /* [BLOCK][n] */
    double *ones;          /* [n] */
    double *counts, *data; /* [BLOCK][points][n] and [..][P] */
    double *all, *left;    /* [BLOCK][P] squares of S E Y, and those that H leaves */
};

/* ---- Before ---------------------------------------------------------------------------------- */

void regress_standardize(const struct regress_run *run, double *e, double *rest)
{
    const struct regress_basis *basis = &run->fit.basis;
    int n = (int)run->n;

    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, n, n, (int)basis->count, -1.0,
                basis->vectors, n, basis->vectors, n, 0.0, e, n);
    for (size_t i = 0; i < run->n; i++) {
        double left = 1.0 + e[i * run->n + i];

        rest[i] = left > CERTAIN ? left : 0.0;
        e[i * run->n + i] = left;
        cblas_dscal(n, left > CERTAIN ? 1.0 / sqrt(left) : 0.0, e + i * run->n, 1);
    }
}

/* Takes the mean over rows out of E. */
static void center(size_t n, double *e)
{
    for (size_t j = 0; j < n; j++) {
        double mean = 0.0;

        for (size_t i = 0; i < n; i++) {
            mean += e[i * n + j] / (double)n;
        }
        for (size_t i = 0; i < n; i++) {
            e[i * n + j] -= mean;
        }
    }
}

static void fill_residuals(struct drawing *d, const double *e)
{
    const struct regress_run *run = d->run;
    size_t points = run->points;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)run->n, (int)points, (int)run->n,
                1.0, e, (int)run->n, run->along, (int)points, 0.0, d->residuals, (int)points);
    for (size_t p = 0; p < points; p++) {
        double sum = 0.0;

        for (size_t i = 0; i < run->n; i++) {
            double square = d->residuals[i * points + p] * d->residuals[i * points + p];

            d->squares[i * points + p] = square;
            sum += square;
        }
        d->deviation[p] = sqrt(sum / (double)run->n);
    }
    for (size_t k = 0; k < run->design->points; k++) {
        double *w = d->weights + k * run->n;

        memcpy(w, run->fit.weights, run->n * sizeof(double));
        for (size_t j = 0; j < run->design->columns; j++) {
            cblas_daxpy((int)run->n, run->design->at[k * run->design->columns + j],
                        run->fit.weights + (j + 1) * run->n, 1, w, 1);
        }
    }
}

static int open_drawing(struct drawing *d)
{
    struct regress_run *run = d->run;
    size_t n = run->n;
    size_t points = run->design->points;
    double *e = srnf_alloc(n, n * sizeof(double));
    double *rest = srnf_alloc(n, sizeof(double));
    int status = SRNF_ENOMEM;

    d->residuals = srnf_alloc(n, run->points * sizeof(double));
    d->squares = srnf_alloc(n, run->points * sizeof(double));
    d->deviation = srnf_alloc(run->points, sizeof(double));
    d->weights = srnf_alloc(points, n * sizeof(double));
    d->farthest = srnf_alloc(points, run->bootstraps * sizeof(double));
    if (e && rest && d->residuals && d->squares && d->deviation && d->weights && d->farthest) {
        regress_standardize(run, e, rest);
        center(n, e);
        fill_residuals(d, e);
        status = SRNF_OK;
    }
    srnf_free(e);
    srnf_free(rest);
    return status;
}

static void close_drawing(struct drawing *d)
{
    srnf_free(d->residuals);
    srnf_free(d->squares);
    srnf_free(d->deviation);
    srnf_free(d->weights);
    srnf_free(d->farthest);
}

/* ---- One sample ------------------------------------------------------------------------------ */

/* S'v: the sum over those that chose subject j. */
static void pick(size_t n, const uint32_t *chosen, const double *v, double *out)
{
    memset(out, 0, n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        out[chosen[i]] += v[i];
    }
}

/* rows: [count][n] in counts. */
static void multiply(const struct drawing *d, const struct sample *s, size_t rows,
                     const double *with, double *out)
{
    int points = (int)d->run->points;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)rows, points, (int)d->run->n, 1.0,
                s->counts, (int)d->run->n, with, points, 0.0, out, points);
}

/* Squares of `count` samples at each node, and what of them the design does not explain. */
static void find_left(const struct drawing *d, const struct sample *s, size_t count)
{
    const struct regress_run *run = d->run;
    size_t n = run->n;
    size_t size = count * run->points;

    for (size_t i = 0; i < n; i++) {
        s->ones[i] = 1.0;
    }
    for (size_t k = 0; k < count; k++) {
        pick(n, s->drawn + k * n, s->ones, s->counts + k * n);
    }
    multiply(d, s, count, d->squares, s->all);
    memcpy(s->left, s->all, size * sizeof(double));
    for (size_t u = 0; u < run->fit.basis.count; u++) {
        for (size_t k = 0; k < count; k++) {
            pick(n, s->drawn + k * n, run->fit.basis.vectors + u * n, s->counts + k * n);
        }
        multiply(d, s, count, d->residuals, s->data);
        for (size_t p = 0; p < size; p++) {
            s->left[p] -= s->data[p] * s->data[p];
        }
    }
}

/* The largest deviation of each prediction, for `count` samples from `first` on. */
static void draw_deviations(struct drawing *d, const struct sample *s, size_t first, size_t count)
{
    const struct regress_run *run = d->run;
    size_t n = run->n;
    size_t points = run->points;
    size_t at = run->design->points;
    double freedom = (double)(n - run->fit.basis.count);

    find_left(d, s, count);
    for (size_t k = 0; k < count * at; k++) {
        pick(n, s->drawn + k / at * n, d->weights + k % at * n, s->counts + k * n);
    }
    multiply(d, s, count * at, d->residuals, s->data);
    for (size_t k = 0; k < count * at; k++) {
        double norm = cblas_dnrm2((int)n, d->weights + k % at * n, 1);
        double largest = 0.0;

        for (size_t p = 0; p < points; p++) {
            double all = s->all[k / at * points + p];
            double left = fmax(s->left[k / at * points + p], ROUNDING * all);
            double scale = norm * sqrt(left / freedom);

            largest = scale > 0.0 ? fmax(largest, fabs(s->data[k * points + p]) / scale) : largest;
        }
        d->farthest[k % at * run->bootstraps + first + k / at] = largest;
    }
}

static int open_sample(struct sample *s, const struct regress_run *run)
{
    size_t n = run->n;
    size_t at = run->design->points;

    *s = (struct sample){0};
    s->drawn = srnf_alloc(BLOCK, n * sizeof *s->drawn);
    s->ones = srnf_alloc(n, sizeof(double));
    s->counts = srnf_alloc(BLOCK * at, n * sizeof(double));
    s->data = srnf_alloc(BLOCK * at, run->points * sizeof(double));
    s->all = srnf_alloc(BLOCK, run->points * sizeof(double));
    s->left = srnf_alloc(BLOCK, run->points * sizeof(double));
    return s->drawn && s->ones && s->counts && s->data && s->all && s->left ? SRNF_OK : SRNF_ENOMEM;
}

static void close_sample(struct sample *s)
{
    srnf_free(s->drawn);
    srnf_free(s->ones);
    srnf_free(s->counts);
    srnf_free(s->data);
    srnf_free(s->all);
    srnf_free(s->left);
}

static int draw_block(void *argument, size_t index, const struct srnf_context *context,
                      struct srnf_error *error)
{
    struct drawing *d = argument;
    const struct regress_run *run = d->run;
    size_t first = index * BLOCK;
    size_t count = run->bootstraps - first < BLOCK ? run->bootstraps - first : BLOCK;
    struct sample s;
    int status = open_sample(&s, run);

    (void)error;
    for (size_t k = 0; k < count * run->n && status == SRNF_OK; k++) {
        s.drawn[k] = stats_below(run->seed, REGRESS_DRAWN + first + k / run->n,
                                 (uint32_t)(k % run->n), (uint32_t)run->n);
    }
    if (status == SRNF_OK) {
        draw_deviations(d, &s, first, count);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    close_sample(&s);
    return status;
}

/* ---- From samples to intervals --------------------------------------------------------------- */

double regress_quantile(size_t n, const double *sorted, double part)
{
    double at = part * (double)(n - 1);
    size_t below = (size_t)at;
    size_t above = below + 1 < n ? below + 1 : below;

    return sorted[below] + (at - (double)below) * (sorted[above] - sorted[below]);
}

static void conclude(struct drawing *d)
{
    struct regress_run *run = d->run;
    size_t n = run->bootstraps;

    for (size_t k = 0; k < run->design->points; k++) {
        struct srnf_predicted_shape *to = &run->out->predicted[k];
        double norm = cblas_dnrm2((int)run->n, d->weights + k * run->n, 1);
        double *farthest = d->farthest + k * n;
        double reach;

        stats_sort(n, farthest);
        reach = regress_quantile(n, farthest, LEVEL);
        to->leverage = norm * norm;
        for (size_t p = 0; p < run->points; p++) {
            double root = run->embedding.root[p];

            to->standard_error[p] = root > 0.0 ? norm * d->deviation[p] / root : 0.0;
            to->confidence[p] = reach * to->standard_error[p];
        }
    }
}

int regress_bootstrap(struct regress_run *run, struct stats_progress progress,
                      struct srnf_error *error)
{
    struct drawing d = {.run = run};
    int status;

    if (run->design->points == 0) {
        return SRNF_OK;
    }
    status = open_drawing(&d);

    status = status ? status
                    : stats_run(run->context, (run->bootstraps + BLOCK - 1) / BLOCK, draw_block, &d,
                                progress, error);
    if (status == SRNF_OK) {
        conclude(&d);
    }
    close_drawing(&d);
    return status;
}
