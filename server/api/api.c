/*
 * api.c - a request's way through the api layer: what is refused before the body is read, and the
 * call of the route's handler afterwards.
 *
 * api_begin decides from method, path, query and headers alone: 404, 405 with Allow, OPTIONS, who
 * calls (auth.c), 406, 413 by Content-Length, 415, and query parameters that the route does not
 * know or that come twice.
 * api_handle calls the handler; api_resume goes on with an execution that waited for its job. All
 * three may run on many threads at once: what is shared (store, jobs, the keys in flight) guards
 * itself.
 */
#include "api/routes.h"
#include "api/volumes.h"

#include "api/auth.h"
#include "api/changes.h"
#include "api/inflight.h"
#include "api/json_memory.h"
#include "api/remote.h"
#include "api/respond.h"
#include "api/transmit.h"
#include "store/job.h"
#include "tasks/tasks.h"

#include <assert.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>

#define MAX_BODY_DEFAULT ((size_t)256 << 20)
#define MAX_BODY_NONE ((size_t)64 << 10) /* of a route that takes no body: read and passed over */
#define TRIM_FROM ((size_t)1 << 20)      /* bytes of a body whose document is worth giving back */
#define SYNC_WAIT_DEFAULT 30.0
#define LINK_SECONDS_DEFAULT 30.0
/* Bytes that a small upload has: so many, and so many for each of its own, up to a limit at which
   it is read in half a second. A few KiB that unpack to hundreds of thousands of faces are no small
   upload, and show it in some milliseconds. */
#define SMALL_MEMORY_FROM ((size_t)1 << 20)
#define SMALL_MEMORY_GROWTH 32
#define SMALL_MEMORY_MAX ((size_t)32 << 20)

static const char *const json_types[] = {"application/json", NULL};
static const char *const member_types[] = {"application/json", "text/csv",
                                           "text/tab-separated-values", NULL};
static const char *const patch_types[] = {"application/json", "application/merge-patch+json", NULL};
/* curl --data-binary sends the last one. */
static const char *const import_types[] = {
    "application/zip,application/x-zip-compressed,application/x-tar,application/gzip",
    "application/x-gzip,application/x-compressed-tar,application/octet-stream",
    "multipart/form-data,application/x-www-form-urlencoded", NULL};
static const char *const result_types[] = {"application/octet-stream", NULL};
static const char *const surface_types[] = {"application/json", "application/x-npy",
                                            "application/octet-stream", NULL};

int api_create(struct api **out, const struct api_config *config)
{
    struct api *api = calloc(1, sizeof *api);
    char message[300];

    *out = NULL;
    if (!api) {
        return -1;
    }
    api->config = *config;
    if (!(api->config.link_seconds > 0)) {
        api->config.link_seconds = LINK_SECONDS_DEFAULT;
    }
    api->remote = remote_rules_read(config->link_prefixes ? config->link_prefixes : "",
                                    config->link_networks ? config->link_networks : "", message,
                                    sizeof message);
    if (api->config.max_body == 0) {
        api->config.max_body = MAX_BODY_DEFAULT;
    }
    if (!(api->config.sync_wait_seconds > 0)) {
        api->config.sync_wait_seconds = SYNC_WAIT_DEFAULT;
    }
    if (api->config.upload_memory == 0) {
        api->config.upload_memory = jobs_memory_of_uploads();
    }
    jobs_memory_begin(&api->uploads, api->config.upload_memory);
    api->inflight = inflight_create();
    api->auth = auth_create(config);
    api->changes = changes_create();
    (void)pthread_mutex_init(&api->probe.mutex, NULL);
    if (!api->inflight || !api->auth || !api->changes || !api->remote) {
        api_destroy(api);
        return -1;
    }
    *out = api;
    return 0;
}

void api_destroy(struct api *api)
{
    if (api) {
        inflight_destroy(api->inflight);
        changes_destroy(api->changes);
        remote_rules_free(api->remote);
        (void)pthread_mutex_destroy(&api->probe.mutex);
        auth_destroy(api->auth, api->config.store);
        free(api);
    }
}

