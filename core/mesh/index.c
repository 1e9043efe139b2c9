/*
 * index.c - building the spatial index: a binary tree of bounding boxes over the faces of a mesh.
 *
 * Each node splits its faces into two halves at the median of their centres along the axis on which
 * the centres spread most. The median is found by radix selection on the bits of the coordinate
 * (four passes of eight bits over single-precision keys), so that the time is O(n log n) for any
 * input, and the halves are equal for any input too: the depth is ceil(log2(n / leaf)), however
 * many faces lie on one spot. Nothing recurses; the pending second children wait on a stack of that
 * depth.
 *
 * Single precision places faces into boxes only; the boxes themselves are exact.
 *
 * Slivers. Boxes along the axes of space hold long thin faces badly: of n that meet in a point, or
 * cross, most boxes hold most places, and a question to the tree becomes one to all faces. A node
 * is crowded when the squared diagonals of its faces' boxes add up to more than CROWDED times that
 * of its own. Surfaces as one meets them come to some ten times at most, and their trees are as if
 * none of this was there. A crowded node and all below it have a box along axes of their own
 * besides (index_box.c), and are split not by the centres alone: faces have six coordinates more,
 * those of e e' / |e| with e the longest edge, so that slivers go together which lie together and
 * point the same way. Such groups are thin, and so are their boxes.
 */
#include "index.h"

#include <string.h>

#define CROWDED 64.0

enum { CENTER_KEYS = 3, LINE_KEYS = 6 };

struct builder {
    struct srnf_index *index;
    const struct srnf_context *context;
    double center[3], size; /* of the mesh */
    float *keys;  /* [n_faces][3] centres of faces; 0 .. 1 in units of the diagonal of the mesh */
    float *lines; /* [n_faces][6] e e' / |e| + 1 in the same units; NULL until a node is crowded */
    float *spans; /* [n_faces] squared diagonals of the faces' boxes, in these units */
    uint32_t *scratch;
};

/* Centres of the faces on the scale of the mesh: 0 .. 1, and no -0, so that their bits order as
   they do; and the squared diagonals of their boxes. */
static void place_keys(struct builder *builder)
{
    const struct srnf_mesh *mesh = builder->index->mesh;
    double size = builder->size;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        double span = 0.0;

        for (size_t k = 0; k < 3; k++) {
            double a = (mesh_corner(mesh, f, 0)[k] - builder->center[k]) / size;
            double b = (mesh_corner(mesh, f, 1)[k] - builder->center[k]) / size;
            double c = (mesh_corner(mesh, f, 2)[k] - builder->center[k]) / size;
            double x = a / 3.0 + b / 3.0 + c / 3.0;
            double side = larger(a, larger(b, c)) - smaller(a, smaller(b, c));

            builder->keys[CENTER_KEYS * f + k] = (float)smaller(larger(x + 0.5, 0.0), 1.0);
            span += side * side;
        }
        builder->spans[f] = (float)span;
    }
}

/* The longest edge of each face, sign and order left out. */
static void place_lines(struct builder *builder)
{
    static const size_t row[LINE_KEYS] = {0, 1, 2, 0, 0, 1}, column[LINE_KEYS] = {0, 1, 2, 1, 2, 2};
    const struct srnf_mesh *mesh = builder->index->mesh;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        double longest[3] = {0.0, 0.0, 0.0}, length = 0.0;

        for (size_t k = 0; k < 3; k++) {
            double edge[3], own;

            vector_subtract(mesh_corner(mesh, f, (k + 1) % 3), mesh_corner(mesh, f, k), edge);
            for (size_t j = 0; j < 3; j++) {
                edge[j] /= builder->size;
            }
            own = vector_norm(edge);
            if (own > length) {
                length = own;
                memcpy(longest, edge, sizeof longest);
            }
        }
        for (size_t k = 0; k < LINE_KEYS; k++) {
            double x = length > 0.0 ? longest[row[k]] * longest[column[k]] / length : 0.0;

            builder->lines[LINE_KEYS * f + k] = (float)smaller(larger(x + 1.0, 0.0), 2.0);
        }
    }
}

static float face_key(const struct builder *builder, uint32_t face, size_t axis)
{
    return axis < CENTER_KEYS ? builder->keys[CENTER_KEYS * (size_t)face + axis]
                              : builder->lines[LINE_KEYS * (size_t)face + axis - CENTER_KEYS];
}

