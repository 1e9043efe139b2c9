/*
 * executions.h - what executions and estimates of processes share.
 */
#ifndef SRNFD_API_EXECUTIONS_H
#define SRNFD_API_EXECUTIONS_H

#include "api/handler.h"

struct framing; /* framing.h */
struct labels;  /* labels.h */

/*
 * Reads the body of an execution.
 *   labels   [out] what the job is to be called; to be cleared in any case
 *   framing  [out] how its results are wanted
 *   seconds  [out] of one processor that a job of these inputs is expected to take
 * Returns the inputs in canonical form as text (malloc), or NULL when a problem was answered.
 */
char *execution_inputs(struct api_call *call, const struct api_process *process,
                       struct labels *labels, struct framing *framing, double *seconds);

#endif
