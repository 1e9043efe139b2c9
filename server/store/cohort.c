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
#include "store/cohort_list.h"
#include "store/digest.h"
#include "store/holdings.h"
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
                               "SELECT coalesce(mesh, surface) FROM cohort JOIN cohort_member AS "
                               "member ON member.list = cohort.list "
                               "WHERE owner = ? AND name = ? ORDER BY position",
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

/* What a change is decided by: the owner's cohort of that name without its text. */
static int read_state(sqlite3 *db, const char *owner, const char *name, struct store_cohort *held)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT digest, created_ms FROM cohort WHERE owner = ? AND name = ?",
                               "tt", owner, name);

    *held = (struct store_cohort){.record = NULL};
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        store_column_id(row, 0, held->digest, sizeof held->digest);
        held->created_ms = sqlite3_column_int64(row, 1);
    }
    sqlite3_finalize(row);
    return status;
}

struct put {
    const struct store_cohort *cohort;
    const struct store_list *list; /* with its members; NULL: they are to be written */
    int64_t now;
    bool created;
    size_t missing;
    int64_t created_ms;
};

/* Gives the members that are to be written, or those of a list that was filled, a list of the
   cohort. */
static int make_list(struct store *store, sqlite3 *db, const struct store_cohort *cohort,
                     const char *owner, const struct store_list *filled, int64_t *list,
                     size_t *missing)
{
    int status;

    if (filled) {
        *list = filled->number;
        return store_list_take(store, db, filled, cohort, owner, missing);
    }
    status = store_list_next(db, list);
    return status == STORE_OK
               ? store_list_add(db, *list, cohort, owner, 0, cohort->n_members, missing)
               : status;
}

static int insert_cohort(struct store *store, sqlite3 *db, struct put *put, const char *owner)
{
    const struct store_cohort *cohort = put->cohort;
    int64_t list = 0;
    int status = make_list(store, db, cohort, owner, put->list, &list, &put->missing);

    if (status == STORE_OK) {
        status = store_execute(
            db, NULL, "INSERT INTO cohort (list, " COLUMNS ") VALUES (?, ?, ?, ?, ?, ?, ?)",
            "itttiit", list, cohort->name, cohort->record, cohort->digest,
            (int64_t)cohort->n_members, put->now, owner);
    }
    return status == STORE_OK ? store_owner_check(db, owner, 0) : status;
}

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_cohort *cohort = put->cohort;
    const char *owner = cohort->view.owner ? cohort->view.owner : "";
    struct store_cohort held;
    int status = read_state(db, owner, cohort->name, &held);

    put->created = false;
    put->missing = 0;
    if (status == STORE_OK) {
        put->created_ms = held.created_ms;
        return strcmp(held.digest, cohort->digest) == 0 ? STORE_OK : STORE_CONFLICT;
    }
    if (status == STORE_NOT_FOUND) {
        status = store_owner_limit(db, owner, cohort->bytes_max);
    }
    if (status == STORE_OK) {
        status = insert_cohort(store, db, put, owner);
    }
    put->created = status == STORE_OK;
    put->created_ms = put->now;
    return status;
}

/* As migrations/0008_quotas.sql counts a cohort. */
static int64_t bytes_of(const struct store_cohort *cohort)
{
    return 1024 + 512 * (int64_t)cohort->n_members + (int64_t)strlen(cohort->record);
}

/* Whether a long list is worth to be filled: STORE_NOT_FOUND: it is; otherwise what the put would
   answer. */
static int foresee(struct store *store, struct put *put, const char *owner)
{
    const struct store_cohort *cohort = put->cohort;
    struct store_reader *reader = NULL;
    struct store_cohort held;
    int64_t bytes = 0, most = 0;
    int status = store_reader_take(store, &reader);

    if (status != STORE_OK) {
        return status;
    }
    status = read_state(reader->db, owner, cohort->name, &held);
    store_reader_return(store, reader);
    if (status == STORE_OK) {
        put->created_ms = held.created_ms;
        return strcmp(held.digest, cohort->digest) == 0 ? STORE_OK : STORE_CONFLICT;
    }
    if (status == STORE_NOT_FOUND && store_owner_bytes(store, owner, &bytes, &most) == STORE_OK) {
        most = cohort->bytes_max < 0 ? most : cohort->bytes_max;
        status = most > 0 && bytes > most - bytes_of(cohort) ? STORE_QUOTA : status;
    }
    return status;
}

int store_cohort_put(struct store *store, struct store_cohort *cohort, bool *created,
                     size_t *missing)
{
    const char *owner = cohort->view.owner ? cohort->view.owner : "";
    struct put put = {.cohort = cohort, .now = store_now_ms()};
    struct store_list list = {0};
    int status = STORE_NOT_FOUND;

    store_sha256_hex(cohort->digest, cohort->record, strlen(cohort->record));
    if (cohort->n_members > STORE_LIST_PIECE) {
        status = foresee(store, &put, owner);
        if (status == STORE_NOT_FOUND) {
            status = store_list_fill(store, cohort, owner, &list, &put.missing);
            put.list = status == STORE_OK ? &list : NULL;
        }
    }
    if (cohort->n_members <= STORE_LIST_PIECE || put.list) {
        status = store_write(store, run_put, &put);
    }
    if (put.list && !put.created) {
        store_list_abandon(store, &list);
    }
    *created = status == STORE_OK && put.created;
    *missing = put.missing;
    cohort->created_ms = put.created_ms;
    return status;
}

