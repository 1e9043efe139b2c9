/*
 * test_changes.c - the jobs that have changed lately: their order, what is left out, what is lost.
 */
#include "api/changes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define MANY 1024

static int open_changes(void **state)
{
    *state = changes_create();
    return *state ? 0 : -1;
}

static int close_changes(void **state)
{
    changes_destroy(*state);
    return 0;
}

static void order_is_that_of_the_last_change(void **state)
{
    struct change list[4];
    uint64_t seen = 0;
    bool lost;

    changes_note(*state, "job-a", "ada", true);
    changes_note(*state, "job-b", "ada", true);
    changes_note(*state, "job-a", NULL, false);
    assert_int_equal(changes_since(*state, NULL, &seen, list, 4, &lost), 2);
    assert_false(lost);
    assert_string_equal(list[0].id, "job-b");
    assert_string_equal(list[1].id, "job-a");
    assert_true(list[1].of_status); /* since the beginning */
    assert_int_equal(seen, 3);
    assert_int_equal(changes_since(*state, NULL, &seen, list, 4, &lost), 0);
    changes_note(*state, "job-a", NULL, false);
    assert_int_equal(changes_since(*state, NULL, &seen, list, 4, &lost), 1);
    assert_false(list[0].of_status);
}

static void others_are_left_out(void **state)
{
    struct change list[4];
    uint64_t seen = 0;
    bool lost;

    changes_note(*state, "job-a", "ada", true);
    changes_note(*state, "job-b", "ben", true);
    changes_note(*state, "job-c", NULL, true); /* it could be ada's */
    assert_int_equal(changes_since(*state, "ada", &seen, list, 4, &lost), 2);
    assert_string_equal(list[1].id, "job-c");
    changes_set_owner(*state, "job-c", "ben");
    seen = 0;
    assert_int_equal(changes_since(*state, "ada", &seen, list, 4, &lost), 1);
    assert_true(changes_is_of(*state, "job-c", "ben"));
    assert_false(changes_is_of(*state, "job-c", "ada"));
    assert_false(changes_is_of(*state, "job-x", "ada"));
}

static void a_page_goes_on_where_the_one_before_ended(void **state)
{
    struct change list[2];
    uint64_t seen = 0;
    size_t n = 0;
    bool lost;

    for (int i = 0; i < 5; i++) {
        char id[32];

        (void)snprintf(id, sizeof id, "job-%d", i);
        changes_note(*state, id, "ada", true);
    }
    for (size_t got; (got = changes_since(*state, NULL, &seen, list, 2, &lost)) > 0; n += got) {
        char id[32];

        (void)snprintf(id, sizeof id, "job-%zu", n);
        assert_string_equal(list[0].id, id);
    }
    assert_int_equal(n, 5);
}

static void what_is_forgotten_is_lost(void **state)
{
    struct change list[1];
    uint64_t start = 0, seen;
    bool lost;

    for (int i = 0; i <= MANY; i++) {
        char id[32];

        (void)snprintf(id, sizeof id, "job-%d", i);
        changes_note(*state, id, "ada", true);
    }
    seen = start;
    (void)changes_since(*state, NULL, &seen, list, 1, &lost);
    assert_true(lost);
    seen = 1; /* up to the one that is not there any more */
    assert_int_equal(changes_since(*state, NULL, &seen, list, 1, &lost), 1);
    assert_false(lost);
    assert_string_equal(list[0].id, "job-1");
}

static void texts_are_of_this_run(void **state)
{
    struct changes *other = changes_create();
    char text[CHANGES_ID_SIZE];
    uint64_t at;

    assert_non_null(other);
    changes_note(*state, "job-a", NULL, true);
    changes_text(*state, 1, text);
    assert_true(changes_parse(*state, text, &at));
    assert_int_equal(at, 1);
    assert_false(changes_parse(other, text, &at));
    changes_text(*state, 2, text); /* has not been yet */
    assert_false(changes_parse(*state, text, &at));
    assert_false(changes_parse(*state, "", &at));
    assert_false(changes_parse(*state, "-1", &at));
    changes_destroy(other);
}

/* The numbers count everybody's changes: their texts must not, nor tell that there were any. */
static void texts_tell_no_number(void **state)
{
    char text[CHANGES_ID_SIZE], again[CHANGES_ID_SIZE];
    uint64_t at;

    for (uint64_t i = 1; i <= MANY; i++) {
        size_t same = 0;

        changes_note(*state, "job-a", "ada", true);
        changes_text(*state, i, text);
        changes_text(*state, i, again);
        assert_int_equal(strlen(text), CHANGES_ID_SIZE - 1);
        for (size_t k = 0; text[k]; k++) {
            same += text[k] == again[k];
        }
        assert_true(same < 48); /* of 96; 6 in the mean */
        assert_true(changes_parse(*state, text, &at));
        assert_int_equal(at, i);
        assert_true(changes_parse(*state, again, &at));
        assert_int_equal(at, i);
        text[10] = text[10] == '0' ? '1' : '0';
        assert_false(changes_parse(*state, text, &at));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(order_is_that_of_the_last_change, open_changes,
                                        close_changes),
        cmocka_unit_test_setup_teardown(others_are_left_out, open_changes, close_changes),
        cmocka_unit_test_setup_teardown(a_page_goes_on_where_the_one_before_ended, open_changes,
                                        close_changes),
        cmocka_unit_test_setup_teardown(what_is_forgotten_is_lost, open_changes, close_changes),
        cmocka_unit_test_setup_teardown(texts_are_of_this_run, open_changes, close_changes),
        cmocka_unit_test_setup_teardown(texts_tell_no_number, open_changes, close_changes),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
