/*
 * processes.h - the processes of this service, as the layers below and main see them.
 */
#ifndef SRNFD_PROCESSES_H
#define SRNFD_PROCESSES_H

#include "api/handler.h"

extern const struct api_processes processes;

/* Id and both schemas as a line of JSON, for free(); NULL: no memory. */
char *process_description(const struct api_process *process);

#endif
