/*
 * Many owners on one queue: each gets its share of the workers however long the others' queues are,
 * none has more running than it may while others wait, and nothing of one's work is another's: not
 * the cache, not the joining, not the Idempotency-Keys.
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
#include "store/job.h"
#include "store/holdings.h"

#define OWNERS 4
#define CLIENTS 20
#define EACH 50 /* jobs of each client */
#define JOBS (CLIENTS * EACH)

struct world {
    struct engine engine;
    atomic_int begun, ended, running[OWNERS], most[OWNERS];
    char order[JOBS]; /* owner's number of the n-th job that ran */
};

static const char *const owners[OWNERS] = {"ada", "ben", "cleo", "dan"};

static int number_of(const char *owner)
{
    int number = 0;

    while (strcmp(owners[number], owner) != 0) {
        number++;
    }
    return number;
}

/* Waits for the gate and writes down whose job it was. */
static void run_note(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    struct world *world = user;
    int owner = number_of(jobs_run_owner(run)), now;

    now = atomic_fetch_add(&world->running[owner], 1) + 1;
    while (now > atomic_load(&world->most[owner])) {
        atomic_store(&world->most[owner], now);
    }
    engine_wait_at_gate(&world->engine);
    world->order[atomic_fetch_add(&world->begun, 1)] = (char)owner;
    atomic_fetch_sub(&world->running[owner], 1);
    atomic_fetch_add(&world->ended, 1);
    result->results = strdup(inputs);
}

static const struct jobs_process table[] = {{"note", run_note, NULL}, {NULL, NULL, NULL}};

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
                                 .numeric_build = "build"};

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

/* Returns the status; the id goes to id unless that is NULL. */
static int submit(struct world *world, const char *owner, struct store_job_limits limits,
                  const char *inputs, const char *key, char *id, enum jobs_submission *how)
{
    const struct jobs_owner whose = {.name = owner, .limits = limits};
    struct store_job job;
    int status = jobs_submit(world->engine.jobs, &whose, "note", inputs, key, key ? "body" : NULL,
                             &job, how);

    if (status == JOBS_OK) {
        if (id) {
            memcpy(id, job.id, STORE_ID_MAX);
        }
        assert_string_equal(job.owner, owner);
        store_job_clear(&job);
    }
    return status;
}

/* ---- Shares ---------------------------------------------------------------------------------- */

struct client {
    struct world *world;
    int number;
    atomic_int errors;
};

/* The first clients are all of one owner: whoever is early is not to be served first. */
static void *submit_some(void *user)
{
    struct client *client = user;
    const char *owner = owners[client->number * OWNERS / CLIENTS];
    enum jobs_submission how;
    char inputs[32];

    for (int i = 0; i < EACH; i++) {
        snprintf(inputs, sizeof inputs, "%d %d", client->number, i);
        if (submit(client->world, owner, (struct store_job_limits){0}, inputs, NULL, NULL, &how) !=
            JOBS_OK) {
            atomic_fetch_add(&client->errors, 1);
        }
    }
    return NULL;
}

static void each_owner_gets_its_share(void **state)
{
    struct world *world = *state;
    struct client clients[CLIENTS];
    pthread_t threads[CLIENTS];
    int served[OWNERS] = {0};

    open_engine(world, 2);
    for (int i = 0; i < CLIENTS; i++) {
        clients[i] = (struct client){.world = world, .number = i};
        assert_int_equal(pthread_create(&threads[i], NULL, submit_some, &clients[i]), 0);
    }
    for (int i = 0; i < CLIENTS; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(clients[i].errors, 0);
    }
    atomic_store(&world->engine.gate, true);
    engine_await(&world->ended, JOBS);
    /* At every moment, but for the jobs that were running before all had come: within one job and
       what two workers may overtake each other. */
    for (int n = 0; n < JOBS; n++) {
        int least = JOBS, most = 0;

        served[(int)world->order[n]]++;
        for (int i = 0; i < OWNERS; i++) {
            least = served[i] < least ? served[i] : least;
            most = served[i] > most ? served[i] : most;
        }
        assert_true(most - least <= 4);
    }
    for (int i = 0; i < OWNERS; i++) {
        assert_int_equal(served[i], JOBS / OWNERS);
    }
}

