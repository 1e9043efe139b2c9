/*
 * workers.c - what a worker thread does with its life.
 *
 *   while not closing (draining: only the last two):
 *       a job is to run alone   when nothing else runs, claim it and run it (alone.c)
 *       a ticket is there       take it, claim the job whose turn it is, run it
 *       a loop has work left    help it
 *       otherwise               sleep
 *
 * A ticket stands for an accepted job that may be there: one is issued with each job, and taken
 * before the claim. A job that is dismissed leaves its ticket behind, which then buys nothing. So
 * a worker that sleeps has overlooked none, and idle workers cost the database nothing. Where all
 * jobs that wait belong to owners who have as many running as they may, the ticket is held until a
 * run ends.
 *
 * Express threads take express jobs only, those that are expected to take a second at most
 * (queue.c), one thread at a time: the one that has the lane. It looks when such a job has come,
 * and then until it finds none; a worker may have taken it before. A ticket that it finds it takes
 * along, as a worker does, and puts back where it gets no job: so no ticket stays behind for a job
 * that it ran, and none is missing for one that it did not. It helps no loops, so a short job waits
 * for nothing but other short ones, however many long jobs run.
 *
 * A job that is there for longer than JOBS_EXPRESS_PATIENCE was misjudged. Its thread has lost the
 * lane as soon as the other one finds that short jobs wait: that one takes the lane, and the job
 * goes on beside it as on a worker. Its thread may have the lane again when the job has ended. So
 * one misjudged job delays short ones by that time, once; where as many run as there are threads,
 * short ones wait for the first of them or for a worker. One owner holds one thread less than there
 * are, if there are other owners: the last looks for the jobs of those alone, so that nobody holds
 * up another's short jobs with misjudged ones of his own. The lane costs the long jobs at most one
 * part in n + 1 of the processors, while short jobs come without end, and another one while a
 * misjudged job runs.
 *
 * Threads: srnfd-work-N and srnfd-express (priority.h). Lock: jobs->mutex
 * (rank 20), never held across the store or a run.
 */
#include "jobs/internal.h"

#include "clock.h"
#include "priority.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The slot makes the run known. A cancellation that fell between the claim and this moment is
   looked up. */
static void enter_slot(struct jobs *jobs, size_t number, struct jobs_run *run, uint64_t seen)
{
    struct store_job row;
    bool missed;

    pthread_mutex_lock(&jobs->mutex);
    jobs->slots[number] = run;
    jobs->accepted -= jobs->accepted > 0 ? 1 : 0;
    missed = jobs->cancellations != seen;
    pthread_mutex_unlock(&jobs->mutex);
    if (missed && store_job_get(jobs->config.store, run->job->id, &row) == STORE_OK) {
        if (row.cancel_requested) {
            atomic_store(&run->cancel, true);
        }
        store_job_clear(&row);
    }
}

/* The run has ended: what was held may be claimed now. */
static void leave_slot(struct jobs *jobs, size_t number)
{
    pthread_mutex_lock(&jobs->mutex);
    jobs->slots[number] = NULL;
    jobs->endings++;
    if (jobs->held > 0) {
        atomic_fetch_add(&jobs->tickets, jobs->held);
        jobs->held = 0;
        pthread_cond_broadcast(&jobs->wake);
    }
    if (jobs->express_held) {
        jobs->express_held = false;
        jobs->express_issued++;
        pthread_cond_broadcast(&jobs->express_wake);
    }
    pthread_mutex_unlock(&jobs->mutex);
}

