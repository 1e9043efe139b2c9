/*
 * frozen.h - fitting a classifier to scores and asking it (frozen.c), for the files that train one
 * and use it.
 */
#ifndef SRNF_STATS_FROZEN_H
#define SRNF_STATS_FROZEN_H

#include "classify_fold.h"

/* Members of which some are trained on: in a view of their own. */
struct frozen_members {
    size_t n, components, classes, n_features;
    const double *scores;   /* [n][components] */
    const double *features; /* [n][n_features] */
    const size_t *labels;   /* [n] */
    const size_t *subjects; /* [n] below n */
};

/* The Gaussians of the members: means, covariances, and what the options leave open of components
   and covariance. The classifier's calibration and priors are not touched. To be cleared in any
   case. Errors: SRNF_EINVAL, SRNF_ENUMERIC (a covariance is singular), SRNF_ENOMEM. */
SRNF_CHECKED int frozen_fit_gauss(const struct frozen_members *members,
                                  const struct srnf_classify_options *options,
                                  struct srnf_classifier *classifier, struct srnf_error *error);
/* Log-likelihoods, [classes], of x, d numbers beside shape and scores; memory: [d (d + 1)].
   SRNF_ENUMERIC: a covariance is not positive. */
SRNF_CHECKED int frozen_likelihoods(const struct srnf_classifier *classifier, const double *x,
                                    double *memory, double *evidence);

/* Numbers beside shape in distances (frozen_nearest.c). */
struct frozen_numbers {
    size_t count;
    const double *values; /* [n][count] */
    double weight;
};
/*
 * Minus the distance, shape and numbers together, of each member to the nearest of each class that
 * is of another subject: what a fold says of its training members, each left out with its subject.
 *   products  [in]  [n][n] inner products of the fields
 *   left_out  [in]  a subject that has no part in it, or SIZE_MAX
 *   evidence  [out] [n][classes]; of the members left out -INFINITY
 * Errors: SRNF_ENOMEM.
 */
SRNF_CHECKED int frozen_judge_nearest(const struct subjects *subjects, const double *products,
                                      const struct frozen_numbers *numbers, const size_t *labels,
                                      size_t classes, size_t left_out, double *evidence);
/* What differences of each number are multiplied by, [count], by all members. SRNF_ENOMEM. */
SRNF_CHECKED int frozen_factors(const struct subjects *subjects, const double *products,
                                const struct frozen_numbers *numbers, double *factors);
/* The sum of the squares of the differences times the factors. */
double frozen_apart2(size_t count, const double *factors, const double *a, const double *b);

#endif
