/* daemon.c - starting, asking and ending a real daemon: see daemon.h. */
#include "support/daemon.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define ARGUMENTS_MAX 40
#define START_SECONDS 60
#define STOP_SECONDS 90
#define REQUEST_SECONDS 60

static void pause_ms(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    nanosleep(&time, NULL);
}

static const char *from_environment(const char *name, const char *otherwise)
{
    const char *value = getenv(name);

    return value && value[0] ? value : otherwise;
}

void daemon_prepare(struct daemon *daemon, const char *folder, const char *name)
{
    int fd;

    *daemon = (struct daemon){.shim = "fault_shim.so"};
    snprintf(daemon->folder, sizeof daemon->folder, "%s", folder);
    snprintf(daemon->data, sizeof daemon->data, "%s/%.60s", daemon->folder, name);
    snprintf(daemon->log, sizeof daemon->log, "%s.log", daemon->data);
    snprintf(daemon->control_path, sizeof daemon->control_path, "%s.fault", daemon->data);
    fd = open(daemon->control_path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0 || ftruncate(fd, sizeof *daemon->control) != 0) {
        abort();
    }
    daemon->control =
        mmap(NULL, sizeof *daemon->control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (daemon->control == MAP_FAILED) {
        abort();
    }
}

void daemon_release(struct daemon *daemon)
{
    daemon_kill(daemon);
    if (daemon->control) {
        munmap(daemon->control, sizeof *daemon->control);
        daemon->control = NULL;
    }
}

/* ---- Processes ------------------------------------------------------------------------------- */

static void set_environment(const struct daemon *daemon)
{
    const char *sanitized = from_environment("SRNFD_SANITIZED", "");
    char shim[600];

    /* Behind a sanitizer's library, which must come first, only the shim of malloc works. */
    if (daemon->shim && (!sanitized[0] || strcmp(daemon->shim, "malloc_shim.so") == 0)) {
        char options[200];

        snprintf(options, sizeof options, "%.120s:verify_asan_link_order=0",
                 from_environment("ASAN_OPTIONS", ""));
        setenv("ASAN_OPTIONS", options, 1);
        snprintf(shim, sizeof shim, "%s/tests/%s", from_environment("SRNFD_BUILD", "build"),
                 daemon->shim);
        setenv("LD_PRELOAD", shim, 1);
        setenv("SRNFD_FAULT_CONTROL", daemon->control_path, 1);
        setenv("SRNFD_FAULT_DIR", daemon->data, 1);
    }
}

static void run_daemon(const struct daemon *daemon)
{
    const char *program = from_environment("SRNFD", "build/srnfd");
    const char *arguments[ARGUMENTS_MAX] = {program,       "serve",  "--listen",
                                            "127.0.0.1:0", "--data", daemon->data};
    char *copy[ARGUMENTS_MAX] = {NULL};
    int log = open(daemon->log, O_WRONLY | O_CREAT | O_APPEND, 0600);

    for (int i = 0; daemon->options && daemon->options[i] && i + 7 < ARGUMENTS_MAX; i++) {
        arguments[6 + i] = daemon->options[i];
    }
    for (int i = 0; arguments[i]; i++) {
        copy[i] = strdup(arguments[i]);
    }
    if (log < 0 || dup2(log, STDERR_FILENO) < 0 || dup2(log, STDOUT_FILENO) < 0) {
        _exit(126);
    }
    set_environment(daemon);
    execv(program, copy);
    _exit(127);
}

/* The port that the log announces after this offset, or 0. */
static int announced_port(const struct daemon *daemon, off_t offset)
{
    static const char key[] = "\"event\":\"listening\",\"address\":\"127.0.0.1:";
    int fd = open(daemon->log, O_RDONLY | O_CLOEXEC), port = 0;
    char text[16384];
    ssize_t n = fd < 0 ? -1 : pread(fd, text, sizeof text - 1, offset);
    const char *found;

    if (fd >= 0) {
        close(fd);
    }
    text[n > 0 ? n : 0] = '\0';
    found = strstr(text, key);
    if (found && strchr(found, '\n')) {
        port = (int)strtol(found + sizeof key - 1, NULL, 10);
    }
    return port;
}

bool daemon_start(struct daemon *daemon)
{
    struct stat before;
    off_t offset = stat(daemon->log, &before) == 0 ? before.st_size : 0;

    daemon->port = 0;
    daemon->pid = fork();
    if (daemon->pid == 0) {
        run_daemon(daemon);
    }
    for (int i = 0; i < START_SECONDS * 200; i++) {
        daemon->port = announced_port(daemon, offset);
        if (daemon->port > 0) {
            return true;
        }
        if (daemon_has_ended(daemon)) {
            return false;
        }
        pause_ms(5);
    }
    daemon_kill(daemon);
    return false;
}

bool daemon_has_ended(struct daemon *daemon)
{
    int status;

    if (daemon->pid > 0 && waitpid(daemon->pid, &status, WNOHANG) == daemon->pid) {
        daemon->pid = 0;
    }
    return daemon->pid == 0;
}

void daemon_kill(struct daemon *daemon)
{
    if (daemon->pid > 0) {
        kill(daemon->pid, SIGKILL);
        waitpid(daemon->pid, NULL, 0);
        daemon->pid = 0;
    }
}

int daemon_stop(struct daemon *daemon)
{
    int status = -1;

    if (daemon->pid == 0) {
        return -1;
    }
    kill(daemon->pid, SIGTERM);
    for (int i = 0; i < STOP_SECONDS * 100; i++) {
        if (waitpid(daemon->pid, &status, WNOHANG) == daemon->pid) {
            daemon->pid = 0;
            return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        }
        pause_ms(10);
    }
    daemon_kill(daemon);
    return -1;
}

void daemon_show_log(const struct daemon *daemon)
{
    FILE *log = fopen(daemon->log, "r");
    char line[2048];

    while (log && fgets(line, sizeof line, log)) {
        fputs(line, stderr);
    }
    if (log) {
        fclose(log);
    }
}

void daemon_fault(struct daemon *daemon, int kinds, int files, int first, int last, int action)
{
    struct fault_control *control = daemon->control;

    atomic_store(&control->kinds, 0);
    atomic_store(&control->calls, 0);
    atomic_store(&control->hits, 0);
    atomic_store(&control->first, first);
    atomic_store(&control->last, last);
    atomic_store(&control->action, action);
    atomic_store(&control->files, files);
    atomic_store(&control->kinds, kinds);
}

/* In the child. */
static void run_command(const char *const *arguments, int output)
{
    const char *program = from_environment("SRNFD", "build/srnfd");
    char *copy[ARGUMENTS_MAX] = {NULL};

    copy[0] = strdup(program);
    for (int i = 0; arguments[i] && i + 2 < ARGUMENTS_MAX; i++) {
        copy[i + 1] = strdup(arguments[i]);
    }
    if (dup2(output, STDERR_FILENO) < 0 || dup2(output, STDOUT_FILENO) < 0) {
        _exit(126);
    }
    execv(program, copy);
    _exit(127);
}

int daemon_command(const char *const *arguments, char *text, size_t size)
{
    FILE *output = tmpfile();
    int status = -1;
    pid_t child;

    text[0] = '\0';
    if (!output) {
        return -1;
    }
    child = fork();
    if (child == 0) {
        run_command(arguments, fileno(output));
    }
    if (waitpid(child, &status, 0) != child) {
        status = -1;
    }
    rewind(output);
    text[fread(text, 1, size - 1, output)] = '\0';
    fclose(output);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* ---- Requests -------------------------------------------------------------------------------- */

void answer_clear(struct answer *answer)
{
    free(answer->headers);
    free(answer->body);
    *answer = (struct answer){0};
}

void answer_member(const struct answer *answer, const char *member, char *value, size_t size)
{
    char key[64];
    const char *found, *end = NULL;

    snprintf(key, sizeof key, "\"%s\":\"", member);
    found = answer->body ? strstr(answer->body, key) : NULL;
    if (found) {
        found += strlen(key);
        end = strchr(found, '"');
    }
    snprintf(value, size, "%.*s", end ? (int)(end - found) : 0, end ? found : "");
}

static int connect_to(int port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    struct timeval limit = {.tv_sec = REQUEST_SECONDS};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd >= 0) {
        setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
        setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
        if (connect(fd, (struct sockaddr *)&address, sizeof address) != 0) {
            close(fd);
            fd = -1;
        }
    }
    return fd;
}

static bool send_all(int fd, const char *bytes, size_t size)
{
    while (size > 0) {
        ssize_t n = send(fd, bytes, size, MSG_NOSIGNAL);

        if (n <= 0 && errno != EINTR) {
            return false;
        }
        bytes += n > 0 ? n : 0;
        size -= n > 0 ? (size_t)n : 0;
    }
    return true;
}

/* All that comes until the other side closes; malloc, zero-terminated. */
static char *receive_all(int fd, size_t *size)
{
    size_t room = 65536;
    char *text = malloc(room + 1);

    *size = 0;
    for (;;) {
        ssize_t n = recv(fd, text + *size, room - *size, 0);

        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n <= 0) {
            break;
        }
        *size += (size_t)n;
        if (*size == room) {
            room *= 2;
            text = realloc(text, room + 1);
        }
    }
    text[*size] = '\0';
    return text;
}

