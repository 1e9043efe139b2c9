/*
 * repair.c - the repairs of a mesh that lose nothing: joining equal vertices, dropping those that
 * no face names and faces that are none, giving fans that touch in a point a vertex each, turning
 * all faces.
 *
 * Vertices and faces that stay keep their order, so that the result depends on nothing but the
 * input. Memory of the dropped ones is kept until the mesh is cleared. Where each vertex comes from
 * and face comes from goes along, in a struct srnf_mesh_origin. A mesh whose repair was told to
 * stop can only be cleared.
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

void srnf_repair_compact(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                         const struct srnf_context *context, const bool *keep, uint32_t *rename)
{
    size_t kept = 0;

    for (size_t i = 0; i < mesh->n_vertices && !srnf_asks(context, i); i++) {
        if (keep[i]) {
            memmove(mesh->vertices + 3 * kept, mesh->vertices + 3 * i, 3 * sizeof(double));
            origin->vertices[kept] = origin->vertices[i];
            rename[i] = (uint32_t)kept++;
        } else {
            rename[i] = rename[rename[i]]; /* the one that stands for it came earlier */
        }
    }
    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(context, c); c++) {
        mesh->faces[c] = rename[mesh->faces[c]];
    }
    mesh->n_vertices = kept;
}

/*
 * Joins vertices with equal coordinates (-0 equals 0) into the first of each group. Sorting, not
 * hashing: no input makes it slow. O(n log n).
 */
int srnf_repair_merge_vertices(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                               const struct srnf_context *context, size_t *merged)
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
    srnf_sort_order(order, rename, n, vertex_less, mesh->vertices, context);
    for (size_t i = 0; i < n && !srnf_asks(context, i); i++) {
        /* The sort is stable: the first of a group has the lowest index. */
        bool first = i == 0 || vertex_less(mesh->vertices, order[i - 1], order[i]);

        keep[order[i]] = first;
        rename[order[i]] = first ? order[i] : rename[order[i - 1]];
        *merged += !first;
    }
    srnf_repair_compact(mesh, origin, context, keep, rename);
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(keep);
    srnf_free(rename);
    srnf_free(order);
    return status;
}

int srnf_repair_drop_unreferenced(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                                  const struct srnf_context *context, size_t *dropped)
{
    size_t n = mesh->n_vertices;
    uint32_t *rename = srnf_alloc(n, sizeof *rename);
    bool *keep = srnf_alloc(n, sizeof *keep);
    int status = SRNF_ENOMEM;

    *dropped = 0;
    if (!rename || !keep) {
        goto out;
    }
    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(context, c); c++) {
        keep[mesh->faces[c]] = true;
    }
    for (size_t i = 0; i < n; i++) {
        *dropped += !keep[i];
    }
    if (*dropped > 0) {
        srnf_repair_compact(mesh, origin, context, keep, rename);
    }
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(keep);
    srnf_free(rename);
    return status;
}

/* ---- Faces that are none --------------------------------------------------------------------- */

/* The corners of a face from the lowest on, and whether going round it that way is going up: the
   two ways round three vertices. */
static bool sorted_face(const struct srnf_mesh *mesh, uint32_t face, uint32_t v[3])
{
    const uint32_t *corners = mesh->faces + 3 * (size_t)face;
    size_t low = corners[1] < corners[0] ? 1 : 0;
    uint32_t second, third;

    low = corners[2] < corners[low] ? 2 : low;
    second = corners[(low + 1) % 3];
    third = corners[(low + 2) % 3];
    v[0] = corners[low];
    v[1] = second < third ? second : third;
    v[2] = second < third ? third : second;
    return second < third;
}

/* By the two higher corners; among faces of one lowest corner. */
static bool face_less(const void *context, uint32_t a, uint32_t b)
{
    uint32_t v[3], w[3];

    (void)sorted_face(context, a, v);
    (void)sorted_face(context, b, w);
    return v[1] != w[1] ? v[1] < w[1] : v[2] < w[2];
}

