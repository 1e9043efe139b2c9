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

/* The fields that are judged here. */
enum field {
    FIELD_AUTHORIZATION,
    FIELD_CONTENT_TYPE,
    FIELD_IDEMPOTENCY_KEY,
    FIELD_IF_RANGE,
    FIELD_LEASE_SECRET,
    FIELD_RANGE,
    FIELDS_ONCE, /* those before may come once */
    FIELD_CONTENT_LENGTH = FIELDS_ONCE,
    FIELD_HOST,
    FIELD_ORIGIN,
    FIELD_TRACEPARENT,
    FIELD_TRANSFER_ENCODING,
    FIELD_X_REQUEST_ID,
    FIELDS,
};

static const char *const names[FIELDS] = {
    "Authorization", "Content-Type", "Idempotency-Key",   "If-Range",
    "Lease-Secret",  "Range",        "Content-Length",    "Host",
    "Origin",        "traceparent",  "Transfer-Encoding", "X-Request-Id"};

/* How often each of them comes, and its last value. */
struct found {
    struct exchange *exchange;
    size_t count[FIELDS];
    const char *value[FIELDS];
};

static enum MHD_Result take_header(void *cls, enum MHD_ValueKind kind, const char *name,
                                   size_t name_length, const char *value, size_t value_length)
{
    struct found *found = cls;
    struct exchange *exchange = found->exchange;
    struct api_request *request = &exchange->request;
    struct api_header *header = &exchange->headers[request->n_headers];

    (void)kind;
    (void)name_length;
    (void)value_length;
    if (request->n_headers == HTTP_HEADERS_MAX) {
        return MHD_NO; /* head.c lets no more of them pass */
    }
    *header = (struct api_header){name, value ? value : ""};
    request->n_headers++;
    for (size_t i = 0; i < FIELDS; i++) {
        if (api_header_is(header, names[i])) {
            found->value[i] = header->value;
            found->count[i]++;
            break;
        }
    }
    return MHD_YES;
}

/* A field that can mean one thing only comes once: nobody knows which of two was meant, and a
   proxy in front may have judged the other one. Lists may come in parts (RFC 9110, 5.3). NULL: all
   is well. */
static const char *check_repeats(const struct found *found)
{
    static const char *const details[FIELDS_ONCE] = {
        "A request has at most one Authorization field.",
        "A request has at most one Content-Type field.",
        "A request has at most one Idempotency-Key field.",
        "A request has at most one If-Range field.",
        "A request has at most one Lease-Secret field.",
        "A request has at most one Range field.",
    };

    for (size_t i = 0; i < FIELDS_ONCE; i++) {
        if (found->count[i] > 1) {
            return details[i];
        }
    }
    return NULL;
}

/* How long the body is: head.c has seen to it that there is one answer. */
static void measure_body(struct exchange *exchange, const struct found *found)
{
    exchange->content_length = 0;
    if (found->count[FIELD_TRANSFER_ENCODING] > 0) {
        exchange->content_length = -1;
    } else if (found->count[FIELD_CONTENT_LENGTH] > 0) {
        exchange->content_length = strtoll(found->value[FIELD_CONTENT_LENGTH], NULL, 10);
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
    const char *target = exchange->connection->target, *escape;
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
    escape = memchr(target, '%', length);
    n = escape ? (size_t)(escape - target) : length;
    memcpy(exchange->path, target, n);
    for (size_t i = n; i < length; i++) {
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
static void choose_id(struct exchange *exchange, const struct found *found)
{
    static const char allowed[] =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ._-";
    const char *given = found->value[FIELD_X_REQUEST_ID];
    char *id = exchange->request.id;

    if (found->count[FIELD_X_REQUEST_ID] == 1 && given[0] &&
        strlen(given) < sizeof exchange->request.id && strspn(given, allowed) == strlen(given)) {
        (void)snprintf(id, sizeof exchange->request.id, "%s", given);
        return;
    }
    request_id_make(exchange->http, id);
}

/* Pages of foreign sites in a browser beside the service are kept out (origin.c). */
static const char *check_origin(const struct exchange *exchange, const struct found *found,
                                const char *host)
{
    const struct http *http = exchange->http;
    const char *origin = found->value[FIELD_ORIGIN];

    if (!http->config.local_only && !http->config.open) {
        return NULL;
    }
    if (found->count[FIELD_ORIGIN] > 1) {
        return "A request has at most one Origin field.";
    }
    return origin_check(http->address, http->config.allowed_hosts, http->config.local_only,
                        exchange->request.method, host, cors_allows(http, origin) ? NULL : origin);
}

const char *guard_check(struct exchange *exchange, const char *version, int *status,
                        const char **code)
{
    struct found found = {.exchange = exchange};
    const char *detail = NULL, *host = NULL;
    char authority[AUTHORITY_MAX];

    *status = 400;
    *code = "malformed-request";
    exchange->close = true;
    (void)MHD_get_connection_values_n(exchange->mhd, MHD_HEADER_KIND, take_header, &found);
    exchange->request.headers = exchange->headers;
    choose_id(exchange, &found);
    if (found.count[FIELD_TRACEPARENT] == 1) {
        trace_continue(found.value[FIELD_TRACEPARENT], exchange->request.trace);
    }
    if (!tap_saw(exchange->connection)) {
        *status = 500;
        *code = "internal-error";
        return "The HTTP library reads requests that were not looked at before.";
    }
    measure_body(exchange, &found);
    host = found.value[FIELD_HOST];
    if (found.count[FIELD_HOST] > 1 || (!host && strcmp(version, "HTTP/1.1") == 0)) {
        return "A request has exactly one Host field.";
    }
    detail = check_repeats(&found);
    if (!detail) {
        detail = take_authority(exchange->connection->target, &host, authority);
    }
    if (detail) {
        return detail;
    }
    detail = check_origin(exchange, &found, host);
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
