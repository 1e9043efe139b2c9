/*
 * cohort_list.c - the lists of members that cohorts have: filled before their cohort is there, and
 * emptied after it has gone.
 *
 * A list of 100,000 members takes seconds, and every other write would wait for them. So a long one
 * is written in pieces, each a transaction; the last transaction, which makes the cohort, only
 * names the list. Nobody sees a list without a cohort: it stands in loose_list, and a list that a
 * crash leaves there is emptied by the next start. The pieces need not reach the disk by
 * themselves: that last commit brings all of them there.
 *
 * What a list names is not held before the cohort is there: a mesh or surface that is erased
 * meanwhile takes its rows in loose lists along. Where anything was erased since the list was
 * begun, the last transaction looks at all of its members once more.
 */
#include "store/cohort_list.h"

#include "store/internal.h"

#include <string.h>

/* ---- Filling --------------------------------------------------------------------------------- */

#define ADD_MEMBER(kind)                                                      \
    "INSERT INTO cohort_member (list, position, " kind ") SELECT ?1, ?2, id " \
    "FROM " kind " WHERE id = ?3 AND (?4 OR EXISTS "                          \
    "(SELECT 1 FROM owned WHERE owned.owner = ?5 AND owned.id = ?3))"

/* Adds the member's row where the mesh or surface exists and its owner may name it. The statement
   has all but the member bound. */
static int add_member(sqlite3 *db, sqlite3_stmt *add, const char *id, size_t position)
{
    int status;

    if (sqlite3_reset(add) != SQLITE_OK ||
        sqlite3_bind_int64(add, 2, (sqlite3_int64)position) != SQLITE_OK ||
        sqlite3_bind_text(add, 3, id, -1, SQLITE_STATIC) != SQLITE_OK) {
        return store_map(db, sqlite3_errcode(db));
    }
    status = store_step(db, add);
    return status == STORE_NOT_FOUND && sqlite3_changes(db) > 0 ? STORE_OK : status;
}

int store_list_next(sqlite3 *db, int64_t *list)
{
    return store_scalar(db, list,
                        "SELECT 1 + max((SELECT coalesce(max(list), 0) FROM cohort), "
                        "(SELECT coalesce(max(list), 0) FROM loose_list))");
}

int store_list_add(sqlite3 *db, int64_t list, const struct store_cohort *cohort, const char *owner,
                   size_t first, size_t count, size_t *missing)
{
    const int64_t all = cohort->view.all;
    sqlite3_stmt *add[2] = {NULL};
    int status =
        store_prepare(db, &add[0], ADD_MEMBER("mesh"), "iitit", list, INT64_C(0), "", all, owner);

    if (status == STORE_OK) {
        status = store_prepare(db, &add[1], ADD_MEMBER("surface"), "iitit", list, INT64_C(0), "",
                               all, owner);
    }
    for (size_t i = first; status == STORE_OK && i < first + count; i++) {
        bool surface = strncmp(cohort->members[i], "surf-", 5) == 0;

        *missing = i;
        status = add_member(db, add[surface], cohort->members[i], i);
    }
    sqlite3_finalize(add[0]);
    sqlite3_finalize(add[1]);
    return status;
}

struct piece {
    const struct store_cohort *cohort;
    const char *owner;
    size_t first, count, missing;
    struct store_list *list;
};

static int run_piece(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct piece *piece = write->argument;
    struct store_list *list = piece->list;
    int status = STORE_OK;

    if (piece->first == 0) {
        list->erasures = store->erasures;
        status = store_list_next(db, &list->number);
        if (status == STORE_OK) {
            status = store_execute(db, NULL, "INSERT INTO loose_list (list, filling) VALUES (?, 1)",
                                   "i", list->number);
        }
    }
    return status == STORE_OK ? store_list_add(db, list->number, piece->cohort, piece->owner,
                                               piece->first, piece->count, &piece->missing)
                              : status;
}

int store_list_fill(struct store *store, const struct store_cohort *cohort, const char *owner,
                    struct store_list *list, size_t *missing)
{
    struct piece piece = {.cohort = cohort, .owner = owner, .list = list};
    bool begun = false;
    int status = STORE_OK;

