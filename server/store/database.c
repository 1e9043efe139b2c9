/*
 * database.c - how a connection is opened, and the pool of read-only ones.
 *
 * SQLite 3.7.0 to 3.51.2 can lose an acknowledged commit when a checkpoint on one connection
 * overlaps a write on another (the WAL-reset bug). The settings here keep both on one connection:
 * readers are opened read-only, so that they cannot write; automatic checkpoints are off, so that
 * only the writer thread makes them, between its transactions.
 *
 * secure_delete overwrites what is deleted with zeros, so that nothing of it stays in free pages.
 *
 * synchronous=FULL syncs the log at each commit: an answer of 201 is a promise.
 *
 * A thread takes a read-only connection for the length of one query and gives it back; the pool
 * keeps up to IDLE_MAX of them open and closes the rest. In WAL mode a reader sees the last commit
 * before its statement began and never waits for the writer.
 *
 * Lock: readers.mutex (rank 41), never held while SQLite runs.
 */
#include "store/fold.h"
#include "store/internal.h"

#include <stdio.h>
#include <stdlib.h>

/* A larger database is opened without quick_check: its time grows with the size, about 1 s for 1
   GB. */
#define QUICK_CHECK_MAX_BYTES ((int64_t)64 * 1024 * 1024)
#define IDLE_MAX 16

static int connect(const char *path, int flags, sqlite3 **db)
{
    int rc = sqlite3_open_v2(path, db, flags | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE, NULL);
    int status;

    if (!*db) {
        return STORE_NOMEM;
    }
    status = store_map(*db, rc);
    if (status == STORE_OK) {
        sqlite3_busy_timeout(*db, STORE_BUSY_TIMEOUT_MS);
        /* The file comes from outside: nothing in its schema may call functions, and no statement
           may damage it. */
        sqlite3_db_config(*db, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
        sqlite3_db_config(*db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, NULL);
        status = store_map(*db, sqlite3_exec(*db, "PRAGMA cell_size_check = ON", NULL, NULL, NULL));
        status = status == STORE_OK ? store_map(*db, store_fold_define(*db)) : status;
    }
    return status;
}

int store_connect_reader(const char *path, sqlite3 **db)
{
    int status = connect(path, SQLITE_OPEN_READONLY, db);

    if (status != STORE_OK) {
        sqlite3_close(*db);
        *db = NULL;
    }
    return status;
}

/* quick_check answers "ok", or one line per damage. */
static int check(sqlite3 *db)
{
    sqlite3_stmt *statement = NULL;
    int64_t pages = 0, page_size = 0;
    int status = store_scalar(db, &pages, "PRAGMA page_count");

    if (status == STORE_OK) {
        status = store_scalar(db, &page_size, "PRAGMA page_size");
    }
    if (status != STORE_OK || pages > QUICK_CHECK_MAX_BYTES / page_size) {
        return status;
    }
    status = store_prepare(db, &statement, "PRAGMA quick_check(1)", "");
    if (status == STORE_OK) {
        status = store_step(db, statement);
    }
    if (status == STORE_OK) {
        const char *answer = (const char *)sqlite3_column_text(statement, 0);

        status = answer && sqlite3_stricmp(answer, "ok") == 0 ? STORE_OK : STORE_CORRUPT;
    }
    sqlite3_finalize(statement);
    return status;
}

int store_connect_writer(const char *path, sqlite3 **db, char *message, size_t message_size)
{
    static const char *const settings =
        "PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA wal_autocheckpoint = 0;"
        "PRAGMA secure_delete = ON;"
        "PRAGMA journal_size_limit = 67108864;";
    int status = connect(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, db);
    int64_t version = 0;

    /* Nothing is written, not even the journal mode, before the file is known to be ours and
       readable. */
    if (status == STORE_OK) {
        status = store_map(*db, sqlite3_exec(*db, settings, NULL, NULL, NULL));
    }
    if (status == STORE_OK) {
        status = store_scalar(*db, &version, "PRAGMA schema_version");
    }
    if (status == STORE_OK) {
        status = check(*db);
    }
    if (status == STORE_OK) {
        status = store_migrate(*db, message, message_size);
    } else {
        snprintf(message, message_size, "%s: %s", path,
                 status == STORE_CORRUPT ? "the file is not an intact SQLite database"
                                         : (*db ? sqlite3_errmsg(*db) : "not enough memory"));
    }
    if (status != STORE_OK) {
        sqlite3_close(*db);
        *db = NULL;
    }
    return status;
}

/* ---- The readers ----------------------------------------------------------------------------- */

int store_readers_start(struct store *store)
{
    pthread_mutex_init(&store->readers.mutex, NULL);
    pthread_cond_init(&store->readers.returned, NULL);
    return STORE_OK;
}

void store_readers_stop(struct store *store)
{
    struct store_readers *readers = &store->readers;

    pthread_mutex_lock(&readers->mutex);
    readers->closing = true;
    while (readers->in_use > 0) {
        pthread_cond_wait(&readers->returned, &readers->mutex);
    }
    pthread_mutex_unlock(&readers->mutex);
    while (readers->idle) {
        struct store_reader *reader = readers->idle;

        readers->idle = reader->next;
        sqlite3_close(reader->db);
        free(reader);
    }
    pthread_cond_destroy(&readers->returned);
    pthread_mutex_destroy(&readers->mutex);
}

/* Opens one more connection; it counts as in use already. */
static int open_reader(struct store *store, struct store_reader **out)
{
    struct store_reader *reader = calloc(1, sizeof *reader);
    int status = reader ? store_connect_reader(store->database, &reader->db) : STORE_NOMEM;

    if (status != STORE_OK) {
        free(reader);
        return status;
    }
    *out = reader;
    return STORE_OK;
}

int store_reader_take(struct store *store, struct store_reader **reader)
{
    struct store_readers *readers = &store->readers;
    int status = STORE_OK;

    *reader = NULL;
    pthread_mutex_lock(&readers->mutex);
    if (readers->closing) {
        pthread_mutex_unlock(&readers->mutex);
        return STORE_CLOSED;
    }
    readers->in_use++;
    if (readers->idle) {
        *reader = readers->idle;
        readers->idle = (*reader)->next;
        readers->n_idle--;
    }
    pthread_mutex_unlock(&readers->mutex);
    if (!*reader) {
        status = open_reader(store, reader);
        if (status != STORE_OK) {
            store_reader_return(store, NULL);
        }
    }
    return status;
}

void store_reader_return(struct store *store, struct store_reader *reader)
{
    struct store_readers *readers = &store->readers;
    struct store_reader *surplus = NULL;
    /* A COMMIT may fail for want of memory. Within its transaction a connection would see what it
       saw then for ever. */
    bool whole = reader && sqlite3_get_autocommit(reader->db);

    pthread_mutex_lock(&readers->mutex);
    if (whole && readers->n_idle < IDLE_MAX) {
        reader->next = readers->idle;
        readers->idle = reader;
        readers->n_idle++;
    } else {
        surplus = reader;
    }
    pthread_mutex_unlock(&readers->mutex);
    if (surplus) {
        sqlite3_close(surplus->db);
        free(surplus);
    }
    /* Counted last: a store that closes waits for this connection to be gone. */
    pthread_mutex_lock(&readers->mutex);
    readers->in_use--;
    pthread_cond_broadcast(&readers->returned);
    pthread_mutex_unlock(&readers->mutex);
}
