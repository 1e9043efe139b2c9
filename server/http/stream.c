/*
 * stream.c - responses without an end of their own: server-sent events.
 *
 * A stream holds one piece, made by the api layer on a request thread (api_stream_next). While
 * libmicrohttpd's thread sends it the exchange is READY; when it is sent the content reader below
 * suspends the connection, and the exchange goes the way of a wait (pool.c): QUEUED at once, to see
 * what changed meanwhile, then WAITING for the job, for a sign of life, or for the end of its
 * pause, since pieces follow each other no faster than one in STREAM_PAUSE. So a client that does
 * not read holds its piece, the socket's small send buffer, and nothing else; it is cut off like
 * any that does not take its response in time. Every STREAM_CHECK the api layer is asked even if
 * nothing has changed: it ends the stream of a token that holds no more. One that has gone is
 * noticed when something is sent to it: who has closed its half gets a sign of life at each check,
 * so that it counts as a stream of its token for some seconds more, and no longer.
 *
 * The publisher (http_job_changed, http_job_progressed) takes the mutex under which a connection is
 * suspended and entered into the list of waits, and so finds it before or after, never between.
 */
#include "http/internal.h"

#include "clock.h"

#include <math.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>

#define STREAM_BLOCK 4096 /* of libmicrohttpd's buffer */
#define STREAM_SEND 16384 /* of the socket's, which would grow to megabytes */
#define STREAM_PAUSE 0.1  /* seconds between two pieces */
#define STREAM_CHECK 2.0  /* between two looks whether the stream may go on */

/* Suspends the connection until there is another piece. False when the daemon drains. */
static bool suspend(struct exchange *exchange)
{
    struct http *http = exchange->http;
    bool open;

    connection_deadline(exchange->connection, HUGE_VAL, false);
    (void)pthread_mutex_lock(&http->mutex);
    open = !http->stopping && !http->draining;
    if (open) {
        MHD_suspend_connection(exchange->mhd);
        exchange->alive_at = clock_now() + http->config.heartbeat_seconds;
        pool_await_stream(exchange);
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return open;
}

static ssize_t read_stream(void *cls, uint64_t position, char *buffer, size_t size)
{
    struct exchange *exchange = cls;
    struct http *http = exchange->http;
    struct api_response *response = &exchange->response;
    size_t rest = response->body_size - exchange->piece_sent;
    size_t n = rest < size ? rest : size;

    (void)position;
    if (n > 0) {
        memcpy(buffer, response->body + exchange->piece_sent, n);
        exchange->piece_sent += n;
        exchange->sent += n;
        connection_deadline(exchange->connection, clock_now() + http->config.transfer_seconds,
                            false);
        return (ssize_t)n;
    }
    if (response->stream.ended || !suspend(exchange)) {
        return MHD_CONTENT_READER_END_OF_STREAM;
    }
    return 0;
}

struct MHD_Response *stream_open(struct exchange *exchange)
{
    struct http *http = exchange->http;
    int bytes = STREAM_SEND;
    bool granted;

    (void)pthread_mutex_lock(&http->mutex);
    granted = http->n_streams < http->config.max_streams;
    http->n_streams += granted ? 1 : 0;
    (void)pthread_mutex_unlock(&http->mutex);
    if (!granted) {
        return NULL;
    }
    exchange->streams = true;
    exchange->pause_until = clock_now() + STREAM_PAUSE;
    metrics_add(http->config.metrics, METRIC_HTTP_STREAMS, NULL, 1);
    (void)setsockopt(exchange->connection->fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, STREAM_BLOCK, read_stream, exchange,
                                             NULL);
}

void stream_closed(struct exchange *exchange)
{
    struct http *http = exchange->http;

    if (!exchange->streams) {
        return;
    }
    exchange->streams = false;
    (void)pthread_mutex_lock(&http->mutex);
    http->n_streams--;
    (void)pthread_mutex_unlock(&http->mutex);
    metrics_add(http->config.metrics, METRIC_HTTP_STREAMS, NULL, -1);
}

/* Whether the client sends nothing more, and was sent nothing since the last check: most that do so
   have gone. */
static bool may_have_gone(const struct exchange *exchange, double now)
{
    struct pollfd fd = {.fd = exchange->connection->fd, .events = POLLRDHUP};
    double sent = exchange->alive_at - exchange->http->config.heartbeat_seconds;

    return now >= sent + STREAM_CHECK && poll(&fd, 1, 0) > 0;
}

void stream_run(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    double now = clock_now();

    exchange->piece_sent = 0;
    response->body_size = 0;
    if (exchange->http->draining) {
        response->stream.ended = true;
        return;
    }
    api_stream_next(exchange->http->config.api, response,
                    now >= exchange->alive_at || may_have_gone(exchange, now));
    exchange->pause_until = now + STREAM_PAUSE;
}

double stream_look_at(const struct exchange *exchange)
{
    return fmin(exchange->alive_at, clock_now() + STREAM_CHECK);
}

bool stream_has_piece(const struct exchange *exchange)
{
    return exchange->response.body_size > 0 || exchange->response.stream.ended;
}
