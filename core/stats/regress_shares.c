/*
 * regress_shares.c - how far the shares of the variance are known.
 *
 * Subjects need not scatter alike, as where one group is more varied than another. So in the
 * samples each keeps its own residual, and only its sign and a little of its length are drawn (the
 * wild bootstrap: C. Wu 1986; A. Davison, D. Hinkley, "Bootstrap methods and their application",
 * 1997, 6.2.4): with H the projection on the whole design and h_i its diagonal,
 *
 *     Y* = H Y + diag(v) S E Y,     E = diag(1 - h_i)^(-1/2) (1 - H),
 *
 * in which the division gives residuals the variance of the errors. S takes the row of subject i
 * itself but for a chance of h_i, by which it takes that of any: the design fixes so much of its
 * value, and leaves it no residual of its own. v_i = +-(1 +- c)^(1/2), all four alike; c^2 = 2 / (D
 * + 2) makes squares of residuals as variable as those of normal noise of D equal directions, D
 * from the products of different subjects, which tell it whatever their scatter.
 *
 * T are the columns of a term, orthonormal, and SS = |T'Y|^2 what it explains. Noise adds to that
 *
 *     V = sum of T_ii (|r_i|^2 + h_i s^2),     T_ii the diagonal of T T', r = (1 - H) Y, s^2 the
 *                                              mean square of r by its degrees of freedom,
 *
 * in which the second part is as above. An interval is one of x = SS / V, whose mean is near t + 1,
 * t V the squares that are no noise. So fitted values of a term enter Y* multiplied by k, with
 * k^2 x = max(x - 1, 0), the estimate of t; x* = SS* / V* over its mean k^2 x + 1 is then spread as
 * x over t + 1 (Davison and Hinkley, 5.2), and quantiles of x* give bounds of t. Without an effect
 * Y* is noise, and the lower one is above 0 where a test at 2.5 % would reject. Shares follow: t V
 * over t V + V + SS_rest of what the others leave, and of all with what the others explain. As
 * estimates that lie beyond would only puzzle, intervals are extended to hold the estimate. They
 * are of these values of the covariates, not of such as another sample would have.
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define BLOCK ((size_t)16)
#define LEVEL 0.95
#define RATIO_MAX 1e12 /* of squares that are explained over their noise: rounding leaves more */
#define ALIKE_MIN 1e-3 /* 1 / D: as of a thousand equal directions */
#define CHANCES (UINT32_C(1) << 30)

/* What a test finds in Y. */
struct observed {
    double inside, left; /* squares that the term explains, and that its model leaves */
    double noise;        /* V */
    double kept;         /* k: of its fitted values */
    double fixed;        /* sum of T_ii h_i */
    double *weights;     /* [n] T_ii, of the result */
    double *crossed;     /* [tested][n] products of the tested with E Y */
};

struct drawing {
    struct regress_run *run;
    double *rest;     /* [n] 1 - h_i, of the result; 0: the design fixes it */
    double *products; /* [n][n] of the rows of E Y */
    uint32_t *others; /* [count] subjects that the design does not fix */
    uint32_t count;
    double lengths[2];     /* of v */
    struct observed *seen; /* [tests] */
    double *ratios;        /* [tests][bootstraps] x* */
};

struct sample {
    double *factors;         /* [n] v */
    uint32_t *source;        /* [n] S */
    double *rows, *products; /* [rows][n] S'diag(v) of vectors, and their products with E Y */
    double *squares;         /* [n] |r*_i|^2 */
    double *inner;           /* [rows][rows] */
};

static size_t most_rows(const struct regress_run *run)
{
    size_t most = run->fit.basis.count;

    for (size_t t = 0; t < run->design->tests; t++) {
        most = run->models[t].tested > most ? run->models[t].tested : most;
    }
    return most;
}

/* ---- Before ---------------------------------------------------------------------------------- */

