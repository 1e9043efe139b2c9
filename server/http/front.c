/*
 * front.c - the door: the thread srnfd-front accepts connections and keeps each until the head of
 * its first request is there; only then libmicrohttpd gets it.
 *
 * The head is looked at where it lies, in the socket's buffer (MSG_PEEK), and judged by head.c. So
 * a client that connects and says nothing, or says it a byte a second, costs a descriptor and
 * struct waiting, and neither memory nor a slot of libmicrohttpd; and what libmicrohttpd would
 * answer by itself, with pages of its own, is answered here with problem documents. The later
 * requests of a connection do not come by here: guard.c judges them, as far as libmicrohttpd lets
 * them through. With TLS that holds for every request: a connection is handed over when its first
 * record is there.
 *
 * When more than max_waiting connections wait, or descriptors run out, the one that has waited
 * longest goes, unless its head has come meanwhile: whoever sends a request when it connects is
 * never kept out by those who do not. Whether a head has a token that holds is judged here, too,
 * before there is a place for it: that takes microseconds, and no more heads are unjudged than
 * wait. A head must come in header_seconds and in PIECES_MAX pieces. With all max_connections in
 * use another one gives way (slots.c); where none does, a request is answered 503 here. An answer
 * closes its connection in good order: what the client still sends is passed over for a moment,
 * since closing a socket with unread bytes would take the answer back (front_waiting.c).
 * Connections that libmicrohttpd's threads close so, they give to the front (front_linger).
 *
 * All of this belongs to the one thread. The one lock that it takes is http->mutex, for slots.c and
 * for the list of those that are given to it. It never blocks on a client: an answer is one send
 * into an empty buffer.
 */
#include "http/front.h"

#include "clock.h"
#include "log.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#define PIECES_MAX 256 /* looks at one head: each looks at all of it again */
#define AGAIN_MS 2     /* before those are handed over for which there was no place */
#define EVENTS 64
#define NO_DESCRIPTORS_MS 100 /* before accepting again when descriptors ran out */

/* ---- Looking at heads ------------------------------------------------------------------------ */

static const struct head_refusal busy = {503, "server-busy",
                                         "Too many connections are open; try again in a moment."};

/* To libmicrohttpd, into one of the lists of those that wait for that, or refused. */
static void hand_over(struct front *front, struct waiting *w, bool known)
{
    struct waiting_list *list = known ? &front->known : &front->ready;
    struct sockaddr_storage peer = w->peer;
    socklen_t length = w->peer_length;
    int fd = w->fd;

    switch (slots_take(front->http, (const struct sockaddr *)&peer, known)) {
    case SLOT_NONE:
        front_refuse(front, w, &busy);
        return;
    case SLOT_LATER:
        if (w->list != list) {
            front_list_remove(w);
            front_list_add(list, w);
        }
        return;
    case SLOT_FREE:
        break;
    }
    front_let_go(front, w);
    slots_hand_over(front->http, fd, known);
    /* Closes the descriptor where it fails; slots.c forgets it then. */
    (void)MHD_add_connection(front->http->daemon, fd, (const struct sockaddr *)&peer, length);
}

/* Those that wait for a place, in the order in which they came. */
static void hand_over_again(struct front *front)
{
    for (size_t i = 0; i < 2; i++) {
        struct waiting_list *list = i == 0 ? &front->known : &front->ready;
        struct waiting *w, *last = NULL;

        while ((w = list->first) != NULL && w != last) {
            last = w;
            hand_over(front, w, i == 0);
        }
    }
}

/* The head is complete, in front->bytes. Whether it has a token that holds is known before it gets
   a place, or takes one from another: so it keeps it, and waits, if it must, before the others. */
static void admit(struct front *front, struct waiting *w, size_t size)
{
    const char *value = NULL;
    size_t length = 0;

    if (!front->http->tls) {
        value = head_field(front->bytes, size, "Authorization", &length);
    }
    hand_over(front, w, value && api_knows(front->http->config.api, value, length));
}

