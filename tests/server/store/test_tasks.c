/*
 * Tasks and leases: who may move them, and who comes too late; a result is written once; tasks
 * outlive the daemon and go with the end of their job.
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
        store_job_transition(store, job, attempt - 1, STORE_JOB_DISMISSED, NULL, NULL, NULL),
        STORE_OK);
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

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_lease_ends_with_one_result),      TEST(an_expired_lease_is_stale),
        TEST(leases_outlive_the_daemon),         TEST(tasks_go_with_their_job),
        TEST(who_has_computed_outlives_the_job), TEST(makers_are_bounded),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
