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
 */
#include "index.h"

struct builder {
    struct srnf_index *index;
    float *keys; /* [n_faces][3] centres of faces; 0 .. 1 in units of the diagonal of the mesh */
    uint32_t *scratch;
};

/* Bits of a non-negative float order as the float does. */
static uint32_t key_bits(const struct builder *builder, uint32_t face, size_t axis)
{
    union {
        float value;
        uint32_t bits;
    } key = {.value = builder->keys[3 * (size_t)face + axis]};

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

static size_t widest_axis(const struct builder *builder, const uint32_t *order, size_t n)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    size_t axis = 0;

    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++) {
            float x = builder->keys[3 * (size_t)order[i] + k];

            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    }
    for (size_t k = 1; k < 3; k++) {
        if (high[k] - low[k] > high[axis] - low[axis]) {
            axis = k;
        }
    }
    return axis;
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

static void build_tree(struct builder *builder)
{
    struct srnf_index *index = builder->index;
    struct pending {
        size_t start, count;
        uint32_t parent;
    } stack[INDEX_DEPTH_MAX];
    size_t depth = 0;

    stack[depth++] = (struct pending){0, index->mesh->n_faces, 0};
    while (depth > 0) {
        struct pending range = stack[--depth];

        if (range.start > 0) {
            index->nodes[range.parent].second = (uint32_t)index->n_nodes;
        }
        for (;;) {
            uint32_t number = (uint32_t)index->n_nodes++;
            struct index_node *node = &index->nodes[number];
            uint32_t *order = index->order + range.start;
            size_t half = range.count / 2;

            bound_faces(index, node, range.start, range.count);
            if (range.count <= INDEX_LEAF_MAX) {
                node->start = (uint32_t)range.start;
                node->count = (uint32_t)range.count;
                break;
            }
            partition(builder, order, range.count, widest_axis(builder, order, range.count));
            stack[depth++] = (struct pending){range.start + half, range.count - half, number};
            range.count = half;
        }
    }
}

/* Centres of the faces on the scale of the mesh: 0 .. 1, and no -0, so that their bits order as
   they do. */
static void place_keys(struct builder *builder)
{
    const struct srnf_mesh *mesh = builder->index->mesh;
    struct srnf_mesh_measures measures;
    double size;

    srnf_mesh_measure(mesh, &measures);
    size = measures.diagonal > 0.0 ? measures.diagonal : 1.0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        for (size_t k = 0; k < 3; k++) {
            double x = (mesh_corner(mesh, f, 0)[k] - measures.center[k]) / size / 3.0 +
                       (mesh_corner(mesh, f, 1)[k] - measures.center[k]) / size / 3.0 +
                       (mesh_corner(mesh, f, 2)[k] - measures.center[k]) / size / 3.0;

            builder->keys[3 * f + k] = (float)smaller(larger(x + 0.5, 0.0), 1.0);
        }
    }
}

int srnf_index_create(struct srnf_index **out, const struct srnf_mesh *mesh)
{
    struct srnf_index *index = srnf_alloc(1, sizeof *index);
    struct builder builder = {.index = index};
    int status = SRNF_EINVAL;

    *out = NULL;
    if (mesh->n_faces == 0 || mesh->n_faces > SRNF_MESH_FACES_MAX) {
        goto out;
    }
    status = SRNF_ENOMEM;
    builder.keys = srnf_alloc(mesh->n_faces, 3 * sizeof *builder.keys);
    builder.scratch = srnf_alloc(mesh->n_faces, sizeof *builder.scratch);
    if (!index || !builder.keys || !builder.scratch) {
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
    place_keys(&builder);
    build_tree(&builder);
    *out = index;
    index = NULL;
    status = SRNF_OK;
out:
    srnf_free(builder.scratch);
    srnf_free(builder.keys);
    srnf_index_destroy(index);
    return status;
}

void srnf_index_destroy(struct srnf_index *index)
{
    if (index) {
        srnf_free(index->nodes);
        srnf_free(index->order);
        srnf_free(index);
    }
}
