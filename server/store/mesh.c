/*
 * mesh.c - the rows of meshes. A mesh never changes: its id is its content, so that storing it
 * twice finds it there. Name, source and time are each owner's (owner.c). The report on it is that
 * of the program that stored it last: a later version may find more.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/holdings.h"
#include "store/mesh.h"
#include "store/page.h"
#include "store/store.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS "id, name, format, report, bytes, vertices, faces, created_ms, source"
/* Name, source and time stay those of the first; what is said of the content that of the last. */
#define RENEW \
    "UPDATE SET report = excluded.report, vertices = excluded.vertices, faces = excluded.faces"
#define COLUMNS_AS                                                                              \
    "mesh.id, coalesce(owned.name, mesh.name), format, report, mesh.bytes, vertices, "          \
    "faces, coalesce(owned.created_ms, mesh.created_ms), coalesce(owned.record, mesh.source), " \
    "coalesce(owned.tags, '[]')"

void store_mesh_clear(struct store_mesh *mesh)
{
    free(mesh->name);
    free(mesh->format);
    free(mesh->report);
    free(mesh->source);
    free(mesh->tags);
    *mesh = (struct store_mesh){0};
}

static int from_row(sqlite3_stmt *row, struct store_mesh *mesh)
{
    int status = STORE_OK;

    *mesh = (struct store_mesh){0};
    store_column_id(row, 0, mesh->id, sizeof mesh->id);
    mesh->name = store_column_text(row, 1, &status);
    mesh->format = store_column_text(row, 2, &status);
    mesh->report = store_column_text(row, 3, &status);
    mesh->bytes = sqlite3_column_int64(row, 4);
    mesh->vertices = sqlite3_column_int64(row, 5);
    mesh->faces = sqlite3_column_int64(row, 6);
    mesh->created_ms = sqlite3_column_int64(row, 7);
    mesh->source = store_column_text(row, 8, &status);
    mesh->tags = store_column_text(row, 9, &status);
    if (status != STORE_OK) {
        store_mesh_clear(mesh);
    }
    return status;
}

int store_mesh_get(struct store *store, const char *id, struct store_mesh *mesh)
{
    return store_mesh_get_as(store, NULL, id, mesh);
}

int store_mesh_get_as(struct store *store, const char *owner, const char *id,
                      struct store_mesh *mesh)
{
    struct store_query query;
    int status =
        store_query_first(&query, store, STORE_ROW_AS(COLUMNS_AS, "mesh"), "tt", owner, id);

    *mesh = (struct store_mesh){0};
    if (status == STORE_OK) {
        status = from_row(query.row, mesh);
    }
    store_query_close(&query);
    return status;
}

int store_mesh_content(struct store *store, const char *id, unsigned char **content, size_t *size)
{
    return store_blob_find(store, "SELECT content FROM mesh WHERE id = ?", id, content, size);
}

struct put {
    const struct store_mesh *mesh;
    const struct store_content *content;
    int64_t now;
    bool created;
};

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_mesh *mesh = put->mesh;
    const int64_t report = mesh->report ? (int64_t)strlen(mesh->report) : 0;
    const struct store_holding holding = {.id = mesh->id,
                                          .kind = "mesh",
                                          .name = mesh->name ? mesh->name : "",
                                          .record = mesh->source ? mesh->source : "",
                                          .bytes = mesh->bytes + report,
                                          .now = put->now};
    int status = store_owner_take(db, &mesh->owner, &holding, &put->created);

    if (status == STORE_OK && put->created) {
        status = store_blob_keep(store, db, put->content);
    }
    if (status == STORE_OK && put->created) {
        status = store_execute(db, NULL,
                               "INSERT INTO mesh (" COLUMNS ", content) "
                               "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO " RENEW,
                               "ttttiiiitt", mesh->id, mesh->name ? mesh->name : "",
                               mesh->format ? mesh->format : "", mesh->report ? mesh->report : "",
                               mesh->bytes, mesh->vertices, mesh->faces, put->now,
                               mesh->source ? mesh->source : "", put->content->hash);
    }
    return status;
}

static int run_renew(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct put *put = write->argument;
    const struct store_mesh *mesh = put->mesh;

    (void)store;
    return store_execute(db, NULL,
                         "UPDATE mesh SET report = ?, vertices = ?, faces = ? WHERE id = ?", "tiit",
                         mesh->report ? mesh->report : "", mesh->vertices, mesh->faces, mesh->id);
}

