/*
 * ball.c - from any set of voxels to a topological ball.
 *
 * The largest component stays, cavities are filled. Then there are two ways (Z. Aktouf, G. Bertrand
 * and L. Perroton, "A three-dimensional holes closing algorithm", Pattern Recognition Letters 23
 * (2002), and homotopic growing as for cortices in J.-F. Mangin and others, "From 3D magnetic
 * resonance images to structural representations of the cortex topography using topology preserving
 * deformations", J. Math. Imaging and Vision 5 (1995)):
 *
 *   growing  from the deepest voxel, simple voxels of the set are added, deep ones first. What is
 *            left are walls of one voxel where fronts met: handles are cut where they are thinnest.
 *   carving  from the whole box, simple voxels outside the set are removed, distant ones first.
 * What
 *            is left are membranes across the tunnels.
 *
 * The one that changes fewer voxels is taken. Both start with a ball and change it by simple voxels
 * alone (simple.c), so the result is one. Depth is the chamfer distance in the spacing of the
 * voxels. Cost O(n log n) for n voxels of the box.
 */
#include "topology.h"

#include <math.h>
#include <string.h>

#define FAR 1e30f

/* A heap of voxels, the one of the largest key first; of equal keys the one that came first, so
   that fronts meet midway and not where indices say. */
struct heap {
    size_t count;
    uint32_t *order; /* [voxels of the box]: when it came */
    uint32_t came;
    uint32_t *items;
    const float *key;
    unsigned char *queued; /* [voxels of the box] */
};

struct ball {
    struct voxel_box *box;
    const struct srnf_context *context;
    struct simple_tables tables;
    struct heap heap;
    float *depth;
    uint32_t *stack;
    unsigned char *grown, *carved;
    size_t asked;
};

static bool asks(struct ball *ball)
{
    return srnf_asks(ball->context, ball->asked++);
}

/* ---- Heap ------------------------------------------------------------------------------------ */

static bool before(const struct heap *heap, uint32_t a, uint32_t b)
{
    return heap->key[a] > heap->key[b] ||
           (heap->key[a] >= heap->key[b] && heap->order[a] < heap->order[b]);
}

static void heap_push(struct heap *heap, uint32_t item)
{
    size_t at = heap->count++;

    heap->queued[item] = 1;
    heap->order[item] = heap->came++;
    while (at > 0 && before(heap, item, heap->items[(at - 1) / 2])) {
        heap->items[at] = heap->items[(at - 1) / 2];
        at = (at - 1) / 2;
    }
    heap->items[at] = item;
}

static uint32_t heap_pop(struct heap *heap)
{
    uint32_t first = heap->items[0], last = heap->items[--heap->count];
    size_t at = 0;

    for (size_t child = 1; child < heap->count; child = 2 * at + 1) {
        if (child + 1 < heap->count && before(heap, heap->items[child + 1], heap->items[child])) {
            child++;
        }
        if (!before(heap, heap->items[child], last)) {
            break;
        }
        heap->items[at] = heap->items[child];
        at = child;
    }
    heap->items[at] = last;
    heap->queued[first] = 0;
    return first;
}

/* ---- Components ------------------------------------------------------------------------------ */

/* Turns the component of the voxel from one state into another; returns its size, 0 if canceled. */
static size_t paint(struct ball *ball, size_t seed, unsigned char from, unsigned char to,
                    int distance)
{
    unsigned char *voxels = ball->box->voxels;
    size_t n = 0, top = 0;

    voxels[seed] = to;
    ball->stack[top++] = (uint32_t)seed;
    while (top > 0) {
        size_t at = ball->stack[--top];

        n++;
        if (asks(ball)) {
            return 0;
        }
        for (size_t b = 0; b < 27; b++) {
            size_t beside = at + (size_t)ball->tables.offset[b];
            int steps = (b % 3 != 1) + (b / 3 % 3 != 1) + (b / 9 != 1);

            if (steps <= distance && voxels[beside] == from) {
                voxels[beside] = to;
                ball->stack[top++] = (uint32_t)beside;
            }
        }
    }
    return n;
}

static void note(struct voxel_box *box, size_t at, enum srnf_change change)
{
    box->changes[at] = (unsigned char)(change + 1);
}

