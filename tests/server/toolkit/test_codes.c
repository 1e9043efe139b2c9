/*
 * test_codes.c - numbers that stand for what is missing, with a gap before the others and without,
 * and numbers that merely look like one.
 */
#include "support/random.h"
#include "toolkit/codes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define N ((size_t)24)

static bool has_code(const double values[N])
{
    double scratch[N];
    struct code code;

    return code_find(N, values, scratch, &code);
}

/* Whether the code that is found is this one. */
static bool is_found(const double values[N], double value)
{
    double scratch[N];
    struct code code;

    return code_find(N, values, scratch, &code) && fabs(code.value - value) < 1e-12;
}

/* Weights of grown people: normal, mean 75, standard deviation 16. */
static void draw_weights(double values[N])
{
    struct test_random random = test_random_seed(5);

    for (size_t i = 0; i < N; i++) {
        values[i] = 75.0 + 16.0 * test_random_normal(&random);
    }
}

static void zeros_need_no_gap_as_wide_as_all_others(void **state)
{
    double values[N], scratch[N];
    struct code code;

    (void)state;
    draw_weights(values);
    assert_false(has_code(values));
    values[3] = values[11] = 0.0;
    assert_true(code_find(N, values, scratch, &code));
    assert_true(code.lowest < code.highest - code.lowest); /* no such gap */
    assert_int_equal(code.members, 2);
    assert_int_equal(code.first, 3);
    values[3] = values[11] = -1.0;
    assert_true(has_code(values));
}

static void negative_codes_need_no_gap(void **state)
{
    double values[N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        values[i] = (double)(i * 7 % N) * 4.0; /* from 0 on, scattering by 35 */
    }
    assert_false(has_code(values));
    values[8] = -9.0;
    assert_true(is_found(values, -9.0));
    values[9] = -3.0; /* others are negative, too */
    assert_false(has_code(values));
}

static void codes_among_the_others_repeat(void **state)
{
    double values[N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        values[i] = 612.5 + 37.25 * (double)i;
    }
    values[4] = 999.0;
    assert_false(has_code(values)); /* may have been measured */
    values[15] = 999.0;
    assert_true(is_found(values, 999.0));
    values[7] = values[6]; /* others repeat as well */
    assert_false(has_code(values));
}

static void what_is_counted_or_chosen_is_no_code(void **state)
{
    double doses[N], cigarettes[N], scores[N];

    (void)state;
    for (size_t i = 0; i < N; i++) {
        doses[i] = i % 6 ? 10.0 * (double)(i % 6) : 0.0;
        cigarettes[i] = i % 7 ? (double)(i % 7 * (i % 7)) : 0.0;
        scores[i] = 90.0 + (double)(i % 12);
    }
    assert_false(has_code(doses));
    assert_false(has_code(cigarettes));
    assert_false(has_code(scores));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zeros_need_no_gap_as_wide_as_all_others),
        cmocka_unit_test(negative_codes_need_no_gap),
        cmocka_unit_test(codes_among_the_others_repeat),
        cmocka_unit_test(what_is_counted_or_chosen_is_no_code),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
