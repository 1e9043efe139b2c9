/*
 * trajectories.h - what the files of the process trajectories share.
 */
#ifndef SRNFD_PROCESSES_TRAJECTORIES_H
#define SRNFD_PROCESSES_TRAJECTORIES_H

#include "processes/regress.h"

struct trajectories {
    struct regress model; /* of slopes: first, so that rows of tables may take it for the whole */
    int scale;            /* 0: shape and size, 1: shape */
    double *times, *at_times; /* [n] of the members; [points of the design] */
};

/* trajectories_inputs.c: as those of regress; at has times, and a formula is not needed. The
   canonical cohort gets times and the design, that has atTimes. */
extern const struct input_own trajectories_cohort, trajectories_formula;
void trajectories_describe(struct process_inputs *given);
/* trajectories_order.c: the members in an order that is theirs whatever the cohort's is (new
   reference; NULL without memory), with what the canonical cohort says of them. */
json_t *trajectories_order(json_t *cohort, const json_t *members);

/* trajectories_result.c: the document of regress with what slopes are; NULL with the problem set.
   lengths: [members] roots of areas in units of the input. */
json_t *trajectories_document(struct jobs_run *run, const struct trajectories *asked,
                              const struct group_mean *mean, const struct srnf_trajectories *found,
                              struct jobs_result *result);

/* trajectories_doubts.c: warnings of visits that look mistaken. */
void trajectories_warn(struct jobs_run *run, const struct trajectories *asked,
                       const struct srnf_trajectories *found, json_t *document);

#endif