static int keep_largest(struct ball *ball)
{
    unsigned char *voxels = ball->box->voxels;
    size_t most = 0, seed = 0;

    for (size_t i = 0; i < ball->box->count; i++) {
        if (voxels[i] == VOXEL_IN) {
            size_t n = paint(ball, i, VOXEL_IN, VOXEL_SEEN, 2);

            if (n == 0) {
                return SRNF_ECANCELED;
            }
            seed = n > most ? i : seed;
            most = n > most ? n : most;
        }
    }
    if (paint(ball, seed, VOXEL_SEEN, VOXEL_KEPT, 2) == 0) {
        return SRNF_ECANCELED;
    }
    for (size_t i = 0; i < ball->box->count; i++) {
        if (voxels[i] == VOXEL_SEEN) {
            voxels[i] = VOXEL_OUT;
            note(ball->box, i, SRNF_CHANGE_ISLAND);
        } else if (voxels[i] == VOXEL_KEPT) {
            voxels[i] = VOXEL_IN;
        }
    }
    return SRNF_OK;
}

static int fill_cavities(struct ball *ball)
{
    const struct voxel_box *box = ball->box;
    unsigned char *voxels = box->voxels;

    /* The voxel inside the wall's first corner is of the empty layer. */
    if (paint(ball, box->stride[0] + box->stride[1] + box->stride[2], VOXEL_OUT, VOXEL_SEEN, 1) ==
        0) {
        return SRNF_ECANCELED;
    }
    for (size_t i = 0; i < box->count; i++) {
        if (voxels[i] == VOXEL_OUT) {
            voxels[i] = VOXEL_IN;
            /* A hole in an island is background again when that is removed: no change at all. */
            if (box->changes[i]) {
                box->changes[i] = 0;
            } else {
                note(ball->box, i, SRNF_CHANGE_CAVITY);
            }
        } else if (voxels[i] == VOXEL_SEEN) {
            voxels[i] = VOXEL_OUT;
        }
    }
    return SRNF_OK;
}

/* ---- Depth ----------------------------------------------------------------------------------- */

/* Chamfer distance of the voxels in the set, or of those outside, to the nearest of the others; 0
   at those. The wall is far from everything. Two passes, over the neighbours before a voxel and
   over those behind it. */
static int measure_depth(struct ball *ball, bool inside)
{
    const struct voxel_box *box = ball->box;
    float weight[27];

    for (size_t b = 0; b < 27; b++) {
        double sum = 0.0;

        for (size_t k = 0, power = 1; k < 3; k++, power *= 3) {
            sum += b / power % 3 != 1 ? box->spacing[k] * box->spacing[k] : 0.0;
        }
        weight[b] = (float)sqrt(sum);
    }
    for (size_t i = 0; i < box->count; i++) {
        ball->depth[i] = (box->voxels[i] == VOXEL_IN) == inside ? FAR : 0.0f;
        ball->depth[i] = box->voxels[i] == VOXEL_WALL ? FAR : ball->depth[i];
    }
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t n = 0; n < box->count; n++) {
            size_t i = pass ? box->count - 1 - n : n;

            if (asks(ball)) {
                return SRNF_ECANCELED;
            }
            if (box->voxels[i] == VOXEL_WALL) {
                continue;
            }
            for (size_t b = pass ? 14 : 0; ball->depth[i] > 0.0f && b < (pass ? 27u : 13u); b++) {
                float there = ball->depth[i + (size_t)ball->tables.offset[b]] + weight[b];

                ball->depth[i] = there < ball->depth[i] ? there : ball->depth[i];
            }
        }
    }
    return SRNF_OK;
}

/* ---- Growing and carving --------------------------------------------------------------------- */

/* Queues the neighbours that may still change: those of the box's state `source` that are `from` in
   the set. */
static void queue_around(struct ball *ball, const unsigned char *set, size_t at,
                         unsigned char source, unsigned char from)
{
    for (size_t b = 0; b < 27; b++) {
        size_t beside = at + (size_t)ball->tables.offset[b];

        if (b != 13 && ball->box->voxels[beside] == source && set[beside] == from &&
            !ball->heap.queued[beside]) {
            heap_push(&ball->heap, (uint32_t)beside);
        }
    }
}

/* Changes simple voxels of the set, in the order of the heap, as long as there are any. */
static int change_simple(struct ball *ball, unsigned char *set, unsigned char source,
                         unsigned char from, unsigned char to)
{
    while (ball->heap.count > 0) {
        size_t at = heap_pop(&ball->heap);

        if (asks(ball)) {
            return SRNF_ECANCELED;
        }
        if (set[at] == from && simple_voxel(&ball->tables, set, at)) {
            set[at] = to;
            queue_around(ball, set, at, source, from);
        }
    }
    return SRNF_OK;
}

