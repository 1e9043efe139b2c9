/*
 * Short jobs beside long ones: with every worker held by a long job, a job that is expected to be
 * short runs at once, one of which nothing is known waits; short jobs keep to the limits of their
 * owner and are found again after a restart; a job that is not short after all gives up the lane,
 * so that others go on, as often as there is a thread for it, and the threads are counted; one
 * owner does not get all of them where there are others; nothing is run twice or left behind where
 * the express worker and the others are after the same jobs; and the accounts of memory are kept
 * apart.
 *
 * srnfd-test: no-asan (fuzz/test_api.sh and test_engine.c run its code)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdatomic.h>

#include "engine.h"
#include "jobs/submit.h"
#include "store/digest.h"
#include "store/job.h"

#define MANY 300
#define CLIENTS 4

struct world {
    struct engine engine;
    atomic_int held, quick, runs[CLIENTS * MANY];
};

/* Holds memory of its own and waits for the gate, or for its cancellation. */
static void run_hold(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;
    void *block = srnf_alloc(1, (size_t)3 << 20);

    atomic_fetch_add(&world->held, 1);
    while (!atomic_load(&world->engine.gate) && !context->canceled(context->user)) {
        engine_pause_ms(1);
    }
    srnf_free(block);
    if (atomic_load(&world->engine.gate)) {
        result->results = strdup(inputs);
    }
}

/* Fails where its account has not the room that a job alone has. */
static void run_quick(struct jobs_run *run, void *user, const char *inputs,
                      struct jobs_result *result)
{
    struct world *world = user;
    void *block = srnf_alloc(1, (size_t)3 << 20);

    (void)run;
    atomic_fetch_add(&world->runs[strtol(inputs, NULL, 10)], 1);
    if (block) {
        result->results = strdup(inputs);
    }
    srnf_free(block);
    atomic_fetch_add(&world->quick, 1);
}

static const struct jobs_process table[] = {
    {"hold", run_hold, NULL}, {"quick", run_quick, NULL}, {NULL, NULL, NULL}};

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
                                 .numeric_build = "build",
                                 .job_memory = (size_t)4 << 20};

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

static int submit(struct world *world, const char *owner, const char *process, const char *inputs,
                  double seconds, size_t running, char id[STORE_ID_MAX])
{
    const struct jobs_owner whose = {
        .name = owner, .limits = {.running = running}, .seconds = seconds};
    enum jobs_submission how;
    struct store_job job;
    int status = jobs_submit(world->engine.jobs, &whose, process, inputs, NULL, NULL, &job, &how);

    if (status == JOBS_OK) {
        memcpy(id, job.id, STORE_ID_MAX);
        store_job_clear(&job);
    }
    return status;
}

