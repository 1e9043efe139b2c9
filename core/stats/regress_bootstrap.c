/*
 * regress_bootstrap.c - how far the shares of the variance and the predictions are known.
 *
 * Residuals of the whole model are drawn anew (B. Efron 1979; D. Freedman 1981): with H the
 * projection on the design and h_i its diagonal, and S the choice of n subjects with replacement,
 *
 *     Y* = H Y + S E Y,     E = (1 - 1 1'/n) diag(1 - h_i)^(-1/2) (1 - H),
 *
 * in which the division gives residuals the variance of the errors. The design stays, so that no
 * sample lacks a level. All shares of Y* follow from the Gram matrix of the SRNFs.
 *
 * An interval of a share is one of x = f SS / SS_rest, the squares that a term of m columns
 * explains over the mean square of the rest with f degrees of freedom. Its mean is near t + m, t
 * the squares that are no noise over the variance: noise explains m, whatever the share. So fitted
 * values of a term enter Y* multiplied by c, with c^2 x = max(x - m, 0), the estimate of t; x* over
 * its mean c^2 x + m is then spread as x over t + m (A. Davison, D. Hinkley, "Bootstrap methods and
 * their application", 1997, 5.2), and quantiles of x* give bounds of t. Without an effect Y* is
 * noise, and the lower one is above 0 where a test at 2.5 % would reject. Shares follow from t:
 * t / (t + m + f) of what the others leave, and of all with what the others explain. As estimates
 * that lie beyond would only puzzle, intervals are extended to hold the estimate. They are of these
 * values of the covariates, not of such as another sample would have.
 *
 * The confidence region of a prediction, w'Y for weights w, along the normal: at each node w'(S E)Y
 * over |w| s*, with s*^2 = |(1 - H) S E Y|^2 / (n - p) of the sample itself at the node, as the
 * spread of few subjects is not well known (the bootstrap-t; Davison and Hinkley, 5.2). The largest
 * over the map is below its 95 % quantile all over the surface in 95 % of the samples. With the
 * orthonormal basis u_k of the design the squares left are |S E Y|^2 less all (u_k'S E Y)^2.
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define BLOCK ((size_t)16)
#define CERTAIN 1e-10 /* 1 - h of a subject whose value the design fixes: it has no residual */
#define LEVEL 0.95
#define RATIO_MAX 1e12 /* of squares that are explained over the rest: rounding leaves more */
#define ROUNDING 1e-12 /* of the squares that a sample leaves at a node */
#define NUMBER (UINT64_C(1) << 40) /* of the first drawing: beyond those of the permutations */

/* What a test finds in Y. */
struct observed {
    double inside, left; /* squares that the term explains, and that its model leaves */
    double freedom;      /* of those left */
    double columns;      /* of the term */
    double kept;         /* c: of its fitted values */
};

struct drawing {
    struct regress_run *run;
    double *e, *projected; /* [n][n] E; and H */
    double *cross;         /* [n][n] E G H */
    double *own;           /* [n] diagonal of E G E' */
    double fitted;         /* trace of H G H */
    double *residuals;     /* [n][P] E times the displacements along the normal */
    double *squares;       /* [n][P] of the same */
    double *deviation;     /* [P] of the same: root of the mean square */
    double *weights;       /* [points][n] of the predictions */
    struct observed *seen; /* [tests] */
    double *ratios;        /* [tests][bootstraps] x* */
    double *farthest;      /* [points][bootstraps] */
};

struct sample {
    uint32_t *drawn;              /* [BLOCK][n] */
    uint32_t *chosen;             /* [n] of these: the sample that is looked at */
    double *picked, *x, *scratch; /* [rows][n] */
    double *counts, *data;        /* [BLOCK][points][n] and [..][P] */
    double *all, *left;           /* [BLOCK][P] squares of S E Y, and those that H leaves */
};

