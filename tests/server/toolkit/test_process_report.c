/*
 * test_process_report.c - what a report is of: jobs by their ids or those of a cohort, its title,
 * and what is refused by name.
 */
#include "server/toolkit/process_fixture.h"

static void test_jobs(void **state)
{
    struct fixture *fixture = *state;

    refused(fixture, "report", "{}", "/inputs/jobs");
    refused(fixture, "report", "{\"jobs\":[]}", "/inputs/jobs");
    refused(fixture, "report", "{\"jobs\":\"" DONE_JOB "\"}", "/inputs/jobs");
    refused(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\",\"job-1\"]}", "/inputs/jobs/1");
    refused(fixture, "report", "{\"jobs\":[\"" GOOD_MESH "\"]}", "/inputs/jobs/0");
    refused(fixture, "report", "{\"jobs\":[\"" WAITING_JOB "\"]}", "/inputs/jobs/0");
    refused(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\"],\"cohort\":\"group\"}",
            "/inputs/cohort");
    answered(fixture, "report", "{\"jobs\":[\"" ABSENT_JOB "\"]}", 404, "no-such-job");
}

/* The jobs of a cohort are settled when the report is asked for. */
static void test_cohort(void **state)
{
    struct fixture *fixture = *state;
    struct outcome outcome = canonicalize_text(fixture, "report", "{\"cohort\":\"group\"}");
    const json_t *cohort = json_object_get(outcome.canonical, "cohort");
    const json_t *jobs = json_object_get(cohort, "jobs");

    assert_int_equal(json_array_size(jobs), 1);
    assert_string_equal(json_string_value(json_array_get(jobs, 0)), DONE_JOB);
    assert_string_equal(json_string_value(json_object_get(outcome.canonical, "title")), "group");
    assert_true(outcome.seconds > 0.2);
    outcome_clear(&outcome);
    refused(fixture, "report", "{\"cohort\":\"patients\"}", "/inputs/cohort");
    answered(fixture, "report", "{\"cohort\":\"nobody\"}", 404, "no-such-cohort");
}

static void test_title(void **state)
{
    struct fixture *fixture = *state;

    same(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\"]}",
         "{\"jobs\":[\"" DONE_JOB "\"],\"title\":\"Report\",\"modes\":3,\"cohort\":null}");
    refused(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\"],\"title\":\"\"}", "/inputs/title");
    refused(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\"],\"title\":\"a\\u0007b\"}",
            "/inputs/title");
    refused(fixture, "report", "{\"jobs\":[\"" DONE_JOB "\"],\"title\":7}", "/inputs/title");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_jobs),
        cmocka_unit_test(test_cohort),
        cmocka_unit_test(test_title),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
