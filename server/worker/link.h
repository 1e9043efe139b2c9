/*
 * link.h - requests to the service: one connection for each thread, kept alive.
 */
#ifndef SRNFD_WORKER_LINK_H
#define SRNFD_WORKER_LINK_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

#define LINK_TOKEN_MAX 128

/* Where the service is, for all threads. */
struct link_target {
    const char *url;         /* without a slash at its end */
    const char *token_file;  /* NULL: no token, or that below */
    const char *token;       /* NULL: that of the file */
    const char *certificate; /* PEM file of the one certificate, or authority, that is trusted;
                                NULL: those of the system */
    const char *host, *cpu, *build; /* who makes results */
};
/* What is wrong with the target, a static sentence, or NULL: no URL, or clear text beyond this
   machine. */
const char *link_problem(const struct link_target *target);

struct link;
/* NULL without memory. stop: requests that may be broken off are, once it is true. */
struct link *link_create(const struct link_target *target, const atomic_bool *stop);
void link_destroy(struct link *link);

struct link_request {
    const char *method, *path; /* path from the root */
    const char *secret;        /* of a lease, or NULL */
    const char *type;          /* of the body, or NULL: there is none */
    const char *digest;        /* Content-Digest, or NULL */
    bool made;                 /* the body is a result: who has made it goes along */
    const void *body;
    size_t size;
    double seconds; /* at most */
    bool stops;     /* may be broken off */
};
struct link_answer {
    long status;          /* of HTTP; 0: there was no answer */
    unsigned char *bytes; /* malloc, with a zero after them */
    size_t size;
    char why[256]; /* without an answer: why */
};
/* answer is to be cleared in any case. */
void link_send(struct link *link, const struct link_request *request, struct link_answer *answer);
void link_answer_clear(struct link_answer *answer);

#endif
