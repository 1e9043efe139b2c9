/*
 * retention.c - the thread that lets old things go: every sweep_seconds it removes the jobs that
 * ended more than retention_days ago, and files that no row names (store/retention.c), these also
 * at the start: what was deleted just before a crash goes at once.
 *
 * The age of a job is by the wall clock, which can be wrong: a machine that wakes up in another
 * year must not lose a year's jobs. So jobs are removed only where the wall clock has run with the
 * monotonic one since the sweep before, and thus never by the first sweep after a start; a jump of
 * more than JUMP_SECONDS puts them off to the sweep after the next, and is told in the log.
 *
 * Thread: srnfd-keep. Lock: retention.mutex (rank 24) protects closing; it is held across nothing.
 */
#include "jobs/internal.h"

#include "clock.h"
#include "store/job.h"
#include "store/store.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>

#define DAY_MS 86400000.0
#define JUMP_SECONDS 60.0

/* By how much the wall clock is ahead of the monotonic one. */
static double wall_offset(void)
{
    return 1e-3 * (double)store_now_ms() - clock_now();
}

/* Waits until the next sweep; false: the engine closes. */
static bool wait_for_sweep(struct jobs *jobs)
{
    struct jobs_retention *retention = &jobs->retention;
    struct timespec until = clock_timespec(clock_now() + jobs->config.sweep_seconds);
    bool closing;
    int status = 0;

    pthread_mutex_lock(&retention->mutex);
    while (!retention->closing && status != ETIMEDOUT) {
        status =
            pthread_cond_clockwait(&retention->wake, &retention->mutex, CLOCK_MONOTONIC, &until);
    }
    closing = retention->closing;
    pthread_mutex_unlock(&retention->mutex);
    return !closing;
}

static void tell(struct jobs *jobs, const char *event, size_t removed, int status)
{
    char detail[80];

    if (removed > 0 || status != STORE_OK) {
        snprintf(detail, sizeof detail, "%zu removed%s%s", removed, status == STORE_OK ? "" : "; ",
                 status == STORE_OK ? "" : store_strerror(status));
        jobs_log(jobs, event, NULL, detail);
    }
}

static void expire_jobs(struct jobs *jobs)
{
    double age_ms = jobs->config.retention_days * DAY_MS;
    size_t removed;
    int status;

    if (age_ms > 0.0) {
        status = store_expire_jobs(jobs->config.store, store_now_ms() - (int64_t)age_ms, &removed);
        tell(jobs, "jobs-expired", removed, status);
    }
}

static void sweep_files(struct jobs *jobs)
{
    size_t removed;
    int status = store_sweep_files(jobs->config.store, &removed);

    tell(jobs, "files-swept", removed, status);
}

static void *retention_main(void *argument)
{
    struct jobs *jobs = argument;
    double before = wall_offset();
    bool settled = false;

    pthread_setname_np(pthread_self(), "srnfd-keep");
    sweep_files(jobs);
    while (wait_for_sweep(jobs)) {
        double offset = wall_offset();
        bool jumped = fabs(offset - before) > JUMP_SECONDS;

        if (jumped) {
            jobs_log(jobs, "clock-jumped", NULL, "no jobs are removed at this sweep and the next");
        } else if (settled) {
            expire_jobs(jobs);
        }
        settled = !jumped;
        before = offset;
        sweep_files(jobs);
    }
    return NULL;
}

int jobs_retention_start(struct jobs *jobs)
{
    struct jobs_retention *retention = &jobs->retention;

    if (jobs->config.sweep_seconds <= 0.0) {
        return STORE_OK;
    }
    pthread_mutex_init(&retention->mutex, NULL);
    pthread_cond_init(&retention->wake, NULL);
    retention->started = pthread_create(&retention->thread, NULL, retention_main, jobs) == 0;
    if (!retention->started) {
        pthread_cond_destroy(&retention->wake);
        pthread_mutex_destroy(&retention->mutex);
        return STORE_NOMEM;
    }
    return STORE_OK;
}

void jobs_retention_stop(struct jobs *jobs)
{
    struct jobs_retention *retention = &jobs->retention;

    if (!retention->started) {
        return;
    }
    pthread_mutex_lock(&retention->mutex);
    retention->closing = true;
    pthread_cond_signal(&retention->wake);
    pthread_mutex_unlock(&retention->mutex);
    pthread_join(retention->thread, NULL);
    pthread_cond_destroy(&retention->wake);
    pthread_mutex_destroy(&retention->mutex);
    retention->started = false;
}
