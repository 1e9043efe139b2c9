/*
 * The engine end to end on a real store: each job runs once, identical work is joined or answered
 * from the cache, keys, cancelling in each state, the limit of the queue, recovery, draining, and
 * processes that misbehave.
 *
 * The processes of these tests do what their inputs say. Assertions are made on the main thread
 * only.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>

#include "engine.h"
#include "jobs/submit.h"
#include "metrics.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/page.h"
#include "store/store.h"

#define JOBS_MANY 500

/* What the processes do and see. gate holds the runs of "wait" until it opens. */
struct world {
    struct engine engine;
    struct metrics *metrics; /* NULL: none */
    atomic_int runs[JOBS_MANY], total, changes, waiting;
};

/* Counts its run and answers with its number. */
static void run_count(struct jobs_run *run, void *user, const char *inputs,
                      struct jobs_result *result)
{
    struct world *world = user;
    int number = (int)strtol(inputs, NULL, 10);

    (void)run;
    atomic_fetch_add(&world->runs[number], 1);
    atomic_fetch_add(&world->total, 1);
    result->results = strdup(inputs);
}

/* Reports half, waits for the gate, and gives up when cancelled. */
static void run_wait(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;

    context->progress(context->user, 0.5, "waiting");
    atomic_fetch_add(&world->waiting, 1);
    while (!atomic_load(&world->engine.gate)) {
        if (context->canceled(context->user)) {
            return;
        }
        engine_pause_ms(1);
    }
    result->results = strdup(inputs);
}

/* Reports 80 percent after a while, and waits for the gate. */
static void run_slow(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct world *world = user;

    for (int i = 0; i < 60; i++) {
        engine_pause_ms(10);
    }
    context->progress(context->user, 0.8, "slowly");
    atomic_fetch_add(&world->waiting, 1);
    engine_wait_at_gate(&world->engine);
    result->results = strdup(inputs);
}

/* Waits for the gate and does not look whether it is cancelled. */
static void run_deaf(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    struct world *world = user;

    (void)run;
    atomic_fetch_add(&world->waiting, 1);
    engine_wait_at_gate(&world->engine);
    result->results = strdup(inputs);
}

static void run_fail(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    (void)run;
    (void)user;
    result->problem_code = "not-converged";
    snprintf(result->problem_detail, sizeof result->problem_detail, "as asked: %s", inputs);
}

static void run_nothing(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    (void)run;
    (void)user;
    (void)inputs;
    (void)result;
}

/* Computes in three phases, of which the first reports twice over; answers with what it sees of its
   own progress after each report, in percent. */
static void run_phases(struct jobs_run *run, void *user, const char *inputs,
                       struct jobs_result *result)
{
    static const struct {
        double share, fraction; /* share > 0: a phase begins */
    } steps[] = {{20.0, 0.5}, {0.0, 1.0},  {0.0, 0.25}, {0.0, 1.0},   {40.0, 0.0},
                 {0.0, NAN},  {0.0, 0.5},  {0.0, -3.0}, {100.0, 0.0}, {0.0, 0.5},
                 {0.0, 0.75}, {0.0, 0.25}, {0.0, 9.0}};
    const struct srnf_context *context = jobs_run_context(run);
    char text[128] = "";
    size_t used = 0;

    (void)user;
    (void)inputs;
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        struct store_job job;

        if (steps[i].share > 0.0) {
            jobs_run_phase(run, steps[i].share);
        }
        context->progress(context->user, steps[i].fraction, NULL);
        if (jobs_get(jobs_run_jobs(run), jobs_run_job_id(run), &job) == STORE_OK) {
            used += (size_t)snprintf(text + used, sizeof text - used, "%g ", job.progress);
        }
        store_job_clear(&job);
    }
    result->results = strdup(text);
}

/* Answers with the definition of its row. */
static void run_defined(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    (void)user;
    (void)inputs;
    result->results = strdup(jobs_run_definition(run));
}