/* Bits of a non-negative float order as the float does. */
static uint32_t key_bits(const struct builder *builder, uint32_t face, size_t axis)
{
    union {
        float value;
        uint32_t bits;
    } key = {.value = face_key(builder, face, axis)};

    return key.bits;
}

/* Key of the element of the given rank among order[n]. */
static uint32_t select_key(const struct builder *builder, const uint32_t *order, size_t n,
                           size_t axis, size_t rank)
{
    uint32_t prefix = 0;

    for (int shift = 24; shift >= 0; shift -= 8) {
        size_t histogram[256] = {0};
        uint32_t digit = 0;

        for (size_t i = 0; i < n; i++) {
            uint32_t bits = key_bits(builder, order[i], axis);

            if (shift == 24 || bits >> (shift + 8) == prefix >> (shift + 8)) {
                histogram[bits >> shift & 255]++;
            }
        }
        while (rank >= histogram[digit]) {
            rank -= histogram[digit++];
        }
        prefix |= digit << shift;
    }
    return prefix;
}

/* Brings the lower half of order[n] along the axis to the front, stably; faces on the median go to
   either side as it takes to make the halves equal. */
static void partition(const struct builder *builder, uint32_t *order, size_t n, size_t axis)
{
    size_t half = n / 2, less = 0, low = 0, high = half;
    uint32_t median = select_key(builder, order, n, axis, half);
    size_t ties; /* that belong in the lower half */

    for (size_t i = 0; i < n; i++) {
        less += key_bits(builder, order[i], axis) < median;
    }
    ties = half - less;
    for (size_t i = 0; i < n; i++) {
        uint32_t bits = key_bits(builder, order[i], axis);
        bool lower = bits < median;

        if (bits == median && ties > 0) {
            ties--;
            lower = true;
        }
        builder->scratch[lower ? low++ : high++] = order[i];
    }
    for (size_t i = 0; i < n; i++) {
        order[i] = builder->scratch[i];
    }
}

/* The key that varies most: of the centres, or, in a crowded node, of all. */
static size_t widest_axis(const struct builder *builder, const uint32_t *order, size_t n,
                          bool crowded)
{
    size_t axes = crowded ? CENTER_KEYS + LINE_KEYS : CENTER_KEYS, axis = 0;
    float widest = -1.0F;

    for (size_t k = 0; k < axes; k++) {
        float low = INFINITY, high = -INFINITY;

        for (size_t i = 0; i < n; i++) {
            float x = face_key(builder, order[i], k);

            low = x < low ? x : low;
            high = x > high ? x : high;
        }
        if (high - low > widest) {
            widest = high - low;
            axis = k;
        }
    }
    return axis;
}

/* Whether the boxes of the faces crowd in that of their node. */
static bool is_crowded(const struct builder *builder, const struct index_node *node,
                       const uint32_t *order, size_t n)
{
    double sum = 0.0, own = 0.0;

    for (size_t i = 0; i < n; i++) {
        sum += (double)builder->spans[order[i]];
    }
    for (size_t k = 0; k < 3; k++) {
        double side = (node->high[k] - node->low[k]) / builder->size;

        own += side * side;
    }
    return sum > CROWDED * own;
}

static void bound_faces(const struct srnf_index *index, struct index_node *node, size_t start,
                        size_t count)
{
    for (size_t k = 0; k < 3; k++) {
        node->low[k] = INFINITY;
        node->high[k] = -INFINITY;
    }
    for (size_t i = 0; i < 3 * count; i++) {
        const double *corner = mesh_corner(index->mesh, index->order[start + i / 3], i % 3);

        for (size_t k = 0; k < 3; k++) {
            node->low[k] = smaller(node->low[k], corner[k]);
            node->high[k] = larger(node->high[k], corner[k]);
        }
    }
}

/* Gives the node a box along axes of its own, and the faces the keys that it is split by. */
static int crowd(struct builder *builder, struct index_node *node, const uint32_t *order, size_t n)
{
    struct srnf_index *index = builder->index;

    if (!builder->lines) {
        builder->lines = srnf_alloc(index->mesh->n_faces, LINE_KEYS * sizeof *builder->lines);
        if (!builder->lines) {
            return SRNF_ENOMEM;
        }
        place_lines(builder);
    }
    if (index->n_boxes == index->box_capacity) {
        size_t capacity = 2 * index->box_capacity + 64;
        struct index_box *boxes = srnf_alloc(capacity, sizeof *boxes);

        if (!boxes) {
            return SRNF_ENOMEM;
        }
        if (index->n_boxes > 0) {
            memcpy(boxes, index->boxes, index->n_boxes * sizeof *boxes);
        }
        srnf_free(index->boxes);
        index->boxes = boxes;
        index->box_capacity = capacity;
    }
    index_box_fit(index->mesh, order, n, &index->boxes[index->n_boxes++]);
    node->box = (uint32_t)index->n_boxes;
    return SRNF_OK;
}