static bool same_corners(const struct srnf_mesh *mesh, uint32_t a, uint32_t b)
{
    uint32_t v[3], w[3];

    (void)sorted_face(mesh, a, v);
    (void)sorted_face(mesh, b, w);
    return v[0] == w[0] && v[1] == w[1] && v[2] == w[2];
}

/* Of `count` faces with the same corners, one stays where more go one way round than the other, the
   first of those; none where they cancel: then pair gets the first face each way round. Returns
   whether they cancel. */
static bool judge_group(const struct srnf_mesh *mesh, const uint32_t *group, size_t count,
                        bool *keep, uint32_t pair[2], struct srnf_mesh_repairs *repairs)
{
    uint32_t v[3];
    size_t up = 0, down;
    bool more_up;

    for (size_t i = 0; i < count; i++) {
        up += sorted_face(mesh, group[i], v);
    }
    down = count - up;
    more_up = up > down;
    repairs->folded_faces_dropped += 2 * (more_up ? down : up);
    if (up != down) {
        repairs->duplicate_faces_dropped += (more_up ? up - down : down - up) - 1;
    }
    for (size_t i = 0, kept = up == down; i < count; i++) {
        keep[group[i]] = !kept && sorted_face(mesh, group[i], v) == more_up;
        kept = kept || keep[group[i]];
    }
    for (size_t i = count; up == down && i-- > 0;) {
        pair[sorted_face(mesh, group[i], v)] = group[i];
    }
    return up == down;
}

/* Faces that take part, sorted by their corners: by counting for the lowest one, by merging among
   those that share it. Returns how many. */
static size_t sort_faces(const struct srnf_mesh *mesh, const struct srnf_context *context,
                         const bool *keep, uint32_t *start, uint32_t *order, uint32_t *scratch)
{
    uint32_t v[3], sum = 0;

    for (size_t f = 0; f < mesh->n_faces && !srnf_asks(context, f); f++) {
        if (keep[f]) {
            (void)sorted_face(mesh, (uint32_t)f, v);
            start[v[0]]++;
        }
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        uint32_t count = start[i];

        start[i] = sum;
        sum += count;
    }
    for (size_t f = 0; f < mesh->n_faces && !srnf_asks(context, f); f++) {
        if (keep[f]) {
            (void)sorted_face(mesh, (uint32_t)f, v);
            order[start[v[0]]++] = (uint32_t)f;
        }
    }
    for (size_t i = 0, begin = 0; i < mesh->n_vertices && !srnf_asks(context, i);
         begin = start[i++]) {
        srnf_sort_order(order + begin, scratch, start[i] - begin, face_less, mesh, context);
    }
    return sum;
}

