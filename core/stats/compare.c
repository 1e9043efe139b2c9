/*
 * compare.c - whether two groups of registered surfaces differ, and where.
 *
 * Data y, with one row a subject, are made free of the nuisance (compare_design.c): Y = R y. For a
 * permutation P of the subjects the adjusted difference of the groups is b = c' Y / <g~, g~> with
 * c = P' g~; P = 1 is what was observed.
 *
 *   Globally, y are the SRNFs, and the statistic is the F of squared L2 distances (M. Anderson
 *   2001),
 *
 *       F = <g~, g~> |b|^2 freedom / e,    e = tr Y Y' - sum_u |z_u|^2 - <g~, g~> |b|^2,
 *
 *   with z_u = u' P Y for the columns u of U but the constant: e are the squares of the residuals
 *   of the whole model. Only the Gram matrix Y Y' is needed. |b| alone is the distance of the
 *   adjusted means, and would not do: of p covariates residuals are too short by p degrees of
 *   freedom, and so are permuted distances. With 16 subjects, 4 covariates and no difference a test
 *   of |b| finds one at the level .05 in a third of the studies. Without covariates both give the
 *   same p.
 *
 *   Locally, y are the displacements of the subjects' surfaces at each node of the grid, and the
 *   statistic is Hotelling's (1931)
 *
 *       T^2 = <g~, g~> b' (E / freedom)^(-1) b,    E = Y'Y - sum_u z_u z_u' - <g~, g~> b b',
 *
 *   E being the matrix of squares and products of those residuals. All b and z_u of a block of
 *   permutations are one dgemm.
 *
 * With m permutations and the observed order as one more, p = (1 + #{as large}) / (1 + m) (B.
 * Phipson, G. K. Smyth 2010). Corrected for all points: the largest T^2 over the map takes the
 * place of the point's own (T. E. Nichols, A. P. Holmes 2002): the chance of reporting any point
 * of equal groups is at most the level. False discovery rate (Y. Benjamini, Y. Hochberg 1995, with
 * weights as in their paper of 1997): points count by their area on the mean surface, as nodes
 * crowd at the poles.
 *
 * Repeated subjects (srnf/subjects.h): SRNFs and covariates of the members of a subject are
 * averaged first, and the comparison is one of subjects, each counted once. Members of a subject
 * never come apart then, neither in the statistic nor in a permutation, and a linear model of
 * members is one of their averages with the same coefficients. Under the null hypothesis the labels
 * of subjects can be exchanged whatever the numbers of their members; where one group is repeated
 * more often than the other its averages vary less, and equal means with unequal variance are not
 * the hypothesis that is tested.
 *
 * Where there are few subjects all relabellings are taken, each once (exchange.c). A permutation
 * enters by the rows of the design that the residuals meet, (group, covariates) of each: subjects
 * with the same row are one kind, and n! / prod c_k! relabellings of the rows are different. Some
 * of these still give the observed value whatever the data are: where c = +-g~ (by Cauchy and
 * Schwarz no other c is as far as g~ for data along g~) and P' leaves the span of U as it is.
 * Names of groups of one size exchanged are such a relabelling. They are counted as they come,
 * and are what the smallest possible p is made of.
 *
 * The level. Without covariates the labels can be exchanged under the null hypothesis, and P(p <=
 * a) is at most a, whether all relabellings are taken or some at random. With covariates it is not
 * so: the residuals R y of exchangeable errors are themselves not exchangeable, since R commutes
 * with all permutations only if U is the constant alone. The level of Freedman and Lane is then
 * asymptotic (M. Anderson, J. Robinson, "Permutation tests for linear models", 2001), also where
 * all relabellings are taken: that only leaves nothing to chance in p.
 *
 * "As large" leaves room for rounding: permutations that exchange subjects within a group only give
 * the observed value again. Counts are whole numbers, so that the sum over blocks does not depend
 * on which thread ran which.
 */
#include "compare.h"
#include "intervals.h"
#include "maps.h"
#include "srnf/regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define PERMUTATIONS 10000
#define PERMUTATIONS_MAX ((size_t)10000000)
#define N_MAX ((size_t)10000)
#define PROGRESS_EMBED 0.3
#define ROUNDING 1e-13 /* of all SRNFs together: surfaces that are the same */