static const struct jobs_process table[] = {
    {"count", run_count, NULL},
    {"wait", run_wait, NULL},
    {"slow", run_slow, NULL},
    {"deaf", run_deaf, NULL},
    {"fail", run_fail, NULL},
    {"nothing", run_nothing, NULL},
    {"phases", run_phases, NULL},
    {"first", run_defined, "of the first"},
    {"second", run_defined, "of the second"},
    {NULL, NULL, NULL},
};

static void on_changed(void *user, const char *job_id)
{
    struct world *world = user;

    (void)job_id;
    atomic_fetch_add(&world->changes, 1);
}

static void open_engine(struct world *world, size_t workers, size_t max_queued)
{
    struct jobs_config config = {
        .store = world->engine.fixture->store,
        .workers = workers,
        .table = table,
        .user = world,
        .numeric_build = "build",
        .max_queued = max_queued,
        .changed = on_changed,
        .metrics = world->metrics,
    };

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

static enum jobs_submission submit(struct world *world, const char *process, const char *inputs,
                                   char id[STORE_ID_MAX])
{
    struct store_job job;
    enum jobs_submission how;

    assert_int_equal(jobs_submit(world->engine.jobs, NULL, process, inputs, NULL, NULL, &job, &how),
                     JOBS_OK);
    memcpy(id, job.id, STORE_ID_MAX);
    store_job_clear(&job);
    return how;
}

/* Waits until the job is in this state. */
static void await(struct world *world, const char *id, enum store_job_status wanted)
{
    enum store_job_status status = fixture_status(world->engine.fixture->store, id);

    for (int ms = 0; ms < ENGINE_WAIT_MS && status != wanted; ms += 2) {
        engine_pause_ms(2);
        status = fixture_status(world->engine.fixture->store, id);
    }
    assert_int_equal(status, wanted);
}

/* ---- Running --------------------------------------------------------------------------------- */

static void many_jobs_run_once_each(void **state)
{
    struct world *world = *state;
    char inputs[16], id[STORE_ID_MAX], last[STORE_ID_MAX] = "";
    size_t successful = 0;

    open_engine(world, 4, 0);
    assert_int_equal(jobs_worker_count(world->engine.jobs), 4);
    for (int i = 0; i < JOBS_MANY; i++) {
        snprintf(inputs, sizeof inputs, "%d", i);
        assert_int_equal(submit(world, "count", inputs, id), JOBS_NEW);
        assert_true(strcmp(last, id) < 0); /* ids sort as they were given out */
        memcpy(last, id, sizeof last);
    }
    for (int ms = 0; ms < ENGINE_WAIT_MS && successful < JOBS_MANY; ms += 5) {
        engine_pause_ms(5);
        assert_int_equal(
            store_job_count(world->engine.fixture->store, STORE_JOB_SUCCESSFUL, &successful),
            STORE_OK);
    }
    assert_int_equal(successful, JOBS_MANY);
    for (int i = 0; i < JOBS_MANY; i++) {
        assert_int_equal(world->runs[i], 1);
    }
    jobs_close(world->engine.jobs, 1.0);
    world->engine.jobs = NULL;
    assert_int_equal(world->changes, 3 * JOBS_MANY); /* accepted, running, successful */
}

static void ids_are_version_7(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1, 0);
    submit(world, "count", "1", id);
    assert_int_equal(strlen(id), strlen("job-00000000-0000-7000-8000-000000000000"));
    assert_memory_equal(id, "job-", 4);
    assert_int_equal(id[18], '7');
    assert_non_null(strchr("89ab", id[23]));
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_true(llabs(job.created_ms - store_now_ms()) < 60000);
    store_job_clear(&job);
}

