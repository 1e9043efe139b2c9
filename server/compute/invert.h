/*
 * invert.h - the process invert: from an SRNF to a surface.
 */
#ifndef SRNFD_COMPUTE_INVERT_H
#define SRNFD_COMPUTE_INVERT_H

#include "compute/compute.h"

struct compute_invert_inputs {
    const char *surface;   /* id of the surface whose SRNF is meant, or NULL: q is given */
    size_t n_theta, n_phi; /* of q */
    const double *q;       /* double[3][n_theta][n_phi] on the Gauss-Legendre grid */
    size_t degree; /* of the result; at most n_theta - 1 and (n_phi - 1) / 2 when q is given */
    struct srnf_invert_options options; /* surface is filled in here from initial_surface */
    const char *initial_surface;        /* for SRNF_INITIAL_SURFACE: an id */
};

struct compute_invert_outputs {
    struct compute_surface truth; /* the surface given; coefficients NULL when q was given */
    struct srnf_inversion inversion;
    struct srnf_surface_measures measures; /* of the result, centred at its area centroid */
    double squared_norm;                   /* ||q||^2 */
    double
        surface_error; /* L2 norm of the difference of the coefficients to truth without l = 0, at
                             unit area; < 0 where truth is not known or has another degree */
};

/* Returns 0 (also for a result that did not reach its tolerance: see inversion.converged), or a
   negative status with the problem in result. outputs are cleared with compute_invert_clear. */
int compute_invert(struct jobs_run *run, const struct compute_invert_inputs *inputs,
                   struct compute_invert_outputs *outputs, struct jobs_result *result);
void compute_invert_clear(struct compute_invert_outputs *outputs);

#endif
