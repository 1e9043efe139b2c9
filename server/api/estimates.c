/*
 * estimates.c - POST /v1/processes/{id}/estimate: what an execution with the same body would take.
 *
 * The body is read as that of an execution, so what is refused there is refused here, and nothing
 * is queued, kept or fetched. The seconds are those that the queue is ordered by, the bytes those
 * that the job is judged by before it is accepted; either is null where the service knows none.
 */
#include "api/executions.h"
#include "api/framing.h"
#include "api/labels.h"
#include "api/respond.h"
#include "api/routes.h"
#include "jobs/jobs.h"

#include <math.h>
#include <stdlib.h>

/* NULL where it is not known. */
static json_t *known(double value)
{
    return value > 0.0 && isfinite(value) ? json_real(value) : json_null();
}

static void answer(struct api_call *call, const struct api_process *process, double seconds)
{
    size_t limit = jobs_memory_limit(call->api->config.jobs);
    double bytes = ceil(call->work.bytes);
    json_t *document =
        json_pack("{s:o, s:o, s:I}", "estimatedSeconds", known(process->guessed ? 0.0 : seconds),
                  "estimatedBytes", bytes > 0.0 ? json_integer((json_int_t)bytes) : json_null(),
                  "memoryLimit", (json_int_t)limit);

    respond_json(call, 200, document);
}

void executions_estimate(struct api_call *call)
{
    const struct api_process *process = api_process_find(call->api, call->parameters[0]);
    struct labels labels = {.tags = NULL};
    struct framing framing = {0};
    double seconds = 0.0;
    char *inputs;

    if (!process) {
        api_process_missing(call);
        return;
    }
    inputs = execution_inputs(call, process, &labels, &framing, &seconds);
    if (inputs) {
        answer(call, process, seconds);
    }
    labels_clear(&labels);
    free(inputs);
}
