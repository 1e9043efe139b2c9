/*
 * intersect.c - faces of a mesh that cross each other.
 *
 * Two triangles cross where an edge of one goes through the inside of the other. That is five signs
 * of volumes of tetrahedra. Each sign is taken for certain only beyond the bound of its rounding
 * error (J. Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997: the first of the stages
 * of orient3d); where it is not, the triangles touch, and that does not count. So what is counted
 * does cross, and what touches, or lies folded onto its neighbour in one plane, is left to others.
 *
 * Of faces with a corner in common the edge opposite to it is tried; faces with an edge in common
 * cannot cross. Pairs come from the hierarchy of boxes of index.c.
 */
#include "index.h"

#include <float.h>

#define ASK_EVERY 256
#define ORIENT_BOUND (8.0 * DBL_EPSILON) /* above (7 + 56 u) u, u = DBL_EPSILON / 2 */

/* The sign of the volume of a tetrahedron; 0: not certain. */
static int orientation(const double a[3], const double b[3], const double c[3], const double d[3])
{
    double u[3], v[3], w[3], value, bound;

    vector_subtract(a, d, u);
    vector_subtract(b, d, v);
    vector_subtract(c, d, w);
    value = u[2] * (v[0] * w[1] - v[1] * w[0]) + v[2] * (w[0] * u[1] - w[1] * u[0]) +
            w[2] * (u[0] * v[1] - u[1] * v[0]);
    bound = ORIENT_BOUND * (fabs(u[2]) * (fabs(v[0] * w[1]) + fabs(v[1] * w[0])) +
                            fabs(v[2]) * (fabs(w[0] * u[1]) + fabs(w[1] * u[0])) +
                            fabs(w[2]) * (fabs(u[0] * v[1]) + fabs(u[1] * v[0])));
    return value > bound ? 1 : value < -bound ? -1 : 0;
}

/* Whether the edge from p to q goes through the inside of the face. */
static bool crosses(const double *p, const double *q, const double *const face[3])
{
    int side = orientation(face[0], face[1], face[2], p), turn;

    if (side == 0 || orientation(face[0], face[1], face[2], q) != -side) {
        return false;
    }
    turn = orientation(p, q, face[0], face[1]);
    return turn != 0 && orientation(p, q, face[1], face[2]) == turn &&
           orientation(p, q, face[2], face[0]) == turn;
}

/* Whether an edge of a goes through b. Edges that end in a corner of b only touch it. */
static bool edge_crosses(const struct srnf_mesh *mesh, size_t a, size_t b)
{
    const uint32_t *v = mesh->faces + 3 * a, *w = mesh->faces + 3 * b;
    const double *const face[3] = {mesh_corner(mesh, b, 0), mesh_corner(mesh, b, 1),
                                   mesh_corner(mesh, b, 2)};

    for (size_t k = 0; k < 3; k++) {
        uint32_t p = v[k], q = v[(k + 1) % 3];
        bool touches = p == w[0] || p == w[1] || p == w[2] || q == w[0] || q == w[1] || q == w[2];

        if (!touches &&
            crosses(mesh->vertices + 3 * (size_t)p, mesh->vertices + 3 * (size_t)q, face)) {
            return true;
        }
    }
    return false;
}

static void face_box(const struct srnf_mesh *mesh, size_t face, double low[3], double high[3])
{
    for (size_t k = 0; k < 3; k++) {
        const double a = mesh_corner(mesh, face, 0)[k], b = mesh_corner(mesh, face, 1)[k],
                     c = mesh_corner(mesh, face, 2)[k];

        low[k] = fmin(a, fmin(b, c));
        high[k] = fmax(a, fmax(b, c));
    }
}

static bool apart(const double *low, const double *high, const double *other_low,
                  const double *other_high)
{
    bool any = false;

    for (size_t k = 0; k < 3; k++) {
        any = any || high[k] < other_low[k] || other_high[k] < low[k];
    }
    return any;
}

static void count_pair(const struct srnf_mesh *mesh, size_t a, size_t b,
                       struct srnf_mesh_crossings *crossings)
{
    if (!edge_crosses(mesh, a, b) && !edge_crosses(mesh, b, a)) {
        return;
    }
    if (crossings->pairs++ > 0) {
        return;
    }
    crossings->faces[0] = a;
    crossings->faces[1] = b;
    for (size_t k = 0; k < 3; k++) {
        crossings->position[k] = 0.0;
        for (size_t c = 0; c < 3; c++) {
            crossings->position[k] +=
                mesh_corner(mesh, a, c)[k] / 6.0 + mesh_corner(mesh, b, c)[k] / 6.0;
        }
    }
}

/* Counts the pairs of a face with those behind it. */
static void count_face(const struct srnf_index *index, size_t face,
                       struct srnf_mesh_crossings *crossings)
{
    uint32_t stack[2 * INDEX_DEPTH_MAX];
    double low[3], high[3], own_low[3], own_high[3];
    size_t depth = 0;

    face_box(index->mesh, face, own_low, own_high);
    stack[depth++] = 0;
    while (depth > 0) {
        uint32_t at = stack[--depth];
        const struct index_node *node = &index->nodes[at];

        if (apart(node->low, node->high, own_low, own_high)) {
            continue;
        }
        if (node->count == 0) {
            stack[depth++] = node->second;
            stack[depth++] = at + 1;
            continue;
        }
        for (uint32_t i = node->start; i < node->start + node->count; i++) {
            size_t other = index->order[i];

            face_box(index->mesh, other, low, high);
            if (other > face && !apart(low, high, own_low, own_high)) {
                count_pair(index->mesh, face, other, crossings);
            }
        }
    }
}

int srnf_mesh_find_crossings(const struct srnf_mesh *mesh, const struct srnf_context *context,
                             struct srnf_mesh_crossings *crossings)
{
    struct srnf_index *index = NULL;
    int status;

    *crossings = (struct srnf_mesh_crossings){.pairs = 0};
    if (mesh->n_faces == 0) {
        return SRNF_OK;
    }
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        if (mesh->faces[c] >= mesh->n_vertices) {
            return SRNF_EINVAL;
        }
    }
    status = index_create(&index, mesh, context);
    for (size_t face = 0; status == SRNF_OK && face < mesh->n_faces; face++) {
        count_face(index, face, crossings);
        if (face % ASK_EVERY == 0 && srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        }
    }
    srnf_index_destroy(index);
    return status;
}
