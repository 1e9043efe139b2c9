/*
 * internal.h - what the files of the engine share: the struct behind the handle, a run, a
 * parallel loop.
 *
 * Locks, by rank; none is held across a call into the store, the core or BLAS. Two are held at once
 * only in these orders: jobs->mutex, run->mutex; rounds.mutex, remotes.mutex.
 *
 *   20 jobs->mutex: tickets' waiters, the slots of running jobs, open loops, counts, closing
 *
 *   21 run->mutex: the message of a run, and its doubts
 *
 *   22 transforms.mutex: the cache of transforms
 *
 *   23 ids.mutex: the last id given out
 *
 *   24 retention.mutex: that the retention is to end
 *
 *   25 kept.mutex: what a run keeps for a later attempt
 *
 *   26 rounds.mutex: open rounds of tasks and their slots
 *
 *   27 remotes.mutex: the table of workers on other machines
 *
 *   28 passes.mutex: the tokens of pilots
 *
 *   29 figures.mutex: numbers that were computed lately
 */
#ifndef SRNFD_JOBS_INTERNAL_H
#define SRNFD_JOBS_INTERNAL_H

#include <pthread.h>
#include <stdatomic.h>

#include "jobs/fault.h"
#include "jobs/jobs.h"
#include "jobs/memory.h"
#include "jobs/rounds.h"

struct store_job; /* store/job.h */

/* Deaths of the daemon with a job after which that runs alone. */
#define JOBS_DEATHS_MAX 3
#define JOBS_QUEUE_DEFAULT 10000

/* ---- Parallel loops (parallel.c) ------------------------------------------------------------- */

/* The one loop that a run may have open at a time. count, body, argument and memory are set before
   it is published. */
struct jobs_loop {
    size_t count;
    void (*body)(void *argument, size_t index);
    void *argument;
    struct jobs_memory *memory; /* of the run, for helpers */
    const char *job, *process;  /* the same */
    atomic_size_t next;         /* the first index that nobody has taken; may pass count */
    atomic_bool open;           /* from before the first call of body until after the last one */
    size_t helpers;             /* workers inside, other than the caller; jobs->mutex */
    pthread_cond_t left;        /* the last helper has gone; jobs->mutex */
    struct jobs_loop *link;     /* list of published loops; jobs->mutex */
};

/* The body of srnf_context.parallel_for. user: struct jobs_run. */
void jobs_parallel_for(void *user, size_t count, void (*body)(void *argument, size_t index),
                       void *argument);
/* A published loop with work left, entered as a helper; NULL if none. jobs->mutex is held. */
struct jobs_loop *jobs_loop_enter(struct jobs *jobs);
/* Works until the loop is empty or a job waits for a worker. Without jobs->mutex. */
void jobs_loop_help(struct jobs *jobs, struct jobs_loop *loop);

/* ---- Checkpoints (kept.c) -------------------------------------------------------------------- */

struct jobs_part {
    uint64_t series, index;
    size_t count; /* of the values, at least 1 */
    double one;   /* the value where there is one */
    double *many; /* [count] otherwise */
    bool owned;   /* many is a block of its own */
};

struct jobs_kept {
    pthread_mutex_t mutex;
    bool opened;             /* what an earlier attempt has left was read; thread of the run */
    struct jobs_part *parts; /* [n], those of earlier attempts first; mutex */
    size_t n, capacity;      /* mutex */
    size_t bytes;            /* that the parts take in a checkpoint; mutex */
    unsigned char *state;    /* [state_size] of the process; mutex */
    size_t state_size;       /* mutex */
    struct jobs_part *old;   /* [recalled] of earlier attempts, by series and index; fixed */
    size_t recalled;
    double *old_values; /* of old, fixed */
    double next;        /* when the next checkpoint is due, by the run's clock; mutex */
    bool writing;       /* somebody writes one; mutex */
};

void jobs_kept_init(struct jobs_kept *kept);
void jobs_kept_destroy(struct jobs_kept *kept);
/* As bytes (malloc), NULL without memory; and back, false where these are no such bytes. kept is as
   initialized. */
unsigned char *jobs_kept_write(const struct jobs_kept *kept, size_t *size);
bool jobs_kept_read(struct jobs_kept *kept, const unsigned char *bytes, size_t size);
/* The values [count] of the part as an earlier attempt has left them; false: it has left none. */
bool jobs_kept_recall(const struct jobs_kept *kept, uint64_t series, uint64_t index, size_t count,
                      double *values);
/* Keeps a copy of the values [count] of a part, as far as there is room; count 0 drops all parts of
   the series. From any thread. */
