/*
 * test_http.c - the listening side against an api layer made for the test: shapes of requests,
 * limits, deadlines, request threads, waiting for jobs, stopping. Clients are raw sockets, because
 * most of what is tried no HTTP library would send.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/http.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <sodium.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define BODY_LIMIT ((size_t)100000)
#define ANSWER_MAX ((size_t)256 << 10)
#define PATIENCE_MS 20000

/* ---- The api layer of this test
   -------------------------------------------------------------------------- */

static struct {
    atomic_int handled;     /* calls of api_handle */
    atomic_bool job_ended;  /* what api_resume finds */
    atomic_bool in_handler; /* a /race request is inside api_handle */
    atomic_bool leave;      /* ... and may leave */
    atomic_int on_request_thread;
    atomic_int state; /* what a stream tells of; below 0: the last */
    atomic_int pieces;
} fake;

const char *api_request_header(const struct api_request *request, const char *name)
{
    for (size_t i = 0; i < request->n_headers; i++) {
        if (strcasecmp(request->headers[i].name, name) == 0) {
            return request->headers[i].value;
        }
    }
    return NULL;
}

void api_response_clear(struct api_response *response)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        free((void *)(uintptr_t)response->headers[i].value);
    }
    free(response->body);
    free(response->stream.state);
    memset(response, 0, sizeof *response);
}

int api_response_header(struct api_response *response, const char *name, const char *format, ...)
{
    char text[256];
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    response->headers[response->n_headers].name = name;
    response->headers[response->n_headers++].value = strdup(text);
    return 0;
}

static void answer(struct api_response *response, int status, const char *text)
{
    response->status = status;
    response->body = (unsigned char *)strdup(text);
    response->body_size = strlen(text);
}

void api_problem(const struct api_request *request, struct api_response *response, int status,
                 const char *code, const char *detail)
{
    char text[300];

    (void)request;
    (void)snprintf(text, sizeof text, "%s: %s", code, detail);
    api_response_clear(response);
    answer(response, status, text);
    response->problem = code;
}

enum api_verdict api_begin(struct api *api, struct api_request *request, int64_t content_length,
                           size_t *max_body, struct api_response *response)
{
    (void)api;
    *max_body = BODY_LIMIT;
    if (content_length > (int64_t)BODY_LIMIT) {
        api_problem(request, response, 413, "body-too-large", "by its Content-Length");
        return API_REFUSED;
    }
    return strcmp(request->path, "/quick") == 0 ? API_QUICK : API_SLOW;
}

static void nap(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    (void)nanosleep(&time, NULL);
}

void api_handle(struct api *api, const struct api_request *request, struct api_response *response)
{
    char name[32] = "", text[200];
    size_t sum = 0;

    (void)api;
    atomic_fetch_add(&fake.handled, 1);
    (void)pthread_getname_np(pthread_self(), name, sizeof name);
    atomic_store(&fake.on_request_thread, strncmp(name, "srnfd-req-", 10) == 0);
    for (size_t i = 0; i < request->body_size; i++) {
        sum += request->body[i];
    }
    if (strcmp(request->path, "/stream") == 0) {
        response->stream.state = calloc(1, sizeof(int));
        (void)snprintf(response->stream.job_id, sizeof response->stream.job_id, "job-1");
        answer(response, 200, "first\n");
        return;
    }
    if (strncmp(request->path, "/wait", 5) == 0 || strcmp(request->path, "/race") == 0) {
        if (strcmp(request->path, "/race") == 0) {
            atomic_store(&fake.in_handler, true);
            while (!atomic_load(&fake.leave)) {
                nap(5);
            }
        }
        (void)snprintf(response->wait.job_id, sizeof response->wait.job_id, "job-1");
        response->wait.seconds = strcmp(request->path, "/wait-short") == 0 ? 0.2 : 600;
        return;
    }
    (void)snprintf(text, sizeof text, "path=%s query=%s size=%zu sum=%zu", request->path,
                   request->query, request->body_size, sum);
    answer(response, 200, text);
}

void api_resume(struct api *api, const struct api_request *request, struct api_response *response)
{
    (void)api;
    (void)request;
    if (!atomic_load(&fake.job_ended) && response->wait.seconds > 0) {
        return;
    }
    response->wait.job_id[0] = '\0';
    answer(response, atomic_load(&fake.job_ended) ? 200 : 201, "resumed");
}

/* "state N" where N differs from what this stream told before, padded to a size that no socket's
   buffer holds often; "alive" where it is asked for. */
void api_stream_next(struct api *api, struct api_response *response, bool alive)
{
    int *told = response->stream.state, state = atomic_load(&fake.state);

    (void)api;
    free(response->body);
    response->body = NULL;
    response->body_size = 0;
    if (state != *told) {
        response->body = malloc(2000);
        assert_non_null(response->body);
        response->body_size =
            (size_t)snprintf((char *)response->body, 2000, "state %-1000d\n", state);
        *told = state;
        response->stream.ended = state < 0;
        atomic_fetch_add(&fake.pieces, 1);
    } else if (alive) {
        response->body = (unsigned char *)strdup("alive\n");
        response->body_size = 6;
    }
}

/* ---- A client
   -------------------------------------------------------------------------------------------- */