static void equal_work_is_joined_then_cached(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX], other[STORE_ID_MAX];
    int changes;

    open_engine(world, 2, 0);
    assert_int_equal(submit(world, "wait", "a", id), JOBS_NEW);
    assert_int_equal(submit(world, "wait", "a", other), JOBS_JOINED);
    assert_string_equal(id, other);
    engine_await(&world->waiting, 1);
    assert_int_equal(submit(world, "wait", "a", other), JOBS_JOINED);
    assert_string_equal(id, other);
    atomic_store(&world->engine.gate, true);
    await(world, id, STORE_JOB_SUCCESSFUL);
    engine_pause_ms(20);
    changes = world->changes;
    assert_int_equal(submit(world, "wait", "a", other), JOBS_CACHED);
    assert_string_equal(id, other);
    assert_int_equal(world->changes, changes);
    assert_int_equal(world->waiting, 1);
    /* Other inputs, or the same ones to another process, are other work. */
    assert_int_equal(submit(world, "wait", "b", other), JOBS_NEW);
    assert_int_equal(submit(world, "fail", "a", other), JOBS_NEW);
    await(world, other, STORE_JOB_FAILED);
    assert_int_equal(submit(world, "fail", "a", id), JOBS_NEW); /* failures are not cached */
}

static void a_new_numeric_build_is_other_work(void **state)
{
    struct world *world = *state;
    struct jobs_config config = {.store = world->engine.fixture->store,
                                 .workers = 1,
                                 .table = table,
                                 .user = world,
                                 .numeric_build = "another build"};
    char id[STORE_ID_MAX];

    open_engine(world, 1, 0);
    submit(world, "count", "1", id);
    await(world, id, STORE_JOB_SUCCESSFUL);
    jobs_close(world->engine.jobs, 1.0);
    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
    assert_int_equal(submit(world, "count", "1", id), JOBS_NEW);
}

struct crowd {
    struct world *world;
    atomic_int made, errors;
};

static void *submit_the_same(void *user)
{
    struct crowd *crowd = user;

    for (int i = 0; i < 20; i++) {
        char inputs[16];
        struct store_job job;
        enum jobs_submission how;

        snprintf(inputs, sizeof inputs, "%d", i);
        if (jobs_submit(crowd->world->engine.jobs, NULL, "count", inputs, NULL, NULL, &job, &how) ==
            JOBS_OK) {
            atomic_fetch_add(&crowd->made, how == JOBS_NEW);
            store_job_clear(&job);
        } else {
            atomic_fetch_add(&crowd->errors, 1);
        }
    }
    return NULL;
}

static void a_crowd_with_one_wish_is_served_once(void **state)
{
    struct world *world = *state;
    struct crowd crowd = {.world = world};
    pthread_t threads[8];

    open_engine(world, 4, 0);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, submit_the_same, &crowd), 0);
    }
    for (int i = 0; i < 8; i++) {
        pthread_join(threads[i], NULL);
    }
    assert_int_equal(crowd.errors, 0);
    assert_int_equal(crowd.made, 20);
    engine_await(&world->total, 20);
}

static void keys_name_their_job(void **state)
{
    struct world *world = *state;
    struct store_job first, again;
    enum jobs_submission how;

    open_engine(world, 1, 0);
    assert_int_equal(
        jobs_submit(world->engine.jobs, NULL, "fail", "x", "key", "body", &first, &how), JOBS_OK);
    assert_int_equal(how, JOBS_NEW);
    await(world, first.id, STORE_JOB_FAILED);
    /* Without the key this would be a new job: failures are not cached. */
    assert_int_equal(
        jobs_submit(world->engine.jobs, NULL, "fail", "x", "key", "body", &again, &how), JOBS_OK);
    assert_string_equal(first.id, again.id);
    assert_int_equal(how, JOBS_JOINED);
    store_job_clear(&again);
    assert_int_equal(
        jobs_submit(world->engine.jobs, NULL, "fail", "y", "key", "other", &again, &how),
        JOBS_IDEMPOTENCY_MISMATCH);
    assert_null(again.process);
    store_job_clear(&first);

    /* A key that met the cache is remembered too. */
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "count", "1", NULL, NULL, &first, &how),
                     JOBS_OK);
    await(world, first.id, STORE_JOB_SUCCESSFUL);
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "count", "1", "k2", "b", &again, &how),
                     JOBS_OK);
    assert_int_equal(how, JOBS_CACHED);
    store_job_clear(&again);
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "count", "2", "k2", "c", &again, &how),
                     JOBS_IDEMPOTENCY_MISMATCH);
    store_job_clear(&first);
}

