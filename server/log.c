/*
 * log.c - structured lines on stderr. A line is composed on the caller's stack and written whole,
 * in pieces that pipes and files opened for appending keep together. Losing a line is better than
 * failing a request, so errors of the write are passed over.
 *
 * Between log_start and log_stop the lines of level info are gathered for up to GATHER_MS and
 * written together by the thread srnfd-log, since thousands of requests a second would otherwise
 * spend a tenth of their time in write(2). Lines of other levels are written before log_line
 * returns, behind what was gathered. A kill -9 takes the last GATHER_MS of info lines with it.
 *
 * Nobody waits for a reader: what a pipe does not take at once stays in two buffers, and when both
 * are full further lines are dropped and counted. A line log-lines-dropped tells their number once
 * there is room again.
 *
 * Locks: gathered.writing, then gathered.mutex, innermost; a line waits for a write only where
 * both buffers are full, or where it is itself to be written. Neither is held while somebody waits
 * for a pipe.
 */
#include "log.h"

#include "digits.h"
#include "text.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
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

/* How many bytes at the beginning stand for themselves. */
static size_t plain_length(const char *text, size_t size)
{
    size_t n = 0;

    while (n + 8 <= size) {
        uint64_t bytes = text_eight(text + n);

        if (text_any_below(bytes, 0x20) | (bytes & TEXT_EACH(0x80)) | text_any_is(bytes, 0x7f) |
            text_any_is(bytes, '"') | text_any_is(bytes, '\\')) {
            break;
        }
        n += 8;
    }
    while (n < size && is_plain((unsigned char)text[n])) {
        n++;
    }
    return n;
}

/* Appends a JSON string. Bytes outside printable ASCII are escaped one by one: paths may hold
   anything. */
