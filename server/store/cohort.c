/*
 * cohort.c - the rows of cohorts: a name that its owner has chosen, for an ordered list of meshes
 * and surfaces. Two owners may give the same name to different lists.
 *
 * What is told of the members (labels, subjects, covariates) is part of the record, a text that
 * the layer above writes; the rows of cohort_member only hold in place what the cohort names. A put
 * of another record under a name that is taken is a conflict; to change a cohort is to replace it
 * as a whole, by one who has seen what it was.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/cohort.h"
#include "store/digest.h"
#include "store/page.h"
#include "store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS "name, record, digest, members, created_ms, owner"

void store_cohort_clear(struct store_cohort *cohort)
{
    free(cohort->record);
    free(cohort->members);
    *cohort = (struct store_cohort){0};
}

static int from_row(sqlite3_stmt *row, struct store_cohort *cohort)
{
    int status = STORE_OK;

    *cohort = (struct store_cohort){0};
    store_column_id(row, 0, cohort->name, sizeof cohort->name);
    cohort->record = store_column_text(row, 1, &status);
    store_column_id(row, 2, cohort->digest, sizeof cohort->digest);
    cohort->n_members = (size_t)sqlite3_column_int64(row, 3);
    cohort->created_ms = sqlite3_column_int64(row, 4);
    store_column_id(row, 5, cohort->owner, sizeof cohort->owner);
    if (status != STORE_OK) {
        store_cohort_clear(cohort);
    }
    return status;
}

static int read_members(sqlite3 *db, struct store_cohort *cohort)
{
    sqlite3_stmt *rows = NULL;
    size_t n = 0;
    int status = store_prepare(db, &rows,
                               "SELECT coalesce(mesh, surface) FROM cohort_member "
                               "WHERE owner = ? AND cohort = ? ORDER BY position",
                               "tt", cohort->owner, cohort->name);

    cohort->members = calloc(cohort->n_members + 1, sizeof *cohort->members);
    if (status == STORE_OK && !cohort->members) {
        status = STORE_NOMEM;
    }
    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK) {
        if (n == cohort->n_members) {
            status = STORE_CORRUPT;
            break;
        }
        store_column_id(rows, 0, cohort->members[n++], STORE_ID_MAX);
    }
    sqlite3_finalize(rows);
    if (status == STORE_NOT_FOUND) {
        status = n == cohort->n_members ? STORE_OK : STORE_CORRUPT;
    }
    return status;
}

/* The owner's cohort of that name, without its members. */
static int read_row(sqlite3 *db, const char *owner, const char *name, struct store_cohort *cohort)
{
    sqlite3_stmt *row = NULL;
    int status =
        store_prepare(db, &row, "SELECT " COLUMNS " FROM cohort WHERE owner = ? AND name = ?", "tt",
                      owner ? owner : "", name);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        status = from_row(row, cohort);
    }
    sqlite3_finalize(row);
    return status;
}

int store_cohort_get_as(struct store *store, const char *owner, const char *name,
                        struct store_cohort *cohort)
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    *cohort = (struct store_cohort){0};
    if (status != STORE_OK) {
        return status;
    }
    /* One snapshot for the row and its members: the cohort may be deleted in between. */
    status = store_execute(reader->db, NULL, "BEGIN", "");
    if (status == STORE_OK) {
        status = read_row(reader->db, owner, name, cohort);
        if (status == STORE_OK) {
            status = read_members(reader->db, cohort);
        }
        (void)store_execute(reader->db, NULL, "COMMIT", "");
    }
    if (status != STORE_OK) {
        store_cohort_clear(cohort);
    }
    store_reader_return(store, reader);
    return status;
}

int store_cohort_get(struct store *store, const char *name, struct store_cohort *cohort)
{
    return store_cohort_get_as(store, "", name, cohort);
}

int store_cohort_owners(struct store *store, const char *name, char (*owners)[STORE_OWNER_MAX],
                        size_t most, size_t *count)
{
    return store_owners_of(store, "SELECT owner FROM cohort WHERE name = ? ORDER BY owner", name,
                           owners, most, count);
}

struct put {
    const struct store_cohort *cohort;
    int64_t now;
    bool created;
    size_t missing;
    int64_t created_ms;
};

