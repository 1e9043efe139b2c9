/*
 * wire.h - raw clients for tests of the real daemon (daemon.h): it is started in a scratch folder,
 * without a shim, and spoken to byte by byte, as no HTTP library would.
 */
#ifndef SRNFD_TEST_WIRE_H
#define SRNFD_TEST_WIRE_H

#include <stdbool.h>
#include <stddef.h>

#include "support/daemon.h"

#define WIRE_ANSWER_MAX ((size_t)256 << 10)
#define WIRE_PATIENCE 30.0 /* seconds that any one answer may take */

/* Starts `srnfd serve` with further options (ended by NULL) and waits until it listens. False, with
   its log on standard error, when it does not. */
bool wire_start(struct daemon *daemon, const char *const *options);
/* SIGTERM, and the folder removed; its exit status, or -1 when it was killed. What is not 0 comes
   with the log on standard error. */
int wire_stop(struct daemon *daemon);
/* A number of /proc/PID/status: "VmRSS", "VmHWM" (KiB), "Threads". -1: not there. */
long wire_status_number(const struct daemon *daemon, const char *name);

/* Monotonic seconds. */
double wire_now(void);
void wire_nap(double seconds);

/* A connection; -1 when it is refused. */
int wire_dial(const struct daemon *daemon);
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
int wire_ask(const struct daemon *daemon, const char *request, struct wire_answer *answer);
/* Whether the answer is a problem document with this code, after one head. */
bool wire_is_problem(const struct wire_answer *answer, int status, const char *code);

#endif
