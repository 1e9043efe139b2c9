/*
 * internal.h - what the threads of a worker share.
 *
 * Threads: one for each slot, which leases, computes and returns; srnfd-heart, which tells the
 * service that the leases are worked on; the first one, which waits for signals.
 *
 * Lock: each slot's mutex guards its lease; never held during a request.
 */
#ifndef SRNFD_WORKER_INTERNAL_H
#define SRNFD_WORKER_INTERNAL_H

#include <pthread.h>

#include "build.h"
#include "ids.h"
#include "worker/cache.h"
#include "worker/link.h"

#define WORKER_PATIENCE 120.0 /* seconds without the service */
#define WORKER_NAME_MAX 64
#define WORKER_SLOTS_MAX 256

enum worker_end {
    WORKER_DONE = 0,
    WORKER_ALONE = 1, /* the service was gone for too long */
    WORKER_WRONG_USE = 2,
    WORKER_REFUSED = 3,
};

struct worker;

struct worker_slot {
    struct worker *worker;
    pthread_t thread;
    struct link *link;
    pthread_mutex_t mutex;
    bool leased;             /* mutex, like the next three */
    char task[STORE_ID_MAX]; /* path of the lease is below /v1/leases/ */
    char secret[64];
    double beat;        /* when the next heartbeat is due */
    atomic_bool cancel; /* the lease is lost: what is computed is for nothing */
};

struct worker {
    struct link_target target;
    char name[WORKER_NAME_MAX], host[WORKER_NAME_MAX], cpu[WORKER_NAME_MAX];
    char build[BUILD_ARITHMETIC_SIZE];
    double idle_seconds; /* without a task; 0: for ever */
    struct cache *cache;
    size_t n_slots, n_started;
    struct worker_slot *slots; /* [n_slots] */
    atomic_size_t running;     /* threads of slots */
    atomic_bool accepted;      /* the service has answered that it may work */
    atomic_bool draining;      /* nothing more is leased */
    atomic_bool hurried;       /* what is computed is given back */
    atomic_bool over;          /* no heartbeats any more */
    _Atomic double worked;     /* when a task was last at work, by the monotonic clock */
    atomic_int end;            /* enum worker_end */
};

/* Ends the worker for that reason. */
void worker_give_up(struct worker *worker, enum worker_end end, const char *why);
/* The thread of a slot. argument: struct worker_slot. */
void *worker_slot_main(void *argument);
/* The thread of heartbeats. argument: struct worker. */
void *worker_heart_main(void *argument);
/* Sleeps; returns at once when *flag is true. */
void worker_sleep(double seconds, const atomic_bool *flag);

#endif
