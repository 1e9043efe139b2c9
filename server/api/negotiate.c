/*
 * negotiate.c - content negotiation (RFC 9110, 12.5.1): which of the media types that a resource
 * has does the Accept header like best? A type's quality is that of the most specific range that
 * covers it: type/subtype before type/star before star/star; parameters other than q are passed
 * over.
 */
#include "api/handler.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* How closely [range, range + length) covers the type: 3 exactly, 2 by type, 1 by anything, 0 not
   at all. */
static int closeness(const char *range, size_t length, const char *type)
{
    const char *slash = strchr(type, '/');
    size_t main_length = slash ? (size_t)(slash - type) + 1 : strlen(type);

    if (length == strlen(type) && strncasecmp(range, type, length) == 0) {
        return 3;
    }
    if (length == main_length + 1 && range[length - 1] == '*' &&
        strncasecmp(range, type, main_length) == 0) {
        return 2;
    }
    return length == 3 && strncmp(range, "*/*", 3) == 0;
}

/* Thousandths of the q parameter in [text, end), 1000 where there is none. */
static int quality_of(const char *text, const char *end)
{
    while (text < end) {
        size_t span = strcspn(text + 1, ";,") + 1;
        const char *p = text + 1;

        while (p < end && isspace((unsigned char)*p)) {
            p++;
        }
        if (p + 2 < end && (p[0] == 'q' || p[0] == 'Q') && p[1] == '=') {
            int quality = p[2] == '1' ? 1000 : 0;
            int place = 100;

            for (p += 4; p < end && isdigit((unsigned char)*p) && place; p++, place /= 10) {
                quality += place * (*p - '0');
            }
            return quality > 1000 ? 1000 : quality;
        }
        text += span;
    }
    return 1000;
}

static int type_quality(const char *accept, const char *type)
{
    int best_closeness = 0, quality = 0;

    while (*accept) {
        size_t span = strcspn(accept, ",");
        const char *start = accept, *end = accept + span, *stop;

        while (start < end && isspace((unsigned char)*start)) {
            start++;
        }
        stop = start;
        while (stop < end && *stop != ';' && !isspace((unsigned char)*stop)) {
            stop++;
        }
        int near = closeness(start, (size_t)(stop - start), type);
        if (near > best_closeness) {
            best_closeness = near;
            while (stop < end && *stop != ';') {
                stop++;
            }
            quality = quality_of(stop, end);
        }
        accept += span + (accept[span] == ',');
    }
    return quality;
}

int accept_best(const struct api_request *request, const char *const *media_types)
{
    const char *accept = api_request_header(request, "Accept");
    int best = -1, best_quality = 0;

    if (!accept || !accept[0]) {
        return media_types[0] ? 0 : -1;
    }
    for (int i = 0; media_types[i]; i++) {
        int quality = type_quality(accept, media_types[i]);

        if (quality > best_quality) {
            best_quality = quality;
            best = i;
        }
    }
    return best;
}