static void look(struct front *front, struct waiting *w)
{
    static const struct head_refusal dribble = {400, "malformed-request",
                                                "The head comes in too many pieces."};
    struct head_refusal refusal;
    ssize_t n = recv(w->fd, front->bytes, sizeof front->bytes, MSG_PEEK | MSG_DONTWAIT);
    enum head_verdict verdict;

    if (n <= 0) {
        if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
            front_hang_up(front, w);
        }
        return;
    }
    verdict = front->http->tls ? head_check_tls(front->bytes, (size_t)n, &refusal)
                               : head_check(front->bytes, (size_t)n, &refusal);
    if (verdict == HEAD_INCOMPLETE && ++w->pieces > PIECES_MAX) {
        verdict = HEAD_REFUSED;
        refusal = dribble;
    }
    if (verdict == HEAD_COMPLETE) {
        admit(front, w, (size_t)n);
    } else if (verdict == HEAD_REFUSED) {
        front_refuse(front, w, &refusal);
    }
}

/* ---- Accepting ------------------------------------------------------------------------------- */

static bool is_crowded(const struct front *front)
{
    return front->heads.count + front->ready.count > front->http->config.max_waiting;
}

/* The one that has waited longest for the rest of its head goes. What has come of that since the
   last round is looked at before. */
static void make_room(struct front *front)
{
    static const struct head_refusal crowded = {503, "server-busy",
                                                "Too many connections wait without a request."};
    struct waiting *oldest = NULL;

    while (is_crowded(front) && front->heads.first && front->heads.first != oldest) {
        oldest = front->heads.first;
        look(front, oldest);
    }
    if (is_crowded(front)) {
        oldest = front->heads.first ? front->heads.first : front->ready.first;
        metrics_add(front->http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("crowded"), 1);
        front_refuse(front, oldest, &crowded);
    }
}

static bool take_in(struct front *front, int fd, const struct sockaddr_storage *peer,
                    socklen_t length)
{
    struct epoll_event event = {.events = EPOLLIN | EPOLLRDHUP | EPOLLET};
    struct waiting *w = calloc(1, sizeof *w);

    if (!w) {
        return false;
    }
    w->fd = fd;
    w->peer = *peer;
    w->peer_length = length;
    w->deadline = clock_now() + front->http->config.header_seconds;
    event.data.ptr = w;
    if (epoll_ctl(front->epoll, EPOLL_CTL_ADD, fd, &event) != 0) {
        free(w);
        return false;
    }
    front_list_add(&front->heads, w);
    front_count(front, 1);
    metrics_add(front->http->config.metrics, METRIC_HTTP_ACCEPTED, NULL, 1);
    make_room(front);
    front_make_room_to_linger(front);
    return true;
}

/* Descriptors ran out, whatever took them: the connection that has waited longest goes, one that is
   closing before others. False: none waits. */
static bool free_descriptor(struct front *front)
{
    struct waiting *w = front->answered.first ? front->answered.first : front->heads.first;

    if (w) {
        metrics_add(front->http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("crowded"), 1);
        front_hang_up(front, w);
    }
    return w != NULL;
}

/* Takes what is there. False when the descriptors ran out. */
static bool accept_all(struct front *front)
{
    for (int i = 0; i < EVENTS; i++) {
        struct sockaddr_storage peer;
        socklen_t length = sizeof peer;
        int fd = accept4(front->http->listen_fd, (struct sockaddr *)&peer, &length,
                         SOCK_NONBLOCK | SOCK_CLOEXEC);

        if (fd < 0 && (errno == EMFILE || errno == ENFILE) && free_descriptor(front)) {
            continue;
        }
        if (fd < 0) {
            return errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM;
        }
        if (!take_in(front, fd, &peer, length)) {
            (void)close(fd);
        }
    }
    return true;
}

static void listen_again(struct front *front, bool listening)
{
    struct epoll_event event = {.events = listening ? EPOLLIN : 0, .data.ptr = front};

    (void)epoll_ctl(front->epoll, EPOLL_CTL_MOD, front->http->listen_fd, &event);
    front->listening = listening;
}

/* Ends what is late; returns the milliseconds until the next is. */
static int expire(struct front *front)
{
    static const struct head_refusal late = {408, "request-timeout",
                                             "The head of the request did not come in time."};
    double now = clock_now(), next = now + 60;

    while (front->heads.first && front->heads.first->deadline <= now) {
        struct waiting *w = front->heads.first;

        metrics_add(front->http->config.metrics, METRIC_HTTP_CUT, METRIC_LABELS("late"), 1);
        if (w->pieces > 0) {
            front_refuse(front, w, &late);
        } else {
            front_hang_up(front, w);
        }
    }
    while (front->ready.first && front->ready.first->deadline <= now) {
        front_refuse(front, front->ready.first, &busy);
    }
    while (front->known.first && front->known.first->deadline <= now) {
        front_refuse(front, front->known.first, &busy);
    }
    while (front->answered.first && front->answered.first->deadline <= now) {
        front_hang_up(front, front->answered.first);
    }
    for (size_t i = 0; i < 2; i++) {
        const struct waiting *first = i == 0 ? front->heads.first : front->answered.first;

        next = first && first->deadline < next ? first->deadline : next;
    }
    return front->ready.first || front->known.first ? AGAIN_MS : (int)(1000 * (next - now)) + 1;
}

