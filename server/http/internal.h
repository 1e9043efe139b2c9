/*
 * internal.h - what the files of http/ share.
 *
 * Threads
 *   srnfd-front accepts connections and sees the head of their first request (front.c);
 *   libmicrohttpd's (a pool, one epoll loop each) parse requests, run quick handlers and send
 *   responses; srnfd-req-N run slow handlers and what goes on after a wait, srnfd-upload-N those
 *   that parse bodies; srnfd-timer watches the deadlines.
 *
 * A request that leaves libmicrohttpd's thread is suspended there first and resumed with its
 * response ready. Its exchange then belongs to exactly one place, told by its phase: the queue of
 * its lane (QUEUED), a request thread (RUNNING), the list of waits alone (WAITING).
 *
 * Lock: http->mutex protects everything marked [m]: the queues, the waits, phases while suspended,
 * and the list of connections. It is the only lock of this layer, and held for short walks only; of
 * libmicrohttpd's functions only MHD_suspend_connection is called under it, so that nobody resumes
 * before it is suspended. A request without a body whose small answer is given on libmicrohttpd's
 * thread never takes it: what all requests touch is atomic.
 */
#ifndef SRNFD_HTTP_INTERNAL_H
#define SRNFD_HTTP_INTERNAL_H

#include "http/frame.h"
#include "http/http.h"

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>

#define HTTP_HEADERS_MAX HEAD_FIELDS_MAX
#define HTTP_SHORT_PATH 128               /* bytes of a path that needs no memory of its own */
#define HTTP_DRAIN_MAX ((size_t)16 << 20) /* of a refused body that is read all the same */
#define HTTP_REQUEST_THREADS_MAX 33       /* 32, and that for small uploads */
#define HTTP_HOLDERS 1024                 /* chains of the table of shares.c */
#define HOLDER_KEY_MAX (STORE_OWNER_MAX + 1)

/* An address, or a token's name, and what it holds (shares.c). */
struct holder {
    struct holder *next;    /* [m] */
    size_t references;      /* [m] */
    size_t connections;     /* [m] of an address */
    size_t buffered;        /* [m] bytes */
    size_t filed;           /* [m] bytes on the disk of answers that are made and sent */
    atomic_size_t requests; /* in progress */
    uint64_t id;            /* by which lanes know it again when it has gone (lane.c) */
    bool local;             /* an address of this machine: has no share */
    char key[HOLDER_KEY_MAX];
};

/* One TCP connection, from NOTIFY_CONNECTION started to closed. */
struct connection {
    struct http *http;
    struct connection *next, **place; /* [m] */
    int fd;
    struct holder *peer;     /* never NULL */
    struct holder *owner;    /* of its last request's token, or NULL; the same thread's */
    atomic_bool known;       /* its last request was admitted; written under the mutex */
    atomic_bool busy;        /* has a request in progress */
    _Atomic double since;    /* when that began */
    bool leaving;            /* [m] its socket was shut to make room */
    bool lingers;            /* its client may still send: the front closes it; the same thread's */
    _Atomic double deadline; /* monotonic seconds; HUGE_VAL while it is ours to wait */
    atomic_bool reads;       /* waits for bytes of a request: its head, or the rest of its body */
    atomic_bool sends;       /* gives a response, whose deadline moves as it is taken */
    uint64_t taken;          /* bytes that the client has acknowledged; the timer's */
    atomic_bool ended;       /* libmicrohttpd is told that no more bytes come (timer.c) */
    char *target;           /* raw request target of the current request; owned by its MHD thread */
    size_t target_size;     /* bytes that target has room for */
    struct frame frame;     /* of all that came on it (tap.c); the same thread's */
    struct exchange *spare; /* of the request before, to be used again; the same thread's */
    struct kept *kept;      /* its response; NULL or, without one, empty (kept.c) */
    /* What its last request was counted as, and where: most clients ask the same again. */
    struct {
        const char *route, *method; /* static */
        int status;
        struct series *requests, *seconds, *sent;
    } counted;
};

enum phase {
    PHASE_BODY,    /* the body is arriving */
    PHASE_DRAIN,   /* refused: the body is read and passed over, the response is complete */
    PHASE_QUEUED,  /* suspended, in the queue */
    PHASE_RUNNING, /* suspended, on a request thread */
    PHASE_WAITING, /* suspended, for a job or the deadline */
    PHASE_READY,   /* the response is complete */
};

