/*
 * test_crowds.c - who gives way when all places are taken, and what no one caller may have all of:
 * connections, requests in progress, bytes. Against the api layer of http_fixture.h, in which names
 * that begin with k are known tokens.
 *
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/http/http_fixture.h"

#include <errno.h>

#define QUICK "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"
#define MANY 200

static struct http *serve_with_tokens(struct http_config config)
{
    struct http *http = serve(config);

    atomic_store(&fake.asks_for_tokens, true);
    return http;
}

/* One that was answered and is kept open. */
static int settle_as(const struct http *http, const char *field)
{
    char request[200];
    int fd = dial(http);

    (void)snprintf(request, sizeof request, "GET /quick HTTP/1.1\r\nHost: x\r\n%s\r\n", field);
    say(fd, request);
    assert_int_equal(hear(fd, text, false, NULL), 200);
    return fd;
}

static bool is_open(int fd)
{
    char byte;

    return recv(fd, &byte, 1, MSG_DONTWAIT | MSG_PEEK) < 0 && errno == EAGAIN;
}

/* ---- Places ---------------------------------------------------------------------------------- */

static void test_the_longest_idle_gives_way(void **state)
{
    struct http *http = serve((struct http_config){.max_connections = 3});
    int fds[6];

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        fds[i] = settle_as(http, "");
        nap(10);
    }
    say(fds[0], QUICK);
    assert_int_equal(hear(fds[0], text, false, NULL), 200);
    for (size_t i = 3; i < 5; i++) {
        nap(10);
        fds[i] = settle_as(http, "");
    }
    assert_true(closes(fds[1]));
    assert_true(closes(fds[2]));
    assert_true(is_open(fds[0]) && is_open(fds[3]) && is_open(fds[4]));
    for (size_t i = 0; i < 5; i++) {
        (void)close(fds[i]);
    }
    http_stop(http, 5);
}

/* However many have been answered something public, whoever has a token is served, and stays. */
static void test_tokens_have_places_of_their_own(void **state)
{
    struct http *http = serve_with_tokens((struct http_config){.max_connections = 16});
    int fds[MANY], known = settle_as(http, "Authorization: Bearer kim\r\n");

    (void)state;
    for (size_t i = 0; i < MANY; i++) {
        fds[i] = settle_as(http, "");
    }
    assert_true(is_open(known));
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n"),
                     200);
    /* 16 places: two are kept for known ones, of which one has a place. */
    for (size_t i = 0; i < MANY - 14; i++) {
        assert_true(closes(fds[i]));
    }
    for (size_t i = 0; i < MANY; i++) {
        (void)close(fds[i]);
    }
    (void)close(known);
    http_stop(http, 5);
}

