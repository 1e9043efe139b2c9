/*
 * respond.c - how handlers answer and read what came: JSON and bytes out, query parameters and JSON
 * bodies in, entity tags.
 *
 * The texts that come in are a client's: each parser says what it refuses, and every size has a
 * limit. JSON bodies are refused when an object names a member twice or when bytes follow the
 * document; jansson limits their depth.
 */
#include "api/respond.h"
#include "api/json_memory.h"
#include "api/routes.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define TAG_MAX ((size_t)160)
#define HEADER_VALUE_MAX 4096 /* a link to the next page has a cursor and filters */

/* ---- Out ------------------------------------------------------------------------------------- */

/* Whether the value lies in the response itself. */
static bool is_short(const struct api_response *response, const char *value)
{
    uintptr_t start = (uintptr_t)response->short_values, at = (uintptr_t)value;

    return at >= start && at < start + API_VALUES_SIZE;
}

void api_response_drop_last(struct api_response *response)
{
    union {
        const char *constant;
        char *owned;
    } value = {response->headers[--response->n_headers].value};

    if (!is_short(response, value.constant)) {
        free(value.owned);
    }
}

void api_response_clear(struct api_response *response)
{
    while (response->n_headers > 0) {
        api_response_drop_last(response);
    }
    free(response->body);
    if (response->body_file) {
        (void)close(response->body_file - 1);
    }
    if (response->wait.state) {
        response->wait.free_state(response->wait.state);
    }
    if (response->stream.state) {
        response->stream.free_state(response->stream.state);
    }
    memset(response, 0, offsetof(struct api_response, headers));
}

int api_response_header_text(struct api_response *response, const char *name, const char *value)
{
    size_t size = strlen(value) + 1;
    char *copy = NULL;

    if (response->n_headers == API_HEADERS_MAX || size > HEADER_VALUE_MAX) {
        return -1;
    }
    if (size <= API_VALUES_SIZE - response->short_used) {
        copy = response->short_values + response->short_used;
        response->short_used += size;
    } else {
        copy = malloc(size);
    }
    if (!copy) {
        response->lacking = true;
        return -1;
    }
    memcpy(copy, value, size);
    response->headers[response->n_headers].name = name;
    response->headers[response->n_headers].value = copy;
    response->n_headers++;
    return 0;
}

int api_response_header(struct api_response *response, const char *name, const char *format, ...)
{
    char value[HEADER_VALUE_MAX];
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(value, sizeof value, format, arguments);
    va_end(arguments);
    return length < 0 || (size_t)length >= sizeof value
               ? -1
               : api_response_header_text(response, name, value);
}

void response_json(struct api_response *response, int status, const char *content_type,
                   json_t *document)
{
    static const char internal[] = "{\"type\":\"urn:srnfd:problem:internal-error\",\"status\":500,"
                                   "\"code\":\"internal-error\"}\n";
    static const char no_memory[] = "{\"type\":\"urn:srnfd:problem:out-of-memory\",\"status\":503,"
                                    "\"code\":\"out-of-memory\"}\n";
    char *text = document ? json_memory_dumps(document, JSON_COMPACT) : NULL;
    size_t length = text ? strlen(text) : 0;
    char *line = text ? realloc(text, length + 1) : NULL;
    bool short_of_memory = text || json_memory_failed(); /* unless there is a line */

    json_decref(document);
    response->status = line ? status : short_of_memory ? 503 : 500;
    if (line) {
        line[length++] = '\n';
    } else {
        free(text);
        line = strdup(short_of_memory ? no_memory : internal);
        length = line ? strlen(line) : 0;
        response->lacking = !line;
        content_type = "application/problem+json";
    }
    json_memory_begin();
    free(response->body);
    response->static_body = NULL;
    response->body = (unsigned char *)line;
    response->body_size = length;
    (void)api_response_header_text(response, "Content-Type", content_type);
}

void respond_json(struct api_call *call, int status, json_t *document)
{
    if (!document && !json_memory_failed()) {
        (void)problem_respond(call, "internal-error", "The answer could not be written as JSON.");
        return;
    }
    response_json(call->response, status, "application/json", document);
}

void respond_bytes(struct api_call *call, int status, const char *content_type,
                   unsigned char *bytes, size_t size)
{
    free(call->response->body);
    call->response->status = status;
    call->response->body = bytes;
    call->response->static_body = NULL;
    call->response->body_size = size;
    (void)api_response_header_text(call->response, "Content-Type", content_type);
}

