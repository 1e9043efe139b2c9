/*
 * geodesic.h - the process geodesic: the path between two surfaces, the second registered
 * to the first or as it is parameterised.
 */
#ifndef SRNFD_COMPUTE_GEODESIC_H
#define SRNFD_COMPUTE_GEODESIC_H

#include "compute/bridge.h"
#include "compute/mirror.h"

struct compute_geodesic_inputs {
    const char *from, *to;                            /* ids of surfaces or meshes */
    const struct srnf_register_options *registration; /* NULL: as they are parameterised */
    struct srnf_geodesic_options options;
    struct compute_origin origins[2]; /* of from and to */
    bool pullback; /* the geodesic of the pulled-back metric, whatever options.method is */
    /* Where they are registered: try the mirror image of the second end too (compute_mirror_pair)
       */
    bool handedness;
    bool opposite; /* the two are the left and the right one of the same */
};

struct compute_geodesic_outputs {
    struct compute_surface ends[2];        /* as loaded */
    struct srnf_registration registration; /* of the second end to the first, if asked for */
    bool bridged;                  /* registered through the meshes of both, from route to route */
    struct srnf_geodesic geodesic; /* at the larger degree of the two */
    struct srnf_pullback_geodesic pullback; /* its figures, when asked for; steps 0 otherwise */
    struct srnf_surface_measures *measures; /* [steps], owned */
    double *squared_norm;               /* [steps], owned: ||q_t||^2 of the straight line in Q */
    struct compute_mirror_trial mirror; /* zeros where it was not tried */
};

/* Returns 0, or a negative status with the problem in result. */
int compute_geodesic(struct jobs_run *run, const struct compute_geodesic_inputs *inputs,
                     struct compute_geodesic_outputs *outputs, struct jobs_result *result);
void compute_geodesic_clear(struct compute_geodesic_outputs *outputs);

#endif