/* All at once: what libmicrohttpd has not closed yet must not keep others out, nor stop it. */
static void test_bursts_are_survived(void **state)
{
    struct http *http = serve_with_tokens((struct http_config){.max_connections = 2});
    int fds[MANY + MANY];

    (void)state;
    for (size_t i = 0; i < MANY + MANY; i++) {
        fds[i] = dial(http);
    }
    for (size_t i = 0; i < MANY + MANY; i++) {
        say(fds[i], "GET /quick HTTP/1.1\r\nHost: x\r\n\r\nGET /quick HTTP/1.1\r\nHost: x\r\n");
    }
    for (size_t i = 0; i < 5; i++) {
        assert_int_equal(
            ask(http, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n"), 200);
    }
    for (size_t i = 0; i < MANY + MANY; i++) {
        (void)close(fds[i]);
    }
    http_stop(http, 5);
}

/* While strangers come without end, a caller with a token keeps its place from the moment at which
   its head is there, though its request takes a while to be read and handled. */
static void test_a_token_keeps_its_place_in_a_burst(void **state)
{
    static const char stranger[] = "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n";
    struct http *http = serve_with_tokens((struct http_config){.max_connections = 2});
    int fds[8 * MANY], known[2];
    size_t n = 0;

    (void)state;
    for (size_t round = 0; round < 8; round++) {
        for (size_t i = 0; i < MANY; i++) {
            if (i == MANY / 3) {
                known[0] = dial(http);
                say(known[0], "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n");
            }
            if (i == MANY / 2) {
                known[1] = dial(http);
                say(known[1], "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kit\r\n\r\n");
            }
            fds[n] = dial(http);
            say(fds[n++], stranger);
        }
        for (size_t i = 0; i < 2; i++) {
            assert_int_equal(hear(known[i], text, false, NULL), 200);
            (void)close(known[i]);
        }
        while (n > 0) {
            (void)close(fds[--n]);
        }
    }
    http_stop(http, 5);
}

/* More connections wait than may: one whose head has come is not among those that go for it. */
static void test_whose_head_is_there_is_not_sent_away(void **state)
{
    struct http *http =
        serve_with_tokens((struct http_config){.max_connections = 2, .max_waiting = 8});
    int fds[MANY], known;

    (void)state;
    for (size_t round = 0; round < 5; round++) {
        known = dial(http);
        say(known, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n");
        for (size_t i = 0; i < MANY; i++) {
            fds[i] = dial(http);
        }
        assert_int_equal(hear(known, text, false, NULL), 200);
        (void)close(known);
        for (size_t i = 0; i < MANY; i++) {
            (void)close(fds[i]);
        }
    }
    http_stop(http, 5);
}

/* From another address of the loopback: to the daemon another machine. */
static int dial_from(const struct http *http, const char *host)
{
    const char *colon = strrchr(http_address(http), ':');
    struct sockaddr_in to = {.sin_family = AF_INET}, from = {.sin_family = AF_INET};
    int fd = socket(AF_INET, SOCK_STREAM, 0);

    to.sin_port = htons((uint16_t)strtol(colon + 1, NULL, 10));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(inet_pton(AF_INET, host, &from.sin_addr), 1);
    assert_int_equal(bind(fd, (struct sockaddr *)&from, sizeof from), 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&to, sizeof to), 0);
    return fd;
}

static void test_the_address_with_most_gives_way(void **state)
{
    struct http *http = serve_with_tokens((struct http_config){.max_connections = 8});
    int few = dial_from(http, "127.0.0.2"), fds[30];

    (void)state;
    say(few, QUICK);
    assert_int_equal(hear(few, text, false, NULL), 200);
    nap(10);
    for (size_t i = 0; i < 30; i++) {
        fds[i] = settle_as(http, "");
    }
    assert_true(is_open(few));
    assert_true(closes(fds[0]));
    for (size_t i = 0; i < 30; i++) {
        (void)close(fds[i]);
    }
    (void)close(few);
    http_stop(http, 5);
}

/* ---- Bodies that are not awaited ------------------------------------------------------------- */

static void test_refused_bodies_are_not_awaited(void **state)
{
    static const struct {
        const char *request;
        int status;
    } cases[] = {
        {"POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n", 401},
        {"POST /x HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n", 401},
        {"POST /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer k\r\n"
         "Content-Length: 200000\r\n\r\nhello",
         413},
        {"GET /quick HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n", 200},
        {"GET /wait-short HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer k\r\n"
         "Transfer-Encoding: chunked\r\n\r\n3\r\n",
         201},
    };
    struct http *http = serve_with_tokens((struct http_config){.transfer_seconds = 15});

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double start = now();
        int fd = dial(http), status;

        say(fd, cases[i].request);
        status = hear(fd, text, false, NULL);
        assert_int_equal(status, cases[i].status);
        assert_non_null(strstr(text, "Connection: close"));
        assert_true(closes(fd));
        assert_true(now() - start < 8);
        (void)close(fd);
    }
    http_stop(http, 5);
}

/* A client that sends all of a refused body before it reads gets its answer all the same. */
static void test_answers_wait_for_those_who_send_first(void **state)
{
    struct http *http = serve_with_tokens((struct http_config){0});
    size_t size = 5000000;
    char *body = calloc(1, size + 1);
    int fd = dial(http);

    (void)state;
    assert_non_null(body);
    memset(body, 'a', size);
    say(fd, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 5000000\r\n\r\n");
    nap(300);
    say(fd, body);
    nap(300);
    assert_int_equal(hear(fd, text, false, NULL), 401);
    assert_true(closes(fd));
    (void)close(fd);
    free(body);
    http_stop(http, 5);
}

/* ---- Shares ---------------------------------------------------------------------------------- */

static void test_requests_of_a_name_are_limited(void **state)
{
    struct http *http = serve_with_tokens((struct http_config){.max_owner_requests = 2});
    int fds[2];

    (void)state;
    for (size_t i = 0; i < 2; i++) {
        fds[i] = dial(http);
        say(fds[i], "GET /wait HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n");
    }
    nap(200);
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n"),
                     503);
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kay\r\n\r\n"),
                     200);
    atomic_store(&fake.job_ended, true);
    http_job_changed(http, "job-1");
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(hear(fds[i], text, false, NULL), 200);
        (void)close(fds[i]);
    }
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer kim\r\n\r\n"),
                     200);
    http_stop(http, 5);
}

static void begin_body(int fd, const char *name)
{
    char request[200];

    (void)snprintf(request, sizeof request,
                   "POST /x HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer %s\r\n"
                   "Transfer-Encoding: chunked\r\n\r\n",
                   name);
    say(fd, request);
}