#define ADD_MEMBER(kind)                                                                   \
    "INSERT INTO cohort_member (owner, cohort, position, " kind ") SELECT ?1, ?2, ?3, id " \
    "FROM " kind " WHERE id = ?4 AND (?5 OR EXISTS "                                       \
    "(SELECT 1 FROM owned WHERE owned.owner = ?1 AND owned.id = ?4))"

/* Adds the member's row where the mesh or surface exists and its owner may name it. The statement
   has owner, name and view bound. */
static int add_member(sqlite3 *db, sqlite3_stmt *add, const char *id, size_t position)
{
    int status;

    if (sqlite3_reset(add) != SQLITE_OK ||
        sqlite3_bind_int64(add, 3, (sqlite3_int64)position) != SQLITE_OK ||
        sqlite3_bind_text(add, 4, id, -1, SQLITE_STATIC) != SQLITE_OK) {
        return store_map(db, sqlite3_errcode(db));
    }
    status = store_step(db, add);
    return status == STORE_NOT_FOUND && sqlite3_changes(db) > 0 ? STORE_OK : status;
}

/* The rows of all members, with two statements for all: a cohort may have 100,000. */
static int add_members(sqlite3 *db, const struct store_cohort *cohort, const char *owner,
                       size_t *missing)
{
    const int64_t all = cohort->view.all;
    sqlite3_stmt *add[2] = {NULL};
    int status = store_prepare(db, &add[0], ADD_MEMBER("mesh"), "ttiti", owner, cohort->name,
                               INT64_C(0), "", all);

    if (status == STORE_OK) {
        status = store_prepare(db, &add[1], ADD_MEMBER("surface"), "ttiti", owner, cohort->name,
                               INT64_C(0), "", all);
    }
    for (size_t i = 0; status == STORE_OK && i < cohort->n_members; i++) {
        bool surface = strncmp(cohort->members[i], "surf-", 5) == 0;

        *missing = i;
        status = add_member(db, add[surface], cohort->members[i], i);
    }
    sqlite3_finalize(add[0]);
    sqlite3_finalize(add[1]);
    return status;
}

static int insert_cohort(sqlite3 *db, const struct store_cohort *cohort, const char *owner,
                         int64_t created_ms, size_t *missing)
{
    int status =
        store_execute(db, NULL, "INSERT INTO cohort (" COLUMNS ") VALUES (?, ?, ?, ?, ?, ?)",
                      "tttiit", cohort->name, cohort->record, cohort->digest,
                      (int64_t)cohort->n_members, created_ms, owner);

    if (status == STORE_OK) {
        status = add_members(db, cohort, owner, missing);
    }
    return status == STORE_OK ? store_owner_check(db, owner, 0) : status;
}

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_cohort *cohort = put->cohort;
    const char *owner = cohort->view.owner ? cohort->view.owner : "";
    struct store_cohort held;
    int status = read_row(db, owner, cohort->name, &held);

    (void)store;
    put->created = false;
    if (status == STORE_OK) {
        status = strcmp(held.digest, cohort->digest) == 0 ? STORE_OK : STORE_CONFLICT;
        put->created_ms = held.created_ms;
        store_cohort_clear(&held);
        return status;
    }
    if (status == STORE_NOT_FOUND) {
        status = store_owner_limit(db, owner, cohort->bytes_max);
    }
    if (status == STORE_OK) {
        status = insert_cohort(db, cohort, owner, put->now, &put->missing);
    }
    put->created = status == STORE_OK;
    put->created_ms = put->now;
    return status;
}

int store_cohort_put(struct store *store, struct store_cohort *cohort, bool *created,
                     size_t *missing)
{
    struct put put = {.cohort = cohort, .now = store_now_ms()};
    int status;

    store_sha256_hex(cohort->digest, cohort->record, strlen(cohort->record));
    status = store_write(store, run_put, &put);
    *created = status == STORE_OK && put.created;
    *missing = put.missing;
    cohort->created_ms = put.created_ms;
    return status;
}

/* ---- Changing -------------------------------------------------------------------------------- */

struct replacement {
    struct store_cohort *cohort;
    const char *name, *digest;
    size_t missing;
    bool changed;
};

