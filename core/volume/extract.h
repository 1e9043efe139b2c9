/*
 * extract.h - the parts of an extraction: extract.c calls them in turn.
 */
#ifndef SRNF_VOLUME_EXTRACT_H
#define SRNF_VOLUME_EXTRACT_H

#include <math.h>

#include "topology.h"

struct extraction {
    const struct srnf_volume *volume;
    const struct srnf_context *context;
    struct srnf_error *error;
    bool chosen[SRNF_VOLUME_LABELS_MAX + 1];
    struct voxel_box box;
    struct voxel_net net;
    struct srnf_extracted *extracted;
};

static inline int extract_no_memory(const struct extraction *work)
{
    return srnf_fail(work->error, SRNF_ENOMEM, -1, "not enough memory to extract the surface");
}

/* Of the matrix from voxels to the world: the volume of a voxel, below 0 for a reflection. */
static inline double extract_determinant(const struct extraction *work)
{
    const double *a = work->volume->affine;

    return a[0] * (a[5] * a[10] - a[6] * a[9]) - a[1] * (a[4] * a[10] - a[6] * a[8]) +
           a[2] * (a[4] * a[9] - a[5] * a[8]);
}

/* The world's point of a place in the box. */
void extract_world(const struct extraction *work, const double place[3], double point[3]);
/* Counts and lists the changed voxels; the marks in the box go (places.c). */
SRNF_CHECKED int extract_places(struct extraction *work);
/* The mesh of the net, in the world, with the volume of the voxels, and checked (finish.c). */
SRNF_CHECKED int extract_finish(struct extraction *work);

#endif
