/*
 * refusal.c - answers that libmicrohttpd has no part in: to a connection that it has not got yet
 * (front.c), and to one whose bytes it does not get (tap.c). They are problem documents like all
 * others, written at once, and end the connection.
 */
#include "http/internal.h"

#include "clock.h"
#include "log.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

/* The answer as it goes over the wire; its length, 0 where it cannot be. */
static size_t write_answer(char text[REFUSAL_MAX], const struct api_request *request,
                           const struct api_response *response, double ms)
{
    time_t now = time(NULL);
    struct tm parts;
    char date[64];
    size_t used;

    (void)gmtime_r(&now, &parts);
    (void)strftime(date, sizeof date, "%a, %d %b %Y %H:%M:%S GMT", &parts);
    used = (size_t)snprintf(text, REFUSAL_MAX,
                            "HTTP/1.1 %d %s\r\nDate: %s\r\nX-Request-Id: %s\r\n"
                            "Server-Timing: total;dur=%.3f\r\nX-Content-Type-Options: nosniff\r\n"
                            "Connection: close\r\nContent-Length: %zu\r\n",
                            response->status, MHD_get_reason_phrase_for((unsigned)response->status),
                            date, request->id, ms, response->body_size);
    for (size_t i = 0; i < response->n_headers && used < REFUSAL_MAX; i++) {
        used += (size_t)snprintf(text + used, REFUSAL_MAX - used, "%s: %s\r\n",
                                 response->headers[i].name, response->headers[i].value);
    }
    if (used + 2 + response->body_size > REFUSAL_MAX) {
        return 0;
    }
    memcpy(text + used, "\r\n", 2);
    if (strcmp(request->method, "HEAD") == 0) {
        return used + 2;
    }
    memcpy(text + used + 2, response->body, response->body_size);
    return used + 2 + response->body_size;
}

static void note_refusal(struct http *http, const struct api_request *request,
                         const struct api_response *response)
{
    struct metrics *metrics = http->config.metrics;
    const char *code = response->problem ? response->problem : "other";
    char status[16];

    (void)snprintf(status, sizeof status, "%d", response->status);
    metrics_add(metrics, METRIC_HTTP_REQUESTS, METRIC_LABELS("none", "other", status), 1);
    metrics_add(metrics, METRIC_HTTP_REFUSALS, METRIC_LABELS(code), 1);
    LOG_WARN("request", log_text("id", request->id), log_text("method", "-"), log_text("path", "-"),
             log_number("status", response->status), log_text("code", code),
             log_text("by", "front"));
}

size_t refusal_write(struct http *http, const struct head_refusal *refusal, const char start[5],
                     char text[REFUSAL_MAX])
{
    struct api_request request = {.method = "GET", .path = "", .query = ""};
    struct api_response response = {0};
    double began = clock_now();
    size_t length;

    if (memcmp(start, "HEAD ", 5) == 0) {
        request.method = "HEAD";
    }
    request_id_make(http, request.id);
    api_problem(&request, &response, refusal->status, refusal->code, refusal->detail);
    length = write_answer(text, &request, &response, 1e3 * (clock_now() - began));
    note_refusal(http, &request, &response);
    api_response_clear(&response);
    return length;
}
