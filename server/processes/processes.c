/*
 * processes.c - the table of the processes that can be executed.
 *
 * A row is all that the service knows of a process: the routes, the job engine's table and the
 * self-description are made from it. Processes with a table of their inputs (toolkit/table.h) have
 * their row in their own file; the others have it here.
 */
#include <string.h>

#include "processes/processes.h"
#include "toolkit/process.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"

static const struct api_process *const rows[] = {
    &encode_process,
    &invert_process,
    &geodesic_process,
    &register_process,
    &distances_process,
    &mean_process,
    &pca_process,
    &modes_process,
    &sample_process,
    &project_process,
    &evaluate_process,
    &compare_process,
    &shoot_process,
    &transport_process,
    &transfer_process,
    &classify_process,
    NULL,
};

static const struct api_process *find(const char *id)
{
    for (size_t i = 0; rows[i]; i++) {
        if (strcmp(rows[i]->id, id) == 0) {
            return rows[i];
        }
    }
    return NULL;
}

static json_t *canonicalise(const struct api_process *process, struct api_call *call,
                            const json_t *inputs, struct problem_list *list)
{
    return process->table ? table_canonicalise(process->table, call, inputs, list)
                          : process->canonicalise(call, inputs, list);
}

static json_t *inputs_schema(const struct api_process *process)
{
    return process->table ? table_inputs_schema(process->table)
                          : json_loads(process->inputs_schema, JSON_REJECT_DUPLICATES, NULL);
}

static json_t *outputs_schema(const struct api_process *process)
{
    return process->table ? table_outputs_schema(process->table)
                          : json_loads(process->outputs_schema, JSON_REJECT_DUPLICATES, NULL);
}

const struct api_processes processes = {rows, canonicalise, inputs_schema, outputs_schema};

void process_run(struct jobs_run *run, void *api, const char *inputs, struct jobs_result *result)
{
    const struct api_process *process = find(jobs_run_process(run));

    if (process && process->table) {
        table_run(process->table, run, inputs, result);
    } else if (process) {
        process->run(run, api, inputs, result);
    }
}

char *process_description(const struct api_process *process)
{
    json_t *document = json_pack("{s:s, s:o, s:o}", "id", process->id, "inputs",
                                 inputs_schema(process), "outputs", outputs_schema(process));
    char *text = document ? json_dumps(document, JSON_COMPACT) : NULL;

    json_decref(document);
    return text;
}