struct srnf_compare_options srnf_compare_options_defaults(void)
{
    return (struct srnf_compare_options){.permutations = PERMUTATIONS};
}

/* ---- What was observed ----------------------------------------------------------------------- */

/* The mean displacement, its length and its part along the normal of the mean surface. */
static int describe(const struct compare_run *run, const double *mean, const double *rows)
{
    size_t points = run->points;
    double *q = srnf_alloc(3 * points, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(run->sht));
    int status = q && workspace ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_field(run->sht, mean, q, workspace);
    }
    for (size_t p = 0; p < points && status == SRNF_OK; p++) {
        double root = run->embedding.root[p];
        double square = 0.0;
        double along = 0.0;
        double length = 0.0;

        for (size_t c = 0; c < 3 && root > 0.0; c++) {
            double b = rows[c * points + p] / run->design.squared / root;
            double normal = q[c * points + p];

            square += b * b;
            along += b * normal;
            length += normal * normal;
        }
        run->out->effect[p] = sqrt(square);
        run->out->normal[p] = length > 0.0 ? along / sqrt(length) : 0.0;
    }
    srnf_free(q);
    srnf_free(workspace);
    return status;
}

/* The model of the distance is that of the comparison: U, and the contrast. */
static int find_interval(const struct compare_run *run)
{
    const struct compare_design *design = &run->design;
    size_t n = run->n;
    size_t count = design->nuisance + 1;
    struct intervals intervals = {0};
    double *basis = srnf_alloc(count + 2, n * sizeof(double));
    double *weights = basis ? basis + count * n : NULL;
    double *along = basis ? weights + n : NULL;
    int status = SRNF_ENOMEM;

    if (basis) {
        memcpy(basis, design->basis, design->nuisance * n * sizeof(double));
        for (size_t i = 0; i < n; i++) {
            basis[design->nuisance * n + i] = design->contrast[i] / sqrt(design->squared);
            weights[i] = design->contrast[i] / design->squared;
        }
        cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)n, 1.0, run->gram, (int)n, weights, 1,
                    0.0, along, 1);
        status = intervals_open(&intervals, n, count, basis, run->gram);
    }
    if (status == SRNF_OK) {
        intervals_norm(&intervals, weights, along, run->out->distance * run->out->distance,
                       run->out->distance_interval);
    }
    intervals_close(&intervals);
    srnf_free(basis);
    return status;
}

/* Residuals e of the whole model have 1 - h degrees of freedom each. */
static int find_spreads(const struct compare_run *run)
{
    const struct compare_design *design = &run->design;
    size_t n = run->n;
    double square = run->out->distance * run->out->distance;
    double *squares = srnf_alloc(3, n * sizeof(double));
    size_t *group = srnf_alloc(n, sizeof *group);
    int status = squares && group ? SRNF_OK : SRNF_ENOMEM;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        double c = design->contrast[i], rest = 1.0 - c * c / design->squared;
        double along = cblas_ddot((int)n, run->gram + i * n, 1, design->contrast, 1);

        for (size_t u = 0; u < design->nuisance; u++) {
            rest -= design->basis[u * n + i] * design->basis[u * n + i];
        }
        group[i] = (size_t)run->group[i];
        squares[i] = run->gram[i * n + i] - 2.0 * c * along / design->squared + c * c * square;
        squares[n + i] = rest;
        squares[2 * n + i] = c * c;
    }
    if (status == SRNF_OK) {
        run->out->inflation =
            srnf_spreads(n, 2, group, squares, squares + n, squares + 2 * n, run->out->spread);
    }
    srnf_free(squares);
    srnf_free(group);
    return status;
}

