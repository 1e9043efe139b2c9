/*
 * What came of a lease behind the back of an open round, as it can while a daemon that was started
 * again opens it: the store has the end of the lease, and nobody told the round. The job must take
 * it from the store when the lease has expired. And which workers count as alive.
 *
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <string.h>

#include "clock.h"
#include "engine.h"
#include "jobs/internal.h"
#include "jobs/submit.h"
#include "jobs/tasks.h"
#include "store/job.h"
#include "store/task.h"

#define TASKS 3
#define LEASE_SECONDS 0.2

struct world {
    struct engine engine;
    atomic_int taken[TASKS]; /* times that the result of each was taken */
    atomic_int offers;       /* times that workers who wait were told of tasks */
};

static bool any_byte(const void *inputs, size_t size, const void *result, size_t result_size)
{
    (void)inputs;
    (void)result;
    return size == 1 && result_size == 1;
}

static const struct tasks_kind kind = {.name = "bytes", .check = any_byte};

static int describe(void *user, size_t index, struct jobs_task *task)
{
    (void)user;
    *task = (struct jobs_task){.inputs = {.bytes = malloc(1), .size = 1}};
    task->inputs.bytes[0] = (unsigned char)('a' + index);
    return 0;
}

static int take(void *user, size_t index, const void *result, size_t size)
{
    struct world *world = user;

    assert_int_equal(size, 1);
    assert_int_equal(*(const unsigned char *)result, 'A' + index);
    atomic_fetch_add(&world->taken[index], 1);
    return 0;
}

static void run_round(struct jobs_run *run, void *user, const char *inputs,
                      struct jobs_result *result)
{
    const struct jobs_round round = {
        .kind = &kind, .n = TASKS, .describe = describe, .take = take, .user = user};

    if (jobs_run_round(run, &round, result) == 0) {
        result->results = strdup(inputs);
    }
}

static const struct jobs_process table[] = {{"round", run_round, NULL}, {NULL, NULL, NULL}};

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

static const struct store_maker maker = {.host = "here", .cpu = "any", .build = "one"};
static const struct jobs_remote remote = {
    .name = "worker", .host = "here", .cpu = "any", .slots = TASKS};

/* The job begins, and the worker leases a task as soon as there is one. */
static void lease(struct world *world, struct jobs_lease *got)
{
    struct jobs_remote worker = remote;
    int status = STORE_NOT_FOUND;

    jobs_remote_who(worker.owner, worker.job, worker.name, worker.who);
    for (int ms = 0; ms < ENGINE_WAIT_MS && status == STORE_NOT_FOUND; ms += 2) {
        engine_pause_ms(2);
        status = jobs_lease(world->engine.jobs, &worker, got);
    }
    assert_int_equal(status, STORE_OK);
    assert_int_equal(got->what.inputs.size, 1);
}

static void count_offer(void *user)
{
    struct world *world = user;

    atomic_fetch_add(&world->offers, 1);
}

static void open_engine(struct world *world, double lease_seconds)
{
    struct jobs_config config = {.store = world->engine.fixture->store,
                                 .workers = 1,
                                 .table = table,
                                 .user = world,
                                 .offers_tasks = true,
                                 .offered = count_offer,
                                 .lease_seconds = lease_seconds};

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

static void begin(struct world *world, double lease_seconds)
{
    struct store_job job;
    enum jobs_submission how;

    open_engine(world, lease_seconds);
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "round", "{}", NULL, NULL, &job, &how),
                     JOBS_OK);
    store_job_clear(&job);
}

/* What the round has to do, once it is open. */
static void await_demand(struct world *world, struct jobs_demand *demand)
{
    size_t n = 0;

    for (int ms = 0; ms < ENGINE_WAIT_MS && n == 0; ms += 2) {
        engine_pause_ms(2);
        n = jobs_demands(world->engine.jobs, demand, 1);
    }
    assert_int_equal(n, 1);
}

