/*
 * labels.c - names and tags: a column each of owned and job, and a row of tag for each tag, all
 * changed in one transaction. The first owner's name stands in the content's own row too, for those
 * who see all (owner.c).
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/labels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct change {
    const char *owner, *id;
    const struct store_labels *labels;
};

#define BYTES(text) "length(CAST(" text " AS BLOB))"

int store_labels_check(sqlite3 *db, const char *owner, const char *id,
                       const struct store_labels *seen)
{
    sqlite3_stmt *row = NULL;
    int status =
        store_prepare(db, &row,
                      "SELECT 1 FROM owned WHERE owner = ?1 AND id = ?2 AND (name <> ?3 OR tags "
                      "<> ?4) UNION ALL SELECT 1 FROM job WHERE owner = ?1 AND id = ?2 AND "
                      "(coalesce(title, '') <> ?3 OR tags <> ?4)",
                      "tttt", owner, id, seen->name, seen->tags);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    sqlite3_finalize(row);
    if (status == STORE_OK) {
        return STORE_CONFLICT;
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static int change_owned(sqlite3 *db, const struct change *change, size_t *changed)
{
    int status = store_execute(
        db, changed,
        "UPDATE owned SET name = coalesce(?3, name), tags = coalesce(?4, tags), bytes = bytes "
        "+ " BYTES("coalesce(?3, name)") " - " BYTES("name") " + " BYTES(
            "coalesce(?4, tags)") " - " BYTES("tags") " WHERE owner = ?1 AND id = ?2",
        "tttt", change->owner, change->id, change->labels->name, change->labels->tags);
    static const char *const copies[] = {
        "UPDATE mesh SET name = ?3 WHERE id = ?2 AND ?3 IS NOT NULL AND EXISTS "
        "(SELECT 1 FROM owned WHERE owner = ?1 AND owned.id = ?2 AND first = 1)",
        "UPDATE surface SET name = ?3 WHERE id = ?2 AND ?3 IS NOT NULL AND EXISTS "
        "(SELECT 1 FROM owned WHERE owner = ?1 AND owned.id = ?2 AND first = 1)",
        "UPDATE volume SET name = ?3 WHERE id = ?2 AND ?3 IS NOT NULL AND EXISTS "
        "(SELECT 1 FROM owned WHERE owner = ?1 AND owned.id = ?2 AND first = 1)",
    };

    for (size_t i = 0; i < sizeof copies / sizeof copies[0] && status == STORE_OK; i++) {
        status = store_execute(db, NULL, copies[i], "ttt", change->owner, change->id,
                               change->labels->name);
    }
    return status;
}

static int change_job(sqlite3 *db, const struct change *change, size_t *changed)
{
    return store_execute(db, changed,
                         "UPDATE job SET title = coalesce(?3, title), tags = coalesce(?4, tags) "
                         "WHERE owner = ?1 AND id = ?2",
                         "tttt", change->owner, change->id, change->labels->name,
                         change->labels->tags);
}

static int change_tags(sqlite3 *db, const struct change *change)
{
    int status = store_execute(db, NULL, "DELETE FROM tag WHERE id = ? AND owner = ?", "tt",
                               change->id, change->owner);

    return status == STORE_OK
               ? store_execute(db, NULL,
                               "INSERT INTO tag (owner, tag, id) SELECT ?1, value, ?2 "
                               "FROM json_each(?3) WHERE true ON CONFLICT DO NOTHING",
                               "ttt", change->owner, change->id, change->labels->tags)
               : status;
}

static int run_change(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct change *change = write->argument;
    const struct store_labels *seen = change->labels->seen;
    size_t changed = 0;
    int status = seen ? store_labels_check(db, change->owner, change->id, seen) : STORE_OK;

    (void)store;
    if (status != STORE_OK) {
        return status;
    }
    status = strncmp(change->id, "job-", 4) == 0 ? change_job(db, change, &changed)
                                                 : change_owned(db, change, &changed);
    if (status == STORE_OK && changed == 0) {
        return STORE_NOT_FOUND;
    }
    if (status == STORE_OK && change->labels->tags) {
        status = change_tags(db, change);
    }
    return status == STORE_OK ? store_owner_check(db, change->owner, 0) : status;
}

int store_label_now(struct store *store, sqlite3 *db, const char *owner, const char *id,
                    const struct store_labels *labels)
{
    struct change change = {.owner = owner, .id = id, .labels = labels};
    struct store_write write = {.argument = &change};

    return run_change(store, db, &write);
}

int store_label(struct store *store, const char *owner, const char *id,
                const struct store_labels *labels)
{
    struct change change = {.owner = owner ? owner : "", .id = id, .labels = labels};

    return store_write(store, run_change, &change);
}

void store_labels_clear(struct store_labels_held *held)
{
    free(held->name);
    free(held->tags);
    *held = (struct store_labels_held){.name = NULL};
}

int store_labels_get(struct store *store, const char *owner, const char *id,
                     struct store_labels_held *held)
{
    struct store_query query;
    int status =
        store_query_first(&query, store,
                          "SELECT name, tags FROM owned WHERE owner = ?1 AND id = ?2 UNION ALL "
                          "SELECT coalesce(title, ''), tags FROM job WHERE owner = ?1 AND id = ?2",
                          "tt", owner ? owner : "", id);

    *held = (struct store_labels_held){.name = NULL};
    if (status == STORE_OK) {
        held->name = store_column_text(query.row, 0, &status);
        held->tags = store_column_text(query.row, 1, &status);
    }
    store_query_close(&query);
    if (status != STORE_OK) {
        store_labels_clear(held);
    }
    return status;
}

struct batched {
    struct change change;
    struct store_labels labels;
    char owner[STORE_OWNER_MAX], id[STORE_ID_MAX], texts[];
};

static void clear_batched(struct store *store, void *argument)
{
    (void)store;
    free(argument);
}

int store_batch_add_labels(struct store_batch *batch, const char *owner, const char *id,
                           const struct store_labels *labels)
{
    size_t name = labels->name ? strlen(labels->name) + 1 : 0;
    size_t tags = labels->tags ? strlen(labels->tags) + 1 : 0;
    struct batched *batched = calloc(1, sizeof *batched + name + tags);

    if (!batched) {
        return STORE_NOMEM;
    }
    if (name) {
        batched->labels.name = memcpy(batched->texts, labels->name, name);
    }
    if (tags) {
        batched->labels.tags = memcpy(batched->texts + name, labels->tags, tags);
    }
    (void)snprintf(batched->owner, sizeof batched->owner, "%s", owner ? owner : "");
    (void)snprintf(batched->id, sizeof batched->id, "%s", id);
    batched->change = (struct change){batched->owner, batched->id, &batched->labels};
    return store_batch_add(
        batch, STORE_OK, STORE_BATCH_REST,
        &(struct store_batch_item){run_change, &batched->change, clear_batched, batched});
}
