/*
 * log.c - structured lines on stderr. No state and no lock: a line is composed on the caller's
 * stack and written with one write(2), which pipes and files opened for appending keep whole.
 * Losing a line is better than failing a request, so errors of the write are passed over.
 */
#include "log.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define LINE_MAX_BYTES 4096

struct line {
    char text[LINE_MAX_BYTES];
    size_t length;
};

/* Appends as it is; false where it does not fit with the closing of the line. */
static int put(struct line *line, const char *text, size_t length)
{
    if (line->length + length > sizeof line->text - 3) {
        return 0;
    }
    memcpy(line->text + line->length, text, length);
    line->length += length;
    return 1;
}

/* Appends a JSON string. Bytes outside printable ASCII are escaped one by one: paths may hold
   anything. */
static int put_string(struct line *line, const char *text)
{
    int fits = put(line, "\"", 1);

    for (; *text && fits; text++) {
        unsigned char c = (unsigned char)*text;
        char escape[8];

        if (c == '"' || c == '\\') {
            fits = put(line, "\\", 1) && put(line, text, 1);
        } else if (c < 0x20 || c > 0x7e) {
            (void)snprintf(escape, sizeof escape, "\\u%04x", (unsigned)c);
            fits = put(line, escape, 6);
        } else {
            fits = put(line, text, 1);
        }
    }
    return fits && put(line, "\"", 1);
}

static int put_field(struct line *line, const struct log_field *field)
{
    char number[40];

    if (!put(line, ",", 1) || !put_string(line, field->name) || !put(line, ":", 1)) {
        return 0;
    }
    if (field->text) {
        return put_string(line, field->text);
    }
    (void)snprintf(number, sizeof number, "%.15g", field->number);
    return isfinite(field->number) ? put(line, number, strlen(number)) : put(line, "null", 4);
}

void log_line(const char *level, const char *event, const struct log_field *fields, size_t n_fields)
{
    struct line line;
    struct timespec now;
    struct tm parts;
    char stamp[96], day[32];

    line.length = 0;
    (void)clock_gettime(CLOCK_REALTIME, &now);
    (void)gmtime_r(&now.tv_sec, &parts);
    (void)strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &parts);
    (void)snprintf(stamp, sizeof stamp, "{\"ts\":\"%s.%03dZ\",\"level\":\"%.8s\",\"event\":", day,
                   (int)(now.tv_nsec / 1000000), level);
    (void)put(&line, stamp, strlen(stamp));
    (void)put_string(&line, event);
    for (size_t i = 0; i < n_fields; i++) {
        size_t length = line.length;

        if (!put_field(&line, &fields[i])) {
            line.length = length;
        }
    }
    line.text[line.length++] = '}';
    line.text[line.length++] = '\n';
    if (write(STDERR_FILENO, line.text, line.length) < 0) {
        return;
    }
}
