/*
 * exchange.c - one request on libmicrohttpd's thread: first look, body, handler or hand-over,
 * response.
 *
 * libmicrohttpd calls exchange_step after the headers, then for each piece of the body, then once
 * at its end, and again when a suspended connection was resumed. A request with a body that is
 * refused early, or whose route takes no body, is answered in the first call, and then the
 * connection ends. Every other request is answered at the end of its body. Without a body that is
 * the second call, because libmicrohttpd closes a connection that is answered in the first.
 *
 * Closing a socket with unread bytes would reset it and might take the answer with it; so the front
 * gets the socket (dup) and passes over for a moment what still comes (front_linger). In mid-body
 * no response can be queued: a body that grows beyond its limit is passed over up to
 * HTTP_DRAIN_MAX, and beyond that the connection is closed without an answer.
 */
#include "http/internal.h"

#include "clock.h"
#include "digits.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BODY_FIRST ((size_t)64 << 10)
#define RESPONSE_FREE ((size_t)64 << 10) /* bytes of a response that are not counted */

/* ---- The response ---------------------------------------------------------------------------- */

static const char own_share[] = "Bodies and responses of this token, or of this address, that are "
                                "on their way fill its share; try again when they are through.";

/* A response that is held while a slow client takes it counts as a body does. */
static void hold_response(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;

    if (response->body_size <= RESPONSE_FREE || response->static_body || response->body_file ||
        response->stream.job_id[0]) {
        return;
    }
    switch (shares_hold(exchange, response->body_size)) {
    case HOLD_GRANTED:
        exchange->held = response->body_size;
        break;
    case HOLD_FULL:
        api_problem(&exchange->request, response, 503, "server-busy",
                    "Too many responses are being sent at once; try again in a moment.");
        break;
    case HOLD_SHARE:
        api_problem(&exchange->request, response, 503, "server-busy", own_share);
        break;
    }
}

static void add_timing(struct api_response *response, double total_ms)
{
    char value[sizeof "total;dur=" + DIGITS_MAX] = "total;dur=";

    (void)digits_thousandths(value + strlen(value), total_ms);
    (void)api_response_header_text(response, "Server-Timing", value);
}

/* The fields of every answer. */
static void add_fields(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;

    cors_headers(exchange);
    (void)api_response_header_text(response, "X-Request-Id", exchange->request.id);
    add_timing(response, exchange->total_ms);
    (void)api_response_header_text(response, "X-Content-Type-Options", "nosniff");
    if (exchange->request.trace[0]) {
        (void)api_response_header_text(response, "traceparent", exchange->request.trace);
    }
    if (exchange->close || exchange->http->draining) {
        (void)api_response_header_text(response, "Connection", "close");
    }
}

/* Another answer in the place of one that cannot be given. */
static void replace_response(struct exchange *exchange, const char *code, const char *detail)
{
    api_problem(&exchange->request, &exchange->response, 503, code, detail);
    add_fields(exchange);
}

static bool add_headers(struct MHD_Response *mhd, const struct api_response *response)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        if (MHD_add_response_header(mhd, response->headers[i].name, response->headers[i].value) !=
            MHD_YES) {
            return false;
        }
    }
    return true;
}

/* The same of a response whose body is bytes. */
static struct MHD_Response *make_of_bytes(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    struct MHD_Response *mhd = kept_again(exchange);
    unsigned char *bytes = response->body;
    union {
        const void *constant;
        void *pointer;
    } body = {response->static_body ? response->static_body : bytes};

    if (mhd) {
        return mhd;
    }
    mhd = MHD_create_response_from_buffer(response->body_size, body.pointer,
                                          response->static_body ? MHD_RESPMEM_PERSISTENT
                                                                : MHD_RESPMEM_MUST_FREE);
    response->body = mhd ? NULL : bytes;
    if (mhd && !add_headers(mhd, response)) {
        MHD_destroy_response(mhd);
        return NULL;
    }
    if (mhd) {
        kept_keep(exchange, mhd, bytes);
    }
    return mhd;
}

