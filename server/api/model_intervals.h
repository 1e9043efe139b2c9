/*
 * model_intervals.h - how far the variances of a model are known, as members of its record.
 */
#ifndef SRNFD_API_MODEL_INTERVALS_H
#define SRNFD_API_MODEL_INTERVALS_H

#include "api/handler.h"

/* eigenvalueIntervals, explainedIntervals and totalVarianceInterval of n subjects, from arrays of
   eigenvalues and scores, and from totalVariance and madeFrom, which record has. */
void model_set_intervals(json_t *record, size_t n, size_t components, double *eigenvalues,
                         double *scores);

#endif