static void progress_is_live(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1, 0);
    submit(world, "wait", "a", id);
    engine_await(&world->waiting, 1);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_int_equal(job.status, STORE_JOB_RUNNING);
    assert_true(job.progress == 50.0);
    assert_string_equal(job.message, "waiting");
    store_job_clear(&job);
    atomic_store(&world->engine.gate, true);
    await(world, id, STORE_JOB_SUCCESSFUL);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_true(job.progress == 100.0);
    store_job_clear(&job);
}

struct listed {
    const char *id;
    double progress, seconds_left;
    int64_t updated_ms;
    char message[64];
};

static bool note_listed(void *user, const struct store_job *job)
{
    struct listed *listed = user;

    if (strcmp(job->id, listed->id) == 0) {
        listed->progress = job->progress;
        listed->seconds_left = job->seconds_left;
        listed->updated_ms = job->updated_ms;
        snprintf(listed->message, sizeof listed->message, "%s", job->message);
    }
    return true;
}

/* A list says of a job that runs what its record says, and of one that waits where. */
static void lists_are_live(void **state)
{
    const struct store_page page = {.limit = 10};
    struct world *world = *state;
    char id[STORE_ID_MAX], second[STORE_ID_MAX], third[STORE_ID_MAX];
    struct listed listed = {.id = id};
    struct store_job job;

    open_engine(world, 1, 0);
    submit(world, "slow", "a", id);
    engine_await(&world->waiting, 1);
    submit(world, "wait", "b", second);
    submit(world, "wait", "c", third);
    assert_int_equal(jobs_page(world->engine.jobs, &page, note_listed, &listed), STORE_OK);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_true(listed.progress == 80.0 && job.progress == 80.0);
    assert_string_equal(listed.message, "slowly");
    assert_true(listed.updated_ms == job.updated_ms);
    /* 0.6 s and more for 80 percent, as many percent a second for the rest */
    assert_true(job.updated_ms >= job.started_ms + 500);
    assert_true(listed.seconds_left == job.seconds_left);
    assert_true(job.seconds_left >= 0.6 / 4.0 && job.seconds_left < 60.0);
    store_job_clear(&job);
    assert_int_equal(jobs_get(world->engine.jobs, second, &job), STORE_OK);
    assert_int_equal(job.queue_position, 1);
    assert_true(job.seconds_left < 0.0);
    store_job_clear(&job);
    assert_int_equal(jobs_get(world->engine.jobs, third, &job), STORE_OK);
    assert_int_equal(job.queue_position, 2);
    job.queue_position = 0;
    assert_int_equal(jobs_place(world->engine.jobs, &job), STORE_OK);
    assert_int_equal(job.queue_position, 2);
    store_job_clear(&job);
    atomic_store(&world->engine.gate, true);
    await(world, third, STORE_JOB_SUCCESSFUL);
    assert_int_equal(jobs_get(world->engine.jobs, third, &job), STORE_OK);
    assert_int_equal(job.queue_position, 0);
    store_job_clear(&job);
}

/* Each phase has its share of the job, and nothing that is reported takes progress back. */
static void progress_never_falls(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX], *text = NULL;
    size_t size;

    open_engine(world, 1, 0);
    submit(world, "phases", "p", id);
    await(world, id, STORE_JOB_SUCCESSFUL);
    assert_int_equal(store_job_results(world->engine.fixture->store, id, &text, &size), STORE_OK);
    assert_string_equal(text, "10 20 20 20 20 20 40 40 60 80 90 90 99.9 ");
    free(text);
}

