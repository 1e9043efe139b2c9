/*
 * tasks.h - a part of a job that is computed elsewhere: the job offers a round of tasks and waits
 * for their results, and workers lease them over HTTP.
 *
 * The rows of tasks and leases are the store's (store/task.h): what they say counts, and outlives
 * the daemon. A job that runs again opens the same round, finds what was done, and honours leases
 * that have not expired. What a task is to compute is in memory, with its run: only tasks of
 * rounds that are open can be leased.
 */
#ifndef SRNFD_JOBS_TASKS_H
#define SRNFD_JOBS_TASKS_H

#include "jobs/jobs.h"
#include "tasks/tasks.h"

#define JOBS_TASK_LOST_MAX 5      /* attempts of a task without a result, and its job fails */
#define JOBS_TASK_LOSERS_MAX 5    /* workers that have lost it, and its job fails */
#define JOBS_LEASE_SECONDS 15.0   /* without a sign of the worker */
#define JOBS_TASK_SECONDS 600.0   /* without a result, whatever signs the worker gives */
#define JOBS_SECRET_SIZE 33       /* 32 hexadecimal digits and a zero */
#define JOBS_WHO_SIZE 33          /* of a worker: digest of its name and token, and a zero */
#define JOBS_REMOTE_NAME_MAX 64   /* bytes of what a worker tells of itself, with the zero */
#define JOBS_REMOTES_MAX 2048     /* workers that are remembered */
#define JOBS_REMOTE_SECONDS 120.0 /* of silence, until one without a lease is forgotten */

/* ---- The job's side (rounds.c) --------------------------------------------------------------- */

/* What a task is: inputs (malloc) and the contents that they are about (malloc), whose bytes belong
   to the round. */
struct jobs_task {
    struct tasks_bytes inputs;
    struct tasks_content *contents;
    size_t n_contents;
};
void jobs_task_clear(struct jobs_task *task);

struct jobs_round {
    const struct tasks_kind *kind;
    size_t n;
    double from, to; /* of the progress of the run's phase; both 0: all of it */
    /* Fills the task of that index, always with the same bytes. On any thread, while the round is
       open. Returns 0 or a core status. */
    int (*describe)(void *user, size_t index, struct jobs_task *task);
    /* Takes a result that was checked, as it comes. On the thread of the run. Returns 0 or a core
       status, which ends the round. */
    int (*take)(void *user, size_t index, const void *result, size_t size);
    void *user;
};
/* Whether jobs offer their tasks to workers, or compute all by themselves. */
bool jobs_offers_tasks(const struct jobs *jobs);
/* Offers the tasks and waits until all are done. Returns 0; SRNF_ECANCELED; otherwise a negative
   core status, or JOBS_TASK_FAILED with the problem of the job in result. */
#define JOBS_TASK_FAILED (-105)
int jobs_run_round(struct jobs_run *run, const struct jobs_round *round,
                   struct jobs_result *result);

/* ---- The workers' side (leases.c) ------------------------------------------------------------ */

/* What a worker tells of itself. */
struct jobs_remote {
    char name[JOBS_REMOTE_NAME_MAX]; /* of this process, unlike all others */
    char host[JOBS_REMOTE_NAME_MAX], cpu[JOBS_REMOTE_NAME_MAX];
    char owner[STORE_OWNER_MAX]; /* name of its token, "" without */
    size_t slots;
    double wait;             /* seconds that it waits for a task */
    char job[STORE_ID_MAX];  /* whose tasks alone it may lease; "": those of all */
    char who[JOBS_WHO_SIZE]; /* jobs_remote_who */
};
/* Who a worker is: its name, and the token with which it comes. */
void jobs_remote_who(const char *owner, const char *job, const char *name, char who[JOBS_WHO_SIZE]);

/* How a caller proves that a lease is its own: by the secret, and the token that it was given
   with. */
struct jobs_proof {
    const char *secret, *owner, *job; /* the latter as in struct jobs_remote */
};

struct jobs_lease {
    char task[STORE_ID_MAX], secret[JOBS_SECRET_SIZE];
    const char *kind;
    int64_t attempt;
    double seconds; /* that it holds without a heartbeat */
    struct jobs_task what;
};
/* A lease of the next task, the open rounds in turn. STORE_NOT_FOUND: there is none for this worker
   now: it has as many as it has slots, or lost its last tasks and has to rest, or all that wait it
   has lost, and others live that have not.
   lease is to be cleared by jobs_task_clear(&lease->what). */
int jobs_lease(struct jobs *jobs, const struct jobs_remote *remote, struct jobs_lease *lease);
/* The worker that waited for a task has gone. */
void jobs_remote_gone(struct jobs *jobs, const struct jobs_remote *remote);
/* All below: STORE_CONFLICT where this is not the current lease of the task (any more), or another
   token's. */
