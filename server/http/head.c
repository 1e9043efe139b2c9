/*
 * head.c - the form of a request's head (RFC 9112, 2 to 6; RFC 9110, 5), strictly.
 *
 *   head = *1CRLF  method SP target SP "HTTP/1." ("0" / "1") CRLF  *( name ":" value CRLF )  CRLF
 *
 * Refused is everything on which two servers in a row might disagree: a line feed without its
 * carriage return or the other way round, control characters and zero bytes anywhere, folded
 * lines, blanks before a colon, several Content-Lengths or one that is no number, Content-Length
 * together with Transfer-Encoding, codings other than chunked; and what is longer, or has more
 * parts, than the limits of head.h. The cost is one pass over the bytes. Which Host and which
 * target are meant is not judged here (guard.c).
 */
#include "http/head.h"

#include "text.h"

#include <stdint.h>
#include <string.h>
#include <strings.h>

/* A record of TLS: its type, that of a handshake, its version, its length in two bytes. */
#define TLS_HANDSHAKE 22
#define TLS_MAJOR 3
#define TLS_HEADER ((size_t)5)
#define TLS_RECORD_MAX ((size_t)1 << 14)
#define LENGTH_DIGITS_MAX 18 /* of a Content-Length that fits an int64_t */

struct head {
    struct head_refusal *refusal;
    size_t fields, field_bytes;
    size_t items, copied; /* fields, query parameters and cookies; bytes of cookies */
    size_t lengths, codings;
    uint64_t length;
    bool old;                  /* HTTP/1.0, which knows no chunks */
    const char *value;         /* of the field that tells the body's end */
    size_t value_size, blanks; /* its bytes, and blanks behind it */
};

static enum head_verdict refuse(struct head *head, int status, const char *code, const char *detail)
{
    *head->refusal = (struct head_refusal){status, code, detail};
    return HEAD_REFUSED;
}

static enum head_verdict malformed(struct head *head, const char *detail)
{
    return refuse(head, 400, "malformed-request", detail);
}

/* The bits of the characters from 0 to 127 that a token may have: "!#$%&'*+-.^_`|~", digits and
   letters. */
static const uint64_t token_characters[2] = {UINT64_C(0x03ff6cfa00000000),
                                             UINT64_C(0x57ffffffc7fffffe)};

static bool is_token(const char *text, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)text[i];

        if (c > 127 || !(token_characters[c >> 6] >> (c & 63) & 1)) {
            return false;
        }
    }
    return length > 0;
}

static bool is_called(const char *text, size_t length, const char *name)
{
    return strlen(name) == length && strncasecmp(text, name, length) == 0;
}

/* ---- The request line ------------------------------------------------------------------------ */

static enum head_verdict check_version(struct head *head, const char *text, size_t length)
{
    if (length != 8 || memcmp(text, "HTTP/", 5) != 0) {
        return malformed(head, "The request line does not end in a version of HTTP.");
    }
    if (memcmp(text + 5, "1.0", 3) != 0 && memcmp(text + 5, "1.1", 3) != 0) {
        return refuse(head, 505, "http-version-not-supported",
                      "The service speaks HTTP/1.1 and HTTP/1.0.");
    }
    head->old = text[7] == '0';
    return HEAD_COMPLETE;
}

static size_t count(const char *text, size_t length, char mark)
{
    size_t found = 0;

    for (size_t i = 0; i < length; i++) {
        found += text[i] == mark;
    }
    return found;
}

/* The query's parameters. */
static enum head_verdict check_query(struct head *head, const char *target, size_t length)
{
    const char *query = memchr(target, '?', length);
    size_t parameters = query ? 1 + count(query, length - (size_t)(query - target), '&') : 0;

    if (parameters > HEAD_PARAMETERS_MAX) {
        return refuse(head, 414, "uri-too-long", "The query has more than 128 parameters.");
    }
    head->items += parameters;
    return HEAD_COMPLETE;
}

static enum head_verdict check_request_line(struct head *head, const char *line, size_t length)
{
    const char *first = memchr(line, ' ', length), *second;
    size_t method = first ? (size_t)(first - line) : length, target;

