/*
 * frozen.h - fitting a classifier to scores and asking it (frozen.c), for the files that train one
 * and use it.
 */
#ifndef SRNF_STATS_FROZEN_H
#define SRNF_STATS_FROZEN_H

#include "classify_fold.h"

/* Members of which some are trained on: in a view of their own. */
struct frozen_members {
    size_t n, components, classes;
    const double *scores;   /* [n][components] */
    const size_t *labels;   /* [n] */
    const size_t *subjects; /* [n] below n */
};

/* The Gaussians of the members: means, covariances, and what the options leave open of components
   and covariance. The classifier's calibration and priors are not touched. To be cleared in any
   case. Errors: SRNF_EINVAL, SRNF_ENUMERIC (a covariance is singular), SRNF_ENOMEM. */
SRNF_CHECKED int frozen_fit_gauss(const struct frozen_members *members,
                                  const struct srnf_classify_options *options,
                                  struct srnf_classifier *classifier, struct srnf_error *error);
/* Log-likelihoods, [classes], of scores; memory: [components (components + 1)]. SRNF_ENUMERIC: a
   covariance is not positive. */
SRNF_CHECKED int frozen_likelihoods(const struct srnf_classifier *classifier, const double *scores,
                                    double *memory, double *evidence);

#endif
