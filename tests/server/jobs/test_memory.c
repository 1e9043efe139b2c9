/*
 * The memory of jobs: accounts are exact to the byte whoever frees, and never above their limit;
 * a job that needs more fails with memory-limit and says how much, whatever it made of the refusal,
 * while the others go on and the next one finds the account empty; helpers' blocks are the job's;
 * and the limit that is taken where none is given follows the control groups.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/resource.h>
#include <unistd.h>

#include "engine.h"
#include "jobs/memory.h"
#include "srnf.h"
#include "jobs/submit.h"
#include "store/job.h"

#define BLOCK ((size_t)1 << 20)
#define FRONT ((size_t)64)           /* in front of each block */
#define CHARGE(n) ((n) + 64 + FRONT) /* for n bytes, n a multiple of 64 */
#define LIMIT (4 * CHARGE(BLOCK))    /* four blocks, to the byte */

/* ---- Accounts -------------------------------------------------------------------------------- */

static void accounts_are_exact(void **state)
{
    static const struct {
        size_t count, size, charged;
    } requests[] = {{0, 8, CHARGE(0)},   {1, 1, CHARGE(0)},       {63, 1, CHARGE(0)},
                    {64, 1, CHARGE(64)}, {1000, 8, CHARGE(8000)}, {BLOCK, 1, CHARGE(BLOCK)}};
    const size_t n = sizeof requests / sizeof requests[0];
    struct jobs_memory memory = {0};
    void *blocks[sizeof requests / sizeof requests[0]];
    size_t used = 0, most;

    (void)state;
    jobs_memory_begin(&memory, SIZE_MAX);
    assert_null(jobs_memory_enter(&memory));
    for (size_t i = 0; i < n; i++) {
        blocks[i] = srnf_alloc(requests[i].count, requests[i].size);
        assert_non_null(blocks[i]);
        assert_int_equal((uintptr_t)blocks[i] % 64, 0);
        used += requests[i].charged;
        assert_int_equal(memory.used, used);
    }
    for (size_t i = 0; i < BLOCK; i++) {
        assert_int_equal(((char *)blocks[n - 1])[i], 0);
    }
    most = used;
    /* Blocks know whose they are: neither another account nor none is charged or relieved. */
    assert_ptr_equal(jobs_memory_enter(NULL), &memory);
    srnf_free(srnf_alloc(BLOCK, 1));
    for (size_t i = 0; i < n; i++) {
        srnf_free(blocks[i]);
        used -= requests[i].charged;
        assert_int_equal(memory.used, used);
    }
    assert_int_equal(memory.used, 0);
    assert_int_equal(memory.peak, most);
    assert_int_equal(memory.refused, 0);
    srnf_free(NULL);
}

/* What is lent is no more than there is room for, refuses without telling the account, and comes
   back whole. */
static void lent_memory_refuses_nobody_else(void **state)
{
    struct jobs_memory memory = {0}, lent;
    void *own, *block;
    size_t used;

    (void)state;
    jobs_memory_begin(&memory, 10000);
    assert_null(jobs_memory_enter(&memory));
    own = srnf_alloc(2048, 1);
    assert_non_null(own);
    used = memory.used;
    jobs_memory_lend(&memory, 4096, &lent);
    assert_int_equal(lent.limit, 4096);
    jobs_memory_return(&memory, &lent);
    jobs_memory_lend(&memory, 20000, &lent);
    assert_int_equal(lent.limit, 10000 - used);
    assert_false(jobs_memory_fits(&memory, 1));
    assert_ptr_equal(jobs_memory_enter(&lent), &memory);
    block = srnf_alloc(4096, 1);
    assert_non_null(block);
    assert_null(srnf_alloc(8192, 1));
    srnf_free(block);
    assert_ptr_equal(jobs_memory_enter(NULL), &lent);
    jobs_memory_return(&memory, &lent);
    assert_int_equal(memory.used, used);
    assert_int_equal(memory.peak, used);
    assert_int_equal(memory.refused, 0);
    srnf_free(own);
    jobs_memory_begin(&memory, 100);
    assert_true(jobs_memory_fits(&memory, 100));
    jobs_memory_lend(&memory, 1, &lent);
    assert_int_equal(lent.limit, 0);
    jobs_memory_return(&memory, &lent);
    jobs_memory_discharge(&memory, 100);
}

