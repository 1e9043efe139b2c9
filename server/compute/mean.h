/*
 * mean.h - the processes mean and pca, and distances: what is computed of a whole group.
 */
#ifndef SRNFD_COMPUTE_MEAN_H
#define SRNFD_COMPUTE_MEAN_H

#include "compute/mirror.h"

struct compute_mean_inputs {
    size_t n;
    const char *const *ids; /* [n] surfaces or meshes */
    struct compute_mirrored mirrored;
    struct compute_origin *origins; /* as for compute_group_load; the caller's (srnf_free) */
    size_t degree;                  /* of the mean; 0: the largest of the members */
    const struct srnf_register_options *registration; /* NULL: as they are parameterised */
    double tolerance;
    size_t max_iterations;
    size_t components;      /* of principal components; 0: all above rounding */
    double share;           /* percent of the job that the mean is; 0: all that encoding leaves */
    bool pullback;          /* the mean in the pulled-back metric instead; of compute_mean only */
    const size_t *subjects; /* [n] as in srnf/subjects.h; NULL: each member its own */
};

struct compute_mean_outputs {
    struct compute_group group;
    struct srnf_mean mean;
    struct srnf_pullback_mean pullback;    /* when asked for; n 0 otherwise */
    struct srnf_surface_measures measures; /* of the mean, centred at its area centroid */
    struct srnf_pca pca;                   /* of compute_pca only */
    double *residuals; /* [n] of each surface beyond the components, owned; of compute_pca only */
    struct srnf_calibration calibration; /* of compute_pca of 3 subjects or more; n 0 otherwise */
    double *pairs;                       /* [n][n] distances of the registered members, owned */
    double
        *angles; /* [n] turns against the mean of other subjects, owned; NULL where values rotate,
                       and of one subject */
    size_t n_theta, n_phi;
    double seconds; /* of the iterations, over all attempts of the job */
};

/*
 * The Karcher mean. After each iteration a checkpoint is saved, and a job that was cut short goes
 * on from its last one. A mean that has not converged within the iterations allowed is a result.
 * The mean in the pulled-back metric begins from that: surfaces are registered to it, where they
 * are, and its surface, the distances to it and what it loses of the mean SRNF take the place of
 * those; it has no checkpoint of its own.
 * Returns 0, or a negative status with the problem in result; outputs are cleared with
 * compute_mean_clear.
 */
int compute_mean(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                 struct compute_mean_outputs *outputs, struct jobs_result *result);
/* The same, and the principal components about it. */
int compute_pca(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                struct compute_mean_outputs *outputs, struct jobs_result *result);
void compute_mean_clear(struct compute_mean_outputs *outputs);

struct compute_distances_inputs {
    enum srnf_metric metric;
    size_t n;
    const char *const *ids;                           /* [n] surfaces or meshes */
    const struct compute_origin *origins;             /* as for compute_group_load */
    const struct srnf_register_options *registration; /* NULL: as they are parameterised */
};

struct compute_distances_outputs {
    struct compute_group group;
    double *matrix; /* [n][n], owned */
};

/*
 * The matrix of distances, at the largest degree of the members. Registered pairs are kept for a
 * later attempt.
 *   handedness  [in/out] which members are mirrored, and which pairs are to be tried with one of
 *               them mirrored
 * Returns 0, or a negative status with the problem in result; outputs are cleared with
 * compute_distances_clear.
 */
int compute_distances(struct jobs_run *run, const struct compute_distances_inputs *inputs,
                      struct compute_handedness *handedness,
                      struct compute_distances_outputs *outputs, struct jobs_result *result);
void compute_distances_clear(struct compute_distances_outputs *outputs);

#endif
