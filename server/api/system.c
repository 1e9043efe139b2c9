/*
 * system.c - what the service says about itself: landing page, health, versions, API description.
 *
 * /healthz says that requests are answered at all and touches nothing else; whether the service can
 * take work is /readyz's to say (monitoring.c).
 */
#include "api/links.h"
#include "api/respond.h"
#include "api/routes.h"

#include "build.h"
#include "embedded.h"
#include "store/digest.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

#define ORIGIN_MAX 300 /* bytes of "https://host:port" */

/* What is at the base URL, after it. */
static const struct {
    const char *path, *rel, *type, *title;
} entries[] = {
    {"/v1/", "self", LINK_JSON, "This page"},
    {"/v1/openapi.json", "service-desc", "application/vnd.oai.openapi+json;version=3.0",
     "The API in OpenAPI 3.0"},
    {"/v1/openapi.yaml", "service-desc", "application/yaml", "The API in OpenAPI 3.1"},
    {"/v1/docs", "service-doc", "text/html", "The API as a page"},
    {"/v1/conformance", LINK_OGC "conformance", LINK_JSON, "What it conforms to"},
    {"/v1/processes", LINK_OGC "processes", LINK_JSON, "What can be computed"},
    {"/v1/jobs", LINK_OGC "job-list", LINK_JSON, "Computations"},
    {"/v1/meshes", "item", LINK_JSON, "Meshes"},
    {"/v1/volumes", "item", LINK_JSON, "Label volumes"},
    {"/v1/surfaces", "item", LINK_JSON, "Surfaces"},
    {"/v1/cohorts", "item", LINK_JSON, "Cohorts"},
    {"/v1/models", "item", LINK_JSON, "Models"},
    {"/v1/version", "version-info", LINK_JSON, "Versions"},
};

/* Links from here are absolute, since clients of the standard start here and take them as they are.
   Behind a proxy that ends TLS, it says so. */
static void origin_of(const struct api_call *call, char origin[ORIGIN_MAX])
{
    const char *host = api_request_header(call->request, "Host");
    const char *forwarded = api_request_header(call->request, "X-Forwarded-Proto");
    bool secure = call->request->secure || (forwarded && strcmp(forwarded, "https") == 0);

    origin[0] = '\0';
    if (host && host[0] && strlen(host) + 9 < ORIGIN_MAX) {
        (void)snprintf(origin, ORIGIN_MAX, "http%s://%s", secure ? "s" : "", host);
    }
}

/* At the root of the service a browser is shown the dashboard. */
void system_landing(struct api_call *call)
{
    static const char *const types[] = {"application/json", "text/html", NULL};
    char origin[ORIGIN_MAX], href[ORIGIN_MAX + 64];
    json_t *links;

    if (strcmp(call->request->path, "/") == 0) {
        if (accept_best(call->request, types) == 1) {
            ui_redirect(call);
            return;
        }
        (void)api_response_header_text(call->response, "Vary", "Accept");
    }
    links = json_array();
    origin_of(call, origin);
    for (size_t i = 0; i < sizeof entries / sizeof entries[0]; i++) {
        (void)snprintf(href, sizeof href, "%s%s", origin, entries[i].path);
        link_add(links, href, entries[i].rel, entries[i].type, entries[i].title);
    }
    respond_json(call, 200,
                 json_pack("{s:s, s:s, s:o}", "title",
                           "srnfd: elastic shape analysis of closed surfaces", "description",
                           "Square-root normal fields of triangle meshes, their inversion and "
                           "geodesics.",
                           "links", links));
}

void system_conformance(struct api_call *call)
{
    static const char *const classes[] = {
        "core", "ogc-process-description", "json", "oas30", "job-list", "dismiss"};
    json_t *list = json_array();
    char uri[96];

    for (size_t i = 0; i < sizeof classes / sizeof classes[0]; i++) {
        (void)snprintf(uri, sizeof uri,
                       "http://www.opengis.net/spec/ogcapi-processes-1/1.0/conf/%s", classes[i]);
        (void)json_array_append_new(list, json_string(uri));
    }
    respond_json(call, 200, json_pack("{s:o}", "conformsTo", list));
}

/* Who calls: what a page needs to know of a token before it offers what the token may not do. */
void system_caller(struct api_call *call)
{
    const struct api_caller *caller = &call->request->caller;
    json_t *document = json_pack("{s:b,s:s}", "tokens", caller->role != NULL, "role",
                                 caller->role ? caller->role : "admin");

    if (caller->role) {
        (void)json_object_set_new(document, "name", json_string(caller->name));
    }
    (void)api_response_header_text(call->response, "Cache-Control", "private, no-store");
    respond_json(call, 200, document);
}

void system_healthz(struct api_call *call)
{
    static const char well[] = "{\"status\":\"ok\"}\n";

    respond_static(call, 200, "application/json", well, sizeof well - 1);
}

void system_version(struct api_call *call)
{
    struct build_part parts[BUILD_PARTS];
    json_t *versions = json_object();
    char id[BUILD_ID_SIZE];

    build_parts(parts);
    build_numeric_id(id);
    for (size_t i = 0; i < BUILD_PARTS; i++) {
        (void)json_object_set_new(versions, parts[i].name, json_string(parts[i].version));
    }
    respond_json(call, 200,
                 json_pack("{s:s,s:s,s:i,s:o}", "version", SRNF_VERSION, "numericBuild", id,
                           "workers", (int)jobs_worker_count(call->api->config.jobs), "versions",
                           versions));
}

/* The API description in its three forms. The entity tags are hashes, found once. */
struct description {
    const char *path, *type;
    const struct embedded_file *file; /* path NULL: this build has none */
    char tag[33];
};
static struct description yaml = {.path = "api/openapi.yaml", .type = "application/yaml"};
static struct description json = {.path = "api/openapi.json",
                                  .type = "application/vnd.oai.openapi+json;version=3.0"};

static void find_description(struct description *description)
{
    const struct embedded_file *file = embedded_files;
    char tag[65];

    while (file->path && strcmp(file->path, description->path) != 0) {
        file++;
    }
    if (file->path) {
        store_sha256_hex(tag, file->bytes, file->size);
        memcpy(description->tag, tag, sizeof description->tag - 1);
    }
    description->file = file;
}

/* The page of the API has its style in it, and nothing else. */
static const char policy[] = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; "
                             "form-action 'none'; frame-ancestors 'none'";

static struct description page = {.path = "api/openapi.html", .type = "text/html; charset=utf-8"};

static void find_descriptions(void)
{
    find_description(&yaml);
    find_description(&json);
    find_description(&page);
}

static void respond_description(struct api_call *call, const struct description *description)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    (void)pthread_once(&once, find_descriptions);
    if (!description->file->path) {
        (void)problem_respond(call, "not-found", "This build carries no API description.");
        return;
    }
    if (respond_not_modified(call, description->tag)) {
        return;
    }
    if (description == &page) {
        (void)api_response_header_text(call->response, "Content-Security-Policy", policy);
    }
    respond_static(call, 200, description->type, description->file->bytes, description->file->size);
}

void system_openapi(struct api_call *call)
{
    respond_description(call, &yaml);
}

void system_openapi_json(struct api_call *call)
{
    respond_description(call, &json);
}

void system_docs(struct api_call *call)
{
    respond_description(call, &page);
}
