/*
 * queue.c - submitting and cancelling.
 *
 * A submission first looks for the job that its Idempotency-Key named, then for a job with the
 * same digest, and only then adds a row. Between the look and the row another thread may have
 * done the same: the store then refuses the row (STORE_CONFLICT: a unique index on the digests of
 * live jobs, the key's primary key), and the submission looks again. So identical work is queued
 * once, without a lock held across the store.
 *
 * The digest is SHA-256 over process, newline, inputs, newline, numeric build, and for an owner
 * with a name newline and that. So identical work of two owners is done twice. In the store a key
 * has the owner's name before it, with a newline between, which no name has.
 */
#include "jobs/internal.h"

#include "jobs/submit.h"
#include "store/digest.h"
#include "store/job.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Looks before the submission gives up with STORE_CONFLICT: each further one means that a job
   ended, was dismissed or deleted in the very moment between look and row. */
#define LOOKS_MAX 16

/* What one submission carries along. */
struct submission {
    const struct jobs_process *process;
    const struct jobs_owner *owner;
    const char *inputs, *key, *body_digest;
    char digest[65];
};

int jobs_digest(const char *process, const char *inputs, const char *build, const char *owner,
                char digest[65])
{
    const char *const parts[] = {process, "\n", inputs, "\n", build, owner[0] ? "\n" : "", owner};
    size_t size = 0, at = 0;
    char *text;

    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        size += strlen(parts[i]);
    }
    text = malloc(size + 1);
    if (!text) {
        return STORE_NOMEM;
    }
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        size_t n = strlen(parts[i]);

        memcpy(text + at, parts[i], n);
        at += n;
    }
    store_sha256_hex(digest, text, size);
    free(text);
    return STORE_OK;
}

static int make_digest(struct jobs *jobs, struct submission *s)
{
    const char *build = jobs->config.numeric_build ? jobs->config.numeric_build : "";

    return jobs_digest(s->process->id, s->inputs, build, s->owner->name, s->digest);
}

static enum jobs_submission joined_or_cached(const struct store_job *job)
{
    return job->status == STORE_JOB_SUCCESSFUL ? JOBS_CACHED : JOBS_JOINED;
}

/* The job of the key; STORE_NOT_FOUND when the key is new. */
static int find_by_key(struct jobs *jobs, const struct submission *s, struct store_job *job)
{
    char id[STORE_ID_MAX], body_digest[65];
    int status = store_idempotency_find(jobs->config.store, s->key, id, body_digest);

    if (status != STORE_OK) {
        return status;
    }
    if (strcmp(body_digest, s->body_digest) != 0) {
        return JOBS_IDEMPOTENCY_MISMATCH;
    }
    return jobs_get(jobs, id, job);
}

/* The job that does or did the same work; its key, if there is one, is then remembered for it. */
static int find_by_digest(struct jobs *jobs, const struct submission *s, struct store_job *job)
{
    int status = store_job_find(jobs->config.store, s->digest, job);

    if (status == STORE_OK && s->key) {
        status = store_idempotency_put(jobs->config.store, s->key, job->id, s->body_digest);
        if (status != STORE_OK) {
            store_job_clear(job);
        }
    }
    return status;
}

/* Room for one more accepted job. */
static int reserve(struct jobs *jobs)
{
    int status = JOBS_OK;

    pthread_mutex_lock(&jobs->mutex);
    if (atomic_load(&jobs->closing)) {
        status = JOBS_CLOSED;
    } else if (jobs->accepted >= jobs->config.max_queued) {
        status = JOBS_QUEUE_FULL;
    } else {
        jobs->accepted++;
    }
    pthread_mutex_unlock(&jobs->mutex);
    return status;
}

static void unreserve(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->mutex);
    jobs->accepted -= jobs->accepted > 0 ? 1 : 0;
    pthread_mutex_unlock(&jobs->mutex);
}

static void issue_ticket(struct jobs *jobs, bool express)
{
    pthread_mutex_lock(&jobs->mutex);
    atomic_fetch_add(&jobs->tickets, 1);
    pthread_cond_signal(&jobs->wake);
    if (express) {
        jobs->express_issued++;
        pthread_cond_broadcast(&jobs->express_wake);
    }
    pthread_mutex_unlock(&jobs->mutex);
}

static void expect(struct store_job *job, double seconds)
{
    if (seconds > 0.0) {
        job->expected_ms = (int64_t)ceil(1e3 * fmin(seconds, JOBS_EXPECTED_MAX));
        job->express = seconds <= JOBS_EXPRESS_SECONDS;
    }
}

static int fill(struct jobs *jobs, const struct submission *s, struct store_job *job)
{
    const char *build = jobs->config.numeric_build ? jobs->config.numeric_build : "";

    *job = (struct store_job){.status = STORE_JOB_ACCEPTED};
    jobs_id_next(&jobs->ids, job->id, &job->created_ms);
    memcpy(job->digest, s->digest, sizeof job->digest);
    (void)snprintf(job->owner, sizeof job->owner, "%s", s->owner->name);
    (void)snprintf(job->trace, sizeof job->trace, "%s", s->owner->trace ? s->owner->trace : "");
    job->updated_ms = job->created_ms;
    expect(job, s->owner->seconds);
    job->process = strdup(s->process->id);
    job->inputs = strdup(s->inputs);
    job->message = strdup("");
    job->numeric_build = strdup(build);
    if (!job->process || !job->inputs || !job->message || !job->numeric_build) {
        store_job_clear(job);
        return STORE_NOMEM;
    }
    return STORE_OK;
}