/* Takes the answer apart; one that is not whole has status 0. */
static void parse(char *text, size_t size, struct answer *answer)
{
    char *blank = strstr(text, "\r\n\r\n"), *length;

    answer->headers = text;
    if (!blank || strncmp(text, "HTTP/1.1 ", 9) != 0) {
        return;
    }
    *blank = '\0';
    answer->size = size - (size_t)(blank + 4 - text);
    answer->body = malloc(answer->size + 1);
    memcpy(answer->body, blank + 4, answer->size);
    answer->body[answer->size] = '\0';
    length = strcasestr(text, "\r\nContent-Length:");
    if (!length || strtoull(length + 17, NULL, 10) == answer->size) {
        answer->status = (int)strtol(text + 9, NULL, 10);
    }
}

int daemon_request(const struct daemon *daemon, const char *method, const char *path,
                   const char *headers, const void *body, size_t size, struct answer *answer)
{
    int fd = connect_to(daemon->port);
    char head[1024], *text;
    size_t got;
    int n = snprintf(head, sizeof head,
                     "%s %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nConnection: close\r\n"
                     "Content-Length: %zu\r\n%s\r\n",
                     method, path, daemon->port, size, headers);

    *answer = (struct answer){0};
    if (fd < 0) {
        return 0;
    }
    /* A refusal may come before all is sent: whatever is there is read. */
    if (send_all(fd, head, (size_t)n)) {
        (void)send_all(fd, body, size);
    }
    text = receive_all(fd, &got);
    parse(text, got, answer);
    close(fd);
    return answer->status;
}

int daemon_status(const struct daemon *daemon, const char *method, const char *path,
                  const char *body)
{
    struct answer answer;
    int status =
        daemon_request(daemon, method, path, body[0] ? "Content-Type: application/json\r\n" : "",
                       body, strlen(body), &answer);

    answer_clear(&answer);
    return status;
}