void respond_static(struct api_call *call, int status, const char *content_type, const void *bytes,
                    size_t size)
{
    respond_bytes(call, status, content_type, NULL, size);
    call->response->static_body = bytes;
}

json_t *json_time(int64_t ms)
{
    time_t seconds = (time_t)(ms / 1000);
    struct tm parts;
    char day[32], text[48];

    if (ms <= 0 || !gmtime_r(&seconds, &parts)) {
        return json_null();
    }
    (void)strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &parts);
    (void)snprintf(text, sizeof text, "%s.%03dZ", day, (int)(ms % 1000));
    return json_string(text);
}

/* Whether a list of entity tags has this one, or is *. A weak one is of the same version, which was
   sent packed (transmit.c). A resource without a tag (NULL) is meant by * alone. */
static bool names_tag(const char *list, const char *tag)
{
    char quoted[160], weak[164];

    (void)snprintf(quoted, sizeof quoted, "\"%s\"", tag ? tag : "");
    (void)snprintf(weak, sizeof weak, "W/%s", quoted);
    return list_has_exactly(list, "*") ||
           (tag && (list_has_exactly(list, quoted) || list_has_exactly(list, weak)));
}

/* Without printf(3), which took 1,100 of the 45,000 instructions of a small result. */
static void add_tag(struct api_response *response, const char *tag)
{
    char quoted[TAG_MAX + 3];
    size_t length = strlen(tag);

    if (length > TAG_MAX) {
        (void)api_response_header(response, "ETag", "\"%s\"", tag);
        return;
    }
    quoted[0] = '"';
    memcpy(quoted + 1, tag, length);
    memcpy(quoted + 1 + length, "\"", 2);
    (void)api_response_header_text(response, "ETag", quoted);
}

/* The same of all fields of a name: a list may come in parts. */
static bool condition_names(const struct api_call *call, const char *field, const char *tag)
{
    const struct api_request *request = call->request;

    for (size_t i = 0; i < request->n_headers; i++) {
        if (api_header_is(&request->headers[i], field) &&
            names_tag(request->headers[i].value, tag)) {
            return true;
        }
    }
    return false;
}

/* Whether If-Match names none of what is there: then 412 is answered. */
static bool match_failed(struct api_call *call, const char *tag)
{
    const char *wanted = api_request_header(call->request, "If-Match");

    if (!wanted || condition_names(call, "If-Match", tag)) {
        return false;
    }
    if (!tag) {
        (void)problem_respond(call, "precondition-failed",
                              "If-Match names %.80s, but a job that has not ended has no tag.",
                              wanted);
    } else {
        (void)problem_respond(call, "precondition-failed",
                              "If-Match names %.80s, but the tag is \"%s\" now: it is another one "
                              "than you have seen.",
                              wanted, tag);
    }
    return true;
}

/* Only of a GET and a HEAD: what changes something answers with the record and its new tag, and
   its conditions were judged before the change (respond_precondition_failed). */
static bool not_modified(struct api_call *call, const char *tag, const char *caching)
{
    const char *method = call->request->method;
    bool reads = strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0;

    if (reads && match_failed(call, tag)) {
        return true;
    }
    add_tag(call->response, tag);
    (void)api_response_header_text(call->response, "Cache-Control", caching);
    if (!reads || !condition_names(call, "If-None-Match", tag)) {
        return false;
    }
    /* As the 200 that it stands for has where it may be packed (transmit.c). */
    (void)api_response_header_text(call->response, "Vary", "Accept-Encoding");
    call->response->status = 304;
    return true;
}

bool respond_not_modified(struct api_call *call, const char *tag)
{
    return not_modified(call, tag, "private, no-cache");
}

bool respond_not_modified_ever(struct api_call *call, const char *tag)
{
    return not_modified(call, tag, "private, max-age=31536000, immutable");
}

bool respond_precondition_failed(struct api_call *call, const char *tag)
{
    if (match_failed(call, tag)) {
        return true;
    }
    if (condition_names(call, "If-None-Match", tag)) {
        (void)problem_respond(call, "precondition-failed",
                              "If-None-Match names %.80s, and that is what is there.",
                              api_request_header(call->request, "If-None-Match"));
        return true;
    }
    return false;
}

/* ---- In -------------------------------------------------------------------------------------- */

const char *api_request_header(const struct api_request *request, const char *name)
{
    for (size_t i = 0; i < request->n_headers; i++) {
        if (api_header_is(&request->headers[i], name)) {
            return request->headers[i].value;
        }
    }
    return NULL;
}

