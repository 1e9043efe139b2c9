/*
 * volumes.c - the volume resource: POST reads a segmentation, lists its labels and keeps it; GET
 * answers records, lists and the original bytes.
 *
 * As with meshes (meshes.c), an id is a content address, the same file sent twice is one resource,
 * and what another owner has sent is read all the same. A body that is no label volume is refused
 * with what to do about it, and not kept.
 */
#include "api/volumes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/json_numbers.h"
#include "api/labels.h"
#include "api/lists.h"
#include "api/meshes.h"
#include "api/respond.h"
#include "api/routes.h"
#include "compute/compute.h"
#include "store/digest.h"
#include "store/holdings.h"
#include "store/volume.h"

static const char accepted[] =
    "application/octet-stream,application/x-www-form-urlencoded,application/gzip,"
    "application/x-gzip,application/x-nifti,application/x-nrrd,text/plain";

bool volume_type_known(const char *value, size_t length)
{
    char type[96];

    if (length >= sizeof type) {
        return false;
    }
    memcpy(type, value, length);
    type[length] = '\0';
    return list_has(accepted, type);
}

json_t *volume_record(const struct store_volume *volume, bool with_labels)
{
    json_t *document = volume->record ? json_loads(volume->record, 0, NULL) : NULL;
    json_t *links = json_object();
    char path[128];

    document = json_is_object(document) ? document : json_object();
    (void)snprintf(path, sizeof path, "/v1/volumes/%s", volume->id);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/volumes/%s/content", volume->id);
    (void)json_object_set_new(links, "content", json_string(path));
    (void)json_object_set_new(document, "id", json_string(volume->id));
    (void)json_object_set_new(document, "name", json_string(volume->name ? volume->name : ""));
    labels_set_tags(document, volume->tags);
    (void)json_object_set_new(document, "bytes", json_integer(volume->bytes));
    (void)json_object_set_new(document, "created", json_time(volume->created_ms));
    (void)json_object_set_new(document, "links", links);
    if (!with_labels) {
        (void)json_object_del(document, "labels");
    }
    return document;
}

/* ---- POST /v1/volumes ------------------------------------------------------------------------ */

static json_t *labels_json(const struct srnf_volume *volume)
{
    json_t *labels = json_array();

    for (size_t i = 0; i < volume->n_labels; i++) {
        const struct srnf_label *label = &volume->labels[i];

        (void)json_array_append_new(
            labels, json_pack("{s:I, s:I, s:o}", "value", (json_int_t)label->value, "voxels",
                              (json_int_t)label->voxels, "name",
                              label->name[0] ? json_string(label->name) : json_null()));
    }
    return labels;
}

/* What was read of the content, as JSON text. */
static char *record_text(const struct srnf_volume *volume)
{
    const size_t shape[2] = {3, 4};
    json_t *document =
        json_pack("{s:s, s:[I,I,I], s:o, s:o, s:s, s:s, s:I, s:I, s:o}", "format",
                  srnf_volume_format_name(volume->format), "shape", (json_int_t)volume->shape[0],
                  (json_int_t)volume->shape[1], (json_int_t)volume->shape[2], "spacing",
                  json_vector(volume->spacing, 3), "affine", json_nested(volume->affine, 2, shape),
                  "space", srnf_volume_space_name(volume->space), "units", volume->units,
                  "background", (json_int_t)volume->background, "labelCount",
                  (json_int_t)volume->n_labels, "labels", labels_json(volume));
    char *text = json_memory_dumps(document, JSON_COMPACT | JSON_REAL_PRECISION(17));

    json_decref(document);
    return text;
}

static bool parse_volume(struct api_call *call, struct store_volume *row)
{
    struct srnf_volume_limits limits = srnf_volume_limits_defaults();
    struct srnf_error error = {.element = -1};
    struct srnf_volume volume;
    int status;

    limits.context = &upload_context;
    limits.unpack_left = call->unpack_left;
    status = srnf_volume_read(call->request->body, call->request->body_size, SRNF_VOLUME_UNKNOWN,
                              &limits, &volume, &error);
    if (status < 0) {
        bool unreadable = status == SRNF_EFORMAT || status == SRNF_EPARSE || status == SRNF_ELIMIT;

        (void)problem_respond(call, unreadable ? "unparsable-volume" : compute_problem_code(status),
                              "%s.", error.message);
        return false;
    }
    row->record = record_text(&volume);
    srnf_volume_clear(&volume);
    if (!row->record) {
        (void)problem_respond(call, "out-of-memory", "The record could not be allocated.");
    }
    return row->record != NULL;
}

