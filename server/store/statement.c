/*
 * statement.c - the few lines around SQLite's C interface that every query needs: status codes,
 * prepared statements with their parameters, steps, queries of readers, and copies of columns.
 *
 * Statements are prepared for each use. That costs some 20 microseconds, against the milliseconds
 * of a synced commit and the network. Those that come with every task of a worker, hundreds a
 * second, the writer keeps (store_execute_kept).
 */
#include "store/internal.h"
#include "store/files.h"

#include <assert.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    int rc; /* primary result code */
    int status;
} codes[] = {
    {SQLITE_OK, STORE_OK},           {SQLITE_ROW, STORE_OK},
    {SQLITE_DONE, STORE_OK},         {SQLITE_FULL, STORE_FULL},
    {SQLITE_CORRUPT, STORE_CORRUPT}, {SQLITE_NOTADB, STORE_CORRUPT},
    {SQLITE_NOMEM, STORE_NOMEM},     {SQLITE_CONSTRAINT, STORE_CONFLICT},
};

int store_map(sqlite3 *db, int rc)
{
    for (size_t i = 0; i < sizeof codes / sizeof codes[0]; i++) {
        if ((rc & 0xff) == codes[i].rc) {
            return codes[i].status;
        }
    }
    if (rc == SQLITE_IOERR_NOMEM) {
        return STORE_NOMEM;
    }
    return db && ((rc & 0xff) == SQLITE_IOERR || (rc & 0xff) == SQLITE_CANTOPEN)
               ? store_map_errno(sqlite3_system_errno(db))
               : STORE_IO;
}

/* Binds the parameters as kinds says; returns SQLite's code. */
static int bind_all(sqlite3_stmt *statement, const char *kinds, va_list arguments)
{
    int rc = SQLITE_OK;

    for (int i = 1; rc == SQLITE_OK && kinds[i - 1]; i++) {
        if (kinds[i - 1] == 't') {
            rc =
                sqlite3_bind_text(statement, i, va_arg(arguments, const char *), -1, SQLITE_STATIC);
        } else if (kinds[i - 1] == 'i') {
            rc = sqlite3_bind_int64(statement, i, va_arg(arguments, int64_t));
        } else if (kinds[i - 1] == 'd') {
            rc = sqlite3_bind_double(statement, i, va_arg(arguments, double));
        } else {
            const void *bytes = va_arg(arguments, const void *);
            size_t size = va_arg(arguments, size_t);

            assert(kinds[i - 1] == 'b');
            /* A null pointer would bind NULL, where an empty blob is meant. */
            rc = sqlite3_bind_blob64(statement, i, bytes ? bytes : "", size, SQLITE_STATIC);
        }
    }
    return rc;
}

static int prepare(sqlite3 *db, sqlite3_stmt **out, const char *sql, const char *kinds,
                   va_list arguments)
{
    int rc = sqlite3_prepare_v2(db, sql, -1, out, NULL);

    if (rc == SQLITE_OK) {
        assert((size_t)sqlite3_bind_parameter_count(*out) == strlen(kinds));
        rc = bind_all(*out, kinds, arguments);
    }
    if (rc != SQLITE_OK) {
        sqlite3_finalize(*out);
        *out = NULL;
    }
    return store_map(db, rc);
}

int store_prepare(sqlite3 *db, sqlite3_stmt **out, const char *sql, const char *kinds, ...)
{
    va_list arguments;
    int status;

    va_start(arguments, kinds);
    status = prepare(db, out, sql, kinds, arguments);
    va_end(arguments);
    return status;
}

int store_step(sqlite3 *db, sqlite3_stmt *statement)
{
    int rc = sqlite3_step(statement);

    return rc == SQLITE_DONE ? STORE_NOT_FOUND : store_map(db, rc);
}

int store_execute(sqlite3 *db, size_t *changed, const char *sql, const char *kinds, ...)
{
    sqlite3_stmt *statement = NULL;
    va_list arguments;
    int status;

    va_start(arguments, kinds);
    status = prepare(db, &statement, sql, kinds, arguments);
    va_end(arguments);
    while (status == STORE_OK) {
        status = store_step(db, statement);
    }
    if (status == STORE_NOT_FOUND) {
        status = STORE_OK;
        if (changed) {
            *changed = (size_t)sqlite3_changes(db);
        }
    }
    sqlite3_finalize(statement);
    return status;
}