/* Length of the media type in a Content-Type value, without its parameters. */
static size_t media_type_length(const char *value)
{
    return strcspn(value, "; \t");
}

static bool type_in(const char *value, const char *const *types)
{
    size_t length = media_type_length(value);
    char type[96];

    if (length >= sizeof type) {
        return false;
    }
    memcpy(type, value, length);
    type[length] = '\0';
    for (size_t i = 0; types[i]; i++) {
        if (list_has(types[i], type)) {
            return true;
        }
    }
    return false;
}

/* For a sentence. */
static const char *types_taken(const struct api_route *route)
{
    switch (route->body) {
    case ROUTE_SURFACE:
        return "application/json, or application/x-npy or application/octet-stream for .npy";
    case ROUTE_MEMBERS:
        return "application/json, text/csv or text/tab-separated-values";
    case ROUTE_IMPORT:
        return "application/zip, application/x-tar, application/gzip, application/octet-stream, or "
               "multipart/form-data";
    case ROUTE_MESH:
        return "the bytes of a mesh alone, no form, as application/octet-stream or model/ply, "
               "model/obj, model/off, model/stl, application/x-vtk, application/x-vtp, "
               "application/x-gifti+xml, model/gltf-binary, model/gltf+json, application/gzip";
    case ROUTE_VOLUME:
        return "the bytes of a volume alone, no form, as application/octet-stream, "
               "application/gzip, application/x-nifti or application/x-nrrd";
    case ROUTE_RESULT:
        return "application/octet-stream";
    default:
        return "application/json";
    }
}

/* 415 where the body's type is not one of the route's. Where JSON is taken alone the type must be
   said: a page in a browser can send a body without it to any address, but not with it. Elsewhere a
   body tells what it is. */
static bool refuse_body_type(struct api_call *call, const struct api_route *route)
{
    const char *type = api_request_header(call->request, "Content-Type");
    const char *encoding = api_request_header(call->request, "Content-Encoding");
    bool fits = true;

    if (route->body == ROUTE_NO_BODY) {
        return false;
    }
    if (encoding && !list_has(encoding, "identity")) {
        (void)problem_respond(call, "unsupported-media-type",
                              "Content-Encoding %s is not supported: send the bytes as they are.",
                              encoding);
        return true;
    }
    if (!type && route_takes_json(route)) {
        (void)problem_respond(call, "unsupported-media-type",
                              "A Content-Type is required here: application/json.");
        return true;
    }
    if (type && route_takes_json(route)) {
        fits = type_in(type, strcmp(route->method, "PATCH") == 0 ? patch_types : json_types);
    } else if (type && route->body == ROUTE_SURFACE) {
        fits = type_in(type, surface_types);
    } else if (type && route->body == ROUTE_MEMBERS) {
        fits = type_in(type, member_types);
    } else if (type && route->body == ROUTE_IMPORT) {
        fits = type_in(type, import_types);
    } else if (type && route->body == ROUTE_MESH) {
        fits = mesh_type_known(type, media_type_length(type));
    } else if (type && route->body == ROUTE_RESULT) {
        fits = type_in(type, result_types);
    } else if (type && route->body == ROUTE_VOLUME) {
        fits = volume_type_known(type, media_type_length(type));
    }
    if (!fits) {
        (void)problem_respond(call, "unsupported-media-type",
                              "Content-Type %.80s is not one that this resource takes: %s.", type,
                              types_taken(route));
    }
    return !fits;
}

/* What OpenAPI calls an array may be given several times; of the list of jobs (job_filters.c). */
#define REPEATED "type,processID,status"