/* The library's form of the response, with its fields; NULL where there is no memory for it. */
static struct MHD_Response *make_response(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    struct MHD_Response *mhd = NULL;

    if (response->stream.job_id[0] && (mhd = stream_open(exchange)) == NULL) {
        bool full = !exchange->streams;

        stream_closed(exchange);
        replace_response(exchange, full ? "server-busy" : "out-of-memory",
                         full ? "Too many streams of events are open; try again later."
                              : "There is not enough memory for the stream.");
    }
    if (!mhd) {
        exchange->sent = response->body_size;
    }
    if (!mhd && !response->body_file) {
        return make_of_bytes(exchange);
    }
    if (!mhd) {
        mhd = MHD_create_response_from_fd_at_offset64(response->body_size, response->body_file - 1,
                                                      response->body_offset);
        response->body_file = mhd ? 0 : response->body_file; /* the library closes it */
    }
    if (mhd && !add_headers(mhd, response)) {
        MHD_destroy_response(mhd);
        mhd = NULL;
    }
    return mhd;
}

/* An answer that lacks a field, such as the place of what was made, is another answer: where memory
   was short it becomes a 503, and where there is not enough for that, the connection is closed. */
static enum MHD_Result send_response(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    const struct http *http = exchange->http;
    struct MHD_Response *mhd = NULL;
    enum MHD_Result result;
    double now;

    hold_response(exchange);
    if (response->status == 0) {
        api_problem(&exchange->request, response, 500, "internal-error", "Nothing was answered.");
    }
    now = clock_now();
    exchange->total_ms = 1e3 * (now - exchange->started);
    add_fields(exchange);
    if (response->lacking) {
        replace_response(exchange, "out-of-memory", "There is not enough memory for the answer.");
    }
    mhd = response->lacking ? NULL : make_response(exchange);
    exchange->status = response->status;
    if (!mhd) {
        return MHD_NO;
    }
    connection_deadline(exchange->connection, now + http->config.transfer_seconds, false);
    atomic_store_explicit(&exchange->connection->sends, !exchange->streams, memory_order_relaxed);
    result = MHD_queue_response(exchange->mhd, (unsigned)response->status, mhd);
    if (!kept_has(exchange->connection, mhd)) {
        MHD_destroy_response(mhd);
    }
    return result;
}

/* ---- The body -------------------------------------------------------------------------------- */

static void drop_body(struct exchange *exchange)
{
    free(exchange->body);
    exchange->body = NULL;
    exchange->request.body = NULL;
    shares_release(exchange, exchange->body_capacity);
    exchange->body_capacity = 0;
}

/* From now on the body is passed over; the response is the problem. */
static void refuse_body(struct exchange *exchange, int status, const char *code, const char *detail)
{
    drop_body(exchange);
    exchange->request.body_size = 0;
    api_problem(&exchange->request, &exchange->response, status, code, detail);
    exchange->phase = PHASE_DRAIN;
    exchange->close = true;
}

/* Grows the buffer to hold size bytes: doubling, never beyond max_body and what was announced, all
   bodies within max_buffered and their holders' shares. False with the problem as the response. */
static bool grow_body(struct exchange *exchange, size_t size)
{
    size_t most = exchange->max_body;
    size_t capacity = exchange->body_capacity ? exchange->body_capacity : BODY_FIRST;
    enum hold_result held;
    unsigned char *body;

    if (exchange->content_length > 0 && (uint64_t)exchange->content_length < most) {
        most = (size_t)exchange->content_length;
    }
    while (capacity < size) {
        capacity *= 2;
    }
    capacity = capacity < most ? capacity : most;
    held = shares_hold(exchange, capacity - exchange->body_capacity);
    if (held != HOLD_GRANTED) {
        refuse_body(exchange, 503, "server-busy",
                    held == HOLD_SHARE
                        ? own_share
                        : "There is no room for the body at present; try again in a moment.");
        return false;
    }
    body = realloc(exchange->body, capacity);
    if (!body) {
        shares_release(exchange, capacity - exchange->body_capacity);
        refuse_body(exchange, 503, "out-of-memory",
                    "There is not enough memory for the body; try again in a moment.");
        return false;
    }
    exchange->body = body;
    exchange->body_capacity = capacity;
    return true;
}