/* The kept statement, or a new one that is to be finalized; NULL with SQLite's code. */
static sqlite3_stmt *find_kept(struct store_writer *writer, const char *sql, int *rc, bool *kept)
{
    sqlite3_stmt *statement = NULL;
    size_t i = 0;

    *rc = SQLITE_OK;
    *kept = true;
    while (i < STORE_KEPT_MAX && writer->kept[i].statement && writer->kept[i].sql != sql) {
        i++;
    }
    if (i < STORE_KEPT_MAX && writer->kept[i].statement) {
        return writer->kept[i].statement;
    }
    *rc = sqlite3_prepare_v3(writer->db, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, NULL);
    *kept = i < STORE_KEPT_MAX && statement;
    if (*kept) {
        writer->kept[i].sql = sql;
        writer->kept[i].statement = statement;
    }
    return statement;
}

int store_execute_kept(struct store *store, size_t *changed, const char *sql, const char *kinds,
                       ...)
{
    sqlite3 *db = store->writer.db;
    bool kept;
    int rc, status;
    sqlite3_stmt *statement = find_kept(&store->writer, sql, &rc, &kept);
    va_list arguments;

    if (rc == SQLITE_OK) {
        va_start(arguments, kinds);
        rc = bind_all(statement, kinds, arguments);
        va_end(arguments);
    }
    status = store_map(db, rc);
    while (status == STORE_OK) {
        status = store_step(db, statement);
    }
    if (status == STORE_NOT_FOUND) {
        status = STORE_OK;
        if (changed) {
            *changed = (size_t)sqlite3_changes(db);
        }
    }
    if (kept) { /* what was bound is gone when the caller returns */
        (void)sqlite3_reset(statement);
        (void)sqlite3_clear_bindings(statement);
    } else {
        sqlite3_finalize(statement);
    }
    return status;
}

int store_scalar(sqlite3 *db, int64_t *value, const char *sql)
{
    sqlite3_stmt *statement = NULL;
    int status = store_prepare(db, &statement, sql, "");

    if (status == STORE_OK) {
        status = store_step(db, statement);
    }
    if (status == STORE_OK) {
        *value = sqlite3_column_int64(statement, 0);
    }
    sqlite3_finalize(statement);
    return status;
}

int store_text(sqlite3 *db, char *text, size_t size, const char *sql, const char *key)
{
    sqlite3_stmt *statement = NULL;
    int status = store_prepare(db, &statement, sql, "t", key);

    if (status == STORE_OK) {
        status = store_step(db, statement);
    }
    if (status == STORE_OK) {
        store_column_id(statement, 0, text, size);
    }
    sqlite3_finalize(statement);
    return status;
}

/* ---- Queries --------------------------------------------------------------------------------- */

static int open_query(struct store_query *query, struct store *store, const char *sql,
                      const char *kinds, va_list arguments)
{
    int status;

    *query = (struct store_query){.store = store};
    status = store_reader_take(store, &query->reader);
    return status == STORE_OK ? prepare(query->reader->db, &query->row, sql, kinds, arguments)
                              : status;
}

int store_query_open(struct store_query *query, struct store *store, const char *sql,
                     const char *kinds, ...)
{
    va_list arguments;
    int status;

    va_start(arguments, kinds);
    status = open_query(query, store, sql, kinds, arguments);
    va_end(arguments);
    return status;
}

int store_query_first(struct store_query *query, struct store *store, const char *sql,
                      const char *kinds, ...)
{
    va_list arguments;
    int status;

    va_start(arguments, kinds);
    status = open_query(query, store, sql, kinds, arguments);
    va_end(arguments);
    return status == STORE_OK ? store_query_next(query) : status;
}

int store_query_next(struct store_query *query)
{
    return store_step(query->reader->db, query->row);
}

void store_query_close(struct store_query *query)
{
    sqlite3_finalize(query->row);
    if (query->reader) {
        store_reader_return(query->store, query->reader);
    }
}

/* ---- Columns --------------------------------------------------------------------------------- */

char *store_column_text(sqlite3_stmt *statement, int column, int *status)
{
    const unsigned char *text;
    size_t size;
    char *copy;

    if (sqlite3_column_type(statement, column) == SQLITE_NULL) {
        return NULL;
    }
    text = sqlite3_column_text(statement, column);
    size = (size_t)sqlite3_column_bytes(statement, column);
    copy = text ? malloc(size + 1) : NULL;
    if (!copy) {
        *status = STORE_NOMEM;
        return NULL;
    }
    memcpy(copy, text, size);
    copy[size] = '\0';
    return copy;
}

void store_column_id(sqlite3_stmt *statement, int column, char *buffer, size_t size)
{
    const unsigned char *text = sqlite3_column_text(statement, column);

    snprintf(buffer, size, "%s", text ? (const char *)text : "");
}
