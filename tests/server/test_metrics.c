/*
 * test_metrics.c - what is counted is what /metrics says: by name, by a series that was looked up
 * once, and by a counter that is watched.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "metrics.h"

static struct metrics *metrics;

static int set_up(void **state)
{
    (void)state;
    metrics = metrics_create();
    return metrics ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    metrics_destroy(metrics);
    return 0;
}

/* Whether /metrics has the line, given with its end. */
static bool tells(const char *line)
{
    size_t size = 0;
    char *text = metrics_text(&metrics, 1, &size);
    const char *found = text ? strstr(text, line) : NULL;
    bool told = found && (found == text || found[-1] == '\n');

    free(text);
    return told;
}

static void series_count_like_names(void **state)
{
    const char *const *labels = METRIC_LABELS("/healthz", "GET", "200");
    struct series *series = metrics_series(metrics, METRIC_HTTP_REQUESTS, labels);

    (void)state;
    assert_non_null(series);
    series_add(series, 2);
    metrics_add(metrics, METRIC_HTTP_REQUESTS, labels, 3);
    metrics_add(metrics, METRIC_HTTP_REQUESTS, METRIC_LABELS("/healthz", "GET", "503"), 1);
    assert_ptr_equal(series, metrics_series(metrics, METRIC_HTTP_REQUESTS, labels));
    assert_true(tells("srnfd_http_requests_total{route=\"/healthz\",method=\"GET\","
                      "status=\"200\"} 5\n"));
    assert_true(tells("srnfd_http_requests_total{route=\"/healthz\",method=\"GET\","
                      "status=\"503\"} 1\n"));
    series_add(NULL, 1);
    assert_null(metrics_series(NULL, METRIC_HTTP_REQUESTS, labels));
}

static void observations_fall_into_their_buckets(void **state)
{
    const char *const *labels = METRIC_LABELS("/x");
    struct series *series = metrics_series(metrics, METRIC_HTTP_SECONDS, labels);

    (void)state;
    series_observe(series, METRIC_HTTP_SECONDS, 0.0005); /* a bound belongs to its bucket */
    metrics_observe(metrics, METRIC_HTTP_SECONDS, labels, 0.002);
    series_observe(series, METRIC_HTTP_SECONDS, 31);
    series_observe(NULL, METRIC_HTTP_SECONDS, 1);
    assert_true(
        tells("srnfd_http_request_duration_seconds_bucket{route=\"/x\",le=\"0.0005\"} 1\n"));
    assert_true(tells("srnfd_http_request_duration_seconds_bucket{route=\"/x\",le=\"0.001\"} 1\n"));
    assert_true(
        tells("srnfd_http_request_duration_seconds_bucket{route=\"/x\",le=\"0.0025\"} 2\n"));
    assert_true(tells("srnfd_http_request_duration_seconds_bucket{route=\"/x\",le=\"30\"} 2\n"));
    assert_true(tells("srnfd_http_request_duration_seconds_bucket{route=\"/x\",le=\"+Inf\"} 3\n"));
    assert_true(metrics_value(metrics, METRIC_HTTP_SECONDS, labels) == 3);
    /* A gauge has no buckets. */
    series_observe(metrics_series(metrics, METRIC_WORKERS, NULL), METRIC_WORKERS, 1);
    assert_true(metrics_value(metrics, METRIC_WORKERS, NULL) == 0);
}

static void watched_counters_are_read_when_asked_for(void **state)
{
    atomic_size_t counter = 2;

    (void)state;
    metrics_watch(metrics, METRIC_HTTP_IN_PROGRESS, &counter);
    assert_true(tells("srnfd_http_requests_in_progress 2\n"));
    counter = 7;
    assert_true(tells("srnfd_http_requests_in_progress 7\n"));
    assert_true(metrics_value(metrics, METRIC_HTTP_IN_PROGRESS, NULL) == 7);
    metrics_watch(metrics, METRIC_HTTP_IN_PROGRESS, NULL);
    counter = 9;
    assert_true(tells("srnfd_http_requests_in_progress 7\n"));
    metrics_watch(NULL, METRIC_HTTP_IN_PROGRESS, &counter);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(series_count_like_names, set_up, tear_down),
        cmocka_unit_test_setup_teardown(observations_fall_into_their_buckets, set_up, tear_down),
        cmocka_unit_test_setup_teardown(watched_counters_are_read_when_asked_for, set_up,
                                        tear_down),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
