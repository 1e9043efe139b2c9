/*
 * mend_fill.c - triangles across a loop of points.
 *
 * Of all triangulations of the loop, as if it were a polygon, the one with the least sum of areas,
 * by dynamic programming over its chords (Barequet and Sharir 1995: Filling gaps in the boundary of
 * a polyhedron). A small part of the squared length of the chords is added, which decides where the
 * loop is flat and all have the same area. Chords that are edges of the mesh already are not taken,
 * since such an edge would get four faces. O(n^3) time, O(n^2) memory.
 */
#include "mend.h"

#define CHORD_WEIGHT 1e-3

struct fill {
    const double (*points)[3];
    size_t n;
    double *cost;    /* [n][n] of the part of the polygon between i and k > i */
    uint16_t *apex;  /* [n][n] of the triangle on chord i k there */
    uint32_t *stack; /* [n][2] */
};

static double triangle_cost(const struct fill *fill, size_t i, size_t m, size_t k)
{
    double u[3], v[3], normal[3];

    vector_subtract(fill->points[m], fill->points[i], u);
    vector_subtract(fill->points[k], fill->points[i], v);
    vector_cross(u, v, normal);
    return vector_norm(normal) / 2.0 + CHORD_WEIGHT * vector_dot(v, v);
}

static void weigh(struct fill *fill, size_t i, size_t k)
{
    size_t n = fill->n;
    double *best = &fill->cost[i * n + k];

    for (size_t m = i + 1; m < k; m++) {
        double parts = fill->cost[i * n + m] + fill->cost[m * n + k];

        if (parts < *best) {
            double cost = parts + triangle_cost(fill, i, m, k);

            if (cost < *best) {
                *best = cost;
                fill->apex[i * n + k] = (uint16_t)m;
            }
        }
    }
}

static void collect(struct fill *fill, uint32_t *triangles)
{
    size_t depth = 1;

    fill->stack[0] = 0;
    fill->stack[1] = (uint32_t)(fill->n - 1);
    while (depth > 0) {
        uint32_t i = fill->stack[2 * --depth], k = fill->stack[2 * depth + 1];
        uint32_t m = fill->apex[i * fill->n + k];
        const uint32_t parts[2][2] = {{i, m}, {m, k}};

        *triangles++ = k;
        *triangles++ = m;
        *triangles++ = i;
        for (size_t p = 0; p < 2; p++) {
            if (parts[p][1] - parts[p][0] > 1) {
                fill->stack[2 * depth] = parts[p][0];
                fill->stack[2 * depth++ + 1] = parts[p][1];
            }
        }
    }
}

int mend_fill(const double (*points)[3], size_t n, const bool *forbidden,
              const struct srnf_context *context, uint32_t *triangles, bool *filled)
{
    struct fill fill = {.points = points, .n = n};
    int status = SRNF_ENOMEM;

    *filled = false;
    fill.cost = srnf_alloc(n * n, sizeof *fill.cost);
    fill.apex = srnf_alloc(n * n, sizeof *fill.apex);
    fill.stack = srnf_alloc(n, 2 * sizeof *fill.stack);
    if (!fill.cost || !fill.apex || !fill.stack) {
        goto out;
    }
    for (size_t span = 2; span < n && !srnf_is_canceled(context); span++) {
        for (size_t i = 0; i + span < n; i++) {
            fill.cost[i * n + i + span] = INFINITY;
            if (!forbidden[i * n + i + span] || span == n - 1) {
                weigh(&fill, i, i + span);
            }
        }
    }
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    *filled = status == SRNF_OK && fill.cost[n - 1] < INFINITY;
    if (*filled) {
        collect(&fill, triangles);
    }
out:
    srnf_free(fill.stack);
    srnf_free(fill.apex);
    srnf_free(fill.cost);
    return status;
}