/* Two processes of one function are told apart by what their rows define. */
static void definition_of_the_row(void **state)
{
    static const char *const names[] = {"first", "second"};
    struct world *world = *state;
    char id[STORE_ID_MAX], wanted[32], *text = NULL;
    size_t size;

    open_engine(world, 1, 0);
    for (size_t i = 0; i < 2; i++) {
        submit(world, names[i], "same", id);
        await(world, id, STORE_JOB_SUCCESSFUL);
        assert_int_equal(store_job_results(world->engine.fixture->store, id, &text, &size),
                         STORE_OK);
        (void)snprintf(wanted, sizeof wanted, "of the %s", names[i]);
        assert_string_equal(text, wanted);
        free(text);
    }
}

/* ---- Cancelling ------------------------------------------------------------------------------ */

static void cancel_in_each_state(void **state)
{
    struct world *world = *state;
    char runs[STORE_ID_MAX], waits[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1, 0);
    submit(world, "wait", "runs", runs);
    engine_await(&world->waiting, 1);
    submit(world, "wait", "waits", waits);

    assert_int_equal(jobs_cancel(world->engine.jobs, waits, &job), JOBS_OK);
    assert_int_equal(job.status, STORE_JOB_DISMISSED);
    assert_true(job.cancel_requested);
    store_job_clear(&job);

    assert_int_equal(jobs_cancel(world->engine.jobs, runs, &job), JOBS_OK);
    assert_true(job.cancel_requested);
    store_job_clear(&job);
    await(world, runs, STORE_JOB_DISMISSED);

    for (int again = 0; again < 2; again++) {
        assert_int_equal(jobs_cancel(world->engine.jobs, runs, &job), JOBS_OK);
        assert_int_equal(job.status, STORE_JOB_DISMISSED);
        store_job_clear(&job);
    }
    assert_int_equal(jobs_cancel(world->engine.jobs, "job-none", &job), STORE_NOT_FOUND);
    /* Dismissed work can be asked for anew. */
    atomic_store(&world->engine.gate, true);
    assert_int_equal(submit(world, "wait", "runs", waits), JOBS_NEW);
    await(world, waits, STORE_JOB_SUCCESSFUL);
    assert_int_equal(jobs_cancel(world->engine.jobs, waits, &job), JOBS_OK);
    assert_int_equal(job.status, STORE_JOB_SUCCESSFUL);
    store_job_clear(&job);
}

static void a_job_being_cancelled_is_not_joined(void **state)
{
    struct world *world = *state;
    char first[STORE_ID_MAX], second[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 2, 0);
    submit(world, "deaf", "a", first);
    engine_await(&world->waiting, 1);
    assert_int_equal(jobs_cancel(world->engine.jobs, first, &job), JOBS_OK);
    store_job_clear(&job);
    assert_int_equal(submit(world, "deaf", "a", second), JOBS_NEW);
    atomic_store(&world->engine.gate, true);
    await(world, first, STORE_JOB_SUCCESSFUL); /* it never looked */
    await(world, second, STORE_JOB_SUCCESSFUL);
}

/* Cancels fall everywhere between submission and end; nothing is lost, nothing hangs, the queue's
   count stays true. */
static void cancels_at_any_moment(void **state)
{
    struct world *world = *state;
    char inputs[16], id[60][STORE_ID_MAX];
    struct store_job job;
    size_t waiting, running;

    open_engine(world, 3, 60);
    for (int i = 0; i < 60; i++) {
        snprintf(inputs, sizeof inputs, "%d", i);
        submit(world, "wait", inputs, id[i]);
        if (i % 2) {
            engine_pause_ms(i % 7);
        }
        assert_int_equal(jobs_cancel(world->engine.jobs, id[i], &job), JOBS_OK);
        store_job_clear(&job);
    }
    for (int i = 0; i < 60; i++) {
        await(world, id[i], STORE_JOB_DISMISSED);
    }
    assert_int_equal(store_job_count(world->engine.fixture->store, STORE_JOB_ACCEPTED, &waiting),
                     STORE_OK);
    assert_int_equal(store_job_count(world->engine.fixture->store, STORE_JOB_RUNNING, &running),
                     STORE_OK);
    assert_int_equal(waiting + running, 0);
    for (int i = 0; i < 60; i++) {
        snprintf(inputs, sizeof inputs, "%d", i + 100);
        submit(world, "wait", inputs, id[0]); /* the whole queue is free again */
    }
}

