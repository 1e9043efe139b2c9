/*
 * searches.h - registrations to a field as tasks of workers.
 */
#ifndef SRNFD_COMPUTE_SEARCHES_H
#define SRNFD_COMPUTE_SEARCHES_H

#include "jobs/jobs.h"

/* From now on the run's context offers the registrations of means and folds to workers
   (srnf_context.search), where the service does; the results have the same bits. What its tasks
   fail with becomes the problem of the job. */
void compute_searches_spread(struct jobs_run *run);

#endif