static size_t resident_bytes(void)
{
    FILE *statm = fopen("/proc/self/statm", "r");
    size_t all = 0, resident = 0;

    assert_non_null(statm);
    assert_int_equal(fscanf(statm, "%zu %zu", &all, &resident), 2);
    (void)fclose(statm);
    return resident * (size_t)sysconf(_SC_PAGESIZE);
}

/* A large block takes pages, and the time to clear them, where it is used; it is charged whole. */
static void large_blocks_are_cleared_where_they_are_used(void **state)
{
    const size_t size = (size_t)512 << 20;
    struct jobs_memory memory = {0};
    size_t before = resident_bytes();
    unsigned char *block;

    (void)state;
    jobs_memory_begin(&memory, SIZE_MAX);
    (void)jobs_memory_enter(&memory);
    block = srnf_alloc(size, 1);
    assert_non_null(block);
    assert_int_equal((uintptr_t)block % 64, 0);
    assert_true(memory.used >= size && memory.used <= size + 4096);
#ifndef __SANITIZE_THREAD__ /* whose calloc clears, and whose shadow of the block is resident */
    assert_true(resident_bytes() < before + size / 4);
#else
    (void)before;
#endif
    for (size_t i = 0; i < size; i += size / 64) {
        assert_int_equal(block[i], 0);
        block[i] = 1;
    }
    assert_int_equal(block[size - 1], 0);
    block[size - 1] = 1;
    (void)jobs_memory_enter(NULL);
    srnf_free(block);
    assert_int_equal(memory.used, 0);
}

static void an_account_ends_at_its_limit(void **state)
{
    struct jobs_memory memory = {0};
    void *blocks[4];

    (void)state;
    jobs_memory_begin(&memory, LIMIT);
    (void)jobs_memory_enter(&memory);
    for (size_t i = 0; i < 4; i++) {
        blocks[i] = srnf_alloc(BLOCK, 1);
        assert_non_null(blocks[i]);
    }
    assert_int_equal(memory.used, LIMIT);
    assert_int_equal(memory.refused, 0);
    assert_null(srnf_alloc(1, 1));
    assert_int_equal(memory.refused, CHARGE(0));
    assert_int_equal(memory.held, LIMIT);
    srnf_free(blocks[3]);
    /* The first refusal is the one that is told. */
    assert_null(srnf_alloc(BLOCK + 64, 1));
    assert_int_equal(memory.refused, CHARGE(0));
    blocks[3] = srnf_alloc(BLOCK, 1);
    assert_non_null(blocks[3]);
    for (size_t i = 0; i < 4; i++) {
        srnf_free(blocks[i]);
    }
    assert_int_equal(memory.used, 0);
    assert_int_equal(memory.peak, LIMIT);
    jobs_memory_begin(&memory, LIMIT);
    assert_int_equal(memory.refused, 0);
    assert_int_equal(memory.peak, 0);
    (void)jobs_memory_enter(NULL);
}

/* What the machine has not got, or no machine can have, is no question of the limit. */
static void other_refusals_are_not_the_limits(void **state)
{
    struct jobs_memory memory = {0};

    (void)state;
    jobs_memory_begin(&memory, SIZE_MAX);
    (void)jobs_memory_enter(&memory);
    assert_null(srnf_alloc(SIZE_MAX / 2, 4));
    assert_null(srnf_alloc(SIZE_MAX - 64, 1));
    assert_null(srnf_alloc((size_t)1 << 60, 1));
    assert_int_equal(memory.refused, 0);
    assert_int_equal(memory.used, 0);
    (void)jobs_memory_enter(NULL);
}

