/*
 * internal.h - what the files of store/ share: the struct behind the handle, statements, the
 * writer's queue, the readers' pool, and blobs.
 *
 * Threads and locks
 *   writer->mutex   rank 40: the queue of writes and the closing flag
 *   readers.mutex   rank 41: the pool's list and its count of connections in use
 * They are never held together, nor across a call into SQLite or the file system. The connections
 * need no lock: the writer's belongs to the writer thread, a reader's to whoever has taken it
 * from the pool.
 */
#ifndef SRNFD_STORE_INTERNAL_H
#define SRNFD_STORE_INTERNAL_H

#include <pthread.h>
#include <sqlite3.h>

#include "store/store.h"

#define STORE_APPLICATION_ID 0x53524e46 /* "SRNF" */
#define STORE_DATABASE_NAME "srnfd.db"

struct store_write;

struct store_writer {
    sqlite3 *db;
    pthread_t thread;
    bool started;
    pthread_mutex_t mutex;
    pthread_cond_t wake;             /* a write is queued, or closing */
    struct store_write *head, *tail; /* in order of arrival */
    bool closing;
    /* Of the writer thread alone: length of the log and how much of it has been copied, in pages;
       whether anything was committed since the last checkpoint. */
    int pages, pages_copied;
    bool dirty;
};

struct store_reader {
    sqlite3 *db;
    struct store_reader *next;
};

struct store_readers {
    pthread_mutex_t mutex;
    pthread_cond_t returned;
    struct store_reader *idle;
    size_t n_idle, in_use;
    bool closing;
};

struct store {
    char *directory;
    char *database; /* path of the database file */
    int lock_fd, blobs_fd;
    struct store_writer writer;
    struct store_readers readers;
};

/* ---- Statements (statement.c) ---------------------------------------------------------------- */

/* The STORE_* code of what the connection just answered. */
int store_map(sqlite3 *db, int rc);
/* STORE_FULL where errno says that there is no room, otherwise STORE_IO. */
int store_map_errno(int error);

/*
 * Prepares a statement and binds its parameters in order. Each letter of kinds takes its arguments:
 *   t  const char * (NULL binds NULL)    i  int64_t    d  double    b  const void *, size_t
 * The bound memory must outlive the statement. *out is NULL on error.
 */
int store_prepare(sqlite3 *db, sqlite3_stmt **out, const char *sql, const char *kinds, ...);
/* STORE_OK: there is a row; STORE_NOT_FOUND: no further row. */
int store_step(sqlite3 *db, sqlite3_stmt *statement);
/* Prepares, binds, runs to the end; *changed (may be NULL) gets the number of rows touched. */
int store_execute(sqlite3 *db, size_t *changed, const char *sql, const char *kinds, ...);
/* First column of the first row as an integer; STORE_NOT_FOUND without a row. */
int store_scalar(sqlite3 *db, int64_t *value, const char *sql);
/* Copies of columns: malloc, NULL for NULL; *status becomes STORE_NOMEM when memory is short. */
char *store_column_text(sqlite3_stmt *statement, int column, int *status);
void store_column_id(sqlite3_stmt *statement, int column, char *buffer, size_t size);

/* ---- Opening (database.c, migrate.c) --------------------------------------------------------- */

int store_connect_writer(const char *path, sqlite3 **db, char *message, size_t message_size);
int store_connect_reader(const char *path, sqlite3 **db);
/* Checks whose database it is, and brings it to the newest version. */
int store_migrate(sqlite3 *db, char *message, size_t message_size);

/* ---- Writing (writer.c) ---------------------------------------------------------------------- */

/*
 * One write. run is called on the writer thread inside a transaction and a savepoint; a negative
 * status undoes what it did. It may be called more than once when its group had to be rolled
 * back: it must then fill its outputs anew. dropped, if set by run, names a blob to be removed
 * from the disk once the group is committed.
 */
struct store_write {
    int (*run)(struct store *store, sqlite3 *db, struct store_write *write);
    void *argument;
    char dropped[65];
    int status;
    bool done;
    pthread_cond_t finished;
    struct store_write *next;
};

int store_writer_start(struct store *store);
void store_writer_stop(struct store *store);
/* Queues the write and waits until it is committed or refused. */
int store_write(struct store *store, int (*run)(struct store *, sqlite3 *, struct store_write *),
                void *argument);

/* ---- Reading (readers.c) --------------------------------------------------------------------- */

