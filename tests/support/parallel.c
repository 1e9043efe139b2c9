/*
 * parallel.c - ways of running a parallel loop.
 */
#include "support/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#define THREADS ((size_t)4)
#define THREADS_MAX ((size_t)64)

void parallel_backwards(void *user, size_t count, void (*body)(void *argument, size_t index),
                        void *argument)
{
    (void)user;
    for (size_t i = count; i-- > 0;) {
        body(argument, i);
    }
}

struct loop {
    atomic_size_t next;
    size_t count;
    void (*body)(void *argument, size_t index);
    void *argument;
};

static void *work(void *argument)
{
    struct loop *loop = argument;

    for (size_t i = atomic_fetch_add(&loop->next, 1); i < loop->count;
         i = atomic_fetch_add(&loop->next, 1)) {
        loop->body(loop->argument, i);
    }
    return NULL;
}

void parallel_spread(size_t threads, size_t count, void (*body)(void *argument, size_t index),
                     void *argument)
{
    struct loop loop = {.count = count, .body = body, .argument = argument};
    pthread_t workers[THREADS_MAX];

    if (threads < 1 || threads > THREADS_MAX) {
        abort();
    }
    for (size_t i = 0; i < threads; i++) {
        if (pthread_create(&workers[i], NULL, work, &loop)) {
            abort();
        }
    }
    for (size_t i = 0; i < threads; i++) {
        if (pthread_join(workers[i], NULL)) {
            abort();
        }
    }
}

void parallel_threads(void *user, size_t count, void (*body)(void *argument, size_t index),
                      void *argument)
{
    (void)user;
    parallel_spread(THREADS, count, body, argument);
}
