/*
 * norms_map.c - where a surface is odd: its deviation along the mean's normal, in standard
 * deviations, at each node.
 *
 * y_i are the displacements of the members' surfaces along the outward normal of the mean surface,
 * all centred as in embedding.c. In a fold with the basis U of its design (norms_fold.c) and f
 * degrees of freedom a surface with the displacement y has
 *
 *     z = (y - a'Y) / (s sqrt(1 + h)),    s^2 = |(1 - U U')Y|^2 / f,
 *
 * node by node: of a member, about the fold without its subject, that is the externally studentized
 * residual (R. Cook, S. Weisberg, "Residuals and influence in regression", 1982), and the spread
 * s sqrt(1 + h) is the standard deviation of such deviations. The largest |z| over the surface is
 * judged by those that the members have, each left out, which allows for all points at once.
 */
#include "norms.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define SPREAD_LEAST 1e-9 /* of the largest spread: no member moves there, but for rounding */

struct map {
    const struct norms *norms;
    const double *q;
    uint64_t series;
    struct stats_embedding embedding;
    double *normal;       /* [3][P] of the mean */
    double *along;        /* [n + 1][P], that of the surface last */
    double *coefficients; /* of the surface */
    double *largest;      /* [n] of each member's |z|, left out */
};

static int open_map(struct map *map)
{
    const struct norms *norms = map->norms;
    size_t points = norms->points;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(norms->sht));
    int status = SRNF_ENOMEM;

    map->normal = srnf_alloc(3, points * sizeof(double));
    map->along = srnf_alloc(norms->n + 1, points * sizeof(double));
    map->largest = srnf_alloc(norms->n, sizeof(double));
    if (workspace && map->normal && map->along && map->largest) {
        status = stats_embedding_create(norms->sht, norms->model->mean, &map->embedding);
    }
    if (status == SRNF_OK) {
        srnf_field(norms->sht, norms->model->mean, map->normal, workspace);
    }
    for (size_t p = 0; p < points && status == SRNF_OK; p++) {
        double *v = map->normal + p;
        double length = sqrt(v[0] * v[0] + v[points] * v[points] + v[2 * points] * v[2 * points]);

        for (size_t c = 0; c < 3; c++) {
            v[c * points] = length > 0.0 ? v[c * points] / length : 0.0;
        }
    }
    srnf_free(workspace);
    return status;
}

static void close_map(struct map *map)
{
    stats_embedding_clear(&map->embedding);
    srnf_free(map->normal);
    srnf_free(map->along);
    srnf_free(map->largest);
}

/* ---- Displacements --------------------------------------------------------------------------- */

static void project(const struct map *map, const double *vector, double *along)
{
    size_t points = map->norms->points;

    for (size_t p = 0; p < points; p++) {
        double root = map->embedding.root[p];
        double sum = 0.0;

        for (size_t c = 0; c < 3; c++) {
            sum += map->normal[c * points + p] * vector[c * points + p];
        }
        along[p] = root > 0.0 ? sum / root : 0.0;
    }
}

static int embed_body(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    struct map *map = argument;
    const struct norms *norms = map->norms;
    size_t size = 3 * norms->points;
    double *along = map->along + i * norms->points;
    double *memory;
    double *coefficients;
    void *workspace;
    int status = SRNF_ENOMEM;

    if (i < norms->n && stats_recall(norms->context, map->series, i, norms->points, along)) {
        return SRNF_OK;
    }
    memory = srnf_alloc(2 * size + 3 * srnf_coefficient_count(srnf_sht_degree(norms->sht)),
                        sizeof(double));
    workspace = srnf_alloc(1, stats_embedding_workspace_size(&map->embedding));
    if (memory && workspace) {
        coefficients = i < norms->n ? memory + 2 * size : map->coefficients;
        if (i < norms->n) {
            srnf_pca_reconstruct(norms->grid, norms->model->pca, norms->model->mean_q,
                                 norms->model->pca->scores + i * norms->model->pca->components,
                                 memory);
        }
        status = stats_invert_near(norms->sht, i < norms->n ? memory : map->q, norms->model->mean,
                                   context, coefficients, error);
        if (status == SRNF_OK) {
            stats_embed(&map->embedding, coefficients, memory + size, workspace);
            project(map, memory + size, along);
        }
        if (status == SRNF_OK && i < norms->n) {
            stats_keep(norms->context, map->series, i, norms->points, along);
        }
    }
    srnf_free(memory);
    srnf_free(workspace);
    return status;
}

/* Rounding is less where displacements are those from their mean. */
static void center(struct map *map)
{
    size_t points = map->norms->points;
    size_t n = map->norms->n;

    for (size_t p = 0; p < points; p++) {
        double mean = 0.0;

        for (size_t i = 0; i < n; i++) {
            mean += map->along[i * points + p] / (double)n;
        }
        for (size_t i = 0; i <= n; i++) {
            map->along[i * points + p] -= mean;
        }
    }
}

/* ---- Deviations ------------------------------------------------------------------------------ */