/* Runs the job that was claimed, where there is one; status is that of the claim. */
static void run_claimed(struct jobs_worker *worker, int status, struct store_job *job,
                        uint64_t seen)
{
    struct jobs *jobs = worker->jobs;
    struct jobs_run run;
    char id[STORE_ID_MAX];

    worker->failures = status == STORE_OK || status == STORE_CONFLICT || status == STORE_NOT_FOUND
                           ? 0
                           : worker->failures + 1;
    if (status == STORE_OK) {
        jobs_run_init(&run, jobs, job, &jobs->memories[worker->number]);
        enter_slot(jobs, worker->number, &run, seen);
        jobs_run_execute(&run);
        leave_slot(jobs, worker->number);
        jobs_run_destroy(&run);
        snprintf(id, sizeof id, "%s", job->id);
        store_job_clear(job);
        jobs_changed(jobs, id);
    } else if (worker->failures > 0) {
        jobs_log(jobs, "claim-failed", NULL, store_strerror(status));
        (void)jobs_pause(worker->failures);
    }
}

/* A run has ended, or was none. jobs->mutex is held. */
static void end_run(struct jobs *jobs)
{
    jobs->running--;
    pthread_cond_broadcast(&jobs->ended);
    if (atomic_load(&jobs->closing) || jobs->alone.waiting > 0) {
        pthread_cond_broadcast(&jobs->wake);
    }
}

/* Runs a job that is to run alone (alone.c). jobs->mutex is held, but not while the job runs. */
static void run_alone(struct jobs_worker *worker)
{
    struct jobs *jobs = worker->jobs;
    uint64_t seen = jobs->cancellations;
    struct store_job job;
    int status;

    jobs->alone.runs = true;
    jobs->running++;
    pthread_mutex_unlock(&jobs->mutex);
    status = store_job_claim_alone(jobs->config.store, &job);
    run_claimed(worker, status, &job, seen);
    pthread_mutex_lock(&jobs->mutex);
    jobs->alone.runs = false;
    if (status == STORE_OK) {
        jobs->alone.waiting--;
    } else if (status == STORE_NOT_FOUND || status == STORE_CONFLICT) {
        jobs->alone.waiting = 0; /* those that were counted have been dismissed */
    }
    end_run(jobs);
    if (!jobs_alone_holds(jobs)) {
        pthread_cond_broadcast(&jobs->wake);
        pthread_cond_broadcast(&jobs->express_wake);
    }
}

/* Spends one ticket. jobs->mutex is held, but not while the job runs. */
static void spend_ticket(struct jobs_worker *worker)
{
    struct jobs *jobs = worker->jobs;
    uint64_t seen = jobs->cancellations, endings = jobs->endings;
    struct store_job job;
    int status;

    atomic_fetch_sub(&jobs->tickets, 1);
    jobs->running++;
    pthread_mutex_unlock(&jobs->mutex);
    status = store_job_claim(jobs->config.store, &job);
    run_claimed(worker, status, &job, seen);
    pthread_mutex_lock(&jobs->mutex);
    if (status == STORE_CONFLICT && jobs->endings == endings) {
        jobs->held++; /* kept until a run ends */
    } else if (status != STORE_OK && status != STORE_NOT_FOUND) {
        atomic_fetch_add(&jobs->tickets, 1); /* a run has ended since, or the store failed */
    }
    end_run(jobs);
}

/* The owner who has a job on every other express thread, into name; false where there is none.
   jobs->mutex is held. */
static bool lane_owner(const struct jobs *jobs, size_t own, char name[STORE_OWNER_MAX])
{
    const char *owner = NULL;

    for (size_t i = jobs->n_workers; i < jobs->n_slots; i++) {
        if (i != own &&
            (!jobs->slots[i] || (owner && strcmp(owner, jobs->slots[i]->job->owner) != 0))) {
            return false;
        }
        owner = i == own ? owner : jobs->slots[i]->job->owner;
    }
    (void)snprintf(name, STORE_OWNER_MAX, "%s", owner ? owner : "");
    return owner != NULL;
}

