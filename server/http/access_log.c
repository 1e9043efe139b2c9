/*
 * access_log.c - what is reported of a request when it is over: a line in the log, and the counts
 * of /metrics. The labels come from the table of routes, a list of methods and the table of
 * problems, never from the client.
 */
#include "http/internal.h"

#include "digits.h"
#include "log.h"

#include <math.h>
#include <string.h>

static const char *method_label(const char *method)
{
    static const char *const known[] = {"GET",   "HEAD",   "POST",    "PUT",
                                        "PATCH", "DELETE", "OPTIONS", "TRACE"};

    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcmp(method, known[i]) == 0) {
            return known[i];
        }
    }
    return "other";
}

/* What a client cannot have caused, and no other moment will cure. */
static bool is_fault(int status)
{
    return status == 500 || status == 507;
}

/* Whether the request leaves a line. Refusals always do. */
static bool is_told(const struct exchange *exchange)
{
    const struct http_config *config = &exchange->http->config;

    return exchange->response.problem ||
           (!config->log_refusals_only && (config->log_probes || !exchange->request.probe));
}

static void tell(const struct exchange *exchange, bool whole)
{
    const struct api_request *request = &exchange->request;
    const char *code = exchange->response.problem;
    const char *level = is_fault(exchange->status) ? "error" : code ? "warn" : "info";
    struct log_field fields[11] = {
        log_text("id", request->id),
        log_text("method", request->method),
        log_text("path", request->path),
        log_number("status", exchange->status),
        log_number("ms", round(1e3 * exchange->total_ms) / 1e3),
        log_number("in", (double)(request->body_size + exchange->drained)),
        log_number("out", (double)exchange->sent),
        log_text("end", whole ? "ok" : "cut"),
    };
    size_t n = 8;

    if (code) {
        fields[n++] = log_text("code", code);
    }
    if (request->caller.name[0]) {
        fields[n++] = log_text("owner", request->caller.name);
    }
    if (request->trace[0]) {
        fields[n++] = log_text("traceparent", request->trace);
    }
    log_line(level, "request", fields, n);
}

void access_log_write(const struct exchange *exchange, bool whole)
{
    if (is_told(exchange)) {
        tell(exchange, whole);
    }
}

/* Finds where requests of this kind are counted. */
static void find_series(const struct exchange *exchange, struct connection *connection)
{
    struct metrics *metrics = exchange->http->config.metrics;
    const char *route = exchange->request.route_name ? exchange->request.route_name : "none";
    const char *method = method_label(exchange->request.method);
    char status[DIGITS_MAX];

    if (connection->counted.requests && connection->counted.seconds &&
        connection->counted.route == route && connection->counted.method == method &&
        connection->counted.status == exchange->status) {
        return;
    }
    (void)digits_unsigned(status, exchange->status > 0 ? (uint64_t)exchange->status : 0);
    connection->counted.route = route;
    connection->counted.method = method;
    connection->counted.status = exchange->status;
    connection->counted.requests =
        metrics_series(metrics, METRIC_HTTP_REQUESTS, METRIC_LABELS(route, method, status));
    connection->counted.seconds =
        metrics_series(metrics, METRIC_HTTP_SECONDS, METRIC_LABELS(route));
    connection->counted.sent = metrics_series(metrics, METRIC_HTTP_SENT, NULL);
}

void access_log_count(const struct exchange *exchange)
{
    const struct api_request *request = &exchange->request;
    struct metrics *metrics = exchange->http->config.metrics;
    struct connection *connection = exchange->connection;

    if (!metrics) {
        return;
    }
    if (connection) {
        find_series(exchange, connection);
        series_add(connection->counted.requests, 1);
        series_observe(connection->counted.seconds, METRIC_HTTP_SECONDS, 1e-3 * exchange->total_ms);
        series_add(connection->counted.sent, (double)exchange->sent);
    } else {
        metrics_add(metrics, METRIC_HTTP_SENT, NULL, (double)exchange->sent);
    }
    if (request->body_size + exchange->drained > 0) {
        metrics_add(metrics, METRIC_HTTP_RECEIVED, NULL,
                    (double)(request->body_size + exchange->drained));
    }
    if (exchange->response.problem) {
        metrics_add(metrics, METRIC_HTTP_REFUSALS, METRIC_LABELS(exchange->response.problem), 1);
    }
}
