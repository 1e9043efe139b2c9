/*
 * guard.c - the first look at a request, before any byte of its body is read: what head.c, which
 * has judged its form (tap.c), leaves open. One Host, and a permitted one; a target that is a path,
 * or has one behind an authority, which then counts in the place of Host (RFC 9112, 3.2.2).
 *
 * libmicrohttpd cuts a path at %00; so the target is taken raw, from the log callback, and decoded
 * here: a zero byte, an encoded slash and a broken escape are refused.
 */
#include "http/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define AUTHORITY_MAX 300 /* bytes of a name of the DNS, and a port */

static enum MHD_Result take_header(void *cls, enum MHD_ValueKind kind, const char *name,
                                   size_t name_length, const char *value, size_t value_length)
{
    struct exchange *exchange = cls;
    struct api_request *request = &exchange->request;

    (void)kind;
    (void)name_length;
    (void)value_length;
    if (request->n_headers == HTTP_HEADERS_MAX) {
        return MHD_NO; /* head.c lets no more of them pass */
    }
    exchange->headers[request->n_headers].name = name;
    exchange->headers[request->n_headers].value = value ? value : "";
    request->n_headers++;
    return MHD_YES;
}

static size_t count_headers(const struct exchange *exchange, const char *name, const char **value)
{
    size_t count = 0;

    for (size_t i = 0; i < exchange->request.n_headers; i++) {
        if (api_header_is(&exchange->headers[i], name)) {
            *value = exchange->headers[i].value;
            count++;
        }
    }
    return count;
}

/* A field that can mean one thing only comes once: nobody knows which of two was meant, and a
   proxy in front may have judged the other one. Lists may come in parts (RFC 9110, 5.3). NULL: all
   is well. */
static const char *check_repeats(const struct exchange *exchange)
{
    static const struct {
        const char *name, *detail;
    } once[] = {
        {"Authorization", "A request has at most one Authorization field."},
        {"Content-Type", "A request has at most one Content-Type field."},
        {"Idempotency-Key", "A request has at most one Idempotency-Key field."},
        {"If-Range", "A request has at most one If-Range field."},
        {"Lease-Secret", "A request has at most one Lease-Secret field."},
        {"Range", "A request has at most one Range field."},
    };
    const char *value;

    for (size_t i = 0; i < sizeof once / sizeof once[0]; i++) {
        if (count_headers(exchange, once[i].name, &value) > 1) {
            return once[i].detail;
        }
    }
    return NULL;
}

/* How long the body is: head.c has seen to it that there is one answer. */
static void measure_body(struct exchange *exchange)
{
    const char *length = NULL, *coding = NULL;

    exchange->content_length = 0;
    if (count_headers(exchange, "Transfer-Encoding", &coding) > 0) {
        exchange->content_length = -1;
    } else if (count_headers(exchange, "Content-Length", &length) > 0) {
        exchange->content_length = strtoll(length, NULL, 10);
    }
}

static int hex_value(char c)
{
    const char *digits = "0123456789abcdef0123456789ABCDEF", *found = c ? strchr(digits, c) : NULL;

    return found ? (int)((found - digits) % 16) : -1;
}

static const char no_memory[] = "There is not enough memory for the path.";

/* Bytes of the scheme and the slashes in front of the authority; 0: the target has none. */
static size_t scheme_length(const char *target)
{
    return strncasecmp(target, "http://", 7) == 0    ? 7
           : strncasecmp(target, "https://", 8) == 0 ? 8
                                                     : 0;
}

/* Host, or the target's authority in its place, which is written to text. */
static const char *take_authority(const char *target, const char **host, char text[AUTHORITY_MAX])
{
    size_t scheme = scheme_length(target), length = strcspn(target + scheme, "/?#");

    if (scheme == 0) {
        return NULL;
    }
    if (length == 0 || length >= AUTHORITY_MAX || memchr(target + scheme, '@', length)) {
        return "The request target has no host, a name beside it, or one that is too long.";
    }
    memcpy(text, target + scheme, length);
    text[length] = '\0';
    *host = text;
    return NULL;
}