/* A queue and its threads (lane.c). */
enum { LANE_REQUESTS, LANE_UPLOADS, LANES };
#define LANE_SETS 64 /* of those whose times are kept, by their ids */
#define LANE_WAYS 8
struct lane {
    struct http *http;
    struct exchange *first, **last; /* [m] the queue */
    pthread_cond_t work;            /* the queue has something, or stopping */
    pthread_t threads[HTTP_REQUEST_THREADS_MAX];
    size_t n_threads, n_started;
    struct exchange *running[HTTP_REQUEST_THREADS_MAX]; /* [m] what each thread handles, or NULL */
    double since[HTTP_REQUEST_THREADS_MAX];             /* [m] from when on */
    struct spent {
        uint64_t id;        /* the holder's */
        double seconds, at; /* as of then; they halve every few seconds. 0, 0: nobody's yet */
    } spent[LANE_SETS][LANE_WAYS]; /* [m] what owners had of the threads */
};

struct exchange {
    struct http *http;
    struct MHD_Connection *mhd;
    struct connection *connection;
    struct api_request request;
    char *path; /* decoded: short_path, or malloc's */
    enum api_verdict verdict;
    enum phase phase;
    unsigned char *body;
    size_t body_capacity, max_body, drained;
    int64_t content_length;      /* -1: chunked */
    bool close;                  /* the connection ends after the response */
    bool resumed;                /* api_resume is next, not api_handle */
    bool woken;                  /* [m] the job changed while this was queued or running */
    bool waits;                  /* [m] in the list of waits */
    size_t held;                 /* bytes of the response that are counted in buffered */
    size_t charged;              /* bytes of body and response that are counted */
    size_t filed;                /* bytes on the disk that are counted */
    struct holder *holder;       /* whose request it is; NULL before it is admitted */
    bool streams;                /* the response is a stream (stream.c) */
    size_t piece_sent;           /* of a stream's piece */
    double look_at;              /* [m] when a wait is handled though nothing has changed */
    double alive_at;             /* when a stream is to give a sign of life */
    double pause_until;          /* before which a stream makes no piece */
    double started;              /* monotonic, when the headers were there */
    double total_ms;             /* until the response was handed to libmicrohttpd */
    double deadline;             /* [m] of the wait */
    char wait_job[STORE_ID_MAX]; /* [m] the job that it waits for */
    int lane;                    /* [m] LANE_REQUESTS or LANE_UPLOADS */
    bool small;                  /* [m] an upload that little memory may do for */
    bool fetches;                /* [m] an upload that may wait for other servers */
    atomic_bool gone;            /* its client is not there any more: nobody waits for the answer */
    double ended_at;  /* [m] since when its client sends nothing more (lane.c); 0: not yet */
    atomic_bool stop; /* whoever handles it is to give up */
    int status;       /* as sent; 0: nothing was */
    size_t sent;
    struct exchange *queue_next;              /* [m] */
    struct exchange *wait_next, **wait_place; /* [m] */
    struct api_response response;
    /* Not cleared: others tell how much of them is in use. */
    struct api_header headers[HTTP_HEADERS_MAX];
    char short_path[HTTP_SHORT_PATH];
};

struct http {
    struct http_config config;
    struct MHD_Daemon *daemon;
    struct tls *tls; /* NULL: plain HTTP */
    int listen_fd;
    char address[80];
    pthread_mutex_t mutex;
    pthread_cond_t timer; /* a wait was added, or stopping */
    pthread_cond_t idle;  /* while draining: an exchange ended */
    struct lane lanes[LANES];
    struct exchange *waits;               /* [m] */
    struct connection *connections;       /* [m] */
    size_t buffered;                      /* [m] */
    size_t n_streams;                     /* [m] */
    size_t n_connections;                 /* [m] with those that are leaving */
    size_t n_leaving, n_unknown;          /* [m] of them; unknown ones that are not leaving */
    size_t n_handed;                      /* [m] given to libmicrohttpd, not opened yet */
    size_t n_handed_known;                /* [m] of them, those with a token that holds */
    double handed_at;                     /* [m] the last of them */
    struct holder *holders[HTTP_HOLDERS]; /* [m] */
    uint64_t holders_seed;
    _Atomic(struct connection *) *taps; /* by descriptor (tap.c) */
    atomic_bool *judged; /* by descriptor: handed over with a token that holds (front.c) */
    size_t n_taps;       /* descriptors that both have room for */
    atomic_size_t n_exchanges;
    struct front *front;
    unsigned char id_key[32]; /* of the ids of requests (request_ids.c) */
    atomic_ullong ids;
    atomic_bool draining;          /* written under the mutex, read anywhere */
    bool stopping, timer_stopping; /* [m] */
    bool giving_up;                /* [m] nothing more is handled (lane_stop) */
    pthread_t timer_thread;
    bool timer_started;
};

/* ---- request_ids.c --------------------------------------------------------------------------- */

/* Chooses where the ids of this daemon start. */
void request_ids_start(struct http *http);
/* An id for a request that brings none. */
void request_id_make(struct http *http, char id[40]);

