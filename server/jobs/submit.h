/*
 * submit.h - asking the engine for a job.
 */
#ifndef SRNFD_JOBS_SUBMIT_H
#define SRNFD_JOBS_SUBMIT_H

#include "jobs/jobs.h"
#include "store/holdings.h"

enum jobs_submission { JOBS_NEW, JOBS_JOINED, JOBS_CACHED };

/* Whose job it is, what the owner may have, in which trace it is asked for, and how long it is
   expected to take. */
struct jobs_owner {
    const char *name; /* shorter than STORE_OWNER_MAX */
    struct store_job_limits limits;
    const char *trace; /* traceparent that a new job is part of (NULL: none), kept with it */
    double seconds;    /* that a new job is expected to take; 0: not known, and so not short */
};

/* Accepts a job: durable when it returns. An identical successful job answers from the cache, an
   identical accepted or running one is joined; neither writes anything but the Idempotency-Key, if
   one is given. The same key with the same body_digest names the same job again, whatever has
   become of it. Cache, joining and keys are each owner's own: nobody learns from an answer, or from
   its time, what another has computed.
     owner            [in] NULL: the owner "" without limits
     inputs           [in] canonical text
     idempotency_key  [in] NULL: none; body_digest then counts for nothing
     job              [out] to be cleared
   Errors: jobs_status, or STORE_*. STORE_QUEUED: as many of the owner's jobs wait as may;
   STORE_QUOTA: the owner holds as many bytes as it may. */
int jobs_submit(struct jobs *jobs, const struct jobs_owner *owner, const char *process,
                const char *inputs, const char *idempotency_key, const char *body_digest,
                struct store_job *job, enum jobs_submission *how);

/* The digest by which a job is found again: of what it computes, by what, and for whom (build: the
   numeric build). STORE_OK or STORE_NOMEM. */
int jobs_digest(const char *process, const char *inputs, const char *build, const char *owner,
                char digest[65]);

#endif