void jobs_kept_keep(struct jobs_kept *kept, uint64_t series, uint64_t index, size_t count,
                    const double *values);

/* ---- Scratch (scratch.c) --------------------------------------------------------------------- */

struct store_scratch; /* store/scratch.h */
struct jobs_scratch {
    struct store_scratch *file; /* NULL: none was asked for */
    struct srnf_scratch lent;
    atomic_uint_fast64_t end; /* of all that was written */
    atomic_int failed;        /* STORE_* of the first write or read that did, or STORE_OK */
};
/* Where scratch has failed, that is the problem. */
void jobs_scratch_judge(const struct jobs_run *run, struct jobs_result *result);
void jobs_scratch_close(struct jobs_run *run);

/* ---- Runs (run.c) ---------------------------------------------------------------------------- */

#define JOBS_MESSAGE_MAX 160

/* What the encodings of a run are to be doubted for (doubts.c). */
struct jobs_doubts {
    struct jobs_doubt *list; /* [count], malloc */
    size_t count, capacity;
};

/* One job on one worker. Lives on the worker's stack; its slot makes it known to others. */
struct jobs_run {
    struct jobs *jobs;
    struct store_job *job;
    const void *definition; /* of its process */
    struct srnf_context context;
    struct jobs_loop loop;
    atomic_bool cancel;         /* a user has asked for it */
    double deadline;            /* by the monotonic clock; INFINITY without a limit */
    atomic_bool overran;        /* it was told to stop because of that */
    atomic_bool yields;         /* it is to be put back before it ends: it only waits for workers */
    atomic_bool stopping;       /* it has asked, and was told to stop, for whatever reason */
    struct jobs_memory *memory; /* its worker's */
    pthread_mutex_t mutex;
    double progress;                /* 0 .. 100, never falls; mutex */
    int64_t updated_ms;             /* of progress or message; mutex */
    double seconds_left;            /* as of updated_ms; < 0: unknown; mutex */
    bool resumed;                   /* the next step is that of an earlier attempt; mutex */
    double base, base_seconds;      /* where this run's own progress began, and when; mutex */
    double from, to;                /* of the job, in percent: the phase that runs; mutex */
    bool phased;                    /* a phase was begun; until then there is one, the job; mutex */
    char message[JOBS_MESSAGE_MAX]; /* mutex */
    struct jobs_kept kept;
    struct jobs_scratch scratch;
    struct jobs_doubts doubts; /* mutex */
    struct jobs_result failed; /* jobs_run_fail; its thread's */
};

void jobs_run_init(struct jobs_run *run, struct jobs *jobs, struct store_job *job,
                   struct jobs_memory *memory);
void jobs_run_destroy(struct jobs_run *run);
/* The next progress is that of an earlier attempt: it tells nothing of the pace. */
void jobs_run_resumed(struct jobs_run *run);
/* The run stops and its job is put back. */
void jobs_run_yield(struct jobs_run *run);
/* Whether the computation has been told to stop: from then on what it makes is unfinished. */
bool jobs_run_stopping(const struct jobs_run *run);

/* ---- Its end (execute.c) --------------------------------------------------------------------- */

/* Runs the claimed job to its end and writes how it ended. On a worker. */
void jobs_run_execute(struct jobs_run *run);

/* ---- Jobs that run alone (alone.c) ----------------------------------------------------------- */

struct jobs_alone {
    size_t waiting;   /* accepted jobs that are to run alone, at most; jobs->mutex */
    bool runs;        /* one of them does; jobs->mutex */
    double from;      /* no such job starts before, by the monotonic clock */
    atomic_bool hold; /* no other job is to start; written with jobs->mutex held */
};

/* Whether no other job is to start; jobs->mutex is held. */
bool jobs_alone_holds(struct jobs *jobs);
/* Whether a worker is to claim such a job now; jobs->mutex is held. */
bool jobs_alone_is_due(struct jobs *jobs);
/* Waits for work, or until such a job may start; jobs->mutex is held. */
void jobs_alone_wait(struct jobs *jobs);

/* ---- Ids (ids.c) ----------------------------------------------------------------------------- */

struct jobs_ids {
    pthread_mutex_t mutex;
    uint64_t last_ms;
    uint16_t counter; /* 12 bits */
};

/* "job-" and a UUIDv7 greater than all that this source has given before. */
void jobs_id_next(struct jobs_ids *ids, char id[STORE_ID_MAX], int64_t *created_ms);

/* ---- Letting go (retention.c) ---------------------------------------------------------------- */

