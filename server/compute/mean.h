/*
 * mean.h - the mean of a group, and its principal components.
 */
#ifndef SRNFD_COMPUTE_MEAN_H
#define SRNFD_COMPUTE_MEAN_H

#include "compute/mirror.h"

struct compute_mean_inputs {
    const struct srnf_register_options *registration; /* NULL: as they are parameterized */
    double tolerance;
    size_t max_iterations;
    bool fit;          /* principal components as well */
    size_t components; /* of those; 0: all above rounding, of up to COMPUTE_PAIRS_MAX */
    double share;      /* percent of the job that the mean is; 0: all that is left */
    bool pullback;     /* the mean in the pulled-back metric instead */
    bool one_of_many;  /* of this job: no checkpoint, but the first registrations of all are kept */
    const struct srnf_group_landmarks *landmarks; /* or NULL */
    const size_t *subjects; /* [n] as in srnf/subjects.h; NULL: each member its own */
};

struct compute_mean_outputs {
    struct compute_group group; /* loaded by the caller */
    struct srnf_mean mean;
    struct srnf_pullback_mean pullback;    /* when asked for; n 0 otherwise */
    struct srnf_surface_measures measures; /* of the mean, centred at its area centroid */
    struct srnf_pca pca;                   /* where they are asked for */
    double eigenvalue_bound; /* within it of each there is one of the covariance; 0 where they are
                                those of the Gram matrix */
    double *residuals; /* [n] of each surface beyond the components, owned; NULL without them */
    struct srnf_calibration calibration; /* the same, of 3 subjects or more; n 0 otherwise */
    double *pairs; /* [n][n] distances of the registered members, owned; NULL of more than
                      COMPUTE_PAIRS_MAX, which have no calibration either */
    double
        *angles; /* [n] turns against the mean of other subjects, owned; NULL where values rotate,
                       and of one subject */
    size_t n_theta, n_phi;
    double seconds; /* of the iterations, over all attempts of the job */
};

/*
 * The Karcher mean of outputs->group, the other outputs being zero, and what else is asked for.
 * After each iteration a checkpoint is saved, and a job that was cut short goes on from its last
 * one. A mean that has not converged within the iterations allowed is a result.
 * The mean in the pulled-back metric begins from that: surfaces are registered to it, where they
 * are, and its surface, the distances to it and what it loses of the mean SRNF take the place of
 * those; it has no checkpoint of its own.
 * A job has one checkpoint: of several means none is saved, and what an earlier attempt has left
 * are the first registrations of each.
 * Returns 0, or a negative status with the problem in result; outputs are cleared with
 * compute_mean_clear in any case.
 */
int compute_mean(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                 struct compute_mean_outputs *outputs, struct jobs_result *result);
void compute_mean_clear(struct compute_mean_outputs *outputs);

#endif
