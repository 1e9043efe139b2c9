/*
 * shares.c - who holds what: connections, requests in progress, bytes in memory, and bytes on the
 * disk of answers that go out, of each address and of each token's name, so that no one caller has
 * all there is.
 *
 * An address is an IPv4 address or the first 64 bits of an IPv6 one, which is what one machine can
 * change at will. Addresses of this machine have no share of the bytes and requests: behind a proxy
 * on the same host everybody comes from there, and the names of the tokens tell them apart.
 *
 * A holder lives as long as a connection refers to it; there are no more of them than two for each
 * connection. Its counts are atomic, since those of requests change without the lock; the table is
 * protected by http->mutex.
 */
#include "http/internal.h"

#include <netinet/in.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>

/* The place of the key in the table: FNV-1a from a start that nobody can guess, so that addresses
   cannot be chosen to lie in one chain. */
static uint64_t hash_of(const struct http *http, const char *key)
{
    uint64_t hash = http->holders_seed;

    for (size_t i = 0; i < HOLDER_KEY_MAX && key[i]; i++) {
        hash = (hash ^ (unsigned char)key[i]) * UINT64_C(1099511628211);
    }
    return hash ^ (hash >> 29);
}

static struct holder **place_of(struct http *http, const char *key)
{
    return &http->holders[hash_of(http, key) % HTTP_HOLDERS];
}

static struct holder *find(struct http *http, const char *key)
{
    struct holder *holder = *place_of(http, key);

    while (holder && strcmp(holder->key, key) != 0) {
        holder = holder->next;
    }
    return holder;
}

/* The one of that key, made where there is none; NULL without memory. The mutex is held. */
static struct holder *get(struct http *http, const char *key, bool local)
{
    struct holder *holder = find(http, key), **place;

    if (!holder) {
        holder = calloc(1, sizeof *holder);
        if (!holder) {
            return NULL;
        }
        memcpy(holder->key, key, strlen(key) + 1);
        holder->local = local;
        holder->id = hash_of(http, key);
        place = place_of(http, key);
        holder->next = *place;
        *place = holder;
    }
    holder->references++;
    return holder;
}

void shares_drop(struct http *http, struct holder *holder)
{
    if (holder && --holder->references == 0) {
        struct holder **place = place_of(http, holder->key);

        while (*place != holder) {
            place = &(*place)->next;
        }
        *place = holder->next;
        free(holder);
    }
}

/* The key of an address, its bytes in hexadecimal; whether it is one of this machine. */
static bool peer_key(const struct sockaddr *address, char key[HOLDER_KEY_MAX])
{
    union {
        const struct sockaddr *any;
        const struct sockaddr_in *v4;
        const struct sockaddr_in6 *v6;
    } peer = {address};
    unsigned char bytes[8] = {0};
    size_t used = 4;
    bool local = false;

    if (address->sa_family == AF_INET) {
        memcpy(bytes, &peer.v4->sin_addr, 4);
        local = bytes[0] == 127;
    } else if (IN6_IS_ADDR_V4MAPPED(&peer.v6->sin6_addr)) {
        memcpy(bytes, peer.v6->sin6_addr.s6_addr + 12, 4);
        local = bytes[0] == 127;
    } else {
        used = 8;
        memcpy(bytes, peer.v6->sin6_addr.s6_addr, 8);
        local = IN6_IS_ADDR_LOOPBACK(&peer.v6->sin6_addr);
    }
    key[0] = local ? 'l' : 'a';
    (void)sodium_bin2hex(key + 1, HOLDER_KEY_MAX - 1, bytes, used);
    return local;
}

struct holder *shares_peer(struct http *http, const struct sockaddr *address)
{
    char key[HOLDER_KEY_MAX];
    bool local = peer_key(address, key);

    return get(http, key, local);
}

size_t shares_connections(struct http *http, const struct sockaddr *address)
{
    char key[HOLDER_KEY_MAX];
    const struct holder *holder;

    (void)peer_key(address, key);
    holder = find(http, key);
    return holder ? holder->connections : 0;
}