/* 400 for a query parameter that the route does not know, or that is given twice. */
static bool refuse_query(struct api_call *call, const struct api_route *route)
{
    const char *cursor = call->request->query;
    struct query_pair pair, other;
    char name[32];

    while (query_next(&cursor, &pair)) {
        /* Some clients add one of a name like this, so that no cache answers. */
        if (pair.name[0] == '_') {
            continue;
        }
        bool known = percent_decode(pair.name, pair.name_length, false, name, sizeof name) &&
                     strlen(name) == pair.name_length && list_has_exactly(route->query, name);

        if (!known) {
            (void)problem_respond(call, "unknown-parameter",
                                  "The query parameter \"%.*s\" is not known here; known: %s.",
                                  (int)(pair.name_length < 60 ? pair.name_length : 60), pair.name,
                                  route->query[0] ? route->query : "none");
            return true;
        }
        for (const char *rest = cursor;
             !list_has_exactly(REPEATED, name) && query_next(&rest, &other);) {
            if (other.name_length == pair.name_length &&
                strncmp(other.name, pair.name, pair.name_length) == 0) {
                (void)problem_respond(call, "malformed-request",
                                      "The query parameter %s is given twice.", name);
                return true;
            }
        }
    }
    return false;
}

static bool refuse_size(struct api_call *call, int64_t content_length, size_t max_body)
{
    if (content_length <= 0 || (uint64_t)content_length <= max_body) {
        return false;
    }
    (void)problem_respond(call, "body-too-large",
                          "The body has %lld bytes; the limit here is %zu bytes.",
                          (long long)content_length, max_body);
    return true;
}

static void answer_no_route(struct api_call *call, const char *allow)
{
    if (!allow[0]) {
        (void)problem_respond(call, "not-found", "Nothing is at this path; GET / lists what is.");
    } else if (strcmp(call->request->method, "OPTIONS") == 0) {
        call->response->status = 204;
    } else {
        (void)problem_respond(call, "method-not-allowed",
                              "%.16s is not among the methods here: %s.", call->request->method,
                              allow);
    }
    if (allow[0]) {
        (void)api_response_header_text(call->response, "Allow", allow);
    }
}

/* What can never be kept within a quota need not be read. */
static size_t body_limit(const struct api *api, const struct api_request *request)
{
    int64_t bytes = request->caller.quotas[STORE_QUOTA_BYTES];

    return bytes > 0 && (uint64_t)bytes < api->config.max_body ? (size_t)bytes
                                                               : api->config.max_body;
}

/* Whether a slow route needs no request thread this time: small results that are in memory. Whose
   they are is asked of the database, where there are owners. */
static bool is_at_hand(struct api *api, const struct api_request *request,
                       const struct route_match *match)
{
    return match->route->handler == jobs_results && !request->caller.restricted &&
           request->query[0] == '\0' &&
           store_job_results_recent(api->config.store, match->parameters[0], NULL, NULL) ==
               STORE_OK;
}

enum api_verdict api_begin(struct api *api, struct api_request *request, int64_t content_length,
                           size_t *max_body, struct api_response *response)
{
    struct api_call call = {.api = api, .request = request, .response = response};
    struct route_match match;
    char allow[96];

    request->route = NULL;
    request->route_name = NULL;
    *max_body = MAX_BODY_NONE;
    route_find(request->method, request->path, &match, allow, sizeof allow);
    if (!match.route) {
        answer_no_route(&call, allow);
        return API_REFUSED;
    }
    request->route_name = match.route->pattern;
    request->probe = (match.route->flags & ROUTE_PROBE) != 0;
    request->bodiless = match.route->body == ROUTE_NO_BODY;
    request->follows = (match.route->flags & ROUTE_FOLLOWS) && remote_enabled(api->remote);
    if (!auth_admit(&call, request, match.route)) {
        return API_REFUSED;
    }
    if (match.route->body != ROUTE_NO_BODY) {
        *max_body = body_limit(api, request);
        if ((route_takes_json(match.route) || match.route->body == ROUTE_MEMBERS) &&
            *max_body > json_body_limit(match.route)) {
            *max_body = json_body_limit(match.route);
        }
        if (match.route->body == ROUTE_RESULT && *max_body > TASKS_RESULT_MAX) {
            *max_body = TASKS_RESULT_MAX;
        }
    }
    if (match.route->produces[0] && accept_best(request, match.route->produces) < 0) {
        (void)problem_respond(&call, "not-acceptable", "This resource is served as %s.",
                              match.route->produces[0]);
        return API_REFUSED;
    }
    if (refuse_query(&call, match.route) || refuse_body_type(&call, match.route) ||
        refuse_size(&call, content_length, *max_body)) {
        return API_REFUSED;
    }
    union {
        const struct api_route *constant;
        void *pointer;
    } route = {match.route};
    request->route = route.pointer;
    return match.route->flags & ROUTE_SLOW && !is_at_hand(api, request, &match) ? API_SLOW
                                                                                : API_QUICK;
}

