/*
 * daemon.h - a real daemon for C tests: started on a free port of the loopback with a shim loaded
 * before it, asked over HTTP, ended or killed.
 *
 * The daemon is that of the environment variable SRNFD (tests/run.sh sets it), build/srnfd by
 * default; its shims lie in SRNFD_BUILD. Any thread may send requests; the rest is for one thread.
 */
#ifndef SRNFD_TEST_DAEMON_H
#define SRNFD_TEST_DAEMON_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "support/fault.h"

struct daemon {
    pid_t pid; /* 0: none runs */
    int port;
    char folder[200]; /* that holds the others */
    char data[300], log[320], control_path[320];
    const char *shim;              /* file name below SRNFD_BUILD/tests, or NULL */
    const char *const *options;    /* of serve, ended by NULL; may be NULL */
    struct fault_control *control; /* mapped */
};

/* Names a data directory below folder, which exists, and makes the page of faults. */
void daemon_prepare(struct daemon *daemon, const char *folder, const char *name);
/* Kills it if it runs; nothing for one that was not prepared. The folder stays. */
void daemon_release(struct daemon *daemon);
/* Starts it and waits until it listens; false when it ended before. The log is appended to. */
bool daemon_start(struct daemon *daemon);
/* SIGTERM, and the exit status; -1 where it was killed or had to be. */
int daemon_stop(struct daemon *daemon);
void daemon_kill(struct daemon *daemon);
/* Copies the log to standard error. */
void daemon_show_log(const struct daemon *daemon);
/* Whether it has ended by itself; it is then reaped. */
bool daemon_has_ended(struct daemon *daemon);
/* From now on the calls first..last, counted from here, meet this fate. 0, 0: none. */
void daemon_fault(struct daemon *daemon, int kinds, int files, int first, int last, int action);

struct answer {
    int status;           /* 0: no answer, or not a whole one */
    char *headers, *body; /* malloc, zero-terminated */
    size_t size;          /* of the body */
};
void answer_clear(struct answer *answer);
/* Text of a string member of the body, the first of that name; "" where there is none. */
void answer_member(const struct answer *answer, const char *member, char *value, size_t size);

/* One request on a connection of its own; headers are lines that end in \r\n, or "". Returns the
   status. */
int daemon_request(const struct daemon *daemon, const char *method, const char *path,
                   const char *headers, const void *body, size_t size, struct answer *answer);
/* The same for a body of text, with the answer thrown away. */
int daemon_status(const struct daemon *daemon, const char *method, const char *path,
                  const char *body);

/* Runs a command of srnfd to its end, with what it says, cut to size, in text; the exit status, or
   -1. */
int daemon_command(const char *const *arguments, char *text, size_t size);

#endif
