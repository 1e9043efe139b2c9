/*
 * parts.h - several structures of each subject: the mean of each, their joint components, and
 * surfaces along those.
 */
#ifndef SRNFD_COMPUTE_PARTS_H
#define SRNFD_COMPUTE_PARTS_H

#include "compute/mean.h"

struct compute_parts_inputs {
    size_t n, n_parts;     /* subjects; members of the group are part after part, n each */
    const double *weights; /* [n_parts] */
    const struct srnf_register_options *registration; /* NULL: as they are parameterized */
    double tolerance;
    size_t max_iterations;
    size_t components;       /* 0: all above rounding */
    const double *positions; /* [n][n_parts][3], or NULL */
    double position_weight;
    size_t modes;      /* so many components get surfaces */
    double deviations; /* how far out those are, either way */
};

struct compute_parts_outputs {
    struct compute_group group; /* loaded by the caller */
    size_t n_parts, modes;      /* modes: as asked, and no more than components */
    /* [n_parts] mean, measures, angles and pairs of each; group is a view of its members. */
    struct compute_mean_outputs *means;
    struct srnf_part *parts; /* [n_parts] views of means */
    struct srnf_joint_pca joint;
    struct srnf_joint_model kept; /* the same as a model keeps it */
    /* Of the surfaces [modes][2][n_parts], first the ones of negative scores. */
    double *coefficients;
    double *relative_energy;
    struct srnf_surface_measures *mode_measures;
};

/* The outputs other than group are zero. Registrations of the first iteration of each mean survive
   the end of the daemon. Returns 0, or a negative status with the problem in result; cleared with
   compute_parts_clear in any case. */
int compute_parts(struct jobs_run *run, const struct compute_parts_inputs *inputs,
                  struct compute_parts_outputs *outputs, struct jobs_result *result);
void compute_parts_clear(struct compute_parts_outputs *outputs);

#endif
