/*
 * owner.c - whom content belongs to.
 *
 * Meshes, surfaces and models are stored once, under the hash of their content; a row of `owned`
 * for each owner says that it is theirs too, with the name, record and time that they gave it. So
 * an owner never sees what another called the same bytes, nor whether another has them. Cohorts
 * and jobs have one owner each, in their own rows.
 *
 * What an owner holds in bytes is kept by triggers (migrations/0004_owners.sql, 0008_quotas.sql),
 * and so is exact in every transaction: the limit is asked for in the one that adds. What the owner
 * may hold comes with each request that adds, and is kept for the jobs that run later.
 */
#include "store/internal.h"

#include "owner.h"
#include "store/holdings.h"
#include "store/token_file.h"

#include <string.h>
#include <unistd.h>

const char *store_owner_name(const struct store_owner *owner)
{
    return owner->name ? owner->name : "";
}

/* On the writer thread: the owner has a row. */
static int add_row(sqlite3 *db, const char *name)
{
    return store_execute(db, NULL, "INSERT INTO owner (name) VALUES (?) ON CONFLICT DO NOTHING",
                         "t", name);
}

/* What the owner holds, and what it may hold; 0, 0 for one that is not known. */
static int read_bytes(sqlite3 *db, const char *name, int64_t *bytes, int64_t *most)
{
    sqlite3_stmt *row = NULL;
    int status =
        store_prepare(db, &row, "SELECT bytes, bytes_max FROM owner WHERE name = ?", "t", name);

    *bytes = *most = 0;
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        *bytes = sqlite3_column_int64(row, 0);
        *most = sqlite3_column_int64(row, 1);
    }
    sqlite3_finalize(row);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int store_owner_limit(sqlite3 *db, const char *name, int64_t bytes_max)
{
    int status = add_row(db, name);

    return status != STORE_OK || bytes_max < 0
               ? status
               : store_execute(db, NULL,
                               "UPDATE owner SET bytes_max = ?2 WHERE name = ?1 "
                               "AND bytes_max <> ?2",
                               "ti", name, bytes_max);
}

int store_owner_check(sqlite3 *db, const char *name, int64_t more)
{
    int64_t bytes, most;
    int status = read_bytes(db, name, &bytes, &most);

    return status == STORE_OK && most > 0 && bytes > most - more ? STORE_QUOTA : status;
}

int store_owner_check_job(sqlite3 *db, const char *job, int64_t more)
{
    char owner[STORE_OWNER_MAX];
    int status = store_text(db, owner, sizeof owner, "SELECT owner FROM job WHERE id = ?", job);

    return status == STORE_OK ? store_owner_check(db, owner, more)
                              : (status == STORE_NOT_FOUND ? STORE_OK : status);
}

static size_t length_of(const char *text)
{
    return text ? strlen(text) : 0;
}

/* What it was made of. */
static int add_needs(sqlite3 *db, const char *owner, const struct store_holding *holding)
{
    struct store_ids ids = {0};
    int status = store_ids_find(&ids, holding->record);

    for (size_t i = 0; i < ids.count && status == STORE_OK; i++) {
        if (!holding->alone || strncmp(ids.list[i], "job-", 4) != 0) {
            status = store_need_add(db, owner, holding->id, ids.list[i], false);
        }
    }
    if (status == STORE_OK && holding->also) {
        status = store_need_add(db, owner, holding->id, holding->also, false);
    }
    store_ids_clear(&ids);
    return status;
}

