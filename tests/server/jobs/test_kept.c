/*
 * What a run keeps for a later attempt: the bytes hold it, damaged bytes hold nothing, and a job
 * whose engine was closed goes on with the numbers that it had.
 *
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdatomic.h>

#include "engine.h"
#include "jobs/internal.h"
#include "jobs/submit.h"
#include "store/job.h"

#define NUMBERS 40
#define SIZE 3                                          /* values of each */
#define WITH_PARTS ((size_t)32 + 5 + 24 + 8 * SIZE + 8) /* bytes of a checkpoint with one of them */

struct world {
    struct engine engine;
    atomic_int computed, recalled, loaded, wrong;
};

/* ---- Bytes ----------------------------------------------------------------------------------- */

static unsigned char *some_bytes(size_t *size)
{
    double values[] = {0.5, -0.5, 8.0};
    struct jobs_part parts[] = {{.series = 7, .index = 2, .count = 3, .many = values},
                                {.series = 7, .index = 0, .count = 1, .one = 0.25},
                                {.series = 3, .index = 9, .count = 1, .one = -1e300}};
    struct jobs_kept kept = {.parts = parts,
                             .n = 3,
                             .bytes = 3 * 24 + 5 * 8,
                             .state = (unsigned char *)(uintptr_t) "state",
                             .state_size = 5};
    unsigned char *bytes = jobs_kept_write(&kept, size);

    assert_non_null(bytes);
    return bytes;
}

static void bytes_hold_the_parts(void **state)
{
    struct jobs_kept kept;
    unsigned char *bytes, *again;
    size_t size, again_size;

    (void)state;
    bytes = some_bytes(&size);
    assert_int_equal(size, 32 + 5 + 3 * 24 + 5 * 8 + 8);
    jobs_kept_init(&kept);
    assert_true(jobs_kept_read(&kept, bytes, size));
    assert_int_equal(kept.n, 3);
    /* by series and index */
    assert_true(kept.parts[0].series == 3 && kept.parts[0].index == 9);
    assert_true(kept.parts[1].index == 0 && kept.parts[1].one == 0.25);
    assert_true(kept.parts[2].index == 2 && kept.parts[2].count == 3);
    assert_true(kept.parts[2].many[0] == 0.5 && kept.parts[2].many[2] == 8.0);
    assert_int_equal(kept.state_size, 5);
    assert_memory_equal(kept.state, "state", 5);
    again = jobs_kept_write(&kept, &again_size);
    assert_non_null(again);
    assert_int_equal(again_size, size);
    free(again);
    jobs_kept_destroy(&kept);
    free(bytes);
}

static void damaged_bytes_hold_nothing(void **state)
{
    struct jobs_kept kept;
    unsigned char *bytes;
    size_t size;

    (void)state;
    bytes = some_bytes(&size);
    jobs_kept_init(&kept);
    for (size_t i = 0; i < size; i++) {
        bytes[i] ^= 0x10;
        assert_false(jobs_kept_read(&kept, bytes, size));
        bytes[i] ^= 0x10;
        assert_false(jobs_kept_read(&kept, bytes, i));
    }
    assert_int_equal(kept.n, 0);
    assert_true(jobs_kept_read(&kept, bytes, size));
    jobs_kept_destroy(&kept);
    free(bytes);
}

/* ---- Runs ------------------------------------------------------------------------------------ */

struct loop {
    const struct srnf_context *context;
    struct world *world;
};

static void compute_one(void *argument, size_t index)
{
    const struct loop *loop = argument;
    const struct srnf_context *context = loop->context;
    double value[SIZE] = {0.0}, state[SIZE];

    for (size_t k = 0; k < SIZE; k++) {
        state[k] = 1.5 * (double)index + (double)k;
    }
    if (context->canceled(context->user)) {
        return;
    }
    /* Of another length there is none, and what was given up is gone. */
    atomic_fetch_add(&loop->world->wrong,
                     context->recall(context->user, 5, index, SIZE - 1, value) ||
                         context->recall(context->user, 6, 0, 1, value));
    if (context->recall(context->user, 5, index, SIZE, value)) {
        atomic_fetch_add(&loop->world->recalled, 1);
        atomic_fetch_add(&loop->world->wrong, memcmp(value, state, sizeof state) != 0);
    } else {
        engine_pause_ms(100);
        context->keep(context->user, 5, index, SIZE, state);
        atomic_fetch_add(&loop->world->computed, 1);
    }
}

/* Computes its numbers, with the help of other workers. */
static void run_numbers(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct loop loop = {.context = context, .world = user};
    const double given_up = 1.0;
    unsigned char *saved;
    size_t size;

    if (jobs_run_checkpoint_load(run, &saved, &size) == STORE_OK) {
        atomic_fetch_add(&loop.world->wrong, size != 5 || memcmp(saved, "state", 5) != 0);
        atomic_fetch_add(&loop.world->loaded, 1);
        free(saved);
    }
    jobs_run_keep_parts(run);
    jobs_run_keep_parts(run); /* once is enough */
    (void)jobs_run_checkpoint_save(run, "state", 5);
    context->keep(context->user, 6, 0, 1, &given_up); /* and given up before the next checkpoint */
    context->keep(context->user, 6, 0, 0, NULL);
    context->parallel_for(context->user, NUMBERS, compute_one, &loop);
    if (!context->canceled(context->user)) {
        result->results = strdup(inputs);
    }
}

