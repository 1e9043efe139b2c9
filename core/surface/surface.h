/*
 * surface.h - triangulations of a surface that can be canceled.
 */
#ifndef SRNF_SURFACE_INTERNAL_H
#define SRNF_SURFACE_INTERNAL_H

#include "internal.h"

/* srnf_surface_triangulate that can be canceled. */
SRNF_CHECKED int surface_triangulate(const struct srnf_context *context, size_t degree,
                                     const double *coefficients, size_t frequency,
                                     struct srnf_mesh *mesh, double **normals);

#endif