int store_owner_take(sqlite3 *db, const struct store_owner *owner,
                     const struct store_holding *holding, bool *taken)
{
    const char *name = store_owner_name(owner);
    size_t changed = 0;
    int64_t bytes = STORE_ROW_BYTES + holding->bytes +
                    (int64_t)(length_of(holding->name) + length_of(holding->record));
    int status = store_owner_limit(db, name, owner->bytes_max);

    /* The first to have it describes it in the content's own row. */
    if (status == STORE_OK) {
        status = store_execute(
            db, &changed,
            "INSERT INTO owned (owner, id, kind, name, record, bytes, created_ms, first, process, "
            "cohort) SELECT ?1, ?2, ?3, coalesce(?4, ''), iif(other, ?5, NULL), ?6, ?7, NOT other, "
            "coalesce(json_extract(told, '$.source.process'), "
            "json_extract(told, '$.madeFrom.process'), json_extract(told, '$.process'), ''), "
            "coalesce(json_extract(told, '$.madeFrom.cohort'), '') "
            "FROM (SELECT EXISTS (SELECT 1 FROM owned WHERE id = ?2) AS other, "
            "iif(json_valid(?5), ?5, '{}') AS told) WHERE true ON CONFLICT DO NOTHING",
            "tttttii", name, holding->id, holding->kind, holding->name, holding->record, bytes,
            holding->now);
    }
    *taken = changed > 0;
    if (status == STORE_OK && changed > 0) {
        status = add_needs(db, name, holding);
    }
    return status == STORE_OK && changed > 0 ? store_owner_check(db, name, 0) : status;
}

int store_owners_of(struct store *store, const char *sql, const char *key,
                    char (*owners)[STORE_OWNER_MAX], size_t most, size_t *count)
{
    struct store_query query;
    int status = store_query_open(&query, store, sql, "t", key);

    *count = 0;
    while (status == STORE_OK && (status = store_query_next(&query)) == STORE_OK) {
        if (*count < most) {
            store_column_id(query.row, 0, owners[*count], STORE_OWNER_MAX);
        }
        ++*count;
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int store_owner_has(struct store *store, const char *owner, const char *id)
{
    bool job = strncmp(id, "job-", 4) == 0;
    struct store_query query;
    int status = store_query_first(&query, store,
                                   job ? "SELECT 1 FROM job WHERE owner = ? AND id = ?"
                                       : "SELECT 1 FROM owned WHERE owner = ? AND id = ?",
                                   "tt", owner ? owner : "", id);

    store_query_close(&query);
    return status;
}

int store_owner_bytes(struct store *store, const char *owner, int64_t *bytes, int64_t *most)
{
    struct store_reader *reader = NULL;
    int64_t unused = 0;
    int status = store_reader_take(store, &reader);

    *bytes = 0;
    if (most) {
        *most = 0;
    }
    if (status == STORE_OK) {
        status = read_bytes(reader->db, owner ? owner : "", bytes, most ? most : &unused);
        store_reader_return(store, reader);
    }
    return status;
}

/* ---- When tokens were used ------------------------------------------------------------------- */

struct use {
    const char *token;
    int64_t now;
};

static int run_use(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct use *use = write->argument;

    (void)store;
    return store_execute(db, NULL,
                         "INSERT INTO token_use (token, last_ms) VALUES (?, ?) "
                         "ON CONFLICT (token) DO UPDATE SET last_ms = excluded.last_ms",
                         "ti", use->token, use->now);
}

int store_token_used(struct store *store, const char *token, int64_t when_ms)
{
    struct use use = {.token = token, .now = when_ms};

    return store_write(store, run_use, &use);
}

void store_tokens_uses(const char *directory, struct store_tokens *tokens)
{
    char path[STORE_TOKEN_PATH];
    sqlite3_stmt *rows = NULL;
    sqlite3 *db = NULL;
    int status = store_token_path(path, directory, STORE_DATABASE_NAME);

    if (status == STORE_OK && access(path, R_OK) == 0) {
        status = store_connect_reader(path, &db);
    }
    if (!db) {
        return;
    }
    status = store_prepare(db, &rows, "SELECT token, last_ms FROM token_use", "");
    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK) {
        char id[STORE_TOKEN_ID_MAX];

        store_column_id(rows, 0, id, sizeof id);
        for (size_t i = 0; i < tokens->n; i++) {
            if (strcmp(tokens->list[i].id, id) == 0) {
                tokens->list[i].last_ms = sqlite3_column_int64(rows, 1);
            }
        }
    }
    sqlite3_finalize(rows);
    sqlite3_close(db);
}
