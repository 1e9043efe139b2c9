/*
 * lane.c - the two queues of what leaves libmicrohttpd's threads, and who may go first.
 *
 *   requests   srnfd-req-N: all that takes milliseconds
 *   uploads    srnfd-upload-N: bodies that are to be parsed (api_is_upload), which can take
 *              seconds and hundreds of MiB, and give way like workers do
 *
 * So nothing short ever waits for a body to be parsed. In either lane owners take turns: once a
 * request of one was taken, what else it has queued goes behind the others'. An owner is a token's
 * name or, without tokens, an address. The first in the queue goes first unless its like have as
 * many threads as they may:
 *
 *   requests   all but probes may have one thread less than there are: /readyz and /metrics find
 *              one, whatever the others do. Of these a name may have as many as make half of all
 *              threads, and beyond its first none that is the last: another name finds one
 *   uploads    a name may have one thread less than there are; so may all together that wait for
 *              other servers (api_fetches), also without tokens
 *
 * Of uploads those go first whose owner has had less time of the threads lately: a few owners who
 * take turns with what each takes long would otherwise hold up another's for the sum of it. An
 * owner's time is kept when its connections have gone, and halves every few seconds; of very many
 * owners those are forgotten who had least.
 *
 * The two queues have no such shares without tokens. One more thread for uploads takes only those
 * that are small (api_is_small), with a little memory of their own: so they have a way past large
 * ones, whoever sends those, and whatever memory these need. One that turns out to need more
 * (a small file can hold a large mesh) is queued again, for the other threads.
 *
 * An upload that found no memory beside others is queued again, before all, to run alone: none
 * begins before it has ended, but on that thread. A request whose client has gone, and which could
 * not run so far, is not handled any more; an upload is told to stop. Either leaves the queue by
 * the lane of requests; when the daemon ends all are told so.
 *
 * Whether a client has gone its socket tells: it was reset, or sends no more. One that only closed
 * its half is not told apart from one that is not there any more. Here it is taken for gone after
 * GONE_SECONDS in which it was an upload or had no thread to run on, since what it would wait for
 * can hold others up.
 *
 * All functions are to be called with http->mutex held.
 */
#include "http/internal.h"

#include "clock.h"

#include <math.h>
#include <poll.h>

#define GONE_SECONDS 1.0
#define SPENT_HALVES 10.0 /* seconds in which an owner's time halves */
#define SPENT_ALIKE 0.05  /* seconds that make no difference */

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
    if (exchange->lane == LANE_UPLOADS) { /* one of its threads takes small ones alone */
        (void)pthread_cond_broadcast(&lane->work);
    } else {
        (void)pthread_cond_signal(&lane->work);
    }
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
    return a->holder == b->holder;
}

static size_t at_least_one(size_t count)
{
    return count > 0 ? count : 1;
}

/* The first thread for uploads takes small ones only, and counts for no share. */
static bool is_for_small(const struct lane *lane, size_t thread)
{
    return lane == &lane->http->lanes[LANE_UPLOADS] && thread == 0;
}

/* Whether this thread of the lane may take the exchange. */
static bool may_run(const struct lane *lane, size_t thread, const struct exchange *exchange)
{
    bool known = exchange->request.caller.account != NULL, uploads = exchange->lane == LANE_UPLOADS;
    size_t others = 0, own = 0, fetching = 0, n = lane->n_threads - uploads, most;

    if (exchange->request.probe || atomic_load(&exchange->gone)) {
        return true;
    }
    if (is_for_small(lane, thread)) {
        return exchange->small;
    }
    for (size_t i = 0; i < lane->n_threads; i++) {
        const struct exchange *runs = is_for_small(lane, i) ? NULL : lane->running[i];

        if (runs && runs->request.alone) {
            return false;
        }
        others += runs && !runs->request.probe;
        own += runs && !runs->request.probe && same_owner(runs, exchange);
        fetching += runs && runs->fetches;
    }
    most = at_least_one(n - 1);
    if (uploads) {
        return exchange->request.alone
                   ? others == 0
                   : (!known || own < most) && (!exchange->fetches || fetching < most);
    }
    return others < most && (!known || own == 0 || (own < (n + 1) / 2 && others + 1 < most));
}

/* What is left at a time of what an owner had. */
static double lasts(const struct spent *spent, double now)
{
    return spent->seconds * exp2((spent->at - now) / SPENT_HALVES);
}

/* Where the owner's time is kept; where it is not, where it may be: in place of the least. */
static struct spent *spent_of(struct lane *lane, uint64_t id, double now)
{
    struct spent *set = lane->spent[(id >> 8) % LANE_SETS], *least = set;

    for (size_t i = 0; i < LANE_WAYS; i++) {
        if (set[i].id == id) {
            return &set[i];
        }
        least = lasts(&set[i], now) < lasts(least, now) ? &set[i] : least;
    }
    return least;
}

/* What the owner has had of the lane's threads lately, in seconds, with what runs. */
static double spent_by(struct lane *lane, const struct exchange *exchange, double now)
{
    uint64_t id = exchange->holder->id;
    const struct spent *before = spent_of(lane, id, now);
    double seconds = before->id == id ? lasts(before, now) : 0.0;

    for (size_t i = 0; i < lane->n_threads; i++) {
        const struct exchange *runs = lane->running[i];

        seconds += runs && runs->holder->id == id ? now - lane->since[i] : 0.0;
    }
    return seconds;
}