/* An account within another: that one counts all, refuses for all, and knows who held what. */
static void accounts_share_what_they_lie_in(void **state)
{
    struct jobs_memory all = {0}, one = {.parent = &all}, other = {.parent = &all};
    atomic_bool stop = false;
    void *blocks[3];

    (void)state;
    one.stop = &stop;
    jobs_memory_begin(&all, LIMIT);
    jobs_memory_begin(&one, SIZE_MAX);
    jobs_memory_begin(&other, SIZE_MAX);
    (void)jobs_memory_enter(&other);
    blocks[0] = srnf_alloc(BLOCK, 1);
    (void)jobs_memory_enter(&one);
    assert_ptr_equal(jobs_memory_current(), &one);
    blocks[1] = srnf_alloc(BLOCK, 1);
    assert_int_equal(one.used, CHARGE(BLOCK));
    assert_int_equal(all.used, 2 * CHARGE(BLOCK));
    assert_null(srnf_alloc(LIMIT, 1));
    assert_int_equal(one.refused, CHARGE(LIMIT));
    assert_int_equal(one.held, CHARGE(BLOCK));
    assert_int_equal(one.beside, CHARGE(BLOCK));
    assert_int_equal(one.used, CHARGE(BLOCK));
    assert_false(jobs_memory_charge(&one, LIMIT));
    assert_true(jobs_memory_charge(&one, 64));
    assert_int_equal(all.used, 2 * CHARGE(BLOCK) + 64);
    jobs_memory_discharge(&one, 64);
    assert_true(jobs_memory_charge(NULL, LIMIT));
    assert_false(one.stopped);
    atomic_store(&stop, true);
    assert_null(srnf_alloc(1, 1));
    assert_true(one.stopped);
    (void)jobs_memory_enter(&other);
    blocks[2] = srnf_alloc(1, 1);
    assert_non_null(blocks[2]);
    for (size_t i = 0; i < 3; i++) {
        srnf_free(blocks[i]);
    }
    assert_int_equal(one.used + other.used + all.used, 0);
    assert_true(jobs_memory_of_uploads() >= ((size_t)384 << 20));
    (void)jobs_memory_enter(NULL);
}

#define CROWD 4

struct crowd {
    struct jobs_memory *memory;
    pthread_barrier_t all;
};

static void *allocate_and_free(void *user)
{
    struct crowd *crowd = user;
    void *blocks[3] = {NULL};

    (void)jobs_memory_enter(crowd->memory);
    blocks[0] = srnf_alloc(9984, 1);
    (void)pthread_barrier_wait(&crowd->all);
    for (size_t i = 0; i < 3000; i++) {
        srnf_free(blocks[i % 3]);
        blocks[i % 3] = srnf_alloc(1 + i % 7, 1000);
    }
    for (size_t i = 0; i < 3; i++) {
        srnf_free(blocks[i]);
    }
    return NULL;
}

static void threads_share_an_account(void **state)
{
    struct jobs_memory memory = {0};
    struct crowd crowd = {.memory = &memory};
    pthread_t threads[CROWD];

    (void)state;
    jobs_memory_begin(&memory, CROWD * CHARGE(9984));
    assert_int_equal(pthread_barrier_init(&crowd.all, NULL, CROWD), 0);
    for (size_t i = 0; i < CROWD; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, allocate_and_free, &crowd), 0);
    }
    for (size_t i = 0; i < CROWD; i++) {
        pthread_join(threads[i], NULL);
    }
    (void)pthread_barrier_destroy(&crowd.all);
    assert_int_equal(memory.used, 0);
    assert_int_equal(memory.peak, CROWD * CHARGE(9984));
}

/* ---- Jobs ------------------------------------------------------------------------------------ */

struct world {
    struct engine engine;
    atomic_int waiting, met, kept;
};

/* Allocates as many blocks as its inputs say, one more than it can keep being its problem; with
   "lie" after the number it makes results of what it got. */