static double now(void)
{
    struct timespec time;

    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static int dial(const struct http *http)
{
    const char *colon = strrchr(http_address(http), ':');
    struct sockaddr_in to = {.sin_family = AF_INET};
    int fd = socket(AF_INET, SOCK_STREAM, 0);

    to.sin_port = htons((uint16_t)strtol(colon + 1, NULL, 10));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(connect(fd, (struct sockaddr *)&to, sizeof to), 0);
    return fd;
}

static void say(int fd, const char *text)
{
    size_t length = strlen(text);

    while (length > 0) {
        ssize_t n = send(fd, text, length, MSG_NOSIGNAL);

        if (n <= 0) {
            return;
        }
        text += n;
        length -= (size_t)n;
    }
}

/* Whether the answer in text is whole: headers and Content-Length bytes. */
static bool whole(const char *text, bool head)
{
    const char *end = strstr(text, "\r\n\r\n"), *length = strcasestr(text, "\r\nContent-Length:");

    if (!end) {
        return false;
    }
    return head || !length || strlen(end + 4) >= strtoul(length + 17, NULL, 10);
}

/* Reads one answer, or what came until the peer closed (*closed); returns its status, 0 where there
   is none. */
static int hear(int fd, char *text, bool head, bool *closed)
{
    size_t used = 0;
    double start = now();
    bool ended = false;

    text[0] = '\0';
    while (!whole(text, head) && now() - start < PATIENCE_MS / 1000.0) {
        struct pollfd poll_fd = {.fd = fd, .events = POLLIN};
        ssize_t n;

        if (poll(&poll_fd, 1, 100) <= 0) {
            continue;
        }
        n = recv(fd, text + used, ANSWER_MAX - 1 - used, 0);
        if (n <= 0) {
            ended = true;
            break;
        }
        used += (size_t)n;
        text[used] = '\0';
    }
    if (closed) {
        *closed = ended;
    }
    return strncmp(text, "HTTP/1.", 7) == 0 ? (int)strtol(text + 9, NULL, 10) : 0;
}

/* Whether the peer closes within the patience. */
static bool closes(int fd)
{
    double start = now();
    char byte;

    while (now() - start < PATIENCE_MS / 1000.0) {
        struct pollfd poll_fd = {.fd = fd, .events = POLLIN};

        if (poll(&poll_fd, 1, 100) > 0 && recv(fd, &byte, 1, 0) <= 0) {
            return true;
        }
    }
    return false;
}

static char text[ANSWER_MAX];

static struct http *serve(struct http_config config)
{
    struct http *http;
    char message[200];

    atomic_store(&fake.handled, 0);
    atomic_store(&fake.job_ended, false);
    atomic_store(&fake.in_handler, false);
    atomic_store(&fake.leave, false);
    atomic_store(&fake.state, 0);
    atomic_store(&fake.pieces, 0);
    config.listen = "127.0.0.1:0";
    assert_int_equal(http_start(&http, &config, message, sizeof message), 0);
    return http;
}

static int ask(const struct http *http, const char *request)
{
    int fd = dial(http), status;

    say(fd, request);
    status = hear(fd, text, false, NULL);
    (void)close(fd);
    return status;
}

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
    say(first, "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\nhello");
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

/* Zero bytes in the target of a second request, which no front has seen. */
static void test_later_requests_are_guarded(void **state)
{
    static const char *const lines[] = {"GET /quick\0x HTTP/1.1", "GET /quick\0HTTP/1.1 HTTP/1.1",
                                        "GET /quick\0 HTTP/1.1"};
    static const size_t lengths[] = {21, 28, 20};
    struct http *http = serve((struct http_config){0});

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        int fd = dial(http), status;

        say(fd, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
        assert_int_equal(hear(fd, text, false, NULL), 200);
        assert_int_equal(send(fd, lines[i], lengths[i], MSG_NOSIGNAL), lengths[i]);
        say(fd, "\r\nHost: x\r\n\r\n");
        status = hear(fd, text, false, NULL);
        assert_int_equal(status, 400);
        assert_true(closes(fd));
        (void)close(fd);
    }
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
    say(first, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(first, text, false, NULL), 200);
    say(second, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n");
    assert_int_equal(hear(second, text, false, NULL), 200);
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 503);
    (void)close(first);
    nap(300);
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
        cmocka_unit_test(test_waits_end_with_the_job_or_the_time),
        cmocka_unit_test(test_a_job_that_ends_before_the_wait_is_noticed),
        cmocka_unit_test(test_stopping_answers_what_waits),
        cmocka_unit_test(test_dawdlers_are_cut_off),
        cmocka_unit_test(test_abandoned_requests_are_let_go),
        cmocka_unit_test(test_half_closed_clients_are_answered),
        cmocka_unit_test(test_refusals_have_one_head),
        cmocka_unit_test(test_foreign_sites_are_kept_out),
        cmocka_unit_test(test_streams_follow_the_job),
        cmocka_unit_test(test_streams_pass_over_what_is_stale),
        cmocka_unit_test(test_streams_are_limited),
        cmocka_unit_test(test_streams_do_not_wait_for_readers),
        cmocka_unit_test(test_stopping_ends_streams),
        cmocka_unit_test(test_later_requests_are_guarded),
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
