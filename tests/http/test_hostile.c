/*
 * test_hostile.c - the real daemon against clients that mean it no good, or know no better: shapes
 * of requests on which servers disagree, floods, heads and bodies that do not end, thousands of
 * connections that say nothing. Each is refused as the contract says, with one problem document;
 * none keeps others from being served; memory and threads stay within bounds, which are read from
 * /proc.
 * srnfd-test: slow
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/head.h"
#include "support/compare.h"
#include "support/wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#define HEAD_END "Host: x\r\n\r\n"
#define TEXT(text) text, sizeof(text) - 1
#define BODY_MAX 2000000 /* the daemon's --max-body */

/* Bounds of what clients may make the daemon hold, in KiB of resident memory. */
#define IDLE_KIB 2           /* of a connection without a request */
#define SENDER_KIB (64 + 40) /* of one whose body has begun: its first buffer, and the library's */
#define SLACK_KIB 16384      /* of the allocator */

static struct daemon daemon_;
static struct wire_answer answer;
static bool sanitized;

static int set_up(void **state)
{
    static const char *const options[] = {"--workers",
                                          "1",
                                          "--max-body",
                                          "2000000",
                                          "--allowed-hosts",
                                          "x",
                                          "--insecure",
                                          "--access-log",
                                          "refusals",
                                          "--header-seconds",
                                          "2",
                                          "--transfer-seconds",
                                          "2",
                                          NULL};
    const char *kind = getenv("SRNFD_SANITIZED");
    struct rlimit limit;

    (void)state;
    sanitized = kind && kind[0];
    if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
        limit.rlim_cur = limit.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &limit);
    }
    return wire_start(&daemon_, options) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    return wire_stop(&daemon_);
}

/* A request whose Host is the daemon's; HOST stands for it. */
static const char *with_host(const char *text)
{
    static char request[4096];
    const char *host = strstr(text, "HOST");

    if (!host) {
        return text;
    }
    (void)snprintf(request, sizeof request, "%.*s127.0.0.1:%d%s", (int)(host - text), text,
                   daemon_.port, host + 4);
    return request;
}

static void assert_well(void)
{
    assert_int_equal(
        wire_ask(&daemon_, with_host("GET /healthz HTTP/1.1\r\nHost: HOST\r\n\r\n"), &answer), 200);
}

/* ---- Shapes ---------------------------------------------------------------------------------- */

