/*
 * workers.c - what a worker thread does with its life.
 *
 *   while not closing:
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
 * Threads: srnfd-work-N, WORKER_NICE below the others: whoever asks for a status is answered at
 * once, also when every processor computes. Lock: jobs->mutex (rank 20), never held across the
 * store or a run.
 */
#include "jobs/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#define WORKER_NICE 10 /* added to the process's own, see nice(2) */
/* Before the next try when the store has failed. */
#define PAUSE_FIRST_MS 20
#define PAUSE_LAST_MS 1000

bool jobs_pause(unsigned failures)
{
    long ms = PAUSE_FIRST_MS;
    struct timespec pause;

    for (; failures > 1 && ms < PAUSE_LAST_MS; failures--) {
        ms *= 2;
    }
    ms = ms < PAUSE_LAST_MS ? ms : PAUSE_LAST_MS;
    pause = (struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L};
    return nanosleep(&pause, NULL) == 0;
}

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
    pthread_mutex_unlock(&jobs->mutex);
}

/* Keeps the ticket for later, or for now where a run has ended since the claim began. */
static void hold(struct jobs *jobs, uint64_t endings)
{
    pthread_mutex_lock(&jobs->mutex);
    if (jobs->endings != endings) {
        atomic_fetch_add(&jobs->tickets, 1);
    } else {
        jobs->held++;
    }
    pthread_mutex_unlock(&jobs->mutex);
}

/* Spends one ticket. */
static void claim_and_run(struct jobs_worker *worker, uint64_t seen, uint64_t endings)
{
    struct jobs *jobs = worker->jobs;
    struct store_job job;
    struct jobs_run run;
    char id[STORE_ID_MAX];
    int status = store_job_claim(jobs->config.store, &job);

    worker->failures = status == STORE_OK || status == STORE_CONFLICT || status == STORE_NOT_FOUND
                           ? 0
                           : worker->failures + 1;
    if (status == STORE_OK) {
        jobs_run_init(&run, jobs, &job, &jobs->memories[worker->number]);
        enter_slot(jobs, worker->number, &run, seen);
        jobs_run_execute(&run);
        leave_slot(jobs, worker->number);
        jobs_run_destroy(&run);
        snprintf(id, sizeof id, "%s", job.id);
        store_job_clear(&job);
        jobs_changed(jobs, id);
    } else if (status == STORE_CONFLICT) {
        hold(jobs, endings);
    } else if (status != STORE_NOT_FOUND) {
        jobs_log(jobs, "claim-failed", NULL, store_strerror(status));
        atomic_fetch_add(&jobs->tickets, 1);
        (void)jobs_pause(worker->failures);
    }
}

/* On Linux the priority is each thread's own (sched(7)). Where it cannot be set, as it was. */
static void step_back(void)
{
    int now = getpriority(PRIO_PROCESS, 0);

    (void)setpriority(PRIO_PROCESS, (id_t)gettid(), now + WORKER_NICE);
}

void *jobs_worker_main(void *argument)
{
    struct jobs_worker worker = *(struct jobs_worker *)argument;
    struct jobs *jobs = worker.jobs;
    char name[16];

    free(argument);
    snprintf(name, sizeof name, "srnfd-work-%u", (unsigned)worker.number % 1000);
    pthread_setname_np(pthread_self(), name);
    step_back();
    pthread_mutex_lock(&jobs->mutex);
    while (!atomic_load(&jobs->closing) || jobs->running > 0) {
        struct jobs_loop *loop;

        if (!atomic_load(&jobs->closing) && atomic_load(&jobs->tickets) > 0) {
            uint64_t seen = jobs->cancellations, endings = jobs->endings;

            atomic_fetch_sub(&jobs->tickets, 1);
            jobs->running++;
            pthread_mutex_unlock(&jobs->mutex);
            claim_and_run(&worker, seen, endings);
            pthread_mutex_lock(&jobs->mutex);
            jobs->running--;
            pthread_cond_broadcast(&jobs->ended);
            if (atomic_load(&jobs->closing)) {
                pthread_cond_broadcast(&jobs->wake);
            }
        } else if ((loop = jobs_loop_enter(jobs)) != NULL) {
            pthread_mutex_unlock(&jobs->mutex);
            jobs_loop_help(jobs, loop);
            pthread_mutex_lock(&jobs->mutex);
        } else {
            jobs->idle++;
            pthread_cond_wait(&jobs->wake, &jobs->mutex);
            jobs->idle--;
        }
    }
    jobs->alive--;
    pthread_mutex_unlock(&jobs->mutex);
    return NULL;
}