static void respond_volume(struct api_call *call, int status, const struct store_volume *volume)
{
    (void)api_response_header(call->response, "Location", "/v1/volumes/%s", volume->id);
    respond_json(call, status, volume_record(volume, true));
}

static void volume_id(char id[STORE_ID_MAX], const void *bytes, size_t size)
{
    char digest[65], text[128];

    store_sha256_hex(digest, bytes, size);
    (void)snprintf(text, sizeof text, "volume:%s", digest);
    store_content_id(id, "vol-", text, strlen(text));
}

bool volume_read_body(struct api_call *call, const char *name, struct store_volume *row, bool *held)
{
    const struct api_request *request = call->request;
    struct store *store = call->api->config.store;
    struct store_owner owner = call_owner(call);

    *row = (struct store_volume){.id = ""};
    *held = false;
    if (request->body_size == 0) {
        (void)problem_respond(call, "unparsable-volume", "The body is empty.");
        return false;
    }
    volume_id(row->id, request->body, request->body_size);
    *held = store_owner_has(store, owner.name, row->id) == 0;
    row->owner = owner;
    row->name = strdup(name);
    row->bytes = (int64_t)request->body_size;
    if (!row->name) {
        (void)problem_respond(call, "out-of-memory", "The record could not be allocated.");
        return false;
    }
    return parse_volume(call, row);
}

bool volume_keep_body(struct api_call *call, const char *name, struct store_volume *row,
                      bool *created)
{
    struct store *store = call->api->config.store;
    bool held;
    int status = STORE_OK;

    *created = false;
    if (!volume_read_body(call, name, row, &held)) {
        return false;
    }
    for (int again = 0; again <= DELETED_MEANWHILE; again++) {
        status = store_volume_put(store, row, call->request->body, created);
        if (status == 0 && !*created) {
            status = labels_rename(store, row->owner.name, row->id, name, &row->name);
        }
        if (status != STORE_NOT_FOUND) {
            break;
        }
    }
    if (status != 0) {
        (void)problem_respond_store(call, status, NULL, "keeping the volume");
    }
    return status == 0;
}

void volumes_create(struct api_call *call)
{
    struct store_volume row = {.id = ""};
    char name[NAME_SIZE];
    bool created;

    if (query_name(call, name) && volume_keep_body(call, name, &row, &created)) {
        respond_volume(call, created ? 201 : 200, &row);
    }
    store_volume_clear(&row);
}

/* ---- GET ------------------------------------------------------------------------------------- */

static bool find_volume(struct api_call *call, struct store_volume *volume)
{
    int status = store_volume_get_as(call->api->config.store, call->request->caller.name,
                                     call->parameters[0], volume);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-volume", call->parameters[0]);
    }
    return status == 0;
}

void volumes_get(struct api_call *call)
{
    struct store_volume volume = {.id = ""};
    char etag[LABELS_ETAG_MAX];

    if (find_volume(call, &volume)) {
        labels_etag(etag, volume.id, volume.name, volume.tags);
        if (!respond_not_modified(call, etag)) {
            respond_json(call, 200, volume_record(&volume, true));
        }
        store_volume_clear(&volume);
    }
}

void volumes_content(struct api_call *call)
{
    struct store_volume volume = {.id = ""};
    unsigned char *content = NULL;
    size_t size = 0;
    char tag[STORE_ID_MAX + 16];
    int status;

    if (!find_volume(call, &volume)) {
        return;
    }
    (void)snprintf(tag, sizeof tag, "%s.content", volume.id);
    if (!respond_not_modified_ever(call, tag)) {
        status = store_volume_content(call->api->config.store, volume.id, &content, &size);
        if (status != 0) {
            (void)problem_respond_store(call, status, "no-such-volume", volume.id);
        } else {
            (void)api_response_header(call->response, "Content-Disposition",
                                      "attachment; filename=\"%s\"", volume.id);
            respond_bytes(call, 200, "application/octet-stream", content, size);
        }
    }
    store_volume_clear(&volume);
}

static bool add_volume(void *user, const struct store_volume *volume)
{
    return list_add(user, volume_record(volume, false), volume->created_ms, volume->id);
}

void volumes_list(struct api_call *call)
{
    struct list list;

    if (list_open(call, "volumes", &list)) {
        list_respond(call, &list, "/v1/volumes",
                     store_volume_list(call->api->config.store, &list.page, add_volume, &list));
    }
}