static const struct {
    const char *bytes;
    size_t size;
    int status;
    const char *code;
} shapes[] = {
    {TEXT("POST /v1/meshes HTTP/1.1\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n" HEAD_END
          "0\r\n\r\nGET /healthz HTTP/1.1\r\n" HEAD_END),
     400, "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nContent-Length: 5\r\nContent-Length: 6\r\n" HEAD_END
          "hello!"),
     400, "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nTransfer-Encoding: gzip, chunked\r\n" HEAD_END "0\r\n\r\n"),
     400, "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: "
          "x\r\n" HEAD_END "0\r\n\r\n"),
     400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nX: a\r\n b\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nX : a\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\nHost: x\n\n"), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nX: a\nY: b\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nContent-Length: abc\r\n" HEAD_END), 400,
     "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nContent-Length: -5\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("POST /v1/meshes HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n" HEAD_END), 413,
     "body-too-large"},
    {TEXT("GET /health%00z HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz\0x HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nX: a\0b\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /v1%2fversion HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n"), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nAuthorization: Bearer a\r\nauthorization: Bearer "
          "b\r\n" HEAD_END),
     400, "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nContent-Type: a/b\r\nContent-Type: a/c\r\n" HEAD_END), 400,
     "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nIdempotency-Key: a\r\nIdempotency-Key: b\r\n" HEAD_END), 400,
     "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nRange: bytes=1-2\r\nRange: bytes=3-4\r\n" HEAD_END), 400,
     "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\nContent-Length: 0\r\nContent-Length: 0\r\n" HEAD_END), 400,
     "malformed-request"},
    {TEXT("GET /healthz HTTP/1.1\r\n\r\n"), 400, "malformed-request"},
    {TEXT("GET /healthz\r\n\r\n"), 400, "malformed-request"},
    {TEXT("GET\r\n\r\n"), 400, "malformed-request"},
    {TEXT("\0\0\0\0\r\n\r\n"), 400, "malformed-request"},
    {TEXT("GET healthz HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("CONNECT x:80 HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("OPTIONS * HTTP/1.1\r\n" HEAD_END), 400, "malformed-request"},
    {TEXT("GET /healthz HTTP/3.0\r\n" HEAD_END), 505, "http-version-not-supported"},
    {TEXT("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), 505, "http-version-not-supported"},
    {TEXT("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"), 400, "malformed-request"},
};

static void test_shapes_get_one_problem_and_are_closed(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        int fd = wire_dial(&daemon_);
        bool well;

        assert_true(fd >= 0);
        assert_true(wire_send(fd, shapes[i].bytes, shapes[i].size));
        wire_hear(fd, false, &answer);
        well = wire_is_problem(&answer, shapes[i].status, shapes[i].code);
        if (!well) {
            print_message("shape %zu, %.50s: %d %s\n", i, shapes[i].bytes, answer.status,
                          answer.text);
        }
        assert_true(well);
        assert_non_null(strcasestr(answer.text, "\r\nX-Request-Id: req-"));
        assert_true(wire_closes(fd));
        (void)close(fd);
    }
    assert_well();
}

/* The same behind a request that was answered. */
static void test_shapes_behind_a_good_request_are_closed_too(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        int fd = wire_dial(&daemon_);

        assert_true(wire_say(fd, with_host("GET /healthz HTTP/1.1\r\nHost: HOST\r\n\r\n")));
        wire_hear(fd, false, &answer);
        assert_int_equal(answer.status, 200);
        (void)wire_send(fd, shapes[i].bytes, shapes[i].size);
        (void)shutdown(fd, SHUT_WR);
        wire_hear(fd, false, &answer);
        if (!wire_is_problem(&answer, shapes[i].status, shapes[i].code)) {
            print_message("shape %zu, %.50s: %d %s\n", i, shapes[i].bytes, answer.status,
                          answer.text);
            fail();
        }
        assert_true(wire_closes(fd));
        (void)close(fd);
    }
    assert_well();
}

static void test_floods_in_the_head_are_cut_short(void **state)
{
    static const struct {
        const char *start, *line;
        int status;
        const char *code;
    } floods[] = {
        {"GET /healthz HTTP/1.1\r\n", "X-Flood: 1\r\n", 431, "headers-too-large"},
        {"GET /healthz HTTP/1.1\r\nX: ", "aaaaaaaaaaaaaaaa", 431, "headers-too-large"},
        {"GET /", "aaaaaaaaaaaaaaaa", 414, "uri-too-long"},
        {"", "AAAAAAAAAAAAAAAA", 414, "uri-too-long"},
    };

    (void)state;
    for (size_t i = 0; i < sizeof floods / sizeof floods[0]; i++) {
        int fd = wire_dial(&daemon_);
        size_t lines = 0;

        (void)wire_say(fd, floods[i].start);
        while (lines < 4000 && wire_say(fd, floods[i].line)) {
            lines++;
        }
        wire_hear(fd, false, &answer);
        assert_true(wire_is_problem(&answer, floods[i].status, floods[i].code));
        assert_true(wire_closes(fd));
        (void)close(fd);
    }
    assert_well();
}

