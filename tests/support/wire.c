/*
 * wire.c - see wire.h.
 */
#include "support/wire.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define OPTIONS_MAX 32
#define START_SECONDS 60.0
#define STOP_SECONDS 90.0

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

static void log_path(const struct wire_daemon *daemon, char *path, size_t size)
{
    (void)snprintf(path, size, "%s/log", daemon->folder);
}

/* In the child. */
static void run(const struct wire_daemon *daemon, const char *const *options)
{
    const char *program = getenv("SRNFD");
    const char *arguments[OPTIONS_MAX + 8] = {"srnfd", "serve", "--listen", "127.0.0.1:0",
                                              "--data"};
    char path[220], data[220];
    size_t n = 6;
    int log, null = open("/dev/null", O_RDWR);

    log_path(daemon, path, sizeof path);
    (void)snprintf(data, sizeof data, "%s/data", daemon->folder);
    arguments[5] = data;
    while (options && *options && n < OPTIONS_MAX) {
        arguments[n++] = *options++;
    }
    log = open(path, O_WRONLY | O_CREAT | O_APPEND, 0600);
    (void)dup2(null, STDIN_FILENO);
    (void)dup2(null, STDOUT_FILENO);
    (void)dup2(log, STDERR_FILENO);
    union {
        const char *const *constant;
        char *const *plain;
    } vector = {arguments};
    (void)execv(program ? program : "build/srnfd", vector.plain);
    _exit(127);
}

/* The port that the log announces; 0 as long as it does not. */
static int announced_port(const struct wire_daemon *daemon)
{
    static const char mark[] = "\"address\":\"127.0.0.1:";
    char path[220], line[2048];
    int port = 0;
    FILE *log;

    log_path(daemon, path, sizeof path);
    log = fopen(path, "r");
    while (log && port == 0 && fgets(line, sizeof line, log)) {
        const char *address = strstr(line, mark);

        if (address && strchr(line, '\n')) {
            port = (int)strtol(address + sizeof mark - 1, NULL, 10);
        }
    }
    if (log) {
        (void)fclose(log);
    }
    return port;
}

static void show_log(const struct wire_daemon *daemon)
{
    char path[220], line[2048];
    FILE *log;

    log_path(daemon, path, sizeof path);
    log = fopen(path, "r");
    while (log && fgets(line, sizeof line, log)) {
        (void)fputs(line, stderr);
    }
    if (log) {
        (void)fclose(log);
    }
}

bool wire_start(struct wire_daemon *daemon, const char *const *options)
{
    const char *scratch = getenv("TMPDIR");
    double start = wire_now();

    *daemon = (struct wire_daemon){0};
    (void)snprintf(daemon->folder, sizeof daemon->folder, "%.150s/srnfd-wire.XXXXXX",
                   scratch ? scratch : "/tmp");
    if (!mkdtemp(daemon->folder)) {
        return false;
    }
    daemon->pid = fork();
    if (daemon->pid == 0) {
        run(daemon, options);
    }
    while (daemon->pid > 0 && wire_now() - start < START_SECONDS) {
        daemon->port = announced_port(daemon);
        if (daemon->port > 0) {
            return true;
        }
        if (waitpid(daemon->pid, NULL, WNOHANG) == daemon->pid) {
            daemon->pid = 0;
            break;
        }
        wire_nap(0.02);
    }
    show_log(daemon);
    return false;
}

static int remove_one(const char *path, const struct stat *about, int kind, struct FTW *place)
{
    (void)about;
    (void)kind;
    (void)place;
    return remove(path);
}

int wire_stop(struct wire_daemon *daemon)
{
    double start = wire_now();
    int status = 0;
    pid_t ended = 0;

    if (daemon->pid > 0) {
        (void)kill(daemon->pid, SIGTERM);
        while (ended == 0 && wire_now() - start < STOP_SECONDS) {
            ended = waitpid(daemon->pid, &status, WNOHANG);
            wire_nap(0.02);
        }
        if (ended == 0) {
            (void)kill(daemon->pid, SIGKILL);
            (void)waitpid(daemon->pid, &status, 0);
        }
    }
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        show_log(daemon);
    }
    (void)nftw(daemon->folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    daemon->pid = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

long wire_status_number(const struct wire_daemon *daemon, const char *name)
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

int wire_dial(const struct wire_daemon *daemon)
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

int wire_ask(const struct wire_daemon *daemon, const char *request, struct wire_answer *answer)
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
