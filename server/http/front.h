/*
 * front.h - the connections that the front keeps (front.c): each is in one list, in the order of
 * its deadlines. All of it belongs to the front's thread, but for what is marked [m].
 */
#ifndef SRNFD_HTTP_FRONT_H
#define SRNFD_HTTP_FRONT_H

#include "http/head.h"
#include "http/internal.h"

struct waiting {
    struct waiting *next, *previous; /* in the order of their deadlines, within their list */
    struct waiting_list *list;
    int fd;
    unsigned pieces;
    size_t passed_over;
    double deadline;
    double end; /* of the passing over */
    socklen_t peer_length;
    struct sockaddr_storage peer;
};

struct waiting_list {
    struct waiting *first, *last;
    size_t count;
};

struct front {
    struct http *http;
    pthread_t thread;
    int epoll, stop, gifts;
    struct waiting_list heads;    /* whose head has not come */
    struct waiting_list ready;    /* whose head has, and that wait for a place */
    struct waiting_list known;    /* the same, of callers with a token that holds */
    struct waiting_list answered; /* refused, to be closed */
    struct waiting *given;        /* [m] the list of front_linger, not in the set yet */
    char bytes[HEAD_BYTES_MAX];
    bool listening;
};

void front_list_add(struct waiting_list *list, struct waiting *w);
void front_list_remove(struct waiting *w);
/* Adds to the connections that wait, as /metrics tells them. */
void front_count(struct front *front, double change);
/* Forgets it; the descriptor is the caller's. */
void front_let_go(struct front *front, struct waiting *w);
/* Forgets it and closes it. */
void front_hang_up(struct front *front, struct waiting *w);

/* Answers and begins to close: it may be gone afterwards. Who speaks TLS gets no answer: there is
   no session yet to send one in. */
void front_refuse(struct front *front, struct waiting *w, const struct head_refusal *refusal);
/* Passes over what a refused client still sends; closes at its end. */
void front_drain(struct front *front, struct waiting *w);
/* Closes the oldest of those that are answered, where there are too many. */
void front_make_room_to_linger(struct front *front);
/* Takes in what front_linger was given. */
void front_take_gifts(struct front *front);

#endif
