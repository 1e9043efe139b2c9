/*
 * encoding.c - encodings of meshes that jobs have made, for the jobs after them.
 *
 * They are a cache: what is missing, damaged or of another build is made again, and the oldest give
 * way once all together take more than a limit. That is looked after at every SWEEP_EVERYth write,
 * so that they pass it by so many at most.
 */
#include "store/internal.h"
#include "store/digest.h"
#include "store/encoding.h"
#include "store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SWEEP_EVERY 64

struct put {
    const char *name, *mesh, *sphere;
    const void *value;
    size_t size;
    int64_t limit;
};

/* The oldest go until those that stay take the limit at most. */
static int sweep(sqlite3 *db, int64_t limit)
{
    return store_execute(db, NULL,
                         "DELETE FROM encoding WHERE name IN (SELECT name FROM (SELECT name, "
                         "sum(length(value)) OVER (ORDER BY created_ms DESC, name) AS total "
                         "FROM encoding) WHERE total > ?)",
                         "i", limit);
}

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct put *put = write->argument;
    char checksum[65];
    int status;

    store_sha256_hex(checksum, put->value, put->size);
    status = store_execute(db, NULL,
                           "INSERT INTO encoding (name, mesh, sphere, checksum, value, created_ms) "
                           "VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (name) DO UPDATE SET "
                           "checksum = excluded.checksum, value = excluded.value",
                           "ttttbi", put->name, put->mesh, put->sphere[0] ? put->sphere : NULL,
                           checksum, put->value, put->size, store_now_ms());
    if (status == STORE_OK && store->encodings++ % SWEEP_EVERY == 0) {
        status = sweep(db, put->limit);
    }
    return status;
}

int store_encoding_put(struct store *store, const char *name, const char *mesh, const char *sphere,
                       const void *value, size_t size, int64_t limit)
{
    struct put put = {
        .name = name, .mesh = mesh, .sphere = sphere, .value = value, .size = size, .limit = limit};

    return (int64_t)size > limit ? STORE_OK : store_write(store, run_put, &put);
}

static int run_drop(struct store *store, sqlite3 *db, struct store_write *write)
{
    const char *mesh = write->argument;

    (void)store;
    return store_execute(db, NULL, "DELETE FROM encoding WHERE mesh = ? OR sphere = ?", "tt", mesh,
                         mesh);
}

int store_encoding_drop(struct store *store, const char *mesh)
{
    char id[STORE_ID_MAX];

    (void)snprintf(id, sizeof id, "%s", mesh);
    return store_write_freeing(store, run_drop, id);
}

/* The value of a row, allocated; STORE_NOT_FOUND where it does not match its checksum. */
static int read_row(sqlite3_stmt *row, unsigned char **value, size_t *size)
{
    const unsigned char *checksum = sqlite3_column_text(row, 0);
    const void *bytes = sqlite3_column_blob(row, 1);
    size_t n = (size_t)sqlite3_column_bytes(row, 1);
    char actual[65];

    if (!checksum || !bytes) {
        return STORE_NOT_FOUND;
    }
    store_sha256_hex(actual, bytes, n);
    if (strcmp(actual, (const char *)checksum) != 0) {
        return STORE_NOT_FOUND;
    }
    *value = malloc(n);
    if (!*value) {
        return STORE_NOMEM;
    }
    memcpy(*value, bytes, n);
    *size = n;
    return STORE_OK;
}

int store_encoding_get(struct store *store, const char *name, unsigned char **value, size_t *size)
{
    struct store_query query;
    int status = store_query_first(
        &query, store, "SELECT checksum, value FROM encoding WHERE name = ?", "t", name);

    *value = NULL;
    *size = 0;
    if (status == STORE_OK) {
        status = read_row(query.row, value, size);
    }
    store_query_close(&query);
    return status;
}
