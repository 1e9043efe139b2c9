/*
 * test_seconds.c - which jobs are expected to be short enough for the express lane: what is short
 * is, and what can take much longer for surfaces of any kind is not. And how many like things make
 * a task.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "compute/seconds.h"
#include "jobs/jobs.h"
#include "toolkit/seconds.h"

/* Between two surfaces of a degree. */
static double expected(process_seconds *seconds, long degree, const char *inputs)
{
    const struct api_work work = {.surfaces = 2, .degree = degree};
    json_t *object = json_loads(inputs, 0, NULL);
    double answer;

    assert_non_null(object);
    answer = seconds(&work, object);
    json_decref(object);
    return answer;
}

/* Rough surfaces took 7 to 12 s at degree 63, and 1.5 s at 31. */
static void shots_that_go_far_are_long(void **state)
{
    static const char *const far[] = {
        "{\"velocity\":{\"toward\":\"s\"},\"times\":[10],\"register\":false}",
        "{\"velocity\":{\"toward\":\"s\"},\"times\":[-10],\"register\":false}",
        "{\"velocity\":{\"coefficients\":{}},\"times\":[0.5],\"register\":false}",
    };

    (void)state;
    for (size_t i = 0; i < sizeof far / sizeof far[0]; i++) {
        assert_true(expected(shoot_seconds, 31, far[i]) > JOBS_EXPRESS_SECONDS);
        assert_true(expected(shoot_seconds, 63, far[i]) > 5.0);
    }
}

static void ordinary_shots_are_short(void **state)
{
    (void)state;
    assert_true(expected(shoot_seconds, 15,
                         "{\"velocity\":{\"toward\":\"s\"},\"times\":[0,0.25,0.5,0.75,1],"
                         "\"register\":false}") <= JOBS_EXPRESS_SECONDS);
}

/* Each shot is a path of its own, and the velocity is another. */
static void shots_in_the_other_metric_are_long(void **state)
{
    (void)state;
    assert_true(expected(shoot_seconds, 8,
                         "{\"velocity\":{\"toward\":\"s\"},\"times\":[1],\"register\":false,"
                         "\"method\":\"pullback\"}") > JOBS_EXPRESS_SECONDS);
}

/* 4,950 pairs of ventricles took 0.05 s each at degree 15, of brain structures 0.17 s. */
static void tasks_take_about_a_second(void **state)
{
    size_t block = seconds_block(seconds_of_pair(15.0, true), 4950, 64);

    (void)state;
    assert_in_range(block, 4, 12);
    assert_in_range(seconds_block(seconds_of_registration(15.0), 10000, 64), 5, 12);
    assert_int_equal(seconds_block(seconds_of_pair(127.0, true), 4950, 64), 1);
}

static void workers_have_tasks_to_share(void **state)
{
    (void)state;
    assert_int_equal(seconds_block(0.01, 0, 64), 1);
    assert_int_equal(seconds_block(0.01, 66, 64), 1);
    assert_int_equal(seconds_block(0.01, 190, 64), 2);
    assert_int_equal(seconds_block(0.01, 1000000, 64), 64);
    assert_int_equal(seconds_block(0.1, 1000000, 64), 10);
}

/* Of 12 subcortical structures at degree 15 all pairs took 2 s by closest points, of 100 ventricles
   84; by coefficients 0.1 s. */
static void pairs_by_closest_points_are_long(void **state)
{
    (void)state;
    assert_true(seconds_of_folds(SRNF_METRIC_ICP, 12.0, 15.0) > JOBS_EXPRESS_SECONDS);
    assert_true(seconds_of_folds(SRNF_METRIC_ICP, 100.0, 15.0) > 40.0);
    assert_true(seconds_of_folds(SRNF_METRIC_ICP, 100.0, 15.0) < 170.0);
    assert_true(seconds_of_folds(SRNF_METRIC_HARMONIC, 100.0, 15.0) < JOBS_EXPRESS_SECONDS);
    assert_true(seconds_of_folds(SRNF_METRIC_SPHARM, 100.0, 15.0) < JOBS_EXPRESS_SECONDS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shots_that_go_far_are_long),
        cmocka_unit_test(ordinary_shots_are_short),
        cmocka_unit_test(shots_in_the_other_metric_are_long),
        cmocka_unit_test(tasks_take_about_a_second),
        cmocka_unit_test(pairs_by_closest_points_are_long),
        cmocka_unit_test(workers_have_tasks_to_share),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
