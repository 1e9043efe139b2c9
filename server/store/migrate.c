/*
 * migrate.c - whose database is it, how old is it, and the way to the newest version.
 *
 * application_id in the header of the file says that the database is ours, user_version the
 * number of the last migration that ran. The migrations are the files migrations/NNNN_*.sql,
 * numbered from 1 without gaps, which the build puts into the binary. Each runs in one
 * transaction together with the new user_version: after a crash the database is at one version or
 * the next, never between.
 */
#include "embedded.h"
#include "store/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char folder[] = "migrations/";

/* The migration with this number, or NULL. */
static const struct embedded_file *migration(int64_t number)
{
    for (const struct embedded_file *file = embedded_files; file->path; file++) {
        if (strncmp(file->path, folder, sizeof folder - 1) == 0 &&
            strtoll(file->path + sizeof folder - 1, NULL, 10) == number) {
            return file;
        }
    }
    return NULL;
}

/* A database without tables and without the id of another application is new. */
int store_identify(sqlite3 *db, int64_t *version, char *message, size_t message_size)
{
    int64_t application = 0, tables = 0;
    int status = store_scalar(db, &application, "PRAGMA application_id");

    if (status == STORE_OK) {
        status = store_scalar(db, version, "PRAGMA user_version");
    }
    if (status == STORE_OK) {
        status = store_scalar(db, &tables, "SELECT count(*) FROM sqlite_schema");
    }
    if (status != STORE_OK) {
        snprintf(message, message_size, "the database cannot be read: %s", sqlite3_errmsg(db));
        return status;
    }
    if (application != STORE_APPLICATION_ID && (application != 0 || *version != 0 || tables != 0)) {
        snprintf(message, message_size, "the database belongs to another application");
        return STORE_CORRUPT;
    }
    if (*version < 0 || (*version > 0 && !migration(*version))) {
        snprintf(
            message, message_size,
            "the database has version %lld, which this daemon does not know: it was written by "
            "a newer one",
            (long long)*version);
        return *version < 0 ? STORE_CORRUPT : STORE_NEWER;
    }
    return STORE_OK;
}

/* Runs one migration and numbers the database, in one transaction. */
static int apply(sqlite3 *db, const struct embedded_file *file, int64_t number)
{
    char header[96];
    int rc = sqlite3_exec(db, "BEGIN IMMEDIATE", NULL, NULL, NULL);

    snprintf(header, sizeof header, "PRAGMA application_id = %d; PRAGMA user_version = %lld",
             STORE_APPLICATION_ID, (long long)number);
    if (rc == SQLITE_OK) {
        rc = sqlite3_exec(db, (const char *)file->bytes, NULL, NULL, NULL);
    }
    if (rc == SQLITE_OK) {
        rc = sqlite3_exec(db, header, NULL, NULL, NULL);
    }
    if (rc == SQLITE_OK) {
        rc = sqlite3_exec(db, "COMMIT", NULL, NULL, NULL);
    }
    return store_map(db, rc);
}

int store_migrate(sqlite3 *db, char *message, size_t message_size)
{
    int64_t version = 0;
    int status = store_identify(db, &version, message, message_size);

    if (status != STORE_OK) {
        return status;
    }
    status = store_map(db, sqlite3_exec(db, "PRAGMA journal_mode = WAL", NULL, NULL, NULL));
    if (status != STORE_OK) {
        snprintf(message, message_size, "the database cannot be prepared: %s", sqlite3_errmsg(db));
        return status;
    }
    for (const struct embedded_file *file; (file = migration(version + 1)) != NULL; version++) {
        status = apply(db, file, version + 1);
        if (status != STORE_OK) {
            snprintf(message, message_size, "%s failed: %s", file->path, sqlite3_errmsg(db));
            if (!sqlite3_get_autocommit(db)) {
                sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
            }
            return status;
        }
    }
    return STORE_OK;
}
