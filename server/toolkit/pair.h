/*
 * pair.h - what processes on two surfaces share: both brought to one degree, and the second
 * registered to the first.
 */
#ifndef SRNFD_TOOLKIT_PAIR_H
#define SRNFD_TOOLKIT_PAIR_H

#include "toolkit/handedness.h"
#include "compute/bridge.h"

struct pair {
    struct compute_surface ends[2];         /* as loaded */
    size_t degree;                          /* the larger of the two */
    size_t count;                           /* coefficients of a surface: 3 (degree + 1)^2 */
    const struct srnf_sht *sht;             /* of that degree, on its working grid */
    double *coefficients;                   /* [2][count] */
    const struct srnf_landmarks *landmarks; /* that guide pair_register; NULL, as pair_load leaves
                                               it: none */
    bool by_route; /* meshes were encoded by a route that was asked for: no other is sought */
    /* What pair_register adds: */
    struct srnf_registration registration; /* of the second end to the first */
    double free_distance; /* where landmarks guide: what a registration without them comes to */
    bool bridged;         /* through the meshes of both, from route to route */
    bool opposite;        /* they are the left and the right one of the same */
    struct compute_mirror_trial mirror; /* zeros where it was not tried */
};

/*
 * Loads two surfaces or meshes, each a phase of `share` percent of the job; meshes are encoded by
 * this route, auto where none is asked for. Returns 0, or a negative status with the problem set;
 * pair_clear in any case.
 */
int pair_load(struct jobs_run *run, const char *first, const char *second,
              enum srnf_parameterization route, double share, struct pair *pair,
              struct jobs_result *result);
/* Registers the second to the first, guided by landmarks if there are any; otherwise through their
   meshes where the surfaces came by different routes (compute/bridge.h) and none was asked for. And
   its mirror image too, if handedness is to be checked and no landmarks guide. As pair_load; a
   registration that has not converged is a result. */
int pair_register(struct jobs_run *run, struct pair *pair,
                  const struct srnf_register_options *options, enum handedness handedness,
                  struct jobs_result *result);
/* The warnings of a mirror image that matches better. New reference. */
json_t *pair_warnings(struct jobs_run *run, const struct pair *pair);
/* Of a pair that was registered in a common pose: the warning pose-differs, where a turn alone does
   far better. As pair_load. */
int pair_warn_pose(struct jobs_run *run, const struct pair *pair, json_t *document,
                   struct jobs_result *result);
/* The same of two surfaces of a degree that are not registered. what: "from and to". */
int pair_warn_unregistered(struct jobs_run *run, size_t degree, const double *first,
                           const double *second, const char *what, json_t *document,
                           struct jobs_result *result);
void pair_clear(struct jobs_run *run, struct pair *pair);

#endif
