/*
 * api.h - what the http layer needs of the api layer: give it a request, get a response. Nothing
 * here knows libmicrohttpd; nothing in http/ knows JSON, ids or routes.
 *
 * A request goes through two calls. api_begin sees method, path, query and headers before the body
 * arrives and may refuse early (404, 405, 413, 415, ...). api_handle sees the body and fills the
 * response; it may be called on an http thread only when api_begin said that the route is quick,
 * otherwise on a request thread, where it may compute for some tens of milliseconds, or, for what
 * api_is_upload says so of, on one of those for uploads, for as long as it takes. A handler that
 * must wait for a job fills response->wait instead; the http layer calls api_resume when the job
 * ended or the deadline passed.
 */
#ifndef SRNFD_API_H
#define SRNFD_API_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <strings.h>

#include "ids.h"
#include "jobs/jobs.h"
#include "metrics.h"
#include "quota.h"

struct api;
struct api_processes; /* handler.h */

struct api_config {
    struct store *store;
    struct jobs *jobs;
    const struct api_processes *processes;
    size_t max_body;          /* bytes; default 256 MiB */
    double sync_wait_seconds; /* of an execution without Prefer; default 30 */
    const char *tokens;       /* the directory with the file of tokens; NULL: none are asked for */
    int64_t quotas[STORE_QUOTAS]; /* of tokens without their own; 0: no limit */
    double least_free_bytes; /* of the data directory's file system, for /readyz; 0: no floor */
    size_t
        upload_memory; /* bytes that reading uploads may have in use; 0: a share of the machine */
    /* Where links in inputs may lead beside this service (remote.h); NULL or "": nowhere. */
    const char *link_prefixes, *link_networks;
    double link_seconds;     /* that all links of a request may take; default 30 */
    const char *executor;    /* "local", "workers", "slurm": for whoever asks; default "local" */
    struct metrics *metrics; /* may be NULL */
};
int api_create(struct api **out, const struct api_config *config);
void api_destroy(struct api *api);

struct api_header {
    const char *name, *value;
};

/* Who sends a request. All zero: a service without tokens, whose one caller sees all. */
struct auth_account;
struct api_caller {
    char name[STORE_OWNER_MAX]; /* the owner of what it makes */
    bool restricted;            /* sees and changes only what belongs to name */
    const char *role;           /* of the token, static; NULL: no tokens are asked for */
    int64_t quotas[STORE_QUOTAS];
    struct auth_account *account; /* of the token, kept by the api layer; NULL: none */
    char job[STORE_ID_MAX];       /* whose tasks alone it may lease; "": those of all */
};

/* What one caller may have on the disk of answers that are made and sent: those of a token's name,
   or of an address. What is held is let go of when the answer was sent, if not before. */
struct api_share {
    bool (*hold)(void *of, size_t bytes); /* false: it is beyond the share; NULL: there is none */
    void (*release)(void *of, size_t bytes);
    void *of;
};

struct api_request {
    const char *method; /* "GET", ... */
    const char *path;   /* as sent, percent-decoded, no zero bytes, without the query */
    const char *query;  /* raw query string without '?', or "" */
    const struct api_header *headers;
    size_t n_headers;
    const unsigned char *body; /* NULL before api_handle */
    size_t body_size;
    char id[40];              /* request id, echoed as X-Request-Id and in problems */
    char trace[56];           /* traceparent as it goes on from here (W3C Trace Context), or "" */
    void *route;              /* set by api_begin, for api_handle */
    struct api_caller caller; /* the same */
    bool probe;               /* set by api_begin: monitors ask this every few seconds */
    bool bodiless;            /* the same: the route takes no body, and one need not be awaited */
    bool follows;             /* the same: links in the body may lead to other servers */
    const char *route_name;   /* set by api_begin: the route's pattern, static; NULL: none fits */
    const atomic_bool *stop;  /* an upload is given up when it becomes true; NULL: never */
    bool alone;               /* no other upload is handled beside this one, but small ones */
    bool secure;              /* it came over TLS */
    bool local;               /* it came from an address of this machine */
    bool gone;                /* before api_resume: nobody is at the other end of its connection */
    bool small; /* an upload that has little memory, of its own: API_AGAIN where it needs more */
    struct api_share disk;
};
/* Whether a header has this name, without regard to case. Most differ in their first letter, seen
   with the bit set that tells small letters from capitals. */
