/*
 * wire.c - see wire.h.
 */
#include "support/wire.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "support/scratch.h"

double wire_now(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void wire_nap(double seconds)
{
    struct timespec time = {.tv_sec = (time_t)seconds};

    time.tv_nsec = (long)(1e9 * (seconds - (double)time.tv_sec));
    (void)nanosleep(&time, NULL);
}

/* ---- The daemon ------------------------------------------------------------------------------ */

bool wire_start(struct daemon *daemon, const char *const *options)
{
    char folder[SCRATCH_MAX];

    if (!scratch_make(folder, "wire")) {
        return false;
    }
    daemon_prepare(daemon, folder, "data");
    daemon->shim = NULL;
    daemon->options = options;
    if (!daemon_start(daemon)) {
        (void)wire_stop(daemon);
        return false;
    }
    return true;
}

int wire_stop(struct daemon *daemon)
{
    int status = daemon_stop(daemon);

    if (status != 0) {
        daemon_show_log(daemon);
    }
    daemon_release(daemon);
    scratch_remove(daemon->folder);
    return status;
}

long wire_status_number(const struct daemon *daemon, const char *name)
{
    char path[64], line[256];
    size_t length = strlen(name);
    long value = -1;
    FILE *file;

    (void)snprintf(path, sizeof path, "/proc/%d/status", (int)daemon->pid);
    file = fopen(path, "r");
    while (file && value < 0 && fgets(line, sizeof line, file)) {
        if (strncmp(line, name, length) == 0 && line[length] == ':') {
            value = strtol(line + length + 1, NULL, 10);
        }
    }
    if (file) {
        (void)fclose(file);
    }
    return value;
}

/* ---- Clients --------------------------------------------------------------------------------- */

int wire_dial(const struct daemon *daemon)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)daemon->port)};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd >= 0 && connect(fd, (struct sockaddr *)&to, sizeof to) != 0) {
        (void)close(fd);
        fd = -1;
    }
    return fd;
}

bool wire_send(int fd, const char *bytes, size_t size)
{
    while (size > 0) {
        ssize_t n = send(fd, bytes, size, MSG_NOSIGNAL);

        if (n <= 0) {
            return false;
        }
        bytes += n;
        size -= (size_t)n;
    }
    return true;
}

bool wire_say(int fd, const char *text)
{
    return wire_send(fd, text, strlen(text));
}

/* Whether the answer is whole: head, and Content-Length bytes. Interim answers do not count. */
static bool is_whole(const struct wire_answer *answer, bool head)
{
    const char *end = memmem(answer->text, answer->size, "\r\n\r\n", 4);
    const char *length = end ? strcasestr(answer->text, "\r\nContent-Length:") : NULL;

    if (!end) {
        return false;
    }
    if (head || !length || length > end) {
        return true;
    }
    return answer->size - (size_t)(end + 4 - answer->text) >= strtoul(length + 17, NULL, 10);
}

void wire_hear(int fd, bool head, struct wire_answer *answer)
{
    double start = wire_now();

    answer->status = 0;
    answer->size = 0;
    answer->closed = false;
    answer->text[0] = '\0';
    while (!is_whole(answer, head) && answer->size < WIRE_ANSWER_MAX - 1 &&
           wire_now() - start < WIRE_PATIENCE) {
        struct pollfd look_at = {.fd = fd, .events = POLLIN};
        ssize_t n;

        if (poll(&look_at, 1, 100) <= 0) {
            continue;
        }
        n = recv(fd, answer->text + answer->size, WIRE_ANSWER_MAX - 1 - answer->size, 0);
        if (n <= 0) {
            answer->closed = true;
            break;
        }
        answer->size += (size_t)n;
        answer->text[answer->size] = '\0';
    }
    if (strncmp(answer->text, "HTTP/1.", 7) == 0) {
        answer->status = (int)strtol(answer->text + 9, NULL, 10);
    }
}

bool wire_closes(int fd)
{
    double start = wire_now();
    char bytes[4096];

    while (wire_now() - start < WIRE_PATIENCE) {
        struct pollfd look_at = {.fd = fd, .events = POLLIN};

        if (poll(&look_at, 1, 100) > 0 && recv(fd, bytes, sizeof bytes, 0) <= 0) {
            return true;
        }
    }
    return false;
}

int wire_ask(const struct daemon *daemon, const char *request, struct wire_answer *answer)
{
    int fd = wire_dial(daemon);

    answer->status = 0;
    if (fd >= 0) {
        (void)wire_say(fd, request);
        wire_hear(fd, strncmp(request, "HEAD ", 5) == 0, answer);
        (void)close(fd);
    }
    return answer->status;
}

/* Heads of answers in the text. */
static size_t count_heads(const char *text)
{
    size_t count = 0;

    for (const char *at = text; (at = strstr(at, "HTTP/1.1 ")) != NULL; at += 9) {
        count += at[9] >= '1' && at[9] <= '5' && at[12] == ' ';
    }
    return count;
}

bool wire_is_problem(const struct wire_answer *answer, int status, const char *code)
{
    char member[80];

    (void)snprintf(member, sizeof member, "\"code\":\"%s\"", code);
    return answer->status == status && strcasestr(answer->text, "application/problem+json") &&
           strstr(answer->text, member) && count_heads(answer->text) == 1;
}
