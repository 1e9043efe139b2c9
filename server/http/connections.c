/*
 * connections.c - the TCP connections, their deadlines, and the timer thread srnfd-timer.
 *
 * libmicrohttpd's own timeout counts inactivity, so a client that sends one byte a second lives for
 * ever. Each connection here has a time by which it must have moved on (headers complete, the next
 * piece of the body, the response taken); the timer shuts the socket of one that has not,
 * libmicrohttpd sees its end and closes it. The shutdown happens under the mutex that the
 * notification of the closing takes, so that a descriptor is never another connection's by then.
 *
 * A client that ends in the middle of a request is not noticed either where its end came
 * together with its last bytes: libmicrohttpd waits for an edge that has passed. So the timer
 * asks the sockets of those that still owe bytes, and gives one whose peer has finished sending,
 * with nothing left to read, that edge once more, by shutting its reading half. libmicrohttpd then
 * reads the end, after what it has read before, however late it comes to that: where the request
 * was whole it is answered, otherwise the connection is closed. No time is set for this.
 *
 * A body or a response must keep up a rate: its deadline is transfer_seconds away at first, and
 * each byte that moves puts it off by what it may take, to no more than transfer_seconds from then.
 * Of a body the pieces are counted as they come (exchange.c); of a response the timer asks the
 * kernel how much the client has acknowledged, since what libmicrohttpd has written may lie in the
 * socket's buffer. With TLS that counts the records' bytes.
 *
 * The timer also wakes exchanges whose wait for a job is over.
 */
#include "http/internal.h"

#include <linux/tcp.h> /* not <netinet/tcp.h>, whose tcp_info ends before tcpi_bytes_acked */
#include <math.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>

#define TIMER_PERIOD 0.25 /* seconds between two looks at the connections */

static double seconds_of(clockid_t clock)
{
    struct timespec now;

    (void)clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double http_now(void)
{
    return seconds_of(CLOCK_MONOTONIC);
}

double http_last_tick(void)
{
    return seconds_of(CLOCK_MONOTONIC_COARSE);
}

struct connection *connection_of(struct MHD_Connection *mhd)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);

    return info ? info->socket_context : NULL;
}

static void connection_opened(struct http *http, struct MHD_Connection *mhd, void **context)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
    const union MHD_ConnectionInfo *from =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    struct connection *connection = calloc(1, sizeof *connection);
    double now = http_now();

    (void)pthread_mutex_lock(&http->mutex);
    slots_came(http, info ? info->connect_fd : -1);
    if (connection && info && from) {
        connection->peer = shares_peer(http, from->client_addr);
    }
    if (!connection || !connection->peer) { /* its first request is closed without an answer */
        (void)pthread_mutex_unlock(&http->mutex);
        free(connection);
        return;
    }
    *context = connection;
    connection->http = http;
    connection->fd = info->connect_fd;
    tap_open(connection);
    slots_busy(connection, true, now);
    connection->deadline = now + http->config.header_seconds;
    connection->reads = true;
    connection->next = http->connections;
    connection->place = &http->connections;
    if (connection->next) {
        connection->next->place = &connection->next;
    }
    http->connections = connection;
    slots_opened(connection);
    (void)pthread_mutex_unlock(&http->mutex);
    metrics_add(http->config.metrics, METRIC_HTTP_CONNECTIONS, METRIC_LABELS("serving"), 1);
}

static void connection_closed(struct http *http, struct connection *connection)
{
    tap_close(connection);
    if (connection->ended && connection->reads && connection->busy) {
        metrics_add(http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("abandoned"), 1);
    }
    (void)pthread_mutex_lock(&http->mutex);
    *connection->place = connection->next;
    if (connection->next) {
        connection->next->place = connection->place;
    }
    slots_closed(connection);
    shares_drop(http, connection->peer);
    shares_drop(http, connection->owner);
    (void)pthread_mutex_unlock(&http->mutex);
    metrics_add(http->config.metrics, METRIC_HTTP_CONNECTIONS, METRIC_LABELS("serving"), -1);
    free(connection->target);
    free(connection->spare);
    free(connection);
}

void connection_notify(void *cls, struct MHD_Connection *mhd, void **context,
                       enum MHD_ConnectionNotificationCode code)
{
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        *context = NULL;
        connection_opened(cls, mhd, context);
    } else if (*context) {
        connection_closed(cls, *context);
        *context = NULL;
    }
}

/* NULL when memory is short. */
static void keep_target(struct connection *connection, const char *uri)
{
    size_t size = strlen(uri) + 1;

    if (!connection->target || size > connection->target_size) {
        free(connection->target);
        connection->target = malloc(size);
        connection->target_size = size;
    }
    if (connection->target) {
        memcpy(connection->target, uri, size);
    }
}

