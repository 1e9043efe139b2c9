/*
 * meshes.c - the mesh resource: GET answers records, lists and the original bytes. POST is
 * meshes_create.c's.
 *
 * An id is a content address of format and bytes, so that the same file sent twice is one resource.
 */
#include "api/meshes.h"
#include "api/labels.h"
#include "api/lists.h"
#include "api/mesh_export.h"
#include "api/respond.h"
#include "api/routes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compute/compute.h"
#include "store/mesh.h"

/* What made it; null for an upload. */
static json_t *mesh_source(const struct store_mesh *mesh)
{
    json_t *source = mesh->source ? json_loads(mesh->source, 0, NULL) : NULL;

    return source ? source : json_null();
}

bool mesh_mirrored(const struct store_mesh *mesh)
{
    json_t *source = mesh_source(mesh);
    bool mirrored = json_is_true(json_object_get(source, "mirrored"));

    json_decref(source);
    return mirrored;
}

json_t *mesh_record(const struct store_mesh *mesh)
{
    json_t *report = mesh_report_load(mesh);
    json_t *document = json_object(), *links = json_object();
    char path[128];

    (void)snprintf(path, sizeof path, "/v1/meshes/%s", mesh->id);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/meshes/%s/content", mesh->id);
    (void)json_object_set_new(links, "content", json_string(path));
    (void)json_object_set_new(document, "id", json_string(mesh->id));
    (void)json_object_set_new(document, "name", json_string(mesh->name ? mesh->name : ""));
    labels_set_tags(document, mesh->tags);
    (void)json_object_set_new(document, "format", json_string(mesh->format));
    (void)json_object_set_new(document, "bytes", json_integer(mesh->bytes));
    (void)json_object_set_new(document, "vertices", json_integer(mesh->vertices));
    (void)json_object_set_new(document, "faces", json_integer(mesh->faces));
    (void)json_object_set_new(document, "created", json_time(mesh->created_ms));
    (void)json_object_set_new(document, "report", report ? report : json_null());
    (void)json_object_set_new(document, "source", mesh_source(mesh));
    (void)json_object_set_new(document, "mirrored", json_boolean(mesh_mirrored(mesh)));
    (void)json_object_set_new(document, "links", links);
    return document;
}

/* ---- GET ------------------------------------------------------------------------------------- */

static bool find_mesh(struct api_call *call, struct store_mesh *mesh)
{
    const char *owner = call->request->caller.name;
    int status = store_mesh_get_as(call->api->config.store, owner, call->parameters[0], mesh);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-mesh", call->parameters[0]);
    }
    return status == 0;
}

void meshes_get(struct api_call *call)
{
    struct store_mesh mesh = {0};
    char etag[LABELS_ETAG_MAX];

    if (find_mesh(call, &mesh)) {
        labels_etag(etag, mesh.id, mesh.name, mesh.tags);
        if (!respond_not_modified(call, etag)) {
            respond_json(call, 200, mesh_record(&mesh));
        }
        store_mesh_clear(&mesh);
    }
}

/* The prepared mesh in another format. */
static void respond_converted(struct api_call *call, const struct store_mesh *row,
                              const unsigned char *content, size_t size,
                              const struct mesh_export *choice)
{
    const struct srnf_mesh_description description = {
        .name = row->id,
        .space = "original",
        .comment = "the uploaded mesh after the lossless repairs of its report, in its own units"};
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_mesh_report report;
    struct srnf_error error = {.element = -1};
    struct srnf_mesh mesh = {0};
    int status;

    limits.context = &upload_context;
    status = srnf_mesh_read(content, size, srnf_mesh_format_from_name(row->format), &limits, &mesh,
                            NULL, &error);
    if (status == 0) {
        status = srnf_mesh_prepare_within(&mesh, true, &upload_context, &report);
    }
    if (status == 0 && mesh.n_faces == 0) {
        status = SRNF_EDEGENERATE;
    }
    if (status == 0) {
        mesh_export_respond(call, choice, row->id, &mesh, NULL, NULL, 0, &description);
    } else {
        (void)problem_respond(call, compute_problem_code(status), "%s.",
                              error.message[0] ? error.message : srnf_strerror(status));
    }
    srnf_mesh_clear(&mesh);
}

static bool asks_for_format(struct api_call *call)
{
    bool refused = false;
    char text[16];

    return query_get(call, "format", text, sizeof text, &refused) || refused;
}

void meshes_content(struct api_call *call)
{
    bool packed, converted = asks_for_format(call);
    struct mesh_export choice = {.format = ""};
    struct store_mesh mesh = {0};
    unsigned char *content = NULL;
    size_t size = 0;
    char tag[STORE_ID_MAX + 16];
    int status;

    if ((converted && !mesh_export_choose(call, &choice)) || !find_mesh(call, &mesh)) {
        return;
    }
    (void)snprintf(tag, sizeof tag, "%s.content%s%s", mesh.id, converted ? "." : "", choice.format);
    if (converted ? respond_not_modified(call, tag) : respond_not_modified_ever(call, tag)) {
        goto out;
    }
    status = store_mesh_content(call->api->config.store, mesh.id, &content, &size);
    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-mesh", mesh.id);
        goto out;
    }
    if (converted) {
        respond_converted(call, &mesh, content, size, &choice);
        free(content);
        goto out;
    }
    packed = size > 2 && content[0] == 0x1f && content[1] == 0x8b;
    (void)api_response_header(call->response, "Content-Disposition",
                              "attachment; filename=\"%s.%s%s\"", mesh.id, mesh.format,
                              packed ? ".gz" : "");
    respond_bytes(call, 200, packed ? "application/gzip" : mesh_media_type(mesh.format), content,
                  size);
out:
    store_mesh_clear(&mesh);
}

static bool add_mesh(void *user, const struct store_mesh *mesh)
{
    return list_add(user, mesh_record(mesh), mesh->created_ms, mesh->id);
}

void meshes_list(struct api_call *call)
{
    struct list list;

    if (list_open(call, "meshes", &list)) {
        list_respond(call, &list, "/v1/meshes",
                     store_mesh_list(call->api->config.store, &list.page, add_mesh, &list));
    }
}