/* Keeps numbers, drops them when the next checkpoint is due, and waits for the end. */
static void run_drop(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;
    const double numbers[SIZE] = {1.0, 2.0, 3.0};

    (void)inputs;
    (void)result;
    jobs_run_keep_parts(run);
    while (!context->canceled(context->user) && atomic_load(&world->computed) == 0) {
        context->keep(context->user, 5, 0, SIZE, numbers);
        engine_pause_ms(20);
    }
    for (int i = 0; i < 150; i++) { /* through a time when a checkpoint is due */
        engine_pause_ms(20);
        context->keep(context->user, 5, 0, 0, NULL);
    }
    atomic_fetch_add(&world->recalled, 1);
    while (!context->canceled(context->user)) {
        engine_pause_ms(2);
    }
}

static const struct jobs_process table[] = {
    {"numbers", run_numbers, NULL}, {"drop", run_drop, NULL}, {NULL, NULL, NULL}};

static void open_engine(struct world *world, const char *build)
{
    struct jobs_config config = {.store = world->engine.fixture->store,
                                 .workers = 2,
                                 .table = table,
                                 .user = world,
                                 .numeric_build = build};

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

/* Cuts a job short when it has kept something, and lets it go on. */
static void go_on(struct world *world, const char *build)
{
    struct store *store = world->engine.fixture->store;
    enum jobs_submission how;
    unsigned char *bytes = NULL;
    char id[STORE_ID_MAX];
    struct store_job job;
    size_t size = 0;

    open_engine(world, "build");
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "numbers", "x", NULL, NULL, &job, &how),
                     JOBS_OK);
    memcpy(id, job.id, sizeof id);
    store_job_clear(&job);
    for (int ms = 0; ms < ENGINE_WAIT_MS && size < WITH_PARTS; ms += 2) {
        engine_pause_ms(2);
        free(bytes);
        (void)store_checkpoint_get(store, id, &bytes, &size);
    }
    assert_true(size >= WITH_PARTS);
    free(bytes);
    jobs_close(world->engine.jobs, 0.0);
    world->engine.jobs = NULL;
    assert_true(atomic_load(&world->computed) < NUMBERS);
    open_engine(world, build);
    for (int ms = 0; ms < ENGINE_WAIT_MS && fixture_status(store, id) != STORE_JOB_SUCCESSFUL;
         ms += 2) {
        engine_pause_ms(2);
    }
    assert_int_equal(fixture_status(store, id), STORE_JOB_SUCCESSFUL);
    assert_int_equal(atomic_load(&world->wrong), 0);
    assert_int_equal(store_checkpoint_get(store, id, &bytes, &size), STORE_NOT_FOUND);
}

static void a_job_goes_on_with_its_numbers(void **state)
{
    struct world *world = *state;

    go_on(world, "build");
    assert_true(atomic_load(&world->recalled) >= 1);
    assert_int_equal(atomic_load(&world->loaded), 1);
    assert_true(atomic_load(&world->computed) <= 2 * NUMBERS - atomic_load(&world->recalled));
}

/* Another build does not mix its numbers in. */
static void another_build_begins_anew(void **state)
{
    struct world *world = *state;

    go_on(world, "another build");
    assert_int_equal(atomic_load(&world->recalled), 0);
    assert_int_equal(atomic_load(&world->loaded), 0);
}

/* What was written stays until something is written in its stead: whoever drops it has yet to keep
   what follows from it. */
static void what_is_dropped_is_replaced_first(void **state)
{
    struct world *world = *state;
    struct store *store = world->engine.fixture->store;
    enum jobs_submission how;
    unsigned char *bytes = NULL;
    struct store_job job;
    size_t size = 0;

    open_engine(world, "build");
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "drop", "x", NULL, NULL, &job, &how),
                     JOBS_OK);
    for (int ms = 0; ms < ENGINE_WAIT_MS && size == 0; ms += 2) {
        engine_pause_ms(2);
        (void)store_checkpoint_get(store, job.id, &bytes, &size);
    }
    free(bytes);
    atomic_store(&world->computed, 1);
    engine_await(&world->recalled, 1);
    assert_int_equal(store_checkpoint_get(store, job.id, &bytes, &size), STORE_OK);
    free(bytes);
    store_job_clear(&job);
    assert_true(size >= WITH_PARTS - strlen("state"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_hold_the_parts),
        cmocka_unit_test(damaged_bytes_hold_nothing),
        cmocka_unit_test_setup_teardown(a_job_goes_on_with_its_numbers, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(another_build_begins_anew, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(what_is_dropped_is_replaced_first, setup, engine_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
