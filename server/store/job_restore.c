/*
 * job_restore.c - jobs that another service has done, with their results, as part of a batch.
 *
 * A restored job keeps its times and build, and its id where that is free: ids are those of the
 * whole service, and another owner may have restored the same archive. It answers the same request
 * of its owner from the cache as it did there, where this service is of the same numeric build: the
 * digest says so. Where the owner has a job of that digest already, that one stays.
 */
#include "store/internal.h"
#include "store/batch.h"
#include "store/job.h"
#include "store/labels.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TIME_LENGTH 23 /* of an id up to its random part: job-xxxxxxxx-xxxx-7xxx- */

struct batched {
    struct store_job job;
    char given_id[STORE_ID_MAX]; /* in the archive */
    struct store_content content;
    struct store_ids given, made; /* what inputs and results name */
    char *results;
    int64_t bytes_max;
};

/* Gives the job another id of the same time where its own is taken: 62 random bits (ids.c of jobs),
   so that a second one that is taken means no accident but a fault. */
static int choose_id(sqlite3 *db, struct store_job *job)
{
    char found[STORE_ID_MAX], hex[17];
    unsigned char bytes[8];
    int status = store_text(db, found, sizeof found, "SELECT id FROM job WHERE id = ?", job->id);

    if (status != STORE_OK) {
        return status == STORE_NOT_FOUND ? STORE_OK : status;
    }
    randombytes_buf(bytes, sizeof bytes);
    bytes[0] = (unsigned char)(0x80 | (bytes[0] & 0x3f)); /* the variant of a UUID */
    (void)sodium_bin2hex(hex, sizeof hex, bytes, sizeof bytes);
    (void)snprintf(job->id + TIME_LENGTH, sizeof job->id - TIME_LENGTH, "%.4s-%.12s", hex, hex + 4);
    return STORE_OK;
}

static int insert_job(sqlite3 *db, const struct store_job *job, size_t *changed)
{
    return store_execute(
        db, changed,
        "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, progress, "
        "created_ms, started_ms, finished_ms, updated_ms, attempt, owner, cohort) "
        "VALUES (?, ?, 'accepted', ?3, ?, ?, 'restored from an archive', 100, ?, ?, ?, ?, 1, "
        "?, " STORE_JOB_COHORT("?3") ") ON CONFLICT DO NOTHING",
        "tttttiiiit", job->id, job->process, job->inputs, job->digest, job->numeric_build,
        job->created_ms, job->started_ms, job->finished_ms, job->finished_ms, job->owner);
}

/* Name and tags, unless there are none. */
static int label_job(struct store *store, sqlite3 *db, const struct store_job *job)
{
    const struct store_labels labels = {.name = job->name, .tags = job->tags};

    return job->name || job->tags ? store_label_now(store, db, job->owner, job->id, &labels)
                                  : STORE_OK;
}

/* What the results name goes with the job, its record names the job by the id that it has here, and
   where its record says that this job made it, it
   needs the job, as it would have if it had been made here. */
static int add_made(sqlite3 *db, const struct batched *batched)
{
    const struct store_job *job = &batched->job;
    int status = store_needs_add(db, job->owner, job->id, &batched->made, true);

    for (size_t i = 0; i < batched->made.count && status == STORE_OK; i++) {
        status =
            store_execute(db, NULL,
                          "UPDATE owned SET record = replace(record, ?3, ?4) "
                          "WHERE owner = ?1 AND id = ?2 AND ?3 <> ?4",
                          "tttt", job->owner, batched->made.list[i], batched->given_id, job->id);
        if (status != STORE_OK) {
            break;
        }
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
    struct store_job *job = &batched->job;
    size_t changed = 0;
    int status = store_owner_limit(db, job->owner, batched->bytes_max);

    memcpy(job->id, batched->given_id, sizeof job->id);
    if (status == STORE_OK) {
        status = choose_id(db, job);
    }
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
    if (status == STORE_OK) {
        status = label_job(store, db, job);
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
    memcpy(batched->given_id, batched->job.id, sizeof batched->given_id);
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
    return store_batch_add(
        batch, status, STORE_BATCH_JOB,
        &(struct store_batch_item){run_batched, batched, clear_batched, batched});
}