static void fill_products(const struct drawing *d, const double *e, double *scratch)
{
    int n = (int)d->run->n;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1.0, e, n, d->run->gram, n, 0.0,
                scratch, n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, n, n, n, 1.0, scratch, n, e, n, 0.0,
                d->products, n);
}

/* 1 / D: squares of the products of two subjects over those of their lengths. Residuals are not
   independent: what their correlation adds to the former is taken off. */
static double alike(const struct drawing *d)
{
    const struct regress_basis *basis = &d->run->fit.basis;
    size_t n = d->run->n;
    double squares = 0.0, lengths = 0.0;

    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            double h = cblas_ddot((int)basis->count, basis->vectors + i, (int)n, basis->vectors + j,
                                  (int)n);
            double both = d->products[i * n + i] * d->products[j * n + j];
            double product = d->products[i * n + j];

            if (d->rest[i] > 0.0 && d->rest[j] > 0.0) {
                double correlated = h * h / (d->rest[i] * d->rest[j]);

                squares += product * product - correlated * both;
                lengths += (1.0 + correlated) * both;
            }
        }
    }
    return lengths > 0.0 ? fmin(fmax(squares / lengths, ALIKE_MIN), 1.0) : 1.0;
}

/* V of squares |r_i|^2. */
static double noise_of(const struct drawing *d, const struct observed *seen, const double *squares)
{
    size_t n = d->run->n;
    double all = 0.0;

    for (size_t i = 0; i < n; i++) {
        all += squares[i];
    }
    return cblas_ddot((int)n, seen->weights, 1, squares, 1) +
           seen->fixed * all / (double)d->run->out->freedom;
}

static int observe(struct drawing *d, size_t t, const double *e, const double *squares,
                   double *scratch)
{
    const struct regress_run *run = d->run;
    const struct regress_model *model = &run->models[t];
    size_t n = run->n;
    const double *basis = model->basis.vectors;
    const double *tested = basis + model->reduced * n;
    struct observed *seen = &d->seen[t];
    double beside = regress_quadratic(run, model->reduced - 1, basis + n, scratch);

    seen->weights = run->out->test_of[t].diagonal = srnf_alloc(n, sizeof(double));
    seen->crossed = srnf_alloc(model->tested, n * sizeof(double));
    if (!seen->weights || !seen->crossed) {
        return SRNF_ENOMEM;
    }
    seen->inside = regress_quadratic(run, model->tested, tested, scratch);
    seen->left = fmax(run->total - beside - seen->inside, 0.0);
    for (size_t k = 0; k < model->tested * n; k++) {
        size_t i = k % n;
        double square = tested[k] * tested[k];

        seen->fixed += square * (1.0 - d->rest[i]);
        seen->weights[i] += square;
    }
    seen->noise = noise_of(d, seen, squares);
    seen->kept = seen->inside > seen->noise ? sqrt(1.0 - seen->noise / seen->inside) : 0.0;
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)model->tested, (int)n, (int)n, 1.0,
                tested, (int)n, run->gram, (int)n, 0.0, scratch, (int)n);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)model->tested, (int)n, (int)n, 1.0,
                scratch, (int)n, e, (int)n, 0.0, seen->crossed, (int)n);
    return SRNF_OK;
}

