/*
 * test_unread.c - what a run could not read fails it by that name, and not for want of memory.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <string.h>

#include "api/json_memory.h"
#include "compute/compute.h"
#include "store_status.h"
#include "toolkit/process.h"

/* The problem of a run that reads rows with these statuses. */
static void fails(const int *statuses, size_t n, const char *code)
{
    struct jobs_result result = {.results = NULL};
    json_t *inputs = process_parse("{}", &result);

    assert_non_null(inputs);
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(process_read(statuses[i]), statuses[i] == STORE_OK);
    }
    assert_int_equal(json_memory_failed(), code != NULL);
    if (code) {
        assert_null(json_memory_dumps(inputs, 0));
        process_fail_document(&result, "writing the results");
        assert_string_equal(result.problem_code, code);
        assert_true(strlen(result.problem_detail) > strlen("writing the results: "));
    }
    json_decref(inputs);
}

static void the_first_that_cannot_be_read_tells(void **state)
{
    (void)state;
    fails((int[]){STORE_OK, STORE_NOT_FOUND}, 2, NULL);
    fails((int[]){STORE_OK, STORE_CORRUPT, STORE_NOMEM}, 3, "data-damaged");
    fails((int[]){STORE_IO}, 1, "storage-unavailable");
    fails((int[]){STORE_NOMEM}, 1, "out-of-memory");
}

static void memory_is_told_of_where_all_was_read(void **state)
{
    struct jobs_result result = {.results = NULL};
    json_t *inputs = process_parse("{}", &result);

    (void)state;
    json_memory_fail();
    process_fail_document(&result, "writing the results");
    assert_string_equal(result.problem_code, "out-of-memory");
    json_decref(inputs);
}

/* A status of the store in the stead of one of the core is none of the core. */
static void statuses_have_one_meaning(void **state)
{
    (void)state;
    assert_string_equal(compute_problem_code(STORE_NOMEM), "out-of-memory");
    assert_string_equal(compute_problem_code(STORE_CORRUPT), "data-damaged");
    assert_string_equal(compute_problem_code(SRNF_ENOT_MANIFOLD), "mesh-not-manifold");
    for (int store = STORE_QUEUED; store <= STORE_NOT_FOUND; store++) {
        assert_true(store < SRNF_EIO);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_that_cannot_be_read_tells),
        cmocka_unit_test(memory_is_told_of_where_all_was_read),
        cmocka_unit_test(statuses_have_one_meaning),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
