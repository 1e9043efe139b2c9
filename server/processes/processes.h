/*
 * processes.h - the processes of this service, as the layers below and main see them.
 */
#ifndef SRNFD_PROCESSES_H
#define SRNFD_PROCESSES_H

#include "api/handler.h"

extern const struct api_processes processes;

/* Runs a job of one of them, on a worker: what the job engine has for each. */
void process_run(struct jobs_run *run, void *user, const char *inputs, struct jobs_result *result);
/* Id and both schemas as a line of JSON, for free(); NULL: no memory. */
char *process_description(const struct api_process *process);

#endif
