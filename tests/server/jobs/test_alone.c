/*
 * test_alone.c - jobs that the daemon has died with: they are put back, after the third death they
 * wait until the engine has lived for a while, and then run with no other job beside them, one
 * after the other; what came in the meantime runs before and after.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>

#include "engine.h"
#include "jobs/submit.h"
#include "store/digest.h"
#include "store/job.h"

#define CALM 0.3 /* seconds */
#define OTHERS 12

struct world {
    struct engine engine;
    atomic_int running, most_beside_alone, ended, alone_ended, ended_before_alone;
    double opened, first_alone;
};

static double now_seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void run_short(struct jobs_run *run, void *user, const char *inputs,
                      struct jobs_result *result)
{
    struct world *world = user;
    bool alone = inputs[0] == 'a';

    (void)run;
    (void)atomic_fetch_add(&world->running, 1);
    if (alone && atomic_load(&world->alone_ended) == 0) {
        world->first_alone = now_seconds();
        atomic_store(&world->ended_before_alone, atomic_load(&world->ended));
    }
    for (int ms = 0; ms < 30; ms++) {
        int beside = atomic_load(&world->running) - 1;

        if (alone && beside > atomic_load(&world->most_beside_alone)) {
            atomic_store(&world->most_beside_alone, beside);
        }
        engine_pause_ms(1);
    }
    (void)atomic_fetch_sub(&world->running, 1);
    (void)atomic_fetch_add(alone ? &world->alone_ended : &world->ended, 1);
    result->results = strdup("{}");
}

static const struct jobs_process table[] = {{"short", run_short, NULL}, {NULL, NULL, NULL}};

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

static void open_engine(struct world *world, size_t workers)
{
    struct jobs_config config = {.store = world->engine.fixture->store,
                                 .workers = workers,
                                 .table = table,
                                 .user = world,
                                 .numeric_build = "test",
                                 .calm_seconds = CALM};

    world->opened = now_seconds();
    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

/* An accepted row, short enough for the express worker. */
static void insert(struct store *store, const char *id, const char *inputs)
{
    char process[] = "short", text[16];
    struct store_job job = {.process = process, .inputs = text, .express = true, .expected_ms = 1};

    snprintf(job.id, sizeof job.id, "%s", id);
    snprintf(text, sizeof text, "%s", inputs);
    store_sha256_hex(job.digest, inputs, strlen(inputs));
    assert_int_equal(store_job_insert(store, &job, NULL, NULL, NULL), STORE_OK);
}

/* The daemon dies so often while these n jobs run. */
static void die(struct store *store, int times, size_t n)
{
    size_t requeued, failed;

    for (int i = 0; i < times; i++) {
        for (size_t k = 0; k < n; k++) {
            struct store_job job;

            assert_int_equal(store_job_claim(store, &job), STORE_OK);
            store_job_clear(&job);
        }
        assert_int_equal(store_job_recover(store, 3, NULL, &requeued, &failed), STORE_OK);
        assert_int_equal(requeued, n);
        assert_int_equal(failed, 0);
    }
}

/* The row follows the run. */
static void await_success(struct store *store, const char *id)
{
    for (int ms = 0; ms < ENGINE_WAIT_MS && fixture_status(store, id) != STORE_JOB_SUCCESSFUL;
         ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(fixture_status(store, id), STORE_JOB_SUCCESSFUL);
}

static void suspects_run_alone_and_late(void **state)
{
    struct world *world = *state;
    struct store *store = world->engine.fixture->store;
    char id[16], inputs[16];

    insert(store, "job-a1", "a1");
    insert(store, "job-a2", "a2");
    die(store, 3, 2);
    for (int i = 0; i < OTHERS; i++) {
        snprintf(id, sizeof id, "job-%d", i);
        snprintf(inputs, sizeof inputs, "%d", i);
        insert(store, id, inputs);
    }
    open_engine(world, 2);
    engine_await(&world->alone_ended, 2);
    engine_await(&world->ended, OTHERS);
    assert_true(world->first_alone - world->opened >= CALM);
    assert_int_equal(atomic_load(&world->most_beside_alone), 0);
    assert_true(atomic_load(&world->ended_before_alone) > 0);
    await_success(store, "job-a1");
    await_success(store, "job-a2");
}

static void two_deaths_are_none(void **state)
{
    struct world *world = *state;
    struct store *store = world->engine.fixture->store;

    insert(store, "job-a1", "a1");
    die(store, 2, 1);
    open_engine(world, 1);
    engine_await(&world->alone_ended, 1);
    assert_true(world->first_alone - world->opened < CALM);
}

/* Those that wait to run alone can be dismissed; the engine then goes on. */
static void a_suspect_is_dismissed(void **state)
{
    struct world *world = *state;
    struct store *store = world->engine.fixture->store;
    struct store_job job;
    enum jobs_submission how;

    insert(store, "job-a1", "a1");
    die(store, 3, 1);
    open_engine(world, 2);
    assert_int_equal(jobs_cancel(world->engine.jobs, "job-a1", &job), JOBS_OK);
    assert_int_equal(job.status, STORE_JOB_DISMISSED);
    store_job_clear(&job);
    engine_pause_ms((int)(1500 * CALM) % 1000);
    assert_int_equal(
        jobs_submit(world->engine.jobs, NULL, "short", "other", NULL, NULL, &job, &how), JOBS_OK);
    store_job_clear(&job);
    engine_await(&world->ended, 1);
    assert_int_equal(atomic_load(&world->alone_ended), 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, engine_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(suspects_run_alone_and_late),
        TEST(two_deaths_are_none),
        TEST(a_suspect_is_dismissed),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
