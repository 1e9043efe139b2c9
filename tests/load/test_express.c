/*
 * srnfd-test: alone
 * srnfd-test: release-only
 * srnfd-test: timeout 600
 *
 * test_express.c - short jobs beside long ones: how long an encode takes, from the request to its
 * results, while two workers are held by `distances` of many surfaces and a third such job waits;
 * and once more with a job on the express lane that was expected to be short and takes minutes.
 *
 * SRNFD_LOAD=full (make load) asks 200 times and holds what is promised, a median below 0.5 s and a
 * 99th percentile below 2 s. Without it there are 20, and the bounds are wide, so that a busy
 * machine does not fail it; a job that waits for the long ones takes minutes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/wire.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MESHES 12
#define REPEATS 8 /* of each mesh in a long job's list: none may end before the last ask */
#define LONG_JOBS 3
#define ASKS_MAX 200
#define MISJUDGED 300 /* surfaces: 44,850 pairs by icp, which cost more than expected */

static const char json_fields[] = "Content-Type: application/json\r\n";
static struct daemon service;
static char meshes[MESHES][80];
static char long_jobs[LONG_JOBS + 1][80];

static void upload(size_t i)
{
    static const char *const names[] = {"amygdala", "caudate", "hippocampus",
                                        "pallidum", "putamen", "thalamus"};
    static char content[200000];
    struct answer answer;
    char path[100];
    FILE *file;
    size_t size;

    (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%c_%s.ply", i % 2 ? 'R' : 'L',
                   names[i / 2]);
    file = fopen(path, "rb");
    assert_non_null(file);
    size = fread(content, 1, sizeof content, file);
    (void)fclose(file);
    assert_int_equal(
        daemon_request(&service, "POST", "/v1/meshes?format=ply", "", content, size, &answer), 201);
    answer_member(&answer, "id", meshes[i], sizeof meshes[i]);
    answer_clear(&answer);
}

/* Distances of so many of the meshes, each REPEATS times: many minutes at degree 31. */
static void start_long(size_t number, size_t n)
{
    char body[REPEATS * MESHES * 80 + 100] = "{\"inputs\":{\"surfaces\":[", fields[120];
    struct answer answer;

    for (size_t i = 0; i < REPEATS * n; i++) {
        size_t used = strlen(body);

        (void)snprintf(body + used, sizeof body - used, "%s\"%s\"", i ? "," : "", meshes[i % n]);
    }
    (void)strncat(body, "]}}", sizeof body - strlen(body) - 1);
    (void)snprintf(fields, sizeof fields, "%sPrefer: respond-async\r\n", json_fields);
    assert_int_equal(daemon_request(&service, "POST", "/v1/processes/distances/execution", fields,
                                    body, strlen(body), &answer),
                     201);
    answer_member(&answer, "id", long_jobs[number], sizeof long_jobs[number]);
    answer_clear(&answer);
}

/* Distances by icp of one surface many times over, expected to take 0.7 s. */
static void start_misjudged(void)
{
    static char body[MISJUDGED * 80 + 200];
    char surface[80], fields[120];
    struct answer answer;
    json_t *document;

    (void)snprintf(body, sizeof body,
                   "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":4,\"smoothing\":0.01}}", meshes[0]);
    assert_int_equal(daemon_request(&service, "POST", "/v1/processes/encode/execution", json_fields,
                                    body, strlen(body), &answer),
                     200);
    document = json_loads(answer.body, 0, NULL);
    (void)snprintf(surface, sizeof surface, "%s",
                   json_string_value(json_object_get(json_object_get(document, "surface"), "id")));
    json_decref(document);
    answer_clear(&answer);
    (void)snprintf(body, sizeof body,
                   "{\"inputs\":{\"metric\":\"icp\",\"register\":false,\"surfaces\":[");
    for (size_t i = 0; i < MISJUDGED; i++) {
        size_t used = strlen(body);

        (void)snprintf(body + used, sizeof body - used, "%s\"%s\"", i ? "," : "", surface);
    }
    (void)strncat(body, "]}}", sizeof body - strlen(body) - 1);
    (void)snprintf(fields, sizeof fields, "%sPrefer: respond-async\r\n", json_fields);
    assert_int_equal(daemon_request(&service, "POST", "/v1/processes/distances/execution", fields,
                                    body, strlen(body), &answer),
                     201);
    answer_member(&answer, "id", long_jobs[LONG_JOBS], sizeof long_jobs[LONG_JOBS]);
    answer_clear(&answer);
}

