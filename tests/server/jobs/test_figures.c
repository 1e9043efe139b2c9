/*
 * test_figures.c - numbers that jobs keep for each other: found by their digest alone, to the last
 * bit, the latest of them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "../store/fixture.h"
#include "jobs/internal.h"

struct world {
    struct fixture *fixture;
    struct jobs *jobs;
};

static int setup(void **state)
{
    static const struct jobs_process none[] = {{NULL, NULL, NULL}};
    struct world *world = calloc(1, sizeof *world);
    struct jobs_config config = {.workers = 1, .table = none};
    void *fixture;

    fixture_setup(&fixture);
    world->fixture = fixture;
    config.store = world->fixture->store;
    assert_int_equal(jobs_open(&world->jobs, &config), JOBS_OK);
    *state = world;
    return 0;
}

static int teardown(void **state)
{
    struct world *world = *state;
    void *fixture = world->fixture;

    jobs_close(world->jobs, 1.0);
    fixture_teardown(&fixture);
    free(world);
    return 0;
}

static void name(size_t number, char digest[65])
{
    (void)snprintf(digest, 65, "%064zx", number);
}

static void keep(struct jobs *jobs, size_t number, double value)
{
    const double values[JOBS_FIGURES] = {value, -0.0, INFINITY, 1.0 / 3.0, 5e-324, (double)number};
    char digest[65];

    name(number, digest);
    jobs_figures_keep(jobs, digest, values);
}

/* Whether the numbers kept as such are there with that value, and the others as they were given. */
static bool has(struct jobs *jobs, size_t number, double value)
{
    const double wanted[JOBS_FIGURES] = {value, -0.0, INFINITY, 1.0 / 3.0, 5e-324, (double)number};
    double values[JOBS_FIGURES] = {0.0};
    char digest[65];

    name(number, digest);
    return jobs_figures_find(jobs, digest, values) && memcmp(values, wanted, sizeof wanted) == 0;
}

static void test_found_by_digest(void **state)
{
    struct jobs *jobs = ((struct world *)*state)->jobs;
    double values[JOBS_FIGURES] = {7.0};
    char digest[65];

    name(1, digest);
    assert_false(jobs_figures_find(jobs, digest, values));
    assert_true(values[0] == 7.0);
    keep(jobs, 1, 0.1);
    keep(jobs, 2, 0.2);
    assert_true(has(jobs, 1, 0.1));
    assert_true(has(jobs, 2, 0.2));
    name(3, digest);
    assert_false(jobs_figures_find(jobs, digest, values));
    digest[0] = '1'; /* differs from what is there in its first digit */
    digest[63] = '1';
    assert_false(jobs_figures_find(jobs, digest, values));
    digest[0] = '\0'; /* as an empty place */
    assert_false(jobs_figures_find(jobs, digest, values));
}

static void test_oldest_leaves(void **state)
{
    struct jobs *jobs = ((struct world *)*state)->jobs;

    for (size_t i = 1; i <= JOBS_FIGURES_KEPT; i++) {
        keep(jobs, i, (double)i);
    }
    keep(jobs, JOBS_FIGURES_KEPT, (double)JOBS_FIGURES_KEPT); /* again: takes no second place */
    assert_true(has(jobs, 1, 1.0));
    keep(jobs, JOBS_FIGURES_KEPT + 1, 0.5);
    assert_false(has(jobs, 1, 1.0));
    assert_true(has(jobs, 2, 2.0));
    assert_true(has(jobs, JOBS_FIGURES_KEPT, (double)JOBS_FIGURES_KEPT));
    assert_true(has(jobs, JOBS_FIGURES_KEPT + 1, 0.5));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_found_by_digest, setup, teardown),
        cmocka_unit_test_setup_teardown(test_oldest_leaves, setup, teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
