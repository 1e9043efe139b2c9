/*
 * test_http.c - the listening side against an api layer made for the test: shapes of requests,
 * limits, deadlines, request threads, waiting for jobs, stopping. Clients are raw sockets, because
 * most of what is tried no HTTP library would send.
 * srnfd-test: slow
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/http/http_fixture.h"

/* ---- Tests
   -----------------------------------------------------------------------------------------------
 */

static void test_answers_carry_id_and_timing(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);

    (void)state;
    for (int i = 0; i < 3; i++) {
        say(fd, "GET /quick?a=1 HTTP/1.1\r\nHost: x\r\nX-Request-Id: abc.1\r\n\r\n");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        assert_non_null(strstr(text, "X-Request-Id: abc.1\r\n"));
        assert_non_null(strstr(text, "Server-Timing: total;dur="));
        assert_non_null(strstr(text, "path=/quick query=a=1"));
    }
    say(fd, "HEAD /quick HTTP/1.1\r\nHost: x\r\nX-Request-Id: a\"b\r\n\r\n");
    assert_int_equal(hear(fd, text, true, NULL), 200);
    assert_null(strstr(text, "a\"b"));
    assert_non_null(strstr(text, "X-Request-Id: req-"));
    assert_string_equal(strstr(text, "\r\n\r\n"), "\r\n\r\n");
    (void)close(fd);
    http_stop(http, 5);
}

