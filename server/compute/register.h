/*
 * register.h - the process register: a moving surface laid on a template.
 */
#ifndef SRNFD_COMPUTE_REGISTER_H
#define SRNFD_COMPUTE_REGISTER_H

#include "compute/bridge.h"
#include "compute/mirror.h"

struct compute_register_inputs {
    const char *template_id, *moving; /* ids of surfaces or meshes */
    struct srnf_register_options options;
    bool handedness;                  /* try the mirror image of moving too (compute_mirror_pair) */
    bool opposite;                    /* the two are the left and the right one of the same */
    struct compute_origin origins[2]; /* of template and moving */
};

struct compute_register_outputs {
    struct compute_surface ends[2]; /* template and moving, as loaded */
    size_t degree;                  /* the larger of the two */
    size_t n_theta, n_phi;          /* of the grid that the registration's points are on */
    struct srnf_registration registration;
    struct srnf_surface_measures measures; /* of the registered surface */
    struct compute_mirror_trial mirror;    /* zeros where it was not tried */
    bool bridged;                          /* through the meshes of both, from route to route */
};

/* Returns 0, or a negative status with the problem in result. A registration that has not converged
   is a result. */
int compute_register(struct jobs_run *run, const struct compute_register_inputs *inputs,
                     struct compute_register_outputs *outputs, struct jobs_result *result);
void compute_register_clear(struct compute_register_outputs *outputs);

#endif
