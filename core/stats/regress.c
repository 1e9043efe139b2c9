/*
 * regress.c - linear models of shape: least squares of SRNFs on covariates, with tests by
 * permutation, maps, shares of the variance and predictions.
 *
 * Y, one row a subject, are the SRNFs, and X the design with its constant. B = (X'X)^(-1) X'Y is
 * found by an orthonormal basis (regress_design.c). Whether a term belongs to the model is asked by
 * comparing two nested models, U for the smaller and T for what the larger has beside it, both
 * orthonormal, T orthogonal to U. Under the null hypothesis the residuals of the smaller model can
 * be exchanged (D. Freedman, D. Lane, "A nonstochastic interpretation of reported significance
 * levels", 1983): for a permutation P of the subjects
 *
 *     Y_P = U U'Y + P R Y,    R = 1 - U U',
 *     F = (|T'Y_P|^2 / d) / (|R_T Y_P|^2 / f),    R_T = R - T T', d columns of T, f = n - rank,
 *
 * the F of distances (M. Anderson, "A new method for non-parametric multivariate analysis of
 * variance", 2001; M. Collyer, D. Sekora, D. Adams for shapes, 2015): norms are those of L2, and
 * only the Gram matrix of the SRNFs is needed. At each node of the grid the data are the
 * displacements of the subjects' surfaces, and the statistic is Hotelling and Lawley's trace of
 * H E^(-1), which for d = 1 is the T^2 of compare.c; from there are also the corrections for all
 * points by the largest statistic and by false discovery rate, and the count of permutations. Where
 * subjects are few all relabellings are taken, each once.
 *
 * Shares of the variance are |T'Y|^2 of the whole, tr(Y'Y) about the mean, and of what the smaller
 * model leaves; their intervals are in regress_shares.c.
 *
 * Members of a subject are averaged with their rows of the design (compare.c says why).
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define PERMUTATIONS 10000
#define BOOTSTRAPS 1000
#define N_MAX ((size_t)10000)
#define COLUMNS_MAX ((size_t)10000)
#define ROUNDING 1e-13 /* of all SRNFs together: surfaces that are the same */
/* Where the parts of a run end in its progress. */
#define PROGRESS_EMBED 0.2
#define PROGRESS_EFFECTS 0.25
#define PROGRESS_PERMUTE 0.9
#define PROGRESS_SHARES 0.95

struct srnf_regress_options srnf_regress_options_defaults(void)
{
    return (struct srnf_regress_options){.permutations = PERMUTATIONS, .bootstraps = BOOTSTRAPS};
}

void srnf_regression_clear(struct srnf_regression *r)
{
    for (size_t t = 0; r->test_of && t < r->tests; t++) {
        srnf_free(r->test_of[t].statistic);
        srnf_free(r->test_of[t].p);
        srnf_free(r->test_of[t].significance);
        srnf_free(r->test_of[t].fdr);
        srnf_free(r->test_of[t].diagonal);
    }
    for (size_t k = 0; r->predicted && k < r->points; k++) {
        srnf_free(r->predicted[k].coefficients);
        srnf_free(r->predicted[k].standard_error);
        srnf_free(r->predicted[k].confidence);
    }
    srnf_free(r->test_of);
    srnf_free(r->predicted);
    srnf_free(r->coefficients);
    srnf_free(r->norms);
    srnf_free(r->norm_intervals);
    srnf_free(r->effect);
    srnf_free(r->normal);
    srnf_free(r->standard_error);
    srnf_free(r->squares);
    srnf_free(r->rest);
    *r = (struct srnf_regression){0};
}

static int check(size_t n, const struct srnf_regress_design *design,
                 const struct srnf_regress_options *options, struct srnf_error *error)
{
    int status;

    if (n < 4 || n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces; 4 to %zu are needed", n, N_MAX);
    }
    if (design->columns > COLUMNS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu columns; at most %zu are taken",
                         design->columns, COLUMNS_MAX);
    }
    status = stats_check_draws(options->permutations, options->bootstraps, error);
    if (status) {
        return status;
    }
    for (size_t k = 0; k < design->points * design->columns; k++) {
        if (!isfinite(design->at[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / design->columns),
                             "point %zu of the predictions is not finite", k / design->columns);
        }
    }
    return SRNF_OK;
}

/* ---- Data ------------------------------------------------------------------------------------ */

/* Takes the mean over subjects, or what is along the lead, out of data, double[n][m]. */
static void center(const struct regress_run *run, size_t m, double *data)
{
    size_t n = run->n;
    double square = run->lead ? cblas_ddot((int)n, run->lead, 1, run->lead, 1) : (double)n;

    for (size_t k = 0; k < m; k++) {
        double mean = 0.0;

        for (size_t i = 0; i < n; i++) {
            mean += data[i * m + k] * (run->lead ? run->lead[i] : 1.0) / square;
        }
        for (size_t i = 0; i < n; i++) {
            data[i * m + k] -= run->lead ? mean * run->lead[i] : mean;
        }
    }
}