/* An answer that was built while memory was short may lack members: it is 503 instead. */
static void refuse_incomplete(struct api_response *response)
{
    if (json_memory_failed() && response->status != 0) {
        api_response_clear(response);
        response_json(response, 503, "application/problem+json", NULL);
    }
}

static void run_handler(struct api_call *call, const struct api_route *route)
{
    json_memory_begin();
    route->handler(call);
    refuse_incomplete(call->response);
    json_memory_begin();
}

/* What memory that was refused makes of the answer. An answer that did without it stays. */
static void judge_upload(struct api_call *call, const struct jobs_memory *memory)
{
    struct api_response *response = call->response;

    if (!response->problem) {
        return;
    }
    if (atomic_load(&memory->stopped)) {
        api_response_clear(response);
        response->undone = API_STOPPED;
    } else if (atomic_load(&memory->refused) > 0 &&
               (call->request->small ||
                (atomic_load(&memory->beside) > 0 && !call->request->alone))) {
        api_response_clear(response);
        response->undone = API_AGAIN;
    } else if (atomic_load(&memory->refused) > 0) {
        api_response_clear(response);
        (void)problem_respond(call, "body-too-large",
                              "To read this body takes more memory than the %zu MiB that this "
                              "service has for it.",
                              call->api->config.upload_memory >> 20);
    }
}

static size_t small_memory(const struct api_request *request)
{
    size_t memory = SMALL_MEMORY_FROM + SMALL_MEMORY_GROWTH * request->body_size;

    return memory < SMALL_MEMORY_MAX ? memory : SMALL_MEMORY_MAX;
}

/* The handler with an account of its own, within that of all uploads unless it is to do with
   little. */
static void handle_upload(struct api_call *call, const struct api_route *route)
{
    bool small = call->request->small;
    struct jobs_memory memory = {.parent = small ? NULL : &call->api->uploads,
                                 .stop = call->request->stop};
    struct jobs_memory *before;

    jobs_memory_begin(&memory, small ? small_memory(call->request) : SIZE_MAX);
    before = jobs_memory_enter(&memory);
    run_handler(call, route);
    transmit(call);
    (void)jobs_memory_enter(before);
    assert(atomic_load(&memory.used) == 0);
    judge_upload(call, &memory);
}

void api_handle(struct api *api, const struct api_request *request, struct api_response *response)
{
    struct api_call call = {.api = api, .request = request, .response = response};
    const struct api_route *route = request->route;
    struct route_match match;

    for (size_t i = 0; i < ROUTE_PARAMETERS_MAX; i++) {
        match.parameters[i][0] = '\0';
    }
    if (!route_matches(route->pattern, request->path, match.parameters)) {
        (void)problem_respond(&call, "not-found", "Nothing is at this path.");
        return;
    }
    for (size_t i = 0; i < ROUTE_PARAMETERS_MAX; i++) {
        call.parameters[i] = match.parameters[i];
    }
    if ((route->flags & ROUTE_SLOW) && !auth_owns_path(&call, route)) {
        return;
    }
    if (api_is_upload(request)) {
        handle_upload(&call, route);
    } else {
        run_handler(&call, route);
        transmit(&call);
    }
    if (request->body_size > TRIM_FROM && route->body != ROUTE_NO_BODY) {
        (void)malloc_trim(
            0); /* of hundreds of thousands of small blocks nothing goes back by itself */
    }
    if (route->flags & ROUTE_SLOW) {
        auth_record(api, request);
    }
}

void api_resume(struct api *api, const struct api_request *request, struct api_response *response)
{
    struct api_call call = {.api = api, .request = request, .response = response};

    json_memory_begin();
    if (strcmp(response->wait.job_id, API_WAIT_TASKS) == 0) {
        leases_resume(api, request, response);
    } else {
        executions_resume(api, request, response);
    }
    refuse_incomplete(response);
    transmit(&call);
}