/* Bodies of one name fill its share, and no more: 64 KiB each at first. */
static void test_bytes_of_a_name_are_limited(void **state)
{
    struct http *http = serve_with_tokens(
        (struct http_config){.max_buffered = 300000, .max_owner_buffered = 140000});
    int fds[3];

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        fds[i] = dial(http);
        begin_body(fds[i], "kim");
        say(fds[i], "5\r\nhello\r\n");
        nap(100);
    }
    say(fds[2], "0\r\n\r\n");
    assert_int_equal(hear(fds[2], text, false, NULL), 503);
    assert_non_null(strstr(text, "share"));
    (void)close(fds[2]);
    fds[2] = dial(http);
    begin_body(fds[2], "kay");
    say(fds[2], "5\r\nhello\r\n0\r\n\r\n");
    assert_int_equal(hear(fds[2], text, false, NULL), 200);
    for (size_t i = 0; i < 3; i++) {
        (void)close(fds[i]);
    }
    /* What one body needs is never refused for the share. */
    nap(300);
    fds[0] = dial(http);
    begin_body(fds[0], "kay");
    for (size_t i = 0; i < 90; i++) {
        char chunk[1010];

        memcpy(chunk, "3e8\r\n", 5);
        memset(chunk + 5, 1, 1000);
        memcpy(chunk + 1005, "\r\n", 3);
        say(fds[0], chunk);
    }
    say(fds[0], "0\r\n\r\n");
    assert_int_equal(hear(fds[0], text, false, NULL), 200);
    (void)close(fds[0]);
    http_stop(http, 5);
}

/* ---- The rate -------------------------------------------------------------------------------- */

/* What was sent fast earns no time: a body that stops is cut off after transfer_seconds, one that
   goes on at the rate is not. */
static void test_bodies_keep_up_a_rate(void **state)
{
    struct http *http = serve((struct http_config){.transfer_seconds = 1, .least_rate = 2000});
    int fast = dial(http), steady = dial(http);
    char piece[1001];
    double start;

    (void)state;
    memset(piece, 'a', 1000);
    piece[1000] = '\0';
    say(fast, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 100000\r\n\r\n");
    say(steady, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 12000\r\n\r\n");
    for (size_t i = 0; i < 90; i++) { /* worth 45 seconds at the rate */
        say(fast, piece);
    }
    start = now();
    for (size_t i = 0; i < 12; i++) {
        say(steady, piece);
        nap(200);
    }
    assert_int_equal(hear(steady, text, false, NULL), 200);
    assert_non_null(strstr(text, "size=12000"));
    assert_true(closes(fast));
    assert_true(now() - start < 8);
    (void)close(fast);
    (void)close(steady);
    http_stop(http, 5);
}

/* The same for a response of 8 MB: unread it is cut off after transfer_seconds, however large it
   is; read slowly, but at the rate, it comes whole. */
static void test_responses_keep_up_a_rate(void **state)
{
    static char piece[65536];
    struct http *http = serve((struct http_config){.transfer_seconds = 1, .least_rate = 100000});
    int unread = dial(http), steady = dial(http), small = 20000;
    size_t got = 0;
    double start = now();
    ssize_t n;

    (void)state;
    (void)setsockopt(unread, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    (void)setsockopt(steady, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    say(unread, "GET /large HTTP/1.1\r\nHost: x\r\n\r\n");
    say(steady, "GET /large HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
    while ((n = recv(steady, piece, sizeof piece, 0)) > 0) {
        got += (size_t)n;
        if (now() - start < 2.5) {
            nap(10);
        }
    }
    assert_true(n == 0 && got > LARGE);
    assert_true(now() - start > 2);
    got = 0;
    while ((n = recv(unread, piece, sizeof piece, 0)) > 0) {
        got += (size_t)n;
    }
    assert_true(got < LARGE);
    (void)close(unread);
    (void)close(steady);
    http_stop(http, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_longest_idle_gives_way),
        cmocka_unit_test(test_tokens_have_places_of_their_own),
        cmocka_unit_test(test_bursts_are_survived),
        cmocka_unit_test(test_a_token_keeps_its_place_in_a_burst),
        cmocka_unit_test(test_whose_head_is_there_is_not_sent_away),
        cmocka_unit_test(test_the_address_with_most_gives_way),
        cmocka_unit_test(test_refused_bodies_are_not_awaited),
        cmocka_unit_test(test_answers_wait_for_those_who_send_first),
        cmocka_unit_test(test_requests_of_a_name_are_limited),
        cmocka_unit_test(test_bytes_of_a_name_are_limited),
        cmocka_unit_test(test_bodies_keep_up_a_rate),
        cmocka_unit_test(test_responses_keep_up_a_rate),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    if (sodium_init() < 0) {
        return 1;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
