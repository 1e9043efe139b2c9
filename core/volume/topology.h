/*
 * topology.h - a set of voxels, and what makes it a ball.
 *
 * Voxels of the set are joined where they share a face or an edge (18-connectivity), voxels outside
 * by paths over faces within blocks of 2 x 2 x 2 (6+): the pair under which the dual surface of
 * net.c is the boundary of the set (simple.c).
 */
#ifndef SRNF_VOLUME_TOPOLOGY_H
#define SRNF_VOLUME_TOPOLOGY_H

#include "internal.h"

/* What a voxel of the box is. */
enum voxel_state {
    VOXEL_OUT = 0,
    VOXEL_IN = 1,
    VOXEL_SEEN = 2, /* while components are sought */
    VOXEL_KEPT = 3,
    VOXEL_WALL = 8, /* the outermost layer of the box, which nothing enters */
};

/* The box around a label, with two layers of voxels more on each side: a wall and an empty one. */
struct voxel_box {
    size_t shape[3], count;
    size_t stride[3];
    ptrdiff_t first[3]; /* index of the volume's voxel (0, 0, 0) less that of the box's */
    double spacing[3];
    unsigned char *voxels;  /* [shape[2]][shape[1]][shape[0]], enum voxel_state */
    unsigned char *changes; /* enum srnf_change + 1, or 0 */
};

/* Tables of the neighbourhood of a voxel (simple.c). Bit 9 (z + 1) + 3 (y + 1) + x + 1 stands for
   the neighbour at (x, y, z). */
struct simple_tables {
    uint32_t edges[27]; /* neighbours by a face or an edge */
    uint32_t faces[27]; /* by a face */
    uint32_t cells[8];  /* the seven others of each block of eight */
    uint32_t sides;     /* the six that share a face with the centre */
    uint32_t corners;   /* the eight that share a corner alone */
    ptrdiff_t offset[27];
};
void simple_tables_fill(struct simple_tables *tables, const struct voxel_box *box);
/* Whether the voxel can be added to the set, or taken from it, with its topology unchanged. */
bool simple_voxel(const struct simple_tables *tables, const unsigned char *voxels, size_t at);

/*
 * Makes the set a ball: its largest component, without cavities, and with handles cut or tunnels
 * closed, whichever changes fewer voxels. Changes are noted in box->changes.
 * Errors: SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int voxels_to_ball(struct voxel_box *box, const struct srnf_context *context);

/* The dual surface of the set in coordinates of the box: polygons of four corners or more. */
struct voxel_net {
    size_t n_vertices, n_polygons, n_corners;
    double *vertices;  /* [n_vertices][3] */
    double *home;      /* [n_vertices][3]: the middle of what a vertex must not leave */
    float *reach;      /* [n_vertices]: how far it may go from there along each axis */
    uint32_t *corners; /* of all polygons, outward counter-clockwise */
    size_t *first;     /* [n_polygons + 1]: where each begins among them */
};
SRNF_CHECKED int voxel_net_make(const struct voxel_box *box, const struct srnf_context *context,
                                struct voxel_net *net);
void voxel_net_clear(struct voxel_net *net);
/* Passes of smoothing that move every vertex within its reach. */
SRNF_CHECKED int voxel_net_smooth(struct voxel_net *net, size_t passes,
                                  const struct srnf_context *context);

#endif