static size_t count_long(const char *status)
{
    struct answer answer;
    char path[80];
    json_t *page;
    size_t count;

    (void)snprintf(path, sizeof path, "/v1/jobs?process=distances&status=%s", status);
    assert_int_equal(daemon_request(&service, "GET", path, "", "", 0, &answer), 200);
    page = json_loads(answer.body, 0, NULL);
    count = json_array_size(json_object_get(page, "jobs"));
    json_decref(page);
    answer_clear(&answer);
    return count;
}

static int set_up(void **state)
{
    static const char *const options[] = {"--workers", "2", "--grace-seconds", "1", "--access-log",
                                          "refusals",  NULL};

    (void)state;
    if (!wire_start(&service, options)) {
        return -1;
    }
    for (size_t i = 0; i < MESHES; i++) {
        upload(i);
    }
    for (size_t i = 0; i < LONG_JOBS; i++) {
        start_long(i, MESHES - i);
    }
    return 0;
}

static int tear_down(void **state)
{
    struct answer answer;
    char path[sizeof long_jobs + 40];

    (void)state;
    for (size_t i = 0; i <= LONG_JOBS && long_jobs[i][0]; i++) {
        (void)snprintf(path, sizeof path, "/v1/jobs/%s/cancel", long_jobs[i]);
        (void)daemon_request(&service, "POST", path, "", "", 0, &answer);
        answer_clear(&answer);
    }
    return wire_stop(&service);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* Seconds of one encode, no two of which are the same. */
static double encode(size_t number)
{
    struct answer answer;
    char body[200];
    double start = wire_now();

    (void)snprintf(body, sizeof body,
                   "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":31,\"smoothing\":%.9f}}",
                   meshes[number % MESHES], 1e-6 * (double)(1 + number));
    assert_int_equal(daemon_request(&service, "POST", "/v1/processes/encode/execution", json_fields,
                                    body, strlen(body), &answer),
                     200);
    answer_clear(&answer);
    return wire_now() - start;
}

/* With so many long jobs that run. */
static void measure(size_t running, size_t first, const char *what)
{
    const char *wanted = getenv("SRNFD_LOAD");
    bool full = wanted && strcmp(wanted, "full") == 0;
    size_t asks = full ? ASKS_MAX : ASKS_MAX / 10;
    double seconds[ASKS_MAX], end = wire_now() + WIRE_PATIENCE;

    while (count_long("running") < running) {
        assert_true(wire_now() < end);
        wire_nap(0.1);
    }
    for (size_t i = 0; i < asks; i++) {
        seconds[i] = encode(first + i);
    }
    /* The long jobs were there all the time. */
    assert_int_equal(count_long("running"), running);
    assert_int_equal(count_long("accepted"), 1);
    qsort(seconds, asks, sizeof *seconds, ascending);
    print_message("encode beside %d distances on two workers%s: median %.3f s, p99 %.3f s, "
                  "slowest %.3f s of %zu\n",
                  LONG_JOBS, what, seconds[asks / 2], seconds[asks * 99 / 100], seconds[asks - 1],
                  asks);
    assert_true(seconds[asks / 2] < (full ? 0.5 : 3.0));
    assert_true(seconds[asks * 99 / 100] < (full ? 2.0 : 15.0));
}

static void test_short_jobs_do_not_wait_for_long_ones(void **state)
{
    (void)state;
    measure(2, 0, "");
}

static void test_nor_for_a_misjudged_one(void **state)
{
    (void)state;
    start_misjudged();
    measure(3, ASKS_MAX, " and a misjudged job");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_short_jobs_do_not_wait_for_long_ones),
        cmocka_unit_test(test_nor_for_a_misjudged_one),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
