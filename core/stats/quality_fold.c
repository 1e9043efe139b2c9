/*
 * quality_fold.c - one subject left out with all its members: mean and components are fitted to the
 * others, and a member is described by its scores in them.
 *
 * Everything but the fields themselves happens in the Gram matrix G_jk = <x_j, x_k> of the centred
 * SRNFs, of which the rows and columns of the others, centred anew, are the Gram matrix of the
 * fold: with r_j the mean of row j over the others and t the mean of those,
 *
 *     S_jk = G_jk - r_j - r_k + t,      c_j = G_ij - r_i - r_j + t.
 *
 * For S a = lambda a, |a| = 1, the score of member i is s = <a, c> / sqrt(lambda), and its
 * reconstruction is the combination of the others' q with the weights
 *
 *     1 / others + sum_k (s_k / sqrt(lambda_k)) a_k,
 *
 * as each a is orthogonal to the constants. The elastic distance needs no field: it is the root of
 * <y, y> - sum_k s_k^2, with y the member less the mean of the others. Components of rounding size
 * are left out; the curve then stays level.
 */
#include "quality.h"

#include <cblas.h>
#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

struct fold {
    const struct quality_run *run;
    size_t out, others; /* the member that is described; how many stay */
    size_t *kept;       /* [others] those that stay */
    size_t components;  /* that are fitted */
    double own;         /* <y, y> */
    double *gram;       /* [others][others] S */
    double *products;   /* [others] c */
    double *values;     /* [others] eigenvalues, increasing; the first `components` are set */
    double *vectors;    /* [components][others] */
    double *work;
    double *weights; /* [n] of all, 0 for those left out */
    lapack_int *iwork, *support;
    lapack_int work_size, iwork_size;
};

/* One call of the eigensolver for the largest `components`; only_query: the sizes it needs. */
static int solve(struct fold *fold, bool only_query)
{
    lapack_int n = (lapack_int)fold->others;
    lapack_int found = 0;
    double size = 0.0;
    lapack_int info;

    info = LAPACKE_dsyevr_work(
        LAPACK_COL_MAJOR, 'V', 'I', 'L', n, fold->gram, n, 0.0, 0.0,
        n - (lapack_int)fold->components + 1, n, 0.0, &found, fold->values, fold->vectors, n,
        fold->support, only_query ? &size : fold->work, only_query ? -1 : fold->work_size,
        only_query ? &fold->iwork_size : fold->iwork, only_query ? -1 : fold->iwork_size);
    if (only_query) {
        fold->work_size = (lapack_int)size;
    }
    return info || (!only_query && found != (lapack_int)fold->components) ? SRNF_ENUMERIC : SRNF_OK;
}

static int open_fold(struct fold *fold)
{
    const size_t *of = fold->run->subjects.of;
    size_t others = fold->others;
    int status = solve(fold, true);

    if (status) {
        return status;
    }
    fold->gram = srnf_alloc(others * others, sizeof(double));
    fold->products = srnf_alloc(others, sizeof(double));
    fold->values = srnf_alloc(others, sizeof(double));
    fold->vectors = srnf_alloc(fold->components * others, sizeof(double));
    fold->weights = srnf_alloc(fold->run->n, sizeof(double));
    fold->support = srnf_alloc(2 * others, sizeof *fold->support);
    fold->work = srnf_alloc((size_t)fold->work_size, sizeof(double));
    fold->iwork = srnf_alloc((size_t)fold->iwork_size, sizeof *fold->iwork);
    fold->kept = srnf_alloc(others, sizeof *fold->kept);
    for (size_t i = 0, j = 0; fold->kept && i < fold->run->n; i++) {
        if (of[i] != of[fold->out]) {
            fold->kept[j++] = i;
        }
    }
    return fold->kept && fold->gram && fold->products && fold->values && fold->vectors &&
                   fold->weights && fold->support && fold->work && fold->iwork
               ? SRNF_OK
               : SRNF_ENOMEM;
}

