/*
 * encode_ahead.h - meshes that workers encode, before compute_encode is asked for them.
 */
#ifndef SRNFD_COMPUTE_ENCODE_AHEAD_H
#define SRNFD_COMPUTE_ENCODE_AHEAD_H

#include "compute/encode.h"
#include "tasks/tasks.h"

/* Of n meshes, by their places. */
struct compute_ahead {
    struct tasks_encoded *found; /* [n]; what compute_encode has taken has no coefficients */
    bool *there;                 /* [n] */
    size_t n;
};

/*
 * Where the service offers tasks to workers, has those of the meshes encoded by them that no
 * encoding is kept of, and sets the member ahead of their inputs: compute_encode then finds them.
 * What cannot be offered (a mesh that is gone or has problems, or one beyond a content) is left to
 * compute_encode.
 *   inputs   [in/out] [n]; those of NULL are left out
 *   from, to [in]     of the progress of the run's phase
 *   ahead    [out]    to outlive the inputs; compute_ahead_clear, in any case
 * Returns 0, or a negative status with the problem in result (none when cancelled).
 */
int compute_encode_ahead(struct jobs_run *run, size_t n, struct compute_encode_inputs **inputs,
                         double from, double to, struct compute_ahead *ahead,
                         struct jobs_result *result);
void compute_ahead_clear(struct compute_ahead *ahead);

#endif
