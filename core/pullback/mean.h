/*
 * mean.h - what the two ways to the Karcher mean of the pulled-back metric share.
 */
#ifndef SRNF_PULLBACK_MEAN_H
#define SRNF_PULLBACK_MEAN_H

#include "pullback.h"

#define PULLBACK_MEAN_STARTED 0.1 /* progress when the extrinsic mean is there */

struct pullback_group {
    const struct srnf_sht *sht;
    size_t n, points, count; /* count = 3 (L+1)^2 */
    const double *const *surfaces;
    const struct srnf_pullback_mean_options *options;
    const struct srnf_context *context;
    struct srnf_context quiet; /* the same without progress */
};

/* mean_steps.c: the mean by steps of the exponential map, from mean->extrinsic. Fills all
   but variance and moved. */
SRNF_CHECKED int pullback_mean_steps(const struct pullback_group *group,
                                     struct srnf_pullback_mean *mean, struct srnf_error *error);

#endif