static inline bool api_header_is(const struct api_header *header, const char *name)
{
    return (header->name[0] | 0x20) == (name[0] | 0x20) && strcasecmp(header->name, name) == 0;
}
/* Value of a header by name without regard to case, or NULL. */
const char *api_request_header(const struct api_request *request, const char *name);

/* What an upload may come to instead of an answer. */
enum api_undone {
    API_DONE,
    API_AGAIN,   /* to be handled again: alone, since others held the memory that it needs, or
                    among the others, where it was small */
    API_STOPPED, /* request->stop was seen */
};

#define API_STREAM_ALL "*" /* of all jobs */
#define API_WAIT_TASKS "+" /* in the place of a job: until there are tasks to lease */
#define API_HEADERS_MAX 24
#define API_VALUES_SIZE ((size_t)320)
/* Zero it to begin with, up to the headers at least; not to be copied or moved while it has
   headers. */
struct api_response {
    int status;
    size_t n_headers, short_used;
    unsigned char *body;     /* malloc, owned */
    const void *static_body; /* in its place: bytes that stay; NULL: body */
    int body_file;           /* in its place: 1 + the descriptor of a file, owned; 0: none */
    size_t body_offset;      /* of the file: where the body begins */
    size_t body_size;        /* of the one or the other */
    const char *problem;     /* code of the problem that was answered, static; NULL: none was */
    bool lacking;            /* memory was short: a header or the body is missing */
    enum api_undone undone;  /* of an upload; there is no answer where it is not API_DONE */
    /* Not finished: wait until this job ends or the seconds are over, then api_resume. */
    struct {
        char job_id[STORE_ID_MAX];
        double seconds;
        void *state; /* of the handler; freed by api_resume or api_response_clear */
        void (*free_state)(void *state);
    } wait;
    /* Not finished with its body: what follows is made by api_stream_next, piece by piece, whenever
       this job changes, or any. */
    struct {
        char job_id[STORE_ID_MAX]; /* "": no stream; or API_STREAM_ALL */
        bool ended;                /* the body is the last piece */
        void *state;               /* freed by api_response_clear */
        void (*free_state)(void *state);
    } stream;
    struct api_header headers[API_HEADERS_MAX]; /* values owned, names static */
    char short_values[API_VALUES_SIZE]; /* those of the first headers; the others are malloc's */
};
void api_response_clear(struct api_response *response);
/* Adds a header; -1 when there are too many, the value is too long, or memory is short. */
int api_response_header_text(struct api_response *response, const char *name, const char *value);
int api_response_header(struct api_response *response, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

enum api_verdict {
    API_REFUSED, /* the response is complete: do not read the body */
    API_QUICK,   /* read the body up to max_body, then api_handle on any thread */
    API_SLOW,    /* read the body up to max_body, then api_handle on a request thread */
};
/* content_length < 0: unknown (chunked). */
enum api_verdict api_begin(struct api *api, struct api_request *request, int64_t content_length,
                           size_t *max_body, struct api_response *response);
void api_handle(struct api *api, const struct api_request *request, struct api_response *response);
/* Whether api_handle has a body to parse, which can take seconds and memory that is counted: it
   belongs on a thread that nothing short waits for. Of a request whose body is there. */
bool api_is_upload(const struct api_request *request);
/* Whether the body may have links to other servers, which are waited for. */
bool api_fetches(const struct api_request *request);
/* Whether such a body is so small that it most likely needs little time and memory: it may be
   handled with request->small first. */
bool api_is_small(const struct api_request *request);
void api_resume(struct api *api, const struct api_request *request, struct api_response *response);
/* Whether the value of an Authorization field is a token that holds. Counts for nothing: for
   whoever must choose which of many requests to look at first. */
bool api_knows(struct api *api, const char *authorization, size_t length);
/* Notes that a job has changed, its row or else its progress: before streams are woken. On any
   thread. */
void api_job_changed(struct api *api, const char *job_id, bool of_status);
/* Replaces the body of a stream by its next piece: empty where the job is as it was told last,
   unless alive asks for a sign of life. On a request thread. */
void api_stream_next(struct api *api, struct api_response *response, bool alive);

/* A problem document (RFC 9457) for what the http layer refuses on its own: 400, 408, 413, 414,
   431, 503. */
void api_problem(const struct api_request *request, struct api_response *response, int status,
                 const char *code, const char *detail);

#endif