/* Gives the stored mesh this report, if it has another. */
static int renew_report(struct store *store, const struct store_mesh *held, struct store_mesh *mesh)
{
    struct put put = {.mesh = mesh};

    return strcmp(held->report, mesh->report ? mesh->report : "") == 0
               ? STORE_OK
               : store_write(store, run_renew, &put);
}

/* Takes name, source and time of what the store holds, and gives it the report. */
static int adopt(struct store *store, struct store_mesh *mesh)
{
    const char *owner = store_owner_name(&mesh->owner);
    struct store_mesh held;
    int status = store_mesh_get_as(store, owner, mesh->id, &held);

    if (status == STORE_OK) {
        status = renew_report(store, &held, mesh);
        free(mesh->name);
        free(mesh->source);
        free(mesh->tags);
        mesh->name = held.name;
        mesh->source = held.source;
        mesh->created_ms = held.created_ms;
        mesh->tags = held.tags;
        held.name = held.source = held.tags = NULL;
        store_mesh_clear(&held);
    }
    return status;
}

int store_mesh_mend(struct store *store, const void *content, size_t size)
{
    return store_blob_mend(store, content, size);
}

int store_mesh_put(struct store *store, struct store_mesh *mesh, const void *content, bool *created)
{
    struct store_content staged;
    struct put put = {.mesh = mesh, .content = &staged, .now = store_now_ms()};
    int status = store_owner_has(store, mesh->owner.name, mesh->id);

    *created = false;
    if (status != STORE_NOT_FOUND) {
        status = status == STORE_OK ? adopt(store, mesh) : status;
        return status == STORE_OK ? store_mesh_mend(store, content, (size_t)mesh->bytes) : status;
    }
    status = store_blob_stage(store, content, (size_t)mesh->bytes, &staged);
    if (status != STORE_OK) {
        return status;
    }
    status = store_write(store, run_put, &put);
    store_blob_unstage(store, &staged);
    if (status == STORE_OK) {
        *created = put.created;
        status = adopt(store, mesh);
    }
    return status;
}

int store_mesh_drop_derived(struct store *store, const char *id)
{
    store_prepared_drop(store, id);
    return store_encoding_drop(store, id);
}

/* ---- As part of a batch ---------------------------------------------------------------------- */

struct batched {
    struct put put;
    struct store_mesh mesh;
    struct store_content content;
};

static void clear_batched(struct store *store, void *argument)
{
    struct batched *batched = argument;

    store_blob_unstage(store, &batched->content);
    store_mesh_clear(&batched->mesh);
    free(batched);
}

int store_batch_add_mesh(struct store_batch *batch, struct store_mesh *mesh, const void *content,
                         bool *kept)
{
    struct batched *batched = calloc(1, sizeof *batched);
    int status;

    *kept = false;
    if (!batched) {
        store_mesh_clear(mesh);
        return STORE_NOMEM;
    }
    batched->mesh = *mesh;
    *mesh = (struct store_mesh){0};
    batched->put =
        (struct put){.mesh = &batched->mesh, .content = &batched->content, .now = store_now_ms()};
    status = store_batch_stage(batch, batched->mesh.owner.name, batched->mesh.id, content,
                               (size_t)batched->mesh.bytes, &batched->content, kept);
    if (status == STORE_OK && !batched->content.hash[0]) { /* the owner has it */
        clear_batched(store_batch_store(batch), batched);
        return STORE_OK;
    }
    return store_batch_add(
        batch, status, STORE_BATCH_UPLOAD,
        &(struct store_batch_item){run_put, &batched->put, clear_batched, batched});
}

struct list {
    bool (*visit)(void *user, const struct store_mesh *mesh);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_mesh mesh;
    int status = from_row(row, &mesh);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &mesh);
        store_mesh_clear(&mesh);
    }
    return status;
}

const struct store_listing store_mesh_listing = {
    STORE_LISTING_OF_CONTENT("mesh", COLUMNS_AS),
    .process = "listed.process",
    .cohort = STORE_LISTED_BY_COHORT("mesh"),
    .mesh = STORE_LISTED_BY_MESH,
};

int store_mesh_list(struct store *store, const struct store_page *page,
                    bool (*visit)(void *user, const struct store_mesh *mesh), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_mesh_listing, page, list_row, &list);
}