/* ---- listen.c -------------------------------------------------------------------------------- */

/* Binds and listens; the address as bound goes to address. Returns the descriptor, or -1 with a
   message. */
int listen_open(const char *text, char *address, size_t address_size, char *message, size_t size);

/* ---- guard.c --------------------------------------------------------------------------------- */

/* Takes over the request's headers and target, and refuses shapes on which servers and proxies
   disagree. NULL when all is well, otherwise the detail of the problem, with status and code. */
const char *guard_check(struct exchange *exchange, const char *version, int *status,
                        const char **code);

/* ---- front.c --------------------------------------------------------------------------------- */

/* The daemon of libmicrohttpd is there, and goes after the front has stopped. */
int front_start(struct http *http);
void front_stop(struct http *http);
/* Takes over a connection whose answer was sent before its request was read to the end: passes over
   what still comes for a moment and closes it. fd is the caller's no more. From any thread. */
void front_linger(struct http *http, int fd);

/* ---- refusal.c ------------------------------------------------------------------------------- */

#define REFUSAL_MAX 8192
/* Writes an answer that ends the connection, and logs and counts it. start: the first bytes of the
   request, by which one to HEAD is told. Returns its length. */
size_t refusal_write(struct http *http, const struct head_refusal *refusal, const char start[5],
                     char text[REFUSAL_MAX]);

/* ---- tap.c ----------------------------------------------------------------------------------- */

int tap_start(struct http *http);
/* As the connection is opened and closed, by its thread. */
void tap_open(struct connection *connection);
void tap_close(struct connection *connection);
/* Whether a head of this connection was judged. */
bool tap_saw(struct connection *connection);

/* ---- slots.c --------------------------------------------------------------------------------- */

enum slot { SLOT_FREE, SLOT_LATER, SLOT_NONE };
/* A place for a connection from that address: it is to be handed over now, later, or refused.
   known: its first request has a token that holds. */
enum slot slots_take(struct http *http, const struct sockaddr *address, bool known);
/* Notes for slots_opened what was found of it, before libmicrohttpd gets it. */
void slots_hand_over(struct http *http, int fd, bool known);
/* libmicrohttpd has it; the mutex is held. */
void slots_came(struct http *http, int fd);
/* Of a connection with its peer, as it enters and leaves the list; the mutex is held. */
void slots_opened(struct connection *connection);
void slots_closed(struct connection *connection);
/* By the connection's own thread. */
void slots_know(struct connection *connection, bool known);
void slots_busy(struct connection *connection, bool busy, double now);

/* ---- shares.c -------------------------------------------------------------------------------- */

/* The holder of an address, with one reference more; NULL without memory. The mutex is held. */
struct holder *shares_peer(struct http *http, const struct sockaddr *address);
/* Gives a reference back; NULL is allowed. The mutex is held. */
void shares_drop(struct http *http, struct holder *holder);
/* How many connections the address has. The mutex is held. */
size_t shares_connections(struct http *http, const struct sockaddr *address);
/* Makes the name's holder connection->owner. False without memory. By the connection's thread. */
bool shares_set_owner(struct connection *connection, const char *name);
/* Counts a request that was admitted. False when its holder has too many in progress: it is counted
   all the same. */
bool shares_enter(struct exchange *exchange);
void shares_leave(struct exchange *exchange);
/* Bytes that are held for clients: bodies that come, and large ones that go. Charged to all, to the
   address and to the token's name, or to none. */
enum hold_result { HOLD_GRANTED, HOLD_FULL, HOLD_SHARE };
enum hold_result shares_hold(struct exchange *exchange, size_t bytes);
void shares_release(struct exchange *exchange, size_t bytes);
/* Lets the request's handler count what its answer has on the disk, until shares_leave. */
void shares_offer(struct exchange *exchange);

/* ---- trace.c --------------------------------------------------------------------------------- */

/* The traceparent of this request from the one that came (NULL: none); "" where there is no valid
   one. */
void trace_continue(const char *given, char trace[56]);

/* ---- origin.c -------------------------------------------------------------------------------- */

/* Whether a request with this Host (NULL: none) and this Origin (NULL: none) may be answered at
   the address; otherwise the detail of the problem. extra: further hosts, separated by commas;
   local: only callers of this machine are expected. */
const char *origin_check(const char *address, const char *extra, bool local, const char *method,
                         const char *host, const char *origin);

/* ---- cors.c ---------------------------------------------------------------------------------- */

/* Whether the origin (NULL: none) is on the allow-list. */
bool cors_allows(const struct http *http, const char *origin);
/* Adds to the response what a browser needs to give it to a page of that origin. */
void cors_headers(struct exchange *exchange);

/* ---- tls.c ----------------------------------------------------------------------------------- */