static int grow(struct ball *ball)
{
    const struct voxel_box *box = ball->box;
    size_t seed = 0;
    int status = measure_depth(ball, true);

    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < box->count; i++) {
        bool deeper = box->voxels[i] == VOXEL_IN &&
                      (box->voxels[seed] != VOXEL_IN || ball->depth[i] > ball->depth[seed]);

        seed = deeper ? i : seed;
        ball->grown[i] = box->voxels[i] == VOXEL_WALL ? VOXEL_WALL : VOXEL_OUT;
    }
    ball->grown[seed] = VOXEL_IN;
    queue_around(ball, ball->grown, seed, VOXEL_IN, VOXEL_OUT);
    return change_simple(ball, ball->grown, VOXEL_IN, VOXEL_OUT, VOXEL_IN);
}

static int carve(struct ball *ball)
{
    const struct voxel_box *box = ball->box;
    int status = measure_depth(ball, false);

    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < box->count; i++) {
        ball->carved[i] = box->voxels[i] == VOXEL_WALL ? VOXEL_WALL : VOXEL_IN;
    }
    for (size_t i = 0; i < box->count; i++) {
        if (box->voxels[i] == VOXEL_WALL) {
            continue;
        }
        for (size_t b = 0; b < 27 && box->voxels[i] == VOXEL_OUT && !ball->heap.queued[i]; b++) {
            if (box->voxels[i + (size_t)ball->tables.offset[b]] == VOXEL_WALL) {
                heap_push(&ball->heap, (uint32_t)i);
            }
        }
    }
    return change_simple(ball, ball->carved, VOXEL_OUT, VOXEL_IN, VOXEL_OUT);
}

static size_t differences(const struct voxel_box *box, const unsigned char *set)
{
    size_t n = 0;

    for (size_t i = 0; i < box->count; i++) {
        n += set[i] != box->voxels[i];
    }
    return n;
}

/* Takes the set over, and notes what differs. A voxel that was an island's, and is within the ball
   again, was not changed. */
static void take(struct voxel_box *box, const unsigned char *set)
{
    for (size_t i = 0; i < box->count; i++) {
        if (set[i] == box->voxels[i]) {
            continue;
        }
        if (box->changes[i]) {
            box->changes[i] = 0;
        } else {
            note(box, i, set[i] == VOXEL_IN ? SRNF_CHANGE_FILLED : SRNF_CHANGE_CUT);
        }
        box->voxels[i] = set[i];
    }
}

static int open_ball(struct ball *ball, struct voxel_box *box, const struct srnf_context *context)
{
    *ball = (struct ball){.box = box, .context = context};
    simple_tables_fill(&ball->tables, box);
    ball->depth = srnf_alloc(box->count, sizeof *ball->depth);
    ball->stack = srnf_alloc(box->count, sizeof *ball->stack);
    ball->grown = srnf_alloc(box->count, 1);
    ball->carved = srnf_alloc(box->count, 1);
    ball->heap = (struct heap){.items = ball->stack, /* components are done by then */
                               .key = ball->depth,
                               .order = srnf_alloc(box->count, sizeof *ball->heap.order),
                               .queued = srnf_alloc(box->count, 1)};
    return ball->depth && ball->stack && ball->grown && ball->carved && ball->heap.order &&
                   ball->heap.queued
               ? SRNF_OK
               : SRNF_ENOMEM;
}

int voxels_to_ball(struct voxel_box *box, const struct srnf_context *context)
{
    struct ball ball;
    size_t cut, filled = SIZE_MAX;
    int status = open_ball(&ball, box, context);

    status = status == SRNF_OK ? keep_largest(&ball) : status;
    status = status == SRNF_OK ? fill_cavities(&ball) : status;
    status = status == SRNF_OK ? grow(&ball) : status;
    if (status == SRNF_OK) {
        cut = differences(box, ball.grown);
        status = cut > 0 ? carve(&ball) : SRNF_OK;
        filled = cut > 0 ? differences(box, ball.carved) : filled;
    }
    if (status == SRNF_OK) {
        take(box, cut <= filled ? ball.grown : ball.carved);
    }
    srnf_free(ball.depth);
    srnf_free(ball.stack);
    srnf_free(ball.grown);
    srnf_free(ball.carved);
    srnf_free(ball.heap.order);
    srnf_free(ball.heap.queued);
    return status;
}
