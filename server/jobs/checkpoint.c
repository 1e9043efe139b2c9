/*
 * checkpoint.c - when a run writes its checkpoint (kept.c), and what it takes from that of an
 * earlier attempt.
 *
 * A state is written when it is saved. Parts come from all threads that help the job: whoever
 * brings one when the last checkpoint is INTERVAL old writes the next, unless somebody is about to:
 * at most once in INTERVAL, and in COST times what writing took, so that a large one does not take
 * the time of what it saves.
 *
 * Lock: kept->mutex (rank 25), never held across the store.
 */
#include "jobs/internal.h"

#include "store/job.h"
#include "store/task.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define INTERVAL 1.0 /* seconds */
#define COST 50.0

/* ---- The store ------------------------------------------------------------------------------- */

/* Writes the checkpoint of the job into the store, and tells it in the log. what: state, or parts
   that came since. */
static int write_row(struct jobs_run *run, const void *bytes, size_t size, const char *what)
{
    const struct store_job *job = run->job;
    char detail[80];
    int status = STORE_CONFLICT;

    if (jobs_run_stopping(run)) {
        return status; /* of what was broken off nothing is kept */
    }
    status = store_checkpoint_put(run->jobs->config.store, job->id, job->attempt, bytes, size);
    if (status == STORE_OK) {
        (void)snprintf(detail, sizeof detail, "%zu bytes, %s", size, what);
    } else {
        (void)snprintf(detail, sizeof detail, "%s", store_strerror(status));
    }
    jobs_log(run->jobs, status == STORE_OK ? "job-checkpoint" : "job-checkpoint-failed", job,
             detail);
    return status;
}

/* The checkpoint that an earlier attempt with the same numeric build has left (bytes: malloc). Told
   in the log. */
static int read_row(struct jobs_run *run, unsigned char **bytes, size_t *size)
{
    const struct store_job *job = run->job;
    const char *build = run->jobs->config.numeric_build ? run->jobs->config.numeric_build : "";
    char detail[80];
    int status = STORE_NOT_FOUND;

    *bytes = NULL;
    *size = 0;
    /* Another build may lay its checkpoints out differently, and would mix its numbers in. */
    if (job->numeric_build && strcmp(job->numeric_build, build) == 0) {
        status = store_checkpoint_get(run->jobs->config.store, job->id, bytes, size);
    }
    if (status == STORE_OK) {
        (void)snprintf(detail, sizeof detail, "%zu bytes, attempt %lld", *size,
                       (long long)job->attempt);
        jobs_log(run->jobs, "job-resumed", job, detail);
        jobs_run_resumed(run);
    }
    return status;
}

/* What an earlier attempt has left, once. On the thread of the run. */
static void open_kept(struct jobs_run *run)
{
    unsigned char *bytes = NULL;
    size_t size = 0;

    if (!run->kept.opened) {
        run->kept.opened = true;
        if (read_row(run, &bytes, &size) == STORE_OK) {
            (void)jobs_kept_read(&run->kept, bytes, size);
        }
        free(bytes);
    }
}

/* ---- The state of the process ---------------------------------------------------------------- */

int jobs_run_checkpoint_save(struct jobs_run *run, const void *bytes, size_t size)
{
    struct jobs_kept *kept = &run->kept;
    unsigned char *state = malloc(size ? size : 1), *all = NULL;
    size_t all_size = 0;
    int status = STORE_NOMEM;

    open_kept(run);
    if (!state) {
        return status;
    }
    memcpy(state, bytes, size);
    pthread_mutex_lock(&kept->mutex);
    free(kept->state);
    kept->state = state;
    kept->state_size = size;
    all = jobs_kept_write(kept, &all_size);
    pthread_mutex_unlock(&kept->mutex);
    if (all) {
        status = write_row(run, all, all_size, "state");
    }
    /* What its tasks so far have yielded is in the state. */
    if (status == STORE_OK && run->jobs->config.offers_tasks) {
        (void)store_tasks_drop_done(run->jobs->config.store, run->job->id);
    }
    free(all);
    return status;
}

int jobs_run_checkpoint_load(struct jobs_run *run, unsigned char **bytes, size_t *size)
{
    struct jobs_kept *kept = &run->kept;

    *bytes = NULL;
    *size = 0;
    open_kept(run);
    if (kept->state_size == 0) {
        return STORE_NOT_FOUND;
    }
    *bytes = malloc(kept->state_size);
    if (!*bytes) {
        return STORE_NOMEM;
    }
    memcpy(*bytes, kept->state, kept->state_size);
    *size = kept->state_size;
    return STORE_OK;
}

/* ---- The parts of the core ------------------------------------------------------------------- */

static bool recall(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    struct jobs_run *run = user;
    bool found = jobs_kept_recall(&run->kept, series, index, count, values);

    if (found) {
        jobs_run_resumed(run);
    }
    return found;
}

/* Writes the checkpoint that is in bytes, and says when the next is due. */
static void write_part(struct jobs_run *run, const unsigned char *bytes, size_t size)
{
    struct jobs_kept *kept = &run->kept;
    double before = run->context.seconds(run), now;

    (void)write_row(run, bytes, size, "parts");
    now = run->context.seconds(run);
    pthread_mutex_lock(&kept->mutex);
    kept->next = now + (COST * (now - before) > INTERVAL ? COST * (now - before) : INTERVAL);
    kept->writing = false;
    pthread_mutex_unlock(&kept->mutex);
}

static void keep(void *user, uint64_t series, uint64_t index, size_t count, const double *values)
{
    struct jobs_run *run = user;
    struct jobs_kept *kept = &run->kept;
    double now = run->context.seconds(run);
    unsigned char *bytes = NULL;
    size_t size = 0;

    jobs_kept_keep(kept, series, index, count, values);
    if (count == 0) {
        return; /* what was written stays until what follows from it is there */
    }
    pthread_mutex_lock(&kept->mutex);
    if (!kept->writing && now >= kept->next) {
        bytes = jobs_kept_write(kept, &size);
        kept->writing = bytes != NULL;
    }
    pthread_mutex_unlock(&kept->mutex);
    if (bytes) {
        write_part(run, bytes, size);
        free(bytes);
    }
}

void jobs_run_keep_parts(struct jobs_run *run)
{
    if (run->context.keep) {
        return;
    }
    open_kept(run);
    run->kept.next = run->context.seconds(run) + INTERVAL;
    run->context.recall = recall;
    run->context.keep = keep;
}
