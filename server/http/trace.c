/*
 * trace.c - the traceparent header (W3C Trace Context, level 1): version-traceid-parentid-flags.
 *
 * A valid one is taken over: its trace id and sampling flag stay, and the parent id becomes that of
 * this request, a random one. Anything else is passed over, as the recommendation asks, and the
 * request belongs to no trace.
 */
#include "http/internal.h"

#include <sodium.h>
#include <stdio.h>
#include <string.h>

#define TRACE_ID 32
#define PARENT_ID 16
#define TRACEPARENT_LENGTH (2 + 1 + TRACE_ID + 1 + PARENT_ID + 1 + 2)

/* Whether count digits of lower case hexadecimal stand here; *zero: and all of them are 0. */
static bool is_hex(const char *text, size_t count, bool *zero)
{
    *zero = strspn(text, "0") >= count;
    return strspn(text, "0123456789abcdef") >= count;
}

static bool is_valid(const char *text)
{
    size_t length = strlen(text);
    bool zero;

    if (length < TRACEPARENT_LENGTH || text[2] != '-' || text[35] != '-' || text[52] != '-') {
        return false;
    }
    /* Later versions may append to it, after another dash. */
    if (strncmp(text, "00", 2) == 0
            ? length > TRACEPARENT_LENGTH
            : text[TRACEPARENT_LENGTH] != '\0' && text[TRACEPARENT_LENGTH] != '-') {
        return false;
    }
    if (!is_hex(text, 2, &zero) || strncmp(text, "ff", 2) == 0 || !is_hex(text + 53, 2, &zero)) {
        return false;
    }
    return is_hex(text + 3, TRACE_ID, &zero) && !zero && is_hex(text + 36, PARENT_ID, &zero) &&
           !zero;
}

void trace_continue(const char *given, char trace[TRACEPARENT_LENGTH + 1])
{
    unsigned char bytes[PARENT_ID / 2];
    char parent[PARENT_ID + 1];
    bool sampled;

    trace[0] = '\0';
    if (!given || !is_valid(given)) {
        return;
    }
    sampled = strchr("13579bdf", given[54]) != NULL;
    randombytes_buf(bytes, sizeof bytes);
    (void)sodium_bin2hex(parent, sizeof parent, bytes, sizeof bytes);
    (void)snprintf(trace, TRACEPARENT_LENGTH + 1, "00-%.*s-%s-0%d", TRACE_ID, given + 3, parent,
                   sampled);
}
