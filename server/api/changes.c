/*
 * changes.c - the jobs that have changed lately (changes.h).
 *
 * A list of at most PLACES jobs, the one that changed last at its end. A job that changes again
 * moves there, so a job that reports progress often takes one place, and what one reads after any
 * point is each job once, with its newest change. The job that changed first gives its place up;
 * who has not read so far is told that changes were lost, and reads the list of jobs.
 *
 * Nothing of it is written down. Points in time are numbers of this run of the daemon, which count
 * the changes of all owners. So that nobody counts others' by them, or sees that there were any,
 * their texts are libsodium's secret boxes: by a key drawn at the start, and each with a nonce of
 * its own, so that no two texts are the same, be they of one point in time.
 *
 * Lock: one mutex around all; rank: innermost.
 */
#include "api/changes.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sodium.h>

#include "owner.h"

#define PLACES 1024
#define BOX_SIZE (crypto_secretbox_NONCEBYTES + crypto_secretbox_MACBYTES + sizeof(uint64_t))

_Static_assert(CHANGES_ID_SIZE == 2 * BOX_SIZE + 1, "a text is a box in hexadecimal digits");

struct place {
    struct place *before, *after;
    uint64_t at, status_at; /* of the last change, and of the last one of its row */
    char id[STORE_ID_MAX], owner[STORE_OWNER_MAX];
    bool owned; /* owner is known */
};

struct changes {
    pthread_mutex_t mutex;
    unsigned char key[crypto_secretbox_KEYBYTES];
    uint64_t now, forgotten; /* the newest change, and the newest of those that are not there */
    struct place *first, *last;
    size_t n;
    struct place places[PLACES];
};

struct changes *changes_create(void)
{
    struct changes *changes = calloc(1, sizeof *changes);

    if (changes && pthread_mutex_init(&changes->mutex, NULL) != 0) {
        free(changes);
        changes = NULL;
    }
    if (changes) {
        crypto_secretbox_keygen(changes->key);
    }
    return changes;
}

void changes_destroy(struct changes *changes)
{
    if (changes) {
        (void)pthread_mutex_destroy(&changes->mutex);
        free(changes);
    }
}

/* Those that change often are near the end. The mutex is held, as in the next three. */
static struct place *find(const struct changes *changes, const char *job_id)
{
    struct place *place = changes->last;

    while (place && strcmp(place->id, job_id) != 0) {
        place = place->before;
    }
    return place;
}

static void cut(struct changes *changes, struct place *place)
{
    *(place->before ? &place->before->after : &changes->first) = place->after;
    *(place->after ? &place->after->before : &changes->last) = place->before;
}

static void append(struct changes *changes, struct place *place)
{
    place->before = changes->last;
    place->after = NULL;
    *(changes->last ? &changes->last->after : &changes->first) = place;
    changes->last = place;
}

/* A place for a job that has none, which the one that changed first may have to give up. */
static struct place *make(struct changes *changes, const char *job_id)
{
    struct place *place;

    if (changes->n < PLACES) {
        place = &changes->places[changes->n++];
    } else {
        place = changes->first;
        changes->forgotten = place->at;
        cut(changes, place);
    }
    memset(place, 0, sizeof *place);
    (void)snprintf(place->id, sizeof place->id, "%s", job_id);
    return place;
}

static void set_owner(struct place *place, const char *owner)
{
    (void)snprintf(place->owner, sizeof place->owner, "%s", owner);
    place->owned = true;
}

void changes_note(struct changes *changes, const char *job_id, const char *owner, bool of_status)
{
    struct place *place;

    (void)pthread_mutex_lock(&changes->mutex);
    place = find(changes, job_id);
    if (place) {
        cut(changes, place);
    } else {
        place = make(changes, job_id);
    }
    append(changes, place);
    place->at = ++changes->now;
    place->status_at = of_status ? place->at : place->status_at;
    if (owner) {
        set_owner(place, owner);
    }
    (void)pthread_mutex_unlock(&changes->mutex);
}

void changes_set_owner(struct changes *changes, const char *job_id, const char *owner)
{
    struct place *place;

    (void)pthread_mutex_lock(&changes->mutex);
    place = find(changes, job_id);
    if (place) {
        set_owner(place, owner);
    }
    (void)pthread_mutex_unlock(&changes->mutex);
}

bool changes_is_of(struct changes *changes, const char *job_id, const char *owner)
{
    const struct place *place;
    bool is;

    (void)pthread_mutex_lock(&changes->mutex);
    place = find(changes, job_id);
    is = place && place->owned && strcmp(place->owner, owner) == 0;
    (void)pthread_mutex_unlock(&changes->mutex);
    return is;
}

uint64_t changes_now(struct changes *changes)
{
    uint64_t now;

    (void)pthread_mutex_lock(&changes->mutex);
    now = changes->now;
    (void)pthread_mutex_unlock(&changes->mutex);
    return now;
}

void changes_text(const struct changes *changes, uint64_t at, char text[CHANGES_ID_SIZE])
{
    unsigned char box[BOX_SIZE], number[sizeof at];

    memcpy(number, &at, sizeof number);
    randombytes_buf(box, crypto_secretbox_NONCEBYTES);
    (void)crypto_secretbox_easy(box + crypto_secretbox_NONCEBYTES, number, sizeof number, box,
                                changes->key);
    (void)sodium_bin2hex(text, CHANGES_ID_SIZE, box, sizeof box);
}

bool changes_parse(struct changes *changes, const char *text, uint64_t *at)
{
    unsigned char box[BOX_SIZE], number[sizeof *at];
    size_t length;

    *at = 0;
    if (sodium_hex2bin(box, sizeof box, text, strlen(text), NULL, &length, NULL) != 0 ||
        length != sizeof box ||
        crypto_secretbox_open_easy(number, box + crypto_secretbox_NONCEBYTES,
                                   sizeof box - crypto_secretbox_NONCEBYTES, box,
                                   changes->key) != 0) {
        return false;
    }
    memcpy(at, number, sizeof number);
    return *at <= changes_now(changes);
}

size_t changes_since(struct changes *changes, const char *owner, uint64_t *seen,
                     struct change *list, size_t most, bool *lost)
{
    const struct place *place;
    uint64_t from = *seen;
    size_t n = 0;

    (void)pthread_mutex_lock(&changes->mutex);
    *lost = from < changes->forgotten;
    place = changes->last;
    while (place && place->before && place->before->at > from) {
        place = place->before;
    }
    for (; place && n < most; place = place->after) {
        if (place->at > from && (!owner || !place->owned || strcmp(place->owner, owner) == 0)) {
            memcpy(list[n].id, place->id, sizeof list[n].id);
            list[n].at = place->at;
            list[n++].of_status = place->status_at > from;
        }
    }
    *seen = n == most && n > 0 ? list[n - 1].at : changes->now;
    (void)pthread_mutex_unlock(&changes->mutex);
    return n;
}
