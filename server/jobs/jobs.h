/*
 * jobs.h - the processes' engine: a queue in the store, worker threads, cache and joining by
 * digest, cancel, progress, and helpers among the workers for one job's parallel loops.
 *
 * The engine knows nothing of JSON: inputs and results are texts that it stores and hands on.
 * What a process is (its validation, its computation) comes as a table from the layer above.
 *
 * Threads: `workers` threads named srnfd-work-N claim accepted jobs, the owners in turn and of each
 * owner the one whose creation plus expected time is earliest. A worker without a job of its own
 * helps the parallel loops of running jobs. JOBS_EXPRESS_THREADS more, named srnfd-express, claim
 * only jobs that are expected to take at most JOBS_EXPRESS_SECONDS, one of these threads at a time:
 * such jobs start at once however many long ones run. OpenBLAS runs one thread per caller.
 */
#ifndef SRNFD_JOBS_H
#define SRNFD_JOBS_H

#include "ids.h"
#include "metrics.h"
#include "srnf.h"
#include "store_status.h"

struct store;      /* store/store.h */
struct store_job;  /* store/job.h */
struct store_page; /* store/page.h */

struct jobs;
struct jobs_run;

#define JOBS_DETAIL_MAX 400 /* bytes of what a problem says, with its zero */

/* How a run ended: exactly one of results (malloc, taken over by the engine) or problem_code is
   set. */
struct jobs_result {
    char *results;
    const char *problem_code; /* static string: "not-converged", "not-star-shaped", ... */
    char problem_detail[JOBS_DETAIL_MAX];
};

/* One row of the process table. run is called on a worker thread; inputs is the canonical text of
   submission. A run that sees cancellation returns with neither results nor problem. user is that
   of jobs_config. */
struct jobs_process {
    const char *id;
    void (*run)(struct jobs_run *run, void *user, const char *inputs, struct jobs_result *result);
    const void *definition; /* for run, by jobs_run_definition; may be NULL */
};

#define JOBS_EXPRESS_SECONDS 1.0
/* Seconds after which an express job was misjudged: another thread takes the lane. */
#define JOBS_EXPRESS_PATIENCE (2.0 * JOBS_EXPRESS_SECONDS)
#define JOBS_EXPRESS_THREADS 2
#define JOBS_CALM_DEFAULT 5.0
#define JOBS_EXPECTED_MAX 3600.0 /* what takes longer is not overtaken for longer */

struct jobs_config {
    struct store *store;
    size_t workers;                   /* 0: one per online processor */
    const struct jobs_process *table; /* ended by id NULL */
    void *user;
    const char *numeric_build; /* part of every cache key */
    size_t max_queued;         /* accepted jobs beyond this are refused; default 10,000 */
    double job_seconds;        /* a run that takes longer fails with time-limit; 0: no limit */
    size_t job_memory;         /* bytes; a run that needs more fails with memory-limit; 0: the
                                  worker's share of the machine (jobs/memory.h) */
    size_t job_cache;      /* bytes of what jobs_run_scratch has room for that are in memory; 0: an
                                  eighth of job_memory, 128 MiB at most */
    double calm_seconds;   /* a job that runs alone starts no sooner than this after the engine;
                                  0: JOBS_CALM_DEFAULT */
    const char *faulty;    /* the job that the daemon died of last time, "" or NULL: not known */
    double kept_encodings; /* bytes of encodings that are kept for later jobs; 0: none are */
    double retention_days; /* ended jobs are removed after so long; 0: never */
    double sweep_seconds;  /* between two looks at what may go; 0: none */
    /* trace: the traceparent that the job came with, or "". */
    void (*log)(void *user, const char *event, const char *job_id, const char *trace,
                const char *detail);
    /* Called, on any thread and without locks held, whenever a job ended or its row changed. */
    void (*changed)(void *user, const char *job_id);
    /* The same, but only for progress and message of a running job; may be NULL. */
    void (*progressed)(void *user, const char *job_id);
    double lease_seconds; /* of tasks, without a sign of the worker; 0: JOBS_LEASE_SECONDS */
    double task_seconds;  /* of a lease, without a result; 0: JOBS_TASK_SECONDS */
    double verify_tasks;  /* share of results of tasks that are computed again, 0 .. 1 */
    bool offers_tasks;    /* to workers on other machines (jobs/tasks.h) */
    /* Called, on any thread and without locks held, whenever there are tasks to lease; may be
       NULL. */
    void (*offered)(void *user);
    struct metrics *metrics; /* NULL: nothing is counted */
};