struct jobs_retention {
    pthread_t thread;
    bool started;
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    bool closing;
};
/* Starts the thread, where the configuration asks for one. */
int jobs_retention_start(struct jobs *jobs);
void jobs_retention_stop(struct jobs *jobs);

/* ---- Transforms (transforms.c) --------------------------------------------------------------- */

struct jobs_transform;
struct jobs_transforms {
    pthread_mutex_t mutex;
    pthread_cond_t made;
    struct jobs_transform *first; /* most recently used first */
    size_t count;
};

void jobs_transforms_init(struct jobs_transforms *transforms);
void jobs_transforms_destroy(struct jobs_transforms *transforms);

/* ---- Figures (figures.c) --------------------------------------------------------------------- */

#define JOBS_FIGURES_KEPT 512

struct jobs_figure {
    char digest[65]; /* empty: none */
    double values[JOBS_FIGURES];
};
struct jobs_figures {
    pthread_mutex_t mutex;
    size_t next; /* the place of the oldest */
    struct jobs_figure kept[JOBS_FIGURES_KEPT];
};

void jobs_figures_init(struct jobs_figures *figures);
void jobs_figures_destroy(struct jobs_figures *figures);

/* ---- The engine (jobs.c, queue.c, workers.c) ------------------------------------------------- */

struct jobs {
    struct jobs_config config;
    size_t n_workers, n_started;
    size_t n_slots; /* threads that run jobs */
    pthread_t *threads;
    pthread_mutex_t mutex;
    pthread_cond_t wake;   /* work for idle workers, or closing */
    pthread_cond_t ended;  /* a run has ended */
    atomic_size_t tickets; /* at least as many as there are accepted rows that nobody is claiming */
    size_t accepted;  /* accepted rows and those about to be; the limit of the queue is on these */
    size_t idle;      /* workers that wait */
    size_t alive;     /* workers whose thread was started and has not ended */
    size_t held;      /* tickets of jobs whose owners have as many running as they may */
    uint64_t endings; /* counts ends of runs, so that a claim can tell whether one fell beside it */
    struct jobs_run **slots;      /* [n_slots]: what each thread runs, or NULL */
    struct jobs_memory *memories; /* [n_slots]: what the job of each has in use */
    size_t running;               /* workers between taking a ticket and the end of its run */
    uint64_t
        cancellations; /* counts requests, so that a claim can tell whether one fell beside it */
    /* Reasons to look for express jobs, and how many of them an express thread has followed up. */
    uint64_t express_issued, express_seen;
    bool express_held;           /* some wait whose owners have as many running as they may */
    pthread_cond_t express_wake; /* express_issued has grown, or closing */
    size_t lane;                 /* the slot whose thread has the express lane, or JOBS_NO_LANE */
    double lane_since;           /* by the monotonic clock: when it took its job */
    pthread_t express[JOBS_EXPRESS_THREADS];
    size_t express_started, express_alive;
    struct jobs_alone alone;
    struct jobs_loop *loops; /* published loops */
    atomic_bool draining;    /* no new claims; jobs->mutex to set it */
    atomic_bool closing;     /* nor is anything accepted; threads end when nothing runs */
    atomic_bool abandoned;   /* the grace is over: runs are to stop */
    struct jobs_transforms transforms;
    struct jobs_figures figures;
    struct jobs_ids ids;
    struct jobs_retention retention;
    struct jobs_rounds rounds;
    struct jobs_remotes remotes;
    struct jobs_passes passes;
};

#define JOBS_NO_LANE SIZE_MAX

/* Who a worker is: allocated for its thread, which frees it. */
struct jobs_worker {
    struct jobs *jobs;
    size_t number;
    unsigned failures; /* claims in a row that the store has failed */
};
void *jobs_worker_main(void *argument);
/* argument: struct jobs_worker as well; its number is beyond those of the workers. */
void *jobs_express_main(void *argument);

/* ---- The handle (handle.c) ------------------------------------------------------------------- */

/* job: its id and trace are told; NULL: of no single job. */
void jobs_log(struct jobs *jobs, const char *event, const struct store_job *job,
              const char *detail);
void jobs_changed(struct jobs *jobs, const char *job_id);
const struct jobs_process *jobs_process_find(const struct jobs *jobs, const char *id);

/* ---- A store that fails (pause.c) ------------------------------------------------------------ */

/* Sleeps before the next try at a store that has failed so many times in a row: 20 ms, doubled each
   time, up to a second. False when a signal woke it up. */
bool jobs_pause(unsigned failures);

#endif