static int open_drawing(struct drawing *d)
{
    struct regress_run *run = d->run;
    size_t n = run->n;
    size_t tests = run->design->tests;
    size_t rows = run->design->columns + 1 > n ? run->design->columns + 1 : n;
    double *scratch = srnf_alloc(rows, n * sizeof(double));
    double *e = srnf_alloc(n, n * sizeof(double));
    double *squares = run->out->squares = srnf_alloc(n, sizeof(double));
    int status = SRNF_ENOMEM;

    d->rest = run->out->rest = srnf_alloc(n, sizeof(double));
    d->others = srnf_alloc(n, sizeof *d->others);
    d->products = srnf_alloc(n, n * sizeof(double));
    d->seen = srnf_alloc(tests + 1, sizeof *d->seen);
    d->ratios = srnf_alloc(tests + 1, run->bootstraps * sizeof(double));
    if (scratch && e && squares && d->rest && d->others && d->products && d->seen && d->ratios) {
        double squared, longer;

        regress_standardize(run, e, d->rest);
        fill_products(d, e, scratch);
        for (size_t i = 0; i < n; i++) {
            squares[i] = d->rest[i] * d->products[i * n + i];
            if (d->rest[i] > 0.0) {
                d->others[d->count++] = (uint32_t)i;
            }
        }
        squared = alike(d);
        longer = sqrt(2.0 * squared / (1.0 + 2.0 * squared));
        d->lengths[0] = sqrt(1.0 - longer);
        d->lengths[1] = sqrt(1.0 + longer);
        status = SRNF_OK;
    }
    for (size_t t = 0; t < tests && status == SRNF_OK; t++) {
        status = observe(d, t, e, squares, scratch);
    }
    srnf_free(scratch);
    srnf_free(e);
    return status;
}

static void close_drawing(struct drawing *d)
{
    for (size_t t = 0; d->seen && t < d->run->design->tests; t++) {
        srnf_free(d->seen[t].crossed);
    }
    srnf_free(d->others);
    srnf_free(d->products);
    srnf_free(d->seen);
    srnf_free(d->ratios);
}

/* ---- One sample ------------------------------------------------------------------------------ */

/* S'diag(v) of the rows u, and the products of that with E Y. */
static void multiply(const struct drawing *d, const struct sample *s, size_t count, const double *u)
{
    size_t n = d->run->n;

    memset(s->rows, 0, count * n * sizeof(double));
    for (size_t k = 0; k < count * n; k++) {
        s->rows[k / n * n + s->source[k % n]] += u[k] * s->factors[k % n];
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)n, (int)n, 1.0, s->rows,
                (int)n, d->products, (int)n, 0.0, s->products, (int)n);
}

/* |r*_i|^2, r* = (1 - H) diag(v) S E Y. */
static void find_squares(const struct drawing *d, const struct sample *s)
{
    const struct regress_basis *basis = &d->run->fit.basis;
    size_t n = d->run->n, count = basis->count;

    multiply(d, s, count, basis->vectors);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, (int)count, (int)n, 1.0,
                s->products, (int)n, s->rows, (int)n, 0.0, s->inner, (int)count);
    for (size_t i = 0; i < n; i++) {
        double v = s->factors[i];
        size_t own = s->source[i];
        double square = v * v * d->products[own * n + own];

        for (size_t k = 0; k < count; k++) {
            double inside =
                cblas_ddot((int)count, s->inner + k * count, 1, basis->vectors + i, (int)n);

            square += basis->vectors[k * n + i] * (inside - 2.0 * v * s->products[k * n + own]);
        }
        s->squares[i] = fmax(square, 0.0);
    }
}

static void draw_ratios(struct drawing *d, const struct sample *s, size_t number)
{
    const struct regress_run *run = d->run;
    size_t n = run->n;

    find_squares(d, s);
    for (size_t t = 0; t < run->design->tests; t++) {
        const struct regress_model *model = &run->models[t];
        const struct observed *seen = &d->seen[t];
        int size = (int)(model->tested * n);
        double noise = noise_of(d, seen, s->squares), inside;

        multiply(d, s, model->tested, model->basis.vectors + model->reduced * n);
        inside = seen->kept * (seen->kept * seen->inside +
                               2.0 * cblas_ddot(size, s->rows, 1, seen->crossed, 1)) +
                 cblas_ddot(size, s->rows, 1, s->products, 1);
        inside = fmax(inside, 0.0);
        d->ratios[t * run->bootstraps + number] =
            noise > inside / RATIO_MAX ? inside / noise : RATIO_MAX;
    }
}

