/*
 * front_waiting.c - the lists of connections that the front keeps, and how it closes one: with an
 * answer, in good order, while what the client still sends is passed over.
 */
#include "http/front.h"

#include "clock.h"

#include <errno.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

/* For the rest of what a refused client sends: while bytes come, up to an end. */
#define LINGER_SECONDS 1.0
#define LINGER_SECONDS_MAX 10.0
#define LINGER_BYTES_MAX HTTP_DRAIN_MAX

void front_list_add(struct waiting_list *list, struct waiting *w)
{
    w->list = list;
    w->next = NULL;
    w->previous = list->last;
    *(list->last ? &list->last->next : &list->first) = w;
    list->last = w;
    list->count++;
}

void front_list_remove(struct waiting *w)
{
    struct waiting_list *list = w->list;

    *(w->previous ? &w->previous->next : &list->first) = w->next;
    *(w->next ? &w->next->previous : &list->last) = w->previous;
    list->count--;
}

void front_count(struct front *front, double change)
{
    metrics_add(front->http->config.metrics, METRIC_HTTP_CONNECTIONS, METRIC_LABELS("waiting"),
                change);
}

void front_let_go(struct front *front, struct waiting *w)
{
    (void)epoll_ctl(front->epoll, EPOLL_CTL_DEL, w->fd, NULL);
    front_list_remove(w);
    front_count(front, -1);
    free(w);
}

void front_hang_up(struct front *front, struct waiting *w)
{
    int fd = w->fd;

    front_let_go(front, w);
    (void)close(fd);
}

/* ---- Refusing -------------------------------------------------------------------------------- */

void front_drain(struct front *front, struct waiting *w)
{
    size_t before = w->passed_over;
    ssize_t n;

    while ((n = recv(w->fd, front->bytes, sizeof front->bytes, MSG_DONTWAIT)) > 0) {
        w->passed_over += (size_t)n;
        if (w->passed_over > LINGER_BYTES_MAX) {
            break;
        }
    }
    if (n > 0 || n == 0 || (errno != EAGAIN && errno != EINTR)) {
        front_hang_up(front, w);
    } else if (w->passed_over > before) {
        double now = clock_now();

        if (now < w->end) {
            front_list_remove(w);
            front_list_add(&front->answered, w);
            w->deadline = now + LINGER_SECONDS;
        }
    }
}

static void linger(struct front *front, struct waiting *w)
{
    front_list_add(&front->answered, w);
    w->deadline = clock_now() + LINGER_SECONDS;
    w->end = w->deadline + LINGER_SECONDS_MAX;
}

void front_refuse(struct front *front, struct waiting *w, const struct head_refusal *refusal)
{
    char text[REFUSAL_MAX], start[5] = "";
    size_t length;

    if (front->http->tls) {
        front_hang_up(front, w);
        return;
    }
    (void)!recv(w->fd, start, sizeof start, MSG_PEEK | MSG_DONTWAIT);
    length = refusal_write(front->http, refusal, start, text);
    if (send(w->fd, text, length, MSG_NOSIGNAL | MSG_DONTWAIT) != (ssize_t)length ||
        shutdown(w->fd, SHUT_WR) != 0) {
        front_hang_up(front, w);
        return;
    }
    front_list_remove(w);
    linger(front, w);
    /* The epoll set tells of new bytes only: those that are there are passed over now. */
    front_drain(front, w);
}

/* ---- Connections of others ------------------------------------------------------------------- */

void front_make_room_to_linger(struct front *front)
{
    while (front->answered.count > front->http->config.max_waiting) {
        front_hang_up(front, front->answered.first);
    }
}

void front_take_gifts(struct front *front)
{
    struct http *http = front->http;
    struct epoll_event event = {.events = EPOLLIN | EPOLLRDHUP | EPOLLET};
    struct waiting *given, *w;
    uint64_t count;

    (void)!read(front->gifts, &count, sizeof count);
    (void)pthread_mutex_lock(&http->mutex);
    given = front->given;
    front->given = NULL;
    (void)pthread_mutex_unlock(&http->mutex);
    while ((w = given) != NULL) {
        given = w->next;
        front_count(front, 1);
        linger(front, w);
        event.data.ptr = w;
        if (epoll_ctl(front->epoll, EPOLL_CTL_ADD, w->fd, &event) != 0) {
            front_hang_up(front, w);
        }
    }
    front_make_room_to_linger(front);
}

void front_linger(struct http *http, int fd)
{
    struct waiting *w = fd >= 0 ? calloc(1, sizeof *w) : NULL;
    const uint64_t one = 1;

    if (!w) {
        if (fd >= 0) {
            (void)close(fd);
        }
        return;
    }
    w->fd = fd;
    (void)pthread_mutex_lock(&http->mutex);
    if (http->front) {
        w->next = http->front->given;
        http->front->given = w;
        (void)!write(http->front->gifts, &one, sizeof one);
        w = NULL;
    }
    (void)pthread_mutex_unlock(&http->mutex);
    if (w) { /* the service ends */
        (void)close(fd);
        free(w);
    }
}
