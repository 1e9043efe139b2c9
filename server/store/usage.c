/*
 * usage.c - what monitoring asks of the store: its sizes, the room that is left, the jobs that have
 * not ended, and whether a write gets through.
 *
 * The log's length is that of its file: SQLite starts it over after a checkpoint without cutting
 * it. The size of the blobs is the sum over their rows, so that files without a row, which the next
 * start removes, do not count.
 */
#include "store/internal.h"
#include "store/prepared.h"
#include "store/usage.h"

#include <stdio.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

static int64_t file_size(const char *path)
{
    struct stat about;

    return stat(path, &about) == 0 ? (int64_t)about.st_size : 0;
}

static int64_t log_size(const struct store *store)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s-wal", store->database);

    return length > 0 && (size_t)length < sizeof path ? file_size(path) : 0;
}

int store_free_bytes(struct store *store, int64_t *bytes)
{
    struct statvfs system;

    if (statvfs(store->directory, &system) != 0) {
        return STORE_IO;
    }
    *bytes = (int64_t)system.f_bavail * (int64_t)system.f_frsize;
    return STORE_OK;
}

int store_usage(struct store *store, struct store_usage *usage)
{
    struct store_reader *reader;
    int status = store_reader_take(store, &reader);

    *usage = (struct store_usage){0};
    if (status != STORE_OK) {
        return status;
    }
    status = store_scalar(reader->db, &usage->blobs,
                          "SELECT COALESCE(SUM(size), 0) FROM blob WHERE bytes IS NULL");
    store_reader_return(store, reader);
    usage->database = file_size(store->database);
    usage->log = log_size(store);
    usage->prepared = store_prepared_bytes(store);
    return status == STORE_OK ? store_free_bytes(store, &usage->free) : status;
}

int store_job_load(struct store *store, void (*visit)(void *user, const struct store_load *load),
                   void *user)
{
    struct store_query query;
    int status =
        store_query_open(&query, store,
                         "SELECT process, status, COUNT(*), MIN(created_ms) FROM job "
                         "WHERE status IN ('accepted', 'running') GROUP BY process, status",
                         "");

    while (status == STORE_OK && (status = store_query_next(&query)) == STORE_OK) {
        const struct store_load load = {
            .process = (const char *)sqlite3_column_text(query.row, 0),
            .status = (const char *)sqlite3_column_text(query.row, 1),
            .count = (size_t)sqlite3_column_int64(query.row, 2),
            .oldest_ms = sqlite3_column_int64(query.row, 3),
        };

        visit(user, &load);
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* Writes the page that holds the schema's version, as it is: a commit like any other, with its
   fsync, that changes nothing. */
static int run_probe(struct store *store, sqlite3 *db, struct store_write *write)
{
    int64_t version = 0;
    char sql[64];
    int status = store_scalar(db, &version, "PRAGMA user_version");

    (void)store;
    (void)write;
    (void)snprintf(sql, sizeof sql, "PRAGMA user_version = %lld", (long long)version);
    return status == STORE_OK ? store_execute(db, NULL, sql, "") : status;
}

int store_probe(struct store *store, int64_t wait_ms, bool *answered)
{
    return store_write_probe(store, run_probe, wait_ms, answered);
}
