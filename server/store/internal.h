/*
 * internal.h - what the files of store/ share: the struct behind the handle, the writer's queue,
 * the readers' pool, and blobs; statements are in statement.h.
 *
 * Threads and locks
 *   writer->mutex   rank 40: the queue of writes and the closing flag
 *   readers.mutex   rank 41: the pool's list and its count of connections in use
 *   recent.mutex    rank 42: the slots of recent results
 *   prepared.evicting  rank 43: the removal of prepared meshes for want of room
 * They are never held together, nor, but the last, across a call into SQLite or the file system.
 * The connections
 * need no lock: the writer's belongs to the writer thread, a reader's to whoever has taken it
 * from the pool.
 */
#ifndef SRNFD_STORE_INTERNAL_H
#define SRNFD_STORE_INTERNAL_H

#include <pthread.h>
#include <sqlite3.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "store/statement.h"
#include "store_status.h"

struct store_job;   /* store/job.h */
struct store_owner; /* owner.h */
struct store_page;  /* store/page.h */
struct store_maps;  /* store/surface.h */

#define STORE_APPLICATION_ID 0x53524e46 /* "SRNF" */
#define STORE_DATABASE_NAME "srnfd.db"
#define STORE_RESERVE_NAME "reserve"
#define STORE_PAGE_SIZE 4096 /* of the database */
/* How long a connection waits for another process, such as the command line tool, that looks into
   the database. */
#define STORE_BUSY_TIMEOUT_MS 5000

enum { STORE_BEGIN, STORE_COMMIT, STORE_ROLLBACK, STORE_SAVEPOINT, STORE_RELEASE, STORE_STEPS };
#define STORE_KEPT_MAX 8 /* statements */

/*
 * One write. run is called on the writer thread inside a transaction and a savepoint; a negative
 * status undoes what it did in the database, and nothing that it did to its argument. It may be
 * called twice: when another write of its group or the commit failed, and, if it frees, again with
 * the reserve on a full disk. So it sets all outputs anew before it reads any, counts from nothing
 * and leaves its inputs as they were. Blobs that run names by store_write_drop are removed from the
 * disk once the group is committed.
 */
struct store_write {
    int (*run)(struct store *store, sqlite3 *db, struct store_write *write);
    void *argument;
    bool frees;   /* may be done with the reserve where the disk is full */
    bool relaxed; /* what a failure of power undoes is done again: it need not wait for the disk */
    bool erases;  /* set by run: the log is to be emptied before the caller is woken */
    char (*dropped)[65]; /* malloc, freed when the write is done */
    size_t n_dropped, dropped_size;
    int status;
    bool done;
    pthread_cond_t finished;
    struct store_write *next;
};

