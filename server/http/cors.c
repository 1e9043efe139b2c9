/*
 * cors.c - pages of other origins that may call the service from a browser (the Fetch standard,
 * "HTTP CORS protocol"): an allow-list of origins, and nothing for all others.
 *
 * An answer to an origin of the list names it in Access-Control-Allow-Origin, and the headers of
 * ours that its scripts may read; an answer to its preflight (OPTIONS with Access-Control-Request-
 * Method) also the methods, which are those of Allow, and the request headers of this API. Cookies
 * are not used, so Access-Control-Allow-Credentials is never sent; a page sends its token itself.
 * Where there is a list, every answer varies by Origin, so that no cache mixes them up.
 *
 * An origin is compared byte for byte, scheme, host and port: that is how browsers write it.
 */
#include "http/internal.h"

#include <string.h>

#define PREFLIGHT_SECONDS 600 /* that a browser may keep the answer to a preflight */

static const char request_headers[] =
    "Authorization, Content-Type, Prefer, Idempotency-Key, If-Match, If-None-Match, If-Range, "
    "Range, Last-Event-ID, X-Request-Id, traceparent";
static const char response_headers[] =
    "Location, Link, ETag, Retry-After, Preference-Applied, Cache-Status, Content-Disposition, "
    "Accept-Ranges, Content-Range, WWW-Authenticate, X-Request-Id, Server-Timing, "
    "Srnfd-Relative-Energy, Srnfd-Offset, Srnfd-Deleted";

bool cors_allows(const struct http *http, const char *origin)
{
    const char *list = http->config.cors_origins;
    size_t length = origin ? strlen(origin) : 0;

    while (list && *list && length > 0) {
        size_t n;

        list += strspn(list, ", ");
        n = strcspn(list, ", ");
        if (n == length && memcmp(list, origin, n) == 0) {
            return true;
        }
        list += n;
    }
    return false;
}

/* The value that the response has for this header, or NULL. */
static const char *answered(const struct api_response *response, const char *name)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        if (strcmp(response->headers[i].name, name) == 0) {
            return response->headers[i].value;
        }
    }
    return NULL;
}

void cors_headers(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    const char *origin, *methods;

    if (!exchange->http->config.cors_origins || !exchange->http->config.cors_origins[0]) {
        return;
    }
    origin = api_request_header(&exchange->request, "Origin");
    methods = answered(response, "Allow");
    (void)api_response_header_text(response, "Vary", "Origin");
    if (!cors_allows(exchange->http, origin)) {
        return;
    }
    (void)api_response_header_text(response, "Access-Control-Allow-Origin", origin);
    if (strcmp(exchange->request.method, "OPTIONS") == 0 && methods &&
        api_request_header(&exchange->request, "Access-Control-Request-Method")) {
        (void)api_response_header_text(response, "Access-Control-Allow-Methods", methods);
        (void)api_response_header_text(response, "Access-Control-Allow-Headers", request_headers);
        (void)api_response_header(response, "Access-Control-Max-Age", "%d", PREFLIGHT_SECONDS);
    } else {
        (void)api_response_header_text(response, "Access-Control-Expose-Headers", response_headers);
    }
}
