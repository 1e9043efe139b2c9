/*
 * parallel.c - two ways of running a parallel loop.
 */
#include "support/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#define THREADS ((size_t)4)

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

void parallel_threads(void *user, size_t count, void (*body)(void *argument, size_t index),
                      void *argument)
{
    struct loop loop = {.count = count, .body = body, .argument = argument};
    pthread_t threads[THREADS];

    (void)user;
    for (size_t i = 0; i < THREADS; i++) {
        if (pthread_create(&threads[i], NULL, work, &loop)) {
            abort();
        }
    }
    for (size_t i = 0; i < THREADS; i++) {
        if (pthread_join(threads[i], NULL)) {
            abort();
        }
    }
}
