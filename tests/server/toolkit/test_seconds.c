/*
 * test_seconds.c - which jobs are expected to be short enough for the express lane: what is short
 * is, and what can take much longer for surfaces of any kind is not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shots_that_go_far_are_long),
        cmocka_unit_test(ordinary_shots_are_short),
        cmocka_unit_test(shots_in_the_other_metric_are_long),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