static size_t most_rows(const struct regress_run *run)
{
    size_t most = run->design->columns + 1;

    for (size_t t = 0; t < run->design->tests; t++) {
        most = run->models[t].basis.count > most ? run->models[t].basis.count : most;
    }
    return most;
}

/* ---- Before ---------------------------------------------------------------------------------- */

static void fill_matrices(struct drawing *d, double *scratch)
{
    const struct regress_run *run = d->run;
    const struct regress_basis *basis = &run->fit.basis;
    int n = (int)run->n;

    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, n, n, (int)basis->count, 1.0,
                basis->vectors, n, basis->vectors, n, 0.0, d->projected, n);
    for (size_t i = 0; i < run->n; i++) {
        double left = 1.0 - d->projected[i * run->n + i];
        double scale = left > CERTAIN ? 1.0 / sqrt(left) : 0.0;

        for (size_t j = 0; j < run->n; j++) {
            d->e[i * run->n + j] = scale * ((i == j ? 1.0 : 0.0) - d->projected[i * run->n + j]);
        }
    }
    for (size_t j = 0; j < run->n; j++) {
        double mean = 0.0;

        for (size_t i = 0; i < run->n; i++) {
            mean += d->e[i * run->n + j] / (double)run->n;
        }
        for (size_t i = 0; i < run->n; i++) {
            d->e[i * run->n + j] -= mean;
        }
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1.0, d->e, n, run->gram, n, 0.0,
                scratch, n);
    for (size_t i = 0; i < run->n; i++) {
        d->own[i] = cblas_ddot(n, scratch + i * run->n, 1, d->e + i * run->n, 1);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1.0, scratch, n, d->projected,
                n, 0.0, d->cross, n);
    d->fitted = regress_quadratic(run, basis->count, basis->vectors, scratch);
}

static void fill_residuals(struct drawing *d)
{
    const struct regress_run *run = d->run;
    size_t points = run->points;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)run->n, (int)points, (int)run->n,
                1.0, d->e, (int)run->n, run->along, (int)points, 0.0, d->residuals, (int)points);
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

static void observe(struct drawing *d, double *scratch)
{
    const struct regress_run *run = d->run;
    size_t n = run->n;

    for (size_t t = 0; t < run->design->tests; t++) {
        const struct regress_model *model = &run->models[t];
        const double *basis = model->basis.vectors;
        struct observed *seen = &d->seen[t];
        double beside = regress_quadratic(run, model->reduced - 1, basis + n, scratch);
        double ratio;

        seen->inside = regress_quadratic(run, model->tested, basis + model->reduced * n, scratch);
        seen->left = fmax(run->total - beside - seen->inside, 0.0);
        seen->freedom = (double)regress_model_freedom(model);
        seen->columns = (double)model->tested;
        ratio = seen->left > 0.0 ? seen->freedom * seen->inside / seen->left : (double)INFINITY;
        seen->kept = ratio < RATIO_MAX ? sqrt(fmax(1.0 - seen->columns / ratio, 0.0)) : 1.0;
    }
}

static int open_drawing(struct drawing *d)
{
    struct regress_run *run = d->run;
    size_t n = run->n;
    size_t tests = run->design->tests;
    size_t points = run->design->points;
    size_t rows = most_rows(run) > n ? most_rows(run) : n;
    double *scratch = srnf_alloc(rows, n * sizeof(double));

    d->e = srnf_alloc(n, n * sizeof(double));
    d->projected = srnf_alloc(n, n * sizeof(double));
    d->cross = srnf_alloc(n, n * sizeof(double));
    d->own = srnf_alloc(n, sizeof(double));
    d->residuals = srnf_alloc(n, run->points * sizeof(double));
    d->squares = srnf_alloc(n, run->points * sizeof(double));
    d->deviation = srnf_alloc(run->points, sizeof(double));
    d->weights = srnf_alloc(points + 1, n * sizeof(double));
    d->seen = srnf_alloc(tests + 1, sizeof *d->seen);
    d->ratios = srnf_alloc(tests + 1, run->bootstraps * sizeof(double));
    d->farthest = srnf_alloc(points + 1, run->bootstraps * sizeof(double));
    if (!scratch || !d->e || !d->projected || !d->cross || !d->own || !d->residuals ||
        !d->squares || !d->deviation || !d->weights || !d->seen || !d->ratios || !d->farthest) {
        srnf_free(scratch);
        return SRNF_ENOMEM;
    }
    fill_matrices(d, scratch);
    fill_residuals(d);
    observe(d, scratch);
    srnf_free(scratch);
    return SRNF_OK;
}