/* compare: strncmp or strncasecmp. */
static bool list_holds(const char *list, const char *token,
                       int (*compare)(const char *a, const char *b, size_t size))
{
    size_t length = strlen(token);

    while (*list) {
        size_t span = strcspn(list, ",");
        const char *start = list, *end = list + span;

        while (start < end && isspace((unsigned char)*start)) {
            start++;
        }
        while (end > start && isspace((unsigned char)end[-1])) {
            end--;
        }
        if ((size_t)(end - start) == length && compare(start, token, length) == 0) {
            return true;
        }
        list += span + (list[span] == ',');
    }
    return false;
}

bool list_has(const char *list, const char *token)
{
    return list_holds(list, token, strncasecmp);
}

bool list_has_exactly(const char *list, const char *token)
{
    return list_holds(list, token, strncmp);
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'a' && c <= 'f') {
        return c - 'a' + 10;
    }
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

bool percent_decode(const char *text, size_t length, bool plus_is_space, char *buffer, size_t size)
{
    size_t n = 0;

    for (size_t i = 0; i < length; i++) {
        int c = (unsigned char)text[i];

        if (c == '%') {
            int high = i + 1 < length ? hex_digit(text[i + 1]) : -1;
            int low = i + 2 < length ? hex_digit(text[i + 2]) : -1;

            if (high < 0 || low < 0 || (high == 0 && low == 0)) {
                return false;
            }
            c = high * 16 + low;
            i += 2;
        } else if (c == '+' && plus_is_space) {
            c = ' ';
        }
        if (n + 1 >= size) {
            return false;
        }
        buffer[n++] = (char)c;
    }
    if (size == 0) {
        return false;
    }
    buffer[n] = '\0';
    return true;
}

bool query_next(const char **cursor, struct query_pair *pair)
{
    size_t span;

    while (**cursor == '&') {
        (*cursor)++;
    }
    span = strcspn(*cursor, "&");
    if (span == 0) {
        return false;
    }
    pair->name = *cursor;
    pair->name_length = strcspn(*cursor, "=&");
    pair->value = pair->name + pair->name_length + (pair->name_length < span);
    pair->value_length = span - (size_t)(pair->value - pair->name);
    *cursor += span;
    return true;
}

bool query_get(struct api_call *call, const char *name, char *buffer, size_t size, bool *refused)
{
    const char *cursor = call->request->query;
    size_t length = strlen(name);
    struct query_pair pair;

    if (refused) {
        *refused = false;
    }
    while (query_next(&cursor, &pair)) {
        if (pair.name_length != length || strncmp(pair.name, name, length) != 0) {
            continue;
        }
        if (percent_decode(pair.value, pair.value_length, true, buffer, size)) {
            return true;
        }
        if (refused) {
            *refused = true;
        }
        (void)problem_respond(call, "malformed-request",
                              "The query parameter %s is not well escaped, or longer than the %zu "
                              "bytes that it may have.",
                              name, size - 1);
        return false;
    }
    return false;
}

bool query_whole(const char *text, long *number)
{
    size_t digits = strspn(text, "0123456789");

    if (digits == 0 || digits > 9 || text[digits]) {
        return false;
    }
    *number = strtol(text, NULL, 10);
    return true;
}

bool query_number(const char **text, double *number)
{
    static const char digits[] = "0123456789";
    const char *at = *text + strspn(*text, "+-");
    size_t whole = strspn(at, digits), fraction = 0;
    double value;

    if (at > *text + 1) {
        return false;
    }
    at += whole;
    if (*at == '.') {
        fraction = strspn(at + 1, digits);
        at += 1 + fraction;
    }
    if (whole + fraction == 0) {
        return false;
    }
    if (*at == 'e' || *at == 'E') {
        const char *power = at + 1 + (at[1] == '+' || at[1] == '-');

        if (strspn(power, digits) == 0) {
            return false;
        }
        at = power + strspn(power, digits);
    }
    if (*at == 'x' || *at == 'X') { /* strtod goes on there */
        return false;
    }
    value = strtod(*text, NULL);
    if (!isfinite(value)) {
        return false;
    }
    *number = value;
    *text = at;
    return true;
}

const char *name_problem(const char *name)
{
    size_t characters = 0;

    for (const unsigned char *at = (const unsigned char *)name; *at; at++) {
        bool control = *at < 0x20 || *at == 0x7f || (*at == 0xc2 && at[1] >= 0x80 && at[1] < 0xa0);

        if (control) {
            return "must not have control characters";
        }
        characters += (*at & 0xc0) != 0x80;
    }
    return characters > NAME_CHARACTERS_MAX ? "has more than 255 characters" : NULL;
}
