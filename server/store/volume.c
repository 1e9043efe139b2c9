/*
 * volume.c - the rows of label volumes. A volume never changes: its id is its content. Name and
 * time are each owner's (owner.c); the record of what was read is that of the program that stored
 * it last.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/holdings.h"
#include "store/page.h"
#include "store/store.h"
#include "store/volume.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS "id, name, record, bytes, created_ms"
#define COLUMNS_AS                                                                \
    "volume.id, coalesce(owned.name, volume.name), volume.record, volume.bytes, " \
    "coalesce(owned.created_ms, volume.created_ms), coalesce(owned.tags, '[]')"

void store_volume_clear(struct store_volume *volume)
{
    free(volume->name);
    free(volume->record);
    free(volume->tags);
    *volume = (struct store_volume){0};
}

static int from_row(sqlite3_stmt *row, struct store_volume *volume)
{
    int status = STORE_OK;

    *volume = (struct store_volume){0};
    store_column_id(row, 0, volume->id, sizeof volume->id);
    volume->name = store_column_text(row, 1, &status);
    volume->record = store_column_text(row, 2, &status);
    volume->bytes = sqlite3_column_int64(row, 3);
    volume->created_ms = sqlite3_column_int64(row, 4);
    volume->tags = store_column_text(row, 5, &status);
    if (status != STORE_OK) {
        store_volume_clear(volume);
    }
    return status;
}

int store_volume_get_as(struct store *store, const char *owner, const char *id,
                        struct store_volume *volume)
{
    struct store_query query;
    int status =
        store_query_first(&query, store, STORE_ROW_AS(COLUMNS_AS, "volume"), "tt", owner, id);

    *volume = (struct store_volume){0};
    if (status == STORE_OK) {
        status = from_row(query.row, volume);
    }
    store_query_close(&query);
    return status;
}

int store_volume_content(struct store *store, const char *id, unsigned char **content, size_t *size)
{
    return store_blob_find(store, "SELECT content FROM volume WHERE id = ?", id, content, size);
}

struct put {
    const struct store_volume *volume;
    const struct store_content *content;
    int64_t now;
    bool created;
};

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_volume *volume = put->volume;
    const int64_t record = volume->record ? (int64_t)strlen(volume->record) : 0;
    const struct store_holding holding = {.id = volume->id,
                                          .kind = "volume",
                                          .name = volume->name ? volume->name : "",
                                          .bytes = volume->bytes + record,
                                          .now = put->now};
    int status = store_owner_take(db, &volume->owner, &holding, &put->created);

    if (status == STORE_OK && put->created) {
        status = store_blob_keep(store, db, put->content);
    }
    if (status == STORE_OK && put->created) {
        status = store_execute(db, NULL,
                               "INSERT INTO volume (" COLUMNS ", content) "
                               "VALUES (?, ?, ?, ?, ?, ?) "
                               "ON CONFLICT (id) DO UPDATE SET record = excluded.record",
                               "tttiit", volume->id, volume->name ? volume->name : "",
                               volume->record ? volume->record : "", volume->bytes, put->now,
                               put->content->hash);
    }
    return status;
}

/* Takes name, tags and time of what the store holds. */
static int adopt(struct store *store, struct store_volume *volume)
{
    struct store_volume held;
    int status = store_volume_get_as(store, store_owner_name(&volume->owner), volume->id, &held);

    if (status == STORE_OK) {
        free(volume->name);
        free(volume->tags);
        volume->name = held.name;
        volume->tags = held.tags;
        volume->created_ms = held.created_ms;
        held.name = held.tags = NULL;
        store_volume_clear(&held);
    }
    return status;
}

int store_volume_put(struct store *store, struct store_volume *volume, const void *content,
                     bool *created)
{
    struct store_content staged;
    struct put put = {.volume = volume, .content = &staged, .now = store_now_ms()};
    int status = store_owner_has(store, volume->owner.name, volume->id);

    *created = false;
    if (status != STORE_NOT_FOUND) {
        status = status == STORE_OK ? adopt(store, volume) : status;
        return status == STORE_OK ? store_blob_mend(store, content, (size_t)volume->bytes) : status;
    }
    status = store_blob_stage(store, content, (size_t)volume->bytes, &staged);
    if (status != STORE_OK) {
        return status;
    }
    status = store_write(store, run_put, &put);
    store_blob_unstage(store, &staged);
    if (status == STORE_OK) {
        *created = put.created;
        status = adopt(store, volume);
    }
    return status;
}

/* ---- As part of a batch ---------------------------------------------------------------------- */

struct batched {
    struct put put;
    struct store_volume volume;
    struct store_content content;
};

static void clear_batched(struct store *store, void *argument)
{
    struct batched *batched = argument;

    store_blob_unstage(store, &batched->content);
    store_volume_clear(&batched->volume);
    free(batched);
}

int store_batch_add_volume(struct store_batch *batch, struct store_volume *volume,
                           const void *content, bool *kept)
{
    struct batched *batched = calloc(1, sizeof *batched);
    int status;

    *kept = false;
    if (!batched) {
        store_volume_clear(volume);
        return STORE_NOMEM;
    }
    batched->volume = *volume;
    *volume = (struct store_volume){.id = ""};
    batched->put = (struct put){
        .volume = &batched->volume, .content = &batched->content, .now = store_now_ms()};
    status = store_batch_stage(batch, batched->volume.owner.name, batched->volume.id, content,
                               (size_t)batched->volume.bytes, &batched->content, kept);
    if (status == STORE_OK && !batched->content.hash[0]) { /* the owner has it */
        clear_batched(store_batch_store(batch), batched);
        return STORE_OK;
    }
    return store_batch_add(
        batch, status, STORE_BATCH_UPLOAD,
        &(struct store_batch_item){run_put, &batched->put, clear_batched, batched});
}

struct list {
    bool (*visit)(void *user, const struct store_volume *volume);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_volume volume;
    int status = from_row(row, &volume);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &volume);
        store_volume_clear(&volume);
    }
    return status;
}

const struct store_listing store_volume_listing = {
    STORE_LISTING_OF_CONTENT("volume", COLUMNS_AS),
};

int store_volume_list(struct store *store, const struct store_page *page,
                      bool (*visit)(void *user, const struct store_volume *volume), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_volume_listing, page, list_row, &list);
}