static void no_owner_runs_more_than_it_may(void **state)
{
    const struct store_job_limits one = {.running = 1}, none = {0};
    struct world *world = *state;
    enum jobs_submission how;
    char inputs[32];

    open_engine(world, 3);
    for (int i = 0; i < 20; i++) {
        snprintf(inputs, sizeof inputs, "ada %d", i);
        assert_int_equal(submit(world, "ada", one, inputs, NULL, NULL, &how), JOBS_OK);
    }
    /* Two workers stay free for others. */
    for (int i = 0; i < 10; i++) {
        snprintf(inputs, sizeof inputs, "ben %d", i);
        assert_int_equal(submit(world, "ben", none, inputs, NULL, NULL, &how), JOBS_OK);
    }
    for (int ms = 0; ms < ENGINE_WAIT_MS && atomic_load(&world->running[1]) < 2; ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(atomic_load(&world->running[0]), 1);
    assert_int_equal(atomic_load(&world->running[1]), 2);
    atomic_store(&world->engine.gate, true);
    engine_await(&world->ended, 30);
    assert_int_equal(atomic_load(&world->most[0]), 1);
    assert_true(atomic_load(&world->most[1]) >= 2);
}

/* ---- Apart ----------------------------------------------------------------------------------- */

static void work_is_joined_and_cached_within_an_owner(void **state)
{
    const struct store_job_limits none = {0};
    struct world *world = *state;
    char a[STORE_ID_MAX], b[STORE_ID_MAX], again[STORE_ID_MAX];
    enum jobs_submission how;

    open_engine(world, 1);
    assert_int_equal(submit(world, "ada", none, "x", "key", a, &how), JOBS_OK);
    assert_int_equal(how, JOBS_NEW);
    assert_int_equal(submit(world, "ben", none, "x", "key", b, &how), JOBS_OK);
    assert_int_equal(how, JOBS_NEW);
    assert_string_not_equal(a, b);
    assert_int_equal(submit(world, "ada", none, "x", NULL, again, &how), JOBS_OK);
    assert_int_equal(how, JOBS_JOINED);
    assert_string_equal(a, again);
    atomic_store(&world->engine.gate, true);
    engine_await(&world->ended, 2);
    for (int ms = 0; ms < ENGINE_WAIT_MS && how != JOBS_CACHED; ms += 2) {
        engine_pause_ms(2);
        assert_int_equal(submit(world, "ben", none, "x", NULL, again, &how), JOBS_OK);
    }
    assert_int_equal(how, JOBS_CACHED);
    assert_string_equal(b, again);
    /* The key of one names nothing of the other. */
    assert_int_equal(submit(world, "ben", none, "other inputs", "key", again, &how), JOBS_OK);
    assert_string_equal(b, again);
    assert_int_equal(submit(world, "cleo", none, "x", "key", again, &how), JOBS_OK);
    assert_int_equal(how, JOBS_NEW);
}

static void a_full_queue_is_the_owners_own(void **state)
{
    const struct store_job_limits two = {.queued = 2};
    struct world *world = *state;
    enum jobs_submission how;
    char id[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1);
    assert_int_equal(submit(world, "dan", two, "running", NULL, NULL, &how), JOBS_OK);
    for (int ms = 0; ms < ENGINE_WAIT_MS && atomic_load(&world->running[3]) < 1; ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(submit(world, "ada", two, "1", NULL, id, &how), JOBS_OK);
    assert_int_equal(submit(world, "ada", two, "2", NULL, NULL, &how), JOBS_OK);
    assert_int_equal(submit(world, "ada", two, "3", NULL, NULL, &how), STORE_QUEUED);
    assert_int_equal(submit(world, "ada", two, "2", NULL, NULL, &how), JOBS_OK); /* joined */
    assert_int_equal(submit(world, "ben", two, "1", NULL, NULL, &how), JOBS_OK);
    assert_int_equal(jobs_cancel(world->engine.jobs, id, &job), STORE_OK);
    store_job_clear(&job);
    assert_int_equal(submit(world, "ada", two, "3", NULL, NULL, &how), JOBS_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_owner_gets_its_share, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(no_owner_runs_more_than_it_may, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(work_is_joined_and_cached_within_an_owner, setup,
                                        engine_teardown),
        cmocka_unit_test_setup_teardown(a_full_queue_is_the_owners_own, setup, engine_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