static int observe(struct compare_run *run, const double *mean)
{
    struct compare_block block;
    int status = compare_block_open(&block, run, 0, 1);

    for (size_t p = 0; p < run->points && status == SRNF_OK; p++) {
        run->out->statistic[p] = compare_hotelling(run, block.rows, p);
        run->largest[0] = fmax(run->largest[0], run->out->statistic[p]);
    }
    if (status == SRNF_OK) {
        run->observed = compare_global(run, block.contrasts);
        run->out->distance = sqrt(compare_square(run, block.contrasts));
        status = find_spreads(run);
        status = status ? status : describe(run, mean, block.rows);
        status = status ? status : find_interval(run);
    }
    compare_block_close(&block);
    return status;
}

/* ---- From counts to p ------------------------------------------------------------------------ */

static int conclude(struct compare_run *run)
{
    struct srnf_comparison *out = run->out;
    const struct stats_map map = {run->points, run->embedding.root, out->statistic,
                                  out->p,      out->significance,   out->fdr};
    double all = 1.0 + (double)run->permutations;

    out->p_value = (1.0 + (double)atomic_load(&run->global)) / all;
    out->test.least = (1.0 + (double)atomic_load(&run->tied)) / all;
    return stats_map_conclude(&map, run->permutations, run->largest, run->count, &out->max_p_value);
}

/* ---- The run --------------------------------------------------------------------------------- */

void srnf_comparison_clear(struct srnf_comparison *comparison)
{
    srnf_free(comparison->statistic);
    srnf_free(comparison->p);
    srnf_free(comparison->significance);
    srnf_free(comparison->fdr);
    srnf_free(comparison->effect);
    srnf_free(comparison->normal);
    *comparison = (struct srnf_comparison){0};
}

static int open_run(struct compare_run *run)
{
    struct srnf_comparison *out = run->out;
    double **maps[] = {&out->statistic, &out->p,      &out->significance,
                       &out->fdr,       &out->effect, &out->normal};
    size_t all;

    if (__builtin_mul_overflow(run->n, 3 * run->points, &all)) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < sizeof maps / sizeof maps[0]; i++) {
        *maps[i] = srnf_alloc(run->points, sizeof(double));
        if (!*maps[i]) {
            return SRNF_ENOMEM;
        }
    }
    run->q = srnf_alloc(all, sizeof(double));
    run->vectors = srnf_alloc(all, sizeof(double));
    run->gram = srnf_alloc(run->n, run->n * sizeof(double));
    run->squares = srnf_alloc(run->points, 6 * sizeof(double));
    run->largest = srnf_alloc(run->permutations + 1, sizeof(double));
    run->count = srnf_alloc(run->points, sizeof *run->count);
    return run->q && run->vectors && run->gram && run->squares && run->largest && run->count
               ? SRNF_OK
               : SRNF_ENOMEM;
}

static void close_run(struct compare_run *run)
{
    compare_design_clear(&run->design);
    exchange_clear(&run->exchange);
    stats_embedding_clear(&run->embedding);
    srnf_free(run->q);
    srnf_free(run->vectors);
    srnf_free(run->gram);
    srnf_free(run->squares);
    srnf_free(run->largest);
    srnf_free(run->count);
}

/* Residuals of the SRNFs and their Gram matrix. */
static int fill_gram(struct compare_run *run, const double *registered_q, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    double squares;
    int status;

    stats_weight(srnf_sht_grid(run->sht), run->n, registered_q, NULL, run->q);
    squares = cblas_dnrm2((int)(run->n * size), run->q, 1);
    compare_design_residuals(&run->design, size, run->q);
    status = stats_gram(run->n, size, run->q, run->gram, error);
    for (size_t i = 0; i < run->n; i++) {
        run->total += run->gram[i * run->n + i];
    }
    run->total = run->total > ROUNDING * squares * ROUNDING * squares ? run->total : 0.0;
    return status;
}

/* Residuals of the displacements and their squares at each node. */
static void fill_squares(struct compare_run *run)
{
    size_t points = run->points;

    compare_design_residuals(&run->design, 3 * points, run->vectors);
    for (size_t i = 0; i < run->n; i++) {
        const double *x = run->vectors + i * 3 * points;
        const double *y = x + points;
        const double *z = y + points;

        for (size_t p = 0; p < points; p++) {
            double *s = run->squares + 6 * p;

            s[0] += x[p] * x[p];
            s[1] += x[p] * y[p];
            s[2] += x[p] * z[p];
            s[3] += y[p] * y[p];
            s[4] += y[p] * z[p];
            s[5] += z[p] * z[p];
        }
    }
}

