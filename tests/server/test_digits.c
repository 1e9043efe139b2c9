/*
 * test_digits.c - the short ways of digits.c write what printf writes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "digits.h"

static void is_as_printed(double value)
{
    char text[DIGITS_MAX], wanted[64];
    size_t length = digits_number(text, value);

    (void)snprintf(wanted, sizeof wanted, "%.15g", value);
    if (strcmp(text, wanted) != 0 || length != strlen(wanted)) {
        fail_msg("%a is written %s, not %s", value, text, wanted);
    }
}

static void numbers_are_as_printf_has_them(void **state)
{
    static const double values[] = {0,
                                    -0.0,
                                    1,
                                    -1,
                                    0.001,
                                    0.0005,
                                    0.0015,
                                    0.1,
                                    0.25,
                                    1e-3,
                                    1e-4,
                                    12.5,
                                    99.999,
                                    -99.999,
                                    1e11,
                                    1e15,
                                    1e14,
                                    1e16,
                                    1.0 / 3,
                                    2.675,
                                    1e300,
                                    -1e-300,
                                    0.1 + 0.2,
                                    999999999999999.0,
                                    999999999999.999,
                                    123456789.125,
                                    DBL_MAX,
                                    DBL_MIN,
                                    9007199254740993.0};
    uint64_t random = 1;

    (void)state;
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        is_as_printed(values[i]);
    }
    for (int i = 0; i < 50000; i++) {
        double value;

        random = random * 6364136223846793005u + 1442695040888963407u;
        value = (double)(random >> 11) / (double)(1u << (random % 31));
        is_as_printed(value);
        is_as_printed(round(value) / 1000);
        is_as_printed(nextafter(round(value) / 1000, 0));
    }
}

static void whole_numbers_and_thousandths(void **state)
{
    static const struct {
        double value;
        const char *text;
    } cases[] = {
        {0, "0.000"},      {0.0004, "0.000"}, {0.0006, "0.001"}, {12.3456, "12.346"},
        {1e3, "1000.000"}, {-5, "0.000"},     {NAN, "0.000"},    {INFINITY, "1000000000000.000"}};
    char text[DIGITS_MAX];

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(digits_thousandths(text, cases[i].value), strlen(cases[i].text));
        assert_string_equal(text, cases[i].text);
    }
    assert_int_equal(digits_unsigned(text, UINT64_MAX), 20);
    assert_string_equal(text, "18446744073709551615");
    assert_int_equal(digits_unsigned(text, 0), 1);
    assert_string_equal(text, "0");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_as_printf_has_them),
        cmocka_unit_test(whole_numbers_and_thousandths),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
