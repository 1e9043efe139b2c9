/*
 * encode.h - from a stored mesh to the coefficients of its surface.
 */
#ifndef SRNFD_COMPUTE_ENCODE_H
#define SRNFD_COMPUTE_ENCODE_H

#include "jobs/jobs.h"

struct tasks_encoded; /* tasks/tasks.h */

struct compute_doubt {
    bool any;
    struct jobs_doubt doubt;
};

struct compute_encode_inputs {
    char mesh[STORE_ID_MAX];
    char sphere[STORE_ID_MAX];          /* for the parameterization given; otherwise "" */
    struct srnf_encode_options options; /* without its sphere, which is loaded here */
    bool mirror; /* encode the mirror images of mesh and sphere, x to -x, before all else */
    struct tasks_encoded *ahead; /* what a worker has made of it (compute/encode_ahead.h), which is
                                    taken; NULL: it is encoded here */
    struct compute_doubt *aside; /* where a doubt goes instead of into the run, for those who may
                                    not use the encoding after all; NULL: into the run */
};

/*
 * Encodes the mesh as it was prepared at its upload, or together with its sphere.
 * What comes of it is judged: the problem encoding-unfaithful, or a doubt of the run.
 *   context [in]  of the run's user: whom to tell of progress
 *   encoded [out] coefficients are owned by the caller (srnf_free); untouched on failure. Of a
 *                 mirrored mesh, origin is where the surface was before it was mirrored: in the
 *                 frame of the mesh x = scale f + origin is the mirror image in the plane x =
 *                 origin[0], through the surface's own area centroid. star.center, like
 *                 options.center, is a point of the mesh as it was uploaded
 * Returns 0, or a negative status with the problem of the job in result (none when cancelled).
 */
int compute_encode(struct jobs_run *run, const struct srnf_context *context,
                   const struct compute_encode_inputs *inputs, struct srnf_encoded *encoded,
                   struct jobs_result *result);
/* Whether an encoding by these inputs is kept from an earlier job. */
bool compute_encode_is_kept(struct jobs_run *run, const struct compute_encode_inputs *inputs);
/* The options with which the mesh, mirrored if it is to be, is encoded; no sphere, no kernel. */
struct srnf_encode_options compute_encode_options(const struct compute_encode_inputs *inputs);

#endif