static int put_string(struct line *line, const char *text)
{
    const char *end = text + strlen(text);
    int fits = put(line, "\"", 1);

    while (text < end && fits) {
        size_t plain = plain_length(text, (size_t)(end - text));
        char escape[8];

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

/* One whole line. */
static void compose(struct line *line, const char *level, const char *event,
                    const struct log_field *fields, size_t n_fields)
{
    line->length = 0;
    (void)put(line, "{\"ts\":\"", 7);
    put_time(line);
    (void)put(line, "\",\"level\":", 10);
    (void)put_string(line, level);
    (void)put(line, ",\"event\":", 9);
    (void)put_string(line, event);
    for (size_t i = 0; i < n_fields; i++) {
        size_t length = line->length;

        if (!put_field(line, &fields[i])) {
            line->length = length;
        }
    }
    line->text[line->length++] = '}';
    line->text[line->length++] = '\n';
}

/* ---- Writing --------------------------------------------------------------------------------- */

/* What a pipe that poll(2) calls writable takes without blocking: PIPE_BUF of Linux. */
#define PIECE_BYTES ((size_t)4096)
#define LAST_WAIT_MS 1000 /* for the reader of a full pipe, when the log stops */

static struct {
    pthread_mutex_t writing; /* held across write(2), so that lines stay in their order */
    pthread_mutex_t mutex;   /* of what follows; taken inside writing */
    pthread_cond_t arrived;
    pthread_t thread;
    atomic_bool started;
    bool stopping;
    int filling;              /* the buffer that lines go to; the other one is being written */
    size_t length;            /* of the lines in it */
    size_t written, to_write; /* bytes of the other one; of writing */
    size_t untold;            /* lines that were dropped since the last line that told of it */
    atomic_size_t dropped;    /* all of them */
    char buffer[2][GATHER_BYTES];
} gathered = {.writing = PTHREAD_MUTEX_INITIALIZER,
              .mutex = PTHREAD_MUTEX_INITIALIZER,
              .arrived = PTHREAD_COND_INITIALIZER};

/* Whether standard error takes something now, or within the time. What cannot be asked does. */
static bool takes_more(int wait_ms)
{
    struct pollfd wanted = {.fd = STDERR_FILENO, .events = POLLOUT};

    return poll(&wanted, 1, wait_ms) != 0;
}

/* The end of the piece that begins at from: whole lines, none longer than a piece. */
static size_t piece_end(const char *text, size_t from, size_t end)
{
    size_t stop = from + PIECE_BYTES;

    if (stop >= end) {
        return end;
    }
    while (stop > from && text[stop - 1] != '\n') {
        stop--;
    }
    return stop > from ? stop : from + PIECE_BYTES;
}

/* Writes what is left of the buffer that is being written; false where a pipe is full. writing is
   held. */
static bool write_rest(void)
{
    const char *text = gathered.buffer[1 - gathered.filling];

    while (gathered.written < gathered.to_write) {
        size_t end = piece_end(text, gathered.written, gathered.to_write);
        ssize_t n;

        if (!takes_more(0)) {
            return false;
        }
        n = write(STDERR_FILENO, text + gathered.written, end - gathered.written);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        gathered.written = n > 0 ? gathered.written + (size_t)n : end;
    }
    return true;
}

/* Writes all that was gathered before the call, as far as it is taken at once; whether all was. No
   lock is held. */
static bool write_gathered(void)
{
    bool whole;

    (void)pthread_mutex_lock(&gathered.writing);
    whole = write_rest();
    if (whole) {
        (void)pthread_mutex_lock(&gathered.mutex);
        gathered.to_write = gathered.length;
        gathered.written = 0;
        gathered.filling = 1 - gathered.filling;
        gathered.length = 0;
        (void)pthread_mutex_unlock(&gathered.mutex);
        whole = write_rest();
    }
    (void)pthread_mutex_unlock(&gathered.writing);
    return whole;
}

static void *keep_writing(void *argument)
{
    const struct timespec pause = {.tv_nsec = GATHER_MS * 1000000L};
    bool whole = true;

    (void)pthread_mutex_lock(&gathered.mutex);
    while (!gathered.stopping) {
        while (gathered.length == 0 && whole && !gathered.stopping) {
            (void)pthread_cond_wait(&gathered.arrived, &gathered.mutex);
        }
        (void)pthread_mutex_unlock(&gathered.mutex);
        if (!whole) {
            (void)takes_more(GATHER_MS * 20);
        }
        (void)nanosleep(&pause, NULL);
        whole = write_gathered();
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
        /* What came during the thread's last write. */
        for (int ms = 0; !write_gathered() && ms < LAST_WAIT_MS; ms += LAST_WAIT_MS / 10) {
            (void)takes_more(LAST_WAIT_MS / 10);
        }
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

/* The line that tells of those that were dropped, where there are any and it fits. */
static void tell_dropped(void)
{
    struct log_field field;
    struct line line;
    size_t count;

    (void)pthread_mutex_lock(&gathered.mutex);
    count = gathered.untold;
    gathered.untold = 0;
    (void)pthread_mutex_unlock(&gathered.mutex);
    if (count == 0) {
        return;
    }
    field = log_number("count", (double)count);
    compose(&line, "error", "log-lines-dropped", &field, 1);
    if (!add(&line)) {
        (void)pthread_mutex_lock(&gathered.mutex);
        gathered.untold += count;
        (void)pthread_mutex_unlock(&gathered.mutex);
    }
}

static void submit(const struct line *line, bool at_once)
{
    bool added;

    tell_dropped();
    added = add(line);
    for (int i = 0; i < 2 && !added; i++) {
        (void)write_gathered();
        added = add(line);
    }
    if (!added) {
        (void)pthread_mutex_lock(&gathered.mutex);
        gathered.untold++;
        (void)pthread_mutex_unlock(&gathered.mutex);
        atomic_fetch_add(&gathered.dropped, 1);
    } else if (at_once || !gathered.started) {
        (void)write_gathered();
    }
}

size_t log_dropped(void)
{
    return atomic_load(&gathered.dropped);
}

void log_line(const char *level, const char *event, const struct log_field *fields, size_t n_fields)
{
    struct line line;

    compose(&line, level, event, fields, n_fields);
    submit(&line, strcmp(level, "info") != 0);
}
