/*
 * timer.c - the thread srnfd-timer, which watches the deadlines.
 *
 * libmicrohttpd's own timeout counts inactivity, so a client that sends one byte a second lives for
 * ever. Each connection here has a time by which it must have moved on (connections.c); the timer
 * shuts the socket of one that has not, libmicrohttpd sees its end and closes it. The shutdown
 * happens under the mutex that the notification of the closing takes, so that a descriptor is never
 * another connection's by then.
 *
 * A client that ends in the middle of a request is not noticed either where its end came
 * together with its last bytes: libmicrohttpd waits for an edge that has passed. So the timer
 * asks the sockets of those that still owe bytes, and gives one whose peer has finished sending,
 * with nothing left to read, that edge once more, by shutting its reading half. libmicrohttpd then
 * reads the end, after what it has read before, however late it comes to that: where the request
 * was whole it is answered, otherwise the connection is closed. No time is set for this.
 *
 * The deadline of a response moves with what the client has taken of it. The timer asks the kernel
 * how much it has acknowledged, since what libmicrohttpd has written may lie in the socket's
 * buffer. With TLS that counts the records' bytes.
 *
 * The timer also wakes exchanges whose wait for a job is over.
 */
#include "http/internal.h"

#include "clock.h"

#include <linux/tcp.h> /* not <netinet/tcp.h>, whose tcp_info ends before tcpi_bytes_acked */
#include <math.h>
#include <netinet/in.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#define TIMER_PERIOD 0.25 /* seconds between two looks at the connections */

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
        double next = look(http, clock_now());
        struct timespec until = clock_timespec(next);

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