/* As large as the limits allow, over and over on one connection, whose memory is bounded too. */
static void test_the_largest_heads_are_taken(void **state)
{
    static char head[HEAD_BYTES_MAX];
    size_t n = 0, fields;
    int fd = wire_dial(&daemon_);

    (void)state;
    n += (size_t)snprintf(head, sizeof head, "GET /");
    memset(head + n, 'a', HEAD_TARGET_MAX - 1);
    n += HEAD_TARGET_MAX - 1;
    n += (size_t)snprintf(head + n, sizeof head - n, " HTTP/1.1\r\n");
    fields = n;
    n += (size_t)snprintf(head + n, sizeof head - n, "Host: x\r\n");
    for (size_t i = 1; i < HEAD_FIELDS_MAX; i++) {
        size_t rest = HEAD_FIELD_BYTES_MAX - (n - fields);
        size_t size = i + 1 < HEAD_FIELDS_MAX ? HEAD_FIELD_BYTES_MAX / HEAD_FIELDS_MAX : rest;
        size_t start = n;

        n += (size_t)snprintf(head + n, sizeof head - n, "X-%zu: ", i);
        memset(head + n, 'v', size - 2 - (n - start));
        n = start + size - 2;
        n += (size_t)snprintf(head + n, sizeof head - n, "\r\n");
    }
    assert_int_equal(n - fields, HEAD_FIELD_BYTES_MAX);
    n += (size_t)snprintf(head + n, sizeof head - n, "\r\n");
    for (int k = 0; k < 3; k++) {
        assert_true(wire_send(fd, head, n));
        wire_hear(fd, false, &answer);
        assert_true(wire_is_problem(&answer, 404, "not-found"));
    }
    (void)close(fd);
    assert_well();
}

/* ---- Methods and versions -------------------------------------------------------------------- */

static void test_methods_and_versions(void **state)
{
    (void)state;
    assert_int_equal(
        wire_ask(&daemon_, with_host("HEAD /healthz HTTP/1.1\r\nHost: HOST\r\n\r\n"), &answer),
        200);
    assert_string_equal(strstr(answer.text, "\r\n\r\n"), "\r\n\r\n");
    assert_int_equal(
        wire_ask(&daemon_, with_host("OPTIONS /v1/meshes HTTP/1.1\r\nHost: HOST\r\n\r\n"), &answer),
        204);
    assert_non_null(strstr(answer.text, "Allow: POST, GET, HEAD, OPTIONS"));
    (void)wire_ask(&daemon_, with_host("BREW /v1/meshes HTTP/1.1\r\nHost: HOST\r\n\r\n"), &answer);
    assert_true(wire_is_problem(&answer, 405, "method-not-allowed"));
    assert_int_equal(wire_ask(&daemon_, "GET /healthz HTTP/1.0\r\n\r\n", &answer), 200);
    assert_well();
}

static void test_pipelined_requests_are_answered_in_order(void **state)
{
    char requests[8192], id[32];
    size_t used = 0, found = 0;
    double start = wire_now();
    int fd = wire_dial(&daemon_);

    (void)state;
    for (int i = 0; i < 40; i++) {
        used += (size_t)snprintf(requests + used, sizeof requests - used,
                                 "GET /%s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nX-Request-Id: "
                                 "p-%d.\r\n\r\n",
                                 i % 3 == 0 ? "readyz" : "healthz", daemon_.port, i);
    }
    assert_true(wire_send(fd, requests, used));
    answer.size = 0;
    while (found < 40 && wire_now() - start < WIRE_PATIENCE) {
        ssize_t n = recv(fd, answer.text + answer.size, WIRE_ANSWER_MAX - 1 - answer.size, 0);

        assert_true(n > 0);
        answer.size += (size_t)n;
        answer.text[answer.size] = '\0';
        for (;; found++) {
            (void)snprintf(id, sizeof id, "X-Request-Id: p-%zu.\r\n", found);
            if (found == 40 || !strstr(answer.text, id)) {
                break;
            }
        }
    }
    assert_int_equal(found, 40);
    for (int i = 1; i < 40; i++) {
        char before[32];

        (void)snprintf(before, sizeof before, "X-Request-Id: p-%d.\r\n", i - 1);
        (void)snprintf(id, sizeof id, "X-Request-Id: p-%d.\r\n", i);
        assert_true(strstr(answer.text, before) < strstr(answer.text, id));
    }
    (void)close(fd);
}

