/*
 * guard.c - the first look at a request, before any byte of its body is read.
 *
 * libmicrohttpd accepts shapes on which two servers in a row may disagree about where a request
 * ends (request smuggling): Transfer-Encoding together with Content-Length, several
 * Content-Lengths, codings other than chunked. They are refused here and the connection is closed.
 * It also cuts a path at %00; so the target is taken raw, from the log callback, and decoded here:
 * a zero byte, an encoded slash and a broken escape are refused. Raw zero bytes it takes for the
 * end of the target: then the version, which it cuts off the line's end, does not stand right
 * behind.
 *
 * The first request of a connection has been judged by its bytes before (front.c), the later ones
 * have not. Of these libmicrohttpd answers some by itself before anything here is called, with 400,
 * 413 or 431 and a page of its own, and closes: a Content-Length that is no number, a head beyond
 * its memory for a connection. It joins folded lines, as RFC 9112 (5.2) allows; and it takes a
 * line feed alone for the end of a line, and zero bytes for the end of a value. Of that the
 * strings that it hands out still tell, since they are cut in place from the lines: line_is_whole
 * looks at what lies between two of them. The last line of a head, with nothing behind it, is not
 * judged so.
 */
#include "http/internal.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define LINE_GAP_MAX 4096 /* between two lines that lie in the same buffer */

static bool is_field_value(const char *text, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)text[i];

        if ((c < 0x20 && c != '\t') || c == 0x7f) {
            return false;
        }
    }
    return true;
}

static enum MHD_Result take_header(void *cls, enum MHD_ValueKind kind, const char *name,
                                   size_t name_length, const char *value, size_t value_length)
{
    struct exchange *exchange = cls;
    struct api_request *request = &exchange->request;

    (void)kind;
    exchange->header_bytes += name_length + value_length + 4;
    if (request->n_headers == HTTP_HEADERS_MAX || exchange->header_bytes > HEAD_FIELD_BYTES_MAX) {
        exchange->header_overflow = true;
        return MHD_NO;
    }
    exchange->headers[request->n_headers].name = name;
    exchange->headers[request->n_headers].value = value ? value : "";
    request->n_headers++;
    if (!head_is_token(name, name_length) || (value && !is_field_value(value, value_length))) {
        exchange->content_length = -2;
        return MHD_NO;
    }
    return MHD_YES;
}

/* Whether a line's text, which ends at end with its zero, is followed by the next line as after
   CR LF, of which both bytes have become zero. Strings that do not lie one behind the other, since
   one was moved, prove nothing. */
static bool line_is_whole(const char *end, const char *next)
{
    uintptr_t from = (uintptr_t)end, to = (uintptr_t)next;

    if (to <= from || to - from > LINE_GAP_MAX) {
        return true;
    }
    if (to - from == 1) {
        return false;
    }
    for (const char *at = end + 1; at + 1 < next; at++) {
        if (*at != '\0' && *at != ' ' && *at != '\t') {
            return false;
        }
    }
    return true;
}

/* The same for the request line and all fields but the last. */
static bool lines_are_whole(const struct exchange *exchange, const char *version)
{
    const char *end = version + strlen(version);

    for (size_t i = 0; i < exchange->request.n_headers; i++) {
        if (!line_is_whole(end, exchange->headers[i].name)) {
            return false;
        }
        end = exchange->headers[i].value + strlen(exchange->headers[i].value);
    }
    return true;
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

/* How the end of the body is told; NULL when there is one way only. */
static const char *check_framing(struct exchange *exchange)
{
    const char *length = NULL, *coding = NULL;
    size_t lengths = count_headers(exchange, "Content-Length", &length);
    size_t codings = count_headers(exchange, "Transfer-Encoding", &coding);

    exchange->content_length = 0;
    if (lengths > 0 && codings > 0) {
        return "Content-Length and Transfer-Encoding exclude each other.";
    }
    if (lengths > 1) {
        return "Content-Length is given more than once.";
    }
    if (codings > 1 || (codings == 1 && strcasecmp(coding, "chunked") != 0)) {
        return "The one Transfer-Encoding that is understood is chunked, given once.";
    }
    if (codings == 1) {
        exchange->content_length = -1;
    }
    if (lengths == 1) {
        size_t digits = strspn(length, "0123456789");

        if (digits == 0 || digits > 18 || length[digits]) {
            return "Content-Length is not a number of bytes.";
        }
        exchange->content_length = strtoll(length, NULL, 10);
    }
    return NULL;
}

static int hex_value(char c)
{
    const char *digits = "0123456789abcdef0123456789ABCDEF", *found = c ? strchr(digits, c) : NULL;

    return found ? (int)((found - digits) % 16) : -1;
}

static const char no_memory[] = "There is not enough memory for the path.";

/* Decodes the target's path into exchange->path and sets the query. */
static const char *check_target(struct exchange *exchange)
{
    const char *target = exchange->connection->target;
    size_t length, n = 0;

    if (strncasecmp(target, "http://", 7) == 0) {
        target += 7 + strcspn(target + 7, "/?");
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
    http_make_id(exchange->http, id);
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
    size_t hosts;

    *status = 400;
    *code = "malformed-request";
    exchange->close = true;
    (void)MHD_get_connection_values_n(exchange->mhd, MHD_HEADER_KIND, take_header, exchange);
    exchange->request.headers = exchange->headers;
    choose_id(exchange);
    choose_trace(exchange);
    if (version != exchange->connection->target_end) {
        return "The request line has a zero byte, or is not a method, a target and a version.";
    }
    if (!lines_are_whole(exchange, version)) {
        return "The head has a zero byte, or a line that does not end in CR LF.";
    }
    if (exchange->header_overflow) {
        *status = 431;
        *code = "headers-too-large";
        return "The header fields exceed 16 KiB or 64 fields.";
    }
    if (exchange->content_length == -2) {
        return "A header field has characters that it must not have.";
    }
    if (strlen(exchange->connection->target) > HEAD_TARGET_MAX) {
        *status = 414;
        *code = "uri-too-long";
        return "The request target exceeds 8 KiB.";
    }
    detail = check_framing(exchange);
    if (detail) {
        return detail;
    }
    hosts = count_headers(exchange, "Host", &host);
    if (hosts > 1 || (hosts == 0 && strcmp(version, "HTTP/1.1") == 0)) {
        return "A request has exactly one Host field.";
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
