/*
 * ledger.h - what a client of a daemon that keeps dying was promised, and whether it was kept.
 *
 * Every request that got a whole answer is a promise; one without an answer may have been done or
 * not, and is sent again with its Idempotency-Key after the next start. The promises:
 *
 *   201 for a mesh                its bytes come back
 *   200, 201 for an execution     the job is there, under the same key, and ends successful - or
 *                                 failed after three attempts that were each cut short
 *   status successful, seen once  it stays so, with the same results, and never runs again
 *   cancel answered dismissed     it stays so
 *   200 for a deletion            it is gone
 */
#ifndef SRNFD_TEST_LEDGER_H
#define SRNFD_TEST_LEDGER_H

#include <pthread.h>

#include "support/daemon.h"

#define LEDGER_JOBS 20000
#define LEDGER_MESHES 4000

enum promise { PENDING, ACCEPTED, SUCCESSFUL, DISMISSED, FAILED, DELETING, DELETED };

struct ledger_job {
    char key[40], body[160], id[64];
    enum promise promise, before; /* before: a deletion that has no answer yet */
    bool tried_to_cancel;
    long seen_at;     /* length of the log when the success was first seen */
    char results[65]; /* digest, "" before they were read */
};

struct ledger_mesh {
    unsigned seed;
    bool large;
    char id[64];
};

struct ledger {
    struct daemon *daemon;
    pthread_mutex_t mutex; /* protects the counts and the entries that many threads may touch */
    size_t n_jobs, n_meshes;
    struct ledger_job jobs[LEDGER_JOBS];
    struct ledger_mesh meshes[LEDGER_MESHES];
    char mesh[64]; /* that the jobs encode */
    atomic_long acknowledged, wrong;
    atomic_bool stop;
};

/* A closed surface in OFF, different for each seed; large is more than the store keeps inline.
   malloc. */
char *ledger_mesh_text(unsigned seed, bool large, size_t *size);

/* One client at work until ledger->stop or until nobody answers; argument: struct ledger_client. */
struct ledger_client {
    struct ledger *ledger;
    unsigned number, random;
    pthread_t thread;
};
void *ledger_client_main(void *argument);

/* Uploads the mesh that the jobs encode; false without an answer. */
bool ledger_begin(struct ledger *ledger);
/* After a start: sends what has no answer again. */
void ledger_resend(struct ledger *ledger);
/* Compares the states of all jobs with what was promised; to the end: waits until none is left to
   run, and reads all results and meshes. Counts in ledger->wrong, and tells each on stderr. */
void ledger_verify(struct ledger *ledger, bool to_the_end);

#endif
