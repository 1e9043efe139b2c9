/*
 * test_half_closes.c - a client that has sent all of its request and closes its half of the
 * connection is answered, whenever its end is seen and however long the answer takes.
 *
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/http/http_fixture.h"

/* A client that has sent everything and closed its half still gets its answer, late as it is. */
static void test_half_closed_clients_are_answered(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http), waits = dial(http), status;

    (void)state;
    say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello");
    (void)shutdown(fd, SHUT_WR);
    say(waits, "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    (void)shutdown(waits, SHUT_WR);
    assert_int_equal(hear(fd, text, false, NULL), 200);
    nap(1500);
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    status = hear(waits, text, false, NULL);
    assert_int_equal(status, 200);
    (void)close(fd);
    (void)close(waits);
    http_stop(http, 5);
}

/* So does one whose bytes were read, but not looked at for a while: a thread that has to wait for a
   processor does not make a client abandoned. */
static void test_half_closed_clients_can_wait(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);

    (void)state;
    say(fd, "POST /late HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello");
    (void)shutdown(fd, SHUT_WR);
    assert_int_equal(hear(fd, text, false, NULL), 200);
    (void)close(fd);
    http_stop(http, 5);
}

/* Nor does it matter when the end of what a client sends is seen: while the request is handled, or
   before. */
static void test_half_closes_come_at_any_time(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fds[20];

    (void)state;
    for (size_t i = 0; i < 20; i++) {
        fds[i] = dial(http);
        say(fds[i], i % 2 == 0 ? "POST /wait HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello"
                               : "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
        if (i >= 10) {
            nap(10);
        }
        (void)shutdown(fds[i], SHUT_WR);
    }
    nap(100);
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    for (size_t i = 0; i < 20; i++) {
        assert_int_equal(hear(fds[i], text, false, NULL), 200);
        assert_true(closes(fds[i]));
        (void)close(fds[i]);
    }
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    http_stop(http, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_half_closed_clients_are_answered),
        cmocka_unit_test(test_half_closed_clients_can_wait),
        cmocka_unit_test(test_half_closes_come_at_any_time),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    if (sodium_init() < 0) {
        return 1;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