static bool face_is_collapsed(const struct srnf_mesh *mesh, size_t face)
{
    const uint32_t *v = mesh->faces + 3 * face;

    return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

/*
 * Drops faces that name a vertex twice, whose neighbours meet without them; of faces with the same
 * three vertices all but one that go the same way round; and all of those that lie back to back, as
 * many one way as the other: a flap without thickness, or a wall between two solids. Every edge
 * loses as many faces that run it one way as the other. Where that leaves a hole, one of them stays
 * (fold.c). O(n log n).
 */
int srnf_repair_drop_faces(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                           const struct srnf_context *context, struct srnf_mesh_repairs *repairs)
{
    size_t n = mesh->n_faces, sorted, end, kept = 0, n_pairs = 0;
    uint32_t(*pairs)[2] = srnf_alloc(n / 2 + 1, sizeof *pairs);
    uint32_t *start = srnf_alloc(mesh->n_vertices, sizeof *start);
    uint32_t *order = srnf_alloc(n, sizeof *order);
    uint32_t *scratch = srnf_alloc(n, sizeof *scratch);
    bool *keep = srnf_alloc(n, sizeof *keep);
    int status = SRNF_ENOMEM;

    if (!pairs || !start || !order || !scratch || !keep) {
        goto out;
    }
    for (size_t f = 0; f < n && !srnf_asks(context, f); f++) {
        keep[f] = !face_is_collapsed(mesh, f);
        repairs->collapsed_faces_dropped += !keep[f];
    }
    sorted = sort_faces(mesh, context, keep, start, order, scratch);
    for (size_t i = 0, groups = 0; i < sorted && !srnf_asks(context, groups); i = end, groups++) {
        for (end = i + 1; end < sorted && same_corners(mesh, order[i], order[end]); end++) {
        }
        n_pairs +=
            end - i > 1 && judge_group(mesh, order + i, end - i, keep, pairs[n_pairs], repairs);
    }
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    if (status == SRNF_OK && n_pairs > 0) {
        status = srnf_repair_keep_folded(mesh, (const uint32_t(*)[2])pairs, n_pairs, context, keep,
                                         repairs);
    }
    for (size_t f = 0; f < n && status == SRNF_OK; f++) {
        if (keep[f]) {
            memmove(mesh->faces + 3 * kept, mesh->faces + 3 * f, 3 * sizeof *mesh->faces);
            origin->faces[kept++] = origin->faces[f];
        }
    }
    mesh->n_faces = status == SRNF_OK ? kept : n;
out:
    srnf_free(keep);
    srnf_free(scratch);
    srnf_free(order);
    srnf_free(start);
    srnf_free(pairs);
    return status;
}

/* ---- Fans ------------------------------------------------------------------------------------ */

/* New numbers for the fans of each vertex but its first: corner c of the mesh gets name[c]. Returns
   how many new vertices that takes. name holds fans (srnf_topology_fans) before. */
static size_t name_fans(const struct srnf_mesh *mesh, const struct srnf_context *context,
                        uint32_t *name, bool *taken)
{
    size_t extra = 0;

    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(context, c); c++) {
        uint32_t vertex = mesh->faces[c];

        if (name[c] != c) {
            name[c] = name[name[c]]; /* the first corner of a fan is the lowest one */
        } else if (taken[vertex]) {
            name[c] = (uint32_t)(mesh->n_vertices + extra++);
        } else {
            taken[vertex] = true;
            name[c] = vertex;
        }
    }
    return extra;
}

/*
 * Gives every fan of faces a vertex of its own, at the same place: a surface that touches itself in
 * points becomes a manifold. The edges must have two faces each. origin->vertices may move; split
 * counts the vertices that came to it.
 */
int srnf_repair_split_fans(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                           const struct srnf_context *context, size_t *split)
{
    size_t n = mesh->n_vertices, corners = 3 * mesh->n_faces;
    uint32_t *name = srnf_alloc(corners, sizeof *name);
    bool *taken = srnf_alloc(n, sizeof *taken);
    double *vertices = NULL;
    uint32_t *traced = NULL;
    int status = SRNF_ENOMEM;

    if (!name || !taken) {
        goto out;
    }
    status = srnf_topology_fans(mesh, context, name);
    if (status == SRNF_OK) {
        *split = name_fans(mesh, context, name, taken);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    if (status != SRNF_OK) {
        goto out;
    }
    status = SRNF_ENOMEM;
    vertices = srnf_alloc(3 * (n + *split), sizeof *vertices);
    traced = srnf_alloc(n + *split, sizeof *traced);
    if (!vertices || !traced) {
        srnf_free(vertices);
        srnf_free(traced);
        goto out;
    }
    memcpy(vertices, mesh->vertices, 3 * n * sizeof *vertices);
    memcpy(traced, origin->vertices, n * sizeof *traced);
    for (size_t c = 0; c < corners && !srnf_asks(context, c); c++) {
        uint32_t from = mesh->faces[c];

        memcpy(vertices + 3 * (size_t)name[c], mesh->vertices + 3 * (size_t)from,
               3 * sizeof *vertices);
        traced[name[c]] = origin->vertices[from];
        mesh->faces[c] = name[c];
    }
    srnf_free(mesh->vertices);
    srnf_free(origin->vertices);
    mesh->vertices = vertices;
    mesh->n_vertices = n + *split;
    origin->vertices = traced;
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(taken);
    srnf_free(name);
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