/* ---- Changing -------------------------------------------------------------------------------- */

struct replacement {
    const struct store_cohort *old;
    struct store_cohort *cohort;
    const struct store_list *list; /* as of struct put */
    bool same;                     /* members: their list stays */
    size_t missing;
    bool changed, left;
};

static bool same_members(const struct store_cohort *one, const struct store_cohort *other)
{
    size_t i = 0;

    while (i < one->n_members && i < other->n_members &&
           strcmp(one->members[i], other->members[i]) == 0) {
        i++;
    }
    return i == one->n_members && i == other->n_members;
}

/* Whether the cohort is still the one that was read, and its new name free. */
static int check_replaced(sqlite3 *db, struct replacement *replacement)
{
    const struct store_cohort *old = replacement->old;
    struct store_cohort *cohort = replacement->cohort, held, other;
    int status = read_state(db, cohort->owner, old->name, &held);

    replacement->changed = false;
    cohort->created_ms = 0;
    if (status != STORE_OK) {
        return status;
    }
    cohort->created_ms = held.created_ms;
    replacement->changed = strcmp(held.digest, old->digest) != 0;
    if (replacement->changed) {
        return STORE_CONFLICT;
    }
    if (strcmp(old->name, cohort->name) != 0) {
        status = read_state(db, cohort->owner, cohort->name, &other);
        status = status == STORE_OK ? STORE_CONFLICT : status;
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static int run_replace(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct replacement *replacement = write->argument;
    const struct store_cohort *cohort = replacement->cohort;
    const char *owner = cohort->owner;
    int64_t list = 0;
    int status = check_replaced(db, replacement);

    replacement->missing = 0;
    replacement->left = false;
    if (status == STORE_OK && !replacement->same) {
        status =
            make_list(store, db, cohort, owner, replacement->list, &list, &replacement->missing);
    }
    if (status == STORE_OK) {
        status = store_execute(db, NULL,
                               "UPDATE cohort SET name = ?3, digest = ?4, members = ?5, "
                               "record = ?6, list = iif(?7, ?7, list) "
                               "WHERE owner = ?1 AND name = ?2",
                               "ttttiti", owner, replacement->old->name, cohort->name,
                               cohort->digest, (int64_t)cohort->n_members, cohort->record, list);
    }
    if (status == STORE_OK) {
        status = store_owner_check(db, owner, 0);
    }
    return status == STORE_OK ? store_lists_empty(db, &replacement->left) : status;
}

/* Refuses before a long list is filled what the owner may not hold. */
static int foresee_replaced(struct store *store, const struct replacement *replacement)
{
    int64_t more = bytes_of(replacement->cohort) - bytes_of(replacement->old), bytes, most;
    int status = store_owner_bytes(store, replacement->cohort->owner, &bytes, &most);

    return status == STORE_OK && most > 0 && bytes > most - more ? STORE_QUOTA : status;
}

int store_cohort_replace(struct store *store, const struct store_cohort *old,
                         struct store_cohort *cohort, bool *changed, size_t *missing)
{
    struct replacement replacement = {
        .old = old, .cohort = cohort, .same = same_members(old, cohort)};
    struct store_list list = {0};
    int status = STORE_OK;

    store_sha256_hex(cohort->digest, cohort->record, strlen(cohort->record));
    if (!replacement.same && cohort->n_members > STORE_LIST_PIECE) {
        cohort->created_ms = old->created_ms;
        status = foresee_replaced(store, &replacement);
        if (status == STORE_OK) {
            status = store_list_fill(store, cohort, cohort->owner, &list, &replacement.missing);
            replacement.list = status == STORE_OK ? &list : NULL;
        }
    }
    if (status == STORE_OK) {
        status = store_write(store, run_replace, &replacement);
        if (status != STORE_OK && replacement.list) {
            store_list_abandon(store, &list);
        }
    }
    if (status == STORE_OK && replacement.left) {
        store_lists_sweep(store);
    }
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
    bool left;
};

static int run_delete(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct deletion *deletion = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "DELETE FROM cohort WHERE owner = ?1 AND name = ?2 "
                               "AND coalesce(?3, digest) = digest",
                               "ttt", deletion->owner, deletion->name, deletion->digest);

    (void)store;
    if (status == STORE_OK && changed == 0) {
        return STORE_NOT_FOUND;
    }
    return status == STORE_OK ? store_lists_empty(db, &deletion->left) : status;
}

int store_cohort_delete_as(struct store *store, const char *owner, const char *name,
                           const char *digest)
{
    struct deletion deletion = {.owner = owner ? owner : "", .name = name, .digest = digest};
    int status = store_write_freeing(store, run_delete, &deletion);

    if (status == STORE_OK && deletion.left) {
        store_lists_sweep(store);
    }
    return status;
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
    .mesh = "listed.list IN (SELECT list FROM cohort_member WHERE mesh = :mesh)",
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