static void close_drawing(struct drawing *d)
{
    srnf_free(d->e);
    srnf_free(d->projected);
    srnf_free(d->cross);
    srnf_free(d->own);
    srnf_free(d->residuals);
    srnf_free(d->squares);
    srnf_free(d->deviation);
    srnf_free(d->weights);
    srnf_free(d->seen);
    srnf_free(d->ratios);
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

/* The sum of squares that `count` vectors u explain of fitted H Y + S E Y: M'GM with
   M = fitted H u + E'S'u. */
static double explained(const struct drawing *d, const struct sample *s, size_t count,
                        const double *u, double fitted)
{
    const struct regress_run *run = d->run;
    int n = (int)run->n;

    if (count == 0) {
        return 0.0;
    }
    for (size_t r = 0; r < count; r++) {
        pick(run->n, s->chosen, u + r * run->n, s->picked + r * run->n);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, n, n, 1.0, s->picked, n,
                d->e, n, 0.0, s->x, n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, n, n, fitted, u, n,
                d->projected, n, 1.0, s->x, n);
    return regress_quadratic(run, count, s->x, s->scratch);
}

static void draw_ratios(struct drawing *d, const struct sample *s, size_t number)
{
    const struct regress_run *run = d->run;
    size_t n = run->n;
    double total = d->fitted;

    for (size_t i = 0; i < n; i++) {
        total += 2.0 * d->cross[s->chosen[i] * n + i] + d->own[s->chosen[i]];
    }
    total -= explained(d, s, 1, run->fit.basis.vectors, 1.0); /* about the mean */
    for (size_t t = 0; t < run->design->tests; t++) {
        const struct regress_model *model = &run->models[t];
        const double *basis = model->basis.vectors, *tested = basis + model->reduced * n;
        const struct observed *seen = &d->seen[t];
        double inside = explained(d, s, model->tested, tested, 1.0);
        double noise = explained(d, s, model->tested, tested, 0.0);
        double mixed = inside - noise - seen->inside;
        double left = total - inside - explained(d, s, model->reduced - 1, basis + n, 1.0);

        inside = seen->kept * (seen->kept * seen->inside + mixed) + noise;
        inside = inside > 0.0 ? inside : 0.0;
        d->ratios[t * run->bootstraps + number] =
            left > inside / RATIO_MAX ? seen->freedom * inside / left : seen->freedom * RATIO_MAX;
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
        s->scratch[i] = 1.0;
    }
    for (size_t k = 0; k < count; k++) {
        pick(n, s->drawn + k * n, s->scratch, s->counts + k * n);
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

    if (at == 0) {
        return;
    }
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
    size_t rows = most_rows(run);
    size_t at = run->design->points;

    *s = (struct sample){0};
    s->drawn = s->chosen = srnf_alloc(BLOCK, n * sizeof *s->drawn);
    s->picked = srnf_alloc(rows, n * sizeof(double));
    s->x = srnf_alloc(rows, n * sizeof(double));
    s->scratch = srnf_alloc(rows, n * sizeof(double));
    s->counts = srnf_alloc(BLOCK * at + 1, n * sizeof(double));
    s->data = srnf_alloc(BLOCK * at + 1, run->points * sizeof(double));
    s->all = srnf_alloc(at ? BLOCK : 1, run->points * sizeof(double));
    s->left = srnf_alloc(at ? BLOCK : 1, run->points * sizeof(double));
    return s->drawn && s->picked && s->x && s->scratch && s->counts && s->data && s->all && s->left
               ? SRNF_OK
               : SRNF_ENOMEM;
}

static void close_sample(struct sample *s)
{
    srnf_free(s->drawn);
    srnf_free(s->picked);
    srnf_free(s->x);
    srnf_free(s->scratch);
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
    for (size_t k = 0; k < count && status == SRNF_OK; k++) {
        s.chosen = s.drawn + k * run->n;
        for (size_t i = 0; i < run->n; i++) {
            s.chosen[i] = stats_below(run->seed, NUMBER + first + k, (uint32_t)i, (uint32_t)run->n);
        }
        draw_ratios(d, &s, first + k);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    if (status == SRNF_OK) {
        draw_deviations(d, &s, first, count);
    }
    close_sample(&s);
    return status;
}

/* ---- From samples to intervals --------------------------------------------------------------- */

/* Of sorted values, between neighbours. */
static double quantile(size_t n, const double *sorted, double part)
{
    double at = part * (double)(n - 1);
    size_t below = (size_t)at;
    size_t above = below + 1 < n ? below + 1 : below;

    return sorted[below] + (at - (double)below) * (sorted[above] - sorted[below]);
}

/* rest: what t is beside, for the whole. */
static void set_interval(struct srnf_share *share, const double bounds[2], double rest)
{
    for (size_t k = 0; k < 2; k++) {
        share->interval[k] = bounds[k] < RATIO_MAX * rest ? bounds[k] / (bounds[k] + rest) : 1.0;
    }
    share->interval[0] = fmin(share->interval[0], share->value);
    share->interval[1] = fmax(share->interval[1], share->value);
}

static void bound_shares(const struct drawing *d, size_t t)
{
    const struct observed *seen = &d->seen[t];
    struct srnf_regression_test *out = &d->run->out->test_of[t];
    size_t n = d->run->bootstraps;
    double *ratios = d->ratios + t * n;
    double half = 0.5 * (1.0 - LEVEL), bounds[2], ratio, mean, all;

    /* Nothing is left: no noise, of which nothing is known. */
    if (!(RATIO_MAX * seen->left > d->run->total)) {
        out->r2.interval[0] = out->r2.interval[1] = NAN;
        out->part.interval[0] = out->part.interval[1] = NAN;
        return;
    }
    stats_sort(n, ratios);
    ratio = seen->freedom * seen->inside / seen->left;
    mean = seen->kept * seen->kept * ratio + seen->columns;
    for (size_t k = 0; k < 2; k++) {
        double at = quantile(n, ratios, k == 0 ? 1.0 - half : half);
        double whole = at > mean / RATIO_MAX ? ratio * mean / at : RATIO_MAX * mean;

        bounds[k] = fmax(whole - seen->columns, 0.0);
    }
    all = seen->freedom * d->run->total / seen->left;
    set_interval(&out->part, bounds, seen->columns + seen->freedom);
    set_interval(&out->r2, bounds, all - fmax(ratio - seen->columns, 0.0));
}

static void conclude(struct drawing *d)
{
    struct regress_run *run = d->run;
    size_t n = run->bootstraps;

    for (size_t t = 0; t < run->design->tests; t++) {
        bound_shares(d, t);
    }
    for (size_t k = 0; k < run->design->points; k++) {
        struct srnf_predicted_shape *to = &run->out->predicted[k];
        double norm = cblas_dnrm2((int)run->n, d->weights + k * run->n, 1);
        double *farthest = d->farthest + k * n;
        double reach;

        stats_sort(n, farthest);
        reach = quantile(n, farthest, LEVEL);
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
    int status = open_drawing(&d);

    status = status ? status
                    : stats_run(run->context, (run->bootstraps + BLOCK - 1) / BLOCK, draw_block, &d,
                                progress, error);
    if (status == SRNF_OK) {
        conclude(&d);
    }
    close_drawing(&d);
    return status;
}
