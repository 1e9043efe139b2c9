/*
 * checkpoint.c - what lets a long job go on after a crash: one blob per running job, replaced as a
 * whole.
 *
 * Putting a checkpoint is one transaction: the new blob, the row that names it, and the end of the
 * blob before. So there is always either the old one or the new one. The transaction in which a
 * job ends (job_state.c) takes its checkpoint along; those of jobs that end at a start, where many
 * do at once, are swept afterwards, one write each, since a write can drop one blob.
 */
#include "store/internal.h"
#include "store/job.h"

#include <string.h>

/* Hash of the checkpoint that the job has; STORE_NOT_FOUND when it has none. */
static int find(sqlite3 *db, const char *job, char hash[65])
{
    hash[0] = '\0';
    return store_text(db, hash, 65, "SELECT content FROM checkpoint WHERE job = ?", job);
}

/* Lets go of a blob that no row names any more. */
static int let_go(sqlite3 *db, const char *hash, struct store_write *write)
{
    bool dropped = false;
    int status = store_blob_release(db, hash, &dropped);

    return status == STORE_OK && dropped ? store_write_drop(write, hash) : status;
}

int store_checkpoint_drop(sqlite3 *db, const char *job, struct store_write *write)
{
    char hash[65];
    int status = find(db, job, hash);

    if (status == STORE_NOT_FOUND) {
        return STORE_OK;
    }
    if (status == STORE_OK) {
        status = store_execute(db, NULL, "DELETE FROM checkpoint WHERE job = ?", "t", job);
    }
    return status == STORE_OK ? let_go(db, hash, write) : status;
}

struct put {
    const char *job;
    int64_t attempt;
    const struct store_content *content;
};

/* Does this attempt of the job run? STORE_CONFLICT if not. Asked before the blob comes into the
   store, so that a refusal leaves no file behind. */
static int check_runs(sqlite3 *db, const struct put *put)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT 1 FROM job WHERE id = ? AND attempt = ? "
                               "AND status = 'running'",
                               "ti", put->job, put->attempt);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    sqlite3_finalize(row);
    return status == STORE_NOT_FOUND ? STORE_CONFLICT : status;
}

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct put *put = write->argument;
    char before[65];
    int found, status = check_runs(db, put);

    if (status == STORE_OK) {
        status = store_owner_check_job(db, put->job, (int64_t)put->content->size);
    }
    if (status == STORE_OK) {
        status = store_blob_keep(store, db, put->content);
    }
    if (status != STORE_OK) {
        return status;
    }
    found = find(db, put->job, before);
    if (found != STORE_OK && found != STORE_NOT_FOUND) {
        return found;
    }
    status = store_execute(db, NULL,
                           "INSERT INTO checkpoint (job, content, owner) SELECT id, ?, owner "
                           "FROM job WHERE id = ? "
                           "ON CONFLICT (job) DO UPDATE SET content = excluded.content",
                           "tt", put->content->hash, put->job);
    return status == STORE_OK && found == STORE_OK ? let_go(db, before, write) : status;
}

int store_checkpoint_put(struct store *store, const char *job, int64_t attempt, const void *bytes,
                         size_t size)
{
    struct store_content staged;
    struct put put = {.job = job, .attempt = attempt, .content = &staged};
    int status = store_blob_stage(store, bytes, size, &staged);

    if (status == STORE_OK) {
        status = store_write(store, run_put, &put);
        store_blob_unstage(store, &staged);
    }
    return status;
}

int store_checkpoint_get(struct store *store, const char *job, unsigned char **bytes, size_t *size)
{
    struct store_reader *reader = NULL;
    char hash[65];
    int status = store_reader_take(store, &reader);

    *bytes = NULL;
    *size = 0;
    if (status != STORE_OK) {
        return status;
    }
    status = find(reader->db, job, hash);
    if (status == STORE_OK) {
        status = store_blob_read(store, reader->db, hash, bytes, size);
    }
    store_reader_return(store, reader);
    return status;
}

/* One checkpoint of a job that has ended. STORE_NOT_FOUND: there is none left. */
static int run_sweep(struct store *store, sqlite3 *db, struct store_write *write)
{
    char job[STORE_ID_MAX] = "";
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT checkpoint.job FROM checkpoint JOIN job ON job.id = "
                               "checkpoint.job WHERE status NOT IN ('accepted', 'running') LIMIT 1",
                               "");

    (void)store;
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        store_column_id(row, 0, job, sizeof job);
    }
    sqlite3_finalize(row);
    return status == STORE_OK ? store_checkpoint_drop(db, job, write) : status;
}

int store_checkpoint_sweep(struct store *store)
{
    int status = STORE_OK;

    while (status == STORE_OK) {
        status = store_write_freeing(store, run_sweep, NULL);
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}