/* ---- Bodies ---------------------------------------------------------------------------------- */

static void test_bodies_too_large(void **state)
{
    char *chunk = malloc(100020);
    int fd;

    (void)state;
    assert_non_null(chunk);
    (void)wire_ask(&daemon_,
                   with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\nExpect: 100-continue\r\n"
                             "Content-Length: 2000001\r\n\r\n"),
                   &answer);
    assert_true(wire_is_problem(&answer, 413, "body-too-large"));
    memset(chunk, 'a', 100020);
    memcpy(chunk, "186a0\r\n", 7);
    memcpy(chunk + 100007, "\r\n", 2);
    fd = wire_dial(&daemon_);
    (void)wire_say(fd, with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: "
                                 "chunked\r\n\r\n"));
    for (size_t i = 0; i < 21; i++) {
        (void)wire_send(fd, chunk, 100009);
    }
    (void)wire_say(fd, "0\r\n\r\n");
    wire_hear(fd, false, &answer);
    assert_true(wire_is_problem(&answer, 413, "body-too-large"));
    (void)close(fd);
    /* Without an end: cut off, and nothing is kept of it. */
    fd = wire_dial(&daemon_);
    (void)wire_say(fd, with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: "
                                 "chunked\r\n\r\n"));
    for (size_t i = 0; i < 1000 && wire_send(fd, chunk, 100009); i++) {
    }
    assert_true(wire_closes(fd));
    (void)close(fd);
    free(chunk);
    assert_well();
}

static void test_a_client_that_waits_is_told_to_go_on(void **state)
{
    int fd = wire_dial(&daemon_);

    (void)state;
    (void)wire_say(fd, with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\nExpect: 100-continue"
                                 "\r\nContent-Length: 5\r\n\r\n"));
    wire_hear(fd, true, &answer);
    assert_int_equal(answer.status, 100);
    (void)wire_say(fd, "hello");
    wire_hear(fd, false, &answer);
    assert_true(wire_is_problem(&answer, 422, "unparsable-mesh"));
    (void)close(fd);
}

static void test_broken_chunks_are_closed(void **state)
{
    static const char *const chunks[] = {"ffffffffffffffff\r\n", "xyz\r\n", "-1\r\n",
                                         "5\r\nhelloX\r\n0\r\n\r\n"};

    (void)state;
    for (size_t i = 0; i < sizeof chunks / sizeof chunks[0]; i++) {
        int fd = wire_dial(&daemon_);

        (void)wire_say(fd, with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\n"
                                     "Transfer-Encoding: chunked\r\n\r\n"));
        (void)wire_say(fd, chunks[i]);
        (void)shutdown(fd, SHUT_WR);
        wire_hear(fd, false, &answer);
        assert_true(wire_is_problem(&answer, 400, "malformed-request"));
        assert_true(wire_closes(fd));
        (void)close(fd);
    }
    assert_well();
}

static int post_json(const char *path, const char *body, size_t size)
{
    char head[300];
    int fd = wire_dial(&daemon_);

    (void)snprintf(head, sizeof head,
                   "POST %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Type: application/json\r\n"
                   "Content-Length: %zu\r\n\r\n",
                   path, daemon_.port, size);
    (void)wire_say(fd, head);
    (void)wire_send(fd, body, size);
    wire_hear(fd, false, &answer);
    (void)close(fd);
    return answer.status;
}

