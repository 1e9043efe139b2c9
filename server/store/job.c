/*
 * job.c - the rows of jobs, as far as they are only read, added or removed; job_state.c moves
 * them from state to state.
 */
#include "store/internal.h"
#include "store/job.h"
#include "store/holdings.h"
#include "store/page.h"
#include "store/store.h"

#include <stdlib.h>
#include <string.h>

/* An Idempotency-Key is remembered for a day. */
#define KEY_LIFETIME_MS ((int64_t)24 * 60 * 60 * 1000)

void store_job_clear(struct store_job *job)
{
    free(job->process);
    free(job->inputs);
    free(job->message);
    free(job->problem_code);
    free(job->problem_detail);
    free(job->numeric_build);
    free(job->name);
    free(job->tags);
    *job = (struct store_job){0};
}

int store_job_from_row(sqlite3_stmt *row, struct store_job *job)
{
    char status_name[16];
    int status = STORE_OK;

    *job = (struct store_job){.seconds_left = -1.0};
    store_column_id(row, 0, job->id, sizeof job->id);
    job->process = store_column_text(row, 1, &status);
    store_column_id(row, 2, status_name, sizeof status_name);
    while (strcmp(store_job_status_name(job->status), status_name) != 0) {
        /* The table's CHECK admits no other name, so the last one need not be compared. */
        if (++job->status == STORE_JOB_DISMISSED) {
            break;
        }
    }
    job->inputs = store_column_text(row, 3, &status);
    store_column_id(row, 4, job->digest, sizeof job->digest);
    job->numeric_build = store_column_text(row, 5, &status);
    job->message = store_column_text(row, 6, &status);
    job->progress = sqlite3_column_double(row, 7);
    job->created_ms = sqlite3_column_int64(row, 8);
    job->started_ms = sqlite3_column_int64(row, 9);
    job->finished_ms = sqlite3_column_int64(row, 10);
    job->updated_ms = sqlite3_column_int64(row, 11);
    job->attempt = sqlite3_column_int64(row, 12);
    job->cancel_requested = sqlite3_column_int64(row, 13) != 0;
    job->problem_code = store_column_text(row, 14, &status);
    job->problem_detail = store_column_text(row, 15, &status);
    store_column_id(row, 16, job->owner, sizeof job->owner);
    store_column_id(row, 17, job->trace, sizeof job->trace);
    job->expected_ms = sqlite3_column_int64(row, 18);
    job->express = sqlite3_column_int64(row, 19) != 0;
    job->name = store_column_text(row, 20, &status);
    job->tags = store_column_text(row, 21, &status);
    if (status != STORE_OK) {
        store_job_clear(job);
    }
    return status;
}

int store_job_row(sqlite3 *db, const char *id, struct store_job *job)
{
    sqlite3_stmt *row = NULL;
    int status =
        store_prepare(db, &row, "SELECT " STORE_JOB_COLUMNS " FROM job WHERE id = ?", "t", id);

    *job = (struct store_job){0};
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        status = store_job_from_row(row, job);
    }
    sqlite3_finalize(row);
    return status;
}

int store_job_get(struct store *store, const char *id, struct store_job *job)
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    *job = (struct store_job){0};
    if (status == STORE_OK) {
        status = store_job_row(reader->db, id, job);
        store_reader_return(store, reader);
    }
    return status;
}

int store_job_find(struct store *store, const char *digest, struct store_job *job)
{
    struct store_query query;
    int status = store_query_first(&query, store,
                                   "SELECT " STORE_JOB_COLUMNS " FROM job WHERE digest = ? "
                                   "AND (status IN ('accepted', 'successful') "
                                   "     OR (status = 'running' AND NOT cancel_requested)) "
                                   "ORDER BY created_ms DESC, id DESC LIMIT 1",
                                   "t", digest);

    *job = (struct store_job){0};
    if (status == STORE_OK) {
        status = store_job_from_row(query.row, job);
    }
    store_query_close(&query);
    return status;
}

int store_job_results(struct store *store, const char *id, char **results, size_t *size)
{
    char hash[65] = "", framed[65] = "";
    unsigned char *bytes = NULL;
    struct store_reader *reader = NULL;
    uint64_t age = store_recent_age(store->recent);
    int status = store_reader_take(store, &reader);

    *results = NULL;
    *size = 0;
    if (status != STORE_OK) {
        return status;
    }
    status = store_text(reader->db, hash, sizeof hash, "SELECT results FROM job WHERE id = ?", id);
    if (status == STORE_OK) {
        status = hash[0] ? store_blob_read(store, reader->db, hash, &bytes, size) : STORE_CONFLICT;
    }
    /* Those of memory are given as they are stored. */
    if (status == STORE_OK) {
        status = store_text(reader->db, framed, sizeof framed,
                            "SELECT EXISTS (SELECT 1 FROM framing WHERE job = ?)", id);
    }
    store_reader_return(store, reader);
    if (status != STORE_OK) {
        free(bytes);
        bytes = NULL;
    } else if (framed[0] == '0') {
        store_recent_keep(store->recent, age, id, (const char *)bytes, *size);
    }
    *results = (char *)bytes;
    return status;
}