static void run_blocks(struct jobs_run *run, void *user, const char *inputs,
                       struct jobs_result *result)
{
    size_t wanted = strtoul(inputs, NULL, 10), n = 0;
    void *blocks[64];

    (void)run;
    (void)user;
    while (n < wanted && n < 64 && (blocks[n] = srnf_alloc(BLOCK, 1)) != NULL) {
        n++;
    }
    if (n == wanted || strstr(inputs, "lie")) {
        result->results = strdup(inputs);
    } else {
        result->problem_code = "out-of-memory";
    }
    while (n > 0) {
        srnf_free(blocks[--n]);
    }
}

/* Keeps two blocks until the gate opens. */
static void run_hold(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    struct world *world = user;
    void *block = srnf_alloc(2, BLOCK);

    (void)run;
    atomic_fetch_add(&world->waiting, 1);
    engine_wait_at_gate(&world->engine);
    result->results = block ? strdup(inputs) : NULL;
    srnf_free(block);
}

struct meeting {
    size_t size;
    void *blocks[2];
    atomic_int arrived;
};

/* Both bodies hold their block at the same time, each on a thread of its own. */
static void meet(void *argument, size_t index)
{
    struct meeting *meeting = argument;

    meeting->blocks[index] = srnf_alloc(meeting->size, 1);
    atomic_fetch_add(&meeting->arrived, 1);
    for (int ms = 0; ms < ENGINE_WAIT_MS && atomic_load(&meeting->arrived) < 2; ms++) {
        engine_pause_ms(1);
    }
}

/* Blocks of the size in the inputs, one on the worker and one on a helper; the worker frees both.
 */
static void run_help(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct meeting meeting = {.size = strtoul(inputs, NULL, 10)};
    struct world *world = user;

    context->parallel_for(context->user, 2, meet, &meeting);
    atomic_fetch_add(&world->met, atomic_load(&meeting.arrived) == 2);
    if (meeting.blocks[0] && meeting.blocks[1]) {
        result->results = strdup(inputs);
    } else {
        result->problem_code = "out-of-memory";
    }
    srnf_free(meeting.blocks[0]);
    srnf_free(meeting.blocks[1]);
}

/* Transforms are shared, and so charged to nobody. */
static void run_transform(struct jobs_run *run, void *user, const char *inputs,
                          struct jobs_result *result)
{
    const struct srnf_sht *sht = NULL;

    (void)user;
    if (jobs_transform_acquire(jobs_run_jobs(run), 127, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht) ==
        SRNF_OK) {
        result->results = strdup(inputs);
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
}

static const struct jobs_process table[] = {
    {"blocks", run_blocks, NULL},       {"hold", run_hold, NULL}, {"help", run_help, NULL},
    {"transform", run_transform, NULL}, {NULL, NULL, NULL},
};

static void on_log(void *user, const char *event, const char *job_id, const char *trace,
                   const char *detail)
{
    struct world *world = user;

    (void)job_id;
    (void)trace;
    (void)detail;
    atomic_fetch_add(&world->kept, strcmp(event, "job-memory-kept") == 0);
}

static int setup(void **state)
{
    return engine_setup(state, sizeof(struct world));
}

static void open_engine(struct world *world, size_t workers, size_t limit, struct metrics *metrics)
{
    struct jobs_config config = {.store = world->engine.fixture->store,
                                 .workers = workers,
                                 .table = table,
                                 .user = world,
                                 .job_memory = limit,
                                 .log = on_log,
                                 .metrics = metrics};

    assert_int_equal(jobs_open(&world->engine.jobs, &config), JOBS_OK);
}

static void submit(struct world *world, const char *process, const char *inputs,
                   struct store_job *job)
{
    enum jobs_submission how;

