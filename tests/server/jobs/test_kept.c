/*
 * What a run keeps for a later attempt: the bytes hold it, damaged bytes hold nothing, and a job
 * whose engine was closed goes on with the numbers that it had.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdatomic.h>

#include "engine.h"
#include "jobs/internal.h"

#define NUMBERS 40

struct world {
    struct engine engine;
    atomic_int computed, recalled, wrong;
};

/* ---- Bytes ----------------------------------------------------------------------------------- */

static unsigned char *some_bytes(size_t *size)
{
    struct jobs_number numbers[] = {{7, 2, 0.5}, {7, 0, 0.25}, {3, 9, -1e300}};
    struct jobs_kept kept = {.numbers = numbers, .n = 3};
    unsigned char *bytes = jobs_kept_write(&kept, size);

    assert_non_null(bytes);
    return bytes;
}

static void bytes_hold_the_numbers(void **state)
{
    struct jobs_kept kept;
    unsigned char *bytes;
    size_t size;

    (void)state;
    bytes = some_bytes(&size);
    assert_int_equal(size, 24 + 3 * 24 + 8);
    jobs_kept_init(&kept);
    assert_true(jobs_kept_read(&kept, bytes, size));
    assert_int_equal(kept.n, 3);
    /* by series and index */
    assert_true(kept.numbers[0].series == 3 && kept.numbers[0].index == 9);
    assert_true(kept.numbers[1].index == 0 && kept.numbers[1].value == 0.25);
    assert_true(kept.numbers[2].index == 2 && kept.numbers[2].value == 0.5);
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
    double value = 0.0;

    if (context->canceled(context->user)) {
        return;
    }
    if (context->recall(context->user, 5, index, &value)) {
        atomic_fetch_add(&loop->world->recalled, 1);
        atomic_fetch_add(&loop->world->wrong, value != 1.5 * (double)index);
    } else {
        engine_pause_ms(100);
        context->keep(context->user, 5, index, 1.5 * (double)index);
        atomic_fetch_add(&loop->world->computed, 1);
    }
}

/* Computes its numbers, with the help of other workers. */
static void run_numbers(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct loop loop = {.context = context, .world = user};

    jobs_run_keep_numbers(run);
    jobs_run_keep_numbers(run); /* once is enough */
    context->parallel_for(context->user, NUMBERS, compute_one, &loop);
    if (!context->canceled(context->user)) {
        result->results = strdup(inputs);
    }
}

static const struct jobs_process table[] = {{"numbers", run_numbers}, {NULL, NULL}};

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
    size_t size;

    open_engine(world, "build");
    assert_int_equal(jobs_submit(world->engine.jobs, "numbers", "x", NULL, NULL, &job, &how),
                     JOBS_OK);
    memcpy(id, job.id, sizeof id);
    store_job_clear(&job);
    for (int ms = 0; ms < ENGINE_WAIT_MS && !bytes; ms += 2) {
        engine_pause_ms(2);
        (void)store_checkpoint_get(store, id, &bytes, &size);
    }
    assert_non_null(bytes);
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
    assert_true(atomic_load(&world->computed) <= 2 * NUMBERS - atomic_load(&world->recalled));
}

/* Another build does not mix its numbers in. */
static void another_build_begins_anew(void **state)
{
    struct world *world = *state;

    go_on(world, "another build");
    assert_int_equal(atomic_load(&world->recalled), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_hold_the_numbers),
        cmocka_unit_test(damaged_bytes_hold_nothing),
        cmocka_unit_test_setup_teardown(a_job_goes_on_with_its_numbers, setup, engine_teardown),
        cmocka_unit_test_setup_teardown(another_build_begins_anew, setup, engine_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