static void finish(struct world *world, struct jobs_lease *lease)
{
    const struct jobs_proof proof = {.secret = lease->secret, .owner = "", .job = ""};
    unsigned char byte = (unsigned char)(lease->what.inputs.bytes[0] - 'a' + 'A');

    assert_int_equal(jobs_lease_finish(world->engine.jobs, lease->task, &proof, &maker, &byte, 1),
                     STORE_OK);
    jobs_task_clear(&lease->what);
}

/* What the store keeps the digest of, as leases.c writes it. */
static void proof_of(const struct jobs_lease *lease, char text[JOBS_SECRET_SIZE + 2])
{
    snprintf(text, JOBS_SECRET_SIZE + 2, "%s\n\n", lease->secret);
}

static void await_success(struct world *world)
{
    size_t successful = 0;

    for (int ms = 0; ms < 20000 && successful == 0; ms += 2) {
        engine_pause_ms(2);
        assert_int_equal(
            store_job_count(world->engine.fixture->store, STORE_JOB_SUCCESSFUL, &successful),
            STORE_OK);
    }
    assert_int_equal(successful, 1);
    for (size_t i = 0; i < TASKS; i++) {
        assert_int_equal(world->taken[i], 1);
    }
}

static void a_result_that_only_the_store_has_is_taken(void **state)
{
    struct world *world = *state;
    struct jobs_lease leases[TASKS];
    char text[JOBS_SECRET_SIZE + 2];
    unsigned char byte;

    begin(world, LEASE_SECONDS);
    for (size_t i = 0; i < TASKS; i++) {
        lease(world, &leases[i]);
    }
    byte = (unsigned char)(leases[0].what.inputs.bytes[0] - 'a' + 'A');
    proof_of(&leases[0], text);
    assert_int_equal(
        store_task_finish(world->engine.fixture->store, leases[0].task, text, &maker, &byte, 1),
        STORE_OK);
    jobs_task_clear(&leases[0].what);
    finish(world, &leases[1]);
    finish(world, &leases[2]);
    await_success(world);
}

static void a_lease_given_back_to_the_store_alone_is_free_again(void **state)
{
    struct world *world = *state;
    struct jobs_lease leases[TASKS], again;
    char text[JOBS_SECRET_SIZE + 2];

    begin(world, LEASE_SECONDS);
    for (size_t i = 0; i < TASKS; i++) {
        lease(world, &leases[i]);
    }
    proof_of(&leases[0], text);
    assert_int_equal(store_task_give_back(world->engine.fixture->store, leases[0].task, text, NULL),
                     STORE_OK);
    jobs_task_clear(&leases[0].what);
    finish(world, &leases[1]);
    finish(world, &leases[2]);
    lease(world, &again);
    assert_string_equal(again.task, leases[0].task);
    assert_int_equal(again.attempt, 2);
    finish(world, &again);
    await_success(world);
}

static void workers_are_told_of_a_task_whose_result_was_none(void **state)
{
    struct world *world = *state;
    struct jobs_lease leases[TASKS], again;
    char text[JOBS_SECRET_SIZE + 2];
    int before;

    begin(world, LEASE_SECONDS);
    for (size_t i = 0; i < TASKS; i++) {
        lease(world, &leases[i]);
    }
    finish(world, &leases[1]);
    finish(world, &leases[2]);
    before = world->offers;
    proof_of(&leases[0], text);
    assert_int_equal(
        store_task_finish(world->engine.fixture->store, leases[0].task, text, &maker, "..", 2),
        STORE_OK);
    jobs_task_clear(&leases[0].what);
    for (int ms = 0; ms < 5000 && world->offers == before; ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_not_equal(world->offers, before);
    lease(world, &again);
    finish(world, &again);
    await_success(world);
}

/* Leases one task as a worker of this job alone does. */
static void lease_as_pilot(struct world *world, struct jobs_remote *worker, const char *job,
                           struct jobs_lease *got)
{
    (void)snprintf(worker->job, sizeof worker->job, "%s", job);
    jobs_remote_who(worker->owner, worker->job, worker->name, worker->who);
    assert_int_equal(jobs_lease(world->engine.jobs, worker, got), STORE_OK);
    jobs_task_clear(&got->what);
}

static int extend(struct world *world, const struct jobs_lease *lease, const char *job)
{
    const struct jobs_proof proof = {.secret = lease->secret, .owner = "", .job = job};
    double seconds;

    return jobs_lease_extend(world->engine.jobs, lease->task, &proof, &seconds);
}

/* A worker that computes for long asks for nothing, and its heartbeats are its signs. */
static void heartbeats_keep_a_worker_alive(void **state)
{
    struct world *world = *state;
    struct jobs_remote worker = remote;
    struct jobs_demand demand;
    struct jobs_lease got;
    double end;

    begin(world, 2.0);
    await_demand(world, &demand);
    lease_as_pilot(world, &worker, demand.job, &got);
    for (end = clock_now() + 3.3; clock_now() < end; engine_pause_ms(50)) {
        assert_int_equal(extend(world, &got, worker.job), STORE_OK);
    }
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
    for (end = clock_now() + 3.3; clock_now() < end;) {
        engine_pause_ms(50);
    }
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 0);
}

