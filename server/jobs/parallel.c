/*
 * parallel.c - one job's loops, spread over workers that have nothing else to do.
 *
 * The loop hands out its indexes by an atomic counter. The caller publishes it, takes indexes
 * like everyone else, and when none is left withdraws it and waits for the helpers that are still
 * inside a body. It never waits for help to come: when all workers are busy it does the whole
 * loop itself, so that loops cannot deadlock. A helper leaves early when a job waits for a
 * worker. What bodies allocate on a helper is charged to the job, as on its own worker.
 *
 * A loop inside a body runs serially, there and then: the run knows that its loop is open, and
 * while it is, only bodies can be calling. Who does which index is left to chance; that results
 * do not depend on it is up to the bodies, each of which writes only what belongs to its index.
 *
 * Lock: jobs->mutex (rank 20) guards the list of loops and their helpers, never held while a body
 * runs.
 */
#include "jobs/internal.h"
#include "store/job.h"

static void take_indexes(struct jobs *jobs, struct jobs_loop *loop, bool helper)
{
    for (;;) {
        size_t index;

        if (helper && atomic_load_explicit(&jobs->tickets, memory_order_relaxed) > 0 &&
            !atomic_load_explicit(&jobs->alone.hold, memory_order_relaxed) &&
            !atomic_load_explicit(&jobs->draining, memory_order_relaxed)) {
            return;
        }
        index = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (index >= loop->count) {
            return;
        }
        loop->body(loop->argument, index);
    }
}

struct jobs_loop *jobs_loop_enter(struct jobs *jobs)
{
    for (struct jobs_loop *loop = jobs->loops; loop; loop = loop->link) {
        if (atomic_load_explicit(&loop->next, memory_order_relaxed) < loop->count) {
            loop->helpers++;
            return loop;
        }
    }
    return NULL;
}

void jobs_loop_help(struct jobs *jobs, struct jobs_loop *loop)
{
    (void)jobs_memory_enter(loop->memory);
    fault_enter(loop->job, loop->process);
    take_indexes(jobs, loop, true);
    fault_enter(NULL, NULL);
    (void)jobs_memory_enter(NULL);
    pthread_mutex_lock(&jobs->mutex);
    if (--loop->helpers == 0) {
        pthread_cond_signal(&loop->left);
    }
    pthread_mutex_unlock(&jobs->mutex);
}

static void publish(struct jobs *jobs, struct jobs_loop *loop)
{
    pthread_mutex_lock(&jobs->mutex);
    loop->link = jobs->loops;
    jobs->loops = loop;
    if (jobs->idle > 0) {
        pthread_cond_broadcast(&jobs->wake);
    }
    pthread_mutex_unlock(&jobs->mutex);
}

static void withdraw(struct jobs *jobs, struct jobs_loop *loop)
{
    struct jobs_loop **link = &jobs->loops;

    pthread_mutex_lock(&jobs->mutex);
    while (*link != loop) {
        link = &(*link)->link;
    }
    *link = loop->link;
    while (loop->helpers > 0) {
        pthread_cond_wait(&loop->left, &jobs->mutex);
    }
    pthread_mutex_unlock(&jobs->mutex);
}

void jobs_parallel_for(void *user, size_t count, void (*body)(void *argument, size_t index),
                       void *argument)
{
    struct jobs_run *run = user;
    struct jobs_loop *loop = &run->loop;

    if (count < 2 || run->jobs->n_workers < 2 || atomic_load(&loop->open)) {
        for (size_t i = 0; i < count; i++) {
            body(argument, i);
        }
        return;
    }
    loop->count = count;
    loop->body = body;
    loop->argument = argument;
    loop->memory = run->memory;
    loop->job = run->job->id;
    loop->process = run->job->process;
    atomic_store(&loop->next, 0);
    atomic_store(&loop->open, true);
    publish(run->jobs, loop);
    take_indexes(run->jobs, loop, false);
    withdraw(run->jobs, loop);
    atomic_store(&loop->open, false);
}