/* What is still to be made a subtree. crowded: a node above it is. */
struct pending {
    size_t start, count;
    uint32_t parent;
    bool crowded;
};

/* The next node: a leaf, or one whose faces are in two halves then. */
static int build_node(struct builder *builder, struct pending *range)
{
    struct srnf_index *index = builder->index;
    struct index_node *node = &index->nodes[index->n_nodes++];
    uint32_t *order = index->order + range->start;
    int status = SRNF_OK;

    bound_faces(index, node, range->start, range->count);
    range->crowded = range->crowded || is_crowded(builder, node, order, range->count);
    if (range->crowded) {
        status = crowd(builder, node, order, range->count);
    }
    if (status == SRNF_OK && range->count <= INDEX_LEAF_MAX) {
        node->start = (uint32_t)range->start;
        node->count = (uint32_t)range->count;
    } else if (status == SRNF_OK) {
        partition(builder, order, range->count,
                  widest_axis(builder, order, range->count, range->crowded));
    }
    return status == SRNF_OK && srnf_is_canceled(builder->context) ? SRNF_ECANCELED : status;
}

static int build_tree(struct builder *builder)
{
    struct srnf_index *index = builder->index;
    struct pending stack[INDEX_DEPTH_MAX];
    size_t depth = 0;

    stack[depth++] = (struct pending){0, index->mesh->n_faces, 0, false};
    while (depth > 0) {
        struct pending range = stack[--depth];

        if (range.start > 0) {
            index->nodes[range.parent].second = (uint32_t)index->n_nodes;
        }
        for (;;) {
            uint32_t number = (uint32_t)index->n_nodes;
            size_t half = range.count / 2;
            int status = build_node(builder, &range);

            if (status != SRNF_OK) {
                return status;
            }
            if (index->nodes[number].count > 0) {
                break;
            }
            stack[depth++] =
                (struct pending){range.start + half, range.count - half, number, range.crowded};
            range.count = half;
        }
    }
    return SRNF_OK;
}

int index_create(struct srnf_index **out, const struct srnf_mesh *mesh,
                 const struct srnf_context *context)
{
    struct srnf_index *index = srnf_alloc(1, sizeof *index);
    struct builder builder = {.index = index, .context = context};
    struct srnf_mesh_measures measures;
    int status = SRNF_EINVAL;

    *out = NULL;
    if (mesh->n_faces == 0 || mesh->n_faces > SRNF_MESH_FACES_MAX) {
        goto out;
    }
    status = SRNF_ENOMEM;
    builder.keys = srnf_alloc(mesh->n_faces, CENTER_KEYS * sizeof *builder.keys);
    builder.spans = srnf_alloc(mesh->n_faces, sizeof *builder.spans);
    builder.scratch = srnf_alloc(mesh->n_faces, sizeof *builder.scratch);
    if (!index || !builder.keys || !builder.spans || !builder.scratch) {
        goto out;
    }
    index->mesh = mesh;
    index->order = srnf_alloc(mesh->n_faces, sizeof *index->order);
    index->nodes =
        srnf_alloc(mesh->n_faces, sizeof *index->nodes); /* leaves hold two faces or more */
    if (!index->order || !index->nodes) {
        goto out;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        index->order[f] = (uint32_t)f;
    }
    srnf_mesh_measure(mesh, NULL, &measures);
    memcpy(builder.center, measures.center, sizeof builder.center);
    builder.size = measures.diagonal > 0.0 ? measures.diagonal : 1.0;
    place_keys(&builder);
    status = build_tree(&builder);
    if (status == SRNF_OK) {
        *out = index;
        index = NULL;
    }
out:
    srnf_free(builder.scratch);
    srnf_free(builder.spans);
    srnf_free(builder.lines);
    srnf_free(builder.keys);
    srnf_index_destroy(index);
    return status;
}

int srnf_index_create(struct srnf_index **out, const struct srnf_mesh *mesh)
{
    return index_create(out, mesh, NULL);
}

void srnf_index_destroy(struct srnf_index *index)
{
    if (index) {
        srnf_free(index->boxes);
        srnf_free(index->nodes);
        srnf_free(index->order);
        srnf_free(index);
    }
}
