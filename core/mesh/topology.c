/*
 * topology.c - edges, fans, components and orientation of a triangle mesh.
 *
 * Each face has three corners c = 3 f + k, and corner c stands for the half-edge from its vertex to
 * the next one of the face. Corners are sorted by their edge (lower vertex, higher vertex) with two
 * stable counting passes; the corners of one edge are then neighbours, in the order of their faces.
 * One sweep over the edges finds
 *   - the boundary (one corner), crowded edges (more than two), and pairs that run the same way;
 *   - the fans: corners of one vertex that lie on both sides of an edge are joined in a
 *     disjoint-set forest; a vertex is manifold when its corners end up in one set;
 *   - orientability: faces are joined with a parity bit (must one of the two be turned?); a
 *     contradiction means that the surface is one-sided.
 * Components are joined through vertices: two solids that touch in a point are one component with a
 * vertex of two fans.
 */
#include "mesh_geometry.h"

/* A disjoint-set forest with parity. link[x] = 2 parent + parity of x relative to its parent; the
   root of a set is its lowest element. */
static uint32_t set_find(uint32_t *link, uint32_t x, uint32_t *parity)
{
    uint32_t relative = 0;

    while (link[x] >> 1 != x) {
        uint32_t up = link[x], beyond = link[up >> 1];

        link[x] = beyond ^ (up & 1); /* halves the path for the next time */
        relative ^= link[x] & 1;
        x = link[x] >> 1;
    }
    *parity = relative;
    return x;
}

/* Joins a and b with the given parity between them; false where that contradicts what is known. */
static bool set_join(uint32_t *link, uint32_t a, uint32_t b, uint32_t parity)
{
    uint32_t parity_a, parity_b;

    a = set_find(link, a, &parity_a);
    b = set_find(link, b, &parity_b);
    parity ^= parity_a ^ parity_b;
    if (a == b) {
        return parity == 0;
    }
    if (a < b) {
        link[b] = 2 * a + parity;
    } else {
        link[a] = 2 * b + parity;
    }
    return true;
}

static uint32_t *set_create(size_t n)
{
    uint32_t *link = srnf_alloc(n, sizeof *link);

    for (size_t i = 0; link && i < n; i++) {
        link[i] = 2 * (uint32_t)i;
    }
    return link;
}

