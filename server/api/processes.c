/*
 * processes.c - the processes that the service offers: their list, and what each takes and gives,
 * as OGC API - Processes 1.0 describes them. Inputs and outputs are those of the tables (one schema
 * of an object each), taken apart into a map by name.
 */
#include "api/links.h"
#include "api/lists.h"
#include "api/respond.h"
#include "api/near.h"
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

void api_process_names(const struct api *api, const char *names[API_PROCESSES_MAX])
{
    const struct api_process *const *rows = api->config.processes->rows;
    size_t n = 0;

    for (; rows[n] && n + 1 < API_PROCESSES_MAX; n++) {
        names[n] = rows[n]->id;
    }
    names[n] = NULL;
}

void api_process_missing(struct api_call *call)
{
    const char *names[API_PROCESSES_MAX];
    char begin[100], text[NEAR_SENTENCE_MAX];

    api_process_names(call->api, names);
    (void)snprintf(begin, sizeof begin, "There is no process \"%.60s\"", call->parameters[0]);
    near_sentence(text, begin, call->parameters[0], names);
    (void)problem_respond(call, "no-such-process", "%s", text);
}

static bool is_required(const json_t *schema, const char *name)
{
    const json_t *required = json_object_get(schema, "required"), *one;
    size_t i;

    json_array_foreach(required, i, one)
    {
        if (strcmp(json_string_value(one), name) == 0) {
            return true;
        }
    }
    return false;
}

/* The properties of an object's schema, each by itself: title, description, schema, and of inputs
   how often they occur. Takes over the schema. */
static json_t *described_members(json_t *schema, bool inputs)
{
    json_t *map = json_object(), *property;
    const char *name;
    char title[64];

    json_object_foreach(json_object_get(schema, "properties"), name, property)
    {
        json_t *one = json_object();

        title_of(name, title, sizeof title);
        (void)json_object_set_new(one, "title", json_string(title));
        (void)json_object_set(one, "description", json_object_get(property, "description"));
        if (inputs) {
            (void)json_object_set_new(one, "minOccurs",
                                      json_integer(is_required(schema, name) ? 1 : 0));
            (void)json_object_set_new(one, "maxOccurs", json_integer(1));
        }
        (void)json_object_del(property, "description");
        schema_to_openapi30(property);
        (void)json_object_set(one, "schema", property);
        (void)json_object_set_new(map, name, one);
    }
    json_decref(schema);
    return map;
}

static json_t *process_links(const struct api_process *process, bool whole)
{
    json_t *links = json_array();
    char path[96];

    (void)snprintf(path, sizeof path, "/v1/processes/%s", process->id);
    link_add(links, path, whole ? "self" : LINK_OGC "process-desc", LINK_JSON,
             "Inputs and outputs");
    (void)snprintf(path, sizeof path, "/v1/processes/%s/execution", process->id);
    link_add(links, path, LINK_OGC "execute", LINK_JSON, "POST here to run it");
    return links;
}

static json_t *process_record(const struct api_processes *all, const struct api_process *process,
                              bool whole)
{
    json_t *document = json_object();

    (void)json_object_set_new(document, "id", json_string(process->id));
    (void)json_object_set_new(document, "title", json_string(process->title));
    (void)json_object_set_new(document, "description", json_string(process->description));
    (void)json_object_set_new(document, "version", json_string(SRNF_VERSION));
    (void)json_object_set_new(document, "jobControlOptions",
                              json_pack("[s,s,s]", "sync-execute", "async-execute", "dismiss"));
    (void)json_object_set_new(document, "outputTransmission",
                              json_pack("[s,s]", "value", "reference"));
    if (whole) {
        (void)json_object_set_new(document, "inputs",
                                  described_members(all->inputs_schema(process->table), true));
        (void)json_object_set_new(document, "outputs",
                                  described_members(all->outputs_schema(process->table), false));
    }
    (void)json_object_set_new(document, "links", process_links(process, whole));
    return document;
}

/* The place of the first process after the cursor, which is the id of one; SIZE_MAX: of none. */
static size_t place_after(const struct api_processes *all, const char *cursor)
{
    for (size_t i = 0; all->rows[i]; i++) {
        if (strcmp(all->rows[i]->id, cursor) == 0) {
            return i + 1;
        }
    }
    return SIZE_MAX;
}

void processes_list(struct api_call *call)
{
    const struct api_processes *all = call->api->config.processes;
    json_t *items, *links, *document;
    char cursor[48], path[160];
    size_t limit = 0, at = 0;
    bool refused;

    if (!list_limit(call, &limit)) {
        return;
    }
    if (query_get(call, "cursor", cursor, sizeof cursor, &refused)) {
        at = place_after(all, cursor);
    }
    if (refused || at == SIZE_MAX) {
        (void)(refused || list_refuse(call, "/cursor", "cursor is not one that this list gave."));
        return;
    }
    items = json_array();
    links = json_array();
    for (size_t end = at + limit; at < end && all->rows[at]; at++) {
        (void)json_array_append_new(items, process_record(all, all->rows[at], false));
    }
    document = json_pack("{s:o, s:o}", "processes", items, "links", links);
    list_self(call, links, "/v1/processes");
    if (all->rows[at]) {
        const char *last = all->rows[at - 1]->id;

        (void)snprintf(path, sizeof path, "/v1/processes?limit=%zu&cursor=%s", limit, last);
        link_add(links, path, "next", LINK_JSON, "The next page");
        (void)json_object_set_new(document, "next", json_string(last));
        (void)api_response_header(call->response, "Link", "<%s>; rel=\"next\"", path);
    }
    respond_json(call, 200, document);
}

void processes_get(struct api_call *call)
{
    const struct api_process *process = api_process_find(call->api, call->parameters[0]);

    if (!process) {
        api_process_missing(call);
        return;
    }
    respond_json(call, 200, process_record(call->api->config.processes, process, true));
}
