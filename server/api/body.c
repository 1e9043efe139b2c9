/*
 * body.c - bodies of requests: what kind a route takes, how long it may be, and JSON.
 */
#include "api/json_memory.h"
#include "api/respond.h"
#include "api/routes.h"

#include <string.h>

#define SMALL_BODY ((size_t)1 << 20) /* bytes of an upload that may be small */
/* Bytes of a JSON body that takes more than a few milliseconds. */
#define JSON_UPLOAD_FROM ((size_t)64 << 10)

bool route_takes_json(const struct api_route *route)
{
    return route->body == ROUTE_JSON || route->body == ROUTE_INPUTS;
}

size_t json_body_limit(const struct api_route *route)
{
    return route->body == ROUTE_JSON ? ROUTE_JSON_MAX : ROUTE_INPUTS_MAX;
}

/* Whether the query asks for a format. */
static bool has_format(const struct api_request *request)
{
    const char *cursor = request->query;
    struct query_pair pair;
    bool found = false;

    while (!found && query_next(&cursor, &pair)) {
        found = pair.name_length == strlen("format") &&
                strncmp(pair.name, "format", pair.name_length) == 0;
    }
    return found;
}

/* It has the name that such a member has, or letters written as escapes. */
bool api_fetches(const struct api_request *request)
{
    return request->follows && request->body_size > 0 &&
           (memmem(request->body, request->body_size, "\"href\"", 6) ||
            memmem(request->body, request->body_size, "\\u", 2));
}

bool api_is_upload(const struct api_request *request)
{
    const struct api_route *route = request->route;

    if (api_fetches(request)) {
        return true;
    }
    if (route &&
        ((route->flags & ROUTE_LONG) || ((route->flags & ROUTE_PARSES) && has_format(request)))) {
        return true;
    }
    return route && request->body_size > 0 &&
           (route->body == ROUTE_MESH || route->body == ROUTE_VOLUME ||
            route->body == ROUTE_SURFACE || route->body == ROUTE_IMPORT ||
            ((route_takes_json(route) || route->body == ROUTE_MEMBERS) &&
             request->body_size > JSON_UPLOAD_FROM));
}

bool api_is_small(const struct api_request *request)
{
    const struct api_route *route = request->route;

    return request->body_size <= SMALL_BODY && !(route && route->flags & ROUTE_LONG) &&
           !api_fetches(request);
}

json_t *body_json(struct api_call *call)
{
    const struct api_request *request = call->request;
    size_t limit = json_body_limit(request->route);
    size_t budget = api_is_upload(request) ? JSON_GROWTH_MAX * limit : JSON_SMALL_MAX;
    json_error_t error;
    json_t *document;
    bool over;

    if (request->body_size == 0) {
        (void)problem_respond(call, "malformed-json",
                              "The body is empty where a JSON object is expected.");
        return NULL;
    }
    if (request->body_size > limit) {
        (void)problem_respond(call, "body-too-large",
                              "The body has %zu bytes; JSON may have %zu bytes here.",
                              request->body_size, limit);
        return NULL;
    }
    document =
        json_memory_load((const char *)request->body, request->body_size, budget, &over, &error);
    if (over) {
        (void)problem_respond(call, "body-too-large",
                              "The body holds too many values: as a document it would take more "
                              "than %zu MiB.",
                              budget >> 20);
        return NULL;
    }
    if (!document && json_memory_failed()) {
        (void)problem_respond(call, "out-of-memory", "The body does not fit into memory now.");
        return NULL;
    }
    if (!document) {
        (void)problem_respond(call, "malformed-json", "At line %d, column %d: %s.", error.line,
                              error.column,
                              json_error_code(&error) == json_error_null_character
                                  ? "a string must not have a zero character"
                                  : error.text);
        return NULL;
    }
    if (!json_is_object(document)) {
        (void)problem_respond(call, "malformed-json", "The body must be a JSON object.");
        json_decref(document);
        return NULL;
    }
    return document;
}
