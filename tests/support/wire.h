/*
 * wire.h - raw clients for tests of the real daemon: it is started on a free port of the loopback,
 * and spoken to byte by byte, as no HTTP library would.
 *
 * The daemon is that of the environment variable SRNFD (tests/run.sh sets it), or build/srnfd.
 */
#ifndef SRNFD_TEST_WIRE_H
#define SRNFD_TEST_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#define WIRE_ANSWER_MAX ((size_t)256 << 10)
#define WIRE_PATIENCE 30.0 /* seconds that any one answer may take */

struct wire_daemon {
    pid_t pid;
    int port;
    char folder[200]; /* scratch: data and log, removed by wire_stop */
};

/* Starts `srnfd serve` with further options (ended by NULL) and waits until it listens. False, with
   its log on standard error, when it does not. */
bool wire_start(struct wire_daemon *daemon, const char *const *options);
/* SIGTERM; its exit status, or -1 when it was killed. */
int wire_stop(struct wire_daemon *daemon);
/* A number of /proc/PID/status: "VmRSS", "VmHWM" (KiB), "Threads". -1: not there. */
long wire_status_number(const struct wire_daemon *daemon, const char *name);

/* Monotonic seconds. */
double wire_now(void);
void wire_nap(double seconds);

/* A connection; -1 when it is refused. */
int wire_dial(const struct wire_daemon *daemon);
/* Sends all; false when the peer has closed. */
bool wire_send(int fd, const char *bytes, size_t size);
bool wire_say(int fd, const char *text);

/* One answer: head, and as many bytes of body as Content-Length says. */
struct wire_answer {
    int status;  /* 0: none came */
    bool closed; /* the peer has closed, or reset */
    size_t size;
    char text[WIRE_ANSWER_MAX];
};
/* Reads one answer, or what came until the peer closed. head: it is one to HEAD. */
void wire_hear(int fd, bool head, struct wire_answer *answer);
/* Whether the peer closes within the patience; what it still sends is passed over. */
bool wire_closes(int fd);
/* A connection, a request, an answer. Returns the status. */
int wire_ask(const struct wire_daemon *daemon, const char *request, struct wire_answer *answer);
/* Whether the answer is a problem document with this code, after one head. */
bool wire_is_problem(const struct wire_answer *answer, int status, const char *code);

#endif
