/*
 * test_sizes.c - sizes that fall into two classes, and those that vary; covariates that give labels
 * away, and those that do not.
 */
#include <math.h>

#include "support/random.h"
#include "toolkit/giveaways.h"
#include "toolkit/sizes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define SETS ((size_t)20000)

static void another_unit_makes_two_classes(void **state)
{
    double one[] = {41.0, 4.2, 55.0, 38.0, 61.0};
    double half[] = {0.041, 39.0, 0.055, 44.0, 0.038, 52.0};
    double pair[] = {41.0, 4.1};
    double varied[] = {2.0, 5.0, 11.0, 24.0, 60.0, 240.0};
    double loose[] = {1.0, 5.5, 12.0, 40.0, 190.0};
    double ratio = 0.0;

    (void)state;
    assert_int_equal(sizes_split(5, one, &ratio), 1);
    assert_true(fabs(ratio - 48.0 / 4.2) < 1e-12);
    assert_int_equal(sizes_split(6, half, &ratio), 3);
    assert_true(ratio > 1000.0 && ratio < 1200.0);
    assert_int_equal(sizes_split(2, pair, &ratio), 0);
    assert_int_equal(sizes_split(6, varied, &ratio), 0);
    assert_int_equal(sizes_split(5, loose, &ratio), 0);
}

/* Bodies that vary by a factor of 1.6, more than organs do, are of one class: of groups of 4 to 40
   less than one in a thousand is told of. */
static void what_varies_is_one_class(void **state)
{
    struct test_random random = test_random_seed(3);
    size_t told = 0;

    (void)state;
    for (size_t set = 0; set < SETS; set++) {
        double sizes[40], ratio;
        size_t n = 4 + set % 37;

        for (size_t i = 0; i < n; i++) {
            sizes[i] = exp(log(1.6) * test_random_normal(&random));
        }
        told += sizes_split(n, sizes, &ratio) > 0;
    }
    printf("# of %zu groups %zu are told of\n", SETS, told);
    assert_true(told < SETS / 1000);
}

static bool find(size_t n, const double *values, const size_t *labels)
{
    struct giveaway pairs[64];

    for (size_t i = 0; i < n; i++) {
        pairs[i] = (struct giveaway){values[i], labels[i]};
    }
    return giveaways_find(n, pairs, 2);
}

static void labels_are_given_away(void **state)
{
    const size_t labels[] = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
    const double same[] = {1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2};
    const double ranges[] = {1, 20, 2, 21, 3, 22, 4, 23, 5, 24, 6, 25, 7, 26};
    const double each[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
    const double but_one[] = {1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 2, 2};
    const double constant[14] = {0};

    (void)state;
    assert_true(find(14, same, labels));
    assert_true(find(14, ranges, labels));
    assert_false(find(14, each, labels));
    assert_false(find(14, but_one, labels));
    assert_false(find(14, constant, labels));
    assert_false(find(6, same, labels)); /* 2 of 20 ways: it may well be chance */
}

/* A covariate that has nothing to do with labels gives them away less than once in a thousand. */
static void chance_gives_nothing_away(void **state)
{
    struct test_random random = test_random_seed(4);
    size_t told = 0;

    (void)state;
    for (size_t set = 0; set < SETS; set++) {
        struct giveaway pairs[30];
        size_t n = 4 + set % 27, steps = 2 + set % 5;

        for (size_t i = 0; i < n; i++) {
            double z = test_random_normal(&random);

            pairs[i] = (struct giveaway){set % 2 ? z : floor(z * (double)steps), i % 3 == 0};
        }
        told += giveaways_find(n, pairs, 2);
    }
    printf("# of %zu covariates %zu are told of\n", SETS, told);
    assert_true(told < SETS / 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(another_unit_makes_two_classes),
        cmocka_unit_test(what_varies_is_one_class),
        cmocka_unit_test(labels_are_given_away),
        cmocka_unit_test(chance_gives_nothing_away),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
