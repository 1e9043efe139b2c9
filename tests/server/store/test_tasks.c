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
    assert_int_equal(store_task_finish(store, ONE, "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w"), STORE_OK);
    assert_int_equal(store_task_lease(store, ONE, 2, "b", "v"), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "forged", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, TWO, "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, "task-3", "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "forged"), STORE_CONFLICT);
    assert_int_equal(store_task_holds(store, TWO, "a"), STORE_CONFLICT);
    assert_int_equal(store_task_result(store, ONE, &result, &size), STORE_NOT_FOUND);
    assert_int_equal(store_task_finish(store, ONE, "a", "xyz", 3), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", "uvw", 3), STORE_CONFLICT);
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
    assert_int_equal(store_task_lease(store, ONE, 1, "a", "slow"), STORE_OK);
    assert_int_equal(store_task_lose(store, ONE, 2, "no sign"), STORE_CONFLICT);
    assert_int_equal(store_task_lose(store, ONE, 1, "no sign of slow"), STORE_OK);
    assert_int_equal(store_task_lose(store, ONE, 1, "no sign"), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 1, "c", "late"), STORE_CONFLICT);
    assert_int_equal(store_task_lease(store, ONE, 2, "b", "next"), STORE_OK);
    assert_int_equal(store_task_finish(store, ONE, "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_give_back(store, ONE, "b", "it broke"), STORE_OK);
    assert_int_equal(store_task_lease(store, ONE, 3, "d", "kind"), STORE_OK);
    assert_int_equal(store_task_give_back(store, ONE, "d", NULL), STORE_OK);
    look(store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_WAITING);
    assert_int_equal(tasks[0].attempt, 3);
    assert_int_equal(tasks[0].lost, 2);
    assert_int_equal(store_task_reasons(store, ONE, reasons), STORE_OK);
    assert_string_equal(reasons, "no sign of slow\nit broke");
}

static void leases_outlive_the_daemon(void **state)
{
    struct fixture *fixture = *state;
    struct store_task tasks[2];
    char job[STORE_ID_MAX];

    open_two(fixture->store, job, tasks);
    assert_int_equal(store_task_lease(fixture->store, ONE, 1, "a", "w"), STORE_OK);
    assert_int_equal(store_task_lease(fixture->store, TWO, 1, "b", "w"), STORE_OK);
    assert_int_equal(store_task_finish(fixture->store, TWO, "b", "y", 1), STORE_OK);
    store_close(fixture->store);
    fixture->store = fixture_store(fixture->path);
    look(fixture->store, job, tasks);
    assert_int_equal(tasks[0].status, STORE_TASK_LEASED);
    assert_string_equal(tasks[0].worker, "w");
    assert_int_equal(tasks[1].status, STORE_TASK_DONE);
    assert_int_equal(store_task_finish(fixture->store, ONE, "a", "x", 1), STORE_OK);
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

    assert_int_equal(store_task_lease(store, ONE, 1, "a", "w"), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job, attempt, STORE_JOB_ACCEPTED, NULL, NULL, NULL), STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job, attempt - 1, STORE_JOB_DISMISSED, NULL, NULL, NULL),
        STORE_OK);
    assert_int_equal(store_task_holds(store, ONE, "a"), STORE_CONFLICT);
    assert_int_equal(store_task_finish(store, ONE, "a", "x", 1), STORE_CONFLICT);
    assert_int_equal(store_task_reasons(store, TWO, reasons), STORE_NOT_FOUND);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_lease_ends_with_one_result),
        TEST(an_expired_lease_is_stale),
        TEST(leases_outlive_the_daemon),
        TEST(tasks_go_with_their_job),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
