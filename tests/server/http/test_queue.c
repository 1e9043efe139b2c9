/*
 * test_queue.c - who waits in the queue of requests after closing its half of the connection: is
 * passed over once nothing has been free for it for a second, and not for waiting on the threads
 * themselves. Times are those that the test gives.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/internal.h"

#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#define THREADS ((size_t)2) /* of which probes have one for themselves */

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

    for (size_t i = 0; i < LANES; i++) {
        http->lanes[i].http = http;
        http->lanes[i].last = &http->lanes[i].first;
        assert_int_equal(pthread_cond_init(&http->lanes[i].work, NULL), 0);
    }
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

    for (size_t i = 0; i < LANES; i++) {
        (void)pthread_cond_destroy(&http->lanes[i].work);
    }
    for (size_t i = 0; i < 2; i++) {
        (void)close(first[i]);
        (void)close(second[i]);
    }
    free(before);
    free(waits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_half_closed_requests_wait_for_threads),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
