/*
 * task.h - tasks of running jobs and their leases (migrations: task).
 *
 *   waiting --lease--> leased --finish--> done
 *      ^                  |
 *      '--give_back, lose-'
 *
 * A lease is known by its task and its secret, which is new with each attempt. Each move is one
 * UPDATE guarded by the status and the attempt or secret: of two that come at once, one gets
 * STORE_CONFLICT. When a lease expires is not known here. Tasks go with the end of their job.
 *
 * Leases and results outlive the daemon, but are committed without waiting for the disk: a failure
 * of power may undo the last ones, in the order in which they came, and their tasks are done again.
 */
#ifndef SRNFD_STORE_TASK_H
#define SRNFD_STORE_TASK_H

#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "store_status.h"

struct store;

#define STORE_TASK_REASONS_MAX 1024 /* bytes of what was said of lost attempts */
#define STORE_EXECUTORS_MAX 64      /* makers that are kept of a job; those beyond are not */

/* Where a result is made, as whoever makes it says. */
struct store_maker {
    const char *host, *cpu, *build; /* build: of a lease NULL */
};

enum store_task_status { STORE_TASK_WAITING, STORE_TASK_LEASED, STORE_TASK_DONE };

struct store_task {
    char id[STORE_ID_MAX]; /* task- and 32 hexadecimal digits */
    enum store_task_status status;
    int64_t attempt, lost;
    char worker[STORE_ID_MAX];
    char secret[65]; /* digest of that of a lease, or "" */
};

/* Adds those tasks of a job that are not there yet, and fills the n rows as they stand; ids are
   given. */
int store_tasks_open(struct store *store, const char *job, const char *kind, size_t n,
                     struct store_task *tasks);
/* Fills the row of a task, whose id is given, as it stands. */
int store_task_get(struct store *store, struct store_task *task);
/* Attempt `attempt` of a waiting task goes to a worker at that place. secret: what that has to
   prove; of it the digest is kept. */
int store_task_lease(struct store *store, const char *id, int64_t attempt, const char *secret,
                     const char *worker, const struct store_maker *maker);
/* Whether this is the lease of the task: STORE_OK or STORE_CONFLICT. Nothing is written. */
int store_task_holds(struct store *store, const char *id, const char *secret);
/* The result of the lease, and who has made it: the task is done. */
int store_task_finish(struct store *store, const char *id, const char *secret,
                      const struct store_maker *maker, const void *result, size_t size);
/* Calls visit for each that has made results of the job, the one with most first; also after the
   end of the job. */
int store_task_makers(struct store *store, const char *job,
                      void (*visit)(void *user, const struct store_maker *maker, int64_t tasks),
                      void *user);
/* The result of a task that is done: malloc. STORE_NOT_FOUND: it has none. */
int store_task_result(struct store *store, const char *id, unsigned char **result, size_t *size);
/* The worker gives the lease back; reason NULL: nothing was wrong. Otherwise the attempt is lost,
   for that reason. */
int store_task_give_back(struct store *store, const char *id, const char *secret,
                         const char *reason);
/* The lease of that attempt is lost, for that reason. STORE_CONFLICT: it has ended. */
int store_task_lose(struct store *store, const char *id, int64_t attempt, const char *reason);
/* A task that is done is to be computed again: its result is none. */
int store_task_reset(struct store *store, const char *id);
/* The tasks of a job that are done go, with their results: the job has no need of them any more. */
int store_tasks_drop_done(struct store *store, const char *job);
/* What was said of lost attempts, one a line, with where it was. */
int store_task_reasons(struct store *store, const char *id, char reasons[STORE_TASK_REASONS_MAX]);

#endif
