/*
 * fit.h - how far a mesh and the surface fitted to it are apart.
 */
#ifndef SRNF_SURFACE_FIT_H
#define SRNF_SURFACE_FIT_H

#include "srnf.h"

/*
 * Distances from the vertices of the mesh to the triangulated surface, and from the vertices of the
 * triangulation to the mesh.
 *   mesh     [in]  the mesh that was encoded
 *   index    [in]  spatial index over that mesh
 *   surface_triangulation
 *            [in]  the surface in the frame and units of the mesh, finer than the detail that the
 *                  distances are to resolve
 *   context  [in]  threads, or NULL; the result does not depend on them
 *   fit      [out] rms, 95th percentile and maximum over both sides together, diagonal of the mesh
 * Each vertex weighs a third of the area of its faces; each side has half of the total weight.
 * Errors: SRNF_EDEGENERATE (a side without area), SRNF_ELIMIT (2^31 vertices together),
 * SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_fit_measure(const struct srnf_mesh *mesh, const struct srnf_index *index,
                                  const struct srnf_mesh *surface_triangulation,
                                  const struct srnf_context *context, struct srnf_fit *fit);

#endif
