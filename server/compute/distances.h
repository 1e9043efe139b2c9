/*
 * distances.h - the matrix of distances of a group, computed here or by workers.
 */
#ifndef SRNFD_COMPUTE_DISTANCES_H
#define SRNFD_COMPUTE_DISTANCES_H

#include "compute/group.h"

/* The error of a call that has set the problem of the job itself. */
#define COMPUTE_FAILED (-1000)

/*
 * As srnf_metric_distances of the group, with the same bits. Registered distances by srnf and srm
 * are tasks where the service offers them to workers; otherwise they are kept for a later attempt.
 *   registration [in]  NULL: as parameterized
 *   matrix       [out] double[n][n]
 * Errors: as srnf_metric_distances; COMPUTE_FAILED with the problem in result.
 */
int compute_distances(struct jobs_run *run, const struct srnf_sht *sht, enum srnf_metric metric,
                      const struct compute_group *group,
                      const struct srnf_register_options *registration, double *matrix,
                      struct jobs_result *result, struct srnf_error *error);

/* From now on the run's context offers the pairs that srnf_nearest_neighbours registers to workers
   (srnf_context.measure), where the service does; the results have the same bits. What its tasks
   fail with becomes the problem of the job. Otherwise they are kept for a later attempt. */
void compute_pairs_measured(struct jobs_run *run);

#endif