static int fill_gram(struct regress_run *run, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    double *y = srnf_alloc(run->n, size * sizeof(double));
    double all;
    int status;

    if (!y) {
        return SRNF_ENOMEM;
    }
    stats_weight(srnf_sht_grid(run->sht), run->n, run->q, NULL, y);
    all = cblas_dnrm2((int)(run->n * size), y, 1);
    center(run, size, y);
    status = stats_gram(run->n, size, y, run->gram, error);
    for (size_t i = 0; i < run->n; i++) {
        run->total += run->gram[i * run->n + i];
    }
    if (!(run->total > ROUNDING * all * ROUNDING * all)) {
        run->total = 0.0;
        memset(run->gram, 0, run->n * run->n * sizeof(double));
    }
    srnf_free(y);
    return status;
}

static int open_run(struct regress_run *run)
{
    size_t size;
    size_t n = run->n;
    struct srnf_regression *out = run->out;

    if (__builtin_mul_overflow(n, 3 * run->points, &size)) {
        return SRNF_ENOMEM;
    }
    out->tests = run->design->tests;
    out->points = run->design->points;
    out->columns = run->design->columns;
    run->models = srnf_alloc(out->tests + 1, sizeof *run->models);
    out->test_of = srnf_alloc(out->tests + 1, sizeof *out->test_of);
    out->predicted = srnf_alloc(out->points + 1, sizeof *out->predicted);
    run->gram = srnf_alloc(n, n * sizeof(double));
    if (!run->embedded) {
        run->vectors = srnf_alloc(size, sizeof(double));
    }
    return run->models && out->test_of && out->predicted && run->gram && run->vectors ? SRNF_OK
                                                                                      : SRNF_ENOMEM;
}

void regress_close(struct regress_run *run)
{
    for (size_t t = 0; run->models && t < run->design->tests; t++) {
        regress_model_clear(&run->models[t]);
    }
    regress_fit_clear(&run->fit);
    exchange_clear(&run->exchange);
    stats_embedding_clear(&run->embedding);
    srnf_free(run->models);
    srnf_free(run->gram);
    srnf_free(run->vectors);
    srnf_free(run->along);
}

/* Subjects with one row of the design, and one weight, are one kind, that exchange to no effect. */
static int open_exchange(struct regress_run *run)
{
    size_t columns = run->design->columns;
    size_t *kind = srnf_alloc(run->n, sizeof *kind);
    int *one_group = srnf_alloc(run->n, sizeof *one_group);
    double *rows = srnf_alloc(run->n, (columns + 1) * sizeof(double));
    const struct compare_averages given = {.n = run->n, .covariates = rows, .group = one_group};
    int status = SRNF_ENOMEM;

    if (kind && one_group && rows) {
        size_t kinds;

        for (size_t k = 0; k < run->n * (columns + 1); k++) {
            size_t i = k / (columns + 1);
            size_t c = k % (columns + 1);

            rows[k] = c < columns ? run->values[i * columns + c] : run->lead ? run->lead[i] : 1.0;
        }
        kinds = compare_kinds(&given, columns + 1, kind);
        status = exchange_open(&run->exchange, run->n, kind, kinds, run->permutations, 1.0);
    }
    srnf_free(kind);
    srnf_free(one_group);
    srnf_free(rows);
    run->permutations = run->exchange.test.permutations;
    run->out->test = run->exchange.test;
    return status;
}

static int open_models(struct regress_run *run, const struct srnf_nested *nested,
                       struct srnf_error *error)
{
    int status = SRNF_OK;

    for (size_t t = 0; t < run->design->tests && status == SRNF_OK; t++) {
        status = regress_model_create(&run->models[t], run->n, run->lead, &nested[t], t, error);
    }
    return status;
}

/* ---- The run --------------------------------------------------------------------------------- */

static int fit_all(struct regress_run *run, const double *mean, struct srnf_error *error)
{
    struct srnf_regression *out = run->out;
    size_t tests = run->design->tests;
    int status = fill_gram(run, error);

    status = status ? status : stats_embedding_create(run->sht, mean, &run->embedding);
    if (status == SRNF_OK && !run->embedded) {
        status = stats_embed_fields(
            &run->embedding, mean, run->near, run->n, run->q, run->context,
            (struct stats_progress){0.0, PROGRESS_EMBED, "inverting the subjects"}, run->vectors,
            error);
    }
    if (status == SRNF_OK) {
        double *scratch = srnf_alloc(run->fit.basis.count, run->n * sizeof(double));

        center(run, 3 * run->points, run->vectors);
        if (!(run->total > 0.0)) {
            memset(run->vectors, 0, run->n * 3 * run->points * sizeof(double));
        }
        out->freedom = run->n - run->fit.basis.count;
        out->variance = run->total / (double)(run->n - 1);
        if (scratch) {
            double fitted =
                regress_quadratic(run, run->fit.basis.count, run->fit.basis.vectors, scratch);

            out->residual_variance = fmax(run->total - fitted, 0.0) / (double)out->freedom;
        }
        status = scratch ? SRNF_OK : SRNF_ENOMEM;
        srnf_free(scratch);
    }
    status = status ? status
                    : regress_effects(run, mean,
                                      (struct stats_progress){PROGRESS_EMBED, PROGRESS_EFFECTS,
                                                              "predicting surfaces"},
                                      error);
    for (size_t t = 0; t < tests && status == SRNF_OK; t++) {
        double each = (PROGRESS_PERMUTE - PROGRESS_EFFECTS) / (double)tests;
        double from = PROGRESS_EFFECTS + each * (double)t;

        status = regress_permute(
            run, t, (struct stats_progress){from, from + each, "permuting residuals"}, error);
    }
    status = status ? status
                    : regress_shares(run,
                                     (struct stats_progress){PROGRESS_PERMUTE, PROGRESS_SHARES,
                                                             "drawing residuals"},
                                     error);
    return status ? status
                  : regress_bootstrap(
                        run, (struct stats_progress){PROGRESS_SHARES, 1.0, "drawing residuals"},
                        error);
}