enum jobs_status {
    JOBS_OK = 0,
    JOBS_QUEUE_FULL = -101,
    JOBS_NO_SUCH_PROCESS = -102,
    JOBS_IDEMPOTENCY_MISMATCH = -103, /* the key was used with another body */
    JOBS_CLOSED = -104,
    /* anything else negative is an enum store_status */
};

/* Recovers the queue and starts the workers. What ran when the daemon died is put back; after three
   deaths it runs alone (alone.c), and only if the daemon dies then has the job failed. Where the
   faulty job is known it alone has failed, and no death is counted with the others (fault.c). */
int jobs_open(struct jobs **out, const struct jobs_config *config);
/* From now on no job is claimed; those that run go on, and what is accepted waits for the next
   start. Before jobs_close, which does it otherwise. */
void jobs_drain(struct jobs *jobs);
/* Drains: no new claims, running jobs get grace_seconds to end, then are cancelled and put back
   to accepted without losing an attempt. */
void jobs_close(struct jobs *jobs, double grace_seconds);

/* Idempotent; an accepted job is dismissed at once, a running one when its run notices. */
int jobs_cancel(struct jobs *jobs, const char *id, struct store_job *job);
/* As store_job_get, with the live progress, message and time of the last change of a running job,
   the seconds that it is expected to take from then on, and the place of an accepted one. */
int jobs_get(struct jobs *jobs, const char *id, struct store_job *job);
/* As store_job_list, with the same of running jobs; places are left to jobs_places. */
int jobs_page(struct jobs *jobs, const struct store_page *page,
              bool (*visit)(void *user, const struct store_job *job), void *user);
/* Sets the place of an accepted job among those that wait. Not inside a visit. */
int jobs_place(struct jobs *jobs, struct store_job *job);
/* As store_job_places: the places of many. Not inside a visit. */
int jobs_places(struct jobs *jobs, bool (*visit)(void *user, const char *id, size_t position),
                void *user);

size_t jobs_worker_count(const struct jobs *jobs);
/* Of this service: struct jobs_config. */
const char *jobs_numeric_build(const struct jobs *jobs);
/* Bytes that a job may have in use. */
size_t jobs_memory_limit(const struct jobs *jobs);
/* Bytes of what jobs_run_scratch has room for that a job may hold in memory. */
size_t jobs_cache_limit(const struct jobs *jobs);

/* What the engine does at this moment. */
struct jobs_health {
    size_t workers;                              /* as many as there should be */
    size_t alive;                                /* threads that run */
    size_t busy;                                 /* with a job of their own */
    size_t express, express_alive, express_busy; /* of the threads of short jobs, beside those */
    size_t queued;                               /* accepted jobs */
    size_t queue_limit;                          /* of accepted jobs */
    bool closing;
};
void jobs_health(struct jobs *jobs, struct jobs_health *health);

/* ---- For the code of a process --------------------------------------------------------------- */

struct store *jobs_run_store(struct jobs_run *run);
const char *jobs_run_job_id(const struct jobs_run *run);
/* That of the row of its process. */
const void *jobs_run_definition(const struct jobs_run *run);
/* That its results are computed with. */
const char *jobs_run_numeric_build(const struct jobs_run *run);
/* Whose job it is, and so whom its outputs belong to. */
const char *jobs_run_owner(const struct jobs_run *run);
/* Why what a run wanted to keep was refused with STORE_QUOTA. */
void jobs_run_quota_detail(const struct jobs_run *run, const char *what,
                           char detail[JOBS_DETAIL_MAX]);
/* Progress, cancellation, parallel_for over idle workers (the caller takes part) and the clock,
   for the core. */
const struct srnf_context *jobs_run_context(struct jobs_run *run);
/* Begins the next phase of a job that computes one thing after another: progress reported from now
   on moves that of the job by `share` percent of the whole, from where the phase before ended, to
   100 at most. Without phases the job is one. A job's progress never falls within an attempt. */