    assert_int_equal(jobs_submit(world->engine.jobs, NULL, process, inputs, NULL, NULL, job, &how),
                     JOBS_OK);
}

/* Waits for the end of the job, which is as it should be. */
static void ends(struct world *world, struct store_job *job, const char *code, const char *detail)
{
    struct store *store = world->engine.fixture->store;
    char id[STORE_ID_MAX];

    memcpy(id, job->id, sizeof id);
    for (int ms = 0; ms < ENGINE_WAIT_MS &&
                     (job->status == STORE_JOB_ACCEPTED || job->status == STORE_JOB_RUNNING);
         ms += 2) {
        engine_pause_ms(2);
        store_job_clear(job);
        assert_int_equal(store_job_get(store, id, job), STORE_OK);
    }
    assert_int_equal(job->status, code ? STORE_JOB_FAILED : STORE_JOB_SUCCESSFUL);
    if (code) {
        assert_string_equal(job->problem_code, code);
        assert_string_equal(job->problem_detail, detail);
    }
    store_job_clear(job);
}

static void refusal(char detail[300], size_t held, size_t asked, size_t limit)
{
    snprintf(detail, 300,
             "The job needs more memory than this service allows: with %zu bytes in use it asked "
             "for %zu more, and the limit is %zu bytes.",
             held, asked, limit);
}

static void a_job_beyond_its_limit_fails_alone(void **state)
{
    struct world *world = *state;
    struct metrics *metrics = metrics_create();
    struct store_job other, job;
    char detail[300];

    refusal(detail, LIMIT, CHARGE(BLOCK), LIMIT);
    open_engine(world, 2, LIMIT, metrics);
    assert_int_equal(jobs_memory_limit(world->engine.jobs), LIMIT);
    submit(world, "hold", "the other", &other);
    engine_await(&world->waiting, 1);
    for (int round = 0; round < 3; round++) {
        submit(world, "blocks", "5", &job);
        ends(world, &job, "memory-limit", detail);
        submit(world, "blocks", round == 0 ? "4" : round == 1 ? "04" : "3", &job);
        ends(world, &job, NULL, NULL);
    }
    /* Nothing is made of a result that came about without what was refused. */
    submit(world, "blocks", "6 lie", &job);
    ends(world, &job, "memory-limit", detail);
    atomic_store(&world->engine.gate, true);
    ends(world, &other, NULL, NULL);
    jobs_close(world->engine.jobs, 5.0);
    world->engine.jobs = NULL;
    assert_int_equal(world->kept, 0);
    assert_int_equal((int)metrics_value(metrics, METRIC_JOB_MEMORY, METRIC_LABELS("blocks")), 7);
    metrics_destroy(metrics);
}

static void helpers_count_to_their_job(void **state)
{
    struct world *world = *state;
    struct store_job job;
    char inputs[32], detail[300];
    size_t half = LIMIT / 2 - CHARGE(0);

    refusal(detail, CHARGE(half + 64), CHARGE(half + 64), LIMIT);
    open_engine(world, 2, LIMIT, NULL);
    snprintf(inputs, sizeof inputs, "%zu", half);
    submit(world, "help", inputs, &job);
    ends(world, &job, NULL, NULL);
    snprintf(inputs, sizeof inputs, "%zu", half + 64);
    submit(world, "help", inputs, &job);
    ends(world, &job, "memory-limit", detail);
    jobs_close(world->engine.jobs, 5.0);
    world->engine.jobs = NULL;
    assert_int_equal(world->met, 2);
    assert_int_equal(world->kept, 0);
}

static void what_is_shared_is_charged_to_nobody(void **state)
{
    struct world *world = *state;
    struct store_job job;

    open_engine(world, 1, 1000, NULL);
    submit(world, "transform", "t", &job);
    ends(world, &job, NULL, NULL);
    jobs_close(world->engine.jobs, 5.0);
    world->engine.jobs = NULL;
    assert_int_equal(world->kept, 0);
}

/* ---- The machine ----------------------------------------------------------------------------- */

static void write_text(const char *folder, const char *name, const char *text)
{
    char path[400];
    FILE *file;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void groups_of_the_daemon_limit_it(void **state)
{
    char root[SCRATCH_MAX], path[400], self[400];

    (void)state;
    assert_true(scratch_make(root, "groups"));
    snprintf(self, sizeof self, "%s/self", root);
    assert_int_equal(jobs_group_memory(self, root), SIZE_MAX); /* not there */
    write_text(root, "self", "4:memory:/old\n");
    assert_int_equal(jobs_group_memory(self, root), SIZE_MAX);
    write_text(root, "self", "4:memory:/old\n0::/a/b\n");
    assert_int_equal(jobs_group_memory(self, root), SIZE_MAX); /* no such groups */
    snprintf(path, sizeof path, "%s/a", root);
    assert_int_equal(mkdir(path, 0700), 0);
    write_text(root, "a/memory.max", "3000000000\n");
    assert_int_equal(jobs_group_memory(self, root), 3000000000u);
    snprintf(path, sizeof path, "%s/a/b", root);
    assert_int_equal(mkdir(path, 0700), 0);
    write_text(root, "a/b/memory.max", "max\n");
    assert_int_equal(jobs_group_memory(self, root), 3000000000u);
    write_text(root, "a/b/memory.max", "2000000000\n");
    assert_int_equal(jobs_group_memory(self, root), 2000000000u);
    write_text(root, "memory.max", "1000000000\n");
    assert_int_equal(jobs_group_memory(self, root), 1000000000u);
    write_text(root, "self", "0::/\n");
    assert_int_equal(jobs_group_memory(self, root), 1000000000u);
    scratch_remove(root);
}

static void so_does_its_address_space(void **state)
{
    size_t before = jobs_machine_memory(), within;
    struct rlimit was, limit;

    (void)state;
    assert_int_equal(getrlimit(RLIMIT_AS, &was), 0);
    limit = (struct rlimit){.rlim_cur = (rlim_t)1 << 30, .rlim_max = was.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_AS, &limit), 0);
    within = jobs_machine_memory();
    assert_int_equal(setrlimit(RLIMIT_AS, &was), 0);
    assert_int_equal(within, before < (size_t)1 << 30 ? before : (size_t)1 << 30);
    assert_int_equal(jobs_machine_memory(), before);
}

static void jobs_share_three_quarters(void **state)
{
    size_t machine = jobs_machine_memory();

    (void)state;
    assert_true(machine >= (size_t)64 << 20);
    for (size_t workers = 1; workers < 10; workers++) {
        size_t share = jobs_memory_share(workers);

        assert_true(workers * share <= machine / 4 * 3);
        assert_true((workers * share + workers) >= machine / 4 * 3);
    }
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, engine_teardown)

/* What can do without memory is not told that it was refused: its job does not fail for it. */
static void no_room_is_no_refusal(void **state)
{
    struct jobs_memory job = {.limit = 0};

    (void)state;
    jobs_memory_begin(&job, 100);
    assert_true(jobs_memory_fits(&job, 64));
    assert_false(jobs_memory_fits(&job, 64));
    assert_int_equal(job.refused, 0);
    assert_int_equal(job.used, 64);
    jobs_memory_discharge(&job, 64);
    assert_true(jobs_memory_fits(&job, 100));
    jobs_memory_discharge(&job, 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_room_is_no_refusal),
        cmocka_unit_test(accounts_are_exact),
        cmocka_unit_test(lent_memory_refuses_nobody_else),
        cmocka_unit_test(large_blocks_are_cleared_where_they_are_used),
        cmocka_unit_test(an_account_ends_at_its_limit),
        cmocka_unit_test(other_refusals_are_not_the_limits),
        cmocka_unit_test(threads_share_an_account),
        cmocka_unit_test(accounts_share_what_they_lie_in),
        TEST(a_job_beyond_its_limit_fails_alone),
        TEST(helpers_count_to_their_job),
        TEST(what_is_shared_is_charged_to_nobody),
        cmocka_unit_test(groups_of_the_daemon_limit_it),
        cmocka_unit_test(so_does_its_address_space),
        cmocka_unit_test(jobs_share_three_quarters),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
