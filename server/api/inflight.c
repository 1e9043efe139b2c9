/*
 * inflight.c - the Idempotency-Keys of requests that are being answered at this moment. A second
 * request with the same key is refused with 409 until the first has its answer; from then on the
 * key is looked up in the store.
 *
 * Lock: one mutex around the list, held for a walk along it; rank: innermost, nothing is called
 * while it is held. The list is as long as there are requests with keys in progress, at most one
 * per connection.
 */
#include "api/respond.h"

#include "api/inflight.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct inflight_key {
    struct inflight_key *next;
    char text[];
};

struct api_inflight {
    pthread_mutex_t mutex; /* protects first */
    struct inflight_key *first;
};

struct api_inflight *inflight_create(void)
{
    struct api_inflight *inflight = calloc(1, sizeof *inflight);

    if (inflight && pthread_mutex_init(&inflight->mutex, NULL) != 0) {
        free(inflight);
        inflight = NULL;
    }
    return inflight;
}

void inflight_destroy(struct api_inflight *inflight)
{
    if (inflight) {
        (void)pthread_mutex_destroy(&inflight->mutex);
        free(inflight);
    }
}

enum inflight_entry inflight_enter(struct api_inflight *inflight, const char *key)
{
    size_t length = strlen(key);
    struct inflight_key *entry = malloc(sizeof *entry + length + 1);
    enum inflight_entry result = INFLIGHT_ENTERED;

    if (!entry) {
        return INFLIGHT_NO_MEMORY;
    }
    memcpy(entry->text, key, length + 1);
    (void)pthread_mutex_lock(&inflight->mutex);
    for (struct inflight_key *other = inflight->first; other; other = other->next) {
        if (strcmp(other->text, key) == 0) {
            result = INFLIGHT_TAKEN;
            break;
        }
    }
    if (result == INFLIGHT_ENTERED) {
        entry->next = inflight->first;
        inflight->first = entry;
        entry = NULL;
    }
    (void)pthread_mutex_unlock(&inflight->mutex);
    free(entry);
    return result;
}

void inflight_leave(struct api_inflight *inflight, const char *key)
{
    struct inflight_key *entry = NULL;

    (void)pthread_mutex_lock(&inflight->mutex);
    for (struct inflight_key **place = &inflight->first; *place; place = &(*place)->next) {
        if (strcmp((*place)->text, key) == 0) {
            entry = *place;
            *place = entry->next;
            break;
        }
    }
    (void)pthread_mutex_unlock(&inflight->mutex);
    free(entry);
}
