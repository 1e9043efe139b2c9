/*
 * routes.c - every route of the service in one table, and the search in it. api/openapi.yaml
 * describes the same routes; tests/api/test_openapi.sh holds both against each other.
 *
 * A path is compared segment by segment; the table is short enough to be walked from its start.
 */
#include "api/routes.h"

#include <stdio.h>
#include <string.h>

#define JSON "application/json"
#define NPY "application/x-npy"
#define CSV "text/csv"
#define EVENTS "text/event-stream"

const struct api_route api_routes[] = {
    {"GET", "/", system_landing, false, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/healthz", system_healthz, false, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/readyz", system_readyz, true, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/metrics", system_metrics, true, ROUTE_NO_BODY, "", {0}},
    {"GET", "/v1/version", system_version, false, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/openapi.yaml", system_openapi, false, ROUTE_NO_BODY, "", {0}},

    {"POST", "/v1/meshes", meshes_create, true, ROUTE_MESH, "format,name", {JSON}},
    {"GET", "/v1/meshes", meshes_list, true, ROUTE_NO_BODY, "limit,cursor", {JSON}},
    {"GET", "/v1/meshes/{id}", meshes_get, true, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/meshes/{id}/content", meshes_content, true, ROUTE_NO_BODY, "", {0}},

    {"POST", "/v1/surfaces", surfaces_create, true, ROUTE_SURFACE, "name,lmax,kind,scale", {JSON}},
    {"GET", "/v1/surfaces", surfaces_list, true, ROUTE_NO_BODY, "limit,cursor", {JSON}},
    {"GET", "/v1/surfaces/{id}", surfaces_get, true, ROUTE_NO_BODY, "", {JSON}},
    {"GET",
     "/v1/surfaces/{id}/coefficients",
     surfaces_coefficients,
     true,
     ROUTE_NO_BODY,
     "format",
     {JSON, NPY}},
    {"GET",
     "/v1/surfaces/{id}/srnf",
     surfaces_srnf,
     true,
     ROUTE_NO_BODY,
     "format,kind,nTheta,nPhi",
     {JSON, NPY}},
    {"GET",
     "/v1/surfaces/{id}/grid",
     surfaces_grid,
     true,
     ROUTE_NO_BODY,
     "format,kind,nTheta,nPhi",
     {JSON, NPY}},
    {"GET", "/v1/surfaces/{id}/mesh", surfaces_mesh, true, ROUTE_NO_BODY, "format,resolution", {0}},

    {"POST", "/v1/cohorts", cohorts_create, true, ROUTE_JSON, "", {JSON}},
    {"GET", "/v1/cohorts", cohorts_list, true, ROUTE_NO_BODY, "limit,cursor,owner", {JSON}},
    {"GET", "/v1/cohorts/{name}", cohorts_get, true, ROUTE_NO_BODY, "owner", {JSON}},
    {"DELETE", "/v1/cohorts/{name}", cohorts_delete, true, ROUTE_NO_BODY, "owner", {0}},

    {"GET", "/v1/models", models_list, true, ROUTE_NO_BODY, "limit,cursor", {JSON}},
    {"GET", "/v1/models/{id}", models_get, true, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/models/{id}/modes", models_modes, true, ROUTE_NO_BODY, "format", {JSON, CSV, NPY}},
    {"GET",
     "/v1/models/{id}/scores",
     models_scores,
     true,
     ROUTE_NO_BODY,
     "format",
     {JSON, CSV, NPY}},

    {"GET", "/v1/processes", processes_list, false, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/processes/{id}", processes_get, false, ROUTE_NO_BODY, "", {JSON}},
    {"POST", "/v1/processes/{id}/execution", executions_create, true, ROUTE_INPUTS, "", {JSON}},

    {"GET", "/v1/jobs", jobs_list, true, ROUTE_NO_BODY, "limit,cursor,process,status", {JSON}},
    {"GET", "/v1/jobs/{id}", jobs_get_one, true, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/jobs/{id}/results", jobs_results, true, ROUTE_NO_BODY, "format", {JSON, CSV, NPY}},
    {"GET", "/v1/jobs/{id}/events", jobs_events, true, ROUTE_NO_BODY, "", {EVENTS}},
    {"POST", "/v1/jobs/{id}/cancel", jobs_cancel_one, true, ROUTE_NO_BODY, "", {JSON}},
    {"DELETE", "/v1/jobs/{id}", jobs_delete, true, ROUTE_NO_BODY, "", {0}},
    {NULL, NULL, NULL, false, ROUTE_NO_BODY, NULL, {0}},
};

size_t json_body_limit(const struct api_route *route)
{
    return route->body == ROUTE_JSON ? ROUTE_JSON_MAX : ROUTE_INPUTS_MAX;
}

bool route_matches(const char *pattern, const char *path,
                   char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE])
{
    size_t n = 0;

    while (*pattern && *path) {
        if (*pattern != '{') {
            if (*pattern++ != *path++) {
                return false;
            }
            continue;
        }
        size_t length = strcspn(path, "/");
        if (length == 0 || length >= ROUTE_PARAMETER_SIZE || n == ROUTE_PARAMETERS_MAX) {
            return false;
        }
        memcpy(parameters[n], path, length);
        parameters[n++][length] = '\0';
        path += length;
        pattern += strcspn(pattern, "}") + 1;
    }
    return *pattern == '\0' && *path == '\0';
}

static void add_method(char *allow, size_t allow_size, const char *method)
{
    size_t used = strlen(allow);

    (void)snprintf(allow + used, allow_size - used, "%s%s", used ? ", " : "", method);
}

/* The methods that a path has, for a request that none of them fits. */
static void list_methods(const char *path, char *allow, size_t allow_size)
{
    char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE];

    for (const struct api_route *route = api_routes; route->method; route++) {
        if (!route_matches(route->pattern, path, parameters)) {
            continue;
        }
        add_method(allow, allow_size, route->method);
        if (strcmp(route->method, "GET") == 0) {
            add_method(allow, allow_size, "HEAD");
        }
    }
    if (allow[0]) {
        add_method(allow, allow_size, "OPTIONS");
    }
}

void route_find(const char *method, const char *path, struct route_match *match, char *allow,
                size_t allow_size)
{
    const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;

    allow[0] = '\0';
    for (const struct api_route *route = api_routes; route->method; route++) {
        if (strcmp(route->method, wanted) == 0 &&
            route_matches(route->pattern, path, match->parameters)) {
            match->route = route;
            return;
        }
    }
    match->route = NULL;
    list_methods(path, allow, allow_size);
}