/* Root of the residual variance of the fold at each node. */
static int find_spread(const struct map *map, const struct norms_fold *fold, double *spread)
{
    size_t points = map->norms->points;
    int n = (int)fold->n;
    double *z = srnf_alloc(fold->p, points * sizeof(double));
    double largest = 0.0;

    if (!z) {
        return SRNF_ENOMEM;
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)fold->p, (int)points, n, 1.0,
                fold->basis, n, map->along, (int)points, 0.0, z, (int)points);
    for (size_t i = 0; i < fold->n; i++) {
        const double *y = map->along + i * points;

        for (size_t p = 0; p < points && fold->inside[i]; p++) {
            spread[p] += y[p] * y[p];
        }
    }
    for (size_t p = 0; p < points; p++) {
        for (size_t k = 0; k < fold->p; k++) {
            spread[p] -= z[k * points + p] * z[k * points + p];
        }
        spread[p] = sqrt(fmax(spread[p], 0.0) / (double)norms_fold_freedom(fold));
        largest = fmax(largest, spread[p]);
    }
    for (size_t p = 0; p < points; p++) {
        spread[p] = fmax(spread[p], SPREAD_LEAST * largest);
    }
    srnf_free(z);
    return SRNF_OK;
}

/* Deviation and spread of row i of the displacements, with its covariates x, about a fold. */
static int deviate(const struct map *map, const struct norms_fold *fold, size_t i, const double *x,
                   double *deviation, double *spread)
{
    size_t points = map->norms->points;
    double *a = srnf_alloc(fold->n + fold->p, sizeof(double));
    double leverage;
    int status;

    if (!a) {
        return SRNF_ENOMEM;
    }
    memset(spread, 0, points * sizeof(double));
    status = find_spread(map, fold, spread);
    leverage = norms_fold_predict(fold, x, a + fold->n, a);
    memcpy(deviation, map->along + i * points, points * sizeof(double));
    cblas_dgemv(CblasRowMajor, CblasTrans, (int)fold->n, (int)points, -1.0, map->along, (int)points,
                a, 1, 1.0, deviation, 1);
    cblas_dscal((int)points, sqrt(1.0 + leverage), spread, 1);
    srnf_free(a);
    return status;
}

static double largest_z(size_t points, const double *deviation, const double *spread)
{
    double largest = 0.0;

    for (size_t p = 0; p < points; p++) {
        largest = spread[p] > 0.0 ? fmax(largest, fabs(deviation[p]) / spread[p]) : largest;
    }
    return largest;
}

/* The members of a subject, left out. */
static int leave_out(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct map *map = argument;
    const struct norms *norms = map->norms;
    const struct subjects *s = &norms->subjects;
    double *memory = srnf_alloc(2, norms->points * sizeof(double));
    struct norms_fold fold = {0};
    int status = memory ? norms_fold_open(&fold, norms, NORMS_NONE, subject, error) : SRNF_ENOMEM;

    (void)context;
    for (size_t m = s->start[subject]; m < s->start[subject + 1] && status == SRNF_OK; m++) {
        size_t i = s->members[m];

        status = deviate(map, &fold, i, norms_row(norms, i), memory, memory + norms->points);
        map->largest[i] = largest_z(norms->points, memory, memory + norms->points);
    }
    norms_fold_clear(&fold);
    srnf_free(memory);
    return status;
}

/* ---- The surface ----------------------------------------------------------------------------- */

static int conclude(const struct map *map, size_t left_out, const double *x,
                    struct srnf_score *score, struct srnf_error *error)
{
    const struct norms *norms = map->norms;
    struct norms_fold fold = {0};
    int status = norms_fold_open(&fold, norms, NORMS_NONE, left_out, error);

    status = status ? status : deviate(map, &fold, norms->n, x, score->deviation, score->spread);
    norms_fold_clear(&fold);
    if (status == SRNF_OK) {
        status =
            norms_rank(norms, map->largest, left_out,
                       largest_z(norms->points, score->deviation, score->spread), &score->largest);
    }
    for (size_t p = 0; p < norms->points && status == SRNF_OK; p++) {
        double z = score->spread[p] > 0.0 ? score->deviation[p] / score->spread[p] : 0.0;
        double as_odd = 0.0;
        double all = 0.0;

        for (size_t i = 0; i < norms->n; i++) {
            if (norms->subjects.of[i] != left_out) {
                all += norms->weights[i];
                as_odd += map->largest[i] >= fabs(z) ? norms->weights[i] : 0.0;
            }
        }
        score->z[p] = z;
        score->significance[p] = (1.0 + as_odd) / (1.0 + all);
    }
    return status;
}

static uint64_t series_of(const struct norms *norms)
{
    size_t degree = srnf_sht_degree(norms->sht);
    uint64_t hash = stats_hash(STATS_HASH_START, STATS_KEPT_NORMS);

    hash = stats_hash(hash, degree);
    hash = stats_hash(hash, norms->points);
    hash = stats_hash_doubles(hash, 3 * srnf_coefficient_count(degree), norms->model->mean);
    hash = stats_hash_doubles(hash, 3 * norms->points, norms->model->mean_q);
    return stats_hash_doubles(hash, norms->n * norms->model->pca->components,
                              norms->model->pca->scores);
}

int norms_map(const struct norms *norms, const double *q, const struct srnf_norm_options *options,
              struct stats_progress progress, struct srnf_score *score, struct srnf_error *error)
{
    struct map map = {.norms = norms, .q = q, .coefficients = score->coefficients};
    size_t left_out = options->member < norms->n ? norms->subjects.of[options->member] : NORMS_NONE;
    int status = open_map(&map);

    if (status == SRNF_OK) {
        map.series = series_of(norms);
        status = stats_run(norms->context, norms->n + 1, embed_body, &map, progress, error);
    }
    if (status == SRNF_OK) {
        center(&map);
        status = stats_run(norms->context, norms->subjects.count, leave_out, &map,
                           (struct stats_progress){0}, error);
    }
    status = status ? status : conclude(&map, left_out, options->at, score, error);
    if (status == SRNF_OK) {
        stats_keep(norms->context, map.series, 0, 0, NULL);
    }
    close_map(&map);
    return status;
}
