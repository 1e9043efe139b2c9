/*
 * mean.h - what the processes that begin with the mean of a group share: its inputs, and
 * the members of their results that tell of it.
 */
#ifndef SRNFD_PROCESSES_MEAN_H
#define SRNFD_PROCESSES_MEAN_H

#include "toolkit/group_doubts.h"
#include "toolkit/group.h"
#include "compute/mean.h"

/* Reads register, commonPose, tolerance, maxIterations and method, which is srnf. */
void inputs_mean_options(struct process_inputs *inputs);
/* Reads lmax, by default that of the group of n surfaces, and checks the memory for `copies` fields
   of each surface. n 0: the group had a problem. */
void inputs_mean_degree(struct process_inputs *inputs, size_t n, long degree, size_t copies);

/* Fills typed from canonical inputs, and options, which it borrows like ids, but for the subjects,
   which a caller that has them sets; origins are the caller's to free in any case. False with the
   problem set for want of memory, also where ids is NULL. */
bool mean_inputs(struct jobs_run *run, const json_t *inputs, size_t n, const char *const *ids,
                 struct compute_mean_inputs *typed, struct srnf_register_options *options,
                 struct jobs_result *result);

/* Stores the mean surface with maps, or NULL for none; its record, or NULL with the problem set. */
json_t *mean_keep_surface(struct jobs_run *run, const char *process, const char *name,
                          const struct compute_mean_inputs *typed,
                          const struct compute_mean_outputs *outputs, const struct store_maps *maps,
                          struct jobs_result *result);

/* iterations, converged, history, relativeEnergy, seconds, registration, bridged and
   bridgedSurfaces of the result. */
void mean_set_members(json_t *document, const struct compute_mean_inputs *typed,
                      const struct compute_mean_outputs *outputs);

/* Adds the warnings of group_doubts.h, of which `doubts` has the ids, the cohort and the classes.
   False with the problem set. */
bool mean_warn(struct jobs_run *run, const struct compute_mean_inputs *typed,
               const struct compute_mean_outputs *outputs, struct group_doubts doubts,
               json_t *document, struct jobs_result *result);

#endif
