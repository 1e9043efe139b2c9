/*
 * routes.c - every route of the service in one table, and the search in it. api/openapi.yaml
 * describes the same routes; tests/api/test_openapi.sh holds both against each other.
 *
 * A path is compared segment by segment, from the table's start on, with the routes of its method
 * whose first letter is its own: all of them took a sixth of the instructions of a small result.
 */
#include "api/routes.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

#define JSON "application/json"
#define HTML "text/html"
#define NPY "application/x-npy"
#define CSV "text/csv"
#define ZIP "application/zip"
#define EVENTS "text/event-stream"
#define BASE "/v1" /* clients of the standard ask for it with a slash, too */
#define PAGES "limit,cursor,sort,name,since,until"
#define MADE PAGES ",tag,process,cohort,mesh"
#define QUICK 0
#define SLOW ROUTE_SLOW
#define PUBLIC ROUTE_PUBLIC
#define MONITORS ROUTE_MONITORS
#define PROBE ROUTE_PROBE
#define WORKERS ROUTE_WORKERS

const struct api_route api_routes[] = {
    {"GET", "/", system_landing, PUBLIC, ROUTE_NO_BODY, "", {JSON, HTML}},
    {"GET", "/ui", ui_redirect, PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/ui/", ui_index, SLOW | PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/ui/{file}", ui_file, SLOW | PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/ui/example/{file}", ui_example, SLOW | PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/healthz", system_healthz, PUBLIC | PROBE, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/readyz", system_readyz, SLOW | PUBLIC | PROBE, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/metrics", system_metrics, SLOW | MONITORS | PROBE, ROUTE_NO_BODY, "", {0}},
    {"GET", "/v1/version", system_version, PUBLIC, ROUTE_NO_BODY, "", {JSON}},
    {"GET", BASE, system_landing, PUBLIC, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/conformance", system_conformance, PUBLIC, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/caller", system_caller, QUICK, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/users", users_list, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"GET", "/v1/openapi.yaml", system_openapi, PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/v1/openapi.json", system_openapi_json, PUBLIC, ROUTE_NO_BODY, "", {0}},
    {"GET", "/v1/docs", system_docs, PUBLIC, ROUTE_NO_BODY, "", {0}},

    {"POST", "/v1/meshes", meshes_create, SLOW, ROUTE_MESH, "format,name", {JSON}},
    {"GET", "/v1/meshes", meshes_list, SLOW, ROUTE_NO_BODY, MADE, {JSON}},
    {"GET", "/v1/meshes/{id}", meshes_get, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"PATCH", "/v1/meshes/{id}", records_patch, SLOW, ROUTE_JSON, "owner", {JSON}},
    {"DELETE", "/v1/meshes/{id}", records_delete, SLOW, ROUTE_NO_BODY, "cascade,owner", {0}},
    {"GET",
     "/v1/meshes/{id}/content",
     meshes_content,
     SLOW | ROUTE_PARSES,
     ROUTE_NO_BODY,
     "format",
     {0}},

    {"POST", "/v1/volumes", volumes_create, SLOW, ROUTE_VOLUME, "name", {JSON}},
    {"GET", "/v1/volumes", volumes_list, SLOW, ROUTE_NO_BODY, PAGES ",tag", {JSON}},
    {"GET", "/v1/volumes/{id}", volumes_get, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"PATCH", "/v1/volumes/{id}", records_patch, SLOW, ROUTE_JSON, "owner", {JSON}},
    {"DELETE", "/v1/volumes/{id}", records_delete, SLOW, ROUTE_NO_BODY, "cascade,owner", {0}},
    {"GET", "/v1/volumes/{id}/content", volumes_content, SLOW, ROUTE_NO_BODY, "", {0}},

    {"POST",
     "/v1/surfaces",
     surfaces_create,
     SLOW,
     ROUTE_SURFACE,
     "name,lmax,kind,scale,orientation",
     {JSON}},
    {"GET", "/v1/surfaces", surfaces_list, SLOW, ROUTE_NO_BODY, MADE, {JSON}},
    {"GET", "/v1/surfaces/{id}", surfaces_get, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"PATCH", "/v1/surfaces/{id}", records_patch, SLOW, ROUTE_JSON, "owner", {JSON}},
    {"DELETE", "/v1/surfaces/{id}", records_delete, SLOW, ROUTE_NO_BODY, "cascade,owner", {0}},
    {"GET",
     "/v1/surfaces/{id}/coefficients",
     surfaces_coefficients,
     SLOW,
     ROUTE_NO_BODY,
     "format",
     {JSON, NPY}},
    {"GET",
     "/v1/surfaces/{id}/srnf",
     surfaces_srnf,
     SLOW,
     ROUTE_NO_BODY,
     "format,kind,nTheta,nPhi",
     {JSON, NPY}},
    {"GET",
     "/v1/surfaces/{id}/grid",
     surfaces_grid,
     SLOW,
     ROUTE_NO_BODY,
     "format,kind,nTheta,nPhi",
     {JSON, NPY}},
    {"GET",
     "/v1/surfaces/{id}/mesh",
     surfaces_mesh,
     SLOW,
     ROUTE_NO_BODY,
     "format,resolution,space",
     {0}},

    {"POST", "/v1/imports", imports_create, SLOW, ROUTE_IMPORT, "cohort,partial", {JSON}},

    {"POST", "/v1/cohorts", cohorts_create, SLOW, ROUTE_INPUTS, "", {JSON}},
    {"GET", "/v1/cohorts", cohorts_list, SLOW, ROUTE_NO_BODY, PAGES ",mesh,owner", {JSON}},
    {"GET", "/v1/cohorts/{name}", cohorts_get, SLOW, ROUTE_NO_BODY, "owner", {JSON}},
    {"PATCH", "/v1/cohorts/{name}", cohorts_patch, SLOW, ROUTE_JSON, "owner", {JSON}},
    {"GET",
     "/v1/cohorts/{name}/members",
     cohorts_members,
     SLOW,
     ROUTE_NO_BODY,
     "owner,limit,cursor,label,subject,side,format",
     {JSON, CSV}},
    {"PUT",
     "/v1/cohorts/{name}/members",
     cohorts_put_members,
     SLOW,
     ROUTE_MEMBERS,
     "owner",
     {JSON}},
    {"DELETE", "/v1/cohorts/{name}", cohorts_delete, SLOW, ROUTE_NO_BODY, "owner", {0}},

    {"GET",
     "/v1/cohorts/{name}/export",
     cohorts_export,
     SLOW | ROUTE_LONG,
     ROUTE_NO_BODY,
     "owner",
     {ZIP}},

    {"GET", "/v1/models/{id}/export", models_export, SLOW | ROUTE_LONG, ROUTE_NO_BODY, "", {ZIP}},
    {"GET", "/v1/models", models_list, SLOW, ROUTE_NO_BODY, MADE, {JSON}},
    {"GET", "/v1/models/{id}", models_get, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"PATCH", "/v1/models/{id}", records_patch, SLOW, ROUTE_JSON, "owner", {JSON}},
    {"DELETE", "/v1/models/{id}", records_delete, SLOW, ROUTE_NO_BODY, "cascade,owner", {0}},
    {"GET",
     "/v1/models/{id}/modes",
     models_modes,
     SLOW,
     ROUTE_NO_BODY,
     "format,part",
     {JSON, CSV, NPY}},
    {"GET",
     "/v1/models/{id}/scores",
     models_scores,
     SLOW,
     ROUTE_NO_BODY,
     "format",
     {JSON, CSV, NPY}},
    {"GET",
     "/v1/models/{id}/shape",
     models_shape,
     SLOW | ROUTE_LONG,
     ROUTE_NO_BODY,
     "coefficients,format,part,resolution",
     {0}},

    {"GET", "/v1/processes", processes_list, QUICK, ROUTE_NO_BODY, "limit,cursor", {JSON}},
    {"GET", "/v1/processes/{id}", processes_get, QUICK, ROUTE_NO_BODY, "", {JSON}},
    {"POST",
     "/v1/processes/{id}/execution",
     executions_create,
     SLOW | ROUTE_FOLLOWS,
     ROUTE_INPUTS,
     "",
     {JSON}},
    {"POST",
     "/v1/processes/{id}/estimate",
     executions_estimate,
     SLOW | ROUTE_READS,
     ROUTE_INPUTS,
     "",
     {JSON}},

    {"GET",
     "/v1/jobs",
     jobs_list,
     SLOW,
     ROUTE_NO_BODY,
     MADE ",type,processID,status,datetime,minDuration,maxDuration",
     {JSON}},
    {"GET", "/v1/jobs/{id}", jobs_get_one, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"GET",
     "/v1/jobs/{id}/results",
     jobs_results,
     SLOW,
     ROUTE_NO_BODY,
     "format,condensed,response,outputs",
     {JSON, CSV, NPY}},
    {"GET", "/v1/jobs/{id}/results/{output}", jobs_output, SLOW, ROUTE_NO_BODY, "", {JSON, HTML}},
    {"GET",
     "/v1/jobs/{id}/events",
     jobs_events,
     SLOW | ROUTE_TICKETS,
     ROUTE_NO_BODY,
     "ticket",
     {EVENTS}},
    {"GET",
     "/v1/events",
     jobs_events_all,
     SLOW | ROUTE_TICKETS,
     ROUTE_NO_BODY,
     "ticket,after",
     {EVENTS}},
    {"POST", "/v1/tickets", tickets_create_one, QUICK | ROUTE_READS, ROUTE_NO_BODY, "", {JSON}},
    {"POST", "/v1/jobs/{id}/cancel", jobs_cancel_one, SLOW, ROUTE_NO_BODY, "", {JSON}},
    {"PATCH", "/v1/jobs/{id}", records_patch, SLOW, ROUTE_JSON, "", {JSON}},
    {"DELETE", "/v1/jobs/{id}", jobs_delete, SLOW, ROUTE_NO_BODY, "", {0}},

    {"POST", "/v1/leases", leases_create, SLOW | WORKERS, ROUTE_JSON, "", {JSON}},
    {"GET",
     "/v1/leases/{task}/contents/{digest}",
     leases_content,
     SLOW | WORKERS,
     ROUTE_NO_BODY,
     "",
     {0}},
    {"POST",
     "/v1/leases/{task}/heartbeat",
     leases_extend,
     SLOW | WORKERS,
     ROUTE_NO_BODY,
     "",
     {JSON}},
    {"PUT", "/v1/leases/{task}/result", leases_result, SLOW | WORKERS, ROUTE_RESULT, "", {0}},
    {"POST", "/v1/leases/{task}/failure", leases_failure, SLOW | WORKERS, ROUTE_JSON, "", {0}},
    {"DELETE", "/v1/leases/{task}", leases_delete, SLOW | WORKERS, ROUTE_NO_BODY, "", {0}},
    {"GET", "/v1/workers", workers_list, QUICK | ROUTE_ADMINS, ROUTE_NO_BODY, "", {JSON}},
    {"DELETE",
     "/v1/workers/bars/{bar}",
     workers_lift,
     QUICK | ROUTE_ADMINS,
     ROUTE_NO_BODY,
     "",
     {0}},
    {NULL, NULL, NULL, QUICK, ROUTE_NO_BODY, NULL, {0}},
};

