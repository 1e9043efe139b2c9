/*
 * job_restore.c - jobs that another service has done, with their results, as part of a batch.
 *
 * A restored job keeps its id, times and build. It answers the same request of its owner from the
 * cache as it did there, where this service is of the same numeric build: the digest says so. Where
 * there is a job of that id or digest already, that one stays.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/job.h"

#include <stdlib.h>
#include <string.h>

struct batched {
    struct store_job job;
    struct store_content content;
    struct store_ids given, made; /* what inputs and results name */
    char *results;
    int64_t bytes_max;
};

static int insert_job(sqlite3 *db, const struct store_job *job, size_t *changed)
{
    return store_execute(
        db, changed,
        "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, progress, "
        "created_ms, started_ms, finished_ms, updated_ms, attempt, owner) "
        "VALUES (?, ?, 'accepted', ?, ?, ?, '', 100, ?, ?, ?, ?, 1, ?) ON CONFLICT DO NOTHING",
        "tttttiiiit", job->id, job->process, job->inputs, job->digest, job->numeric_build,
        job->created_ms, job->started_ms, job->finished_ms, job->finished_ms, job->owner);
}

/* What the results name goes with the job, and where its record says that this job made it, it
   needs the job, as it would have if it had been made here. */
static int add_made(sqlite3 *db, const struct batched *batched)
{
    const struct store_job *job = &batched->job;
    int status = store_needs_add(db, job->owner, job->id, &batched->made, true);

    for (size_t i = 0; i < batched->made.count && status == STORE_OK; i++) {
        status = store_execute(
            db, NULL,
            "INSERT INTO need (owner, needing, id, along) SELECT ?1, ?2, ?3, 0 FROM owned "
            "LEFT JOIN surface ON surface.id = owned.id LEFT JOIN model ON model.id = owned.id "
            "WHERE owned.owner = ?1 AND owned.id = ?2 "
            "AND instr(coalesce(owned.record, surface.record, model.record), ?3) > 0 "
            "AND coalesce(json_extract(coalesce(owned.record, surface.record, model.record), "
            "'$.source.process'), '') <> 'encode' ON CONFLICT DO NOTHING",
            "ttt", job->owner, batched->made.list[i], job->id);
    }
    return status;
}

static int run_batched(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct batched *batched = write->argument;
    const struct store_job *job = &batched->job;
    size_t changed = 0;
    int status = store_owner_limit(db, job->owner, batched->bytes_max);

    if (status == STORE_OK) {
        status = insert_job(db, job, &changed);
    }
    if (status != STORE_OK || changed == 0) {
        return status;
    }
    status = store_blob_keep(store, db, &batched->content);
    if (status == STORE_OK) {
        status = store_execute(db, NULL,
                               "UPDATE job SET status = 'successful', results = ? WHERE id = ?",
                               "tt", batched->content.hash, job->id);
    }
    if (status == STORE_OK) {
        status = store_needs_add(db, job->owner, job->id, &batched->given, false);
    }
    if (status == STORE_OK) {
        status = add_made(db, batched);
    }
    return status == STORE_OK ? store_owner_check(db, job->owner, 0) : status;
}

static void clear_batched(struct store *store, void *argument)
{
    struct batched *batched = argument;

    store_blob_unstage(store, &batched->content);
    store_job_clear(&batched->job);
    store_ids_clear(&batched->given);
    store_ids_clear(&batched->made);
    free(batched->results);
    free(batched);
}

int store_batch_add_job(struct store_batch *batch, struct store_job *job, const char *results,
                        size_t size, int64_t bytes_max)
{
    struct store *store = store_batch_store(batch);
    struct batched *batched = calloc(1, sizeof *batched);
    int status = STORE_NOMEM;

    if (!batched) {
        store_job_clear(job);
        return STORE_NOMEM;
    }
    batched->job = *job;
    *job = (struct store_job){.attempt = 0};
    batched->bytes_max = bytes_max;
    batched->results = malloc(size + 1);
    if (batched->results) {
        memcpy(batched->results, results, size);
        batched->results[size] = '\0';
        status = store_ids_find(&batched->given, batched->job.inputs);
    }
    if (status == STORE_OK) {
        status = store_ids_find(&batched->made, batched->results);
    }
    if (status == STORE_OK) {
        status = store_blob_stage(store, batched->results, size, &batched->content);
    }
    if (status == STORE_OK) {
        status =
            store_batch_add(batch, &(struct store_batch_item){run_batched, batched, clear_batched});
        batched = status == STORE_OK ? NULL : batched;
    }
    if (batched) {
        clear_batched(store, batched);
    }
    return status;
}
