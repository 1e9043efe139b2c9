/*
 * doubts.c - what a run has found doubtful about the meshes that it encoded, for whoever writes its
 * results.
 *
 * Meshes are encoded wherever a surface is wanted, in many processes and often several at a time;
 * a doubt is noted where it is found and told at the end. Protected by run->mutex; what is read
 * after the computation is sorted by mesh, so that results do not depend on which thread came
 * first.
 */
#include "jobs/internal.h"

#include <stdlib.h>
#include <string.h>

/* By mesh, then by degree: the same mesh may be wanted at several; then by what it stood in for. */
static int compare(const void *a, const void *b)
{
    const struct jobs_doubt *x = a, *y = b;
    int order = strcmp(x->mesh, y->mesh);

    if (order == 0 && x->degree != y->degree) {
        order = x->degree < y->degree ? -1 : 1;
    }
    return order ? order : strcmp(x->surface, y->surface);
}

bool jobs_run_doubt(struct jobs_run *run, const struct jobs_doubt *doubt)
{
    struct jobs_doubts *doubts = &run->doubts;
    bool kept = true;

    pthread_mutex_lock(&run->mutex);
    for (size_t i = 0; i < doubts->count; i++) {
        if (compare(&doubts->list[i], doubt) == 0) {
            goto out;
        }
    }
    if (doubts->count == doubts->capacity) {
        size_t capacity = 2 * doubts->capacity + 8;
        struct jobs_doubt *list = realloc(doubts->list, capacity * sizeof *list);

        kept = list != NULL;
        if (!kept) {
            goto out;
        }
        doubts->list = list;
        doubts->capacity = capacity;
    }
    doubts->list[doubts->count++] = *doubt;
out:
    pthread_mutex_unlock(&run->mutex);
    return kept;
}

size_t jobs_run_doubts(struct jobs_run *run, const struct jobs_doubt **list)
{
    struct jobs_doubts *doubts = &run->doubts;

    pthread_mutex_lock(&run->mutex);
    if (doubts->count > 1) {
        qsort(doubts->list, doubts->count, sizeof *doubts->list, compare);
    }
    pthread_mutex_unlock(&run->mutex);
    *list = doubts->list;
    return doubts->count;
}
