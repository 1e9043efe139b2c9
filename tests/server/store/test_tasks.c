/*
 * Tasks and leases: who may move them, and who comes too late; a result is written once; tasks
 * outlive the daemon and go with the end of their job.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/task.h"

#define ONE "task-1"
#define TWO "task-2"

static const struct store_maker here = {.host = "here", .cpu = "any", .build = "this"};

/* A running job with two tasks; tasks[2] are as they are now. */
static int64_t open_two(struct store *store, char job[STORE_ID_MAX], struct store_task tasks[2])
{
    struct store_job row;
    int64_t attempt;

    assert_int_equal(fixture_insert_job(store, 1, job), STORE_OK);
    assert_int_equal(store_job_claim(store, &row), STORE_OK);
    attempt = row.attempt;
    store_job_clear(&row);
    memset(tasks, 0, 2 * sizeof *tasks);
    snprintf(tasks[0].id, STORE_ID_MAX, ONE);
    snprintf(tasks[1].id, STORE_ID_MAX, TWO);
    assert_int_equal(store_tasks_open(store, job, "pairs", 2, tasks), STORE_OK);
    return attempt;
}

/* As they are when the job comes to them again. */
static void look(struct store *store, const char *job, struct store_task tasks[2])
{
    assert_int_equal(store_tasks_open(store, job, "pairs", 2, tasks), STORE_OK);
}

static void a_lease_ends_with_one_result(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_task tasks[2];
    char job[STORE_ID_MAX];
    unsigned char *result;
    size_t size;

    open_two(store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_WAITING);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w", &here), STORE_OK);
    assert_int_equal(store_task_lease(store, ONE, 2, "b", "v", &here), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "forged", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, TWO, "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, "task-3", "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "forged"), STORE_CONFLICT);
    assert_int_equal(store_task_holds(store, TWO, "a"), STORE_CONFLICT);
    assert_int_equal(store_task_result(store, ONE, &result, &size), STORE_NOT_FOUND);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "xyz", 3), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "uvw", 3), STORE_CONFLICT);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_CONFLICT);
    assert_int_equal(store_task_give_back(store, ONE, "a", NULL), STORE_CONFLICT);
    look(store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_DONE);
    assert_int_equal(tasks[1].status, STORE_TASK_WAITING);
    assert_int_equal(store_task_result(store, ONE, &result, &size), STORE_OK);
    assert_int_equal(size, 3);
    assert_memory_equal(result, "xyz", 3);
    free(result);
    assert_int_equal(store_tasks_drop_done(store, job), STORE_OK);
    assert_int_equal(store_task_result(store, ONE, &result, &size), STORE_NOT_FOUND);
    look(store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_WAITING);
    assert_int_equal(tasks[0].attempt, 0);
}

static void an_expired_lease_is_stale(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char job[STORE_ID_MAX], reasons[STORE_TASK_REASONS_MAX];
    struct store_task tasks[2];

    open_two(store, job, tasks);
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "slow", &here), STORE_OK);
    assert_int_equal(store_task_lose(store, ONE, 2, "no sign"), STORE_CONFLICT);
    assert_int_equal(store_task_lose(store, ONE, 1, "no sign of slow"), STORE_OK);
    assert_int_equal(store_task_lose(store, ONE, 1, "no sign"), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 1, "c", "late", &here), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 2, "b", "next", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_give_back(store, ONE, "b", "it broke"), STORE_OK);
    assert_int_equal(store_task_lease(store, ONE, 3, "d", "kind", &here), STORE_OK);
    assert_int_equal(store_task_give_back(store, ONE, "d", NULL), STORE_OK);
    look(store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_WAITING);
    assert_int_equal(tasks[0].attempt, 3);
    assert_int_equal(tasks[0].lost, 2);
    assert_int_equal(store_task_reasons(store, ONE, reasons), STORE_OK);
    assert_string_equal(reasons, "here (any): no sign of slow\nhere (any): it broke");
}