static int check(size_t n, const struct srnf_compare_options *options, struct srnf_error *error)
{
    if (n < 4 || n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces; 4 to %zu are needed", n, N_MAX);
    }
    if (options->permutations == 0 || options->permutations > PERMUTATIONS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "permutations is %zu, not 1 to %zu",
                         options->permutations, PERMUTATIONS_MAX);
    }
    return SRNF_OK;
}

static int compute(struct compare_run *run, const double *mean, const double *registered_q,
                   const struct srnf_context *context, struct srnf_error *error)
{
    size_t blocks = (run->permutations + COMPARE_BLOCK - 1) / COMPARE_BLOCK;
    int status = open_run(run);

    status = status ? status : fill_gram(run, registered_q, error);
    status = status ? status : stats_embedding_create(run->sht, mean, &run->embedding);
    if (status == SRNF_OK) {
        status = stats_embed_fields(
            &run->embedding, mean, run->near, run->n, registered_q, context,
            (struct stats_progress){0.0, PROGRESS_EMBED, "inverting the subjects"}, run->vectors,
            error);
    }
    if (status == SRNF_OK) {
        fill_squares(run);
        status = observe(run, mean);
    }
    status = status ? status
                    : stats_run(context, blocks, compare_block_run, run,
                                (struct stats_progress){PROGRESS_EMBED, 1.0, "permuting"}, error);
    return status ? status : conclude(run);
}

static int open_exchange(struct compare_run *run, const struct compare_averages *given,
                         size_t n_covariates, size_t asked)
{
    size_t *kind = srnf_alloc(run->n, sizeof *kind);
    int status = SRNF_ENOMEM;

    if (kind) {
        size_t kinds = compare_kinds(given, n_covariates, kind);

        status = exchange_open(&run->exchange, run->n, kind, kinds, asked, 1.0);
    }
    srnf_free(kind);
    run->permutations = run->exchange.test.permutations;
    run->out->test = run->exchange.test;
    run->out->asymptotic = n_covariates > 0;
    return status;
}

int srnf_compare_groups(const struct srnf_sht *sht, size_t n, const double *mean,
                        const double *registered_q, const int *group, size_t n_covariates,
                        const double *covariates, const struct srnf_compare_options *options,
                        const struct srnf_context *context, struct srnf_comparison *comparison,
                        struct srnf_error *error)
{
    struct srnf_compare_options defaults = srnf_compare_options_defaults();
    struct srnf_comparison found = {.n = n};
    struct srnf_error first = {0};
    struct subjects subjects = {0};
    struct compare_averages given = {
        .n = n, .q = registered_q, .covariates = covariates, .group = group};
    struct compare_run run = {
        .sht = sht, .points = stats_points(srnf_sht_grid(sht)), .out = &found};
    int status;

    options = options ? options : &defaults;
    run.seed = options->seed;
    given.count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    given.near = options->surfaces;
    atomic_init(&run.global, 0);
    atomic_init(&run.tied, 0);
    status = check(n, options, &first);
    status = status ? status : subjects_open(&subjects, n, options->subjects, &first);
    if (status == SRNF_OK && subjects.count < n) {
        status = compare_average(&subjects, 3 * run.points, n_covariates, &given, &first);
    }
    run.n = given.n;
    run.near = given.near;
    run.group = given.group;
    found.subjects = subjects.count;
    if (status == SRNF_OK) {
        status = compare_design_create(&run.design, run.n, given.group, n_covariates,
                                       given.covariates, &first);
    }
    status = status ? status : open_exchange(&run, &given, n_covariates, options->permutations);
    status = status ? status : compute(&run, mean, given.q, context, &first);
    close_run(&run);
    subjects_clear(&subjects);
    compare_averages_clear(&given);
    if (status) {
        srnf_comparison_clear(&found);
        return stats_fail(error, status, &first);
    }
    *comparison = found;
    return SRNF_OK;
}
