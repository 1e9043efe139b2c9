/*
 * seconds.h - how long a job is expected to take, from its canonical inputs and from what
 * was read of the things that they name. It orders the queue and says which jobs are short enough
 * for the express threads (jobs/workers.c); nothing that a job computes depends on it.
 */
#ifndef SRNFD_TOOLKIT_SECONDS_H
#define SRNFD_TOOLKIT_SECONDS_H

#include "api/handler.h"

typedef double process_seconds(const struct api_work *work, const json_t *inputs);

process_seconds encode_seconds, invert_seconds, geodesic_seconds, register_seconds,
    distances_seconds, neighbours_seconds, mean_seconds, modes_seconds, sample_seconds,
    project_seconds, evaluate_seconds, compare_seconds, shoot_seconds, transport_seconds,
    transfer_seconds, regress_seconds;

/* Of the encodings of a group's meshes, and where it is registered of those that bridge its
   routes. */
double seconds_of_group(const struct api_work *work, bool registered);

#endif