void *connection_target(void *cls, const char *uri, struct MHD_Connection *mhd)
{
    struct connection *connection = connection_of(mhd);
    struct http *http = cls;

    if (connection) {
        keep_target(connection, uri);
        connection_deadline(connection, http_last_tick() + http->config.header_seconds, true);
    }
    return NULL;
}

void connection_deadline(struct connection *connection, double deadline, bool reads)
{
    atomic_store_explicit(&connection->sends, false, memory_order_relaxed);
    atomic_store_explicit(&connection->reads, reads, memory_order_relaxed);
    atomic_store_explicit(&connection->deadline, deadline, memory_order_relaxed);
}

double connection_put_off(const struct http *http, double deadline, double now, double bytes)
{
    return fmin(now + http->config.transfer_seconds, deadline + bytes / http->config.least_rate);
}

/* ---- The timer ------------------------------------------------------------------------------- */

/* Puts off the deadline of a response by what the client has taken of it since the last look. The
   mutex is held. */
static void follow_response(struct connection *connection, double now)
{
    double deadline = connection->deadline;
    struct tcp_info tcp;
    socklen_t size = sizeof tcp;

    memset(&tcp, 0, sizeof tcp);
    if (getsockopt(connection->fd, IPPROTO_TCP, TCP_INFO, &tcp, &size) != 0 ||
        tcp.tcpi_bytes_acked <= connection->taken) {
        return;
    }
    /* Where the response has ended meanwhile the deadline is another one, and stays. */
    (void)atomic_compare_exchange_strong(
        &connection->deadline, &deadline,
        connection_put_off(connection->http, deadline, now,
                           (double)(tcp.tcpi_bytes_acked - connection->taken)));
    connection->taken = tcp.tcpi_bytes_acked;
}

/* Whether the peer has finished sending and everything it sent was read. */
static bool finished_sending(int fd)
{
    struct pollfd look_at = {.fd = fd, .events = POLLRDHUP};
    int unread = 0;

    return poll(&look_at, 1, 0) > 0 && ioctl(fd, FIONREAD, &unread) == 0 && unread == 0;
}

/* Lets libmicrohttpd see the end of what the peer sends, once. The mutex is held. */
static void tell_end(struct connection *connection)
{
    if (!connection->ended && connection->reads && finished_sending(connection->fd)) {
        connection->ended = true;
        (void)shutdown(connection->fd, SHUT_RD);
    }
}

/* Ends what is over; returns when to look again. The mutex is held. */
static double look(struct http *http, double now)
{
    double next = now + TIMER_PERIOD;

    for (struct connection *connection = http->connections; connection;
         connection = connection->next) {
        if (connection->sends) {
            follow_response(connection, now);
        }
        tell_end(connection);
        if (connection->deadline <= now) {
            metrics_add(http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("late"), 1);
            (void)shutdown(connection->fd, SHUT_RDWR);
            connection->deadline = HUGE_VAL;
            connection->reads = false;
        }
    }
    lane_look(http, now);
    for (struct exchange *exchange = http->waits; exchange; exchange = exchange->wait_next) {
        if (exchange->phase != PHASE_WAITING) {
            continue;
        }
        double due =
            exchange->streams ? exchange->deadline : fmin(exchange->deadline, exchange->look_at);

        if (due <= now) {
            pool_wake(exchange);
        } else if (due < next) {
            next = due;
        }
    }
    return next;
}

static void *watch(void *argument)
{
    struct http *http = argument;

    (void)pthread_mutex_lock(&http->mutex);
    while (!http->timer_stopping) {
        double next = look(http, http_now());
        struct timespec until = {.tv_sec = (time_t)next};

        until.tv_nsec = (long)(1e9 * (next - (double)until.tv_sec));
        (void)pthread_cond_timedwait(&http->timer, &http->mutex, &until);
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return NULL;
}

int timer_start(struct http *http)
{
    if (pthread_create(&http->timer_thread, NULL, watch, http) != 0) {
        return -1;
    }
    (void)pthread_setname_np(http->timer_thread, "srnfd-timer");
    http->timer_started = true;
    return 0;
}

void timer_stop(struct http *http)
{
    if (!http->timer_started) {
        return;
    }
    (void)pthread_mutex_lock(&http->mutex);
    http->timer_stopping = true;
    (void)pthread_cond_signal(&http->timer);
    (void)pthread_mutex_unlock(&http->mutex);
    (void)pthread_join(http->timer_thread, NULL);
    http->timer_started = false;
}
