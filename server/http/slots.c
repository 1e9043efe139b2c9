/*
 * slots.c - who has a place among the max_connections that are served, and who gives way.
 *
 * A connection is *known* once a request on it was admitted: it brought a token that holds, or none
 * is asked for. It is *busy* from its opening, and later from the head of a request, to the end of
 * the response, otherwise idle.
 * The front judges the token of a first request before there is a place for it (front.c), so a new
 * connection with one that holds is known, and keeps its place while the request is read. With TLS
 * the token lies behind the handshake, and a new connection is unknown. Unknown ones may take all
 * places but kept_connections, known ones all; and when the places are taken, one gives way:
 *
 *   1. an unknown one, of the address that has most connections: an idle one before a busy one,
 *      and of these the one that has been so for longest;
 *   2. otherwise a known one that is idle: the same.
 *
 * Known ones that are busy stay: that no token's name has all places with them is seen to by
 * max_owner_requests, and that they come to an end by the rate that transfers must keep up. An
 * address gets no place at the expense of another that has fewer (2.; of the first kind the one
 * that goes is always among those of the address that has most).
 *
 * Giving way is a shutdown of the socket; libmicrohttpd sees its end and closes it, soon. Until
 * then there is one connection more, of LEAVING_MAX at most. With these taken, or HANDED_MAX that
 * libmicrohttpd has not looked at yet, unknown newcomers wait at the front; known ones pass them
 * by, behind which they would wait in libmicrohttpd.
 */
#include "http/internal.h"

#include "clock.h"

#include <math.h>
#include <sys/socket.h>

#define LEAVING_MAX 128
#define HANDED_MAX 32
#define LOST_SECONDS 1.0 /* after which a connection that libmicrohttpd never showed is forgotten */

static bool gives_way_before(const struct connection *a, const struct connection *b)
{
    if (a->known != b->known) {
        return !a->known;
    }
    if (a->peer->connections != b->peer->connections) {
        return a->peer->connections > b->peer->connections;
    }
    if (a->busy != b->busy) {
        return !a->busy;
    }
    return a->since <= b->since; /* of equals, the one further back in the list is older */
}

/* The one that gives way for a newcomer whose address has so many connections; NULL: none does. The
   mutex is held. */
static struct connection *choose(struct http *http, size_t newcomers)
{
    struct connection *chosen = NULL;

    for (struct connection *c = http->connections; c; c = c->next) {
        if (!c->leaving && !(c->known && c->busy) && (!chosen || gives_way_before(c, chosen))) {
            chosen = c;
        }
    }
    return chosen && chosen->known && chosen->peer->connections < newcomers ? NULL : chosen;
}

/* The mutex is held. */
static void send_away(struct http *http, struct connection *connection)
{
    metrics_add(http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("displaced"), 1);
    connection->leaving = true;
    connection->reads = false;
    connection->deadline = HUGE_VAL;
    http->n_leaving++;
    http->n_unknown -= connection->known ? 0 : 1;
    (void)shutdown(connection->fd, SHUT_RDWR);
}

/* One that was handed over and never came: memory was short. The mutex is held. */
static void forget_lost(struct http *http, double now)
{
    if (http->n_handed > 0 && now - http->handed_at > LOST_SECONDS) {
        http->n_handed = http->n_handed_known = 0;
    }
}

enum slot slots_take(struct http *http, const struct sockaddr *address, bool known)
{
    const struct http_config *config = &http->config;
    enum slot slot = SLOT_FREE;
    double now = clock_now();
    size_t taken, unknown;

    (void)pthread_mutex_lock(&http->mutex);
    forget_lost(http, now);
    taken = http->n_connections + http->n_handed - http->n_leaving;
    unknown = http->n_unknown + http->n_handed - http->n_handed_known;
    if (!known && (http->n_handed >= HANDED_MAX || http->n_leaving >= LEAVING_MAX)) {
        slot = SLOT_LATER;
    } else if (taken >= config->max_connections ||
               (!known && unknown >= config->max_connections - config->kept_connections)) {
        struct connection *chosen = choose(http, shares_connections(http, address));

        if (chosen) {
            send_away(http, chosen);
        } else {
            slot = http->n_handed > 0 ? SLOT_LATER : SLOT_NONE;
        }
    }
    if (slot == SLOT_FREE) {
        http->n_handed++;
        http->n_handed_known += known;
        http->handed_at = now;
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return slot;
}

static bool was_judged(const struct http *http, int fd)
{
    return !http->tls && fd >= 0 && (size_t)fd < http->n_taps && atomic_load(&http->judged[fd]);
}

void slots_hand_over(struct http *http, int fd, bool known)
{
    if (!http->tls && (size_t)fd < http->n_taps) {
        atomic_store(&http->judged[fd], known);
    }
}

void slots_came(struct http *http, int fd)
{
    http->n_handed -= http->n_handed > 0 ? 1 : 0;
    http->n_handed_known -= http->n_handed_known > 0 && was_judged(http, fd) ? 1 : 0;
}

void slots_opened(struct connection *connection)
{
    struct http *http = connection->http;

    connection->known = was_judged(http, connection->fd);
    http->n_connections++;
    http->n_unknown += connection->known ? 0 : 1;
    connection->peer->connections++;
}

void slots_closed(struct connection *connection)
{
    struct http *http = connection->http;

    http->n_connections--;
    if (connection->leaving) {
        http->n_leaving--;
    } else if (!connection->known) {
        http->n_unknown--;
    }
    connection->peer->connections--;
}

void slots_know(struct connection *connection, bool known)
{
    struct http *http = connection->http;

    if (connection->known == known) { /* written by this thread alone */
        return;
    }
    (void)pthread_mutex_lock(&http->mutex);
    connection->known = known;
    if (!connection->leaving) {
        http->n_unknown += known ? (size_t)-1 : 1;
    }
    (void)pthread_mutex_unlock(&http->mutex);
}

void slots_busy(struct connection *connection, bool busy, double now)
{
    connection->since = now;
    connection->busy = busy;
}
