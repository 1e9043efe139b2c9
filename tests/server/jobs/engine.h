/*
 * engine.h - what the tests of the engine share: a store in a directory that goes away, the engine
 * on it, a gate at which processes wait, and waiting for what other threads do. For programs that
 * include cmocka.h first.
 */
#ifndef SRNFD_TEST_ENGINE_H
#define SRNFD_TEST_ENGINE_H

#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

#include "../store/fixture.h"
#include "jobs/jobs.h"

#define ENGINE_WAIT_MS 120000 /* for anything that other threads do */

/* First member of the world that a program's processes see. */
struct engine {
    struct fixture *fixture;
    struct jobs *jobs; /* NULL: not open */
    atomic_bool gate;  /* opened by engine_teardown at the latest */
};

static inline void engine_pause_ms(int ms)
{
    struct timespec time = {.tv_nsec = ms * 1000000L};

    nanosleep(&time, NULL);
}

/* Waits at the gate. */
static inline void engine_wait_at_gate(struct engine *engine)
{
    while (!atomic_load(&engine->gate)) {
        engine_pause_ms(1);
    }
}

/* A world of this size, of zeros but for its store. */
static inline int engine_setup(void **state, size_t world_size)
{
    struct engine *engine = calloc(1, world_size);
    void *fixture;

    fixture_setup(&fixture);
    engine->fixture = fixture;
    *state = engine;
    return 0;
}

static inline int engine_teardown(void **state)
{
    struct engine *engine = *state;
    void *fixture = engine->fixture;

    atomic_store(&engine->gate, true);
    jobs_close(engine->jobs, 10.0);
    fixture_teardown(&fixture);
    free(engine);
    return 0;
}

/* Waits until a counter has come to what is wanted, and no further. */
static inline void engine_await(atomic_int *counter, int wanted)
{
    for (int ms = 0; ms < ENGINE_WAIT_MS && atomic_load(counter) < wanted; ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(atomic_load(counter), wanted);
}

#endif
