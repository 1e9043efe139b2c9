/*
 * embedding.c - registered surfaces as points of a Euclidean space: the coordinates of a surface
 * are its values at the nodes of the grid, moved to their centroid and times the root of each
 * node's share of the mean surface's area,
 *
 *     v_p = sqrt(a_p) (f(s_p) - t),   a_p = w_p |n(s_p)| / A,   t = sum_p a_p f(s_p),
 *
 * with w the weights of the quadrature, n the normal and A the area of the mean. The distance of
 * two such points is the surface distance of srnf/groups.h: the best translation is the difference
 * of the centroids.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

int stats_embedding_create(const struct srnf_sht *sht, const double *mean,
                           struct stats_embedding *embedding)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = stats_points(grid);
    double *q = srnf_alloc(3 * points, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    double area = 0.0;
    int status = SRNF_ENOMEM;

    *embedding = (struct stats_embedding){.sht = sht, .points = points};
    embedding->root = srnf_alloc(points, sizeof(double));
    if (!q || !workspace || !embedding->root) {
        goto out;
    }
    srnf_field(sht, mean, q, workspace);
    for (size_t p = 0; p < points; p++) {
        double square = 0.0;

        for (size_t c = 0; c < 3; c++) {
            square += q[c * points + p] * q[c * points + p];
        }
        embedding->root[p] = grid->weight[p / grid->n_phi] * square;
        area += embedding->root[p];
    }
    status = area > 0.0 && isfinite(area) ? SRNF_OK : SRNF_EDEGENERATE;
    for (size_t p = 0; p < points && status == SRNF_OK; p++) {
        embedding->root[p] = sqrt(embedding->root[p] / area);
    }
out:
    srnf_free(q);
    srnf_free(workspace);
    if (status) {
        stats_embedding_clear(embedding);
    }
    return status;
}

void stats_embedding_clear(struct stats_embedding *embedding)
{
    srnf_free(embedding->root);
    embedding->root = NULL;
}

size_t stats_embedding_workspace_size(const struct stats_embedding *embedding)
{
    return srnf_sht_workspace_size(embedding->sht, 3);
}

void stats_embed(const struct stats_embedding *embedding, const double *coefficients,
                 double *vector, void *workspace)
{
    size_t points = embedding->points;

    srnf_sht_synthesis(embedding->sht, 3, coefficients, vector, workspace);
    for (size_t c = 0; c < 3; c++) {
        double *v = vector + c * points;
        double centroid = 0.0;

        for (size_t p = 0; p < points; p++) {
            centroid += embedding->root[p] * embedding->root[p] * v[p];
        }
        for (size_t p = 0; p < points; p++) {
            v[p] = embedding->root[p] * (v[p] - centroid);
        }
    }
}

int stats_invert_near(const struct srnf_sht *sht, const double *q, const double *start,
                      const struct srnf_context *context, double *coefficients,
                      struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion = {0};
    int status;

    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = start;
    options.certify = false;
    status = srnf_invert(sht, q, &options, context, &inversion, error);
    if (status < 0) {
        return status;
    }
    memcpy(coefficients, inversion.coefficients, count * sizeof(double));
    srnf_inversion_clear(&inversion);
    return SRNF_OK;
}

struct embed_loop {
    const struct stats_embedding *embedding;
    const double *mean, *q;
    const double *const *near;
    double *vectors;
};

static int embed_one(void *argument, size_t i, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct embed_loop *loop = argument;
    const struct stats_embedding *embedding = loop->embedding;
    size_t size = 3 * embedding->points;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(embedding->sht));
    double *coefficients = srnf_alloc(count, sizeof(double));
    void *workspace = srnf_alloc(1, stats_embedding_workspace_size(embedding));
    int status = SRNF_ENOMEM;

    if (coefficients && workspace) {
        status = stats_invert_near(embedding->sht, loop->q + i * size,
                                   loop->near ? loop->near[i] : loop->mean, context, coefficients,
                                   error);
    }
    if (status == SRNF_OK) {
        stats_embed(embedding, coefficients, loop->vectors + i * size, workspace);
    }
    srnf_free(coefficients);
    srnf_free(workspace);
    return status;
}

int stats_embed_fields(const struct stats_embedding *embedding, const double *mean,
                       const double *const *near, size_t n, const double *q,
                       const struct srnf_context *context, struct stats_progress progress,
                       double *vectors, struct srnf_error *error)
{
    struct embed_loop loop = {embedding, mean, q, near, vectors};

    return stats_run(context, n, embed_one, &loop, progress, error);
}
