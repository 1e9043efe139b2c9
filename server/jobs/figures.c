/*
 * figures.c - numbers that jobs computed lately, by a digest of what they follow from. Analyses of
 * one cohort ask the same of the same members; whoever asks again gets the bits of the first.
 *
 * A table of fixed size: the oldest leaves. Its memory is charged to no job.
 *
 * Lock: figures.mutex (rank 29) guards the table.
 */
#include "jobs/internal.h"

#include <string.h>

void jobs_figures_init(struct jobs_figures *figures)
{
    pthread_mutex_init(&figures->mutex, NULL);
}

void jobs_figures_destroy(struct jobs_figures *figures)
{
    pthread_mutex_destroy(&figures->mutex);
}

/* With the lock. NULL: not there. */
static struct jobs_figure *find(struct jobs_figures *figures, const char digest[65])
{
    for (size_t i = 0; i < JOBS_FIGURES_KEPT; i++) {
        if (memcmp(figures->kept[i].digest, digest, sizeof figures->kept[i].digest) == 0) {
            return &figures->kept[i];
        }
    }
    return NULL;
}

bool jobs_figures_find(struct jobs *jobs, const char digest[65], double values[JOBS_FIGURES])
{
    struct jobs_figures *figures = &jobs->figures;
    const struct jobs_figure *found;

    pthread_mutex_lock(&figures->mutex);
    found = find(figures, digest);
    if (found) {
        memcpy(values, found->values, sizeof found->values);
    }
    pthread_mutex_unlock(&figures->mutex);
    return found != NULL;
}

void jobs_figures_keep(struct jobs *jobs, const char digest[65], const double values[JOBS_FIGURES])
{
    struct jobs_figures *figures = &jobs->figures;
    struct jobs_figure *place;

    pthread_mutex_lock(&figures->mutex);
    place = find(figures, digest); /* two may have computed it at once */
    if (!place) {
        place = &figures->kept[figures->next];
        figures->next = (figures->next + 1) % JOBS_FIGURES_KEPT;
    }
    memcpy(place->digest, digest, sizeof place->digest);
    memcpy(place->values, values, sizeof place->values);
    pthread_mutex_unlock(&figures->mutex);
}
