/*
 * http_fixture.h - an api layer made for the tests of the listening side, and raw clients of it.
 * Included by the tests of this folder, after cmocka's headers.
 */
#ifndef TESTS_HTTP_FIXTURE_H
#define TESTS_HTTP_FIXTURE_H

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
#define LARGE ((size_t)8 << 20) /* bytes of the answer at /large */

/* ---- The api layer of this test -------------------------------------------------------------- */

static struct {
    atomic_int handled;     /* calls of api_handle */
    atomic_bool job_ended;  /* what api_resume finds */
    atomic_bool in_handler; /* a /race request is inside api_handle */
    atomic_bool leave;      /* ... and may leave */
    atomic_int on_request_thread;
    atomic_int state; /* what a stream tells of; below 0: the last */
    atomic_int pieces;
    atomic_int uploads, most_uploads; /* inside api_handle now, and at most */
    atomic_int alone;                 /* handled with request->alone */
    atomic_int crowded;               /* of these, those beside which another was handled */
    atomic_int heads;                 /* of uploads and slow requests: their bodies come next */
    atomic_int begun;                 /* uploads and slow requests */
    atomic_int noted;                 /* of them, in order */
    char order[64];                   /* of those: the letters of their owners */
    atomic_bool asks_for_tokens;      /* of all paths but /quick */
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

int api_response_header_text(struct api_response *response, const char *name, const char *value)
{
    response->headers[response->n_headers].name = name;
    response->headers[response->n_headers++].value = strdup(value);
    return 0;
}

int api_response_header(struct api_response *response, const char *name, const char *format, ...)
{
    char text[256];
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return api_response_header_text(response, name, text);
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

static void nap(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    (void)nanosleep(&time, NULL);
}

enum api_verdict api_begin(struct api *api, struct api_request *request, int64_t content_length,
                           size_t *max_body, struct api_response *response)
{
    const char *token = api_request_header(request, "Authorization");

    (void)api;
    *max_body = BODY_LIMIT;
    if (strcmp(request->path, "/late") == 0) {
        nap(1500); /* libmicrohttpd's thread has the head, and does not come to the body */
    }
    memset(&request->caller, 0, sizeof request->caller);
    request->bodiless =
        strcmp(request->path, "/quick") == 0 || strncmp(request->path, "/wait", 5) == 0;
    request->caller.restricted = atomic_load(&fake.asks_for_tokens);
    if (token && strncmp(token, "Bearer k", 8) == 0) {
        (void)snprintf(request->caller.name, sizeof request->caller.name, "%s", token + 7);
    } else if (request->caller.restricted && strcmp(request->path, "/quick") != 0) {
        api_problem(request, response, 401, "token-required", "none came");
        return API_REFUSED;
    }
    if (content_length > (int64_t)BODY_LIMIT) {
        api_problem(request, response, 413, "body-too-large", "by its Content-Length");
        return API_REFUSED;
    }
    if (strncmp(request->path, "/upload-", 8) == 0 || strncmp(request->path, "/slow-", 6) == 0) {
        const char *dash = strchr(request->path, '-');

        request->caller.name[0] = dash[1];
        request->caller.account = dash[1] == '0' ? NULL : (void *)&fake;
        atomic_fetch_add(&fake.heads, 1);
    }
    request->probe = strcmp(request->path, "/probe") == 0;
    return strcmp(request->path, "/quick") == 0 ? API_QUICK : API_SLOW;
}

bool api_is_upload(const struct api_request *request)
{
    return strncmp(request->path, "/upload", 7) == 0;
}

/* "/upload-X-small" and what begins so. */
bool api_is_small(const struct api_request *request)
{
    return strncmp(request->path + 9, "-small", 6) == 0;
}

/* "/upload-X-fetch" and what begins so. */
bool api_fetches(const struct api_request *request)
{
    return strncmp(request->path, "/upload-", 8) == 0 && strstr(request->path, "-fetch");
}

/* "Bearer NAME" with a name that begins with k is known. */
bool api_knows(struct api *api, const char *authorization, size_t length)
{
    (void)api;
    return length > 7 && strncmp(authorization, "Bearer k", 8) == 0;
}

/* Stays inside until the test says so, or it is told to stop; "/upload-X-again" finds no room
   unless it is alone. */
static void handle_upload(const struct api_request *request, struct api_response *response)
{
    int now, most = atomic_load(&fake.most_uploads);

    /* Before it is counted, on which the test waits. */
    fake.order[atomic_fetch_add(&fake.begun, 1) % (int)sizeof fake.order] = request->caller.name[0];
    atomic_fetch_add(&fake.noted, 1);
    now = atomic_fetch_add(&fake.uploads, 1) + 1;
    while (now > most && !atomic_compare_exchange_weak(&fake.most_uploads, &most, now)) {
    }
    if (request->alone) {
        atomic_fetch_add(&fake.alone, 1);
        atomic_fetch_add(&fake.crowded, now > 1);
    } else if (strstr(request->path, "again")) {
        response->undone = API_AGAIN;
    }
    while (response->undone == API_DONE && !atomic_load(&fake.leave) &&
           !atomic_load(request->stop)) {
        nap(5);
    }
    if (response->undone == API_DONE && atomic_load(request->stop)) {
        response->undone = API_STOPPED;
    } else if (response->undone == API_DONE) {
        answer(response, 200, "read");
    }
    atomic_fetch_sub(&fake.uploads, 1);
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
    if (api_is_upload(request) || strncmp(request->path, "/slow-", 6) == 0) {
        handle_upload(request, response);
        return;
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
    if (strcmp(request->path, "/large") == 0) {
        response->status = 200;
        response->body = calloc(1, LARGE);
        response->body_size = response->body ? LARGE : 0;
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

/* ---- A client -------------------------------------------------------------------------------- */

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
    atomic_store(&fake.most_uploads, 0);
    atomic_store(&fake.alone, 0);
    atomic_store(&fake.crowded, 0);
    atomic_store(&fake.heads, 0);
    atomic_store(&fake.begun, 0);
    atomic_store(&fake.noted, 0);
    memset(fake.order, 0, sizeof fake.order);
    atomic_store(&fake.asks_for_tokens, false);
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

#endif