int store_job_count(struct store *store, enum store_job_status state, size_t *count)
{
    struct store_query query;
    int status = store_query_first(&query, store, "SELECT count(*) FROM job WHERE status = ?", "t",
                                   store_job_status_name(state));

    *count = 0;
    if (status == STORE_OK) {
        *count = (size_t)sqlite3_column_int64(query.row, 0);
    }
    store_query_close(&query);
    return status;
}

int store_job_count_alone(struct store *store, size_t *count)
{
    struct store_reader *reader = NULL;
    int64_t waiting = 0;
    int status = store_reader_take(store, &reader);

    *count = 0;
    if (status == STORE_OK) {
        status = store_scalar(reader->db, &waiting,
                              "SELECT count(*) FROM job WHERE status = 'accepted' AND alone = 1");
        store_reader_return(store, reader);
    }
    *count = (size_t)waiting;
    return status;
}

struct list {
    bool (*visit)(void *user, const struct store_job *job);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_job job;
    int status = store_job_from_row(row, &job);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &job);
        store_job_clear(&job);
    }
    return status;
}

const struct store_listing store_job_listing = {
    .rows = "job AS listed",
    .one = "listed.owner = :owner",
    .all = "1",
    .id = "listed.id",
    .name = "listed.title",
    .process = "listed.process",
    .status = "listed.status",
    .tag = "listed.id IN (SELECT id FROM tag WHERE tag = :tag)",
    .cohort = "listed.cohort = :cohort",
    .mesh = "listed.id IN (SELECT needing FROM need WHERE id = :mesh)",
    .duration = "CASE WHEN listed.started_ms <= 0 OR listed.status = 'accepted' THEN NULL "
                "WHEN listed.status = 'running' THEN :now - listed.started_ms "
                "WHEN listed.finished_ms > 0 THEN listed.finished_ms - listed.started_ms END",
    .found = "listed.id AS found",
    .columns = STORE_JOB_COLUMNS,
    .join = "JOIN job ON job.id = page.found",
};

int store_job_list(struct store *store, const struct store_page *page,
                   bool (*visit)(void *user, const struct store_job *job), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_job_listing, page, list_row, &list);
}

/* ---- Adding and removing --------------------------------------------------------------------- */

struct insert {
    const struct store_job *job; /* NULL: only the key, for job_id */
    const struct store_job_limits *limits;
    const char *job_id, *key, *body_digest;
    const struct store_ids *needs; /* that the inputs name */
    int64_t now;
};

static int insert_key(sqlite3 *db, const struct insert *insert)
{
    size_t changed = 0;
    int status = store_execute(db, NULL, "DELETE FROM idempotency WHERE created_ms <= ?", "i",
                               insert->now - KEY_LIFETIME_MS);

    if (status == STORE_OK) {
        status =
            store_execute(db, &changed,
                          "INSERT INTO idempotency (key, job, body_digest, created_ms, owner) "
                          "SELECT ?, id, ?, ?, owner FROM job WHERE id = ?",
                          "ttit", insert->key, insert->body_digest, insert->now, insert->job_id);
        status = status == STORE_OK && changed == 0 ? STORE_CONFLICT : status;
    }
    return status;
}

/* The owner's row, with what a claim must know of it. STORE_QUEUED: no more jobs. */
static int admit(sqlite3 *db, const struct insert *insert)
{
    const struct store_job_limits *limits = insert->limits;
    const char *owner = insert->job->owner;
    sqlite3_stmt *row = NULL;
    int status = store_execute(db, NULL,
                               "INSERT INTO owner (name, running_max) VALUES (?, ?) "
                               "ON CONFLICT (name) DO UPDATE SET running_max = "
                               "excluded.running_max WHERE running_max <> excluded.running_max",
                               "ti", owner, (int64_t)limits->running);

    if (status == STORE_OK) {
        status = store_owner_limit(db, owner, limits->bytes);
    }
    if (status != STORE_OK || limits->queued == 0) {
        return status;
    }
    status = store_prepare(db, &row,
                           "SELECT 1 FROM job WHERE owner = ? AND status = 'accepted' "
                           "LIMIT 1 OFFSET ?",
                           "ti", owner, (int64_t)limits->queued - 1);
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    sqlite3_finalize(row);
    return status == STORE_NOT_FOUND ? STORE_OK : status == STORE_OK ? STORE_QUEUED : status;
}