static int open_sample(struct sample *s, const struct regress_run *run)
{
    size_t n = run->n;
    size_t rows = most_rows(run);

    *s = (struct sample){0};
    s->factors = srnf_alloc(n, sizeof(double));
    s->source = srnf_alloc(n, sizeof *s->source);
    s->rows = srnf_alloc(rows, n * sizeof(double));
    s->products = srnf_alloc(rows, n * sizeof(double));
    s->squares = srnf_alloc(n, sizeof(double));
    s->inner = srnf_alloc(rows, rows * sizeof(double));
    return s->factors && s->source && s->rows && s->products && s->squares && s->inner
               ? SRNF_OK
               : SRNF_ENOMEM;
}

static void close_sample(struct sample *s)
{
    srnf_free(s->factors);
    srnf_free(s->source);
    srnf_free(s->rows);
    srnf_free(s->products);
    srnf_free(s->squares);
    srnf_free(s->inner);
}

/* S and v. A subject without residual of its own takes that of one that has some. */
static void draw(const struct drawing *d, const struct sample *s, uint64_t number)
{
    const struct regress_run *run = d->run;
    uint32_t n = (uint32_t)run->n;

    for (uint32_t i = 0; i < n; i++) {
        uint32_t sign = stats_below(run->seed, number, 3 * i, 4);
        double own = stats_below(run->seed, number, 3 * i + 1, CHANCES) / (double)CHANCES;

        s->source[i] =
            own < d->rest[i] ? i : d->others[stats_below(run->seed, number, 3 * i + 2, d->count)];
        s->factors[i] = (sign & 1u ? -1.0 : 1.0) * d->lengths[sign >> 1];
    }
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
        draw(d, &s, REGRESS_DRAWN + first + k);
        draw_ratios(d, &s, first + k);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    close_sample(&s);
    return status;
}

/* ---- From samples to intervals --------------------------------------------------------------- */

/* squares: bounds of those that are no noise; rest: what they are beside, for the whole. */
static void set_interval(struct srnf_share *share, const double squares[2], double rest)
{
    for (size_t k = 0; k < 2; k++) {
        share->interval[k] = squares[k] < RATIO_MAX * rest ? squares[k] / (squares[k] + rest) : 1.0;
    }
    share->interval[0] = fmin(share->interval[0], share->value);
    share->interval[1] = fmax(share->interval[1], share->value);
}

static void bound(const struct drawing *d, size_t t)
{
    const struct observed *seen = &d->seen[t];
    struct srnf_regression_test *out = &d->run->out->test_of[t];
    size_t n = d->run->bootstraps;
    double *ratios = d->ratios + t * n;
    double half = 0.5 * (1.0 - LEVEL), squares[2], ratio, mean;

    /* Nothing is left: no noise, of which nothing is known. */
    if (!(RATIO_MAX * fmin(seen->left, seen->noise) > d->run->total)) {
        out->r2.interval[0] = out->r2.interval[1] = NAN;
        out->part.interval[0] = out->part.interval[1] = NAN;
        return;
    }
    stats_sort(n, ratios);
    ratio = seen->inside / seen->noise;
    mean = seen->kept * seen->kept * ratio + 1.0;
    for (size_t k = 0; k < 2; k++) {
        double at = regress_quantile(n, ratios, k == 0 ? 1.0 - half : half);
        double whole = at > mean / RATIO_MAX ? ratio * mean / at : RATIO_MAX * mean;

        squares[k] = fmax(whole - 1.0, 0.0) * seen->noise;
    }
    set_interval(&out->part, squares, seen->noise + seen->left);
    set_interval(&out->r2, squares, d->run->total - fmax(seen->inside - seen->noise, 0.0));
}

int regress_shares(struct regress_run *run, struct stats_progress progress,
                   struct srnf_error *error)
{
    struct drawing d = {.run = run};
    int status = open_drawing(&d);

    status = status ? status
                    : stats_run(run->context, (run->bootstraps + BLOCK - 1) / BLOCK, draw_block, &d,
                                progress, error);
    for (size_t t = 0; t < run->design->tests && status == SRNF_OK; t++) {
        bound(&d, t);
    }
    close_drawing(&d);
    return status;
}
