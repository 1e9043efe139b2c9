/*
 * transforms.c - the cache of harmonic transforms: Legendre tables and FFTW plans, dear to make,
 * immutable and shared by all runs.
 *
 * A transform is made outside the lock by whoever asks for it first; others who want the same one
 * wait for it. At most TRANSFORMS_MAX are kept beyond those in use: the least recently used that
 * nobody holds leaves first. Their memory is charged to no job.
 *
 * Lock: transforms.mutex (rank 22) guards the list and the counts, never held while a transform
 * is made or freed.
 */
#include "jobs/internal.h"

#include <stdlib.h>

#define TRANSFORMS_MAX 16

struct jobs_transform {
    size_t degree, n_theta, n_phi;
    enum srnf_grid_kind kind;
    struct srnf_sht *sht; /* NULL while it is being made */
    int status;           /* of the making */
    size_t holders;       /* those who wait for it included */
    bool making;
    struct jobs_transform *next;
};

void jobs_transforms_init(struct jobs_transforms *transforms)
{
    pthread_mutex_init(&transforms->mutex, NULL);
    pthread_cond_init(&transforms->made, NULL);
}

void jobs_transforms_destroy(struct jobs_transforms *transforms)
{
    while (transforms->first) {
        struct jobs_transform *entry = transforms->first;

        transforms->first = entry->next;
        srnf_sht_destroy(entry->sht);
        free(entry);
    }
    pthread_cond_destroy(&transforms->made);
    pthread_mutex_destroy(&transforms->mutex);
}

/* Finds the entry and moves it to the front. */
static struct jobs_transform *find(struct jobs_transforms *transforms,
                                   const struct jobs_transform *key)
{
    for (struct jobs_transform **link = &transforms->first; *link; link = &(*link)->next) {
        struct jobs_transform *entry = *link;

        if (entry->degree == key->degree && entry->kind == key->kind &&
            entry->n_theta == key->n_theta && entry->n_phi == key->n_phi) {
            *link = entry->next;
            entry->next = transforms->first;
            transforms->first = entry;
            return entry;
        }
    }
    return NULL;
}

/* Cuts the least recently used entry that nobody holds off the list, if there are too many. */
static struct jobs_transform *evict(struct jobs_transforms *transforms)
{
    struct jobs_transform **oldest = NULL, *entry = NULL;

    if (transforms->count > TRANSFORMS_MAX) {
        for (struct jobs_transform **link = &transforms->first; *link; link = &(*link)->next) {
            oldest = (*link)->holders == 0 ? link : oldest;
        }
    }
    if (oldest) {
        entry = *oldest;
        *oldest = entry->next;
        transforms->count--;
    }
    return entry;
}

static void drop(struct jobs_transform *entry)
{
    if (entry) {
        srnf_sht_destroy(entry->sht);
        free(entry);
    }
}

/* Takes an entry that did not come about out of the list; the last of those who waited frees it. */
static void forget(struct jobs_transforms *transforms, struct jobs_transform *entry)
{
    for (struct jobs_transform **link = &transforms->first; *link; link = &(*link)->next) {
        if (*link == entry) {
            *link = entry->next;
            transforms->count--;
            return;
        }
    }
}

static struct jobs_transform *add(struct jobs_transforms *transforms,
                                  const struct jobs_transform *key)
{
    struct jobs_transform *entry = calloc(1, sizeof *entry);

    if (entry) {
        *entry = *key;
        entry->making = true;
        entry->next = transforms->first;
        transforms->first = entry;
        transforms->count++;
    }
    return entry;
}

int jobs_transform_acquire(struct jobs *jobs, size_t degree, enum srnf_grid_kind kind,
                           size_t n_theta, size_t n_phi, const struct srnf_sht **sht)
{
    struct jobs_transforms *transforms = &jobs->transforms;
    struct jobs_transform key = {
        .degree = degree, .kind = kind, .n_theta = n_theta, .n_phi = n_phi};
    struct jobs_transform *entry, *old = NULL;
    struct srnf_sht *made = NULL;
    struct jobs_memory *asker;
    int status = SRNF_OK;
    bool last = false;

    /* 0 means the working grid: one entry for both ways of asking. */
    if (kind == SRNF_GRID_GAUSS_LEGENDRE && n_theta == 0) {
        key.n_theta = srnf_working_rows(degree);
    }
    if (key.n_theta > 0 && n_phi == 0) {
        key.n_phi = 2 * key.n_theta;
    }
    *sht = NULL;
    pthread_mutex_lock(&transforms->mutex);
    entry = find(transforms, &key);
    if (!entry && (entry = add(transforms, &key)) != NULL) {
        entry->holders = 1;
        pthread_mutex_unlock(&transforms->mutex);
        asker = jobs_memory_enter(NULL);
        status = srnf_sht_create(&made, key.degree, key.kind, key.n_theta, key.n_phi);
        (void)jobs_memory_enter(asker);
        pthread_mutex_lock(&transforms->mutex);
        entry->sht = made;
        entry->status = status;
        entry->making = false;
        if (status < 0) {
            forget(transforms, entry);
        }
        pthread_cond_broadcast(&transforms->made);
    } else if (entry) {
        entry->holders++;
        while (entry->making) {
            pthread_cond_wait(&transforms->made, &transforms->mutex);
        }
    }
    status = entry ? entry->status : SRNF_ENOMEM;
    if (entry && status < 0) {
        last = --entry->holders == 0;
    } else if (entry) {
        *sht = entry->sht;
        old = evict(transforms);
    }
    pthread_mutex_unlock(&transforms->mutex);
    drop(last ? entry : old);
    return status;
}

void jobs_transform_release(struct jobs *jobs, const struct srnf_sht *sht)
{
    struct jobs_transforms *transforms = &jobs->transforms;
    struct jobs_transform *old;

    if (!sht) {
        return;
    }
    pthread_mutex_lock(&transforms->mutex);
    for (struct jobs_transform *entry = transforms->first; entry; entry = entry->next) {
        if (entry->sht == sht) {
            entry->holders--;
            break;
        }
    }
    old = evict(transforms);
    pthread_mutex_unlock(&transforms->mutex);
    drop(old);
}
