/*
 * processes.c - the processes that can be executed, in the order in which they are listed.
 *
 * The Makefile finds them: PROCESSES has a row for each struct api_process that a file of this
 * folder defines. That is all that the service knows of a process: the routes, the job engine's
 * table and the self-description are made from what its file declares.
 */
#include "processes/processes.h"

#include "toolkit/table.h"

#define DECLARE(name) extern const struct api_process name##_process;
#define ADDRESS(name) &name##_process,
PROCESSES(DECLARE)

static const struct api_process *const rows[] = {PROCESSES(ADDRESS) NULL};

const struct api_processes processes = {rows, table_canonicalize, table_inputs_schema,
                                        table_outputs_schema};

char *process_description(const struct api_process *process)
{
    json_t *document = json_pack("{s:s, s:o, s:o}", "id", process->id, "inputs",
                                 table_inputs_schema(process->table), "outputs",
                                 table_outputs_schema(process->table));
    char *text = document ? json_dumps(document, JSON_COMPACT) : NULL;

    json_decref(document);
    return text;
}