int regress_compute(struct regress_run *run, const double *mean, const struct srnf_nested *nested,
                    struct srnf_error *error)
{
    int status =
        regress_fit_create(&run->fit, run->n, run->lead, run->design->columns, run->values, error);

    status = status ? status : open_run(run);
    status = status ? status : open_models(run, nested, error);
    status = status ? status : open_exchange(run);
    return status ? status : fit_all(run, mean, error);
}

int regress_average_nested(const struct srnf_regress_design *design,
                           const struct subjects *subjects, struct srnf_nested *nested,
                           double **memory)
{
    for (size_t t = 0; t < design->tests; t++) {
        const struct srnf_nested *given = &design->nested[t];
        size_t all = given->reduced + given->tested;
        double *values = srnf_alloc(all + 1, subjects->count * sizeof(double));
        double *tested = values ? values + given->reduced * subjects->count : NULL;

        memory[t] = values;
        if (!values) {
            return SRNF_ENOMEM;
        }
        nested[t] = (struct srnf_nested){given->reduced, given->tested, values, tested};
        for (size_t i = 0; i < subjects->n; i++) {
            size_t s = subjects->of[i];
            double members = (double)subjects->size[s];

            for (size_t j = 0; j < given->reduced; j++) {
                values[s * given->reduced + j] += given->nuisance[i * given->reduced + j] / members;
            }
            for (size_t j = 0; j < given->tested; j++) {
                tested[s * given->tested + j] += given->columns[i * given->tested + j] / members;
            }
        }
    }
    return SRNF_OK;
}

/* Members averaged over subjects. */
static int average(struct regress_run *run, const struct subjects *subjects,
                   struct compare_averages *given, struct srnf_error *error)
{
    int *one_group = srnf_alloc(subjects->n, sizeof *one_group);
    int status = one_group ? SRNF_OK : SRNF_ENOMEM;

    given->group = one_group;
    if (status == SRNF_OK && subjects->count < subjects->n) {
        status = compare_average(subjects, 3 * run->points, run->design->columns, given, error);
    }
    given->group = NULL;
    srnf_free(one_group);
    run->n = given->n;
    run->q = given->q;
    run->near = given->near;
    run->values = given->covariates;
    return status;
}

int srnf_regress(const struct srnf_sht *sht, size_t n, const double *mean,
                 const double *registered_q, const struct srnf_regress_design *design,
                 const struct srnf_regress_options *options, const struct srnf_context *context,
                 struct srnf_regression *regression, struct srnf_error *error)
{
    struct srnf_regress_options defaults = srnf_regress_options_defaults();
    struct srnf_regression found = {.n = n};
    struct srnf_error first = {0};
    struct subjects subjects = {0};
    struct srnf_nested *nested = srnf_alloc(design->tests + 1, sizeof *nested);
    double **memory = srnf_alloc(design->tests + 1, sizeof *memory);
    struct compare_averages given = {.n = n, .q = registered_q, .covariates = design->values};
    struct regress_run run = {.sht = sht,
                              .points = stats_points(srnf_sht_grid(sht)),
                              .context = context,
                              .design = design,
                              .out = &found};
    int status;

    options = options ? options : &defaults;
    run.seed = options->seed;
    run.bootstraps = options->bootstraps;
    run.permutations = options->permutations;
    given.count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    given.near = options->surfaces;
    status = check(n, design, options, &first);
    status = status ? status : subjects_open(&subjects, n, options->subjects, &first);
    status = status ? status : average(&run, &subjects, &given, &first);
    found.subjects = subjects.count;
    if (status == SRNF_OK) {
        status = nested && memory ? regress_average_nested(design, &subjects, nested, memory)
                                  : SRNF_ENOMEM;
    }
    status = status ? status : regress_compute(&run, mean, nested, &first);
    regress_close(&run);
    for (size_t t = 0; memory && t < design->tests; t++) {
        srnf_free(memory[t]);
    }
    srnf_free(memory);
    srnf_free(nested);
    subjects_clear(&subjects);
    compare_averages_clear(&given);
    if (status) {
        srnf_regression_clear(&found);
        return stats_fail(error, status, &first);
    }
    *regression = found;
    return SRNF_OK;
}
