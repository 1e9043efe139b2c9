/*
 * routes.h - the table of routes and the search in it.
 */
#ifndef SRNFD_API_ROUTES_H
#define SRNFD_API_ROUTES_H

#include "api/handler.h"

#define ROUTE_PARAMETERS_MAX 4
#define ROUTE_PARAMETER_SIZE 128

/* What kind of body a route takes; decides the limit and the media types it accepts. */
enum route_body {
    ROUTE_NO_BODY,
    ROUTE_JSON,    /* application/json, up to ROUTE_JSON_MAX */
    ROUTE_INPUTS,  /* application/json with arrays of numbers, up to ROUTE_INPUTS_MAX */
    ROUTE_MESH,    /* a mesh in any of its formats */
    ROUTE_VOLUME,  /* a label volume */
    ROUTE_SURFACE, /* JSON or .npy */
    ROUTE_MEMBERS, /* JSON or a table as text, up to ROUTE_INPUTS_MAX */
    ROUTE_IMPORT,  /* an archive, or a form with files */
    ROUTE_RESULT,  /* bytes of a task's result */
};

/* What holds of a route, as bits. Without PUBLIC or MONITORS a token is needed, where there are
   any. */
enum route_flag {
    ROUTE_SLOW = 1,      /* needs a request thread: computes, or reads much */
    ROUTE_PUBLIC = 2,    /* for anyone */
    ROUTE_MONITORS = 4,  /* for admins, and tokens for metrics alone */
    ROUTE_LONG = 32,     /* without a body takes as long as an upload, and is handled as one */
    ROUTE_PROBE = 8,     /* asked by monitors every few seconds */
    ROUTE_READS = 64,    /* changes nothing that anyone has, whatever its method */
    ROUTE_TICKETS = 128, /* takes a ticket in the place of a token (tickets.h) */
    ROUTE_WORKERS = 512, /* for workers, and admins */
    ROUTE_ADMINS = 1024, /* for admins alone */
    ROUTE_PARSES = 16,   /* with ?format=, parses a stored mesh, as an upload does */
    ROUTE_FOLLOWS = 256, /* its body may have links to other servers (remote.h) */
};

#define ROUTE_JSON_MAX ((size_t)8 << 20)
#define ROUTE_INPUTS_MAX ((size_t)32 << 20)
/* What a document may take in memory, in lengths of the longest text: an array of numbers of full
   precision takes four. */
#define JSON_GROWTH_MAX ((size_t)4)
/* The same for a text that is no upload (api_is_upload), in bytes: of 64 KiB no document takes
   more. */
#define JSON_SMALL_MAX ((size_t)8 << 20)

struct api_route {
    const char *method;  /* "GET" answers HEAD too */
    const char *pattern; /* "/v1/meshes/{id}": a brace stands for one segment */
    api_handler *handler;
    unsigned flags; /* enum route_flag */
    enum route_body body;
    const char *query; /* parameters that it knows, separated by commas */
    const char
        *produces[5]; /* media types, the default first; empty: whatever Accept says is ignored */
};
extern const struct api_route api_routes[]; /* ended by method NULL */

/* The path parameters of one request, as matched. */
struct route_match {
    const struct api_route *route;
    char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE];
};

/* Of bodies (body.c): whether the route takes JSON and nothing else, and bytes that it may have. */
bool route_takes_json(const struct api_route *route);
size_t json_body_limit(const struct api_route *route);

/* Whether the pattern fits the path; then parameters holds its segments in order. */
bool route_matches(const char *pattern, const char *path,
                   char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE]);

/* Finds the route for method and path. Where there is none, route is NULL and allow lists the
   methods that the path has, as the Allow header wants them, or is empty where nothing is at the
   path. */
void route_find(const char *method, const char *path, struct route_match *match, char *allow,
                size_t allow_size);

api_handler surfaces_create, surfaces_list, surfaces_get, surfaces_coefficients, surfaces_srnf,
    surfaces_grid, surfaces_mesh;
api_handler meshes_create, meshes_list, meshes_get, meshes_content;
api_handler imports_create, cohorts_export, models_export;
api_handler cohorts_patch, cohorts_members, cohorts_put_members;
api_handler volumes_create, volumes_list, volumes_get, volumes_content;
api_handler cohorts_create, cohorts_list, cohorts_get, cohorts_delete;
api_handler records_delete, records_patch;
api_handler models_list, models_get, models_modes, models_scores, models_shape;
api_handler jobs_list, jobs_get_one, jobs_results, jobs_output, jobs_cancel_one, jobs_delete,
    jobs_events, jobs_events_all;
api_handler tickets_create_one;
api_handler processes_list, processes_get, executions_create, executions_estimate;
api_handler system_landing, system_conformance, system_openapi_json, system_docs, system_healthz,
    system_readyz, system_version, system_openapi, system_metrics, system_caller, users_list;
api_handler leases_create, leases_content, leases_extend, leases_result, leases_failure,
    leases_delete, workers_list, workers_lift;
api_handler ui_redirect, ui_index, ui_file, ui_example;

/* Goes on with a waiting execution: answers, or leaves response->wait set to wait on. */
void executions_resume(struct api *api, const struct api_request *request,
                       struct api_response *response);
/* The same of a request for a lease. */
void leases_resume(struct api *api, const struct api_request *request,
                   struct api_response *response);

#endif