/* Reads certificate chain and key, PEM files; NULL with a message where they cannot be used. */
struct tls *tls_open(const char *certificate, const char *key, char *message, size_t size);
void tls_close(struct tls *tls);
#define TLS_OPTIONS 3
/* What libmicrohttpd must be told; without tls nothing. */
void tls_options(const struct tls *tls, struct MHD_OptionItem options[TLS_OPTIONS]);

/* ---- exchange.c ------------------------------------------------------------------------------ */

enum MHD_Result exchange_step(void *cls, struct MHD_Connection *mhd, const char *url,
                              const char *method, const char *version, const char *data,
                              size_t *data_size, void **state);
void exchange_completed(void *cls, struct MHD_Connection *mhd, void **state,
                        enum MHD_RequestTerminationCode code);

/* ---- kept.c ---------------------------------------------------------------------------------- */

/* The response that the connection gave last, made the exchange's, whose body is used up; NULL
   where it is not alike. */
struct MHD_Response *kept_again(struct exchange *exchange);
/* Keeps a response that was just made, or lets go of the one before only. body: that of the
   exchange's response, which now is the library's; NULL: it is static. */
void kept_keep(struct exchange *exchange, struct MHD_Response *mhd, unsigned char *body);
/* Whether the response is the connection's, which then is to give it back. */
bool kept_has(const struct connection *connection, const struct MHD_Response *mhd);
void kept_drop(struct connection *connection);

/* ---- access_log.c ---------------------------------------------------------------------------- */

/* The line of the log that a request leaves, and what is counted of it. whole: the response was
   taken. */
void access_log_write(const struct exchange *exchange, bool whole);
void access_log_count(const struct exchange *exchange);

/* ---- pool.c ---------------------------------------------------------------------------------- */

int pool_start(struct http *http);
/* Suspends the connection and queues the exchange. False when the pool is stopping: then nothing
   was done. */
bool pool_submit(struct exchange *exchange);
/* Enters a stream whose connection was just suspended: it looks for a change at once, or when its
   pause is over. The mutex is held. */
void pool_await_stream(struct exchange *exchange);
/* Queues a WAITING exchange; the mutex is held. */
void pool_wake(struct exchange *exchange);
void pool_wake_all(struct http *http);
/* Answers what is still queued, waits for the threads: afterwards nothing is suspended. */
void pool_stop(struct http *http);

/* ---- lane.c: with the mutex held ------------------------------------------------------------- */

/* Puts the exchange into the queue of its lane. */
void lane_enqueue(struct http *http, struct exchange *exchange);
/* What this thread of the lane is to handle next, which then is RUNNING; NULL: nothing. */
struct exchange *lane_take(struct http *http, struct lane *lane, size_t thread);
/* The thread has handled it. */
void lane_leave(struct http *http, struct lane *lane, size_t thread);
/* Whether the lane's threads may end: the daemon stops, and nothing is left to do. */
bool lane_is_over(const struct http *http, const struct lane *lane);
/* Tells uploads whose clients have gone to stop, and passes over requests that are queued for such
   clients. */
void lane_look(struct http *http, double now);
/* Tells all uploads to stop; what is queued, and what comes from now on, is answered with 503. */
void lane_stop(struct http *http);

/* ---- stream.c -------------------------------------------------------------------------------- */

/* A response that goes on with the pieces of exchange->response.stream; NULL when there are too
   many streams, or, where exchange->streams, no memory. */
struct MHD_Response *stream_open(struct exchange *exchange);
void stream_closed(struct exchange *exchange);
/* On a request thread: makes the next piece, if there is one. */
void stream_run(struct exchange *exchange);
/* When a stream that waits is to be looked at again, whatever happens. */
double stream_look_at(const struct exchange *exchange);
bool stream_has_piece(const struct exchange *exchange);

/* ---- connections.c --------------------------------------------------------------------------- */

void connection_notify(void *cls, struct MHD_Connection *mhd, void **context,
                       enum MHD_ConnectionNotificationCode code);
void *connection_target(void *cls, const char *uri, struct MHD_Connection *mhd);
struct connection *connection_of(struct MHD_Connection *mhd);
/* Sets the time by which the connection must have moved on; HUGE_VAL for none. reads: whether it
   waits for bytes of a request. */
void connection_deadline(struct connection *connection, double deadline, bool reads);
/* The deadline of a transfer that has moved on by so many bytes: it is put off by the time that
   they may take at least_rate, but never to more than transfer_seconds from now. So over each such
   time the rate is kept up, and no credit is saved. */
double connection_put_off(const struct http *http, double deadline, double now, double bytes);

/* ---- timer.c --------------------------------------------------------------------------------- */

int timer_start(struct http *http);
void timer_stop(struct http *http);

#endif