/* One look for an express job. jobs->mutex is held, but not while the job runs. */
static void take_express(struct jobs_worker *worker)
{
    struct jobs *jobs = worker->jobs;
    uint64_t issued = jobs->express_issued, endings = jobs->endings, seen = jobs->cancellations;
    bool ticket = atomic_load(&jobs->tickets) > 0;
    char owner[STORE_OWNER_MAX];
    bool held = lane_owner(jobs, worker->number, owner);
    struct store_job job;
    int status;

    atomic_fetch_sub(&jobs->tickets, ticket ? 1 : 0);
    jobs->running++;
    pthread_mutex_unlock(&jobs->mutex);
    status = store_job_claim_express(jobs->config.store, held ? owner : NULL, &job);
    run_claimed(worker, status, &job, seen);
    pthread_mutex_lock(&jobs->mutex);
    if (status == STORE_NOT_FOUND) {
        jobs->express_seen = issued;
    } else if (status == STORE_CONFLICT && jobs->endings == endings) {
        jobs->express_seen = issued;
        jobs->express_held = true;
    }
    if (status != STORE_OK && ticket) {
        atomic_fetch_add(&jobs->tickets, 1);
        pthread_cond_signal(&jobs->wake);
    }
    end_run(jobs);
}

static void settle_in(const char *name)
{
    pthread_setname_np(pthread_self(), name);
    priority_compute();
    fault_thread();
}

void *jobs_worker_main(void *argument)
{
    struct jobs_worker worker = *(struct jobs_worker *)argument;
    struct jobs *jobs = worker.jobs;
    char name[16];

    free(argument);
    snprintf(name, sizeof name, "srnfd-work-%u", (unsigned)worker.number % 1000);
    settle_in(name);
    pthread_mutex_lock(&jobs->mutex);
    while (!atomic_load(&jobs->closing) || jobs->running > 0) {
        struct jobs_loop *loop;

        if (!atomic_load(&jobs->draining) && jobs_alone_is_due(jobs)) {
            run_alone(&worker);
        } else if (!atomic_load(&jobs->draining) && atomic_load(&jobs->tickets) > 0 &&
                   !jobs_alone_holds(jobs)) {
            spend_ticket(&worker);
        } else if ((loop = jobs_loop_enter(jobs)) != NULL) {
            pthread_mutex_unlock(&jobs->mutex);
            jobs_loop_help(jobs, loop);
            pthread_mutex_lock(&jobs->mutex);
        } else {
            jobs_alone_wait(jobs);
        }
    }
    jobs->alive--;
    pthread_mutex_unlock(&jobs->mutex);
    return NULL;
}

/* Seconds until the lane may be taken; 0: now. jobs->mutex is held. */
static double lane_wait(const struct jobs *jobs)
{
    double wait =
        jobs->lane == JOBS_NO_LANE ? 0.0 : jobs->lane_since + JOBS_EXPRESS_PATIENCE - clock_now();

    return wait > 0.0 ? wait : 0.0;
}

/* Until there is something to look for, or for so long. jobs->mutex is held. */
static void await_express(struct jobs *jobs, double seconds)
{
    struct timespec until = clock_timespec(clock_now() + seconds);

    (void)pthread_cond_clockwait(&jobs->express_wake, &jobs->mutex, CLOCK_MONOTONIC, &until);
}

void *jobs_express_main(void *argument)
{
    struct jobs_worker worker = *(struct jobs_worker *)argument;
    struct jobs *jobs = worker.jobs;

    free(argument);
    settle_in("srnfd-express");
    pthread_mutex_lock(&jobs->mutex);
    while (!atomic_load(&jobs->closing)) {
        double wait = lane_wait(jobs);

        if (jobs->express_seen == jobs->express_issued || jobs_alone_holds(jobs) ||
            atomic_load(&jobs->draining)) {
            pthread_cond_wait(&jobs->express_wake, &jobs->mutex);
        } else if (wait > 0.0) {
            await_express(jobs, wait);
        } else {
            jobs->lane = worker.number;
            jobs->lane_since = clock_now();
            take_express(&worker);
            jobs->lane = jobs->lane == worker.number ? JOBS_NO_LANE : jobs->lane;
        }
    }
    jobs->express_alive--;
    pthread_mutex_unlock(&jobs->mutex);
    return NULL;
}
