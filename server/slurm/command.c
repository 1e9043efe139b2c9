/*
 * command.c - one program of Slurm: started without a shell, with an environment of a few names,
 * its output bounded, and killed with all that it has started when its time is over.
 *
 * What it reads is in a file without a name, so that nothing waits for it to read. Of what it
 * prints, pipes are read until it has ended: a process that it leaves behind may hold them open.
 */
#include "slurm/internal.h"

#include "clock.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#define HURRY_SECONDS 2.0
#define LOOK_MS 5
#define ERRORS_MAX ((size_t)8192)

struct stream {
    int fd; /* -1: at its end */
    char *text;
    size_t size, most;
    bool cut;
};

struct child {
    pid_t pid;
    struct stream out, errors;
};

/* ---- Starting -------------------------------------------------------------------------------- */

/* What of the environment goes along, as NAME=VALUE: nothing that is ours. */
static void make_environment(char *environment[16])
{
    static const char *const names[] = {
        "PATH", "HOME", "USER", "LOGNAME", "TMPDIR", "SLURM_CONF", "SLURM_CONF_SERVER", NULL};
    static char locale[] = "LC_ALL=C";
    size_t n = 0;

    environment[n++] = locale;
    for (char **variable = environ; *variable; variable++) {
        for (size_t i = 0; names[i] && n < 15; i++) {
            size_t length = strlen(names[i]);

            if (strncmp(*variable, names[i], length) == 0 && (*variable)[length] == '=') {
                environment[n++] = *variable;
            }
        }
    }
    environment[n] = NULL;
}

/* A descriptor of a file in memory that holds the text, at its beginning; -1: not possible. */
static int input_of(const char *text)
{
    size_t size = text ? strlen(text) : 0, done = 0;
    int fd = text ? memfd_create("input", MFD_CLOEXEC) : open("/dev/null", O_RDONLY | O_CLOEXEC);

    while (fd >= 0 && done < size) {
        ssize_t n = write(fd, text + done, size - done);

        if (n < 0 && errno != EINTR) {
            (void)close(fd);
            return -1;
        }
        done += n > 0 ? (size_t)n : 0;
    }
    if (fd >= 0 && text) {
        (void)lseek(fd, 0, SEEK_SET);
    }
    return fd;
}

/* Signals as a program expects them, a group of its own, and no descriptor but three. */
static int spawn(pid_t *pid, const char *const *arguments, const int descriptors[3])
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    char *environment[16], *list[SLURM_ARGUMENTS_MAX + 16];
    sigset_t none, all;
    size_t n = 0;
    int error;

    for (; arguments[n] && n < sizeof list / sizeof list[0] - 1; n++) {
        memcpy(&list[n], &arguments[n], sizeof list[n]);
    }
    list[n] = NULL;
    make_environment(environment);
    (void)sigemptyset(&none);
    (void)sigfillset(&all);
    (void)posix_spawn_file_actions_init(&actions);
    (void)posix_spawnattr_init(&attributes);
    for (int i = 0; i < 3; i++) {
        (void)posix_spawn_file_actions_adddup2(&actions, descriptors[i], i);
    }
    (void)posix_spawn_file_actions_addclosefrom_np(&actions, 3);
    (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK |
                                                    POSIX_SPAWN_SETSIGDEF);
    (void)posix_spawnattr_setpgroup(&attributes, 0);
    (void)posix_spawnattr_setsigmask(&attributes, &none);
    (void)posix_spawnattr_setsigdefault(&attributes, &all);
    error = posix_spawnp(pid, list[0], &actions, &attributes, list, environment);
    (void)posix_spawn_file_actions_destroy(&actions);
    (void)posix_spawnattr_destroy(&attributes);
    return error;
}

static void close_if_open(int *fd)
{
    if (*fd >= 0) {
        (void)close(*fd);
        *fd = -1;
    }
}

/* Returns 0 or an errno. */
static int start(struct child *child, const struct slurm_command *command)
{
    int out[2] = {-1, -1}, errors[2] = {-1, -1}, input = input_of(command->input);
    int error =
        input < 0 || pipe2(out, O_CLOEXEC) != 0 || pipe2(errors, O_CLOEXEC) != 0 ? errno : 0;

    if (error == 0) {
        const int descriptors[3] = {input, out[1], errors[1]};

        error = spawn(&child->pid, command->arguments, descriptors);
    }
    close_if_open(&input);
    close_if_open(&out[1]);
    close_if_open(&errors[1]);
    if (error != 0) {
        close_if_open(&out[0]);
        close_if_open(&errors[0]);
        return error;
    }
    child->out = (struct stream){.fd = out[0], .most = SLURM_OUTPUT_MAX};
    child->errors = (struct stream){.fd = errors[0], .most = ERRORS_MAX};
    (void)fcntl(out[0], F_SETFL, O_NONBLOCK);
    (void)fcntl(errors[0], F_SETFL, O_NONBLOCK);
    return 0;
}

