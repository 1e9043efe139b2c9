/*
 * test_compare.c - support/compare.h: what it computes of numbers, and that a NaN, wherever it
 * stands, gives a figure that is below no limit.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>

#include "support/compare.h"

#define N ((size_t)7)

static const double numbers[7] = {3.0, -9.0, 0.0, 1e-300, 4.0, -2.5, 8.0};
static const double others[7] = {3.0, -8.0, 0.5, 0.0, 1.0, -2.5, 8.0};

/* No limit is one: how every assertion on a figure is written. */
static void assert_fails(double figure)
{
    bool passes = figure <= INFINITY || figure < INFINITY || figure >= -INFINITY;

    assert_false(passes);
}

static void of_numbers_it_is_exact(void **state)
{
    double sorted[7];

    (void)state;
    assert_true(compare_max(1.0, 2.0) == 2.0 && compare_max(2.0, 1.0) == 2.0);
    assert_true(compare_min(1.0, 2.0) == 1.0 && compare_min(2.0, 1.0) == 1.0);
    assert_true(compare_max(-INFINITY, -1.0) == -1.0 && compare_min(INFINITY, 1.0) == 1.0);
    assert_true(compare_max(1.0, INFINITY) == INFINITY && compare_max(5.0, 5.0) == 5.0);
    assert_true(compare_largest(N, numbers) == 9.0 && compare_largest(0, numbers) == 0.0);
    assert_true(compare_difference(N, numbers, others) == 3.0);
    assert_true(compare_difference(0, numbers, others) == 0.0);
    assert_true(compare_relative(N, numbers, others) == 3.0 / 8.0);
    assert_true(compare_finite(N, numbers) && compare_finite(0, numbers));
    for (size_t i = 0; i < N; i++) {
        sorted[i] = numbers[i];
    }
    qsort(sorted, N, sizeof *sorted, compare_order);
    for (size_t i = 1; i < N; i++) {
        assert_true(sorted[i - 1] <= sorted[i]);
    }
    assert_true(sorted[0] == -9.0 && sorted[N - 1] == 8.0);
}

/* In the first array, in the second, at every place; a NaN of either sign. */
static void a_nan_anywhere_is_the_answer(void **state)
{
    (void)state;
    for (size_t at = 0; at < 2 * N; at++) {
        double x[2 * N];
        double running[2] = {0.0, 0.0};

        for (size_t i = 0; i < 2 * N; i++) {
            x[i] = i < N ? numbers[i] : others[i - N];
        }
        x[at] = at % 2 == 0 ? (double)NAN : -(double)NAN;
        for (size_t i = 0; i < 2 * N; i++) {
            running[0] = compare_max(running[0], x[i]);
            running[1] = compare_min(x[i], running[1]);
        }
        assert_fails(running[0]);
        assert_fails(running[1]);
        assert_fails(compare_largest(2 * N, x));
        assert_fails(compare_difference(N, x, x + N));
        assert_fails(compare_relative(N, x, x + N));
        assert_false(compare_finite(2 * N, x));
        qsort(x, 2 * N, sizeof *x, compare_order);
        assert_fails(x[2 * N - 1]);
        for (size_t i = 1; i < 2 * N - 1; i++) {
            assert_true(x[i - 1] <= x[i]);
        }
    }
}

static void what_cannot_be_compared_fails(void **state)
{
    const double infinite[2] = {1.0, INFINITY};
    const double zero[2] = {0.0, 0.0};

    (void)state;
    assert_fails(compare_difference(2, infinite, infinite));
    assert_fails(compare_relative(2, zero, zero));
    assert_true(compare_relative(1, infinite, zero) == INFINITY);
    assert_false(compare_finite(2, infinite));
    assert_fails(compare_max(NAN, INFINITY));
    assert_fails(compare_min(-INFINITY, NAN));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_numbers_it_is_exact),
        cmocka_unit_test(a_nan_anywhere_is_the_answer),
        cmocka_unit_test(what_cannot_be_compared_fails),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("compare", tests, NULL, NULL);
}
