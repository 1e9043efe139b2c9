/*
 * fold.c - faces that lie back to back, and whether one of them is the surface after all.
 *
 * Two faces over the same three vertices that run opposite ways cancel: a flap without thickness,
 * or a wall between two solids, and both go. A face that a program wrote twice, once in reverse, is
 * the surface itself, and without both of them it is a hole. What tells them apart is the faces
 * around: call the sum of the runs of an edge, +1 and -1 for its two ways, over all faces but the
 * cancelled ones, its balance. It is 0 around a flap or a wall; on the rim of a hole it is not.
 *
 * Cancelled pairs that meet in edges with no other face make a patch. One face of each pair is
 * kept, all turned alike, if that brings more edges of the patch's rim to balance 0 than it takes
 * away from it; of the two ways round, the one with the better count. O(n log n) in the faces
 * around the pairs.
 */
#include "mesh_geometry.h"

#include <string.h>

#define NONE UINT32_MAX

struct fold {
    const struct srnf_mesh *mesh;
    const struct srnf_context *context; /* may be NULL */
    const uint32_t (*pairs)[2];         /* [n]: two faces, one each way round */
    size_t n;
    uint32_t *pair_of;    /* [faces]: the pair that the face is the first of, or NONE */
    uint32_t *edges;      /* corners: the edge from that corner to the next, sorted by its ends */
    size_t n_edges;       /* of faces that stay, and of first faces */
    uint32_t *across;     /* [3 n]: the edge of a pair that this one meets alone, or NONE */
    signed char *balance; /* [3 n]: of the edges on a rim, as the first face runs them */
    signed char *way;     /* [n]: 0 not seen; 1 as the first face, -1 as the second */
    uint32_t *queue;      /* [n] */
};

