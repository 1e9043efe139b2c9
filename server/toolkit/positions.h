/*
 * positions.h - where the parts of a subject are, relative to each other.
 */
#ifndef SRNFD_TOOLKIT_POSITIONS_H
#define SRNFD_TOOLKIT_POSITIONS_H

#include "toolkit/process.h"

/*
 * The centroids of the parts less their mean, in units of the subject's size, the root of the total
 * area of its parts in the units of their places.
 *   sht        [in]  of the degree of the surfaces
 *   surfaces   [in]  [n] id, scale and origin of each, as they were loaded; their numbers are not
 *                    read
 *   numbers    [in]  [n] coefficients of each, [3][(L+1)^2]
 *   positions  [out] [n][3]
 * Returns 0, or a negative status with the problem in result: a surface was turned, or it has no
 * place.
 */
int positions_find(struct jobs_run *run, const struct srnf_sht *sht, size_t n,
                   const struct compute_surface *surfaces, const double *const *numbers,
                   double *positions, struct jobs_result *result);

#endif
