/*
 * system.c - what the service says about itself: landing page, health, versions, API description.
 *
 * /healthz says that requests are answered at all and touches nothing else; whether the service can
 * take work is /readyz's to say (monitoring.c).
 */
#include "api/respond.h"
#include "api/routes.h"

#include "build.h"
#include "embedded.h"
#include "store/digest.h"

#include <pthread.h>
#include <string.h>

void system_landing(struct api_call *call)
{
    respond_json(call, 200,
                 json_pack("{s:s,s:s,s:{s:s,s:s,s:s,s:s,s:s,s:s,s:s,s:s}}", "title",
                           "srnfd: elastic shape analysis of closed surfaces", "description",
                           "Square-root normal fields of triangle meshes, their inversion and "
                           "geodesics. The API is described by links.description.",
                           "links", "self", "/", "description", "/v1/openapi.yaml", "version",
                           "/v1/version", "processes", "/v1/processes", "meshes", "/v1/meshes",
                           "volumes", "/v1/volumes", "surfaces", "/v1/surfaces", "jobs",
                           "/v1/jobs"));
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

/* The API description and its entity tag, which is a hash over all of it: found once. */
static struct {
    const struct embedded_file *file; /* path NULL: this build has none */
    char tag[65];
} description;

static void find_description(void)
{
    const struct embedded_file *file = embedded_files;

    while (file->path && strcmp(file->path, "api/openapi.yaml") != 0) {
        file++;
    }
    if (file->path) {
        store_sha256_hex(description.tag, file->bytes, file->size);
        description.tag[32] = '\0';
    }
    description.file = file;
}

void system_openapi(struct api_call *call)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    (void)pthread_once(&once, find_description);
    if (!description.file->path) {
        (void)problem_respond(call, "not-found", "This build carries no API description.");
        return;
    }
    if (respond_not_modified(call, description.tag)) {
        return;
    }
    respond_static(call, 200, "application/yaml", description.file->bytes, description.file->size);
}
