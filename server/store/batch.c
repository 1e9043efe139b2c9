/*
 * batch.c - several puts in one transaction.
 *
 * What takes long is done when a put is added, on the caller's thread: hashing, and writing large
 * content to the disk under a temporary name. The transaction then moves files to their names and
 * inserts rows, so that the writer has all puts of a batch as one write: a failure of any of them
 * undoes the others. A file that had its name already is then without a row, which the sweep of the
 * next start removes.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/holdings.h"

#include <stdlib.h>

struct entry {
    struct store_batch_item item;
    enum store_batch_turn turn;
};

struct store_batch {
    struct store *store;
    struct entry *items;
    size_t count, capacity;
    size_t failed;
    const char *owner; /* store_batch_commit */
};

struct store_batch *store_batch_create(struct store *store)
{
    struct store_batch *batch = calloc(1, sizeof *batch);

    if (batch) {
        batch->store = store;
    }
    return batch;
}

static void clear_item(struct store_batch *batch, size_t index)
{
    struct store_batch_item *item = &batch->items[index].item;

    if (item->clear) {
        item->clear(batch->store, item->owned);
    }
    *item = (struct store_batch_item){.run = NULL};
}

void store_batch_destroy(struct store_batch *batch)
{
    if (!batch) {
        return;
    }
    for (size_t i = 0; i < batch->count; i++) {
        clear_item(batch, i);
    }
    free(batch->items);
    free(batch);
}

struct store *store_batch_store(const struct store_batch *batch)
{
    return batch->store;
}

static int make_room(struct store_batch *batch)
{
    size_t capacity = batch->capacity ? 2 * batch->capacity : 64;
    struct entry *items;

    if (batch->count < batch->capacity) {
        return STORE_OK;
    }
    items = reallocarray(batch->items, capacity, sizeof *batch->items);
    if (!items) {
        return STORE_NOMEM;
    }
    batch->items = items;
    batch->capacity = capacity;
    return STORE_OK;
}

int store_batch_add(struct store_batch *batch, int status, enum store_batch_turn turn,
                    const struct store_batch_item *item)
{
    status = status == STORE_OK ? make_room(batch) : status;
    if (status == STORE_OK) {
        batch->items[batch->count++] = (struct entry){*item, turn};
    } else {
        item->clear(batch->store, item->owned);
    }
    return status;
}

int store_batch_stage(struct store_batch *batch, const char *owner, const char *id,
                      const void *bytes, size_t size, struct store_content *content, bool *kept)
{
    int status = store_owner_has(batch->store, owner, id);

    *kept = false;
    if (status == STORE_OK) {
        return store_blob_mend(batch->store, bytes, size);
    }
    if (status == STORE_NOT_FOUND) {
        status = store_blob_stage(batch->store, bytes, size, content);
        *kept = !content->temporary[0];
    }
    return status;
}

size_t store_batch_count(const struct store_batch *batch)
{
    return batch->count;
}

void store_batch_drop(struct store_batch *batch, size_t index)
{
    clear_item(batch, index);
}

/* What the owner's things need of others, who may delete it. Content and jobs are told apart by
   their ids: a job that has gone may be needed still (0012_needs.sql). */
static int drop_foreign(sqlite3 *db, const char *owner)
{
    return store_execute(
        db, NULL,
        "DELETE FROM need WHERE owner = ?1 AND CASE WHEN id GLOB 'job-*' "
        "THEN EXISTS (SELECT 1 FROM job WHERE job.id = need.id AND job.owner <> ?1) "
        "ELSE NOT EXISTS (SELECT 1 FROM owned WHERE owned.owner = ?1 AND owned.id = need.id) END",
        "t", owner);
}

static int run_batch(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct store_batch *batch = write->argument;
    int status = STORE_OK;

    for (size_t k = 0; status == STORE_OK && k < STORE_BATCH_TURNS * batch->count; k++) {
        const size_t i = k % batch->count;
        const struct store_batch_item *item = &batch->items[i].item;
        struct store_write one = {.argument = item->argument};

        if (batch->items[i].turn == k / batch->count && item->run) {
            batch->failed = i;
            status = item->run(store, db, &one);
        }
    }
    return status == STORE_OK && batch->owner ? drop_foreign(db, batch->owner) : status;
}

int store_batch_commit(struct store_batch *batch, const char *owner, size_t *failed)
{
    int status;

    batch->owner = owner;
    status = store_write(batch->store, run_batch, batch);

    *failed = batch->failed;
    return status;
}
