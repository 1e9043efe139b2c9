/*
 * recent.c - small results that were just read, kept in memory: dashboards ask for the same ones
 * over and over.
 *
 * A slot is good as long as nothing was written: the writer counts its commits here before it wakes
 * those who wait for them, and a slot is marked with the count from before its row was read. So
 * whatever a write changes (a deletion, a retention, a job that ends), nobody who knows of it finds
 * the state before it. There are SLOTS slots, a result's own by its id; the memory is bounded by
 * SLOTS * SIZE_MAX_KEPT.
 *
 * Lock: recent->mutex (rank 42) protects the slots; nothing but malloc and memcpy happens under it.
 */
#include "store/internal.h"
#include "store/job.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define SLOTS 256
#define SIZE_MAX_KEPT ((size_t)8 << 10)

struct slot {
    uint64_t age;
    char id[STORE_ID_MAX];
    char *results; /* NULL: empty */
    size_t size;
};

struct store_recent {
    pthread_mutex_t mutex;
    atomic_uint_least64_t age; /* commits so far */
    struct slot slots[SLOTS];
};

struct store_recent *store_recent_create(void)
{
    struct store_recent *recent = calloc(1, sizeof *recent);

    if (recent) {
        pthread_mutex_init(&recent->mutex, NULL);
    }
    return recent;
}

void store_recent_destroy(struct store_recent *recent)
{
    if (!recent) {
        return;
    }
    for (size_t i = 0; i < SLOTS; i++) {
        free(recent->slots[i].results);
    }
    pthread_mutex_destroy(&recent->mutex);
    free(recent);
}

void store_recent_expire(struct store_recent *recent)
{
    if (recent) {
        atomic_fetch_add(&recent->age, 1);
    }
}

uint64_t store_recent_age(struct store_recent *recent)
{
    return atomic_load(&recent->age);
}

/* By the last bytes, which are random in the ids of jobs. */
static struct slot *slot_of(struct store_recent *recent, const char *id)
{
    size_t length = strlen(id);
    uint64_t end = 0;

    memcpy(&end, length < sizeof end ? id : id + length - sizeof end,
           length < sizeof end ? length : sizeof end);
    return &recent->slots[end * UINT64_C(0x9e3779b97f4a7c15) >> 32 & (SLOTS - 1)];
}

void store_recent_keep(struct store_recent *recent, uint64_t age, const char *id,
                       const char *results, size_t size)
{
    struct slot *slot = slot_of(recent, id);
    char *copy, *old;

    if (size > SIZE_MAX_KEPT || strlen(id) >= sizeof slot->id || age != store_recent_age(recent)) {
        return;
    }
    copy = malloc(size + 1);
    if (!copy) {
        return;
    }
    memcpy(copy, results, size);
    copy[size] = '\0';
    pthread_mutex_lock(&recent->mutex);
    old = slot->results;
    memcpy(slot->id, id, strlen(id) + 1);
    slot->results = copy;
    slot->size = size;
    slot->age = age;
    pthread_mutex_unlock(&recent->mutex);
    free(old);
}

int store_job_results_recent(struct store *store, const char *id, char **results, size_t *size)
{
    struct store_recent *recent = store->recent;
    struct slot *slot = slot_of(recent, id);
    int status = STORE_NOT_FOUND;

    pthread_mutex_lock(&recent->mutex);
    if (slot->results && slot->age == store_recent_age(recent) && strcmp(slot->id, id) == 0) {
        status = STORE_OK;
        if (results) {
            *results = malloc(slot->size + 1);
            *size = slot->size;
            status = *results ? STORE_OK : STORE_NOMEM;
        }
        if (results && *results) {
            memcpy(*results, slot->results, slot->size + 1);
        }
    }
    pthread_mutex_unlock(&recent->mutex);
    return status;
}