static int add(struct jobs *jobs, const struct submission *s, struct store_job *job)
{
    int status = reserve(jobs);

    if (status != JOBS_OK) {
        return status;
    }
    status = fill(jobs, s, job);
    if (status == STORE_OK) {
        status =
            store_job_insert(jobs->config.store, job, &s->owner->limits, s->key, s->body_digest);
    }
    if (status != STORE_OK) {
        store_job_clear(job);
        unreserve(jobs);
        return status;
    }
    jobs_log(jobs, "job-accepted", job, job->process);
    issue_ticket(jobs, job->express);
    jobs_changed(jobs, job->id);
    return JOBS_OK;
}

/* One look, and the row if nothing was found. STORE_CONFLICT: look again. */
static int submit_once(struct jobs *jobs, const struct submission *s, struct store_job *job,
                       enum jobs_submission *how)
{
    int status = s->key ? find_by_key(jobs, s, job) : STORE_NOT_FOUND;

    if (status == STORE_NOT_FOUND) {
        status = find_by_digest(jobs, s, job);
    }
    if (status == STORE_OK) {
        *how = joined_or_cached(job);
        return JOBS_OK;
    }
    if (status == STORE_NOT_FOUND) {
        *how = JOBS_NEW;
        status = add(jobs, s, job);
    }
    return status;
}

/* The key as the store has it (malloc), or NULL without memory. */
static char *owned_key(const struct jobs_owner *owner, const char *key)
{
    size_t length = strlen(owner->name), size = length + strlen(key) + 2;
    char *text = malloc(size);

    if (text) {
        snprintf(text, size, "%s%s%s", owner->name, length ? "\n" : "", key);
    }
    return text;
}

static int submit(struct jobs *jobs, struct submission *s, struct store_job *job,
                  enum jobs_submission *how)
{
    int status = make_digest(jobs, s);

    if (status != STORE_OK) {
        return status;
    }
    status = STORE_CONFLICT;
    for (int look = 0; look < LOOKS_MAX && status == STORE_CONFLICT; look++) {
        status = submit_once(jobs, s, job, how);
    }
    return status;
}

int jobs_submit(struct jobs *jobs, const struct jobs_owner *owner, const char *process,
                const char *inputs, const char *idempotency_key, const char *body_digest,
                struct store_job *job, enum jobs_submission *how)
{
    static const struct jobs_owner nobody = {.name = ""};
    struct submission s = {.process = jobs_process_find(jobs, process),
                           .owner = owner ? owner : &nobody,
                           .inputs = inputs,
                           .body_digest = body_digest ? body_digest : ""};
    char *key = NULL;
    int status;

    *job = (struct store_job){0};
    *how = JOBS_NEW;
    if (!s.process) {
        return JOBS_NO_SUCH_PROCESS;
    }
    if (idempotency_key) {
        key = owned_key(s.owner, idempotency_key);
        if (!key) {
            return STORE_NOMEM;
        }
        s.key = key;
    }
    status = submit(jobs, &s, job, how);
    free(key);
    if (status == JOBS_OK) {
        static const char *const names[] = {"new", "joined", "cached"};

        metrics_add(jobs->config.metrics, METRIC_JOBS_SUBMITTED,
                    METRIC_LABELS(s.process->id, names[*how]), 1);
    }
    return status;
}

/* Tells the run of this job, if it is here, and those who are just claiming. */
static void flag_run(struct jobs *jobs, const char *id)
{
    pthread_mutex_lock(&jobs->mutex);
    jobs->cancellations++;
    for (size_t i = 0; i < jobs->n_slots; i++) {
        struct jobs_run *run = jobs->slots[i];

        if (run && strcmp(run->job->id, id) == 0) {
            atomic_store(&run->cancel, true);
        }
    }
    pthread_mutex_unlock(&jobs->mutex);
}

/* Dismisses a job that waits. STORE_CONFLICT: it no longer does. */
static int dismiss(struct jobs *jobs, const struct store_job *job)
{
    int status = store_job_transition(jobs->config.store, job->id, job->attempt,
                                      STORE_JOB_DISMISSED, NULL, NULL, NULL);

    if (status == STORE_OK) {
        unreserve(jobs);
        jobs_log(jobs, "job-dismissed", job, "");
        metrics_add(jobs->config.metrics, METRIC_JOBS_ENDED,
                    METRIC_LABELS(job->process, store_job_status_name(STORE_JOB_DISMISSED)), 1);
        jobs_changed(jobs, job->id);
    }
    return status;
}

/* Asks a job that runs to stop, and its run to notice. */
static int ask_to_stop(struct jobs *jobs, const char *id, struct store_job *job)
{
    bool asked_before = job->cancel_requested;
    int status;

    store_job_clear(job);
    status = store_job_request_cancel(jobs->config.store, id, job);
    if (status == STORE_OK) {
        flag_run(jobs, id);
        if (!asked_before) {
            jobs_log(jobs, "job-cancel-requested", job, "");
            jobs_changed(jobs, id);
        }
    }
    return status;
}

int jobs_cancel(struct jobs *jobs, const char *id, struct store_job *job)
{
    int status = STORE_CONFLICT;

    for (int look = 0; look < LOOKS_MAX && status == STORE_CONFLICT; look++) {
        status = store_job_get(jobs->config.store, id, job);
        if (status == STORE_OK && job->status == STORE_JOB_ACCEPTED) {
            status = dismiss(jobs, job);
            store_job_clear(job);
            status = status == STORE_OK ? store_job_get(jobs->config.store, id, job) : status;
        } else if (status == STORE_OK && job->status == STORE_JOB_RUNNING) {
            status = ask_to_stop(jobs, id, job);
        }
    }
    return status;
}
