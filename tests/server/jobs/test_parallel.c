/*
 * Parallel loops among the workers: each index once, results the same as alone, loops within
 * loops, several jobs' loops at once, help that really comes, and no deadlock when none can.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "engine.h"
#include "jobs/submit.h"
#include "store/job.h"

#define COUNT ((size_t)2000)
#define INNER ((size_t)10)

struct world {
    struct engine engine;
    atomic_int wrong, met;
};

struct loop {
    const struct srnf_context *context;
    atomic_int calls[COUNT];
    size_t squares[COUNT], inner[COUNT * INNER];
};

static void square(void *argument, size_t index)
{
    struct loop *loop = argument;

    atomic_fetch_add(&loop->calls[index], 1);
    loop->squares[index] = index * index;
}

struct inner {
    size_t *row;
    size_t base;
    pthread_t thread;
    bool strayed;
};

static void inner_body(void *argument, size_t index)
{
    struct inner *inner = argument;

    inner->strayed |= !pthread_equal(inner->thread, pthread_self());
    inner->row[index] = inner->base + index;
}

static void outer_body(void *argument, size_t index)
{
    struct loop *loop = argument;
    struct inner inner = {
        .row = &loop->inner[index * INNER], .base = index * INNER, .thread = pthread_self()};

    atomic_fetch_add(&loop->calls[index], 1);
    loop->context->parallel_for(loop->context->user, INNER, inner_body, &inner);
    if (inner.strayed) {
        atomic_fetch_add(&loop->calls[index], 100);
    }
}

/* Ten loops in a row, flat and nested, each checked in full. */
static void run_loops(struct jobs_run *run, void *user, const char *inputs,
                      struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;

    for (int round = 0; round < 10; round++) {
        struct loop *loop = calloc(1, sizeof *loop);
        size_t count = round % 5 == 4 ? (size_t)round - 4 : COUNT; /* also 0 and 5 indexes */

        loop->context = context;
        context->parallel_for(context->user, count, round % 2 ? outer_body : square, loop);
        for (size_t i = 0; i < COUNT; i++) {
            bool right = loop->calls[i] == (i < count) &&
                         (round % 2 || loop->squares[i] == (i < count ? i * i : 0));

            for (size_t k = 0; round % 2 && i < count && k < INNER; k++) {
                right = right && loop->inner[i * INNER + k] == i * INNER + k;
            }
            atomic_fetch_add(&world->wrong, !right);
        }
        free(loop);
    }
    result->results = strdup(inputs);
}

/* Two bodies that each wait for the other: only with two threads at once do both arrive. */
struct meeting {
    pthread_t caller;
    atomic_int arrived, left;
    atomic_bool gave_up;
};

static void meet(void *argument, size_t index)
{
    struct meeting *meeting = argument;
    struct timespec time = {.tv_nsec = 1000000L};

    (void)index;
    atomic_fetch_add(&meeting->arrived, 1);
    for (int ms = 0; atomic_load(&meeting->arrived) < 2; ms++) {
        if (ms > ENGINE_WAIT_MS) {
            atomic_store(&meeting->gave_up, true);
            return;
        }
        nanosleep(&time, NULL);
    }
    /* Whoever came to help leaves last: the loop must wait for it. */
    for (int ms = 0; ms < 30 && !pthread_equal(meeting->caller, pthread_self()); ms++) {
        nanosleep(&time, NULL);
    }
    atomic_fetch_add(&meeting->left, 1);
}

static void run_meeting(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;
    struct meeting meeting = {.caller = pthread_self()};

    context->parallel_for(context->user, 2, meet, &meeting);
    atomic_store(&world->met, meeting.gave_up ? -1 : atomic_load(&meeting.left));
    result->results = strdup(inputs);
}

static const struct jobs_process table[] = {
    {"loops", run_loops, NULL}, {"meeting", run_meeting, NULL}, {NULL, NULL, NULL}};

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

/* Runs n jobs of this process on so many workers to their end. */
static void run_jobs(struct world *world, const char *process, int n, size_t workers)
{
    struct jobs_config config = {
        .store = world->engine.fixture->store, .workers = workers, .table = table, .user = world};
    struct timespec time = {.tv_nsec = 2000000L};
    size_t successful = 0;

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
    for (int i = 0; i < n; i++) {
        char inputs[16];
        struct store_job job;
        enum jobs_submission how;

        snprintf(inputs, sizeof inputs, "%d", i);
        assert_int_equal(
            jobs_submit(world->engine.jobs, NULL, process, inputs, NULL, NULL, &job, &how),
            JOBS_OK);
        store_job_clear(&job);
    }
    for (int ms = 0; ms < ENGINE_WAIT_MS && successful < (size_t)n; ms += 2) {
        nanosleep(&time, NULL);
        assert_int_equal(
            store_job_count(world->engine.fixture->store, STORE_JOB_SUCCESSFUL, &successful),
            STORE_OK);
    }
    jobs_close(world->engine.jobs, 5.0);
    world->engine.jobs = NULL;
    assert_int_equal(successful, n);
}

static void every_index_once_with_idle_workers(void **state)
{
    struct world *world = *state;

    run_jobs(world, "loops", 1, 4);
    assert_int_equal(world->wrong, 0);
}

static void every_index_once_with_busy_workers(void **state)
{
    struct world *world = *state;

    run_jobs(world, "loops", 8, 4);
    assert_int_equal(world->wrong, 0);
}

static void a_single_worker_does_it_alone(void **state)
{
    struct world *world = *state;

    run_jobs(world, "loops", 2, 1);
    assert_int_equal(world->wrong, 0);
}

static void idle_workers_help(void **state)
{
    struct world *world = *state;

    run_jobs(world, "meeting", 1, 2);
    assert_int_equal(world->met, 2);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, engine_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(every_index_once_with_idle_workers),
        TEST(every_index_once_with_busy_workers),
        TEST(a_single_worker_does_it_alone),
        TEST(idle_workers_help),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
