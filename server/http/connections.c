/*
 * connections.c - the TCP connections, from their opening to their end, and until when each must
 * have moved on: headers complete, the next piece of the body, the response taken. The timer holds
 * them to it (timer.c).
 *
 * A body or a response must keep up a rate: its deadline is transfer_seconds away at first, and
 * each byte that moves puts it off by what it may take, to no more than transfer_seconds from then.
 * Of a body the pieces are counted as they come (exchange.c), of a response what the client has
 * acknowledged (timer.c).
 */
#include "http/internal.h"

#include "clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    double now = clock_now();

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
    kept_drop(connection);
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
        connection_deadline(connection, clock_last_tick() + http->config.header_seconds, true);
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
