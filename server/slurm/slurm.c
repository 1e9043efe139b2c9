/*
 * slurm.c - the thread of the executor, and its life.
 *
 * In each turn it asks squeue once for all arrays, settles what that means, asks for pilots where
 * jobs wait for more, and cancels what is not needed. A turn comes every poll_seconds while there
 * is anything, and at once when a job offers tasks; without jobs and arrays it sleeps.
 *
 * Nothing of this decides about tasks: where Slurm is silent, wrong or gone, leases expire and
 * other workers compute. What it costs is time.
 *
 * Lock: slurm->mutex guards the wish to wake up; innermost, nothing is called while it is held.
 */
#include "slurm/internal.h"

#include "clock.h"

#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TURN_SECONDS 0.3 /* between two turns at least */
#define CLOSE_SECONDS 5.0

static const char *const programs[] = {"sbatch", "squeue", "scancel"};

bool slurm_check(const struct slurm_config *config, char *message, size_t size)
{
    const char *problem = slurm_arguments_problem(config->arguments);

    for (size_t i = 0; i < sizeof programs / sizeof programs[0]; i++) {
        if (!slurm_has(programs[i])) {
            (void)snprintf(message, size,
                           "--executor slurm runs %s, and PATH has none: install Slurm's programs "
                           "(Debian: slurm-client) and its configuration on this machine, or "
                           "choose --executor workers or local",
                           programs[i]);
            return false;
        }
    }
    if (problem) {
        (void)snprintf(message, size, "--slurm-arguments: %s", problem);
        return false;
    }
    return true;
}

/* ---- A turn ---------------------------------------------------------------------------------- */

static void end_arrays(struct slurm *slurm, const char *job)
{
    for (struct slurm_array *array = slurm->arrays; array; array = array->next) {
        if (strcmp(array->row.job, job) == 0 && array->row.status == STORE_PILOTS_SUBMITTED) {
            slurm_array_end(slurm, array);
            array->doubt = clock_now();
        }
    }
}

static void serve(struct slurm *slurm, struct slurm_operation *operation)
{
    size_t live = operation->pending + operation->running - operation->silent;
    size_t most = operation->most;

    if (!operation->wanted) {
        end_arrays(slurm, operation->job);
    } else if (operation->waits && live < most && !operation->unclear && !slurm->blind &&
               clock_now() >= operation->next) {
        slurm_submit(slurm, operation, most - live);
    } else if (operation->waits && !slurm->blind) {
        slurm_shrink(slurm, operation, live > most ? live - most : 0);
    }
}

static void turn(struct slurm *slurm)
{
    if (clock_now() - slurm->looked >= 0.9 * slurm->config.poll_seconds || !slurm->arrays) {
        slurm_look(slurm);
        slurm_operations_update(slurm);
        slurm_settle(slurm);
    }
    slurm_operations_update(slurm);
    for (struct slurm_operation *operation = slurm->operations;
         operation && !atomic_load(&slurm->closing); operation = operation->link) {
        serve(slurm, operation);
    }
    if (!slurm->blind) {
        slurm_cancel_ending(slurm, false);
        slurm_sweep(slurm);
    }
    slurm_operations_tell(slurm);
}

/* Seconds until the next turn; 0: until somebody wakes the thread. */
static double rest(struct slurm *slurm)
{
    double due;

    if (slurm->operations || slurm->arrays) {
        slurm->active = clock_now();
        return slurm->config.poll_seconds;
    }
    due = slurm_sweep_due(slurm);
    return due > 0.0 ? fmax(due - clock_now(), slurm->config.poll_seconds) : 0.0;
}

/* ---- The thread ------------------------------------------------------------------------------ */

/* Until somebody wakes the thread, or for so many seconds; 0: for ever. */
static void wait_for_work(struct slurm *slurm, double seconds)
{
    struct timespec until = clock_timespec(clock_now() + seconds);

    (void)pthread_mutex_lock(&slurm->mutex);
    while (!slurm->woken && !atomic_load(&slurm->closing)) {
        if (seconds <= 0.0) {
            (void)pthread_cond_wait(&slurm->wake, &slurm->mutex);
        } else if (pthread_cond_clockwait(&slurm->wake, &slurm->mutex, CLOCK_MONOTONIC, &until)) {
            break;
        }
    }
    slurm->woken = false;
    (void)pthread_mutex_unlock(&slurm->mutex);
}

static void *slurm_main(void *argument)
{
    struct slurm *slurm = argument;

    (void)pthread_setname_np(pthread_self(), "srnfd-slurm");
    while (!atomic_load(&slurm->closing)) {
        double turned = clock_now();
        struct timespec pause = {.tv_nsec = (long)(1e9 * TURN_SECONDS)};

        turn(slurm);
        if (clock_now() - turned < TURN_SECONDS && !atomic_load(&slurm->closing)) {
            (void)nanosleep(&pause, NULL);
        }
        wait_for_work(slurm, rest(slurm));
    }
    return NULL;
}

int slurm_open(struct slurm **out, const struct slurm_config *config)
{
    struct slurm *slurm = calloc(1, sizeof *slurm);
    int status;

    *out = NULL;
    if (!slurm) {
        return STORE_NOMEM;
    }
    slurm->config = *config;
    slurm->active = clock_now();
    (void)snprintf(slurm->start, sizeof slurm->start, "%04x", randombytes_uniform(0x10000));
    (void)pthread_mutex_init(&slurm->mutex, NULL);
    (void)pthread_cond_init(&slurm->wake, NULL);
    status = slurm_arrays_load(slurm);
    if (status == 0 && pthread_create(&slurm->thread, NULL, slurm_main, slurm) != 0) {
        status = STORE_NOMEM;
    }
    if (status != 0) {
        slurm_arrays_free(slurm);
        (void)pthread_cond_destroy(&slurm->wake);
        (void)pthread_mutex_destroy(&slurm->mutex);
        free(slurm);
        return status;
    }
    *out = slurm;
    return 0;
}

void slurm_wake(struct slurm *slurm)
{
    (void)pthread_mutex_lock(&slurm->mutex);
    slurm->woken = true;
    (void)pthread_cond_signal(&slurm->wake);
    (void)pthread_mutex_unlock(&slurm->mutex);
}

void slurm_close(struct slurm *slurm)
{
    if (!slurm) {
        return;
    }
    atomic_store(&slurm->closing, true);
    slurm_wake(slurm);
    (void)pthread_join(slurm->thread, NULL);
    slurm->config.seconds = fmin(slurm->config.seconds, CLOSE_SECONDS);
    if (slurm->arrays) {
        slurm_look(slurm);
        slurm_settle(slurm);
    }
    for (struct slurm_array *array = slurm->arrays; array; array = array->next) {
        /* Where it is not known whether Slurm has it, the next start finds out. */
        if (array->row.number[0]) {
            slurm_array_end(slurm, array);
        }
    }
    slurm_cancel_ending(slurm, true);
    slurm_arrays_free(slurm);
    slurm_operations_free(slurm);
    (void)pthread_cond_destroy(&slurm->wake);
    (void)pthread_mutex_destroy(&slurm->mutex);
    free(slurm);
}