static void leases_outlive_the_daemon(void **state)
{
    struct fixture *fixture = *state;
    struct store_task tasks[2];
    char job[STORE_ID_MAX];

    open_two(fixture->store, job, tasks);
    assert_int_equal(store_task_lease(fixture->store, ONE, 1, "a", "w", &here), STORE_OK);
    assert_int_equal(store_task_lease(fixture->store, TWO, 1, "b", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(fixture->store, TWO, "b", &here, "y", 1), STORE_OK);
    store_close(fixture->store);
    fixture->store = fixture_store(fixture->path);
    look(fixture->store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_LEASED);
    assert_string_equal(tasks[0].worker, "w");
    assert_int_equal(tasks[1].status, STORE_TASK_DONE);
    assert_int_equal(store_task_finish(fixture->store, ONE, "a", &here, "x", 1), STORE_OK);
    assert_int_equal(store_task_reset(fixture->store, ONE), STORE_OK);
    assert_int_equal(store_task_reset(fixture->store, ONE), STORE_CONFLICT);
    look(fixture->store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_WAITING);
    assert_int_equal(tasks[0].lost, 1);
}

static void tasks_go_with_their_job(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_task tasks[2];
    char job[STORE_ID_MAX], reasons[STORE_TASK_REASONS_MAX];
    int64_t attempt = open_two(store, job, tasks);

    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w", &here), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job, attempt, STORE_JOB_ACCEPTED, NULL, NULL, NULL), STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job, attempt, STORE_JOB_DISMISSED, NULL, NULL, NULL), STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_reasons(store, TWO, reasons), STORE_NOT_FOUND);
}

struct found {
    char text[400];
    size_t n;
};

static void add_found(void *user, const struct store_maker *maker, int64_t tasks)
{
    struct found *found = user;
    size_t length = strlen(found->text);

    (void)snprintf(found->text + length, sizeof found->text - length, "%s %s %s %d; ", maker->host,
                   maker->cpu, maker->build, (int)tasks);
    found->n++;
}

static void who_has_computed_outlives_the_job(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    const struct store_maker there = {.host = "there", .cpu = "other", .build = "this"};
    struct found found = {.n = 0};
    struct store_task tasks[2];
    char job[STORE_ID_MAX];
    int64_t attempt = open_two(store, job, tasks);

    assert_int_equal(store_task_makers(store, job, add_found, &found), STORE_OK);
    assert_int_equal(found.n, 0);
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "forged", &there, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "a", &there, "x", 1), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", &there, "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, TWO, 1, "b", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, TWO, "b", &here, "x", 1), STORE_OK);
    assert_int_equal(store_tasks_drop_done(store, job), STORE_OK);
    look(store, job, tasks);
    assert_int_equal(store_task_lease(store, ONE, 1, "c", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "c", &here, "x", 1), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job, attempt, STORE_JOB_DISMISSED, NULL, NULL, NULL), STORE_OK);
    assert_int_equal(store_task_makers(store, job, add_found, &found), STORE_OK);
    assert_string_equal(found.text, "here any this 2; there other this 1; ");
    assert_int_equal(store_job_delete(store, job), STORE_OK);
    found.n = 0;
    assert_int_equal(store_task_makers(store, job, add_found, &found), STORE_OK);
    assert_int_equal(found.n, 0);
}

/* Whoever calls itself otherwise with each result fills no database. */
static void makers_are_bounded(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct found found = {.n = 0};
    struct store_task tasks[2];
    char job[STORE_ID_MAX], host[16];
    const struct store_maker many = {.host = host, .cpu = "any", .build = "this"};

    open_two(store, job, tasks);
    for (int i = 0; i < STORE_EXECUTORS_MAX + 3; i++) {
        (void)snprintf(host, sizeof host, "h%d", i);
        assert_int_equal(store_task_lease(store, ONE, 2 * i + 1, "a", "w", &many), STORE_OK);
        assert_int_equal(store_task_finish(store, ONE, "a", &many, "x", 1), STORE_OK);
        assert_int_equal(store_task_reset(store, ONE), STORE_OK);
    }
    assert_int_equal(store_task_makers(store, job, add_found, &found), STORE_OK);
    assert_int_equal(found.n, STORE_EXECUTORS_MAX);
}

/* ---- A failure of power ---------------------------------------------------------------------- */

#define PAGE 4096 /* bytes of the database's */

