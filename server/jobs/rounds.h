/*
 * rounds.h - what the run's side (rounds.c), the workers' side (leases.c), the table of workers
 * (remotes.c) and that of passes (passes.c) share.
 *
 * A slot goes WAITING -> TAKEN -> LEASED -> DONE. TAKEN: a thread asks the store for the lease, and
 * nobody else may. Only what the store has agreed to is noted in a slot.
 *
 * Lock: rounds.mutex (rank 26) guards the list of open rounds and all that belongs to them; never
 * held across the store. A round that is open stays while it has users: threads of requests that
 * look into it without the lock.
 */
#ifndef SRNFD_JOBS_ROUNDS_H
#define SRNFD_JOBS_ROUNDS_H

#include <pthread.h>

#include "jobs/tasks.h"
#include "store/task.h"

#define JOBS_REMARK_MAX 104

enum slot_state { SLOT_WAITING, SLOT_TAKEN, SLOT_LEASED, SLOT_DONE };

/* A worker that has lost a task. */
struct jobs_loser {
    char who[JOBS_WHO_SIZE];
    unsigned times;
};

struct jobs_slot {
    struct store_task row;
    enum slot_state state;
    size_t before, after;  /* of the list of those that are LEASED; SIZE_MAX: none */
    double since, expires; /* of a lease, by the monotonic clock */
    bool losing;           /* the store is asked to lose the lease: it is extended no more */
    bool restored;         /* the lease is of before a restart */
    unsigned char *result; /* malloc, charged to the job; NULL: the store has it alone */
    size_t size;
    char who[JOBS_WHO_SIZE]; /* has the lease, "": not known, as of one given before a restart */
    struct jobs_loser losers[JOBS_TASK_LOSERS_MAX];
    size_t n_losers;
    char certain[65]; /* digest of the last failure that a worker called certain, or "" */
    char certain_who[JOBS_WHO_SIZE]; /* who called it so */
};

struct jobs_open_round {
    const struct jobs_round *what;
    const char *job;
    struct jobs_memory *memory; /* of the run */
    struct jobs_slot *slots;    /* [n] */
    size_t *order;              /* [n] indexes by id */
    size_t *arrived;            /* [n] indexes of those that are DONE, as they came */
    size_t done, leased;        /* slots */
    size_t first_leased;        /* SIZE_MAX: none */
    size_t cursor;              /* no slot before it is WAITING */
    size_t users;
    double offer_at; /* when all who wait are to be asked again, since a task is free that was not,
                        or was not given to one who lost it; by the monotonic clock, 0: never */
    double stirred;  /* when the thread of the run was woken last, by the same */
    bool failed;     /* a task was lost too often, or for certain */
    size_t poison;
    double seconds;  /* that tasks took whose leases have ended with a result */
    size_t measured; /* how many these are */
    char remark[JOBS_REMARK_MAX];
    bool remarked; /* it is another than was told last */
    pthread_cond_t changed;
    struct jobs_open_round *link;
};

struct jobs_rounds {
    pthread_mutex_t mutex;
    struct jobs_open_round *first; /* the next to lease from */
};
void jobs_rounds_init(struct jobs_rounds *rounds);
void jobs_rounds_destroy(struct jobs_rounds *rounds);

/* Whether the bytes can be the result of the task, as far as that can be told. */
bool jobs_task_suits(const struct tasks_kind *kind, const struct jobs_task *task,
                     const void *result, size_t size);

/* Fills the slots of a round from the store, which adds tasks that it does not have yet. What it
   allocates the round has to free. Returns 0 or as jobs_run_round (rounds_open.c). */
int jobs_open_round(struct jobs_run *run, struct jobs_open_round *round,
                    struct jobs_result *result);
/* The problem of a job whose tasks the store cannot keep; returns JOBS_TASK_FAILED. */
int jobs_fail_store(struct jobs_result *result, int status);

/* ---- Moves of a task (slots.c) --------------------------------------------------------------- */

/* A task is leased from now on. The mutex is held, as for all that follows. */
void jobs_slot_lease(struct jobs_open_round *round, size_t index, double seconds);
/* A task is done; result (malloc) is taken over, where the job has room for it. */
void jobs_slot_finish(struct jobs_open_round *round, size_t index, struct tasks_bytes *result);
/* A task is free again. */
void jobs_slot_free(struct jobs_open_round *round, size_t index);
/* The same, and its attempt was lost. certain: why, where every attempt would end so; NULL
   otherwise. */
void jobs_slot_lose(struct jobs *jobs, struct jobs_open_round *round, size_t index,
                    const char *certain);