/* The bytes of one of the contents of the task: malloc. STORE_NOT_FOUND: it has no such content. */
int jobs_lease_content(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                       const char *digest, struct tasks_bytes *content);
/* It holds for *seconds more. Nothing is written. */
int jobs_lease_extend(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                      double *seconds);
/* Takes the result of the lease, and notes who has made it; bytes are copied. STORE_CORRUPT: it
   cannot be the result of this task; the attempt is lost. */
struct store_maker; /* store/task.h */
int jobs_lease_finish(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                      const struct store_maker *maker, const void *bytes, size_t size);
/* reason NULL: nothing was wrong with it. certain: any attempt will end so; the second time that a
   task ends so for the same reason, its job fails. */
int jobs_lease_give_back(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                         const char *reason, bool certain);

/* ---- Who works (remotes.c) ------------------------------------------------------------------- */

struct jobs_remote_state {
    struct jobs_remote remote;
    int64_t first_ms, last_ms; /* signs of it, by the clock of the day */
    double last;               /* by the monotonic clock */
    double until;              /* by the same: it lives so long, without a sign */
    bool alive;                /* jobs_remotes: it has a lease, or its silence is not long yet */
    bool barred;               /* jobs_remotes: it gets no tasks (bars.c) */
    size_t losses;             /* leases that ended without a result since the last with one */
    double rest_until;         /* by the monotonic clock: it gets nothing before, beside others */
    struct jobs_remote_counts {
        size_t leased, done, lost; /* tasks at work, with a result, and without */
    } of[TASKS_KINDS_MAX];         /* by the index of tasks_kind_at */
};
/* Calls visit for each worker that gave a sign of late, in the order of their coming. */
void jobs_remotes(struct jobs *jobs,
                  bool (*visit)(void *user, const struct jobs_remote_state *state), void *user);
/* Tasks that are leased, and workers that gave a sign of late. */
void jobs_remotes_count(struct jobs *jobs, size_t *workers, size_t *leased);

/* ---- Who gets nothing (bars.c) --------------------------------------------------------------- */

#define JOBS_BARS_MAX 64
#define JOBS_BAR_SECONDS 86400.0

/* Workers that get no tasks: those on the host, or on any, that come with the token. */
struct jobs_bar {
    int64_t number;                    /* from 1 on, new with each */
    char worker[JOBS_REMOTE_NAME_MAX]; /* that it was made for */
    char host[JOBS_REMOTE_NAME_MAX];   /* "": every host */
    char token[STORE_OWNER_MAX];       /* name, "" without one */
    bool pilots;                       /* the token is the service's own */
    char why[200];
    int64_t since_ms; /* by the clock of the day */
    double until;     /* by the monotonic clock */
};
/* Those that hold, the oldest first; returns how many. */
size_t jobs_bars(struct jobs *jobs, struct jobs_bar bars[JOBS_BARS_MAX]);
/* The bar ends now. False: there is no such bar. */
bool jobs_bars_lift(struct jobs *jobs, int64_t number);

/* ---- Whoever brings workers (demands.c, passes.c) -------------------------------------------- */

/* What a round that is open has to do. */
struct jobs_demand {
    char job[STORE_ID_MAX];
    size_t left, done; /* tasks, those that are leased among the first */
    double seconds;    /* that a task took on average; 0: none was done since the round opened */
    size_t alive;      /* workers of passes of this job that gave a sign of late */
};
/* Fills demands with those of the open rounds, `most` of them; returns how many. */
size_t jobs_demands(struct jobs *jobs, struct jobs_demand *demands, size_t most);
/* Says beside the progress of the open rounds of the job why workers are missing; "": nothing. */
void jobs_remark(struct jobs *jobs, const char *job, const char *remark);

/* A pass is a token of the service's own making with which the tasks of one job can be leased, and
   nothing else. Of it the digest is known: SHA-256 in hexadecimal digits. */
#define JOBS_PASS_PREFIX "srnfd_pilot_"
#define JOBS_PASS_SIZE 64 /* bytes of the longest with its zero */
/* False without memory. */
bool jobs_pass_add(struct jobs *jobs, const char digest[65], const char *job);
void jobs_pass_drop(struct jobs *jobs, const char digest[65]);
/* The job of a pass; false: there is no such pass. */
bool jobs_pass_find(struct jobs *jobs, const char *secret, char job[STORE_ID_MAX]);
/* Whether there still is a pass for the job. */
bool jobs_pass_holds(struct jobs *jobs, const char *job);

#endif
