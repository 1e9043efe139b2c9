/*
 * references.c - inputs by {"value": ..} and by {"href": ..} (references.h).
 *
 * A link names a resource of this service: a mesh, surface, model, volume or cohort, or an output
 * of a job, which stands for what it holds: the id of a record, the ids of a list of records, or
 * the value itself. Nothing is fetched from elsewhere, so that a request cannot make the service
 * call into the network that it stands in, unless the settings list addresses for it: a link to one
 * of those stands for the mesh or volume that its content is, which is kept as an upload of it
 * (remote_input.c). So what a job works on is here before the job is accepted, and stays.
 *
 * An object is a qualified value or a link only if all its members are those of one: inputs of our
 * own are objects, too.
 */
#include "api/references.h"

#include "api/auth.h"
#include "api/framing.h"
#include "api/json_memory.h"
#include "api/remote.h"
#include "api/respond.h"
#include "api/routes.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define LOCAL_MAX 512  /* bytes of a path here */
#define OUTPUTS_MAX 16 /* links to outputs in one request: each reads the results of a job */
#define REMOTE_MAX 16  /* links to other servers in one request */

/* What is being resolved. */
struct resolving {
    struct api_call *call;
    struct problem_list *list;
    size_t n_outputs, n_remote;
    double seconds; /* left for what is elsewhere */
};

static const char *const value_members[] = {"value",  "mediaType", "encoding",
                                            "schema", "format",    NULL};
static const char *const link_members[] = {"href", "rel", "type", "title", "hreflang", NULL};

/* Whether the object has the first of these members and none beside them. */
static bool is_of(json_t *object, const char *const *members)
{
    const char *name;
    json_t *value;

    if (!json_object_get(object, members[0])) {
        return false;
    }
    json_object_foreach(object, name, value)
    {
        size_t i = 0;

        while (members[i] && strcmp(members[i], name) != 0) {
            i++;
        }
        if (!members[i]) {
            return false;
        }
    }
    return true;
}

/* The path of an address on this service; NULL where it is another's. */
static const char *local_path(const struct api_call *call, const char *href)
{
    const char *host = api_request_header(call->request, "Host");
    const char *rest = strstr(href, "://");
    size_t length;

    if (href[0] == '/' && href[1] != '/') {
        return href;
    }
    if (!rest || !host || strcspn(href, "/?#") < (size_t)(rest - href)) {
        return NULL;
    }
    rest += 3;
    length = strcspn(rest, "/");
    return length == strlen(host) && strncasecmp(rest, host, length) == 0 ? rest + length : NULL;
}

/* What one record stands for: its id, or itself. New reference. */
static json_t *id_of(json_t *value)
{
    json_t *id = json_is_object(value) ? json_object_get(value, "id") : NULL;

    return json_incref(json_is_string(id) ? id : value);
}

/* The value of an output (new reference), or NULL where there is none or a problem was answered. */
static json_t *output_value(struct api_call *call, const char *job, const char *output)
{
    struct framing_member member;
    char *results = NULL;
    size_t size = 0, i;
    json_t *value = NULL, *ids = NULL, *one;
    int status = call_sees(call, job);

    if (status == 0) {
        status = store_job_results(call->api->config.store, job, &results, &size);
    }
    if (status == STORE_CONFLICT) {
        (void)problem_respond(call, "result-not-ready", "%s has no results (yet).", job);
    } else if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", job);
    } else if (framing_find(results, size, output, &member)) {
        value = member.value[0] == '{' || member.value[0] == '['
                    ? json_memory_load(member.value, member.length, 0, NULL, NULL)
                    : json_loadb(member.value, member.length, JSON_DECODE_ANY, NULL);
    }
    free(results);
    if (!json_is_array(value)) {
        ids = value ? id_of(value) : NULL;
    } else {
        ids = json_array();
        json_array_foreach(value, i, one)
        {
            (void)json_array_append_new(ids, id_of(one));
        }
    }
    json_decref(value);
    return ids;
}

/* What is at the path (new reference); NULL: nothing that an input can be, or a problem was
   answered. */