void jobs_run_phase(struct jobs_run *run, double share);
/* Where a run can go on from, should the daemon end before the job does. save replaces what was
   saved before, durably; the engine drops it when the job ends. load finds what an earlier attempt
   of this job has saved with the same numeric build (bytes: malloc), otherwise STORE_NOT_FOUND. A
   run that cannot save goes on: only a crash would cost more. Both are told in the log
   (job-checkpoint, job-resumed). */
int jobs_run_checkpoint_save(struct jobs_run *run, const void *bytes, size_t size);
int jobs_run_checkpoint_load(struct jobs_run *run, unsigned char **bytes, size_t *size);
/* From now on the run's context keeps the parts that the core says are dear (srnf_context.keep), 64
   MiB of them at most, in the run's checkpoint beside what was saved, about every second, and
   recalls those of earlier attempts. */
void jobs_run_keep_parts(struct jobs_run *run);
/* From now on the run's context has this member search (srnf_context.search); user: the run. */
void jobs_run_search_by(struct jobs_run *run,
                        int (*search)(void *user, const struct srnf_field_search *search,
                                      struct srnf_error *error));
/* The same for the member measure. */
void jobs_run_measure_by(struct jobs_run *run,
                         int (*measure)(void *user, const struct srnf_pair_search *pairs,
                                        struct srnf_error *error));
/* What the job fails with, should its process end with no results: for what happens beneath the
   core, which passes on no more than a status. The first one counts. On the thread of the run. */
void jobs_run_fail(struct jobs_run *run, const struct jobs_result *result);
/* Room outside of memory for what a large job has: a file of the job, which its next attempt finds
   as it was and which goes with its end; `used` is the end of what it has at this call. NULL: there
   is none, which fails the job. On the thread of the run. */
const struct srnf_scratch *jobs_run_scratch(struct jobs_run *run);
/* Bytes of encodings that may be kept for later jobs; 0: none are. */
int64_t jobs_run_encodings_limit(const struct jobs_run *run);
/* Count an encoding, or a prepared mesh, that was needed: found as it was kept, or made anew. */
void jobs_run_count_encoding(struct jobs_run *run, bool kept);
void jobs_run_count_mesh(struct jobs_run *run, bool kept);
/* A mesh whose encoding is an answer, but a poor one (srnf_encode_judge), or whose coordinates are
   coarse, or not where its file has a transform to. */
#define JOBS_COARSE 0.1 /* struct srnf_mesh_report: shifts area by some thousandths */
struct jobs_doubt {
    char mesh[STORE_ID_MAX];
    char surface[STORE_ID_MAX]; /* that the encoding stood in for (compute/bridge.h), or "" */
    size_t degree;
    double coarseness; /* of the mesh */
    bool untransformed;
    struct srnf_judgement judgement;
};
/* Notes it for the results, once for a mesh, surface and degree; from any thread of the run. False
   without memory. */
bool jobs_run_doubt(struct jobs_run *run, const struct jobs_doubt *doubt);
/* What was noted so far, sorted by mesh: to be read when nothing of the run computes any more, and
   until the run ends. Returns how many. */
size_t jobs_run_doubts(struct jobs_run *run, const struct jobs_doubt **list);
/* Transforms are dear to make: one per (degree, kind, n_theta, n_phi), shared by all, kept until
   jobs_close (least recently used beyond 16 leave when nobody holds them). */
int jobs_transform_acquire(struct jobs *jobs, size_t degree, enum srnf_grid_kind kind,
                           size_t n_theta, size_t n_phi, const struct srnf_sht **sht);
void jobs_transform_release(struct jobs *jobs, const struct srnf_sht *sht);
/* Numbers that are dear to compute and follow from little, kept for all jobs of this start: the
   latest 512, by the SHA-256 of all that they follow from, in hexadecimal digits. */
#define JOBS_FIGURES 6
bool jobs_figures_find(struct jobs *jobs, const char digest[65], double values[JOBS_FIGURES]);
void jobs_figures_keep(struct jobs *jobs, const char digest[65], const double values[JOBS_FIGURES]);
struct jobs *jobs_run_jobs(struct jobs_run *run);

#endif
