/*
 * job.h - jobs in the store: their states, results, keys and checkpoints.
 */
#ifndef SRNFD_STORE_JOB_H
#define SRNFD_STORE_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "store_status.h"

struct store;
struct store_page;       /* store/page.h */
struct store_job_limits; /* store/holdings.h */

enum store_job_status {
    STORE_JOB_ACCEPTED,
    STORE_JOB_RUNNING,
    STORE_JOB_SUCCESSFUL,
    STORE_JOB_FAILED,
    STORE_JOB_DISMISSED,
};
/* "accepted", "running", "successful", "failed", "dismissed". */
const char *store_job_status_name(enum store_job_status status);

#define STORE_TRACE_MAX 56 /* bytes of a traceparent (W3C Trace Context) with its zero */

struct store_job {
    char id[STORE_ID_MAX]; /* job- + UUIDv7 */
    char *process;
    enum store_job_status status;
    char *inputs;    /* canonical text after defaulting */
    char digest[65]; /* cache key: SHA-256 of owner, process, inputs, build (queue.c) */
    char *message;   /* may be empty */
    double progress; /* 0 .. 100; < 0: unknown */
    int64_t created_ms, started_ms, finished_ms, updated_ms; /* 0: not yet */
    int64_t attempt;                                         /* 0 before the first claim */
    bool cancel_requested;
    char *problem_code; /* of a failed job, otherwise NULL */
    char *problem_detail;
    char *numeric_build;
    char *name, *tags; /* the owner's, tags as a JSON array; not set for insert */
    char owner[STORE_OWNER_MAX];
    char trace[STORE_TRACE_MAX]; /* traceparent of the submission, or "" */
    int64_t expected_ms;         /* how long it is expected to take; 0: not known */
    bool express;                /* so short that store_job_claim_express may take it */
    /* Of no row; 0 and below 0 as the store reads a job. What is told of it at this moment
       (jobs/live.c): its place among accepted jobs, 1 the next, and the seconds that a running one
       still takes. */
    size_t queue_position;
    double seconds_left;
};
void store_job_clear(struct store_job *job);

/* Adds an accepted job, with its Idempotency-Key if that is not NULL. STORE_CONFLICT: the id or
   the key is taken, or a job with this digest is accepted, running or successful already (those
   being cancelled do not count). limits (NULL: none) is what the owner of the job may have:
   STORE_QUEUED where so many of the owner's jobs are waiting, STORE_QUOTA where the owner holds
   more bytes. Their running is kept with the owner, for claims. */
int store_job_insert(struct store *store, const struct store_job *job,
                     const struct store_job_limits *limits, const char *idempotency_key,
                     const char *body_digest);
int store_job_get(struct store *store, const char *id, struct store_job *job);
/* Newest job with this digest that is accepted, running (and not being cancelled) or successful. */
int store_job_find(struct store *store, const char *digest, struct store_job *job);
/* results is allocated with malloc; STORE_CONFLICT when the job is not successful. */
int store_job_results(struct store *store, const char *id, char **results, size_t *size);
/* The same from memory, for small results that were read since the last write (recent.c):
   STORE_NOT_FOUND where they are not there. Costs a lock and a copy; results NULL: only asks. */
int store_job_results_recent(struct store *store, const char *id, char **results, size_t *size);
/* The next job becomes running, attempt + 1: of the owner whose turn it is, the accepted one whose
   created_ms + expected_ms comes first. STORE_NOT_FOUND when no job waits, STORE_CONFLICT when
   those that do belong to owners who have as many running as they may. */
int store_job_claim(struct store *store, struct store_job *job);
/* The same among express jobs only. `except`, unless NULL, is an owner to be passed over, if there
   are others: STORE_CONFLICT when only jobs of that one wait. */
int store_job_claim_express(struct store *store, const char *except, struct store_job *job);
/* The same among the jobs that are to run with no other job beside them, which the two above leave
   out; and how many of these wait. */
int store_job_claim_alone(struct store *store, struct store_job *job);
int store_job_count_alone(struct store *store, size_t *count);
/* The place of an accepted job in the order of claims as things stand, 1 the next; 0 for a job that
   does not wait, or is not there. Owners' limits on running jobs and express claims are left out.
   O(jobs that wait), each a step along an index. */
int store_job_position(struct store *store, const char *id, size_t *position);
/* The same of all that wait, in their order, until visit returns false: one look at the queue. No
   call into the store from inside visit. */
int store_job_places(struct store *store,
                     bool (*visit)(void *user, const char *id, size_t position), void *user);
/* Apart from cancellation and recovery, the one function in which a job ends or goes back: a
 * transition table and one UPDATE guarded by
   status and attempt; STORE_CONFLICT when the guard does not hold. results only with SUCCESSFUL,
   a problem only with FAILED. STORE_QUOTA: the owner may not hold the results; nothing has changed.
 */
int store_job_transition(struct store *store, const char *id, int64_t attempt,
                         enum store_job_status to, const char *results, const char *problem_code,
                         const char *problem_detail);
/* accepted becomes dismissed, running gets cancel_requested, an ended job stays as it is. */
int store_job_request_cancel(struct store *store, const char *id, struct store_job *job);
/* Ended jobs only, otherwise STORE_CONFLICT. */
int store_job_delete(struct store *store, const char *id);
int store_job_list(struct store *store, const struct store_page *page,
                   bool (*visit)(void *user, const struct store_job *job), void *user);
int store_job_count(struct store *store, enum store_job_status status, size_t *count);
/* At start: what the rows call running the daemon has died with. running -> accepted, from the
   deaths_max-th death on to run alone; running alone -> failed (attempts-exhausted). Counts both.
   What was being cancelled is dismissed. named: the job that the fault has named (NULL, "": none).
   If that ran, it alone has failed (job-crashed); the others are put back as they were, and no
   death is counted. */
int store_job_recover(struct store *store, int64_t deaths_max, const char *named, size_t *requeued,
                      size_t *failed);
/* The job that an Idempotency-Key of the last 24 h named; STORE_NOT_FOUND otherwise. */
int store_idempotency_find(struct store *store, const char *key, char job_id[STORE_ID_MAX],
                           char body_digest[65]);

/* Remembers a key for a job that exists; STORE_CONFLICT when the key is taken. */
int store_idempotency_put(struct store *store, const char *key, const char *job_id,
                          const char *body_digest);

/* What a running job needs to go on from where it is, should the daemon end: replaced as a whole,
   and dropped when the job ends. STORE_CONFLICT: this attempt of the job does not run. */
int store_checkpoint_put(struct store *store, const char *job, int64_t attempt, const void *bytes,
                         size_t size);
/* bytes is allocated with malloc; STORE_NOT_FOUND when there is none. */
int store_checkpoint_get(struct store *store, const char *job, unsigned char **bytes, size_t *size);

/* Removes the jobs that ended before this moment, as store_job_delete does. */
int store_expire_jobs(struct store *store, int64_t before_ms, size_t *removed);

#endif