bool shares_set_owner(struct connection *connection, const char *name)
{
    struct http *http = connection->http;
    char key[HOLDER_KEY_MAX] = "o";

    if (connection->owner && strcmp(connection->owner->key + 1, name) == 0) {
        return true;
    }
    strncat(key, name, sizeof key - 2);
    (void)pthread_mutex_lock(&http->mutex);
    shares_drop(http, connection->owner);
    connection->owner = get(http, key, false);
    (void)pthread_mutex_unlock(&http->mutex);
    return connection->owner != NULL;
}

bool shares_enter(struct exchange *exchange)
{
    struct connection *connection = exchange->connection;
    struct holder *holder = exchange->request.caller.name[0] ? connection->owner : connection->peer;

    exchange->holder = holder;
    return atomic_fetch_add(&holder->requests, 1) < exchange->http->config.max_owner_requests ||
           holder->local;
}

/* ---- Files of answers ------------------------------------------------------------------------ */

/* One that has nothing else there may always, so that the largest is sent. */
static bool hold_file(void *of, size_t bytes)
{
    struct exchange *exchange = of;
    struct holder *holder = exchange->holder;
    size_t share = exchange->http->config.max_owner_files;
    bool granted;

    if (!holder) {
        return true;
    }
    (void)pthread_mutex_lock(&exchange->http->mutex);
    granted = holder->local || holder->filed == exchange->filed ||
              (bytes <= share && holder->filed <= share - bytes);
    if (granted) {
        holder->filed += bytes;
        exchange->filed += bytes;
    }
    (void)pthread_mutex_unlock(&exchange->http->mutex);
    return granted;
}

static void release_file(void *of, size_t bytes)
{
    struct exchange *exchange = of;

    if (!exchange->holder || bytes == 0) {
        return;
    }
    (void)pthread_mutex_lock(&exchange->http->mutex);
    exchange->holder->filed -= bytes;
    exchange->filed -= bytes;
    (void)pthread_mutex_unlock(&exchange->http->mutex);
}

void shares_offer(struct exchange *exchange)
{
    exchange->request.disk =
        (struct api_share){.hold = hold_file, .release = release_file, .of = exchange};
}

void shares_leave(struct exchange *exchange)
{
    if (exchange->holder) {
        release_file(exchange, exchange->filed);
        atomic_fetch_sub(&exchange->holder->requests, 1);
        exchange->holder = NULL;
    }
}

/* Whether the holder may have so many bytes more. One that has nothing but what this exchange holds
   may always, so that the largest body and result that are allowed at all pass. */
static bool within(const struct holder *holder, const struct exchange *exchange, size_t bytes,
                   size_t share)
{
    size_t others = holder->buffered - exchange->charged;

    return holder->local || others == 0 || (bytes <= share && holder->buffered <= share - bytes);
}

enum hold_result shares_hold(struct exchange *exchange, size_t bytes)
{
    struct http *http = exchange->http;
    struct holder *peer = exchange->connection->peer, *owner = exchange->holder;
    enum hold_result result = HOLD_GRANTED;

    (void)pthread_mutex_lock(&http->mutex);
    if (bytes > http->config.max_buffered || http->buffered > http->config.max_buffered - bytes) {
        result = HOLD_FULL;
    } else if (!within(peer, exchange, bytes, http->config.max_peer_buffered) ||
               (owner && owner != peer &&
                !within(owner, exchange, bytes, http->config.max_owner_buffered))) {
        result = HOLD_SHARE;
    } else {
        http->buffered += bytes;
        peer->buffered += bytes;
        if (owner && owner != peer) {
            owner->buffered += bytes;
        }
        exchange->charged += bytes;
    }
    (void)pthread_mutex_unlock(&http->mutex);
    if (result == HOLD_GRANTED && bytes > 0) {
        metrics_add(http->config.metrics, METRIC_HTTP_BUFFERED, NULL, (double)bytes);
    }
    return result;
}

void shares_release(struct exchange *exchange, size_t bytes)
{
    struct http *http = exchange->http;
    struct holder *owner = exchange->holder;

    if (bytes == 0) {
        return;
    }
    (void)pthread_mutex_lock(&http->mutex);
    http->buffered -= bytes;
    exchange->connection->peer->buffered -= bytes;
    if (owner && owner != exchange->connection->peer) {
        owner->buffered -= bytes;
    }
    exchange->charged -= bytes;
    (void)pthread_mutex_unlock(&http->mutex);
    metrics_add(http->config.metrics, METRIC_HTTP_BUFFERED, NULL, -(double)bytes);
}
