/*
 * parallel.h - ways of running a parallel loop that a test can put in a context: a result that
 * is the same under both and in order does not depend on how its work is spread.
 */
#ifndef TESTS_PARALLEL_H
#define TESTS_PARALLEL_H

#include <stddef.h>

/* As the member parallel_for of struct srnf_context: from the last index to the first. */
void parallel_backwards(void *user, size_t count, void (*body)(void *argument, size_t index),
                        void *argument);

/* Four threads that take the next index when they are free. */
void parallel_threads(void *user, size_t count, void (*body)(void *argument, size_t index),
                      void *argument);

/* The same on a number of threads of choice, 1 to 64. */
void parallel_spread(size_t threads, size_t count, void (*body)(void *argument, size_t index),
                     void *argument);

#endif