    if (!first || !is_token(line, method)) {
        return malformed(head, "The request line does not start with a method and a blank.");
    }
    if (method > HEAD_METHOD_MAX) {
        return malformed(head, "The method has more than 32 characters.");
    }
    second = memchr(first + 1, ' ', length - method - 1);
    target = second ? (size_t)(second - first) - 1 : 0;
    if (target == 0) {
        return malformed(head, "The request line is not a method, a target and a version.");
    }
    if (target > HEAD_TARGET_MAX) {
        return refuse(head, 414, "uri-too-long", "The request target exceeds 8 KiB.");
    }
    if (check_query(head, first + 1, target) == HEAD_REFUSED) {
        return HEAD_REFUSED;
    }
    return check_version(head, second + 1, length - method - target - 2);
}

/* ---- Fields ---------------------------------------------------------------------------------- */

/* How the end of the body is told. value is without blanks around it. */
static enum head_verdict check_framing(struct head *head, const char *name, size_t name_length,
                                       const char *value, size_t length)
{
    if (is_called(name, name_length, "Transfer-Encoding")) {
        if (head->codings++ > 0 || !is_called(value, length, "chunked")) {
            return malformed(head, "The one Transfer-Encoding that is understood is chunked, "
                                   "given once.");
        }
    } else if (is_called(name, name_length, "Content-Length")) {
        size_t digits = 0;

        head->length = 0;
        while (digits < length && value[digits] >= '0' && value[digits] <= '9') {
            head->length = 10 * head->length + (uint64_t)(value[digits] - '0');
            digits++;
        }
        if (head->lengths++ > 0) {
            return malformed(head, "Content-Length is given more than once.");
        }
        if (digits == 0 || digits < length) {
            return malformed(head, "Content-Length is not a number of bytes.");
        }
        if (digits > LENGTH_DIGITS_MAX) {
            return refuse(head, 413, "body-too-large", "The body is larger than any limit.");
        }
    }
    if (head->lengths > 0 && head->codings > 0) {
        return malformed(head, "Content-Length and Transfer-Encoding exclude each other.");
    }
    if (head->codings > 0 && head->old) {
        return malformed(head, "HTTP/1.0 has no Transfer-Encoding.");
    }
    return HEAD_COMPLETE;
}

/* Leaves out the blanks around the value; returns how many are behind it. */
static size_t trim(const char **value, size_t *length)
{
    size_t whole;

    while (*length > 0 && (**value == ' ' || **value == '\t')) {
        (*value)++;
        (*length)--;
    }
    whole = *length;
    while (*length > 0 && ((*value)[*length - 1] == ' ' || (*value)[*length - 1] == '\t')) {
        (*length)--;
    }
    return whole - *length;
}

static enum head_verdict check_field(struct head *head, const char *line, size_t length)
{
    const char *colon = memchr(line, ':', length), *value;
    size_t name = colon ? (size_t)(colon - line) : 0, framing = head->lengths + head->codings;
    enum head_verdict verdict;
    size_t blanks;

    if (line[0] == ' ' || line[0] == '\t') {
        return malformed(head, "A header field goes on in the next line.");
    }
    if (!is_token(line, name)) {
        return malformed(head, "A header field has characters in its name that it must not have, "
                               "or no colon right after it.");
    }
    head->field_bytes += length + 2;
    if (++head->fields > HEAD_FIELDS_MAX || head->field_bytes > HEAD_FIELD_BYTES_MAX) {
        return refuse(head, 431, "headers-too-large",
                      "The header fields exceed 16 KiB or 64 fields.");
    }
    value = colon + 1;
    length -= name + 1;
    blanks = trim(&value, &length);
    head->items++;
    if (is_called(line, name, "Cookie")) {
        head->items += 1 + count(value, length, ';');
        head->copied += length + 1;
    }
    verdict = check_framing(head, line, name, value, length);
    if (head->lengths + head->codings > framing) {
        head->value = value;
        head->value_size = length;
        head->blanks = blanks;
    }
    return verdict;
}

/* ---- Lines ----------------------------------------------------------------------------------- */

/* The length of the line at text without its CRLF; SIZE_MAX where a byte must not be there. *whole
   says whether its end has come. Blanks: space, and tab where a field may have it. */
static size_t line_length(const char *text, size_t size, bool tabs, bool *whole)
{
    size_t i = 0;

    *whole = false;
    /* Most bytes are no control characters: eight at once are passed over. */
    while (i + 8 <= size) {
        uint64_t bytes = text_eight(text + i);

        if (text_any_below(bytes, 0x20) | text_any_is(bytes, 0x7f)) {
            break;
        }
        i += 8;
    }
    for (; i < size; i++) {
        unsigned char c = (unsigned char)text[i];

        if (c == '\r') {
            *whole = i + 1 < size;
            return !*whole || text[i + 1] == '\n' ? i : SIZE_MAX;
        }
        if ((c < 0x20 && !(c == '\t' && tabs)) || c == 0x7f) {
            return SIZE_MAX;
        }
    }
    return size;
}