static size_t read_whole(const char *folder, const char *name, unsigned char **bytes)
{
    char path[SCRATCH_MAX + 40];
    FILE *file;
    size_t size;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    size = (size_t)ftell(file);
    rewind(file);
    *bytes = malloc(size + 1);
    assert_int_equal(fread(*bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    return size;
}

static void write_whole(const char *folder, const char *name, const void *bytes, size_t size)
{
    char path[SCRATCH_MAX + 40];
    FILE *file;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* Reads on for the time of the test, so that nothing is copied from the log to the database. */
static sqlite3 *hold_back(const char *folder)
{
    char path[SCRATCH_MAX + 40];
    sqlite3 *db;

    snprintf(path, sizeof path, "%s/srnfd.db", folder);
    assert_int_equal(sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "BEGIN; SELECT count(*) FROM task", NULL, NULL, NULL),
                     SQLITE_OK);
    return db;
}

/* How far the two tasks of the history below have come. */
static size_t stage_of(const struct store_task tasks[2])
{
    return (size_t)tasks[0].status + (size_t)tasks[1].status;
}

/* Brings a task to its end from where it stands, whatever the worker of before has to say. */
static void bring_to_end(struct store *store, const struct store_task *task, const char *secret)
{
    int64_t next = task->attempt + 1;

    if (task->status == STORE_TASK_LEASED) {
        assert_int_equal(store_task_lose(store, task->id, task->attempt, "no sign"), STORE_OK);
    }
    assert_int_equal(store_task_finish(store, task->id, secret, &here, "x", 1), STORE_CONFLICT);
    if (task->status != STORE_TASK_DONE) {
        assert_int_equal(store_task_lease(store, task->id, next, "new", "w", &here), STORE_OK);
        assert_int_equal(store_task_finish(store, task->id, "new", &here, "x", 1), STORE_OK);
    }
}

/* With as much of the log as was on the disk; returns how far the tasks had come. */
static size_t come_back(const unsigned char *database, size_t size, const unsigned char *log,
                        size_t written, const char *job)
{
    char folder[SCRATCH_MAX];
    struct store_task tasks[2] = {{.id = ONE}, {.id = TWO}};
    struct store *store;
    size_t stage;

    assert_true(scratch_make(folder, "power"));
    write_whole(folder, "srnfd.db", database, size);
    write_whole(folder, "srnfd.db-wal", log, written);
    store = fixture_store(folder);
    look(store, job, tasks);
    stage = stage_of(tasks);
    /* In the order in which it was done, nothing left out. */
    assert_true(tasks[1].status == STORE_TASK_WAITING || tasks[0].status == STORE_TASK_DONE);
    bring_to_end(store, &tasks[0], "a");
    bring_to_end(store, &tasks[1], "b");
    look(store, job, tasks);
    assert_int_equal(stage_of(tasks), 2 * STORE_TASK_DONE);
    store_close(store);
    scratch_remove(folder);
    return stage;
}

/* Leases and results are committed without waiting for the disk. Where the power fails at any
   place of the log, some are as if they had not been, the last ones first, and their tasks are
   done again. */
static void a_failure_of_power_costs_time_alone(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *database, *log;
    size_t size, begin, end, stage = 0;
    struct store_task tasks[2];
    char job[STORE_ID_MAX];
    bool seen[2 * STORE_TASK_DONE + 1] = {false};
    sqlite3 *reader;

    reader = hold_back(fixture->path);
    open_two(store, job, tasks);
    begin = read_whole(fixture->path, "srnfd.db-wal", &log);
    free(log);
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", &here, "x", 1), STORE_OK);
    assert_int_equal(store_task_lease(store, TWO, 1, "b", "w", &here), STORE_OK);
    assert_int_equal(store_task_finish(store, TWO, "b", &here, "x", 1), STORE_OK);
    size = read_whole(fixture->path, "srnfd.db", &database);
    end = read_whole(fixture->path, "srnfd.db-wal", &log);
    for (size_t written = begin; written <= end; written += PAGE / 2) {
        size_t found = come_back(database, size, log, written, job);

        assert_true(found >= stage);
        stage = found;
        seen[stage] = true;
    }
    stage = come_back(database, size, log, end, job);
    seen[stage] = true;
    for (size_t i = 0; i <= 2 * STORE_TASK_DONE; i++) {
        assert_true(seen[i]);
    }
    free(log);
    free(database);
    assert_int_equal(sqlite3_close(reader), SQLITE_OK);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_lease_ends_with_one_result),        TEST(an_expired_lease_is_stale),
        TEST(leases_outlive_the_daemon),           TEST(tasks_go_with_their_job),
        TEST(who_has_computed_outlives_the_job),   TEST(makers_are_bounded),
        TEST(a_failure_of_power_costs_time_alone),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
