/*
 * remotes.c - the workers that have asked for tasks: who they are, when they last gave a sign, and
 * what became of what they leased. In memory alone: after a restart they are known again with their
 * next request.
 *
 * Lock: remotes.mutex (rank 27, innermost) guards the table.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "clock.h"
#include "store/store.h"

#include <stdlib.h>
#include <string.h>

void jobs_remotes_init(struct jobs_remotes *remotes)
{
    pthread_mutex_init(&remotes->mutex, NULL);
}

void jobs_remotes_destroy(struct jobs_remotes *remotes)
{
    pthread_mutex_destroy(&remotes->mutex);
    free(remotes->list);
}

/* Lets go of those without a sign of late. The mutex is held. */
static void forget(struct jobs_remotes *remotes)
{
    double now = clock_now();
    size_t left = 0;

    for (size_t i = 0; i < remotes->count; i++) {
        const struct jobs_remote_state *state = &remotes->list[i];

        if (now - state->last < JOBS_REMOTE_SECONDS) {
            remotes->list[left++] = *state;
        }
    }
    remotes->count = left;
}

static struct jobs_remote_state *find(struct jobs_remotes *remotes, const char *name)
{
    for (size_t i = 0; i < remotes->count; i++) {
        if (strcmp(remotes->list[i].remote.name, name) == 0) {
            return &remotes->list[i];
        }
    }
    return NULL;
}

/* A place for one more, or NULL. The mutex is held. */
static struct jobs_remote_state *add(struct jobs_remotes *remotes)
{
    if (!remotes->list) {
        remotes->list = calloc(JOBS_REMOTES_MAX, sizeof *remotes->list);
    }
    return remotes->list && remotes->count < JOBS_REMOTES_MAX ? &remotes->list[remotes->count++]
                                                              : NULL;
}

void jobs_remotes_sign(struct jobs_remotes *remotes, const struct jobs_remote *remote)
{
    int64_t now = store_now_ms();
    struct jobs_remote_state *state;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, remote->name);
    if (!state) {
        forget(remotes);
        state = add(remotes);
        if (state) {
            *state = (struct jobs_remote_state){.first_ms = now};
        }
    }
    if (state) {
        state->remote = *remote;
        state->last_ms = now;
        state->last = clock_now();
    }
    pthread_mutex_unlock(&remotes->mutex);
}

static size_t index_of(const char *kind)
{
    size_t i = 0;

    while (tasks_kind_at(i) && strcmp(tasks_kind_at(i)->name, kind) != 0) {
        i++;
    }
    return i;
}

void jobs_remotes_note(struct jobs_remotes *remotes, const char *name, enum jobs_remote_event event,
                       const char *kind)
{
    struct jobs_remote_state *state;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, name);
    if (state) {
        struct jobs_remote_counts *of = &state->of[index_of(kind)];

        if (event != REMOTE_LOST) {
            state->last_ms = store_now_ms();
            state->last = clock_now();
        }
        of->leased += event == REMOTE_LEASED;
        of->leased -= event != REMOTE_LEASED && event != REMOTE_ALIVE && of->leased > 0;
        of->done += event == REMOTE_DONE;
        of->lost += event == REMOTE_LOST;
    }
    pthread_mutex_unlock(&remotes->mutex);
}

void jobs_remotes(struct jobs *jobs,
                  bool (*visit)(void *user, const struct jobs_remote_state *state), void *user)
{
    struct jobs_remotes *remotes = &jobs->remotes;
    struct jobs_remote_state *copy;
    size_t count;

    pthread_mutex_lock(&remotes->mutex);
    forget(remotes);
    count = remotes->count;
    copy = count > 0 ? malloc(count * sizeof *copy) : NULL;
    if (copy) {
        memcpy(copy, remotes->list, count * sizeof *copy);
    }
    pthread_mutex_unlock(&remotes->mutex);
    for (size_t i = 0; copy && i < count && visit(user, &copy[i]); i++) {
    }
    free(copy);
}

void jobs_remotes_count(struct jobs *jobs, size_t *workers, size_t *leased)
{
    struct jobs_remotes *remotes = &jobs->remotes;

    pthread_mutex_lock(&remotes->mutex);
    forget(remotes);
    *workers = remotes->count;
    *leased = 0;
    for (size_t i = 0; i < remotes->count; i++) {
        for (size_t k = 0; k < TASKS_KINDS_MAX; k++) {
            *leased += remotes->list[i].of[k].leased;
        }
    }
    pthread_mutex_unlock(&remotes->mutex);
}