/* What one round may free is not looked at again in it: each descriptor is in the set once, and
   only its own event, or expire and make_room, end it. */
static bool handle(struct front *front, const struct epoll_event *events, int n)
{
    bool arrivals = false, gifts = false;

    for (int i = 0; i < n; i++) {
        struct waiting *w = events[i].data.ptr;

        if (events[i].data.ptr == &front->stop) {
            return false;
        }
        if (events[i].data.ptr == front) {
            arrivals = true;
        } else if (events[i].data.ptr == &front->gifts) {
            gifts = true;
        } else if (w->list == &front->heads) {
            look(front, w);
        } else if (w->list == &front->answered) {
            front_drain(front, w);
        }
    }
    if (gifts) {
        front_take_gifts(front);
    }
    if (arrivals && !accept_all(front)) {
        LOG_WARN("no-descriptors", log_number("waiting", (double)front->heads.count));
        listen_again(front, false);
    }
    return true;
}

static void *stand(void *argument)
{
    struct front *front = argument;
    struct epoll_event events[EVENTS];
    bool going = true;

    while (going) {
        int patience = expire(front), n;

        if (!front->listening) {
            patience = NO_DESCRIPTORS_MS;
        }
        n = epoll_wait(front->epoll, events, EVENTS, patience);
        if (!front->listening) {
            listen_again(front, true);
        }
        going = n <= 0 || handle(front, events, n);
        if (going) {
            hand_over_again(front);
        }
    }
    return NULL;
}

/* ---- Life ------------------------------------------------------------------------------------ */

static void front_free(struct front *front)
{
    struct waiting_list *lists[] = {&front->heads, &front->ready, &front->known, &front->answered};

    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
        while (lists[i]->first) {
            front_hang_up(front, lists[i]->first);
        }
    }
    while (front->given) {
        struct waiting *w = front->given;

        front->given = w->next;
        (void)close(w->fd);
        free(w);
    }
    if (front->epoll >= 0) {
        (void)close(front->epoll);
    }
    if (front->stop >= 0) {
        (void)close(front->stop);
    }
    if (front->gifts >= 0) {
        (void)close(front->gifts);
    }
    free(front);
}

int front_start(struct http *http)
{
    struct front *front = calloc(1, sizeof *front);
    struct epoll_event arrivals = {.events = EPOLLIN}, stop = arrivals, gifts = arrivals;

    if (!front) {
        return -1;
    }
    front->http = http;
    front->listening = true;
    front->epoll = epoll_create1(EPOLL_CLOEXEC);
    front->stop = eventfd(0, EFD_CLOEXEC);
    arrivals.data.ptr = front;
    front->gifts = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    stop.data.ptr = &front->stop;
    gifts.data.ptr = &front->gifts;
    if (front->epoll < 0 || front->stop < 0 || front->gifts < 0 ||
        epoll_ctl(front->epoll, EPOLL_CTL_ADD, front->gifts, &gifts) != 0 ||
        epoll_ctl(front->epoll, EPOLL_CTL_ADD, http->listen_fd, &arrivals) != 0 ||
        epoll_ctl(front->epoll, EPOLL_CTL_ADD, front->stop, &stop) != 0 ||
        pthread_create(&front->thread, NULL, stand, front) != 0) {
        front_free(front);
        return -1;
    }
    (void)pthread_setname_np(front->thread, "srnfd-front");
    http->front = front;
    return 0;
}

void front_stop(struct http *http)
{
    struct front *front = http->front;
    const uint64_t one = 1;

    if (!front) {
        return;
    }
    if (write(front->stop, &one, sizeof one) == (ssize_t)sizeof one) {
        (void)pthread_join(front->thread, NULL);
        (void)pthread_mutex_lock(&http->mutex);
        http->front = NULL;
        (void)pthread_mutex_unlock(&http->mutex);
        front_free(front);
    }
}