int store_readers_start(struct store *store);
/* Waits until all connections are back. */
void store_readers_stop(struct store *store);
int store_reader_take(struct store *store, struct store_reader **reader);
void store_reader_return(struct store *store, struct store_reader *reader);

/* ---- Lists (page.c) -------------------------------------------------------------------------- */

/* The statement of a page: ?1 and ?2 are key and time of the row before it, ?3 its length, ?4 and
   ?5 the process and the status that are asked for. filter says what the last two mean. */
#define STORE_PAGE_SQL(columns, table, key, filter)                                              \
    "SELECT " columns " FROM " table " WHERE (?1 = '' OR (created_ms, " key ") < (?2, ?1)) AND " \
    "(" filter ") ORDER BY created_ms DESC, " key " DESC LIMIT ?3"
/* Of tables that have neither: a page that asks for one of them is empty. */
#define STORE_PAGE_UNFILTERED "?4 IS NULL AND ?5 IS NULL"

/* One row of a page, in order. *more, true before, ends the page early; a status other than
   STORE_OK ends it as the status of the walk. */
typedef int store_page_row(void *argument, sqlite3_stmt *row, bool *more);
/* STORE_OK also for a page without rows. */
int store_page_walk(struct store *store, const struct store_page *page, const char *sql,
                    store_page_row *row, void *argument);

/* ---- Blobs (blob.c) -------------------------------------------------------------------------- */

/* Content on its way into the store. */
struct store_content {
    char hash[65];
    char temporary[48]; /* path under blobs/ of the staged file; "" for inline content */
    const void *bytes;
    size_t size;
};

int store_blobs_open(struct store *store, char *message, size_t message_size);
/* On the caller's thread: hashes the bytes, and writes and syncs large ones under a temporary
   name. */
int store_blob_stage(struct store *store, const void *bytes, size_t size,
                     struct store_content *content);
/* On the writer thread: moves a staged file to its place and adds the row. */
int store_blob_keep(struct store *store, sqlite3 *db, const struct store_content *content);
/* Removes what stage left behind, if anything. */
void store_blob_unstage(struct store *store, const struct store_content *content);
/* bytes is malloc and zero-terminated beyond size. STORE_CORRUPT: missing, or not what its name
   says. */
int store_blob_read(struct store *store, sqlite3 *db, const char *hash, unsigned char **bytes,
                    size_t *size);
/* On the writer thread, in a transaction: drops the row unless something refers to it; true if it
   did. */
int store_blob_release(sqlite3 *db, const char *hash, bool *dropped);
/* On the writer thread, after the commit: removes the file unless a row has come back. */
void store_blob_remove(struct store *store, sqlite3 *db, const char *hash);

/* ---- Numbers (numbers.c) --------------------------------------------------------------------- */

/* Integers and doubles as the store writes them: eight bytes each, least significant first,
   whatever the machine; -0 as 0. */
void store_put_integer(unsigned char bytes[8], int64_t value);
void store_put_doubles(unsigned char *bytes, const double *values, size_t count);
/* Reads a blob of exactly count doubles: malloc. */
int store_read_doubles(struct store *store, sqlite3 *db, const char *hash, size_t count,
                       double **values);

/* ---- Maps of a surface (surface_maps.c) ------------------------------------------------------ */

/* Their bytes, which the caller frees after the write, and the staged blob. */
int store_maps_stage(struct store *store, const struct store_maps *maps, unsigned char **bytes,
                     struct store_content *content);
/* On the writer thread, in the transaction that inserts the surface. */
int store_maps_insert(struct store *store, sqlite3 *db, const char *surface,
                      const struct store_maps *maps, const struct store_content *content);

/* ---- Jobs ------------------------------------------------------------------------------------ */

/* On the writer thread: the job has ended, and so its checkpoint goes, if it has one. The blob
   becomes what write drops. */
int store_checkpoint_drop(sqlite3 *db, const char *job, struct store_write *write);
/* Drops the checkpoints of all jobs that have ended, one by one. */
int store_checkpoint_sweep(struct store *store);

#define STORE_JOB_COLUMNS                                                                 \
    "id, process, status, inputs, digest, numeric_build, message, progress, created_ms, " \
    "started_ms, finished_ms, updated_ms, attempt, cancel_requested, problem_code, problem_detail"

/* Fills job from a row of STORE_JOB_COLUMNS; on failure the job is clear. */
int store_job_from_row(sqlite3_stmt *statement, struct store_job *job);
int store_job_row(sqlite3 *db, const char *id, struct store_job *job);

#endif