/* Adds to what the owner has had. */
static void spend(struct lane *lane, const struct exchange *ran, double seconds, double now)
{
    struct spent *spent = spent_of(lane, ran->holder->id, now);
    double before = spent->id == ran->holder->id ? lasts(spent, now) : 0.0;

    *spent = (struct spent){ran->holder->id, before + seconds, now};
}

/* What of the queue goes next on this thread, or NULL. */
static struct exchange **choose(struct http *http, struct lane *lane, size_t thread, double now)
{
    struct exchange **place = &lane->first, **best = NULL;
    bool uploads = lane == &http->lanes[LANE_UPLOADS];
    double least = INFINITY;

    for (; *place; place = &(*place)->queue_next) {
        const struct exchange *exchange = *place;

        if (!http->stopping && !may_run(lane, thread, exchange)) {
            if (exchange->request.alone && !is_for_small(lane, thread)) {
                return best; /* nothing overtakes it */
            }
        } else if (!uploads || http->stopping || exchange->request.alone) {
            return best ? best : place;
        } else {
            double seconds = spent_by(lane, exchange, now);

            best = seconds < least - SPENT_ALIKE ? place : best;
            least = best == place ? seconds : least;
        }
    }
    return best;
}

/* What else the owner has queued goes to the end, in its order; but what is to run alone stays. */
static void give_way(struct lane *lane, const struct exchange *taken)
{
    struct exchange *later = NULL, **last = &later, **place = &lane->first;

    while (*place) {
        if (same_owner(*place, taken) && !(*place)->request.alone) {
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
    double now = clock_now();
    struct exchange **place = choose(http, lane, thread, now), *taken;

    if (!place) {
        return NULL;
    }
    taken = cut(lane, place);
    if (!atomic_load(&taken->gone)) {
        give_way(lane, taken);
    }
    taken->request.small = is_for_small(lane, thread) && taken->small;
    taken->phase = PHASE_RUNNING;
    lane->running[thread] = taken;
    lane->since[thread] = now;
    return taken;
}

void lane_leave(struct http *http, struct lane *lane, size_t thread)
{
    const struct exchange *ran = lane->running[thread];

    lane->running[thread] = NULL;
    if (lane == &http->lanes[LANE_UPLOADS]) {
        double now = clock_now();

        spend(lane, ran, now - lane->since[thread], now);
    }
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

    if (ended && (fd.revents & (POLLHUP | POLLERR)) != 0) {
        return true;
    }
    if (!ended) {
        exchange->ended_at = 0.0;
    } else if (exchange->ended_at == 0.0) {
        exchange->ended_at = now;
    }
    return ended && now - exchange->ended_at >= GONE_SECONDS;
}

/* Whether what is queued is to be passed over. What may run is about to be taken, and left to that,
   and its time begins when it may not: who closed its half is answered, however late the threads
   come to it on a busy machine. */
static bool is_given_up(const struct lane *lane, struct exchange *exchange, double now)
{
    if (atomic_load(&exchange->gone) || exchange->resumed || exchange->streams) {
        return false;
    }
    if (exchange->lane != LANE_UPLOADS && may_run(lane, 0, exchange)) {
        exchange->ended_at = 0.0;
        return false;
    }
    return has_gone(exchange, now);
}

/* Takes those out of the queue whose clients have gone. */
static void look_at_queue(struct http *http, struct lane *lane, double now)
{
    struct exchange **place = &lane->first;

    while (*place) {
        struct exchange *exchange = *place;

        if (is_given_up(lane, exchange, now)) {
            (void)cut(lane, place);
            atomic_store(&exchange->gone, true);
            atomic_store(&exchange->stop, true);
            exchange->lane = LANE_REQUESTS;
            lane_enqueue(http, exchange);
        } else {
            place = &exchange->queue_next;
        }
    }
}

void lane_look(struct http *http, double now)
{
    struct lane *uploads = &http->lanes[LANE_UPLOADS];

    for (size_t i = 0; i < uploads->n_threads; i++) {
        struct exchange *exchange = uploads->running[i];

        if (exchange && has_gone(exchange, now)) {
            atomic_store(&exchange->gone, true);
            atomic_store(&exchange->stop, true);
        }
    }
    for (size_t i = 0; i < LANES; i++) {
        look_at_queue(http, &http->lanes[i], now);
    }
}

void lane_stop(struct http *http)
{
    struct lane *uploads = &http->lanes[LANE_UPLOADS];

    http->giving_up = true;
    for (size_t i = 0; i < uploads->n_threads; i++) {
        if (uploads->running[i]) {
            atomic_store(&uploads->running[i]->stop, true);
        }
    }
    for (size_t i = 0; i < LANES; i++) {
        for (struct exchange *exchange = http->lanes[i].first; exchange;
             exchange = exchange->queue_next) {
            if (!exchange->resumed) { /* what is left of those is short */
                atomic_store(&exchange->stop, true);
            }
        }
    }
}