static void test_deep_and_huge_json(void **state)
{
    static const char *const paths[] = {"/v1/processes/encode/execution", "/v1/surfaces",
                                        "/v1/cohorts"};
    size_t size = BODY_MAX;
    char *body = malloc(size);

    (void)state;
    assert_non_null(body);
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        memset(body, '[', size);
        (void)post_json(paths[i], body, size);
        assert_true(wire_is_problem(&answer, 400, "malformed-json"));
        for (size_t k = 0; k + 6 <= size; k += 6) {
            memcpy(body + k, "{\"a\":{", 6);
        }
        (void)post_json(paths[i], body, size - size % 6);
        assert_true(wire_is_problem(&answer, 400, "malformed-json"));
        memset(body, '9', size);
        memcpy(body, "{\"inputs\":", 10);
        body[size - 1] = '}';
        (void)post_json(paths[i], body, size);
        assert_true(answer.status == 400 || answer.status == 422);
        memset(body, ',', size);
        for (size_t k = 11; k < size; k += 2) {
            body[k] = '1';
        }
        memcpy(body, "{\"inputs\":[", 11);
        body[11] = '1';
        body[12] = ',';
        memcpy(body + size - 3, "1]}", 3);
        (void)post_json(paths[i], body, size);
        assert_true(answer.status == 400 || answer.status == 422);
    }
    free(body);
    assert_well();
}

/* ---- Crowds ---------------------------------------------------------------------------------- */

#define IDLE 3000
#define SENDERS 300
#define READERS 60

static int crowd[IDLE];

static void test_idle_connections_cost_little(void **state)
{
    long before, after, threads = wire_status_number(&daemon_, "Threads");
    size_t open = 0;

    (void)state;
    assert_well();
    before = wire_status_number(&daemon_, "VmRSS");
    for (size_t i = 0; i < IDLE; i++) {
        crowd[i] = wire_dial(&daemon_);
        open += crowd[i] >= 0;
        if (i % 100 == 0) {
            assert_well();
        }
    }
    assert_int_equal(open, IDLE);
    assert_well();
    after = wire_status_number(&daemon_, "VmRSS");
    print_message("%d idle connections: %ld KiB more\n", IDLE, after - before);
    assert_true(sanitized || after - before <= IDLE * IDLE_KIB + SLACK_KIB);
    assert_int_equal(wire_status_number(&daemon_, "Threads"), threads);
    /* The last of them is as good as any other. */
    assert_true(
        wire_say(crowd[IDLE - 1], with_host("GET /healthz HTTP/1.1\r\nHost: HOST\r\n\r\n")));
    wire_hear(crowd[IDLE - 1], false, &answer);
    assert_int_equal(answer.status, 200);
    /* Those that say nothing are let go, in header_seconds. */
    assert_true(wire_closes(crowd[0]));
    assert_true(wire_closes(crowd[IDLE - 2]));
    for (size_t i = 0; i < IDLE; i++) {
        (void)close(crowd[i]);
    }
}

/* Answered within so many seconds, among the crowd. */
static double slowest_of(int count)
{
    double slowest = 0;

    for (int i = 0; i < count; i++) {
        double start = wire_now(), took;

        assert_well();
        took = wire_now() - start;
        slowest = compare_max(slowest, took);
    }
    return slowest;
}

static void test_slow_senders_hold_nobody_up(void **state)
{
    long before, after, threads = wire_status_number(&daemon_, "Threads");
    double start = wire_now(), slowest;
    size_t alive = SENDERS;

    (void)state;
    before = wire_status_number(&daemon_, "VmRSS");
    for (size_t i = 0; i < SENDERS; i++) {
        crowd[i] = wire_dial(&daemon_);
        assert_true(crowd[i] >= 0);
        (void)wire_say(crowd[i], i % 2 ? "GET /healthz HTTP/1.1\r\nX-Slow: "
                                       : with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\n"
                                                   "Content-Length: 1000000\r\n\r\n"));
    }
    slowest = slowest_of(100);
    after = wire_status_number(&daemon_, "VmRSS");
    print_message("%d slow senders: %ld KiB more, slowest answer beside them %.1f ms\n", SENDERS,
                  after - before, 1e3 * slowest);
    assert_true(slowest < 5.0);
    assert_true(sanitized || after - before <= SENDERS * SENDER_KIB + SLACK_KIB);
    assert_int_equal(wire_status_number(&daemon_, "Threads"), threads);
    /* A byte now and then does not keep them alive beyond their time. */
    while (alive > 0 && wire_now() - start < WIRE_PATIENCE) {
        wire_nap(0.5);
        for (size_t i = 0; i < SENDERS; i++) {
            if (crowd[i] >= 0 && !wire_say(crowd[i], "a")) {
                (void)close(crowd[i]);
                crowd[i] = -1;
                alive--;
            }
        }
    }
    assert_int_equal(alive, 0);
    assert_well();
}

