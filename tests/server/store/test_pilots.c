/*
 * Rows of arrays of pilots: they outlive the daemon and their job, and say what was last known.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/pilots.h"

static void rows_come_change_and_go(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_pilots row = {
        .name = "b", .job = "job-1", .attempt = 1, .size = 4, .memory = 512, .token = "digest"};
    struct store_pilots *list;
    size_t n;

    assert_int_equal(store_pilots_list(store, &list, &n), STORE_OK);
    assert_int_equal(n, 0);
    assert_int_equal(store_pilots_put(store, &row), STORE_OK);
    row.status = STORE_PILOTS_SUBMITTED;
    snprintf(row.number, sizeof row.number, "123");
    assert_int_equal(store_pilots_put(store, &row), STORE_OK);
    snprintf(row.name, sizeof row.name, "a");
    row.status = STORE_PILOTS_ENDING;
    row.vanished = true;
    assert_int_equal(store_pilots_put(store, &row), STORE_OK);
    assert_int_equal(store_pilots_list(store, &list, &n), STORE_OK);
    assert_int_equal(n, 2);
    assert_string_equal(list[0].name, "a");
    assert_int_equal(list[0].status, STORE_PILOTS_ENDING);
    assert_true(list[0].vanished);
    assert_false(list[1].vanished);
    assert_string_equal(list[1].name, "b");
    assert_int_equal(list[1].status, STORE_PILOTS_SUBMITTED);
    assert_string_equal(list[1].number, "123");
    assert_string_equal(list[1].job, "job-1");
    assert_string_equal(list[1].token, "digest");
    assert_int_equal(list[1].attempt, 1);
    assert_int_equal(list[1].size, 4);
    assert_int_equal(list[1].memory, 512);
    free(list);
    assert_int_equal(store_pilots_drop(store, "a"), STORE_OK);
    assert_int_equal(store_pilots_drop(store, "a"), STORE_OK);
    assert_int_equal(store_pilots_list(store, &list, &n), STORE_OK);
    assert_int_equal(n, 1);
    free(list);
    row.size = 0;
    assert_int_not_equal(store_pilots_put(store, &row), STORE_OK);
}

static void a_job_is_wanted_until_it_ends(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char job[STORE_ID_MAX];
    struct store_job row;
    bool wanted = true;

    assert_int_equal(store_pilots_wanted(store, "job-none", &wanted), STORE_OK);
    assert_false(wanted);
    assert_int_equal(fixture_insert_job(store, 1, job), STORE_OK);
    assert_int_equal(store_pilots_wanted(store, job, &wanted), STORE_OK);
    assert_true(wanted);
    assert_int_equal(store_job_request_cancel(store, job, &row), STORE_OK);
    store_job_clear(&row);
    assert_int_equal(store_pilots_wanted(store, job, &wanted), STORE_OK);
    assert_false(wanted);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(rows_come_change_and_go, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(a_job_is_wanted_until_it_ends, fixture_setup,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
