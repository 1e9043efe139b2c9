/*
 * tickets.c - one-use tickets (tickets.h). They live in memory alone, as digests, and are forgotten
 * when the daemon ends: a client then asks for another.
 *
 * A new ticket takes the place of the oldest of its token where that has EACH, otherwise that of
 * the one that ends first: no token takes more than EACH places, and memory is fixed.
 *
 * Lock: one mutex around the table; rank: innermost.
 */
#include "api/tickets.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include <sodium.h>

#include "clock.h"
#include "store/digest.h"

#define PLACES 1024
#define EACH 8

struct ticket {
    double ends; /* monotonic; 0: free */
    char digest[65], token[STORE_TOKEN_ID_MAX];
};

struct tickets {
    pthread_mutex_t mutex;
    struct ticket places[PLACES];
};

struct tickets *tickets_create(void)
{
    struct tickets *tickets = calloc(1, sizeof *tickets);

    if (tickets && pthread_mutex_init(&tickets->mutex, NULL) != 0) {
        free(tickets);
        tickets = NULL;
    }
    return tickets;
}

void tickets_destroy(struct tickets *tickets)
{
    if (tickets) {
        (void)pthread_mutex_destroy(&tickets->mutex);
        free(tickets);
    }
}

/* Where the next ticket of a token goes. The mutex is held. */
static struct ticket *choose(struct tickets *tickets, const char *token)
{
    struct ticket *first = &tickets->places[0], *own = NULL;
    size_t n_own = 0;

    for (size_t i = 0; i < PLACES; i++) {
        struct ticket *one = &tickets->places[i];

        first = one->ends < first->ends ? one : first;
        if (one->ends > 0 && strcmp(one->token, token) == 0) {
            own = !own || one->ends < own->ends ? one : own;
            n_own++;
        }
    }
    return n_own >= EACH ? own : first;
}

void tickets_issue(struct tickets *tickets, const char *token, char ticket[TICKET_SIZE])
{
    unsigned char bytes[(TICKET_SIZE - 1) / 2];
    char digest[65];
    struct ticket *place;

    randombytes_buf(bytes, sizeof bytes);
    (void)sodium_bin2hex(ticket, TICKET_SIZE, bytes, sizeof bytes);
    store_sha256_hex(digest, ticket, TICKET_SIZE - 1);
    (void)pthread_mutex_lock(&tickets->mutex);
    place = choose(tickets, token);
    place->ends = clock_now() + TICKET_SECONDS;
    memcpy(place->digest, digest, sizeof digest);
    memcpy(place->token, token, strlen(token) + 1);
    (void)pthread_mutex_unlock(&tickets->mutex);
}

static bool find(struct tickets *tickets, const char *ticket, bool take,
                 char token[STORE_TOKEN_ID_MAX])
{
    bool found = false;
    char digest[65];

    store_sha256_hex(digest, ticket, strlen(ticket));
    (void)pthread_mutex_lock(&tickets->mutex);
    for (size_t i = 0; i < PLACES && !found; i++) {
        struct ticket *one = &tickets->places[i];

        if (one->ends > 0 && memcmp(one->digest, digest, sizeof digest) == 0) {
            found = one->ends > clock_now();
            memcpy(token, one->token, sizeof one->token);
            one->ends = take ? 0 : one->ends;
            break;
        }
    }
    (void)pthread_mutex_unlock(&tickets->mutex);
    return found;
}

bool tickets_redeem(struct tickets *tickets, const char *ticket, char token[STORE_TOKEN_ID_MAX])
{
    return find(tickets, ticket, true, token);
}

bool tickets_look_at(struct tickets *tickets, const char *ticket, char token[STORE_TOKEN_ID_MAX])
{
    return find(tickets, ticket, false, token);
}