/* Decodes the target's path into exchange->path and sets the query. */
static const char *check_target(struct exchange *exchange)
{
    const char *target = exchange->connection->target;
    size_t length = scheme_length(target), n = 0;

    if (length > 0) {
        target += length + strcspn(target + length, "/?");
    }
    length = strcspn(target, "?#");
    if (target[0] != '/') {
        return "The request target must be a path.";
    }
    exchange->path = length < HTTP_SHORT_PATH ? exchange->short_path : malloc(length + 1);
    if (!exchange->path) {
        return no_memory;
    }
    for (size_t i = 0; i < length; i++) {
        int c = (unsigned char)target[i];

        if (c == '%') {
            int high = hex_value(target[i + 1]), low = high < 0 ? -1 : hex_value(target[i + 2]);

            c = low < 0 ? 0 : high * 16 + low;
            if (c == 0 || c == '/') {
                return "The path has an escape that is broken, or stands for a slash or a zero "
                       "byte.";
            }
            i += 2;
        }
        exchange->path[n++] = (char)c;
    }
    exchange->path[n] = '\0';
    exchange->request.path = exchange->path;
    exchange->request.query = target[length] == '?' ? target + length + 1 : "";
    return NULL;
}

/* The client's X-Request-Id where it is harmless in headers and logs, otherwise one of ours. */
static void choose_id(struct exchange *exchange)
{
    static const char allowed[] =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ._-";
    const char *given = NULL;
    char *id = exchange->request.id;

    if (count_headers(exchange, "X-Request-Id", &given) == 1 && given[0] &&
        strlen(given) < sizeof exchange->request.id && strspn(given, allowed) == strlen(given)) {
        (void)snprintf(id, sizeof exchange->request.id, "%s", given);
        return;
    }
    request_id_make(exchange->http, id);
}

/* Whether the request is part of a trace. */
static void choose_trace(struct exchange *exchange)
{
    const char *given = NULL;

    if (count_headers(exchange, "traceparent", &given) == 1) {
        trace_continue(given, exchange->request.trace);
    }
}

/* Pages of foreign sites in a browser beside the service are kept out (origin.c). */
static const char *check_origin(struct exchange *exchange, const char *host)
{
    const struct http *http = exchange->http;
    const char *origin = NULL;

    if (!http->config.local_only && !http->config.open) {
        return NULL;
    }
    if (count_headers(exchange, "Origin", &origin) > 1) {
        return "A request has at most one Origin field.";
    }
    return origin_check(http->address, http->config.allowed_hosts, http->config.local_only,
                        exchange->request.method, host, cors_allows(http, origin) ? NULL : origin);
}

const char *guard_check(struct exchange *exchange, const char *version, int *status,
                        const char **code)
{
    const char *detail = NULL, *host = NULL;
    char authority[AUTHORITY_MAX];
    size_t hosts;

    *status = 400;
    *code = "malformed-request";
    exchange->close = true;
    (void)MHD_get_connection_values_n(exchange->mhd, MHD_HEADER_KIND, take_header, exchange);
    exchange->request.headers = exchange->headers;
    choose_id(exchange);
    choose_trace(exchange);
    if (!tap_saw(exchange->connection)) {
        *status = 500;
        *code = "internal-error";
        return "The HTTP library reads requests that were not looked at before.";
    }
    measure_body(exchange);
    hosts = count_headers(exchange, "Host", &host);
    if (hosts > 1 || (hosts == 0 && strcmp(version, "HTTP/1.1") == 0)) {
        return "A request has exactly one Host field.";
    }
    detail = check_repeats(exchange);
    if (!detail) {
        detail = take_authority(exchange->connection->target, &host, authority);
    }
    if (detail) {
        return detail;
    }
    detail = check_origin(exchange, host);
    if (detail) {
        *status = 403;
        *code = "forbidden";
        return detail;
    }
    detail = check_target(exchange);
    if (detail == no_memory) {
        *status = 503;
        *code = "out-of-memory";
    }
    exchange->close = detail != NULL;
    return detail;
}