/* ---- Limits and failures --------------------------------------------------------------------- */

static void the_queue_has_a_limit(void **state)
{
    struct world *world = *state;
    char inputs[16], id[STORE_ID_MAX], waits[STORE_ID_MAX];
    enum jobs_submission how;
    struct store_job job;

    open_engine(world, 1, 3);
    submit(world, "wait", "running", id);
    engine_await(&world->waiting, 1);
    for (int i = 0; i < 3; i++) {
        snprintf(inputs, sizeof inputs, "%d", i);
        submit(world, "wait", inputs, waits);
    }
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "wait", "more", NULL, NULL, &job, &how),
                     JOBS_QUEUE_FULL);
    assert_int_equal(submit(world, "wait", "2", id), JOBS_JOINED); /* needs no room */
    assert_int_equal(jobs_cancel(world->engine.jobs, waits, &job), JOBS_OK);
    store_job_clear(&job);
    assert_int_equal(submit(world, "wait", "more", id), JOBS_NEW);
    assert_int_equal(jobs_submit(world->engine.jobs, NULL, "none", "", NULL, NULL, &job, &how),
                     JOBS_NO_SUCH_PROCESS);
}

static void failures_are_written_down(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];
    struct store_job job;

    open_engine(world, 1, 0);
    submit(world, "fail", "please", id);
    await(world, id, STORE_JOB_FAILED);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_string_equal(job.problem_code, "not-converged");
    assert_string_equal(job.problem_detail, "as asked: please");
    store_job_clear(&job);
    submit(world, "nothing", "", id);
    await(world, id, STORE_JOB_FAILED);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_string_equal(job.problem_code, "internal-error");
    store_job_clear(&job);
}

/* ---- Stopping and starting ------------------------------------------------------------------- */

/* It has been begun once then, and has waited once. */
static void draining_puts_back_what_does_not_end(void **state)
{
    struct world *world = *state;
    char runs[STORE_ID_MAX], waits[STORE_ID_MAX];
    struct store_job job;

    world->metrics = metrics_create();
    open_engine(world, 1, 0);
    submit(world, "wait", "runs", runs);
    submit(world, "count", "7", waits);
    engine_await(&world->waiting, 1);
    jobs_close(world->engine.jobs, 0.05);
    world->engine.jobs = NULL;
    assert_int_equal(store_job_get(world->engine.fixture->store, runs, &job), STORE_OK);
    assert_int_equal(job.status, STORE_JOB_ACCEPTED);
    assert_int_equal(job.attempt, 1);
    store_job_clear(&job);
    assert_int_equal(fixture_status(world->engine.fixture->store, waits), STORE_JOB_ACCEPTED);
    assert_int_equal(world->total, 0);

    atomic_store(&world->engine.gate, true);
    open_engine(world, 1, 0);
    await(world, runs, STORE_JOB_SUCCESSFUL);
    await(world, waits, STORE_JOB_SUCCESSFUL);
    assert_int_equal(world->runs[7], 1);
    assert_int_equal(
        (int)metrics_value(world->metrics, METRIC_JOB_WAIT_SECONDS, METRIC_LABELS("wait")), 1);
    jobs_close(world->engine.jobs, 1.0);
    world->engine.jobs = NULL;
    metrics_destroy(world->metrics);
}

