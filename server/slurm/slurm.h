/*
 * slurm.h - the executor "slurm": asks a cluster for workers, as many as the tasks that wait need.
 *
 * Workers that Slurm starts are called pilots: processes of `srnfd worker` that pull tasks over
 * HTTP as others do. Slurm decides where and how many run, the store decides who has which task.
 * Slurm is spoken to by its programs sbatch, squeue and scancel alone, which are needed when the
 * service runs and not when it is built.
 */
#ifndef SRNFD_SLURM_H
#define SRNFD_SLURM_H

#include <stdbool.h>
#include <stddef.h>

#include "metrics.h"

struct jobs;
struct store;

/* Texts are borrowed until slurm_close; "" leaves a choice to the cluster. */
struct slurm_config {
    struct store *store;
    struct jobs *jobs;
    struct metrics *metrics;  /* may be NULL */
    const char *installation; /* part of the names of arrays: which daemon they belong to */
    const char *partition, *account, *qos, *time;
    const char *arguments;        /* more of them for sbatch, separated by blanks */
    const char *server;           /* URL under which nodes reach the service */
    const char *program;          /* srnfd on the nodes */
    const char *const *variables; /* of its environment: names and values in turn, ended by NULL */
    const char *cache;            /* folder on the nodes for what tasks are about, or "" */
    const char *certificate;      /* PEM file whose first certificate pilots trust, or "" */
    size_t cpus;                  /* of a pilot: tasks at once */
    size_t memory;                /* MiB of a pilot; 0: as the cluster gives */
    size_t workers;               /* pilots at once, at most */
    double seconds;               /* that a program of Slurm may take */
    double poll_seconds;          /* between two looks at the queue */
    double lease_seconds;         /* in which a pilot at work gives a sign */
};

/* Whether the programs of Slurm are there, and its settings can be used; otherwise a sentence. Runs
   nothing. */
bool slurm_check(const struct slurm_config *config, char *message, size_t size);

struct slurm;
/* Takes up the arrays of an earlier run and starts the thread. Returns 0 or a status of the store.
 */
int slurm_open(struct slurm **out, const struct slurm_config *config);
/* There may be more to do: from any thread. */
void slurm_wake(struct slurm *slurm);
/* Cancels all pilots. NULL is allowed. */
void slurm_close(struct slurm *slurm);

#endif