static void test_slow_readers_hold_nobody_up(void **state)
{
    int small = 2000, fd = wire_dial(&daemon_);
    char byte;
    double slowest;

    (void)state;
    for (size_t i = 0; i < READERS; i++) {
        crowd[i] = wire_dial(&daemon_);
        (void)setsockopt(crowd[i], SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        for (int k = 0; k < 100; k++) {
            (void)wire_say(crowd[i],
                           with_host("GET /v1/openapi.yaml HTTP/1.1\r\nHost: HOST\r\n\r\n"));
        }
    }
    slowest = slowest_of(100);
    print_message("%d slow readers: slowest answer beside them %.1f ms\n", READERS, 1e3 * slowest);
    assert_true(slowest < 5.0);
    /* Cut off, with the answer in the middle: after --transfer-seconds and the answer's length over
       16 KiB a second. */
    (void)wire_ask(&daemon_, with_host("GET /v1/openapi.yaml HTTP/1.1\r\nHost: HOST\r\n\r\n"),
                   &answer);
    wire_nap(3.0 + (double)strlen(answer.text) / 16384.0);
    for (size_t i = 0; i < READERS; i++) {
        ssize_t n = send(crowd[i], "a", 1, MSG_NOSIGNAL | MSG_DONTWAIT);

        while ((n = recv(crowd[i], &byte, 1, MSG_DONTWAIT)) > 0) {
        }
        assert_true(n == 0 || recv(crowd[i], &byte, 1, MSG_DONTWAIT) <= 0);
        (void)close(crowd[i]);
    }
    (void)close(fd);
    assert_well();
}

static void test_aborted_uploads_leave_nothing(void **state)
{
    long before, after;

    (void)state;
    assert_well();
    before = wire_status_number(&daemon_, "VmRSS");
    for (int i = 0; i < 300; i++) {
        int fd = wire_dial(&daemon_);
        struct linger at_once = {.l_onoff = 1, .l_linger = 0};

        (void)wire_say(fd, with_host("POST /v1/meshes HTTP/1.1\r\nHost: HOST\r\n"
                                     "Content-Length: 1000000\r\n\r\nhello"));
        if (i % 2) { /* a reset instead of an end */
            (void)setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
        }
        (void)close(fd);
    }
    wire_nap(1.5);
    after = wire_status_number(&daemon_, "VmRSS");
    assert_true(sanitized || after - before <= SLACK_KIB);
    (void)wire_ask(&daemon_, with_host("GET /metrics HTTP/1.1\r\nHost: HOST\r\n\r\n"), &answer);
    assert_non_null(strstr(answer.text, "\nsrnfd_http_buffered_bytes 0\n"));
    assert_non_null(strstr(answer.text, "\nsrnfd_http_requests_in_progress 1\n"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shapes_get_one_problem_and_are_closed),
        cmocka_unit_test(test_shapes_behind_a_good_request_are_closed_too),
        cmocka_unit_test(test_floods_in_the_head_are_cut_short),
        cmocka_unit_test(test_the_largest_heads_are_taken),
        cmocka_unit_test(test_methods_and_versions),
        cmocka_unit_test(test_pipelined_requests_are_answered_in_order),
        cmocka_unit_test(test_bodies_too_large),
        cmocka_unit_test(test_a_client_that_waits_is_told_to_go_on),
        cmocka_unit_test(test_broken_chunks_are_closed),
        cmocka_unit_test(test_deep_and_huge_json),
        cmocka_unit_test(test_idle_connections_cost_little),
        cmocka_unit_test(test_slow_senders_hold_nobody_up),
        cmocka_unit_test(test_slow_readers_hold_nobody_up),
        cmocka_unit_test(test_aborted_uploads_leave_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
