/*
 * http.h - the listening side of the daemon: everything that knows libmicrohttpd. It takes requests
 * to the api layer (api/api.h) and its responses back, keeps limits and deadlines, and lets
 * connections wait for jobs.
 */
#ifndef SRNFD_HTTP_H
#define SRNFD_HTTP_H

#include <stdbool.h>
#include <stddef.h>

#include "api/api.h"
#include "metrics.h"

struct http;

struct http_config {
    struct api *api;
    const char *listen;        /* "127.0.0.1:8080", "[::1]:0"; port 0 takes a free one */
    size_t threads;            /* of libmicrohttpd; 0: half the processors, 1 to 4 */
    size_t request_threads;    /* for slow routes; 0: 4 */
    size_t upload_threads;     /* that parse bodies, beside one for small ones; 0: 2 */
    size_t max_connections;    /* beyond them idle ones give way (slots.c); 0: 1024 */
    size_t kept_connections;   /* of them, for those whose requests are admitted; 0: an eighth */
    size_t max_owner_requests; /* in progress, of a token's name or, without, an address that is not
                                  of this machine; 0: a quarter of max_connections, 16 at least */
    size_t max_waiting;        /* connections without a request; the oldest goes; 0: 4096 */
    size_t max_streams;        /* of server-sent events; 0: 128 */
    size_t max_buffered;       /* bytes of all bodies that arrive, are handled or go; 0: 1 GiB */
    size_t max_owner_buffered; /* of them, of a token's name; 0: a quarter */
    size_t max_peer_buffered;  /* of them, of an address that is not of this machine; 0: half */
    size_t max_owner_files;    /* bytes on the disk of answers that are made and sent, of a name or
                                  such an address; 0: 1 GiB */
    bool local_only; /* answer only those who call it by a loopback name, or by allowed_hosts */
    bool open;       /* tokens may be missing: keep out pages of other sites on any address */
    const char *allowed_hosts; /* "host" or "host:port", separated by commas; may be NULL */
    const char *cors_origins;  /* "https://host[:port]", separated by commas: pages that may call;
                                 may be NULL */
    const char *tls_certificate, *tls_key; /* PEM files, read anew when replaced; NULL: plain */
    double header_seconds;                 /* from connecting to the end of the headers; 0: 15 */
    double transfer_seconds;               /* that a body or a response may stand still; 0: 30 */
    double least_rate;        /* bytes a second that it must keep up over that time; 0: 16384 */
    double idle_seconds;      /* between requests of one connection; 0: 60 */
    double heartbeat_seconds; /* between signs of life in a stream; 0: 15 */
    bool log_refusals_only;   /* no line in the log for a request that was answered well */
    bool log_probes;          /* nor, without this, for a monitor's probe that was */
    struct metrics *metrics;  /* may be NULL */
};

/* Listens and starts the threads. message gets a sentence on failure. */
int http_start(struct http **out, const struct http_config *config, char *message, size_t size);

/* "127.0.0.1:41234": where it listens. */
const char *http_address(const struct http *http);

/* To be called when a job's row changed; from any thread. */
void http_job_changed(struct http *http, const char *job_id);

/* To be called when the progress or the message of a running job changed; from any thread. Only
   streams take notice. */
void http_job_progressed(struct http *http, const char *job_id);

/* Stops listening, answers what waits for jobs, gives requests in progress grace_seconds to end,
   then closes all connections and frees everything. */
void http_stop(struct http *http, double grace_seconds);

/* What to say of a text, its one argument, that is no address to listen on. */
#define HTTP_NO_ADDRESS                                                                 \
    "\"%.60s\" is no address: use a numeric address and a port from 0 to 65535, as in " \
    "127.0.0.1:8080 or [::1]:8080"

/* Whether the text is "host:port" or "[host]:port" with a numeric address. */
bool http_is_address(const char *listen);

/* Whether "host:port" names a loopback address; false also for what does not parse. */
bool http_is_loopback(const char *listen);

#endif