static enum MHD_Result take_piece(struct exchange *exchange, const char *data, size_t size)
{
    struct api_request *request = &exchange->request;
    struct connection *connection = exchange->connection;
    size_t received = request->body_size;

    connection_deadline(
        connection,
        connection_put_off(exchange->http, connection->deadline, clock_last_tick(), (double)size),
        true);
    if (exchange->phase == PHASE_BODY && size > exchange->max_body - request->body_size) {
        refuse_body(exchange, 413, "body-too-large", "The body is larger than the limit here.");
        exchange->drained = received;
    } else if (exchange->phase == PHASE_BODY && received + size > exchange->body_capacity &&
               !grow_body(exchange, received + size)) {
        exchange->drained = received;
    }
    if (exchange->phase == PHASE_DRAIN) {
        exchange->drained += size;
        return exchange->drained > HTTP_DRAIN_MAX + exchange->max_body ? MHD_NO : MHD_YES;
    }
    memcpy(exchange->body + request->body_size, data, size);
    request->body_size += size;
    request->body = exchange->body;
    return MHD_YES;
}

/* ---- The calls ------------------------------------------------------------------------------- */

/* A connection has one request at a time, and so one exchange, which is used over and over. */
static struct exchange *exchange_new(struct http *http, struct MHD_Connection *mhd,
                                     const char *method)
{
    struct connection *connection = connection_of(mhd);
    struct exchange *exchange = connection ? connection->spare : NULL;

    if (exchange) {
        connection->spare = NULL;
    } else {
        exchange = malloc(sizeof *exchange);
    }
    if (!exchange) {
        return NULL;
    }
    memset(exchange, 0, offsetof(struct exchange, response.headers));
    exchange->http = http;
    exchange->mhd = mhd;
    exchange->connection = connection;
    exchange->started = clock_now();
    if (connection) {
        slots_busy(connection, true, exchange->started);
    }
    exchange->request.method = method;
    exchange->request.path = "";
    exchange->request.query = "";
    exchange->request.secure = http->tls != NULL;
    exchange->request.local = connection && connection->peer->local;
    shares_offer(exchange);
    atomic_fetch_add(&http->n_exchanges, 1);
    return exchange;
}

/* 503 where the service ends. True when it was refused. */
static bool refuse_ending(struct exchange *exchange)
{
    if (!atomic_load(&exchange->http->draining)) {
        return false;
    }
    exchange->close = true;
    api_problem(&exchange->request, &exchange->response, 503, "shutting-down",
                "The service is shutting down.");
    return true;
}

/* Takes down whose request it is, once the api layer has looked at it. True when it was refused
   because its holder has too many in progress. */
static bool refuse_share(struct exchange *exchange)
{
    struct connection *connection = exchange->connection;
    const struct api_caller *caller = &exchange->request.caller;
    bool refused = exchange->verdict == API_REFUSED;

    if (caller->name[0] && !shares_set_owner(connection, caller->name)) {
        api_problem(&exchange->request, &exchange->response, 503, "out-of-memory",
                    "There is not enough memory for the request.");
        return true;
    }
    if (caller->name[0] || (!refused && !caller->restricted)) {
        slots_know(connection, true);
    } else if (exchange->response.status == 401) {
        slots_know(connection, false);
    }
    if (refused || shares_enter(exchange)) {
        return false;
    }
    api_problem(&exchange->request, &exchange->response, 503, "server-busy",
                "Too many requests of this token, or of this address, are in progress; try again "
                "when one has ended.");
    return true;
}

/* The body is complete: here or on a request thread. */
static enum MHD_Result handle(struct exchange *exchange)
{
    struct http *http = exchange->http;

    connection_deadline(exchange->connection, HUGE_VAL, false);
    if (exchange->verdict == API_QUICK) {
        api_handle(http->config.api, &exchange->request, &exchange->response);
        exchange->phase = PHASE_READY;
        return send_response(exchange);
    }
    if (pool_submit(exchange)) {
        return MHD_YES;
    }
    exchange->close = true;
    api_problem(&exchange->request, &exchange->response, 503, "shutting-down",
                "The service is shutting down.");
    return send_response(exchange);
}