static int run_replace(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct replacement *replacement = write->argument;
    struct store_cohort *cohort = replacement->cohort, held, other = {.record = NULL};
    const char *owner = cohort->owner;
    int status = read_row(db, owner, replacement->name, &held);

    (void)store;
    replacement->changed = false;
    if (status != STORE_OK) {
        return status;
    }
    cohort->created_ms = held.created_ms;
    replacement->changed = strcmp(held.digest, replacement->digest) != 0;
    store_cohort_clear(&held);
    if (replacement->changed) {
        return STORE_CONFLICT;
    }
    if (strcmp(replacement->name, cohort->name) != 0) {
        status = read_row(db, owner, cohort->name, &other);
        store_cohort_clear(&other);
        if (status != STORE_NOT_FOUND) {
            return status == STORE_OK ? STORE_CONFLICT : status;
        }
        status = STORE_OK;
    }
    status = store_execute(db, NULL, "DELETE FROM cohort WHERE owner = ? AND name = ?", "tt", owner,
                           replacement->name);
    return status == STORE_OK
               ? insert_cohort(db, cohort, owner, cohort->created_ms, &replacement->missing)
               : status;
}

int store_cohort_replace(struct store *store, const char *name, const char *digest,
                         struct store_cohort *cohort, bool *changed, size_t *missing)
{
    struct replacement replacement = {.cohort = cohort, .name = name, .digest = digest};
    int status;

    store_sha256_hex(cohort->digest, cohort->record, strlen(cohort->record));
    status = store_write(store, run_replace, &replacement);
    *changed = replacement.changed;
    *missing = replacement.missing;
    return status;
}

/* ---- As part of a batch ---------------------------------------------------------------------- */

struct batched {
    struct put put;
    struct store_cohort *cohort;
    bool *created;
    size_t *missing;
};

static int run_batched(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct batched *batched = write->argument;
    struct store_write put = {.argument = &batched->put};
    int status = run_put(store, db, &put);

    *batched->created = status == STORE_OK && batched->put.created;
    *batched->missing = batched->put.missing;
    batched->cohort->created_ms = batched->put.created_ms;
    return status;
}

static void clear_batched(struct store *store, void *argument)
{
    (void)store;
    free(argument);
}

int store_batch_add_cohort(struct store_batch *batch, struct store_cohort *cohort, bool *created,
                           size_t *missing)
{
    struct batched *batched = calloc(1, sizeof *batched);

    if (!batched) {
        return STORE_NOMEM;
    }
    store_sha256_hex(cohort->digest, cohort->record, strlen(cohort->record));
    batched->put = (struct put){.cohort = cohort, .now = store_now_ms()};
    batched->cohort = cohort;
    batched->created = created;
    batched->missing = missing;
    *created = false;
    *missing = 0;
    return store_batch_add(
        batch, STORE_OK, STORE_BATCH_REST,
        &(struct store_batch_item){run_batched, batched, clear_batched, batched});
}

/* ---- Removing -------------------------------------------------------------------------------- */

struct deletion {
    const char *owner, *name, *digest;
};

static int run_delete(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct deletion *deletion = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "DELETE FROM cohort WHERE owner = ?1 AND name = ?2 "
                               "AND coalesce(?3, digest) = digest",
                               "ttt", deletion->owner, deletion->name, deletion->digest);

    (void)store;
    return status == STORE_OK && changed == 0 ? STORE_NOT_FOUND : status;
}

int store_cohort_delete_as(struct store *store, const char *owner, const char *name,
                           const char *digest)
{
    struct deletion deletion = {.owner = owner ? owner : "", .name = name, .digest = digest};

    return store_write_freeing(store, run_delete, &deletion);
}

struct list {
    bool (*visit)(void *user, const struct store_cohort *cohort);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_cohort cohort;
    int status = from_row(row, &cohort);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &cohort);
        store_cohort_clear(&cohort);
    }
    return status;
}

/* Two owners may have one of the same name: a page ends with both. */
const struct store_listing store_cohort_listing = {
    .rows = "cohort AS listed",
    .one = "listed.owner = :owner",
    .all = "1",
    .id = "listed.name || '/' || listed.owner",
    .name = "listed.name",
    .mesh = "(listed.owner, listed.name) IN (SELECT owner, cohort FROM cohort_member "
            "WHERE mesh = :mesh)",
    .found = "listed.owner AS owner, listed.name AS name",
    .columns = "cohort.name, record, digest, members, created_ms, cohort.owner",
    .join = "JOIN cohort ON cohort.owner = page.owner AND cohort.name = page.name",
};

int store_cohort_list(struct store *store, const struct store_page *page,
                      bool (*visit)(void *user, const struct store_cohort *cohort), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_cohort_listing, page, list_row, &list);
}
