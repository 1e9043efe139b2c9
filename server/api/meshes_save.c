/*
 * meshes_save.c - the id of a mesh, and how one that a job made is kept.
 *
 * A mesh of a job is written as binary PLY in double precision, read back, and stored as if those
 * bytes had been uploaded. So the mesh that is encoded later, the mesh that the content shows and
 * the one of the report are the same to the bit, and a user who downloads and uploads it again gets
 * the same resource.
 */
#include "api/meshes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "compute/compute.h"
#include "compute/prepared.h"
#include "store/digest.h"
#include "store/mesh.h"
#include "store/store.h"

void mesh_id(char id[STORE_ID_MAX], const char *format, const void *bytes, size_t size)
{
    char digest[65], text[128];

    store_sha256_hex(digest, bytes, size);
    (void)snprintf(text, sizeof text, "%s:%s", format, digest);
    store_content_id(id, "mesh-", text, strlen(text));
}

/* The row of a mesh of these bytes, with its report. Returns an enum srnf_status. */
static int row_of(const struct srnf_buffer *bytes, const struct srnf_context *context,
                  struct store_mesh *row, struct compute_prepared *mesh)
{
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_mesh_read_info info = {0};
    int status;

    limits.context = context;
    status =
        srnf_mesh_read(bytes->data, bytes->size, SRNF_MESH_PLY, &limits, &mesh->mesh, &info, NULL);
    if (status >= 0) {
        status = mesh_examine(mesh, &info, context, &row->report);
    }
    row->vertices = (int64_t)mesh->mesh.n_vertices;
    row->faces = (int64_t)mesh->mesh.n_faces;
    row->bytes = (int64_t)bytes->size;
    row->created_ms = store_now_ms();
    return status;
}

/* Stores the row and gives its record, with the source that this job has. */
static int keep_row(struct store *store, struct store_mesh *row, const struct srnf_buffer *bytes,
                    json_t *source, json_t **record)
{
    bool created;
    int status = store_mesh_put(store, row, bytes->data, &created);

    if (status == STORE_OK) {
        *record = mesh_record(row);
        status = *record ? STORE_OK : STORE_NOMEM;
    }
    if (*record) {
        (void)json_object_set(*record, "source", source);
        (void)json_object_set(*record, "mirrored",
                              json_is_true(json_object_get(source, "mirrored")) ? json_true()
                                                                                : json_false());
    }
    return status;
}

int mesh_save(struct jobs *jobs, struct store *store, const struct store_owner *owner,
              struct mesh_description *description, const struct srnf_context *context,
              json_t **record, int *failed)
{
    struct compute_prepared prepared = {.kernel_known = false};
    struct store_mesh row = {.owner = *owner};
    struct srnf_buffer bytes = {0};
    int status = STORE_NOMEM;

    *record = NULL;
    *failed = srnf_mesh_write(description->mesh, SRNF_MESH_PLY, NULL, NULL, 0, &bytes);
    if (*failed >= 0) {
        *failed = row_of(&bytes, context, &row, &prepared);
    }
    if (*failed < 0) {
        goto out;
    }
    *failed = 0;
    mesh_id(row.id, srnf_mesh_format_name(SRNF_MESH_PLY), bytes.data, bytes.size);
    row.name = strdup(description->name ? description->name : "");
    row.format = strdup(srnf_mesh_format_name(SRNF_MESH_PLY));
    row.source = json_memory_dumps(description->source, JSON_COMPACT | JSON_SORT_KEYS);
    if (row.name && row.format && row.source) {
        status = keep_row(store, &row, &bytes, description->source, record);
    }
    if (status == STORE_OK && jobs) {
        compute_prepared_keep(jobs, store, owner->name, row.id, &prepared);
    }
out:
    json_decref(description->source);
    description->source = NULL;
    srnf_buffer_clear(&bytes);
    compute_prepared_clear(&prepared);
    store_mesh_clear(&row);
    return status;
}
