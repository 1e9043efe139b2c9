/*
 * sizes.h - sizes that surfaces had in their files, roots of areas: doubts that some are in another
 * unit, or of another structure, than the rest.
 *
 * Where sizes count (shape-and-size, transfer) any two that are ten times apart are told of, of
 * several structures each by itself. So are surfaces that are compared as they are stored, and are
 * not of unit area: then the sizes are those of what is stored.
 * Where none are, and where sizes do not count, a group is told of where it falls into two classes
 * of sizes, one of three members or more, that are four times apart at least and further than
 * either is wide: a body that varies a lot is no such group, and millimetres beside centimetres
 * are. Surfaces that were sent in have no size that is known, and are left out.
 */
#ifndef SRNFD_TOOLKIT_SIZES_H
#define SRNFD_TOOLKIT_SIZES_H

#include "toolkit/process.h"

/* Adds the warning mixed-units where sizes count and are far apart, or where they fall into two
   classes: of what canonical inputs compare, of several structures each by itself. With
   relative positions the structures are held against each other too, and beside a model the
   surface against its mean. */
void units_warn(struct jobs_run *run, const json_t *inputs, json_t *document);

/*
 * Of n sizes, which are sorted, how many are in the lower of two classes; 0: they are one.
 *   ratio  [out] of the medians of the two
 */
size_t sizes_split(size_t n, double *sizes, double *ratio);

#endif
