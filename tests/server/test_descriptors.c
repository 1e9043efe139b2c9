/*
 * test_descriptors.c - connections that are fitted to the limit of open files.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "descriptors.h"

static void what_fits_is_left_alone(void **state)
{
    struct descriptors d = {.threads = 11, .connections = 1024, .waiting = 4096};

    (void)state;
    d.limit = descriptors_needed(&d);
    assert_false(descriptors_fit(&d));
    d.limit = SIZE_MAX;
    assert_false(descriptors_fit(&d));
    assert_int_equal(d.connections, 1024);
    assert_int_equal(d.waiting, 4096);
}

static void those_that_wait_are_lowered_first(void **state)
{
    struct descriptors d = {.limit = 4096, .threads = 11, .connections = 1024, .waiting = 4096};

    (void)state;
    assert_true(descriptors_fit(&d));
    assert_int_equal(d.connections, 1024);
    assert_true(d.waiting < 4096 && d.waiting >= 800);
    assert_true(descriptors_needed(&d) <= 4096);
}

/* Whatever the limit: both kinds stay possible, and all fits as long as there is any room. */
static void every_limit_leaves_both(void **state)
{
    (void)state;
    for (size_t limit = 0; limit < 12000; limit += limit < 1200 ? 1 : 37) {
        struct descriptors d = {
            .limit = limit, .threads = 11, .connections = 1024, .waiting = 4096};
        bool fitted = descriptors_fit(&d);

        assert_true(d.connections >= 1 && d.connections <= 1024);
        assert_true(d.waiting >= 1 && d.waiting <= 4096);
        assert_true(limit < 400 || descriptors_needed(&d) <= limit);
        assert_true(limit < 16 || 2 * (d.connections + d.waiting) <= limit);
        assert_true(!fitted || limit < 400 || descriptors_needed(&d) + 4 > limit);
    }
}

static void few_that_wait_leave_room_for_others(void **state)
{
    struct descriptors d = {.limit = 1024, .threads = 11, .connections = 1024, .waiting = 5};

    (void)state;
    assert_true(descriptors_fit(&d));
    assert_int_equal(d.waiting, 5);
    assert_true(d.connections > 300 && descriptors_needed(&d) <= 1024);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_fits_is_left_alone),
        cmocka_unit_test(those_that_wait_are_lowered_first),
        cmocka_unit_test(every_limit_leaves_both),
        cmocka_unit_test(few_that_wait_leave_room_for_others),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
