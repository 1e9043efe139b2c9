/*
 * group_doubts.h - warnings of a group whose members do not belong together (compute/likeness.h):
 * the same subject twice, members unlike the others, mirror images, other poses.
 */
#ifndef SRNFD_TOOLKIT_GROUP_DOUBTS_H
#define SRNFD_TOOLKIT_GROUP_DOUBTS_H

#include "toolkit/process.h"
#include "compute/likeness.h"

struct group_doubts {
    const json_t *surfaces, *cohort; /* canonical: ids; labels, subjects, mirrored, or null */
    const struct compute_group *group;
    const double *pairs;   /* [n][n] */
    const size_t *classes; /* [n] below n_classes; NULL: none */
    size_t n_classes;
    const char *const *names; /* [n_classes] */
    bool rotates;             /* as the process was asked */
    bool positions;           /* where the parts of subjects are counts too (relativePose) */
    bool members;             /* whether members far from the others are told of here */
    bool mirrors;             /* whether mirror images are looked for */
};

/* How rotations are let be sought, for the end of a sentence of advice. positions: turns would lose
   them, and are refused. */
const char *doubts_rotations(bool positions);
/* Adds the warnings to the document; false with the problem set. pairs NULL: none. */
bool group_doubts_warn(struct jobs_run *run, const struct group_doubts *doubts, json_t *document,
                       struct jobs_result *result);

#endif