/* The grace of a shutdown is for what runs; what waits, or comes, is for the next start. */
static void draining_starts_nothing(void **state)
{
    struct world *world = *state;
    const struct jobs_owner owner = {.name = "", .seconds = 0.1};
    char runs[STORE_ID_MAX], waits[STORE_ID_MAX], comes[STORE_ID_MAX];
    struct store_job brief;
    enum jobs_submission how;

    open_engine(world, 1, 0);
    submit(world, "wait", "runs", runs);
    engine_await(&world->waiting, 1);
    submit(world, "count", "7", waits);
    jobs_drain(world->engine.jobs);
    submit(world, "count", "8", comes);
    assert_int_equal(
        jobs_submit(world->engine.jobs, &owner, "count", "9", NULL, NULL, &brief, &how), JOBS_OK);
    atomic_store(&world->engine.gate, true);
    await(world, runs, STORE_JOB_SUCCESSFUL);
    engine_pause_ms(200);
    assert_int_equal(world->total, 0);
    jobs_close(world->engine.jobs, 30.0);
    world->engine.jobs = NULL;
    assert_int_equal(world->total, 0);

    open_engine(world, 1, 0);
    await(world, waits, STORE_JOB_SUCCESSFUL);
    await(world, comes, STORE_JOB_SUCCESSFUL);
    await(world, brief.id, STORE_JOB_SUCCESSFUL);
    store_job_clear(&brief);
}

static void draining_lets_runs_end(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];

    open_engine(world, 2, 0);
    submit(world, "wait", "a", id);
    engine_await(&world->waiting, 1);
    atomic_store(&world->engine.gate, true);
    jobs_close(world->engine.jobs, 30.0);
    world->engine.jobs = NULL;
    assert_int_equal(fixture_status(world->engine.fixture->store, id), STORE_JOB_SUCCESSFUL);
}

/* Rows that a killed daemon has left as running. */
static void what_was_cut_short_runs_again(void **state)
{
    struct world *world = *state;
    struct store *store = world->engine.fixture->store;
    char process[] = "count", inputs[] = "3";
    struct store_job job = {.id = "job-1", .process = process, .inputs = inputs}, claimed;

    store_sha256_hex(job.digest, "3", 1);
    assert_int_equal(store_job_insert(store, &job, NULL, NULL, NULL), STORE_OK);
    assert_int_equal(store_job_claim(store, &claimed), STORE_OK);
    store_job_clear(&claimed);
    open_engine(world, 2, 0);
    await(world, "job-1", STORE_JOB_SUCCESSFUL);
    assert_int_equal(jobs_get(world->engine.jobs, "job-1", &claimed), STORE_OK);
    assert_int_equal(claimed.attempt, 2);
    store_job_clear(&claimed);
    assert_int_equal(world->runs[3], 1);
}

static void a_process_that_is_gone_fails_its_jobs(void **state)
{
    struct world *world = *state;
    char id[STORE_ID_MAX];
    struct store_job job;

    assert_int_equal(fixture_insert_job(world->engine.fixture->store, 1, id),
                     STORE_OK); /* "encode" */
    open_engine(world, 1, 0);
    await(world, id, STORE_JOB_FAILED);
    assert_int_equal(jobs_get(world->engine.jobs, id, &job), STORE_OK);
    assert_string_equal(job.problem_code, "no-such-process");
    store_job_clear(&job);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, engine_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(many_jobs_run_once_each),
        TEST(ids_are_version_7),
        TEST(equal_work_is_joined_then_cached),
        TEST(a_new_numeric_build_is_other_work),
        TEST(a_crowd_with_one_wish_is_served_once),
        TEST(keys_name_their_job),
        TEST(progress_is_live),
        TEST(lists_are_live),
        TEST(progress_never_falls),
        TEST(definition_of_the_row),
        TEST(cancel_in_each_state),
        TEST(a_job_being_cancelled_is_not_joined),
        TEST(cancels_at_any_moment),
        TEST(the_queue_has_a_limit),
        TEST(failures_are_written_down),
        TEST(draining_puts_back_what_does_not_end),
        TEST(draining_starts_nothing),
        TEST(draining_lets_runs_end),
        TEST(what_was_cut_short_runs_again),
        TEST(a_process_that_is_gone_fails_its_jobs),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