/* The end has not come: is there room for it? */
static enum head_verdict unfinished(struct head *head, bool in_request_line, size_t rest)
{
    if (in_request_line && rest > HEAD_METHOD_MAX + HEAD_TARGET_MAX + 16) {
        return refuse(head, 414, "uri-too-long", "The request target exceeds 8 KiB.");
    }
    if (!in_request_line && head->field_bytes + rest > HEAD_FIELD_BYTES_MAX) {
        return refuse(head, 431, "headers-too-large",
                      "The header fields exceed 16 KiB or 64 fields.");
    }
    return HEAD_INCOMPLETE;
}

/* Whether libmicrohttpd has room for all its parts, of a head of this size. */
static enum head_verdict check_memory(struct head *head, size_t size)
{
    size_t items = head->items * HEAD_ITEM_BYTES + head->copied;

    if (items > HEAD_ITEMS_BYTES_MAX || size + items > HEAD_MEMORY_MAX) {
        return refuse(head, 431, "headers-too-large",
                      "The header fields, cookies and query parameters are too many, or too long, "
                      "together.");
    }
    return HEAD_COMPLETE;
}

enum head_verdict head_check(const char *bytes, size_t size, struct head_refusal *refusal)
{
    struct head_end end;

    return head_read(bytes, size, refusal, &end);
}

enum head_verdict head_read(const char *bytes, size_t size, struct head_refusal *refusal,
                            struct head_end *end)
{
    struct head head = {.refusal = refusal};
    enum head_verdict verdict = HEAD_COMPLETE;
    bool request_line = true, whole;
    size_t at = 0;

    if (size >= 2 && bytes[0] == '\r' && bytes[1] == '\n') {
        at = 2;
    }
    if (size > 0 && bytes[0] == 0x16) {
        return malformed(&head, "This port speaks plain HTTP, not TLS.");
    }
    while (verdict == HEAD_COMPLETE) {
        size_t length = line_length(bytes + at, size - at, !request_line, &whole);

        if (length == SIZE_MAX) {
            return malformed(&head, "The head has a character that it must not have, or a line "
                                    "that does not end in CR LF.");
        }
        if (!whole) {
            return unfinished(&head, request_line, size - at);
        }
        if (length == 0 && !request_line) {
            *end = (struct head_end){.size = at + 2,
                                     .chunked = head.codings > 0,
                                     .length = head.length,
                                     .value = head.value ? (size_t)(head.value - bytes) : 0,
                                     .value_size = head.value_size,
                                     .blanks = head.blanks};
            return check_memory(&head, at + 2);
        }
        verdict = request_line ? check_request_line(&head, bytes + at, length)
                               : check_field(&head, bytes + at, length);
        request_line = false;
        at += length + 2;
    }
    return verdict;
}

const char *head_field(const char *bytes, size_t size, const char *name, size_t *length)
{
    size_t name_length = strlen(name);
    const char *end = bytes + size, *line = memmem(bytes, size, "\r\n", 2), *next;

    while (line && (next = memmem(line + 2, (size_t)(end - line) - 2, "\r\n", 2)) != NULL) {
        line += 2;
        if ((size_t)(next - line) > name_length && line[name_length] == ':' &&
            strncasecmp(line, name, name_length) == 0) {
            const char *value = line + name_length + 1;

            *length = (size_t)(next - value);
            (void)trim(&value, length);
            return value;
        }
        line = next == line ? NULL : next; /* what follows the empty line is the body */
    }
    return NULL;
}

enum head_verdict head_check_tls(const char *bytes, size_t size, struct head_refusal *refusal)
{
    static const unsigned char start[] = {TLS_HANDSHAKE, TLS_MAJOR};
    struct head head = {.refusal = refusal};
    const unsigned char *record = (const unsigned char *)bytes;
    size_t length;

    if (memcmp(record, start, size < sizeof start ? size : sizeof start) != 0) {
        return malformed(&head, "This port speaks TLS.");
    }
    if (size < TLS_HEADER) {
        return HEAD_INCOMPLETE;
    }
    length = (size_t)record[3] << 8 | record[4];
    if (length == 0 || length > TLS_RECORD_MAX) {
        return malformed(&head, "The first record of TLS has no valid length.");
    }
    return size < TLS_HEADER + length ? HEAD_INCOMPLETE : HEAD_COMPLETE;
}