/* Of a worker that is busy, and so has not asked for a task since the service was started again,
   its leases tell; once it has asked, it is counted no second time. */
static void workers_of_before_a_restart_count_as_alive(void **state)
{
    struct world *world = *state;
    struct jobs_remote worker = remote;
    struct jobs_demand demand;
    struct jobs_lease leases[2], none;

    worker.slots = 2;
    begin(world, 60.0);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 0);
    lease_as_pilot(world, &worker, demand.job, &leases[0]);
    lease_as_pilot(world, &worker, demand.job, &leases[1]);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
    jobs_close(world->engine.jobs, 0.0);
    world->engine.jobs = NULL;
    open_engine(world, 60.0);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
    assert_int_equal(extend(world, &leases[0], worker.job), STORE_OK);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
    assert_int_equal(extend(world, &leases[1], worker.job), STORE_OK);
    assert_int_equal(jobs_lease(world->engine.jobs, &worker, &none), STORE_NOT_FOUND);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
}

/* As if so many seconds had passed since the last sign of any worker. */
static void let_pass(struct world *world, double seconds)
{
    struct jobs_remotes *remotes = &world->engine.jobs->remotes;

    pthread_mutex_lock(&remotes->mutex);
    for (size_t i = 0; i < remotes->count; i++) {
        remotes->list[i].last -= seconds;
        remotes->list[i].until -= seconds;
    }
    pthread_mutex_unlock(&remotes->mutex);
}

static void are_known(struct world *world, size_t workers, size_t leased)
{
    size_t got[2];

    jobs_remotes_count(world->engine.jobs, &got[0], &got[1]);
    assert_int_equal(got[0], workers);
    assert_int_equal(got[1], leased);
}

/* Leases may hold for longer than the time after which a silent worker is forgotten; then what it
   loses is still its loss. */
static void a_worker_is_known_for_as_long_as_its_lease_holds(void **state)
{
    struct world *world = *state;
    struct jobs_remote worker = remote;
    struct jobs_demand demand;
    struct jobs_lease got;
    const struct jobs_proof proof = {.secret = got.secret, .owner = "", .job = worker.job};

    begin(world, 300.0);
    await_demand(world, &demand);
    lease_as_pilot(world, &worker, demand.job, &got);
    let_pass(world, 200.0);
    are_known(world, 1, 1);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 1);
    let_pass(world, 200.0); /* it is taken for dead, but the store has not yet lost the lease */
    are_known(world, 1, 1);
    await_demand(world, &demand);
    assert_int_equal(demand.alive, 0);
    assert_int_equal(jobs_lease_give_back(world->engine.jobs, got.task, &proof, "no room", false),
                     STORE_OK);
    assert_int_equal(world->engine.jobs->remotes.list[0].losses, 1);
    are_known(world, 0, 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, engine_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_result_that_only_the_store_has_is_taken),
        TEST(a_lease_given_back_to_the_store_alone_is_free_again),
        TEST(workers_are_told_of_a_task_whose_result_was_none),
        TEST(heartbeats_keep_a_worker_alive),
        TEST(workers_of_before_a_restart_count_as_alive),
        TEST(a_worker_is_known_for_as_long_as_its_lease_holds),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