bool route_matches(const char *pattern, const char *path,
                   char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE])
{
    const char *whole = pattern;
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
    return *pattern == '\0' &&
           (*path == '\0' || (strcmp(path, "/") == 0 && strcmp(whole, BASE) == 0));
}

/* The letter behind the version, in which most routes differ, or else that of the first segment. */
static char initial(const char *path)
{
    size_t version = sizeof BASE - 1;

    if (strncmp(path, BASE "/", version + 1) == 0 && path[version + 1]) {
        return path[version + 1];
    }
    return path[0] ? path[1] : '\0';
}

static char initials[sizeof api_routes / sizeof api_routes[0]];
static pthread_once_t initials_once = PTHREAD_ONCE_INIT;

static void take_initials(void)
{
    for (size_t i = 0; api_routes[i].method; i++) {
        initials[i] = initial(api_routes[i].pattern);
    }
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
    char first = initial(path);

    (void)pthread_once(&initials_once, take_initials);
    allow[0] = '\0';
    for (size_t i = 0; api_routes[i].method; i++) {
        const struct api_route *route = &api_routes[i];

        if ((initials[i] == first || initials[i] == '{') && strcmp(route->method, wanted) == 0 &&
            route_matches(route->pattern, path, match->parameters)) {
            match->route = route;
            return;
        }
    }
    match->route = NULL;
    list_methods(path, allow, allow_size);
}
