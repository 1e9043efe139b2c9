/*
 * references.c - inputs by {"value": ..} and by {"href": ..} (references.h).
 *
 * A link names a resource of this service: a mesh, surface, model, volume or cohort, or an output
 * of a job, which stands for what it holds: the id of a record, the ids of a list of records, or
 * the value itself. Nothing is fetched from elsewhere, so that a request cannot make the service
 * call into the network that it stands in, unless the settings list addresses for it: a link to one
 * of those stands for the mesh or volume that its content is, which is kept as an upload of it
 * (remote_input.c). So what a job works on is here before the job is accepted, and stays. These
 * links come last, and only if nothing is wrong without them: they are counted, judged by their
 * address, and the process judges the inputs with ids in their places that nothing has.
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

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define LOCAL_MAX 512  /* bytes of a path here */
#define OUTPUTS_MAX 16 /* links to outputs in one request: each reads the results of a job */
#define REMOTE_MAX 16  /* links to other servers in one request */

#define POINTER_MAX 160
#define NO_ELEMENT SIZE_MAX

/* Where a link to another server stands. */
struct place {
    const char *name;   /* of the input, its key */
    size_t element;     /* of its array, or NO_ELEMENT */
    const char *member; /* of its object, or NULL */
};

/* What is being resolved. */
struct resolving {
    struct api_call *call;
    struct problem_list *list;
    size_t n_outputs, n_remote;
    struct place place;              /* of what is looked at */
    struct place remote[REMOTE_MAX]; /* of the links to other servers */
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

static size_t point_to(char pointer[POINTER_MAX], const char *name)
{
    (void)snprintf(pointer, POINTER_MAX, "/inputs/%.120s", name);
    return strlen(pointer);
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

/* Notes a link to another server, which stays for now (new reference), or a problem (NULL). */
static json_t *put_off(struct resolving *r, json_t *link, const char *pointer)
{
    const char *href = json_string_value(json_object_get(link, "href"));
    char url[REMOTE_URL_MAX];

    if (!href || !r->call->request->follows) {
        problem_add(r->list, pointer,
                    "href must be the address of a resource of this service, such as "
                    "/v1/surfaces/{id}; nothing is fetched from elsewhere: upload it first");
        return NULL;
    }
    if (!remote_permits(r->call->api->remote, href, url)) {
        problem_add(r->list, pointer,
                    "href is neither of this service nor under an address that it may fetch from "
                    "(--link-prefixes): upload what is there first");
        return NULL;
    }
    if (++r->n_remote > REMOTE_MAX) {
        problem_add(r->list, pointer,
                    "a request has at most %d links to other servers; upload what they lead to",
                    REMOTE_MAX);
        return NULL;
    }
    r->remote[r->n_remote - 1] = r->place;
    return json_incref(link);
}

/* What a link means (new reference), or NULL with a problem noted or answered. */
static json_t *follow(struct resolving *r, json_t *link, const char *pointer)
{
    const char *href = json_string_value(json_object_get(link, "href"));
    const char *path = href ? local_path(r->call, href) : NULL;
    size_t n_outputs = r->n_outputs;
    char decoded[LOCAL_MAX];
    json_t *value = NULL;

    if (!path) {
        return put_off(r, link, pointer);
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

static void put_within(json_t *input, const struct place *place, json_t *value)
{
    if (place->member) {
        (void)json_object_set_new(input, place->member, value);
    } else {
        (void)json_array_set_new(input, place->element, value);
    }
}

static json_t *get_within(const json_t *input, const struct place *place)
{
    return place->member ? json_object_get(input, place->member)
                         : json_array_get(input, place->element);
}

/* Resolves what stands at r->place, in an array or an object of our own. */
static void resolve_one(struct resolving *r, json_t *input, const char *pointer)
{
    json_t *one = get_within(input, &r->place), *new;

    if (!json_is_object(one) || r->call->response->status != 0 || r->n_outputs > OUTPUTS_MAX ||
        r->n_remote > REMOTE_MAX) {
        return;
    }
    new = meaning(r, one, pointer);
    if (new) {
        put_within(input, &r->place, new);
    }
}

static void resolve_within(struct resolving *r, json_t *input, const char *pointer)
{
    const char *name = r->place.name, *member;
    json_t *value;
    void *next;

    for (size_t i = 0; i < json_array_size(input); i++) {
        r->place = (struct place){name, i, NULL};
        resolve_one(r, input, pointer);
    }
    json_object_foreach_safe(input, next, member, value)
    {
        r->place = (struct place){name, NO_ELEMENT, member};
        resolve_one(r, input, pointer);
    }
}

/* Puts what is here in the place of each value, and notes the links to other servers. */
static void resolve_here(struct resolving *r, json_t *inputs)
{
    const char *name;
    json_t *value;
    void *next;
    char pointer[POINTER_MAX];

    json_object_foreach_safe(inputs, next, name, value)
    {
        size_t n_remote = r->n_remote;
        json_t *new;

        point_to(pointer, name);
        r->place = (struct place){name, NO_ELEMENT, NULL};
        new = meaning(r, value, pointer);
        if (new && r->n_remote == n_remote) {
            resolve_within(r, new, pointer);
        }
        if (new) {
            (void)json_object_set_new(inputs, name, new);
        }
    }
}

/* ---- Other servers --------------------------------------------------------------------------- */

static bool is_within(const struct place *place)
{
    return place->member || place->element != NO_ELEMENT;
}

static void put(json_t *inputs, const struct place *place, json_t *value)
{
    if (is_within(place)) {
        put_within(json_object_get(inputs, place->name), place, value);
    } else {
        (void)json_object_set_new(inputs, place->name, value);
    }
}

/* Whether something is said to be wrong with the input. */
static bool is_wrong(const json_t *errors, const char *name)
{
    char pointer[POINTER_MAX];
    size_t length = point_to(pointer, name), i;
    json_t *entry;

    json_array_foreach(errors, i, entry)
    {
        const char *where = json_string_value(json_object_get(entry, "pointer"));

        if (where && strncmp(where, pointer, length) == 0 &&
            (where[length] == '\0' || where[length] == '/')) {
            return true;
        }
    }
    return false;
}

/* What the process finds wrong with the inputs by their form alone, with ids in the places of the
   links: of volumes where volumes is true of the link, or else of meshes. NULL: nothing. An entry
   that the list has before lets the process look up no id; it is taken out again. */
static struct problem_list judge_form(struct resolving *r, const struct api_process *process,
                                      json_t *inputs, const bool *volumes)
{
    struct problem_list list = {.errors = NULL};
    const struct api_work work = r->call->work;
    json_t *form = json_copy(inputs);
    char id[64];

    for (size_t i = 0; form && i < r->n_remote; i++) {
        const char *name = r->remote[i].name;

        if (is_within(&r->remote[i])) {
            (void)json_object_set_new(form, name, json_copy(json_object_get(form, name)));
        }
    }
    for (size_t i = 0; form && i < r->n_remote; i++) {
        (void)snprintf(id, sizeof id, "%s-%032zx", volumes[i] ? "vol" : "mesh", i);
        put(form, &r->remote[i], json_string(id));
    }
    problem_add(&list, "", "links are not followed yet");
    json_decref(r->call->api->config.processes->canonicalize(process->table, r->call, form, &list));
    r->call->work = work;
    (void)json_array_remove(list.errors, 0);
    list.count--;
    json_decref(form);
    return list;
}

/* Whether the inputs are right as far as they can be judged without what the links lead to; or else
   what is wrong goes into the list, or a problem was answered. */
static bool is_right(struct resolving *r, const struct api_process *process, json_t *inputs)
{
    bool volumes[REMOTE_MAX] = {false};
    struct problem_list list = judge_form(r, process, inputs, volumes), other;

    if (list.count > 0 && r->call->response->status == 0) {
        /* A link that is wrong as a mesh may be right as a volume. */
        for (size_t i = 0; i < r->n_remote; i++) {
            volumes[i] = is_wrong(list.errors, r->remote[i].name);
        }
        other = judge_form(r, process, inputs, volumes);
        json_decref(other.count < list.count ? list.errors : other.errors);
        list = other.count < list.count ? other : list;
    }
    if (list.count == 0 || r->call->response->status != 0) {
        json_decref(list.errors);
        return list.count == 0 && r->call->response->status == 0;
    }
    *r->list = list;
    return false;
}

static void fetch_all(struct resolving *r, json_t *inputs)
{
    double seconds = r->call->api->config.link_seconds;
    char pointer[POINTER_MAX];

    for (size_t i = 0; i < r->n_remote && r->call->response->status == 0; i++) {
        const struct place *place = &r->remote[i];
        const json_t *link = json_object_get(inputs, place->name);
        const char *href, *type;
        json_t *id;

        link = is_within(place) ? get_within(link, place) : link;
        href = json_string_value(json_object_get(link, "href"));
        type = json_string_value(json_object_get(link, "type"));
        point_to(pointer, place->name);
        id = remote_input(r->call, href, type, pointer, &seconds);
        if (id) {
            put(inputs, place, id);
        }
    }
}

bool references_resolve(struct api_call *call, const struct api_process *process, json_t *inputs,
                        struct problem_list *list)
{
    struct resolving r = {.call = call, .list = list};

    resolve_here(&r, inputs);
    if (r.n_remote > 0 && !list->errors && call->response->status == 0 &&
        is_right(&r, process, inputs)) {
        fetch_all(&r, inputs);
    }
    return call->response->status == 0;
}
