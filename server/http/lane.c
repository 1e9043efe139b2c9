/*
 * lane.c - the two queues of what leaves libmicrohttpd's threads, and who may go first.
 *
 *   requests   srnfd-req-N: all that takes milliseconds
 *   uploads    srnfd-upload-N: bodies that are to be parsed (api_is_upload), which can take
 *              seconds and hundreds of MiB, and give way like workers do
 *
 * So nothing short ever waits for a body to be parsed. In either lane the first in the queue goes
 * first unless its like have as many threads as they may:
 *
 *   requests   an owner may have half the threads, and all but probes one less than there are:
 *              /readyz and /metrics find a thread, whatever the others do
 *   uploads    one thread more than is asked for is kept for bodies of up to SMALL_BODY of owners
 *              that have no upload running: so two names that hold the others keep no third one
 *              waiting. Of the others an owner may have one less than there are, and after each
 *              turn what else it has queued goes behind the others
 *
 * Without tokens there is one owner, who has all threads that are not kept for probes.
 *
 * An upload that found no memory beside others is queued again, before all, to run alone: none
 * begins before it has ended. One whose client has gone is told to stop, and leaves the queue by
 * the other lane; when the daemon ends all are told so.
 *
 * Whether a client has gone its socket tells: it sends no more. One that only closed its half is
 * not told apart from one that is not there any more. Here it is taken for gone after GONE_SECONDS,
 * since what it would wait for can hold others up.
 *
 * All functions are to be called with http->mutex held.
 */
#include "http/internal.h"

#include <poll.h>
#include <string.h>

#define GONE_SECONDS 1.0
#define SMALL_BODY ((size_t)1 << 20)

void lane_enqueue(struct http *http, struct exchange *exchange)
{
    struct lane *lane = &http->lanes[exchange->lane];

    exchange->phase = PHASE_QUEUED;
    exchange->woken = false;
    if (exchange->request.alone || atomic_load(&exchange->gone)) {
        exchange->queue_next = lane->first;
        lane->first = exchange;
        if (!exchange->queue_next) {
            lane->last = &exchange->queue_next;
        }
    } else {
        exchange->queue_next = NULL;
        *lane->last = exchange;
        lane->last = &exchange->queue_next;
    }
    (void)pthread_cond_signal(&lane->work);
}

static struct exchange *cut(struct lane *lane, struct exchange **place)
{
    struct exchange *exchange = *place;

    *place = exchange->queue_next;
    if (!*place) {
        lane->last = place;
    }
    return exchange;
}

static bool same_owner(const struct exchange *a, const struct exchange *b)
{
    return (a->request.caller.account != NULL) == (b->request.caller.account != NULL) &&
           strcmp(a->request.caller.name, b->request.caller.name) == 0;
}

static size_t at_least_one(size_t count)
{
    return count > 0 ? count : 1;
}

/* Whether the exchange may have one more thread of the lane. */
static bool may_run(const struct lane *lane, const struct exchange *exchange)
{
    bool known = exchange->request.caller.account != NULL, uploads = exchange->lane == LANE_UPLOADS;
    size_t others = 0, own = 0, n = lane->n_threads, most;

    if (exchange->request.probe || atomic_load(&exchange->gone)) {
        return true;
    }
    for (size_t i = 0; i < n; i++) {
        const struct exchange *runs = lane->running[i];

        if (runs && runs->request.alone) {
            return false;
        }
        others += runs && !runs->request.probe;
        own += runs && !runs->request.probe && same_owner(runs, exchange);
    }
    if (uploads) {
        size_t common = n - 1; /* without the one that is kept */
        bool kept = known && own == 0 && exchange->request.body_size <= SMALL_BODY;

        return exchange->request.alone
                   ? others == 0
                   : (others < common || kept) && (!known || own < at_least_one(common - 1));
    }
    most = at_least_one(n - 1);
    return others < most && (!known || own < (n + 1) / 2);
}

/* What else the owner has queued goes to the end, in its order. */
static void give_way(struct lane *lane, const struct exchange *taken)
{
    struct exchange *later = NULL, **last = &later, **place = &lane->first;

    while (*place) {
        if (same_owner(*place, taken)) {
            *last = cut(lane, place);
            last = &(*last)->queue_next;
        } else {
            place = &(*place)->queue_next;
        }
    }
    *last = NULL;
    *lane->last = later;
    if (later) {
        lane->last = last;
    }
}

struct exchange *lane_take(struct http *http, struct lane *lane, size_t thread)
{
    struct exchange **place = &lane->first, *taken;

    while (*place && !http->stopping && !may_run(lane, *place)) {
        if ((*place)->request.alone) {
            return NULL; /* nothing overtakes it */
        }
        place = &(*place)->queue_next;
    }
    if (!*place) {
        return NULL;
    }
    taken = cut(lane, place);
    if (taken->lane == LANE_UPLOADS) {
        give_way(lane, taken);
    }
    taken->phase = PHASE_RUNNING;
    lane->running[thread] = taken;
    return taken;
}

void lane_leave(struct http *http, struct lane *lane, size_t thread)
{
    lane->running[thread] = NULL;
    if (lane->first || http->stopping) {
        (void)pthread_cond_broadcast(&lane->work);
    }
    if (http->stopping) {
        (void)pthread_cond_broadcast(&http->lanes[LANE_REQUESTS].work);
    }
}

/* What an upload leaves to be done goes to the other lane, whose threads so end after it. */
bool lane_is_over(const struct http *http, const struct lane *lane)
{
    const struct lane *uploads = &http->lanes[LANE_UPLOADS];
    bool busy = lane->first != NULL || uploads->first != NULL;

    for (size_t i = 0; i < uploads->n_threads; i++) {
        busy = busy || uploads->running[i];
    }
    return http->stopping && !busy;
}

/* Notes since when the client has sent nothing more to come. */
static bool has_gone(struct exchange *exchange, double now)
{
    struct pollfd fd = {.fd = exchange->connection->fd, .events = POLLRDHUP};
    bool ended = poll(&fd, 1, 0) > 0 && (fd.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;

    if (!ended) {
        exchange->ended_at = 0.0;
    } else if (exchange->ended_at == 0.0) {
        exchange->ended_at = now;
    }
    return ended && now - exchange->ended_at >= GONE_SECONDS;
}

void lane_look(struct http *http, double now)
{
    struct lane *uploads = &http->lanes[LANE_UPLOADS];
    struct exchange **place = &uploads->first;

    for (size_t i = 0; i < uploads->n_threads; i++) {
        struct exchange *exchange = uploads->running[i];

        if (exchange && has_gone(exchange, now)) {
            atomic_store(&exchange->gone, true);
            atomic_store(&exchange->stop, true);
        }
    }
    while (*place) {
        if (has_gone(*place, now)) {
            struct exchange *exchange = cut(uploads, place);

            atomic_store(&exchange->gone, true);
            atomic_store(&exchange->stop, true);
            exchange->lane = LANE_REQUESTS;
            lane_enqueue(http, exchange);
        } else {
            place = &(*place)->queue_next;
        }
    }
}

void lane_stop_uploads(struct http *http)
{
    struct lane *uploads = &http->lanes[LANE_UPLOADS];

    for (size_t i = 0; i < uploads->n_threads; i++) {
        if (uploads->running[i]) {
            atomic_store(&uploads->running[i]->stop, true);
        }
    }
    for (struct exchange *exchange = uploads->first; exchange; exchange = exchange->queue_next) {
        atomic_store(&exchange->stop, true);
    }
}
