/*
 * prefer.c - reads respond-async and wait=N out of Prefer headers (RFC 7240): preferences are
 * separated by commas, may carry parameters after a semicolon, and the first of two with the same
 * name counts.
 */
#include "api/prefer.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#define WAIT_DIGITS_MAX 6

static void read_preference(const char *text, size_t length, struct prefer *prefer)
{
    size_t name_length = 0, digits = 0;
    const char *value;

    while (name_length < length &&
           (isalnum((unsigned char)text[name_length]) || text[name_length] == '-')) {
        name_length++;
    }
    if (name_length == 13 && strncasecmp(text, "respond-async", 13) == 0) {
        prefer->respond_async = true;
    }
    if (name_length != 4 || strncasecmp(text, "wait", 4) != 0 || prefer->has_wait) {
        return;
    }
    value = text + 4;
    while (value < text + length && (*value == ' ' || *value == '=' || *value == '"')) {
        value++;
    }
    while (value + digits < text + length && isdigit((unsigned char)value[digits])) {
        digits++;
    }
    if (digits > 0 && digits <= WAIT_DIGITS_MAX) {
        prefer->has_wait = true;
        prefer->wait = (double)strtol(value, NULL, 10);
    }
}

void prefer_read(const struct api_request *request, struct prefer *prefer)
{
    memset(prefer, 0, sizeof *prefer);
    for (size_t i = 0; i < request->n_headers; i++) {
        const char *text = request->headers[i].value;

        if (!api_header_is(&request->headers[i], "Prefer")) {
            continue;
        }
        while (*text) {
            size_t span = strcspn(text, ",");
            size_t skip = strspn(text, " \t");

            if (skip < span) {
                read_preference(text + skip, span - skip, prefer);
            }
            text += span + (text[span] == ',');
        }
    }
}