static void close_fold(struct fold *fold)
{
    srnf_free(fold->kept);
    srnf_free(fold->gram);
    srnf_free(fold->products);
    srnf_free(fold->values);
    srnf_free(fold->vectors);
    srnf_free(fold->weights);
    srnf_free(fold->support);
    srnf_free(fold->work);
    srnf_free(fold->iwork);
}

/* Mean of row i of the Gram matrix over the others. */
static double row_mean(const struct fold *fold, size_t i)
{
    const double *row = fold->run->gram + i * fold->run->n;
    double sum = 0.0;

    for (size_t j = 0; j < fold->others; j++) {
        sum += row[fold->kept[j]];
    }
    return sum / (double)fold->others;
}

/* S, c and <y, y>. */
static void centre(struct fold *fold)
{
    size_t n = fold->run->n;
    size_t others = fold->others;
    const double *gram = fold->run->gram;
    double mine = row_mean(fold, fold->out);
    double total = 0.0;

    for (size_t j = 0; j < others; j++) {
        fold->products[j] = row_mean(fold, fold->kept[j]);
        total += fold->products[j] / (double)others;
    }
    for (size_t j = 0; j < others; j++) {
        for (size_t k = 0; k < others; k++) {
            fold->gram[j * others + k] = gram[fold->kept[j] * n + fold->kept[k]] -
                                         fold->products[j] - fold->products[k] + total;
        }
    }
    for (size_t j = 0; j < others; j++) {
        fold->products[j] = gram[fold->out * n + fold->kept[j]] - mine - fold->products[j] + total;
    }
    fold->own = gram[fold->out * n + fold->out] - 2.0 * mine + total;
}

/* Adds component k to the weights; returns the square of the score. 0: it is but rounding. */
static double add_component(struct fold *fold, size_t k)
{
    size_t at = fold->components - 1 - k;
    const double *a = fold->vectors + at * fold->others;
    double lambda = fold->values[at];
    double floor = (double)fold->others * DBL_EPSILON * fold->values[fold->components - 1];
    double along = 0.0;

    if (!(lambda > floor)) {
        return 0.0;
    }
    for (size_t j = 0; j < fold->others; j++) {
        along += a[j] * fold->products[j];
    }
    for (size_t j = 0; j < fold->others; j++) {
        fold->weights[fold->kept[j]] += along / lambda * a[j];
    }
    return along * along / lambda;
}

int quality_fold(const struct quality_run *run, size_t i, const struct srnf_context *context,
                 struct quality_distances out, struct srnf_error *error)
{
    const struct subjects *subjects = &run->subjects;
    struct fold fold = {.run = run,
                        .out = i,
                        .others = run->n - subjects->size[subjects->of[i]],
                        .components = run->components};
    size_t size = 3 * run->points;
    struct quality_walk walk = {0};
    int status = open_fold(&fold);

    status = status ? status : quality_walk_open(&walk, run);
    if (status == SRNF_OK) {
        centre(&fold);
        status = solve(&fold, false);
    }
    for (size_t j = 0; j < fold.others && status == SRNF_OK; j++) {
        fold.weights[fold.kept[j]] = 1.0 / (double)fold.others;
    }
    for (size_t k = 0; k < run->components && status == SRNF_OK; k++) {
        fold.own -= add_component(&fold, k);
        cblas_dgemv(CblasColMajor, CblasNoTrans, (int)size, (int)run->n, 1.0, run->q, (int)size,
                    fold.weights, 1, 0.0, walk.q, 1);
        status = quality_walk_step(&walk, context, error);
        if (status == SRNF_OK) {
            out.surface[k] = quality_walk_distance(&walk, i);
            out.elastic[k] = sqrt(fmax(fold.own, 0.0));
        }
    }
    quality_walk_close(&walk);
    close_fold(&fold);
    return status;
}