/* ---- Until it ends --------------------------------------------------------------------------- */

/* Takes what there is. Beyond its bound it is read and dropped. */
static void take(struct stream *stream)
{
    char piece[16384];
    ssize_t n;

    while (stream->fd >= 0 && (n = read(stream->fd, piece, sizeof piece)) != 0) {
        char *grown;

        if (n < 0) {
            if (errno == EAGAIN) {
                return;
            }
            if (errno == EINTR) {
                continue;
            }
            break;
        }
        grown = (size_t)n <= stream->most - stream->size
                    ? realloc(stream->text, stream->size + (size_t)n + 1)
                    : NULL;
        if (!grown) {
            stream->cut = true;
            continue;
        }
        memcpy(grown + stream->size, piece, (size_t)n);
        stream->text = grown;
        stream->size += (size_t)n;
        grown[stream->size] = '\0';
    }
    close_if_open(&stream->fd);
}

/* Waits for its end. False: its time was over, and it was killed. */
static bool await(struct child *child, const struct slurm_command *command, int *status)
{
    double until = clock_now() + command->seconds;
    bool in_time = true;

    for (;;) {
        struct pollfd fds[2] = {{.fd = child->out.fd, .events = POLLIN},
                                {.fd = child->errors.fd, .events = POLLIN}};
        double now = clock_now();

        if (waitpid(child->pid, status, WNOHANG) == child->pid) {
            break;
        }
        if (command->hurry && atomic_load(command->hurry)) {
            until = fmin(until, now + HURRY_SECONDS);
        }
        if (in_time && now >= until) {
            (void)kill(-child->pid, SIGKILL);
            in_time = false;
        }
        (void)poll(fds, 2, LOOK_MS);
        take(&child->out);
        take(&child->errors);
        if (child->out.fd < 0 && child->errors.fd < 0) {
            (void)poll(NULL, 0, LOOK_MS);
        }
    }
    take(&child->out);
    take(&child->errors);
    close_if_open(&child->out.fd);
    close_if_open(&child->errors.fd);
    return in_time;
}

/* The last line that says something, without what cannot be printed. */
static void last_line(const struct stream *stream, char why[SLURM_WHY_MAX])
{
    size_t end = stream->text ? stream->size : 0, begin;

    while (end > 0 && (unsigned char)stream->text[end - 1] <= ' ') {
        end--;
    }
    begin = end;
    while (begin > 0 && stream->text[begin - 1] != '\n') {
        begin--;
    }
    end = end - begin < SLURM_WHY_MAX ? end : begin + SLURM_WHY_MAX - 1;
    for (size_t i = begin; i < end; i++) {
        unsigned char byte = (unsigned char)stream->text[i];

        why[i - begin] = (char)(byte >= ' ' && byte < 127 ? byte : '?');
    }
    why[end - begin] = '\0';
}

void slurm_run(const struct slurm_command *command, struct slurm_answer *answer)
{
    struct child child = {.pid = 0};
    int status = 0, error = start(&child, command);

    *answer = (struct slurm_answer){.status = -1};
    if (error != 0) {
        answer->ended = true;
        (void)snprintf(answer->why, sizeof answer->why, "%s cannot be run: %s",
                       command->arguments[0], strerror(error));
        return;
    }
    answer->ended = await(&child, command, &status);
    if (answer->ended && WIFEXITED(status)) {
        answer->status = WEXITSTATUS(status);
    }
    last_line(&child.errors, answer->why);
    if (!answer->ended) {
        (void)snprintf(answer->why, sizeof answer->why, "%s gave no answer in time",
                       command->arguments[0]);
    } else if (!answer->why[0]) {
        (void)snprintf(answer->why, sizeof answer->why, "%s ended with status %d",
                       command->arguments[0], answer->status);
    }
    if (child.out.cut) {
        free(child.out.text);
    } else {
        answer->text = child.out.text ? child.out.text : calloc(1, 1);
        answer->size = child.out.size;
    }
    free(child.errors.text);
}

void slurm_answer_clear(struct slurm_answer *answer)
{
    free(answer->text);
    *answer = (struct slurm_answer){.status = -1};
}

bool slurm_has(const char *program)
{
    const char *path = getenv("PATH");
    char file[1024];

    for (path = path ? path : ""; *path;) {
        size_t length = strcspn(path, ":");

        (void)snprintf(file, sizeof file, "%.*s/%s", (int)(length < 900 ? length : 900), path,
                       program);
        if (length > 0 && access(file, X_OK) == 0) {
            return true;
        }
        path += length + (path[length] == ':');
    }
    return false;
}
