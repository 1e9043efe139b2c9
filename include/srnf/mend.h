/*
 * mend.h - repairs of a mesh that cannot be analysed as it is, each on request (core/mesh/mend*.c,
 * core/volume/handles.c).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_MEND_H
#define SRNF_PUBLIC_MEND_H

#include "srnf/base.h"
#include "srnf/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* What is to be mended. Zero: nothing. */
struct srnf_mend_options {
    bool orient;     /* turn faces so that all look outwards */
    bool islands;    /* keep the component of the largest area */
    bool duplicates; /* of faces with the same corners keep one, or none where they lie back to
                        back and the surface is closed without them */
    bool degenerate; /* drop faces that name a point twice */
    double merge;    /* join vertices within this distance, in units of the mesh; 0: none */
    double holes;    /* close holes of at most this perimeter, in units of the mesh; 0: none */
};

#define SRNF_MEND_HOLE_EDGES_MAX 1000 /* of a hole that is closed */

/* One kind of change that was made, or one that was asked for and refused. */
struct srnf_mend_item {
    const char *code; /* "faces-turned", "hole-too-long", ...; static */
    size_t count;     /* faces, vertices, holes, components or voxels, as the code says */
    int64_t first;    /* lowest number in the input of a face (of a vertex where of_vertex); -1
                           where there is none */
    bool of_vertex;   /* first is the number of a vertex */
    double
        position[3];  /* of that vertex, or the middle of the face or hole; in the input's units */
    char detail[200]; /* of what was refused: why, and what would help; "" for changes */
};
#define SRNF_MEND_ITEMS_MAX 32

struct srnf_mended {
    struct srnf_mesh mesh; /* empty where nothing was changed */
    size_t n_changes, n_refused;
    struct srnf_mend_item changes[SRNF_MEND_ITEMS_MAX];
    struct srnf_mend_item refused[SRNF_MEND_ITEMS_MAX];
};
void srnf_mended_clear(struct srnf_mended *mended);

/*
 * Mends what the options name, in this order: equal points are joined as srnf_mesh_prepare does,
 * then vertices within the tolerance, degenerate faces, duplicates, islands, orientation, holes. A
 * mesh in which srnf_mesh_prepare finds no problem is left alone, whatever is asked for; so is one
 * in which nothing of what is asked for applies.
 *   mesh     [in]  as it was read, not prepared
 *   mended   [out] to be cleared; what is still wrong with the mesh, srnf_mesh_prepare says
 * Cost O(n log n), and O(k^3) for a hole of k edges. Errors: SRNF_EINVAL (an index out of range, a
 * coordinate or option that is not finite, below 0), SRNF_EDEGENERATE (no face would be left),
 * SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_mend(const struct srnf_mesh *mesh, const struct srnf_mend_options *options,
                           const struct srnf_context *context, struct srnf_mended *mended,
                           struct srnf_error *error);

#define SRNF_HANDLES_VOXELS_MIN 16
#define SRNF_HANDLES_VOXELS_MAX 256
/*
 * Cuts the handles of a closed mesh, or closes the tunnels through it, by way of voxels: the inside
 * of the mesh as a volume of `voxels` along its longest side, made a ball by changing the fewest
 * simple voxels, and its surface (srnf_extract). The whole surface is made anew, since taking a
 * handle off a mesh by surgery can make it cross itself. Detail finer than a voxel is lost: see
 * srnf_mesh_distance. Changes are added to those in mended: "made-anew-from-voxels" (count:
 * vertices) and those of srnf_change_name (count: voxels), where they are. A mesh that is not
 * closed, manifold, oriented and connected is refused, which is noted there too. A mesh of genus 0
 * is left alone.
 *   mesh    [in]     as it was read, or NULL for mended->mesh
 *   mended  [in/out] from srnf_mend
 * Errors: SRNF_EINVAL (voxels out of range, an index out of range), SRNF_ENUMERIC, SRNF_ENOMEM,
 * SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_mend_handles(const struct srnf_mesh *mesh, size_t voxels,
                                   const struct srnf_context *context, struct srnf_mended *mended,
                                   struct srnf_error *error);

struct srnf_mesh_distance {
    double rms; /* root of half of: mean squared distance of each mesh's points from the other,
                   weighted by area, exact for what is quadratic on a face */
    double max; /* of vertices and middles of faces, of either mesh from the other */
};
/*
 * How far two meshes are from each other, in their units, where they stand.
 * Errors: SRNF_EINVAL (an index out of range, a coordinate not finite), SRNF_EDEGENERATE (no area),
 * SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_mesh_distance(const struct srnf_mesh *a, const struct srnf_mesh *b,
                                    const struct srnf_context *context,
                                    struct srnf_mesh_distance *distance);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