static void test_ambiguous_requests_are_refused(void **state)
{
    static const char *const requests[] = {
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n"
        "0\r\n\r\n",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\nhello!",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nContent-Length: 5\r\n\r\nhello",
        "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
        "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: "
        "chunked\r\n\r\n0\r\n\r\n",
        "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: identity\r\n\r\nhello",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: +5\r\n\r\nhello",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5, 5\r\n\r\nhello",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length : 5\r\n\r\nhello",
        "GET /x HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n",
        "GET /x HTTP/1.1\r\n\r\n",
        "GET /x%00y HTTP/1.1\r\nHost: x\r\n\r\n",
        "GET /x%2fy HTTP/1.1\r\nHost: x\r\n\r\n",
        "GET /x%zz HTTP/1.1\r\nHost: x\r\n\r\n",
        "GET /x% HTTP/1.1\r\nHost: x\r\n\r\n",
        "GET x HTTP/1.1\r\nHost: x\r\n\r\n",
    };
    struct http *http = serve((struct http_config){0});

    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        int fd = dial(http), status;

        say(fd, requests[i]);
        status = hear(fd, text, false, NULL);
        if (status != 400) {
            print_message("request %zu answered %d\n", i, status);
        }
        assert_int_equal(status, 400);
        assert_true(closes(fd));
        (void)close(fd);
    }
    assert_int_equal(atomic_load(&fake.handled), 0);
    assert_int_equal(ask(http, "GET /a%20b HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_non_null(strstr(text, "path=/a b"));
    assert_int_equal(ask(http, "GET http://x/abs?q HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_non_null(strstr(text, "path=/abs query=q"));
    http_stop(http, 5);
}

static void test_oversized_heads_are_refused(void **state)
{
    struct http *http = serve((struct http_config){0});
    size_t size = 40000;
    char *request = malloc(size + 200);
    size_t used;

    (void)state;
    assert_non_null(request);
    used = (size_t)snprintf(request, 100, "GET /quick HTTP/1.1\r\nHost: x\r\nX-Long: ");
    memset(request + used, 'a', size - used);
    memcpy(request + size, "\r\n\r\n", 5);
    assert_int_equal(ask(http, request), 431);
    used = (size_t)snprintf(request, 100, "GET /");
    memset(request + used, 'a', size - used);
    (void)snprintf(request + size, 100, " HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(ask(http, request), 414);
    free(request);
    http_stop(http, 5);
}

/* Sends count chunks of 1000 bytes, and their end. */
static void say_chunks(int fd, size_t count)
{
    char chunk[1010];

    memcpy(chunk, "3e8\r\n", 5);
    memset(chunk + 5, 1, 1000);
    memcpy(chunk + 1005, "\r\n", 3);
    for (size_t i = 0; i < count; i++) {
        say(fd, chunk);
    }
    say(fd, "0\r\n\r\n");
}

static void test_bodies_arrive_whole_or_not_at_all(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);

    (void)state;
    say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
    say_chunks(fd, 100);
    assert_int_equal(hear(fd, text, false, NULL), 200);
    assert_non_null(strstr(text, "size=100000 sum=100000"));
    say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
    say_chunks(fd, 101);
    assert_int_equal(hear(fd, text, false, NULL), 413);
    assert_true(closes(fd));
    (void)close(fd);
    assert_int_equal(ask(http, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\n\r\n\1\1\1\1"),
                     200);
    assert_non_null(strstr(text, "size=4 sum=4"));
    assert_int_equal(ask(http, "POST /x HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\n"
                               "Content-Length: 100001\r\n\r\n"),
                     413);
    http_stop(http, 5);
}

static void test_all_bodies_together_are_bounded(void **state)
{
    struct http *http = serve((struct http_config){.max_buffered = 70000});
    int first = dial(http), second = dial(http);

    (void)state;
    say(first, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 90000\r\n\r\nhello");
    nap(200);
    say(second, "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
    say_chunks(second, 1);
    assert_int_equal(hear(second, text, false, NULL), 503);
    (void)close(first);
    nap(200);
    (void)close(second);
    second = dial(http);
    say(second, "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
    say_chunks(second, 1);
    assert_int_equal(hear(second, text, false, NULL), 200);
    (void)close(second);
    http_stop(http, 5);
}

static void test_slow_routes_run_on_request_threads(void **state)
{
    struct http *http = serve((struct http_config){0});

    (void)state;
    assert_int_equal(ask(http, "GET /slow HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_int_equal(atomic_load(&fake.on_request_thread), 1);
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_int_equal(atomic_load(&fake.on_request_thread), 0);
    http_stop(http, 5);
}

static double counted(struct metrics *metrics, const char *method, const char *status)
{
    return metrics_value(metrics, METRIC_HTTP_REQUESTS, METRIC_LABELS("none", method, status));
}

/* A connection remembers where its last request was counted: other ones go elsewhere. */
static void test_requests_are_counted_by_what_they_were(void **state)
{
    struct metrics *metrics = metrics_create();
    struct http *http = serve((struct http_config){.metrics = metrics});
    int fd = dial(http);

    (void)state;
    for (int i = 0; i < 3; i++) {
        say(fd, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        say(fd, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        say(fd, "HEAD /quick HTTP/1.1\r\nHost: x\r\n\r\n");
        assert_int_equal(hear(fd, text, true, NULL), 200);
    }
    say(fd, "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    while (metrics_value(metrics, METRIC_HTTP_IN_PROGRESS, NULL) != 1) {
        nap(5);
    }
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    assert_int_equal(hear(fd, text, false, NULL), 200);
    say(fd, "GET /% HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(fd, text, false, NULL), 400);
    (void)close(fd);
    http_stop(http, 5);
    assert_true(counted(metrics, "GET", "200") == 7 && counted(metrics, "HEAD", "200") == 3);
    assert_true(counted(metrics, "GET", "400") == 1);
    assert_true(metrics_value(metrics, METRIC_HTTP_SECONDS, METRIC_LABELS("none")) == 11);
    assert_true(metrics_value(metrics, METRIC_HTTP_IN_PROGRESS, NULL) == 0);
    metrics_destroy(metrics);
}

static void test_waits_end_with_the_job_or_the_time(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 1});
    int waiting[8];
    double start;

    (void)state;
    for (size_t i = 0; i < 8; i++) {
        waiting[i] = dial(http);
        say(waiting[i], "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    }
    /* One request thread, eight waiting connections: others are still served. */
    start = now();
    assert_int_equal(ask(http, "GET /wait-short HTTP/1.1\r\nHost: x\r\n\r\n"), 201);
    assert_true(now() - start >= 0.2);
    http_job_changed(http, "job-2");
    http_job_changed(http, "job-1");
    nap(100);
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    for (size_t i = 0; i < 8; i++) {
        assert_int_equal(hear(waiting[i], text, false, NULL), 200);
        (void)close(waiting[i]);
    }
    http_stop(http, 5);
}

static void test_a_job_that_ends_before_the_wait_is_noticed(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);

    (void)state;
    say(fd, "GET /race HTTP/1.1\r\nHost: x\r\n\r\n");
    while (!atomic_load(&fake.in_handler)) {
        nap(5);
    }
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    atomic_store(&fake.leave, true);
    assert_int_equal(hear(fd, text, false, NULL), 200);
    (void)close(fd);
    http_stop(http, 5);
}

static void test_stopping_answers_what_waits(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http), idle = dial(http), half = dial(http);
    double start;

    (void)state;
    say(half, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\nhello");
    say(fd, "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    nap(300);
    start = now();
    http_stop(http, 0.5);
    assert_true(now() - start < 10);
    assert_int_equal(hear(fd, text, false, NULL), 201);
    assert_true(closes(fd));
    assert_true(closes(idle));
    assert_true(closes(half));
    (void)close(fd);
    (void)close(idle);
    (void)close(half);
}

static void test_dawdlers_are_cut_off(void **state)
{
    struct http *http = serve((struct http_config){.header_seconds = 0.5, .transfer_seconds = 0.5});
    int head = dial(http), body = dial(http);
    bool ended = false;

    (void)state;
    say(head, "GET /quick HTTP/1.1\r\nX-Slow: ");
    say(body, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n");
    for (int i = 0; i < 50 && !ended; i++) {
        char byte;

        say(head, "a");
        say(body, "b");
        nap(100);
        ended = recv(head, &byte, 1, MSG_DONTWAIT | MSG_PEEK) == 1;
    }
    assert_true(ended);
    assert_int_equal(hear(head, text, false, NULL), 408);
    assert_true(closes(head));
    assert_true(closes(body));
    (void)close(head);
    (void)close(body);
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    http_stop(http, 5);
}

/* The peer finished sending in mid-request: noticed long before the deadlines, so that neither the
   slots nor the end of the service wait for it. */
static void test_abandoned_requests_are_let_go(void **state)
{
    static const char *const beginnings[] = {
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\nhello",
        "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 200000\r\n\r\nrefused, and read",
        "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhel",
        "POST /x HTTP/1.1\r\nHost: ",
    };
    struct http *http = serve((struct http_config){.max_connections = 2});
    double start = now();

    (void)state;
    for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; i++) {
        int fd = dial(http);

        say(fd, beginnings[i]);
        (void)close(fd);
    }
    while (ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n") != 200 && now() - start < 20) {
        nap(50);
    }
    assert_true(now() - start < 8);
    for (size_t i = 0; i < 2; i++) {
        int fd = dial(http);

        say(fd, beginnings[i]);
        (void)close(fd);
    }
    nap(100);
    start = now();
    http_stop(http, 20);
    assert_true(now() - start < 8);
}

/* One head, and it is ours. */
static void test_refusals_have_one_head(void **state)
{
    static const char *const requests[] = {
        "GET /quick HTTP/1.1\r\n\r\n",
        "GET /quick HTTP/1.1\r\nX-A: b\r\n\r\n",
    };
    struct http *http = serve((struct http_config){0});

    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        assert_int_equal(ask(http, requests[i]), 400);
        assert_null(strstr(text + 1, "HTTP/1.1"));
        assert_non_null(strstr(text, "malformed-request: "));
    }
    http_stop(http, 5);
}

static int ask_as(const struct http *http, const char *method, const char *fields)
{
    char request[300];

    (void)snprintf(request, sizeof request, "%s /quick HTTP/1.1\r\n%s\r\n\r\n", method, fields);
    return ask(http, request);
}

static void test_foreign_sites_are_kept_out(void **state)
{
    static const struct {
        const char *method, *fields; /* PORT: that of the service */
        int status;
    } cases[] = {
        {"GET", "Host: localhost:PORT", 200},
        {"GET", "Host: LocalHost:PORT", 200},
        {"GET", "Host: 127.0.0.1:PORT", 200},
        {"GET", "Host: [::1]:PORT", 200},
        {"GET", "Host: shapes.example", 200},
        {"GET", "Host: shapes.example:PORT", 200},
        {"GET", "Host: rebound.example:PORT", 403},
        {"GET", "Host: localhost", 403},
        {"GET", "Host: localhost:1", 403},
        {"GET", "Host: localhost.evil.example:PORT", 403},
        {"GET", "Host: shapes.example.evil", 403},
        {"GET", "Host: ", 403},
        {"GET", "Host: localhost:PORT\r\nOrigin: http://evil.example", 200},
        {"POST", "Host: localhost:PORT\r\nContent-Length: 0", 200},
        {"POST", "Host: localhost:PORT\r\nContent-Length: 0\r\nOrigin: http://localhost:PORT", 200},
        {"POST", "Host: localhost:PORT\r\nContent-Length: 0\r\nOrigin: http://evil.example", 403},
        {"POST", "Host: localhost:PORT\r\nContent-Length: 0\r\nOrigin: null", 403},
        {"DELETE", "Host: localhost:PORT\r\nOrigin: http://localhost:1", 403},
    };
    struct http *http = serve(
        (struct http_config){.local_only = true, .allowed_hosts = "a.example, shapes.example"});
    const char *port = strrchr(http_address(http), ':') + 1;

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char fields[200];
        size_t used = 0;
        int status;

        for (const char *at = cases[i].fields; *at && used < sizeof fields - 8;) {
            if (strncmp(at, "PORT", 4) == 0) {
                used += (size_t)snprintf(fields + used, sizeof fields - used, "%s", port);
                at += 4;
            } else {
                fields[used++] = *at++;
            }
        }
        fields[used] = '\0';
        status = ask_as(http, cases[i].method, fields);
        if (status != cases[i].status) {
            print_message("%s %s answered %d\n", cases[i].method, cases[i].fields, status);
        }
        assert_int_equal(status, cases[i].status);
    }
    http_stop(http, 5);
}

/* An authority in the target counts in the place of Host. */
static void test_authorities_count_as_host(void **state)
{
    static const struct {
        const char *target, *host;
        int status;
    } cases[] = {
        {"http://evil.example", "shapes.example", 403},
        {"HTTPS://evil.example:1", "shapes.example", 403},
        {"http://shapes.example.evil", "shapes.example", 403},
        {"http://shapes.example", "shapes.example", 200},
        {"https://shapes.example:1", "evil.example", 200},
        {"http://shapes.example@evil.example", "shapes.example", 400},
        {"http://me@shapes.example", "shapes.example", 400},
        {"http://", "shapes.example", 400},
    };
    struct http *http =
        serve((struct http_config){.local_only = true, .allowed_hosts = "shapes.example"});

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char request[200];
        int status;

        (void)snprintf(request, sizeof request, "GET %s/quick HTTP/1.1\r\nHost: %s\r\n\r\n",
                       cases[i].target, cases[i].host);
        status = ask(http, request);
        if (status != cases[i].status) {
            print_message("%s answered %d\n", cases[i].target, status);
        }
        assert_int_equal(status, cases[i].status);
    }
    http_stop(http, 5);
}

/* Reads until the text has come, or the peer has closed. */
static bool hear_until(int fd, const char *wanted)
{
    size_t used = 0;
    double start = now();

    text[0] = '\0';
    while (!strstr(text, wanted) && now() - start < PATIENCE_MS / 1000.0) {
        struct pollfd poll_fd = {.fd = fd, .events = POLLIN};
        ssize_t n =
            poll(&poll_fd, 1, 100) > 0 ? recv(fd, text + used, ANSWER_MAX - 1 - used, 0) : -1;

        if (n == 0) {
            break;
        }
        used += n > 0 ? (size_t)n : 0;
        text[used] = '\0';
    }
    return strstr(text, wanted) != NULL;
}

static void test_streams_follow_the_job(void **state)
{
    struct http *http = serve((struct http_config){.heartbeat_seconds = 0.3});
    int fd = dial(http), old = dial(http);

    (void)state;
    say(fd, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    say(old, "GET /stream HTTP/1.0\r\n\r\n");
    assert_true(hear_until(fd, "first\n"));
    assert_true(hear_until(fd, "alive\n"));
    atomic_store(&fake.state, 1);
    http_job_changed(http, "job-2");
    http_job_progressed(http, "job-1");
    assert_true(hear_until(fd, "state 1 "));
    atomic_store(&fake.state, -1);
    http_job_changed(http, "job-1");
    assert_true(hear_until(fd, "\r\n0\r\n\r\n"));
    assert_non_null(strstr(text, "state -1 "));
    assert_true(hear_until(old, "state -1 "));
    assert_true(closes(old));
    /* The connection of HTTP/1.1 goes on. */
    say(fd, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(fd, text, false, NULL), 200);
    (void)close(fd);
    (void)close(old);
    http_stop(http, 5);
}

/* However often the job changes, pieces follow each other at a pace, and the last state comes. */
static void test_streams_pass_over_what_is_stale(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);
    double start;

    (void)state;
    say(fd, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_true(hear_until(fd, "first\n"));
    start = now();
    for (int i = 1; i <= 500; i++) {
        atomic_store(&fake.state, i);
        http_job_progressed(http, "job-1");
        nap(1);
    }
    assert_true(hear_until(fd, "state 500 "));
    assert_true(atomic_load(&fake.pieces) <= 2 + (int)((now() - start) / 0.1));
    (void)close(fd);
    http_stop(http, 5);
}

static void test_streams_are_limited(void **state)
{
    struct http *http = serve((struct http_config){.max_streams = 1});
    int first = dial(http), second = dial(http);

    (void)state;
    say(first, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_true(hear_until(first, "first\n"));
    say(second, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(second, text, false, NULL), 503);
    atomic_store(&fake.state, -1);
    http_job_changed(http, "job-1");
    assert_true(hear_until(first, "state -1 "));
    nap(200);
    say(second, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_true(hear_until(second, "state -1 "));
    (void)close(first);
    (void)close(second);
    http_stop(http, 5);
}

/* A reader that takes nothing is cut off, and its stream is free again. */
static void test_streams_do_not_wait_for_readers(void **state)
{
    struct http *http =
        serve((struct http_config){.max_streams = 1, .transfer_seconds = 0.5, .idle_seconds = 60});
    int fd = dial(http), small = 1000, status = 503;
    double start = now();

    (void)state;
    (void)setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    say(fd, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    nap(100);
    for (int i = 1; status != 200 && now() - start < PATIENCE_MS / 1000.0; i++) {
        int other = dial(http);

        atomic_store(&fake.state, i);
        http_job_progressed(http, "job-1");
        say(other, "HEAD /stream HTTP/1.1\r\nHost: x\r\n\r\n");
        status = hear(other, text, true, NULL);
        (void)close(other);
        nap(50);
    }
    assert_int_equal(status, 200);
    (void)close(fd);
    http_stop(http, 5);
}

static void test_stopping_ends_streams(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);
    double start;

    (void)state;
    say(fd, "GET /stream HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_true(hear_until(fd, "first\n"));
    nap(200);
    start = now();
    http_stop(http, 20);
    assert_true(now() - start < 8);
    assert_true(hear_until(fd, "0\r\n\r\n"));
    assert_true(closes(fd));
    (void)close(fd);
}

/* Shapes in a second request, which no front has seen, or in a body: one problem, of ours. */
static void test_later_bytes_are_judged(void **state)
{
    static const struct {
        const char *bytes;
        size_t size;
    } shapes[] = {
#define SHAPE(text) {text, sizeof(text) - 1}
#define POST "POST /x HTTP/1.1\r\nHost: x\r\n"
        SHAPE("GET /quick\0x HTTP/1.1\r\nHost: x\r\n\r\n"),
        SHAPE("GET /quick\0HTTP/1.1 HTTP/1.1\r\nHost: x\r\n\r\n"),
        SHAPE("GET /quick\0 HTTP/1.1\r\nHost: x\r\n\r\n"),
        SHAPE("GET /quick HTTP/1.1\nHost: x\n\n"),
        SHAPE("GET /quick HTTP/1.1\r\nHost: x\r\n\n"),
        SHAPE("GET /quick HTTP/1.1\r\nHost: x\r\nX: a\r\n b\r\n\r\n"),
        SHAPE(POST "Content-Length: 2\0\r\n\r\nab"),
        SHAPE(POST "Content-Length: two\r\n\r\nab"),
        SHAPE(POST "Transfer-Encoding: chunked\r\n\r\n2\nab\r\n0\r\n\r\n"),
        SHAPE(POST "Transfer-Encoding: chunked\r\n\r\n2\r\nab\n0\r\n\r\n"),
        SHAPE("POST /x HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"),
    };
    struct http *http = serve((struct http_config){0});

    (void)state;
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        int fd = dial(http), status;

        say(fd, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        assert_int_equal(send(fd, shapes[i].bytes, shapes[i].size, MSG_NOSIGNAL), shapes[i].size);
        status = hear(fd, text, false, NULL);
        if (status != 400) {
            print_message("shape %zu answered %d\n", i, status);
        }
        assert_int_equal(status, 400);
        assert_null(strstr(text, "\nHTTP/1."));
        assert_non_null(strstr(text, "malformed-request: "));
        assert_non_null(strstr(text, "Server-Timing: total;dur="));
        assert_true(closes(fd));
        (void)close(fd);
    }
    http_stop(http, 5);
}

/* Blanks behind a length are no part of it, in any request. */
static void test_blanks_behind_a_length_are_passed_over(void **state)
{
    struct http *http = serve((struct http_config){0});
    int fd = dial(http);

    (void)state;
    for (int i = 0; i < 2; i++) {
        say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 2 \r\n\r\nab");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        assert_non_null(strstr(text, "size=2"));
    }
    (void)close(fd);
    http_stop(http, 5);
}

/* An extension of 40 KB does not end in the library's page. */
static void test_long_chunk_lines_are_refused(void **state)
{
    struct http *http = serve((struct http_config){0});
    char *line = malloc(40001);
    int fd = dial(http);

    (void)state;
    assert_non_null(line);
    memset(line, 'a', 40000);
    line[40000] = '\0';
    memcpy(line, "5;", 2);
    say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
    say(fd, line);
    assert_int_equal(hear(fd, text, false, NULL), 400);
    assert_non_null(strstr(text, "malformed-request: "));
    assert_true(closes(fd));
    (void)close(fd);
    free(line);
    http_stop(http, 5);
}

/* Those who say nothing make room for those who do. */
static void test_idle_connections_keep_nobody_out(void **state)
{
    struct http *http = serve((struct http_config){.max_waiting = 5, .max_connections = 2});
    int idle[50];

    (void)state;
    for (size_t i = 0; i < 50; i++) {
        idle[i] = dial(http);
    }
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_int_equal(hear(idle[0], text, false, NULL), 503);
    assert_true(closes(idle[0]));
    say(idle[49], "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(idle[49], text, false, NULL), 200);
    for (size_t i = 0; i < 50; i++) {
        (void)close(idle[i]);
    }
    http_stop(http, 5);
}

static void test_too_many_connections_are_told(void **state)
{
    struct http *http = serve((struct http_config){.max_connections = 2});
    int first = dial(http), second = dial(http);

    (void)state;
    say(first, "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    say(second, "GET /wait HTTP/1.1\r\nHost: x\r\n\r\n");
    nap(200);
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 503);
    assert_non_null(strstr(text, "Server-Timing: total;dur="));
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    assert_int_equal(hear(first, text, false, NULL), 200);
    nap(100); /* it is idle now */
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    (void)close(second);
    http_stop(http, 5);
}

static void test_loopback_is_told_from_the_rest(void **state)
{
    (void)state;
    assert_true(http_is_loopback("127.0.0.1:8080"));
    assert_true(http_is_loopback("127.9.9.9:0"));
    assert_true(http_is_loopback("[::1]:8080"));
    assert_false(http_is_loopback("0.0.0.0:8080"));
    assert_false(http_is_loopback("[::]:8080"));
    assert_false(http_is_loopback("192.168.0.1:8080"));
    assert_false(http_is_loopback("localhost:8080"));
    assert_false(http_is_loopback("127.0.0.1"));
    assert_false(http_is_loopback("127.0.0.1:99999"));
    assert_false(http_is_loopback("127.0.0.1:80x"));
    assert_false(http_is_loopback("]:1"));
    assert_false(http_is_loopback("[:1"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_carry_id_and_timing),
        cmocka_unit_test(test_ambiguous_requests_are_refused),
        cmocka_unit_test(test_oversized_heads_are_refused),
        cmocka_unit_test(test_bodies_arrive_whole_or_not_at_all),
        cmocka_unit_test(test_all_bodies_together_are_bounded),
        cmocka_unit_test(test_slow_routes_run_on_request_threads),
        cmocka_unit_test(test_requests_are_counted_by_what_they_were),
        cmocka_unit_test(test_waits_end_with_the_job_or_the_time),
        cmocka_unit_test(test_a_job_that_ends_before_the_wait_is_noticed),
        cmocka_unit_test(test_stopping_answers_what_waits),
        cmocka_unit_test(test_dawdlers_are_cut_off),
        cmocka_unit_test(test_abandoned_requests_are_let_go),
        cmocka_unit_test(test_refusals_have_one_head),
        cmocka_unit_test(test_foreign_sites_are_kept_out),
        cmocka_unit_test(test_authorities_count_as_host),
        cmocka_unit_test(test_streams_follow_the_job),
        cmocka_unit_test(test_streams_pass_over_what_is_stale),
        cmocka_unit_test(test_streams_are_limited),
        cmocka_unit_test(test_streams_do_not_wait_for_readers),
        cmocka_unit_test(test_stopping_ends_streams),
        cmocka_unit_test(test_later_bytes_are_judged),
        cmocka_unit_test(test_blanks_behind_a_length_are_passed_over),
        cmocka_unit_test(test_long_chunk_lines_are_refused),
        cmocka_unit_test(test_idle_connections_keep_nobody_out),
        cmocka_unit_test(test_too_many_connections_are_told),
        cmocka_unit_test(test_loopback_is_told_from_the_rest),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    if (sodium_init() < 0) {
        return 1;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