static void await(struct world *world, const char *id, enum store_job_status wanted)
{
    struct store *store = world->engine.fixture->store;

    for (int ms = 0; ms < ENGINE_WAIT_MS && fixture_status(store, id) != wanted; ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(fixture_status(store, id), wanted);
}

static void hold_all(struct world *world, const char *owner, int workers, size_t running)
{
    char inputs[32], id[STORE_ID_MAX];

    for (int i = 0; i < workers; i++) {
        snprintf(inputs, sizeof inputs, "long %d", i);
        assert_int_equal(submit(world, owner, "hold", inputs, 300.0, running, id), JOBS_OK);
    }
    engine_await(&world->held, workers);
}

static void short_jobs_do_not_wait_for_long_ones(void **state)
{
    struct world *world = *state;
    char unknown[STORE_ID_MAX], middling[STORE_ID_MAX], quick[STORE_ID_MAX];

    open_engine(world, 2);
    hold_all(world, "ada", 2, 0);
    assert_int_equal(submit(world, "ada", "quick", "0", 0.0, 0, unknown), JOBS_OK);
    assert_int_equal(submit(world, "ada", "quick", "1", JOBS_EXPRESS_SECONDS + 0.1, 0, middling),
                     JOBS_OK);
    assert_int_equal(submit(world, "ada", "quick", "2", JOBS_EXPRESS_SECONDS, 0, quick), JOBS_OK);
    await(world, quick, STORE_JOB_SUCCESSFUL);
    assert_int_equal(fixture_status(world->engine.fixture->store, unknown), STORE_JOB_ACCEPTED);
    assert_int_equal(fixture_status(world->engine.fixture->store, middling), STORE_JOB_ACCEPTED);
    atomic_store(&world->engine.gate, true);
    await(world, unknown, STORE_JOB_SUCCESSFUL);
    await(world, middling, STORE_JOB_SUCCESSFUL);
}

static void short_jobs_keep_to_their_owners_limits(void **state)
{
    struct world *world = *state;
    char mine[STORE_ID_MAX], other[STORE_ID_MAX];

    open_engine(world, 1);
    hold_all(world, "ada", 1, 1);
    assert_int_equal(submit(world, "ada", "quick", "0", 0.1, 1, mine), JOBS_OK);
    assert_int_equal(submit(world, "ben", "quick", "1", 0.1, 1, other), JOBS_OK);
    await(world, other, STORE_JOB_SUCCESSFUL);
    assert_int_equal(fixture_status(world->engine.fixture->store, mine), STORE_JOB_ACCEPTED);
    atomic_store(&world->engine.gate, true);
    await(world, mine, STORE_JOB_SUCCESSFUL);
}

static void short_jobs_are_found_after_a_restart(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX], process[] = "quick", inputs[] = "7", build[] = "build", empty[] = "";
    struct store_job job = {.id = "job-00000001",
                            .process = process,
                            .inputs = inputs,
                            .message = empty,
                            .numeric_build = build,
                            .created_ms = 5,
                            .expected_ms = 10,
                            .express = true};

    open_engine(world, 1);
    hold_all(world, "", 1, 0);
    jobs_close(world->engine.jobs, 0.0); /* the long one waits again, and is the older */
    world->engine.jobs = NULL;
    store_sha256_hex(job.digest, inputs, strlen(inputs));
    assert_int_equal(store_job_insert(world->engine.fixture->store, &job, NULL, NULL, NULL),
                     STORE_OK);
    memcpy(id, job.id, sizeof id);
    open_engine(world, 1);
    await(world, id, STORE_JOB_SUCCESSFUL);
    assert_int_equal(atomic_load(&world->engine.gate), false);
}

static void a_short_job_can_be_cancelled(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1);
    hold_all(world, "ada", 1, 0);
    /* Wrongly expected to be short: it holds the express worker, and can be stopped there. */
    assert_int_equal(submit(world, "ada", "hold", "short", 0.1, 0, id), JOBS_OK);
    engine_await(&world->held, 2);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_int_equal(job.status, STORE_JOB_RUNNING);
    store_job_clear(&job);
    assert_int_equal(jobs_cancel(world->engine.jobs, id, &job), STORE_OK);
    store_job_clear(&job);
    await(world, id, STORE_JOB_DISMISSED);
}

/* The health once so many threads of the lane are busy: one is so for a moment after its job has
   ended in the store. */
static void await_express_busy(struct world *world, size_t busy, struct jobs_health *health)
{
    for (int i = 0; i < 500; i++) {
        jobs_health(world->engine.jobs, health);
        if (health->express_busy == busy) {
            return;
        }
        engine_pause_ms(10);
    }
    assert_int_equal(health->express_busy, busy);
}

/* Two jobs that were misjudged: the first lets others by after a while, and takes its thread with
   it for as long as it runs. */
