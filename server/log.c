/*
 * log.c - structured lines on stderr. A line is composed on the caller's stack and written whole
 * with one write(2), which pipes and files opened for appending keep together. Losing a line is
 * better than failing a request, so errors of the write are passed over.
 *
 * Between log_start and log_stop the lines of level info are gathered for up to GATHER_MS and
 * written together by the thread srnfd-log, since thousands of requests a second would otherwise
 * spend a tenth of their time in write(2). Lines of other levels are written before log_line
 * returns, behind what was gathered. A kill -9 takes the last GATHER_MS of info lines with it.
 *
 * Locks: gathered.writing, then gathered.mutex, innermost; a line waits for a write only where
 * both buffers are full, or where it is itself to be written.
 */
#include "log.h"

#include "digits.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define LINE_MAX_BYTES 4096
#define GATHER_MS 5
#define GATHER_BYTES ((size_t)64 << 10)

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

/* Bytes that stand for themselves in a JSON string. */
static bool is_plain(unsigned char c)
{
    return c >= 0x20 && c <= 0x7e && c != '"' && c != '\\';
}

/* Appends a JSON string. Bytes outside printable ASCII are escaped one by one: paths may hold
   anything. */
static int put_string(struct line *line, const char *text)
{
    int fits = put(line, "\"", 1);

    while (*text && fits) {
        size_t plain = 0;
        char escape[8];

        while (is_plain((unsigned char)text[plain])) {
            plain++;
        }
        fits = put(line, text, plain);
        text += plain;
        if (fits && *text) {
            (void)snprintf(escape, sizeof escape,
                           *text == '"' || *text == '\\' ? "\\%c" : "\\u%04x",
                           (unsigned)(unsigned char)*text);
            fits = put(line, escape, strlen(escape));
            text++;
        }
    }
    return fits && put(line, "\"", 1);
}

static int put_field(struct line *line, const struct log_field *field)
{
    char number[DIGITS_MAX];

    /* The names are ours, and need no escape. */
    if (!put(line, ",\"", 2) || !put(line, field->name, strlen(field->name)) ||
        !put(line, "\":", 2)) {
        return 0;
    }
    if (field->text) {
        return put_string(line, field->text);
    }
    return isfinite(field->number) ? put(line, number, digits_number(number, field->number))
                                   : put(line, "null", 4);
}

/* The time now, by a calendar that each thread looks at once a second. */
static void put_time(struct line *line)
{
    static _Thread_local time_t second = -1;
    static _Thread_local char day[32];
    struct timespec now;
    char rest[8] = ".000Z";
    int ms;

    (void)clock_gettime(CLOCK_REALTIME, &now);
    if (now.tv_sec != second) {
        struct tm parts;

        (void)gmtime_r(&now.tv_sec, &parts);
        (void)strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &parts);
        second = now.tv_sec;
    }
    ms = (int)(now.tv_nsec / 1000000);
    rest[1] = (char)('0' + ms / 100);
    rest[2] = (char)('0' + ms / 10 % 10);
    rest[3] = (char)('0' + ms % 10);
    (void)put(line, day, strlen(day));
    (void)put(line, rest, 5);
}

/* ---- Writing --------------------------------------------------------------------------------- */

static struct {
    pthread_mutex_t writing; /* held across write(2), so that lines stay in their order */
    pthread_mutex_t mutex;   /* of what follows; taken inside writing */
    pthread_cond_t arrived;
    pthread_t thread;
    atomic_bool started;
    bool stopping;
    int filling; /* the buffer that lines go to; the other one is being written */
    size_t length;
    char buffer[2][GATHER_BYTES];
} gathered = {.writing = PTHREAD_MUTEX_INITIALIZER,
              .mutex = PTHREAD_MUTEX_INITIALIZER,
              .arrived = PTHREAD_COND_INITIALIZER};

static void write_out(const char *text, size_t length)
{
    if (length > 0 && write(STDERR_FILENO, text, length) < 0) {
        return;
    }
}

/* Writes all that was gathered before the call. No lock is held. */
static void write_gathered(void)
{
    const char *text;
    size_t length;

    (void)pthread_mutex_lock(&gathered.writing);
    (void)pthread_mutex_lock(&gathered.mutex);
    text = gathered.buffer[gathered.filling];
    length = gathered.length;
    gathered.filling = 1 - gathered.filling;
    gathered.length = 0;
    (void)pthread_mutex_unlock(&gathered.mutex);
    write_out(text, length);
    (void)pthread_mutex_unlock(&gathered.writing);
}

static void *keep_writing(void *argument)
{
    const struct timespec pause = {.tv_nsec = GATHER_MS * 1000000L};

    (void)pthread_mutex_lock(&gathered.mutex);
    while (!gathered.stopping) {
        while (gathered.length == 0 && !gathered.stopping) {
            (void)pthread_cond_wait(&gathered.arrived, &gathered.mutex);
        }
        (void)pthread_mutex_unlock(&gathered.mutex);
        (void)nanosleep(&pause, NULL);
        write_gathered();
        (void)pthread_mutex_lock(&gathered.mutex);
    }
    (void)pthread_mutex_unlock(&gathered.mutex);
    return argument;
}

void log_start(void)
{
    gathered.stopping = false;
    gathered.started = pthread_create(&gathered.thread, NULL, keep_writing, NULL) == 0;
    if (gathered.started) {
        (void)pthread_setname_np(gathered.thread, "srnfd-log");
    }
}

void log_stop(void)
{
    bool started;

    (void)pthread_mutex_lock(&gathered.mutex);
    started = gathered.started;
    gathered.started = false;
    gathered.stopping = true;
    (void)pthread_cond_signal(&gathered.arrived);
    (void)pthread_mutex_unlock(&gathered.mutex);
    if (started) {
        (void)pthread_join(gathered.thread, NULL);
        write_gathered(); /* what came during the thread's last write */
    }
}

/* Adds the line; false when it does not fit. */
static bool add(const struct line *line)
{
    bool fits;

    (void)pthread_mutex_lock(&gathered.mutex);
    fits = gathered.length + line->length <= GATHER_BYTES;
    if (fits) {
        if (gathered.length == 0 && gathered.started) {
            (void)pthread_cond_signal(&gathered.arrived);
        }
        memcpy(gathered.buffer[gathered.filling] + gathered.length, line->text, line->length);
        gathered.length += line->length;
    }
    (void)pthread_mutex_unlock(&gathered.mutex);
    return fits;
}

static void submit(const struct line *line, bool at_once)
{
    while (!add(line)) {
        write_gathered();
    }
    if (at_once || !gathered.started) {
        write_gathered();
    }
}

void log_line(const char *level, const char *event, const struct log_field *fields, size_t n_fields)
{
    struct line line;

    line.length = 0;
    (void)put(&line, "{\"ts\":\"", 7);
    put_time(&line);
    (void)put(&line, "\",\"level\":", 10);
    (void)put_string(&line, level);
    (void)put(&line, ",\"event\":", 9);
    (void)put_string(&line, event);
    for (size_t i = 0; i < n_fields; i++) {
        size_t length = line.length;

        if (!put_field(&line, &fields[i])) {
            line.length = length;
        }
    }
    line.text[line.length++] = '}';
    line.text[line.length++] = '\n';
    submit(&line, strcmp(level, "info") != 0);
}
