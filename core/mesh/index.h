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
};

struct srnf_index {
    const struct srnf_mesh *mesh;
    struct index_node *nodes;
    size_t n_nodes;
    uint32_t *order;
};

#endif