struct store_writer {
    sqlite3 *db;
    /* Prepared once: of a transaction and its parts, and those of store_execute_kept. */
    sqlite3_stmt *steps[STORE_STEPS];
    struct {
        const char *sql; /* static */
        sqlite3_stmt *statement;
    } kept[STORE_KEPT_MAX];
    pthread_t thread;
    bool started;
    pthread_mutex_t mutex;
    pthread_cond_t wake;             /* a write is queued, or closing */
    struct store_write *head, *tail; /* in order of arrival */
    bool closing;
    struct store_write probe; /* of store_write_probe */
    bool probing;             /* it was queued once */
    /* Of the writer thread alone: length of the log and how much of it has been copied, in pages;
       whether anything was committed since the last checkpoint. */
    int pages, pages_copied;
    bool dirty;
    bool purge;   /* the log still has what was erased: it is to be cut to nothing */
    bool relaxed; /* commits do not wait for the disk */
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

struct store_recent;

/* Prepared meshes that are kept (prepared.c). */
struct store_prepared {
    int fd; /* of their folder; -1: there is none */
    atomic_llong limit, total, least_free;
    pthread_mutex_t evicting;
};

struct store {
    char *directory;
    char *database; /* path of the database file */
    int lock_fd, blobs_fd;
    atomic_int reserve;       /* STORE_OK where the reserve is there; otherwise why it is not */
    int64_t reserve_tried_ms; /* of the writer thread */
    struct store_writer writer;
    struct store_readers readers;
    struct store_recent *recent;
    struct store_prepared prepared;
    size_t encodings; /* of the writer thread: how many were put (encoding.c) */
    size_t erasures;  /* of the writer thread: how often content was erased (erase.c) */
};

/* ---- Opening (store.c, database.c, migrate.c) ------------------------------------------------ */

int store_connect_writer(const char *path, sqlite3 **db, char *message, size_t message_size);
int store_connect_reader(const char *path, sqlite3 **db);
/* Checks whose database it is, and that its version is known; message gets a sentence if not. */
int store_identify(sqlite3 *db, int64_t *version, char *message, size_t message_size);
/* Checks that, and brings it to the newest version. */
int store_migrate(sqlite3 *db, char *message, size_t message_size);

/* ---- Recent results (recent.c) --------------------------------------------------------------- */

/* NULL when memory is short. */
struct store_recent *store_recent_create(void);
void store_recent_destroy(struct store_recent *recent);
/* To be called by the writer when a group is committed, before its callers are woken. */
void store_recent_expire(struct store_recent *recent);
/* The age of what is read from now on, for store_recent_keep. */
uint64_t store_recent_age(struct store_recent *recent);
/* Keeps a copy of results that were read since then, where they are small and no write fell
   between. */
void store_recent_keep(struct store_recent *recent, uint64_t age, const char *id,
                       const char *results, size_t size);

/* ---- Writing (writer.c) ---------------------------------------------------------------------- */

/* To be called by run: the blob's row has gone, and its file goes after the commit. */
int store_write_drop(struct store_write *write, const char *hash);

/* On the writer thread, between transactions, when the log is empty: zeroes what no row of the
   database uses (scrub.c). */
int store_scrub(sqlite3 *db);

int store_writer_start(struct store *store);
void store_writer_stop(struct store *store);
/* Queues the write and waits until it is committed or refused. */
int store_write(struct store *store, int (*run)(struct store *, sqlite3 *, struct store_write *),
                void *argument);
/* The same for a write that is done again where power has failed: it waits for the commit, which
   other processes see and which outlives this one, but not for the disk. */
int store_write_relaxed(struct store *store,
                        int (*run)(struct store *, sqlite3 *, struct store_write *),
                        void *argument);
/* The same for a write that makes room, or leaves things as large as they are. */
int store_write_freeing(struct store *store,
                        int (*run)(struct store *, sqlite3 *, struct store_write *),
                        void *argument);

/* The same for a write without argument that only asks whether one gets through, and whose caller
   waits so long at most: *answered is false where it is still on its way. Those who ask meanwhile
   wait for the same one. */
int store_write_probe(struct store *store,
                      int (*run)(struct store *, sqlite3 *, struct store_write *), int64_t wait_ms,
                      bool *answered);

/* ---- Several as one (batch.c) ---------------------------------------------------------------- */

struct store_batch; /* store/batch.h */
struct store_content;

/* One put of a batch. */
struct store_batch_item {
    int (*run)(struct store *store, sqlite3 *db, struct store_write *write); /* NULL: left out */
    void *argument;                                                          /* of run's write */
    void (*clear)(struct store *store, void *owned);
    void *owned; /* all that the put needs until it is done */
};
struct store *store_batch_store(const struct store_batch *batch);
/* What rests on others is put after them, in whatever order they were added. */
enum store_batch_turn {
    STORE_BATCH_UPLOAD,
    STORE_BATCH_SURFACE,
    STORE_BATCH_MODEL,
    STORE_BATCH_JOB,
    STORE_BATCH_REST,
    STORE_BATCH_TURNS
};
/* Adds a put that was made ready. Clears it where that failed, which is the status given, or where
   there is no memory. Returns the status. */
int store_batch_add(struct store_batch *batch, int status, enum store_batch_turn turn,
                    const struct store_batch_item *item);
/* Makes the content of what has this id ready: mends what is stored of it if the owner has it, and
   content->hash is then ""; stages it otherwise. kept: the bytes are read until it is stored. */
int store_batch_stage(struct store_batch *batch, const char *owner, const char *id,
                      const void *bytes, size_t size, struct store_content *content, bool *kept);

/* ---- Room for that (reserve.c) --------------------------------------------------------------- */

/* Takes the reserve unless it is there or it was tried just now; store->reserve tells. */
void store_reserve_take(struct store *store);
/* Leaves what room there is for the next start, when the writer has ended. */
void store_reserve_leave(const struct store *store);
/* Lets go of it; false where there is none. */
bool store_reserve_release(struct store *store);
/* Pages of the log that it has room for in the database. */
int store_reserve_pages(const struct store *store);
/* Whether there is room to copy the log, which db has written, into the database. */
bool store_reserve_copies(const struct store *store, sqlite3 *db);

/* ---- Reading (database.c) -------------------------------------------------------------------- */

int store_readers_start(struct store *store);
/* Waits until all connections are back. */
void store_readers_stop(struct store *store);
int store_reader_take(struct store *store, struct store_reader **reader);
void store_reader_return(struct store *store, struct store_reader *reader);

/* ---- Lists (page.c) -------------------------------------------------------------------------- */

/* What a list is of, in pieces of SQL. The row that is filtered and sorted is called listed, the
   one that is on the page page. */
struct store_listing {
    const char *rows;                /* "owned AS listed" */
    const char *one, *all;           /* which of them one owner sees, and one who sees all */
    const char *id, *name;           /* columns */
    const char *process, *status;    /* the same; NULL: there is none to be filtered by */
    const char *tag, *cohort, *mesh; /* conditions; NULL as before */
    const char *duration;            /* ms, NULL in SQL where it has none; the same */
    const char *found, *join;        /* columns of the page, and how they lead to the rows */
    const char *columns;             /* of the rows */
};
/* Of content, which anyone may own: of owned and the table of its kind. */
#define STORE_LISTING_OF_CONTENT(table, row_columns)                                         \
    .rows = "owned AS listed", .one = "listed.owner = :owner AND listed.kind = '" table "'", \
    .all = "listed.first = 1 AND listed.kind = '" table "'", .id = "listed.id",              \
    .name = "listed.name",                                                                   \
    .tag = "(listed.owner, listed.id) IN (SELECT owner, id FROM tag WHERE tag = :tag)",      \
    .found = "listed.owner AS owner, listed.id AS id", .columns = row_columns,               \
    .join = "JOIN owned ON owned.owner = page.owner AND owned.id = page.id JOIN " table      \
            " ON " table ".id = page.id"
#define STORE_LISTED_BY_MESH \
    "(listed.owner, listed.id) IN (SELECT owner, needing FROM need WHERE id = :mesh)"
/* What is a member of a cohort of that name, which the owner has, or anyone. */
#define STORE_LISTED_BY_COHORT(kind)                                                   \
    "listed.id IN (SELECT " kind " FROM cohort CROSS JOIN cohort_member AS member ON " \
    "member.list = cohort.list WHERE cohort.name = :cohort"                            \
    " AND (cohort.owner = :owner OR :owner IS NULL) AND " kind " IS NOT NULL)"

#define STORE_PAGE_SQL_MAX 3072
/* The statements of a page and of its total; parameters have names. */
void store_page_sql(const struct store_listing *listing, const struct store_page *page,
                    char text[STORE_PAGE_SQL_MAX]);
void store_page_count_sql(const struct store_listing *listing, const struct store_page *page,
                          char text[STORE_PAGE_SQL_MAX]);
extern const struct store_listing store_mesh_listing, store_surface_listing, store_model_listing,
    store_volume_listing, store_cohort_listing, store_job_listing;

/* One row of a page, in order. *more, true before, ends the page early; a status other than
   STORE_OK ends it as the status of the walk. */
typedef int store_page_row(void *argument, sqlite3_stmt *row, bool *more);
/* STORE_OK also for a page without rows. */
int store_page_walk(struct store *store, const struct store_listing *listing,
                    const struct store_page *page, store_page_row *row, void *argument);

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
/* Where the stored copy of these bytes is damaged, they replace it (mend.c). */
int store_blob_mend(struct store *store, const void *bytes, size_t size);
/* Removes what stage left behind, if anything. */
void store_blob_unstage(struct store *store, const struct store_content *content);
/* The blob whose hash the statement finds by an id; bytes as below. */
int store_blob_find(struct store *store, const char *sql, const char *id, unsigned char **bytes,
                    size_t *size);
/* bytes is malloc and zero-terminated beyond size. STORE_CORRUPT: missing, or not what its name
   says. */
int store_blob_read(struct store *store, sqlite3 *db, const char *hash, unsigned char **bytes,
                    size_t *size);
/* On the writer thread, in a transaction: drops the row unless something refers to it; true if it
   did. */
int store_blob_release(sqlite3 *db, const char *hash, bool *dropped);
/* On the writer thread, after the commit: removes the file unless a row has come back or a backup
   is being made; true if it did. */
bool store_blob_remove(struct store *store, sqlite3 *db, const char *hash);
/* Whether a row names the blob; true also where that cannot be told. */
bool store_blob_has_row(sqlite3 *db, const char *hash);
/* Whether its row has the content, rather than a file. */
bool store_blob_is_inline(sqlite3 *db, const char *hash);

#define STORE_BLOB_PATH 80
/* Path of a blob's file below blobs/. */
void store_blob_path(char path[STORE_BLOB_PATH], const char *hash);

/* ---- What is derived from meshes (prepared.c, encoding.c) ------------------------------------ */

/* Removes the prepared meshes, or the encodings, that were made of a mesh or with it as sphere. */
void store_prepared_drop(struct store *store, const char *mesh);
int store_encoding_drop(struct store *store, const char *mesh);
/* Tells of each file of a prepared mesh that is damaged or that nothing needs: a path for people,
   and where it is. */
void store_prepared_verify(const char *directory, sqlite3 *db,
                           void (*found)(void *user, const char *path, int folder_fd,
                                         const char *name),
                           void *user);

/* ---- From outside the daemon (offline.c) ----------------------------------------------------- */

/* Fills the paths and descriptors of a store without threads, and opens a read-only connection that
   makes no checkpoint. message gets a sentence on failure; store_close_offline is due in any case.
*/
int store_open_offline(struct store *store, sqlite3 **db, const char *directory, char *message,
                       size_t message_size);
void store_close_offline(struct store *store, sqlite3 *db);

/* Reads a blob of exactly count doubles: malloc (blob.c). */
int store_read_doubles(struct store *store, sqlite3 *db, const char *hash, size_t count,
                       double **values);

/* ---- Owners (owner.c) ------------------------------------------------------------------------ */

const char *store_owner_name(const struct store_owner *owner);
/* The owners that a statement finds by a key: *count of them, the first `most` in owners. */
int store_owners_of(struct store *store, const char *sql, const char *key,
                    char (*owners)[STORE_OWNER_MAX], size_t most, size_t *count);
/* On the writer thread: the owner has a row, and may hold so many bytes (0: any number; below 0: as
   many as before). */
int store_owner_limit(sqlite3 *db, const char *name, int64_t bytes_max);
/* On the writer thread: STORE_QUOTA where what the owner holds and so many bytes more are above
   that. */
int store_owner_check(sqlite3 *db, const char *name, int64_t more);
/* The same for the owner of a job; STORE_OK for a job that is not there. */
int store_owner_check_job(sqlite3 *db, const char *job, int64_t more);
/* What a row of owned counts for beside its content, name and record, with that of the mesh,
   surface or model. What jobs (2048 and their inputs), keys (1024) and cohorts (1024, 512 for a
   member, and the text) count for stands in migrations/0008_quotas.sql. Measured as the growth of
   the database by 20,000 of each, packed: 650 bytes for a mesh, 1190 for a failed job, 725 for the
   longest key, 710 for a cohort and 360 for a member. */
#define STORE_ROW_BYTES 1024

/* Content as one owner has it. */
struct store_holding {
    const char *id, *kind; /* "mesh", "surface", "model" */
    const char *name, *record;
    const char *also; /* an id that it needs beside those in its record, or NULL */
    bool alone;       /* the record names all that it was made of: it needs no job */
    int64_t bytes, now;
};
/* On the writer thread, before the content itself is stored, so that a refusal leaves no blob
   behind: it is the owner's now; *taken is false where it was before. */
int store_owner_take(sqlite3 *db, const struct store_owner *owner,
                     const struct store_holding *holding, bool *taken);

/* One row as an owner (NULL: nobody) knows it: parameters are the owner and the id. */
#define STORE_ROW_AS(columns, table)                                                \
    "SELECT " columns " FROM " table " LEFT JOIN owned ON owned.id = " table ".id " \
    "AND owned.owner = ?1 WHERE " table ".id = ?2"

/* ---- What needs what (needs.c) --------------------------------------------------------------- */

/* Ids that a text names, each as often as it does. */
struct store_ids {
    char (*list)[STORE_ID_MAX]; /* malloc */
    size_t count, size;
};
void store_ids_clear(struct store_ids *ids);
/* Adds those of a JSON text; NULL has none. STORE_NOMEM: ids is clear. */
int store_ids_find(struct store_ids *ids, const char *text);
/* On the writer thread: needing, which is the owner's, needs id, if there is such a thing. along:
   needing goes with id, but does not keep it. What was said before stays. */
int store_need_add(sqlite3 *db, const char *owner, const char *needing, const char *id, bool along);
/* The same for each of the ids. */
int store_needs_add(sqlite3 *db, const char *owner, const char *needing,
                    const struct store_ids *ids, bool along);

/* ---- Maps of a surface (surface_maps.c) ------------------------------------------------------ */

/* Their bytes, which the caller frees after the write, and the staged blob. */
int store_maps_stage(struct store *store, const struct store_maps *maps, unsigned char **bytes,
                     struct store_content *content);
/* Replaces what the store holds of them where that is damaged (mend.c). */
int store_maps_mend(struct store *store, const struct store_maps *maps);
/* On the writer thread, in the transaction that inserts the surface. */
int store_maps_insert(struct store *store, sqlite3 *db, const char *surface,
                      const struct store_maps *maps, const struct store_content *content);

/* ---- Names and tags (labels.c) --------------------------------------------------------------- */

struct store_labels; /* store/labels.h */
/* On the writer thread, in a transaction: what store_label does. */
int store_label_now(struct store *store, sqlite3 *db, const char *owner, const char *id,
                    const struct store_labels *labels);
/* The same: STORE_CONFLICT where the owner's name and tags are not those that were seen. */
int store_labels_check(sqlite3 *db, const char *owner, const char *id,
                       const struct store_labels *seen);

/* ---- Jobs ------------------------------------------------------------------------------------ */

/* On the writer thread: removes an ended job with its results and keys. STORE_CONFLICT: it has not
   ended. */
int store_job_remove(sqlite3 *db, const char *id, struct store_write *write);
/* On the writer thread: the job has ended, and so its checkpoint goes, if it has one. The blob
   becomes what write drops. */
int store_checkpoint_drop(sqlite3 *db, const char *job, struct store_write *write);
/* Removes the file that the job has for what memory has no room for, if it has one (scratch.c); and
   those of all jobs that have ended. */
void store_scratch_remove(struct store *store, const char *job);
int store_scratch_sweep(struct store *store);
/* Drops the checkpoints of all jobs that have ended, one by one. */
int store_checkpoint_sweep(struct store *store);

#define STORE_JOB_COLUMNS                                                                 \
    "id, process, status, inputs, digest, numeric_build, message, progress, created_ms, " \
    "started_ms, finished_ms, updated_ms, attempt, cancel_requested, problem_code, "      \
    "problem_detail, "                                                                    \
    "owner, trace, expected_ms, express, title, tags"

/* The cohort that inputs name, or ''. */
#define STORE_JOB_COHORT(inputs)                                                          \
    "iif(instr(" inputs ", '\"cohort\"') > 0 AND json_valid(" inputs "), coalesce("       \
    "json_extract(" inputs ", '$.cohort.name'), iif(json_type(" inputs ", '$.cohort') = " \
    "'text', json_extract(" inputs ", '$.cohort'), '')), '')"

/* Fills job from a row of STORE_JOB_COLUMNS; on failure the job is clear. */
int store_job_from_row(sqlite3_stmt *statement, struct store_job *job);
int store_job_row(sqlite3 *db, const char *id, struct store_job *job);

#endif
