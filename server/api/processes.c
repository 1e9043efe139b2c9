/*
 * processes.c - the processes that the service offers: their list, and what each takes and gives.
 */
#include "api/routes.h"

#include <stdio.h>
#include <string.h>

const struct api_process *api_process_find(const struct api *api, const char *id)
{
    const struct api_process *const *rows = api->config.processes->rows;

    while (*rows && strcmp((*rows)->id, id) != 0) {
        rows++;
    }
    return *rows;
}

static json_t *process_record(const struct api_processes *all, const struct api_process *process,
                              bool whole)
{
    json_t *document = json_object(), *links = json_object();
    char path[96];

    (void)snprintf(path, sizeof path, "/v1/processes/%s", process->id);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/processes/%s/execution", process->id);
    (void)json_object_set_new(links, "execute", json_string(path));
    (void)json_object_set_new(document, "id", json_string(process->id));
    (void)json_object_set_new(document, "title", json_string(process->title));
    (void)json_object_set_new(document, "description", json_string(process->description));
    (void)json_object_set_new(document, "version", json_string(SRNF_VERSION));
    (void)json_object_set_new(document, "jobControlOptions",
                              json_pack("[s,s,s]", "sync-execute", "async-execute", "dismiss"));
    if (whole) {
        (void)json_object_set_new(document, "inputs", all->inputs_schema(process));
        (void)json_object_set_new(document, "outputs", all->outputs_schema(process));
    }
    (void)json_object_set_new(document, "links", links);
    return document;
}

void processes_list(struct api_call *call)
{
    const struct api_processes *all = call->api->config.processes;
    json_t *items = json_array();

    for (size_t i = 0; all->rows[i]; i++) {
        (void)json_array_append_new(items, process_record(all, all->rows[i], false));
    }
    respond_json(call, 200, json_pack("{s:o,s:n}", "items", items, "next"));
}

void processes_get(struct api_call *call)
{
    const struct api_process *process = api_process_find(call->api, call->parameters[0]);

    if (!process) {
        (void)problem_respond(call, "no-such-process", "There is no process \"%.60s\".",
                              call->parameters[0]);
        return;
    }
    respond_json(call, 200, process_record(call->api->config.processes, process, true));
}