    while (status == STORE_OK && piece.first < cohort->n_members) {
        size_t left = cohort->n_members - piece.first;

        piece.count = left < STORE_LIST_PIECE ? left : STORE_LIST_PIECE;
        status = store_write_relaxed(store, run_piece, &piece);
        begun = begun || status == STORE_OK;
        piece.first += piece.count;
    }
    *missing = piece.missing;
    if (status != STORE_OK && begun) {
        store_list_abandon(store, list);
    }
    return status;
}

/* The first member that was erased since, or that is no longer the owner's. */
static int find_missing(sqlite3 *db, const struct store_list *list,
                        const struct store_cohort *cohort, const char *owner, size_t *missing)
{
    sqlite3_stmt *rows = NULL;
    size_t n = 0;
    int status = store_prepare(db, &rows,
                               "SELECT position FROM cohort_member WHERE list = ?1 AND (?2 OR "
                               "EXISTS (SELECT 1 FROM owned WHERE owned.owner = ?3 AND "
                               "owned.id = coalesce(mesh, surface))) ORDER BY position",
                               "iit", list->number, (int64_t)cohort->view.all, owner);

    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK &&
           sqlite3_column_int64(rows, 0) == (sqlite3_int64)n) {
        n++;
    }
    sqlite3_finalize(rows);
    *missing = n;
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        return status;
    }
    return n == cohort->n_members ? STORE_OK : STORE_NOT_FOUND;
}

int store_list_take(struct store *store, sqlite3 *db, const struct store_list *list,
                    const struct store_cohort *cohort, const char *owner, size_t *missing)
{
    int status = list->erasures == store->erasures ? STORE_OK
                                                   : find_missing(db, list, cohort, owner, missing);

    return status == STORE_OK
               ? store_execute(db, NULL, "DELETE FROM loose_list WHERE list = ?", "i", list->number)
               : status;
}

/* ---- Emptying -------------------------------------------------------------------------------- */

int store_lists_empty(sqlite3 *db, bool *left)
{
    int64_t room = STORE_LIST_PIECE, list = 0;
    int status = STORE_OK;

    while (room > 0 && (status = store_scalar(db, &list,
                                              "SELECT list FROM loose_list WHERE filling = 0 "
                                              "LIMIT 1")) == STORE_OK) {
        size_t changed = 0;

        status = store_execute(db, &changed,
                               "DELETE FROM cohort_member WHERE list = ?1 AND position < coalesce("
                               "(SELECT position FROM cohort_member WHERE list = ?1 "
                               "ORDER BY position LIMIT 1 OFFSET ?2), 0x7fffffffffffffff)",
                               "ii", list, room);
        if (status == STORE_OK && (int64_t)changed < room) {
            status = store_execute(db, NULL, "DELETE FROM loose_list WHERE list = ?", "i", list);
        }
        if (status != STORE_OK) {
            break;
        }
        room -= (int64_t)changed;
    }
    *left = status == STORE_OK;
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static int run_empty(struct store *store, sqlite3 *db, struct store_write *write)
{
    (void)store;
    return store_lists_empty(db, write->argument);
}

void store_lists_sweep(struct store *store)
{
    bool left = true;

    while (left && store_write_freeing(store, run_empty, &left) == STORE_OK) {
    }
}

static int run_abandon(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct store_list *list = write->argument;

    (void)store;
    return store_execute(db, NULL, "UPDATE loose_list SET filling = 0 WHERE list = ?", "i",
                         list->number);
}

void store_list_abandon(struct store *store, const struct store_list *list)
{
    struct store_list of = *list;

    if (store_write_freeing(store, run_abandon, &of) == STORE_OK) {
        store_lists_sweep(store);
    }
}

static int run_abandon_all(struct store *store, sqlite3 *db, struct store_write *write)
{
    (void)store;
    (void)write;
    return store_execute(db, NULL, "UPDATE loose_list SET filling = 0", "");
}

void store_lists_recover(struct store *store)
{
    struct store_query query;
    int status = store_query_first(&query, store, "SELECT 1 FROM loose_list LIMIT 1", "");

    store_query_close(&query);
    if (status == STORE_OK && store_write_freeing(store, run_abandon_all, NULL) == STORE_OK) {
        store_lists_sweep(store);
    }
}