static int run_insert(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct insert *insert = write->argument;
    const struct store_job *job = insert->job;
    int status = STORE_OK;

    (void)store;
    if (job) {
        status = admit(db, insert);
    }
    if (job && status == STORE_OK) {
        status = store_execute(
            db, NULL,
            "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, "
            "progress, created_ms, updated_ms, owner, trace, expected_ms, express, cohort) "
            "VALUES (?, ?, 'accepted', ?3, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, " STORE_JOB_COHORT(
                "?3") ")",
            "ttttttdiittii", job->id, job->process, job->inputs, job->digest,
            job->numeric_build ? job->numeric_build : "", job->message ? job->message : "",
            job->progress, job->created_ms, insert->now, job->owner, job->trace, job->expected_ms,
            (int64_t)job->express);
    }
    if (job && status == STORE_OK) {
        status = store_needs_add(db, job->owner, job->id, insert->needs, false);
    }
    if (status == STORE_OK && insert->key) {
        status = insert_key(db, insert);
    }
    return status == STORE_OK ? store_owner_check_job(db, insert->job_id, 0) : status;
}

int store_job_insert(struct store *store, const struct store_job *job,
                     const struct store_job_limits *limits, const char *idempotency_key,
                     const char *body_digest)
{
    const struct store_job_limits none = {0};
    struct store_ids needs = {0};
    struct insert insert = {.job = job,
                            .limits = limits ? limits : &none,
                            .job_id = job->id,
                            .key = idempotency_key,
                            .body_digest = body_digest ? body_digest : "",
                            .needs = &needs,
                            .now = store_now_ms()};
    int status = store_ids_find(&needs, job->inputs);

    status = status == STORE_OK ? store_write(store, run_insert, &insert) : status;
    store_ids_clear(&needs);
    return status;
}

int store_idempotency_put(struct store *store, const char *key, const char *job_id,
                          const char *body_digest)
{
    struct insert insert = {
        .job_id = job_id, .key = key, .body_digest = body_digest, .now = store_now_ms()};

    return store_write(store, run_insert, &insert);
}

int store_idempotency_find(struct store *store, const char *key, char job_id[STORE_ID_MAX],
                           char body_digest[65])
{
    struct store_query query;
    int status = store_query_first(&query, store,
                                   "SELECT job, body_digest FROM idempotency "
                                   "WHERE key = ? AND created_ms > ?",
                                   "ti", key, store_now_ms() - KEY_LIFETIME_MS);

    job_id[0] = body_digest[0] = '\0';
    if (status == STORE_OK) {
        store_column_id(query.row, 0, job_id, STORE_ID_MAX);
        store_column_id(query.row, 1, body_digest, 65);
    }
    store_query_close(&query);
    return status;
}

/* The hash of the results that the job holds, or "". STORE_CONFLICT: the job has not ended. */
static int results_of_ended(sqlite3 *db, const char *id, char hash[65])
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT results, status IN ('accepted', 'running') FROM job "
                               "WHERE id = ?",
                               "t", id);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        store_column_id(row, 0, hash, 65);
        status = sqlite3_column_int(row, 1) ? STORE_CONFLICT : STORE_OK;
    }
    sqlite3_finalize(row);
    return status;
}

int store_job_remove(sqlite3 *db, const char *id, struct store_write *write)
{
    char hash[65] = "";
    bool dropped = false;
    int status = results_of_ended(db, id, hash);

    if (status == STORE_OK) {
        status = store_execute(db, NULL, "DELETE FROM job WHERE id = ?", "t", id);
    }
    if (status == STORE_OK && hash[0]) {
        status = store_blob_release(db, hash, &dropped);
    }
    return status == STORE_OK && dropped ? store_write_drop(write, hash) : status;
}

static int run_delete(struct store *store, sqlite3 *db, struct store_write *write)
{
    (void)store;
    return store_job_remove(db, write->argument, write);
}

int store_job_delete(struct store *store, const char *id)
{
    char copy[STORE_ID_MAX] = "";
    size_t length = strlen(id);

    if (length >= sizeof copy) {
        return STORE_NOT_FOUND;
    }
    memcpy(copy, id, length);
    return store_write_freeing(store, run_delete, copy);
}