static uint32_t corner_next(uint32_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static bool face_is_degenerate(const struct srnf_mesh *mesh, size_t face)
{
    const uint32_t *v = mesh->faces + 3 * face;

    return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

static uint32_t edge_end(const struct srnf_mesh *mesh, uint32_t corner, bool high)
{
    uint32_t from = mesh->faces[corner], to = mesh->faces[corner_next(corner)];

    return (from < to) == high ? to : from;
}

/* One stable counting pass: in[n] to out[n] by the higher or the lower vertex of each corner's
   edge. */
static void counting_pass(const struct srnf_mesh *mesh, const struct srnf_context *context,
                          bool high, const uint32_t *in, uint32_t *out, size_t n, uint32_t *start)
{
    uint32_t sum = 0;

    for (size_t v = 0; v < mesh->n_vertices; v++) {
        start[v] = 0;
    }
    for (size_t i = 0; i < n && !srnf_asks(context, i); i++) {
        start[edge_end(mesh, in[i], high)]++;
    }
    for (size_t v = 0; v < mesh->n_vertices; v++) {
        uint32_t count = start[v];

        start[v] = sum;
        sum += count;
    }
    for (size_t i = 0; i < n && !srnf_asks(context, i); i++) {
        out[start[edge_end(mesh, in[i], high)]++] = in[i];
    }
}

/* Corners of the faces that take part, sorted by edge; *n of them. NULL when memory is short. Told
   to stop, in any order. */
static uint32_t *sorted_corners(const struct srnf_mesh *mesh, const struct srnf_context *context,
                                size_t *n)
{
    uint32_t *corners = srnf_alloc(3 * mesh->n_faces, sizeof *corners);
    uint32_t *scratch = srnf_alloc(3 * mesh->n_faces, sizeof *scratch);
    uint32_t *start = srnf_alloc(mesh->n_vertices, sizeof *start);

    *n = 0;
    if (!corners || !scratch || !start) {
        srnf_free(corners);
        corners = NULL;
        goto out;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        for (size_t k = 0; k < 3 && !face_is_degenerate(mesh, f); k++) {
            corners[(*n)++] = (uint32_t)(3 * f + k);
        }
    }
    counting_pass(mesh, context, true, corners, scratch, *n, start);
    counting_pass(mesh, context, false, scratch, corners, *n, start);
out:
    srnf_free(start);
    srnf_free(scratch);
    return corners;
}

static void find_edge(const struct srnf_mesh *mesh, uint32_t corner,
                      struct srnf_edge_finding *finding)
{
    uint32_t face = corner / 3;

    if (finding->count++ == 0 || face < finding->face) {
        finding->face = face;
        finding->from = mesh->faces[corner];
        finding->to = mesh->faces[corner_next(corner)];
    }
}

/* Corner, of the same face as this half-edge, at the lower or the higher vertex of its edge. */
static uint32_t corner_at_end(const struct srnf_mesh *mesh, uint32_t corner, bool high)
{
    bool from_here = edge_end(mesh, corner, high) == mesh->faces[corner];

    return from_here ? corner : corner_next(corner);
}

/* The sweep over the edges. fans and sides are forests over corners and over faces. */
static void sweep_edges(const struct srnf_mesh *mesh, const struct srnf_context *context,
                        const uint32_t *corners, size_t n, uint32_t *fans, uint32_t *sides,
                        struct srnf_topology *topology)
{
    size_t end;

    topology->orientable = true;
    for (size_t start = 0; start < n && !srnf_asks(context, topology->edges); start = end) {
        uint32_t first = corners[start];

        for (end = start + 1;
             end < n && edge_end(mesh, corners[end], false) == edge_end(mesh, first, false) &&
             edge_end(mesh, corners[end], true) == edge_end(mesh, first, true) &&
             !srnf_asks(context, end - start);
             end++) {
            (void)set_join(fans, corner_at_end(mesh, first, false),
                           corner_at_end(mesh, corners[end], false), 0);
            (void)set_join(fans, corner_at_end(mesh, first, true),
                           corner_at_end(mesh, corners[end], true), 0);
        }
        topology->edges++;
        if (end - start == 1) {
            find_edge(mesh, first, &topology->boundary);
        } else if (end - start > 2) {
            find_edge(mesh, first, &topology->crowded);
        } else {
            bool disagree = mesh->faces[first] == mesh->faces[corners[start + 1]];

            if (disagree) {
                find_edge(mesh, first, &topology->disagreeing);
            }
            if (!set_join(sides, first / 3, corners[start + 1] / 3, disagree)) {
                topology->orientable = false;
            }
        }
    }
}

/* Vertices that take part, and those whose corners form several sets. fan_count[v] saturates at
   2. */
static void count_fans(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       const uint32_t *fans, uint8_t *fan_count, struct srnf_topology *topology)
{
    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(context, c); c++) {
        uint8_t *count = &fan_count[mesh->faces[c]];

        if (fans[c] >> 1 == c && !face_is_degenerate(mesh, c / 3)) {
            *count = *count < 2 ? (uint8_t)(*count + 1) : 2;
        }
    }
    for (size_t v = 0; v < mesh->n_vertices; v++) {
        topology->vertices += fan_count[v] > 0;
        if (fan_count[v] > 1 && topology->split_vertices++ == 0) {
            topology->first_split_vertex = (uint32_t)v;
        }
    }
}

static void count_components(const struct srnf_mesh *mesh, const struct srnf_context *context,
                             uint32_t *joined, struct srnf_topology *topology)
{
    uint32_t parity, root, first_root = 0;
    bool elsewhere = false;

    for (size_t f = 0; f < mesh->n_faces && !srnf_asks(context, f); f++) {
        const uint32_t *v = mesh->faces + 3 * f;

        if (face_is_degenerate(mesh, f)) {
            if (topology->degenerate_faces++ == 0) {
                topology->first_degenerate_face = (uint32_t)f;
            }
            continue;
        }
        topology->faces++;
        (void)set_join(joined, v[0], v[1], 0);
        (void)set_join(joined, v[0], v[2], 0);
    }
    for (size_t f = 0, seen = 0; f < mesh->n_faces && !srnf_asks(context, f); f++) {
        if (face_is_degenerate(mesh, f)) {
            continue;
        }
        root = set_find(joined, mesh->faces[3 * f], &parity);
        if (seen++ == 0) {
            first_root = root;
            topology->first_face = (uint32_t)f;
        } else if (root != first_root && !elsewhere) {
            elsewhere = true;
            topology->first_face_elsewhere = (uint32_t)f;
        }
    }
}

int srnf_topology_analyse(const struct srnf_mesh *mesh, const struct srnf_context *context,
                          struct srnf_topology *topology)
{
    size_t n;
    uint32_t *corners = sorted_corners(mesh, context, &n);
    uint32_t *fans = set_create(3 * mesh->n_faces);
    uint32_t *sides = set_create(mesh->n_faces);
    uint32_t *joined = set_create(mesh->n_vertices);
    uint8_t *fan_count = srnf_alloc(mesh->n_vertices, sizeof *fan_count);
    int status = SRNF_ENOMEM;

    *topology = (struct srnf_topology){0};
    if (!corners || !fans || !sides || !joined || !fan_count) {
        goto out;
    }
    sweep_edges(mesh, context, corners, n, fans, sides, topology);
    count_fans(mesh, context, fans, fan_count, topology);
    count_components(mesh, context, joined, topology);
    for (size_t v = 0; v < mesh->n_vertices; v++) {
        topology->components += fan_count[v] > 0 && joined[v] >> 1 == v;
    }
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(fan_count);
    srnf_free(joined);
    srnf_free(sides);
    srnf_free(fans);
    srnf_free(corners);
    return status;
}

int srnf_topology_fans(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       uint32_t *fans)
{
    struct srnf_topology unused = {0};
    size_t n;
    uint32_t *corners = sorted_corners(mesh, context, &n);
    uint32_t *links = set_create(3 * mesh->n_faces);
    uint32_t *sides = set_create(mesh->n_faces);
    int status = SRNF_ENOMEM;

    if (!corners || !links || !sides) {
        goto out;
    }
    sweep_edges(mesh, context, corners, n, links, sides, &unused);
    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(context, c); c++) {
        uint32_t parity;

        fans[c] = set_find(links, (uint32_t)c, &parity);
    }
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(sides);
    srnf_free(links);
    srnf_free(corners);
    return status;
}

int srnf_topology_opposites(const struct srnf_mesh *mesh, const struct srnf_context *context,
                            uint32_t boundary, uint32_t crowded, uint32_t *opposite)
{
    size_t n, end, edges = 0;
    uint32_t *corners = sorted_corners(mesh, context, &n);

    if (!corners) {
        return SRNF_ENOMEM;
    }
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        opposite[c] = crowded;
    }
    for (size_t start = 0; start < n && !srnf_asks(context, edges); start = end, edges++) {
        uint32_t first = corners[start];

        for (end = start + 1;
             end < n && edge_end(mesh, corners[end], false) == edge_end(mesh, first, false) &&
             edge_end(mesh, corners[end], true) == edge_end(mesh, first, true);
             end++) {
        }
        if (end - start == 1) {
            opposite[first] = boundary;
        } else if (end - start == 2) {
            opposite[first] = corners[start + 1];
            opposite[corners[start + 1]] = first;
        }
    }
    srnf_free(corners);
    return srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
}
