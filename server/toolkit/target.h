/*
 * target.h - an SRNF as an input: that of a surface, or values on a grid.
 */
#ifndef SRNFD_TOOLKIT_TARGET_H
#define SRNFD_TOOLKIT_TARGET_H

#include "toolkit/table.h"

/* The typed input. */
struct target {
    char surface[STORE_ID_MAX]; /* whose SRNF is meant; "": q is given */
    size_t n_theta, n_phi;      /* of q */
    double *q;                  /* double[3][n_theta][n_phi] on the Gauss-Legendre grid; owned */
};

/* {"surface": id} or {"lmax", "nTheta", "nPhi", "q"}, required. Its degree is the default of the
   input lmax, a derived one, which is read before it; a grid must resolve lmax. */
extern const struct input_own target_input;

/* The SRNF on its grid. */
struct sampled {
    struct compute_surface truth;   /* the surface; coefficients NULL when q was given */
    const struct srnf_sht *sht;     /* degree of the result on the grid of q */
    const struct srnf_sht *forward; /* degree of the truth on the same grid, or NULL */
    const double *q;                /* double[3][n_theta][n_phi] */
    double *own;                    /* what is owned of q */
    void *workspace;                /* of forward */
};

/*
 * Loads the surface, if there is one, and samples its SRNF on the working grid of the larger of the
 * two degrees, so that both the surface and a result are resolved.
 *   degree  of the result; a grid that is given resolves it
 *   route   by which a mesh is encoded, in a phase of `share` percent of the job
 * Returns 0, or a negative status with the problem set; target_close in any case.
 */
int target_open(struct jobs_run *run, const struct target *target, size_t degree,
                enum srnf_parameterization route, double share, struct sampled *sampled,
                struct jobs_result *result);
void target_close(struct jobs_run *run, struct sampled *sampled);

#endif