static void a_long_job_gives_up_the_lane(void **state)
{
    struct world *world = *state;
    char misjudged[STORE_ID_MAX], quick[STORE_ID_MAX], other[STORE_ID_MAX];
    struct jobs_health health;

    open_engine(world, 1);
    hold_all(world, "ada", 1, 0);
    assert_int_equal(submit(world, "ada", "hold", "first", 0.1, 0, misjudged), JOBS_OK);
    engine_await(&world->held, 2);
    assert_int_equal(submit(world, "ada", "quick", "0", 0.1, 0, quick), JOBS_OK);
    await(world, quick, STORE_JOB_SUCCESSFUL);
    assert_int_equal(submit(world, "ben", "quick", "1", 0.1, 0, quick), JOBS_OK);
    await(world, quick, STORE_JOB_SUCCESSFUL);
    await_express_busy(world, 1, &health);
    assert_int_equal(health.workers, 1);
    assert_int_equal(health.busy, 1);
    assert_int_equal(health.express, JOBS_EXPRESS_THREADS);
    assert_int_equal(health.express_alive, JOBS_EXPRESS_THREADS);

    /* No more of them than there are threads. */
    assert_int_equal(submit(world, "ben", "hold", "second", 0.1, 0, other), JOBS_OK);
    engine_await(&world->held, 3);
    assert_int_equal(submit(world, "ada", "quick", "2", 0.1, 0, quick), JOBS_OK);
    engine_pause_ms((long)(1500.0 * JOBS_EXPRESS_PATIENCE));
    jobs_health(world->engine.jobs, &health);
    assert_int_equal(health.express_busy, JOBS_EXPRESS_THREADS);
    assert_int_equal(fixture_status(world->engine.fixture->store, quick), STORE_JOB_ACCEPTED);
    atomic_store(&world->engine.gate, true);
    await(world, quick, STORE_JOB_SUCCESSFUL);
    await(world, misjudged, STORE_JOB_SUCCESSFUL);
    await(world, other, STORE_JOB_SUCCESSFUL);
}

/* Of the two threads of the lane a name that is not alone gets one: however many jobs it sends that
   are longer than expected, the short jobs of others go on. */
static void one_owner_does_not_hold_the_lane(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX], mine[STORE_ID_MAX];
    struct jobs_health health;

    open_engine(world, 1);
    hold_all(world, "ben", 1, 0);
    assert_int_equal(submit(world, "ada", "hold", "first", 0.1, 0, id), JOBS_OK);
    engine_await(&world->held, 2);
    assert_int_equal(submit(world, "ada", "hold", "second", 0.1, 0, mine), JOBS_OK);
    engine_pause_ms((long)(1250.0 * JOBS_EXPRESS_PATIENCE));
    assert_int_equal(fixture_status(world->engine.fixture->store, mine), STORE_JOB_ACCEPTED);
    jobs_health(world->engine.jobs, &health);
    assert_int_equal(health.express_busy, 1);
    assert_int_equal(submit(world, "ben", "quick", "0", 0.1, 0, id), JOBS_OK);
    await(world, id, STORE_JOB_SUCCESSFUL);
    atomic_store(&world->engine.gate, true);
    await(world, mine, STORE_JOB_SUCCESSFUL);
}

struct client {
    struct world *world;
    int number, errors;
};

static void *submit_many(void *argument)
{
    struct client *client = argument;
    char inputs[32], id[STORE_ID_MAX];

    for (int i = 0; i < MANY; i++) {
        snprintf(inputs, sizeof inputs, "%d", client->number * MANY + i);
        client->errors += submit(client->world, client->number % 2 ? "ada" : "ben", "quick", inputs,
                                 i % 3 ? 0.1 : 5.0, 0, id) != JOBS_OK;
    }
    return NULL;
}

/* Short and other jobs at once, more workers than one: each runs once. */
static void each_job_runs_once(void **state)
{
    struct world *world = *state;
    struct client clients[CLIENTS];
    pthread_t threads[CLIENTS];

    open_engine(world, 2);
    for (int i = 0; i < CLIENTS; i++) {
        clients[i] = (struct client){.world = world, .number = i};
        assert_int_equal(pthread_create(&threads[i], NULL, submit_many, &clients[i]), 0);
    }
    for (int i = 0; i < CLIENTS; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(clients[i].errors, 0);
    }
    engine_await(&world->quick, CLIENTS * MANY);
    for (int i = 0; i < CLIENTS * MANY; i++) {
        assert_int_equal(world->runs[i], 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(short_jobs_do_not_wait_for_long_ones, setup,
                                        engine_teardown),
        cmocka_unit_test_setup_teardown(short_jobs_keep_to_their_owners_limits, setup,
                                        engine_teardown),
        cmocka_unit_test_setup_teardown(short_jobs_are_found_after_a_restart, setup,
                                        engine_teardown),
        cmocka_unit_test_setup_teardown(a_short_job_can_be_cancelled, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(a_long_job_gives_up_the_lane, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(one_owner_does_not_hold_the_lane, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(each_job_runs_once, setup, engine_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