static uint32_t next_corner(uint32_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/* The ends of an edge, the lower first; true where it runs up. */
static bool edge_ends(const struct srnf_mesh *mesh, uint32_t corner, uint32_t ends[2])
{
    uint32_t from = mesh->faces[corner], to = mesh->faces[next_corner(corner)];

    ends[0] = from < to ? from : to;
    ends[1] = from < to ? to : from;
    return from < to;
}

static bool edge_less(const void *context, uint32_t a, uint32_t b)
{
    uint32_t p[2], q[2];

    (void)edge_ends(context, a, p);
    (void)edge_ends(context, b, q);
    return p[0] != q[0] ? p[0] < q[0] : p[1] < q[1];
}

static bool is_pair(const struct fold *fold, uint32_t corner)
{
    return fold->pair_of[corner / 3] != NONE;
}

/* Where the edge at a corner of a first face stands in across and balance. */
static size_t slot(const struct fold *fold, uint32_t corner)
{
    return 3 * (size_t)fold->pair_of[corner / 3] + corner % 3;
}

/* The edges between vertices of pairs, of faces that stay and of the first of each pair. */
static void collect_edges(struct fold *fold, const bool *keep, bool *touched)
{
    const struct srnf_mesh *mesh = fold->mesh;

    memset(fold->pair_of, 0xff, mesh->n_faces * sizeof *fold->pair_of);
    for (size_t i = 0; i < fold->n; i++) {
        const uint32_t *face = mesh->faces + 3 * (size_t)fold->pairs[i][0];

        fold->pair_of[fold->pairs[i][0]] = (uint32_t)i;
        touched[face[0]] = touched[face[1]] = touched[face[2]] = true;
    }
    for (size_t c = 0; c < 3 * mesh->n_faces && !srnf_asks(fold->context, c); c++) {
        if ((keep[c / 3] || is_pair(fold, (uint32_t)c)) && touched[mesh->faces[c]] &&
            touched[mesh->faces[next_corner((uint32_t)c)]]) {
            fold->edges[fold->n_edges++] = (uint32_t)c;
        }
    }
}

/* One edge, of all faces that have it: where two pairs meet alone, or the balance of the others. */
static void look_at_edge(struct fold *fold, const uint32_t *corners, size_t count)
{
    uint32_t ends[2], of_pairs[2] = {NONE, NONE};
    size_t pairs = 0;
    int up = 0;

    for (size_t i = 0; i < count; i++) {
        if (is_pair(fold, corners[i])) {
            of_pairs[pairs < 2 ? pairs : 1] = corners[i];
            pairs++;
        } else {
            up += edge_ends(fold->mesh, corners[i], ends) ? 1 : -1;
        }
    }
    if (pairs == 2 && count == 2) {
        fold->across[slot(fold, of_pairs[0])] = of_pairs[1];
        fold->across[slot(fold, of_pairs[1])] = of_pairs[0];
    } else if (pairs == 1 && (up == 1 || up == -1)) {
        bool runs_up = edge_ends(fold->mesh, of_pairs[0], ends);

        fold->balance[slot(fold, of_pairs[0])] = (signed char)(runs_up ? up : -up);
    }
}

/* The pairs that hang together with one, each turned as that one's first face: fold->queue holds
   them, from 0. False where the patch has no two sides. */
static bool gather_patch(struct fold *fold, size_t seed, size_t *count)
{
    bool two_sided = true;

    *count = 1;
    fold->queue[0] = (uint32_t)seed;
    fold->way[seed] = 1;
    for (size_t i = 0; i < *count && !srnf_asks(fold->context, i); i++) {
        size_t pair = fold->queue[i];

        for (uint32_t k = 0; k < 3; k++) {
            uint32_t other = fold->across[3 * pair + k], ends[2];
            bool along;
            size_t next;
            signed char way;

            if (other == NONE) {
                continue;
            }
            next = fold->pair_of[other / 3];
            along = edge_ends(fold->mesh, 3 * fold->pairs[pair][0] + k, ends) ==
                    edge_ends(fold->mesh, other, ends);
            way = along ? (signed char)-fold->way[pair] : fold->way[pair];
            if (fold->way[next] == 0) {
                fold->way[next] = way;
                fold->queue[(*count)++] = (uint32_t)next;
            } else if (fold->way[next] != way) {
                two_sided = false;
            }
        }
    }
    return two_sided;
}

/* Edges of the rim that the patch closes, less those that it opens, when it is turned that way. */
static long gain_of_patch(const struct fold *fold, size_t count, int way)
{
    long gain = 0;

    for (size_t i = 0; i < count; i++) {
        size_t pair = fold->queue[i];

        for (size_t k = 0; k < 3; k++) {
            if (fold->across[3 * pair + k] == NONE) {
                gain += fold->balance[3 * pair + k] == -way * fold->way[pair] ? 1 : -1;
            }
        }
    }
    return gain;
}

static void judge_patches(struct fold *fold, bool *keep, struct srnf_mesh_repairs *repairs)
{
    for (size_t seed = 0; seed < fold->n && !srnf_asks(fold->context, seed); seed++) {
        size_t count;
        long as_it_is, turned;

        if (fold->way[seed] != 0 || !gather_patch(fold, seed, &count)) {
            continue;
        }
        as_it_is = gain_of_patch(fold, count, 1);
        turned = gain_of_patch(fold, count, -1);
        if (as_it_is <= 0 && turned <= 0) {
            continue;
        }
        for (size_t i = 0; i < count; i++) {
            size_t pair = fold->queue[i];
            bool first = (fold->way[pair] > 0) == (as_it_is >= turned);

            keep[fold->pairs[pair][first ? 0 : 1]] = true;
        }
        repairs->folded_faces_dropped -= count;
    }
}

int srnf_repair_keep_folded(const struct srnf_mesh *mesh, const uint32_t (*pairs)[2], size_t n,
                            const struct srnf_context *context, bool *keep,
                            struct srnf_mesh_repairs *repairs)
{
    struct fold fold = {.mesh = mesh, .context = context, .pairs = pairs, .n = n};
    bool *touched = srnf_alloc(mesh->n_vertices, sizeof *touched);
    uint32_t *scratch = srnf_alloc(3 * mesh->n_faces, sizeof *scratch);
    int status = SRNF_ENOMEM;

    fold.pair_of = srnf_alloc(mesh->n_faces, sizeof *fold.pair_of);
    fold.edges = srnf_alloc(3 * mesh->n_faces, sizeof *fold.edges);
    fold.across = srnf_alloc(3 * n, sizeof *fold.across);
    fold.balance = srnf_alloc(3 * n, sizeof *fold.balance);
    fold.way = srnf_alloc(n, sizeof *fold.way);
    fold.queue = srnf_alloc(n, sizeof *fold.queue);
    if (!touched || !scratch || !fold.pair_of || !fold.edges || !fold.across || !fold.balance ||
        !fold.way || !fold.queue) {
        goto out;
    }
    collect_edges(&fold, keep, touched);
    memset(fold.across, 0xff, 3 * n * sizeof *fold.across);
    srnf_sort_order(fold.edges, scratch, fold.n_edges, edge_less, mesh, context);
    for (size_t i = 0, end, edges = 0; i < fold.n_edges && !srnf_asks(context, edges);
         i = end, edges++) {
        for (end = i + 1; end < fold.n_edges && !edge_less(mesh, fold.edges[i], fold.edges[end]);
             end++) {
        }
        look_at_edge(&fold, fold.edges + i, end - i);
    }
    judge_patches(&fold, keep, repairs);
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
out:
    srnf_free(fold.queue);
    srnf_free(fold.way);
    srnf_free(fold.balance);
    srnf_free(fold.across);
    srnf_free(fold.edges);
    srnf_free(fold.pair_of);
    srnf_free(scratch);
    srnf_free(touched);
    return status;
}