static json_t *resource(struct resolving *r, const char *pointer, const char *path)
{
    static const char *const patterns[] = {
        "/v1/meshes/{id}",  "/v1/meshes/{id}/content",  "/v1/surfaces/{id}", "/v1/models/{id}",
        "/v1/volumes/{id}", "/v1/volumes/{id}/content", "/v1/cohorts/{name}"};
    char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE];

    for (size_t i = 0; i < sizeof patterns / sizeof patterns[0]; i++) {
        if (route_matches(patterns[i], path, parameters)) {
            return json_string(parameters[0]);
        }
    }
    if (!route_matches("/v1/jobs/{id}/results/{output}", path, parameters)) {
        return NULL;
    }
    if (++r->n_outputs > OUTPUTS_MAX) {
        problem_add(r->list, pointer,
                    "a request has at most %d links to outputs of jobs; name what they hold",
                    OUTPUTS_MAX);
        return NULL;
    }
    return output_value(r->call, parameters[0], parameters[1]);
}

/* The id of what lies on another server, or NULL with a problem noted or answered. */
static json_t *fetched(struct resolving *r, const json_t *link, const char *pointer)
{
    const char *href = json_string_value(json_object_get(link, "href"));

    if (!href || !remote_enabled(r->call->api->remote)) {
        problem_add(r->list, pointer,
                    "href must be the address of a resource of this service, such as "
                    "/v1/surfaces/{id}; nothing is fetched from elsewhere: upload it first");
        return NULL;
    }
    if (++r->n_remote > REMOTE_MAX) {
        problem_add(r->list, pointer,
                    "a request has at most %d links to other servers; upload what they lead to",
                    REMOTE_MAX);
        return NULL;
    }
    return remote_input(r->call, href, json_string_value(json_object_get(link, "type")), pointer,
                        &r->seconds, r->list);
}

/* What a link means (new reference), or NULL with a problem noted or answered. */
static json_t *follow(struct resolving *r, const json_t *link, const char *pointer)
{
    const char *href = json_string_value(json_object_get(link, "href"));
    const char *path = href ? local_path(r->call, href) : NULL;
    size_t n_outputs = r->n_outputs;
    char decoded[LOCAL_MAX];
    json_t *value = NULL;

    if (!path) {
        return fetched(r, link, pointer);
    }
    if (percent_decode(path, strlen(path), false, decoded, sizeof decoded)) {
        value = resource(r, pointer, decoded);
    }
    if (!value && r->call->response->status == 0 &&
        (r->n_outputs == n_outputs || r->n_outputs <= OUTPUTS_MAX)) {
        problem_add(r->list, pointer,
                    "href names no mesh, volume, surface, cohort, model or output of a job");
    }
    return value;
}

/* What stands in the place of one value (new reference), or NULL. */
static json_t *meaning(struct resolving *r, json_t *value, const char *pointer)
{
    if (!json_is_object(value)) {
        return json_incref(value);
    }
    if (is_of(value, value_members)) {
        return json_incref(json_object_get(value, "value"));
    }
    if (is_of(value, link_members)) {
        return follow(r, value, pointer);
    }
    return json_incref(value);
}

bool references_resolve(struct api_call *call, json_t *inputs, struct problem_list *list)
{
    struct resolving r = {.call = call, .list = list, .seconds = call->api->config.link_seconds};
    const char *name;
    json_t *value, *element;
    void *next;
    char pointer[160];
    size_t i;

    json_object_foreach_safe(inputs, next, name, value)
    {
        json_t *new;

        (void)snprintf(pointer, sizeof pointer, "/inputs/%.120s", name);
        new = meaning(&r, value, pointer);
        for (i = 0; call->response->status == 0 && r.n_outputs <= OUTPUTS_MAX &&
                    r.n_remote <= REMOTE_MAX && (element = json_array_get(new, i)) != NULL;
             i++) {
            json_t *one = json_is_object(element) ? meaning(&r, element, pointer) : NULL;

            if (one) {
                (void)json_array_set_new(new, i, one);
            }
        }
        if (new) {
            (void)json_object_set_new(inputs, name, new);
        }
    }
    return call->response->status == 0;
}
