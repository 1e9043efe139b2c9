/*
 * index.h - the bounding-volume hierarchy that index.c builds and index_query.c walks.
 */
#ifndef SRNF_MESH_INDEX_H
#define SRNF_MESH_INDEX_H

#include "mesh_geometry.h"

/* The tree halves its faces at each level, so that 2^31 of them are 31 levels deep at most. */
#define INDEX_DEPTH_MAX 40
#define INDEX_LEAF_MAX 4

/* Nodes in preorder: the first child follows its parent. */
struct index_node {
    double low[3], high[3];
    uint32_t second; /* second child; 0 for a leaf */
    uint32_t start;  /* leaf: its faces are order[start .. start + count) */
    uint32_t count;
    uint32_t box; /* 1 + its place among boxes; 0: it has none */
};

/* A box along axes of its own, cut by two slabs along its sides:
   low_k <= <x - origin, axis_k> / unit <= high_k.
   The first three axes are orthonormal to single precision, all are of length one. */
enum { INDEX_BOX_AXES = 3, INDEX_BOX_SLABS = 5 };
struct index_box {
    double origin[3], unit;
    float axis[INDEX_BOX_SLABS][3], low[INDEX_BOX_SLABS], high[INDEX_BOX_SLABS];
};

struct srnf_index {
    const struct srnf_mesh *mesh;
    struct index_node *nodes;
    size_t n_nodes;
    uint32_t *order;
    struct index_box *boxes; /* of the nodes in which faces crowd */
    size_t n_boxes, box_capacity;
};

/* ---- Boxes along axes of their own (index_box.c) --------------------------------------------- */

/* The box about n faces, along the principal axes of their corners. */
void index_box_fit(const struct srnf_mesh *mesh, const uint32_t *faces, size_t n,
                   struct index_box *box);
/* Cuts [enter, leave], parameters of a ray, down to the box enlarged by padding. */
void index_box_clip(const struct index_box *box, const double origin[3], const double direction[3],
                    double padding, double *enter, double *leave);
/* At most the squared distance of a point from what is in the box. */
double index_box_distance2(const struct index_box *box, const double point[3]);

/* srnf_index_distance2 that has a face to begin with, *face, which may be any: the sooner done the
   nearer it is, as where the point has moved a little since. */
double index_distance2_from(const struct srnf_index *index, const double point[3],
                            double nearest[3], uint32_t *face);

/* srnf_index_create that can be canceled. */
SRNF_CHECKED int index_create(struct srnf_index **out, const struct srnf_mesh *mesh,
                              const struct srnf_context *context);

#endif
