/*
 * projected.h - a subject beside a model: both loaded, the subject registered to the mean as the
 * members were, and projected.
 */
#ifndef SRNFD_TOOLKIT_PROJECTED_H
#define SRNFD_TOOLKIT_PROJECTED_H

#include "compute/mirror.h"
#include "toolkit/model_members.h"
#include "toolkit/subject.h"

struct projected {
    struct compute_model model;
    struct compute_projected subject;
    const struct srnf_register_options *registration; /* options; NULL: nothing was registered */
    struct srnf_register_options options;
    struct model_members members;
    struct compute_projection projection;
    struct compute_mirror_trial trial;
    json_t *made; /* madeFrom of the model */
};

/* 0, or a negative status with the problem in result; projected_clear in any case. input must
   outlive it. */
int projected_make(struct jobs_run *run, const char *model, const struct subject_input *input,
                   struct projected *projected, struct jobs_result *result);
void projected_clear(struct projected *projected);

/* Tries the mirror image where handedness (enum handedness) is checked and the subject is no member
   of the model: members are on its side. 0, or a negative status with the problem in result. */
int projected_try_mirrored(struct jobs_run *run, int handedness, struct projected *projected,
                           struct jobs_result *result);

#endif
