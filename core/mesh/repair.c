/*
 * repair.c - the repairs of a mesh that lose nothing: joining equal vertices, dropping those that
 * no face names, turning all faces.
 *
 * Vertices that stay keep their order, so that the result depends on nothing but the input. Memory
 * of the dropped ones is kept until the mesh is cleared.
 */
#include "mesh_geometry.h"

#include <string.h>

static bool vertex_less(const void *context, uint32_t a, uint32_t b)
{
    const double *vertices = context;
    const double *p = vertices + 3 * (size_t)a, *q = vertices + 3 * (size_t)b;

    for (int k = 0; k < 3; k++) {
        if (p[k] < q[k]) {
            return true;
        }
        if (p[k] > q[k]) {
            return false;
        }
    }
    return false;
}

/* Moves the vertices with keep[i] to the front and renames the corners of all faces: rename[i] is
   the new number of a kept vertex, and of a vertex that is not kept the (old) number of the one
   that stands for it. */
static void compact(struct srnf_mesh *mesh, const bool *keep, uint32_t *rename)
{
    size_t kept = 0;

    for (size_t i = 0; i < mesh->n_vertices; i++) {
        if (keep[i]) {
            memmove(mesh->vertices + 3 * kept, mesh->vertices + 3 * i, 3 * sizeof(double));
            rename[i] = (uint32_t)kept++;
        } else {
            rename[i] = rename[rename[i]]; /* the one that stands for it came earlier */
        }
    }
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        mesh->faces[c] = rename[mesh->faces[c]];
    }
    mesh->n_vertices = kept;
}

/*
 * Joins vertices with equal coordinates (-0 equals 0) into the first of each group. Sorting, not
 * hashing: no input makes it slow. O(n log n).
 */
int srnf_repair_merge_vertices(struct srnf_mesh *mesh, size_t *merged)
{
    size_t n = mesh->n_vertices;
    uint32_t *order = srnf_alloc(n, sizeof *order);
    uint32_t *rename = srnf_alloc(n, sizeof *rename);
    bool *keep = srnf_alloc(n, sizeof *keep);
    int status = SRNF_ENOMEM;

    *merged = 0;
    if (!order || !rename || !keep) {
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        order[i] = (uint32_t)i;
    }
    srnf_sort_order(order, rename, n, vertex_less, mesh->vertices);
    for (size_t i = 0; i < n; i++) {
        /* The sort is stable: the first of a group has the lowest index. */
        bool first = i == 0 || vertex_less(mesh->vertices, order[i - 1], order[i]);

        keep[order[i]] = first;
        rename[order[i]] = first ? order[i] : rename[order[i - 1]];
        *merged += !first;
    }
    compact(mesh, keep, rename);
    status = SRNF_OK;
out:
    srnf_free(keep);
    srnf_free(rename);
    srnf_free(order);
    return status;
}

int srnf_repair_drop_unreferenced(struct srnf_mesh *mesh, size_t *dropped)
{
    size_t n = mesh->n_vertices;
    uint32_t *rename = srnf_alloc(n, sizeof *rename);
    bool *keep = srnf_alloc(n, sizeof *keep);
    int status = SRNF_ENOMEM;

    *dropped = 0;
    if (!rename || !keep) {
        goto out;
    }
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        keep[mesh->faces[c]] = true;
    }
    for (size_t i = 0; i < n; i++) {
        *dropped += !keep[i];
    }
    if (*dropped > 0) {
        compact(mesh, keep, rename);
    }
    status = SRNF_OK;
out:
    srnf_free(keep);
    srnf_free(rename);
    return status;
}

void srnf_repair_flip_faces(struct srnf_mesh *mesh)
{
    for (size_t f = 0; f < mesh->n_faces; f++) {
        uint32_t *face = mesh->faces + 3 * f;
        uint32_t second = face[1];

        face[1] = face[2];
        face[2] = second;
    }
}
