/*
 * test_queue.c - the queues, without threads. Who waits in that of requests after closing its half
 * of the connection: is passed over once nothing has been free for it for a second, and not for
 * waiting on the threads themselves. In that of uploads: whose time of the threads is whose, of
 * any number of owners. Times are those that the test gives.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/internal.h"

#include "clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#define THREADS ((size_t)2) /* of which probes have one for themselves */

static void start_lanes(struct http *http)
{
    for (size_t i = 0; i < LANES; i++) {
        http->lanes[i].http = http;
        http->lanes[i].last = &http->lanes[i].first;
        assert_int_equal(pthread_cond_init(&http->lanes[i].work, NULL), 0);
    }
}

static void stop_lanes(struct http *http)
{
    for (size_t i = 0; i < LANES; i++) {
        (void)pthread_cond_destroy(&http->lanes[i].work);
    }
}

static struct exchange *queue(struct http *http, struct connection *connection,
                              struct holder *holder)
{
    struct exchange *exchange = calloc(1, sizeof *exchange);

    assert_non_null(exchange);
    exchange->http = http;
    exchange->connection = connection;
    exchange->holder = holder;
    exchange->lane = LANE_REQUESTS;
    lane_enqueue(http, exchange);
    return exchange;
}

static void test_half_closed_requests_wait_for_threads(void **state)
{
    static struct http service;
    struct http *http = &service;
    struct lane *lane = &http->lanes[LANE_REQUESTS];
    struct holder holder = {.references = 1};
    struct connection open = {.http = http}, half = {.http = http};
    struct exchange *before, *waits;
    int first[2], second[2];
    (void)state;

    start_lanes(http);
    lane->n_threads = THREADS;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, first), 0);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, second), 0);
    open.fd = first[0];
    half.fd = second[0];
    before = queue(http, &open, &holder);
    waits = queue(http, &half, &holder);
    assert_int_equal(shutdown(second[1], SHUT_WR), 0);

    lane_look(http, 100.0); /* no thread has had a processor yet */
    lane_look(http, 101.5);
    assert_false(atomic_load(&waits->gone));
    assert_ptr_equal(lane_take(http, lane, 1), before);
    lane_look(http, 101.6); /* from now on it waits for another request */
    assert_false(atomic_load(&waits->gone));
    lane_look(http, 102.5);
    assert_false(atomic_load(&waits->gone));
    lane_look(http, 102.7);
    assert_true(atomic_load(&waits->gone));
    assert_false(atomic_load(&before->gone));
    assert_ptr_equal(lane_take(http, lane, 0), waits);

    stop_lanes(http);
    for (size_t i = 0; i < 2; i++) {
        (void)close(first[i]);
        (void)close(second[i]);
    }
    free(before);
    free(waits);
}

#define OWNERS 1000

/* A daemon that never listens, with the connections and uploads of OWNERS names. */
struct crowd {
    struct http http;
    struct lane *lane;
    struct connection connections[OWNERS];
    struct exchange uploads[OWNERS];
};

static struct crowd *gather(void)
{
    struct crowd *crowd = calloc(1, sizeof *crowd);

    assert_non_null(crowd);
    start_lanes(&crowd->http);
    assert_int_equal(pthread_mutex_init(&crowd->http.mutex, NULL), 0);
    crowd->http.holders_seed = UINT64_C(0x9e3779b97f4a7c15);
    crowd->lane = &crowd->http.lanes[LANE_UPLOADS];
    crowd->lane->n_threads = THREADS;
    for (size_t i = 0; i < OWNERS; i++) {
        char name[16];

        (void)snprintf(name, sizeof name, "lab-%zu", i);
        crowd->connections[i].http = &crowd->http;
        assert_true(shares_set_owner(&crowd->connections[i], name));
        crowd->uploads[i].http = &crowd->http;
        crowd->uploads[i].holder = crowd->connections[i].owner;
        crowd->uploads[i].lane = LANE_UPLOADS;
    }
    return crowd;
}

static void scatter(struct crowd *crowd)
{
    for (size_t i = 0; i < OWNERS; i++) {
        shares_drop(&crowd->http, crowd->connections[i].owner);
    }
    (void)pthread_mutex_destroy(&crowd->http.mutex);
    stop_lanes(&crowd->http);
    free(crowd);
}

/* The owner has the thread for so long. */
static void spend(struct crowd *crowd, size_t owner, double seconds)
{
    lane_enqueue(&crowd->http, &crowd->uploads[owner]);
    assert_ptr_equal(lane_take(&crowd->http, crowd->lane, 1), &crowd->uploads[owner]);
    crowd->lane->since[1] = clock_now() - seconds;
    lane_leave(&crowd->http, crowd->lane, 1);
}

/* Which of two goes first, when the first one was queued first; neither keeps the thread. */
static size_t first_of(struct crowd *crowd, size_t one, size_t other)
{
    const struct exchange *first, *second;

    lane_enqueue(&crowd->http, &crowd->uploads[one]);
    lane_enqueue(&crowd->http, &crowd->uploads[other]);
    first = lane_take(&crowd->http, crowd->lane, 1);
    lane_leave(&crowd->http, crowd->lane, 1);
    second = lane_take(&crowd->http, crowd->lane, 1);
    lane_leave(&crowd->http, crowd->lane, 1);
    assert_non_null(first);
    assert_non_null(second);
    assert_ptr_not_equal(first, second);
    return (size_t)(first - crowd->uploads);
}

/* Who has had nothing goes before who has had a minute, whatever their names are. */
static void test_time_is_not_taken_for_anothers(void **state)
{
    struct crowd *crowd = gather();
    (void)state;

    spend(crowd, 0, 60.0);
    for (size_t i = 1; i < OWNERS; i++) {
        assert_int_equal(first_of(crowd, 0, i), i);
    }
    scatter(crowd);
}

/* Also when many others have had a little since. */
static void test_long_times_are_kept(void **state)
{
    struct crowd *crowd = gather();
    (void)state;

    spend(crowd, 0, 60.0);
    for (size_t i = 1; i < OWNERS - 1; i++) {
        spend(crowd, i, 0.2);
    }
    assert_int_equal(first_of(crowd, 0, OWNERS - 1), OWNERS - 1);
    assert_int_equal(first_of(crowd, 0, 1), 1);
    scatter(crowd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_half_closed_requests_wait_for_threads),
        cmocka_unit_test(test_time_is_not_taken_for_anothers),
        cmocka_unit_test(test_long_times_are_kept),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