/* An answer that does not wait for the body ends the connection, which stays open behind it for a
   moment. */
static void leave_body(struct exchange *exchange)
{
    exchange->close = true;
    exchange->connection->lingers = true;
}

/* Without a body the answer is given in the second call: libmicrohttpd closes the connection after
   any that is given in the first one. */
static enum MHD_Result refuse_early(struct exchange *exchange)
{
    if (exchange->content_length == 0) {
        exchange->phase = PHASE_DRAIN;
        return MHD_YES;
    }
    leave_body(exchange);
    return send_response(exchange);
}

static enum MHD_Result first_step(struct exchange *exchange, const char *version)
{
    struct http *http = exchange->http;
    const char *code;
    int status;
    const char *detail = guard_check(exchange, version, &status, &code);

    if (detail) {
        exchange->connection->lingers = true;
        api_problem(&exchange->request, &exchange->response, status, code, detail);
        return send_response(exchange);
    }
    connection_deadline(exchange->connection, exchange->started + http->config.transfer_seconds,
                        true);
    exchange->verdict = API_REFUSED;
    if (!refuse_ending(exchange)) {
        exchange->verdict =
            api_begin(http->config.api, &exchange->request, exchange->content_length,
                      &exchange->max_body, &exchange->response);
        exchange->verdict = refuse_share(exchange) ? API_REFUSED : exchange->verdict;
    }
    if (exchange->verdict == API_REFUSED) {
        return refuse_early(exchange);
    }
    if (exchange->request.bodiless && exchange->content_length != 0) {
        leave_body(exchange);
        return handle(exchange);
    }
    return MHD_YES;
}

enum MHD_Result exchange_step(void *cls, struct MHD_Connection *mhd, const char *url,
                              const char *method, const char *version, const char *data,
                              size_t *data_size, void **state)
{
    struct exchange *exchange = *state;

    (void)url;
    if (!exchange) {
        exchange = exchange_new(cls, mhd, method);
        *state = exchange;
        return exchange && exchange->connection && exchange->connection->target
                   ? first_step(exchange, version)
                   : MHD_NO;
    }
    if (*data_size > 0) {
        size_t size = *data_size;

        *data_size = 0;
        return take_piece(exchange, data, size);
    }
    if (exchange->phase == PHASE_BODY) {
        return handle(exchange);
    }
    return send_response(exchange);
}

/* Who waits for the last one has set draining first, and so misses no ending. */
static void leave(struct http *http)
{
    atomic_fetch_sub(&http->n_exchanges, 1);
    if (atomic_load(&http->draining)) {
        (void)pthread_mutex_lock(&http->mutex);
        (void)pthread_cond_broadcast(&http->idle);
        (void)pthread_mutex_unlock(&http->mutex);
    }
}

void exchange_completed(void *cls, struct MHD_Connection *mhd, void **state,
                        enum MHD_RequestTerminationCode code)
{
    struct exchange *exchange = *state;
    struct connection *connection = exchange ? exchange->connection : NULL;
    struct http *http = cls;

    (void)mhd;
    if (!exchange) {
        return;
    }
    *state = NULL;
    access_log_write(exchange, code == MHD_REQUEST_TERMINATED_COMPLETED_OK);
    access_log_count(exchange);
    stream_closed(exchange);
    drop_body(exchange);
    shares_release(exchange, exchange->held);
    shares_leave(exchange);
    if (connection) {
        double now = clock_last_tick();

        connection_deadline(connection, now + http->config.idle_seconds, true);
        slots_busy(connection, false, now);
        if (connection->lingers) {
            front_linger(http, dup(connection->fd));
        }
    }
    api_response_clear(&exchange->response);
    if (exchange->path != exchange->short_path) {
        free(exchange->path);
    }
    if (connection && !connection->spare) {
        connection->spare = exchange;
    } else {
        free(exchange);
    }
    leave(http);
}
