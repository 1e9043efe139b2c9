/*
 * test_text.c - a text that was cut ends with a whole character.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "text.h"

static void every_cut_ends_with_a_character(void **state)
{
    static const char whole[] = "a\u00e4b\u20ac\U0001f9e0c\u00e9";
    static const size_t kept[] = {0, 1, 1, 3, 4, 4, 4, 7, 7, 7, 7, 11, 12, 12, 14};

    (void)state;
    assert_int_equal(sizeof kept / sizeof kept[0], sizeof whole);
    for (size_t length = 0; length < sizeof whole; length++) {
        char text[sizeof whole];

        (void)snprintf(text, length + 1, "%s", whole);
        text_trim_cut(text);
        assert_int_equal(strlen(text), kept[length]);
        assert_memory_equal(text, whole, kept[length]);
    }
}

static void other_bytes_stay(void **state)
{
    static const char *const texts[] = {"\x80", "\x80\x80\x80\x80\x80\x80", "a\xffz", "\xff  \x80"};

    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        char text[16];

        (void)snprintf(text, sizeof text, "%s", texts[i]);
        text_trim_cut(text);
        assert_string_equal(text, texts[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_cut_ends_with_a_character),
        cmocka_unit_test(other_bytes_stay),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
