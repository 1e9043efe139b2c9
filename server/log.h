/*
 * log.h - one JSON object per line on stderr.
 */
#ifndef SRNFD_LOG_H
#define SRNFD_LOG_H

#include <stddef.h>

struct log_field {
    const char *name;
    const char *text; /* NULL: number is meant */
    double number;
};

/* Fields of a line: texts are escaped; numbers are written with up to 15 digits. */
static inline struct log_field log_text(const char *name, const char *text)
{
    return (struct log_field){name, text ? text : "", 0};
}

static inline struct log_field log_number(const char *name, double number)
{
    return (struct log_field){name, NULL, number};
}

/* Writes {"ts":..,"level":level,"event":event, fields ..}, whole, so that lines of several threads
   do not mix. A line that grows beyond 4 KiB loses the fields that do not fit. Never waits for who
   reads standard error: lines that are not taken are dropped, and counted. */
void log_line(const char *level, const char *event, const struct log_field *fields,
              size_t n_fields);

/* From log_start to log_stop lines of level info may come some milliseconds late, many in one
   write; other levels, and everything outside, at once. Not while other threads start or stop. */
void log_start(void);
void log_stop(void);

/* Lines that were dropped so far because standard error is a pipe that nobody reads. */
size_t log_dropped(void);

#define LOG_AT(level, event, ...)                                   \
    log_line(level, event, (const struct log_field[]){__VA_ARGS__}, \
             sizeof((const struct log_field[]){__VA_ARGS__}) / sizeof(struct log_field))

/* What happens; what somebody should know of, as a refused request; what somebody should see to. */
#define LOG(event, ...) LOG_AT("info", event, __VA_ARGS__)
#define LOG_WARN(event, ...) LOG_AT("warn", event, __VA_ARGS__)
#define LOG_ERROR(event, ...) LOG_AT("error", event, __VA_ARGS__)

#endif