/* Whether the task is for this worker: no other lives that has lost it fewer times (losers.c). */
bool jobs_slot_suits(struct jobs *jobs, const struct jobs_open_round *round,
                     const struct jobs_slot *slot, const char *who);
/* Notes that the worker of the lease has lost the task; true: once too often (losers.c). */
bool jobs_slot_blame(struct jobs *jobs, const struct jobs_open_round *round, struct jobs_slot *slot,
                     const char *certain);
/* Computes some results again, as the configuration says (verify.c). False: the bits are others;
   the worker gets no more tasks, its leases end, and result has the problem. On the thread of the
   run, without locks. */
bool jobs_verify(struct jobs_run *run, const struct jobs_open_round *round, size_t index,
                 const struct tasks_bytes *bytes, struct jobs_result *result);
/* Tells those who wait for tasks that there may be some. No lock is held. */
void jobs_rounds_offer(struct jobs *jobs);

struct jobs_pass;
struct jobs_passes {
    pthread_mutex_t mutex;
    struct jobs_pass *first;
};
void jobs_passes_init(struct jobs_passes *passes);
void jobs_passes_destroy(struct jobs_passes *passes);

#define JOBS_CREDITS_MAX 64

/* What the results of a token have earned (bars.c). */
struct jobs_credit {
    char token[STORE_OWNER_MAX];
    size_t earned; /* leases at once */
    double last;   /* by the monotonic clock */
};

struct jobs_remotes {
    pthread_mutex_t mutex;
    struct jobs_remote_state *list; /* [count] of JOBS_REMOTES_MAX */
    size_t count;
    double lease_seconds; /* from its start on */
    struct jobs_bar bars[JOBS_BARS_MAX];
    size_t n_bars;
    int64_t last_bar; /* its number */
    struct jobs_credit credits[JOBS_CREDITS_MAX];
    bool withheld; /* a task, since its token holds as many as it may */
};
void jobs_remotes_init(struct jobs_remotes *remotes);
void jobs_remotes_destroy(struct jobs_remotes *remotes);
/* The worker has asked for a task. False: it is to get none now. fresh: it was not known, and so
   are leases of before a restart that it may hold. */
bool jobs_remotes_sign(struct jobs_remotes *remotes, const struct jobs_remote *remote, bool *fresh);
/* REMOTE_OVER: a lease has ended, and not by what the worker did. */
enum jobs_remote_event {
    REMOTE_LEASED,
    REMOTE_ALIVE,
    REMOTE_DONE,
    REMOTE_BACK,
    REMOTE_LOST,
    REMOTE_OVER
};
/* What became of a lease, of a task of that kind, of that worker. */
void jobs_remotes_note(struct jobs_remotes *remotes, const char *who, enum jobs_remote_event event,
                       const char *kind);
/* The worker gets no more tasks, nor do others on its host with its token. False: it gave no sign
   of late, and is not known any more. */
bool jobs_remotes_bar(struct jobs_remotes *remotes, const char *who, const char *why);
/* Whether the worker is barred. */
bool jobs_remotes_barred(struct jobs_remotes *remotes, const char *who);
/* How many workers live that may lease tasks of this job alone. */
size_t jobs_remotes_alive(struct jobs_remotes *remotes, const char *job);
/* Whether the worker has asked for a task since the start, and was not forgotten. */
bool jobs_remotes_know(struct jobs_remotes *remotes, const char *who);
/* Whether a task was withheld since the last call because its token holds as many as it may. */
bool jobs_remotes_withheld(struct jobs_remotes *remotes);
/* Whether a worker lives beside that one that may lease tasks of the job, does not lose all that it
   gets, and fits; fits NULL: any. */
bool jobs_remotes_other(struct jobs_remotes *remotes, const char *who, const char *job,
                        bool (*fits)(const void *user, const char *who), const void *user);

/* Tasks at work. The mutex of the remotes is held, as for all that follows. */
size_t jobs_remote_leased(const struct jobs_remote_state *state);
/* The bar that holds for the worker, or NULL. */
const struct jobs_bar *jobs_bars_find(struct jobs_remotes *remotes,
                                      const struct jobs_remote *remote);
void jobs_bars_add(struct jobs_remotes *remotes, const struct jobs_remote *remote, const char *why);
/* A lease of the worker has ended, with a result or not. */
void jobs_credit_note(struct jobs_remotes *remotes, const struct jobs_remote *remote, bool result);
/* Whether its token may hold one more task. */
bool jobs_credit_allows(struct jobs_remotes *remotes, const struct jobs_remote *remote);

#endif
