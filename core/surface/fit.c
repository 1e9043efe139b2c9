/*
 * fit.c - fit error between a mesh and a triangulated surface, from both sides.
 *
 * With d_i the distance of vertex i of one side to the other side, and w_i a third of the area of
 * its faces divided by twice the area of its side, so that all weights sum to one,
 *   rms = (sum w_i d_i^2)^(1/2)
 *   p95 = the least d such that the weights of all d_i <= d sum to 0.95 at least
 *   max = max d_i
 * One side alone would not do: a surface that misses a limb is near the mesh everywhere, the limb
 * is not near the surface.
 *
 * Cost: one query of a spatial index per vertex, O(n log n). Queries run in parallel where the
 * context can; sums run in the order of the vertices.
 */
#include "fit.h"

#include "mesh/index.h"

#define QUANTILE 0.95
#define BLOCK ((size_t)128)

/* A quantile is reached up to the rounding of a sum of weights. */
#define WEIGHT_ROUNDING 1e-12

/* Adds to weights[n_vertices] so that they sum to total; false when the faces have no area. */
static bool weigh_vertices(const struct srnf_mesh *mesh, double total, double *weights)
{
    double diagonal, area = 0.0;
    struct srnf_mesh_measures measures;

    srnf_mesh_measure(mesh, NULL, &measures);
    diagonal = measures.diagonal;
    if (!(measures.relative_area > 0.0)) {
        return false;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        double ab[3], ac[3], normal[3], third;

        vector_subtract(mesh_corner(mesh, f, 1), mesh_corner(mesh, f, 0), ab);
        vector_subtract(mesh_corner(mesh, f, 2), mesh_corner(mesh, f, 0), ac);
        for (size_t k = 0; k < 3; k++) {
            ab[k] /= diagonal;
            ac[k] /= diagonal;
        }
        vector_cross(ab, ac, normal);
        third = vector_norm(normal) / 6.0;
        area += 3.0 * third;
        for (size_t k = 0; k < 3; k++) {
            weights[mesh->faces[3 * f + k]] += third;
        }
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        weights[i] *= total / area;
    }
    return true;
}

static bool distance_less(const void *context, uint32_t a, uint32_t b)
{
    const double *distances = context;

    return distances[a] < distances[b];
}

/* Fills rms, p95 and max from n weighted distances; order and scratch are workspace for n. */
static void summarize(const double *distances, const double *weights, size_t n, uint32_t *order,
                      uint32_t *scratch, struct srnf_fit *fit)
{
    double largest, sum = 0.0, weight = 0.0;

    for (size_t i = 0; i < n; i++) {
        order[i] = (uint32_t)i;
    }
    srnf_sort_order(order, scratch, n, distance_less, distances, NULL);
    largest = distances[order[n - 1]];
    fit->max = largest;
    fit->p95 = largest;
    for (size_t i = 0; i < n; i++) {
        weight += weights[order[i]];
        if (weight >= QUANTILE - WEIGHT_ROUNDING) {
            fit->p95 = distances[order[i]];
            break;
        }
    }
    for (size_t i = 0; i < n && largest > 0.0; i++) {
        double ratio = distances[i] / largest; /* so that no square leaves the range of a double */

        sum += weights[i] * ratio * ratio;
    }
    fit->rms = largest * sqrt(sum);
}

struct side {
    const struct srnf_index *index;
    const struct srnf_mesh *mesh;
    double *distances;
};

/* A block of vertices: enough queries to be worth handing to another thread. */
static void measure_block(void *argument, size_t block)
{
    const struct side *side = argument;
    size_t begin = block * BLOCK;
    size_t end = begin + BLOCK < side->mesh->n_vertices ? begin + BLOCK : side->mesh->n_vertices;

    for (size_t i = begin; i < end; i++) {
        side->distances[i] =
            sqrt(srnf_index_distance2(side->index, side->mesh->vertices + 3 * i, NULL, NULL));
    }
}

/* Distances of the vertices of a mesh to what the index is over. */
static int measure_side(const struct srnf_context *context, const struct srnf_index *index,
                        const struct srnf_mesh *mesh, double *distances)
{
    struct side side = {index, mesh, distances};

    return srnf_parallel_for(context, (mesh->n_vertices + BLOCK - 1) / BLOCK, measure_block, &side);
}

int srnf_fit_measure(const struct srnf_mesh *mesh, const struct srnf_index *index,
                     const struct srnf_mesh *surface_triangulation,
                     const struct srnf_context *context, struct srnf_fit *fit)
{
    const struct srnf_mesh *surface = surface_triangulation;
    size_t n = mesh->n_vertices + surface->n_vertices;
    struct srnf_index *surface_index = NULL;
    struct srnf_mesh_measures measures;
    double *distances = NULL, *weights = NULL;
    uint32_t *order = NULL, *scratch = NULL;
    int status = SRNF_ELIMIT;

    if (mesh->n_vertices > SRNF_MESH_VERTICES_MAX || n > SRNF_MESH_VERTICES_MAX) {
        goto out;
    }
    status = SRNF_ENOMEM;
    distances = srnf_alloc(n, sizeof *distances);
    weights = srnf_alloc(n, sizeof *weights);
    order = srnf_alloc(n, sizeof *order);
    scratch = srnf_alloc(n, sizeof *scratch);
    if (!distances || !weights || !order || !scratch) {
        goto out;
    }
    status = SRNF_EDEGENERATE;
    if (!weigh_vertices(mesh, 0.5, weights) ||
        !weigh_vertices(surface, 0.5, weights + mesh->n_vertices)) {
        goto out;
    }
    status = index_create(&surface_index, surface, context);
    if (status != SRNF_OK) {
        goto out;
    }
    status = measure_side(context, surface_index, mesh, distances);
    if (status == SRNF_OK) {
        status = measure_side(context, index, surface, distances + mesh->n_vertices);
    }
    if (status != SRNF_OK) {
        goto out;
    }
    srnf_mesh_measure(mesh, NULL, &measures);
    summarize(distances, weights, n, order, scratch, fit);
    fit->diagonal = measures.diagonal;
    status = SRNF_OK;
out:
    srnf_index_destroy(surface_index);
    srnf_free(scratch);
    srnf_free(order);
    srnf_free(weights);
    srnf_free(distances);
    return status;
}
