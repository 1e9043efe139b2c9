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
#include "store/digest.h"
#include "store/store.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOSSES_MAX 3  /* leases in a row without a result, and a worker has to rest */
#define REST_MAX 60.0 /* seconds; the first rest is one second, and each is twice the last */

void jobs_remotes_init(struct jobs_remotes *remotes)
{
    pthread_mutex_init(&remotes->mutex, NULL);
}

void jobs_remotes_destroy(struct jobs_remotes *remotes)
{
    pthread_mutex_destroy(&remotes->mutex);
    free(remotes->list);
}

size_t jobs_remote_leased(const struct jobs_remote_state *state)
{
    size_t leased = 0;

    for (size_t k = 0; k < TASKS_KINDS_MAX; k++) {
        leased += state->of[k].leased;
    }
    return leased;
}

/* Whether nothing is expected of it any more: it has no lease, does not live, and was silent for
   long. A lease may hold for longer than that. */
static bool is_gone(const struct jobs_remote_state *state, double now)
{
    return jobs_remote_leased(state) == 0 && now >= state->until &&
           now - state->last >= JOBS_REMOTE_SECONDS;
}

/* Lets go of those that are gone. The mutex is held. */
static void forget(struct jobs_remotes *remotes)
{
    double now = clock_now();
    size_t left = 0;

    for (size_t i = 0; i < remotes->count; i++) {
        if (!is_gone(&remotes->list[i], now)) {
            remotes->list[left++] = remotes->list[i];
        }
    }
    remotes->count = left;
}

static struct jobs_remote_state *find(struct jobs_remotes *remotes, const char *who)
{
    for (size_t i = 0; i < remotes->count; i++) {
        if (strcmp(remotes->list[i].remote.who, who) == 0) {
            return &remotes->list[i];
        }
    }
    return NULL;
}

static bool has_worked(const struct jobs_remote_state *state)
{
    bool worked = false;

    for (size_t k = 0; k < TASKS_KINDS_MAX; k++) {
        worked = worked || state->of[k].done > 0;
    }
    return worked;
}

/* The one to forget where there is no room: without a lease, rather one that has never done
   anything, and of these the one that was silent for longest. NULL: all have leases. */
static struct jobs_remote_state *least_of(struct jobs_remotes *remotes)
{
    struct jobs_remote_state *least = NULL;

    for (size_t i = 0; i < remotes->count; i++) {
        struct jobs_remote_state *state = &remotes->list[i];

        if (jobs_remote_leased(state) > 0) {
            continue;
        }
        if (!least || has_worked(state) < has_worked(least) ||
            (has_worked(state) == has_worked(least) && state->last < least->last)) {
            least = state;
        }
    }
    return least;
}

/* A place for one more, or NULL. The mutex is held. */
static struct jobs_remote_state *add(struct jobs_remotes *remotes)
{
    if (!remotes->list) {
        remotes->list = calloc(JOBS_REMOTES_MAX, sizeof *remotes->list);
    }
    if (!remotes->list) {
        return NULL;
    }
    return remotes->count < JOBS_REMOTES_MAX ? &remotes->list[remotes->count++] : least_of(remotes);
}

static bool may_lease(const struct jobs_remote_state *state, const char *job)
{
    return !state->remote.job[0] || !job[0] || strcmp(state->remote.job, job) == 0;
}

/* As jobs_remotes_other. The mutex is held. */
static bool has_other(struct jobs_remotes *remotes, const char *who, const char *job,
                      bool (*fits)(const void *user, const char *who), const void *user)
{
    double now = clock_now();

    for (size_t i = 0; i < remotes->count; i++) {
        const struct jobs_remote_state *state = &remotes->list[i];

        if (now < state->until && state->losses < LOSSES_MAX && may_lease(state, job) &&
            strcmp(state->remote.who, who) != 0 && !jobs_bars_find(remotes, &state->remote) &&
            (!fits || fits(user, state->remote.who))) {
            return true;
        }
    }
    return false;
}

bool jobs_remotes_other(struct jobs_remotes *remotes, const char *who, const char *job,
                        bool (*fits)(const void *user, const char *who), const void *user)
{
    bool has;

    pthread_mutex_lock(&remotes->mutex);
    has = has_other(remotes, who, job, fits, user);
    pthread_mutex_unlock(&remotes->mutex);
    return has;
}

bool jobs_remotes_sign(struct jobs_remotes *remotes, const struct jobs_remote *remote, bool *fresh)
{
    int64_t now = store_now_ms();
    struct jobs_remote_state *state;
    bool may = false;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, remote->who);
    *fresh = !state;
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
        state->until = state->last + fmax(remote->wait, remotes->lease_seconds) + 1.0;
        may = !jobs_bars_find(remotes, remote) && jobs_remote_leased(state) < remote->slots &&
              jobs_credit_allows(remotes, remote) &&
              (state->last >= state->rest_until ||
               !has_other(remotes, remote->who, remote->job, NULL, NULL));
    }
    pthread_mutex_unlock(&remotes->mutex);
    return may;
}

bool jobs_remotes_bar(struct jobs_remotes *remotes, const char *who, const char *why)
{
    const struct jobs_remote_state *state;
    bool known;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, who);
    known = state != NULL;
    if (known && !jobs_bars_find(remotes, &state->remote)) {
        jobs_bars_add(remotes, &state->remote, why);
    }
    pthread_mutex_unlock(&remotes->mutex);
    return known;
}

bool jobs_remotes_barred(struct jobs_remotes *remotes, const char *who)
{
    const struct jobs_remote_state *state;
    bool barred;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, who);
    barred = state && jobs_bars_find(remotes, &state->remote);
    pthread_mutex_unlock(&remotes->mutex);
    return barred;
}

size_t jobs_remotes_alive(struct jobs_remotes *remotes, const char *job)
{
    double now = clock_now();
    size_t alive = 0;

    pthread_mutex_lock(&remotes->mutex);
    for (size_t i = 0; i < remotes->count; i++) {
        const struct jobs_remote_state *state = &remotes->list[i];

        alive += now < state->until && strcmp(state->remote.job, job) == 0;
    }
    pthread_mutex_unlock(&remotes->mutex);
    return alive;
}

bool jobs_remotes_know(struct jobs_remotes *remotes, const char *who)
{
    bool known;

    pthread_mutex_lock(&remotes->mutex);
    known = find(remotes, who) != NULL;
    pthread_mutex_unlock(&remotes->mutex);
    return known;
}

bool jobs_remotes_withheld(struct jobs_remotes *remotes)
{
    bool withheld;

    pthread_mutex_lock(&remotes->mutex);
    withheld = remotes->withheld;
    remotes->withheld = false;
    pthread_mutex_unlock(&remotes->mutex);
    return withheld;
}

void jobs_remote_gone(struct jobs *jobs, const struct jobs_remote *remote)
{
    struct jobs_remotes *remotes = &jobs->remotes;
    struct jobs_remote_state *state;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, remote->who);
    if (state && jobs_remote_leased(state) == 0) {
        state->until = 0.0;
    }
    pthread_mutex_unlock(&remotes->mutex);
}

void jobs_remote_who(const char *owner, const char *job, const char *name, char who[JOBS_WHO_SIZE])
{
    char text[STORE_OWNER_MAX + STORE_ID_MAX + JOBS_REMOTE_NAME_MAX + 2], digest[65];

    (void)snprintf(text, sizeof text, "%s\n%s\n%s", owner, job, name);
    store_sha256_hex(digest, text, strlen(text));
    (void)snprintf(who, JOBS_WHO_SIZE, "%.32s", digest);
}

static size_t index_of(const char *kind)
{
    size_t i = 0;

    while (tasks_kind_at(i) && strcmp(tasks_kind_at(i)->name, kind) != 0) {
        i++;
    }
    return i;
}

/* A lease has ended, or not, with a result. */
static void count_losses(struct jobs_remote_state *state, enum jobs_remote_event event)
{
    if (event == REMOTE_DONE) {
        state->losses = 0;
        state->rest_until = 0.0;
    } else if (event == REMOTE_LOST || event == REMOTE_BACK) {
        state->losses++;
        if (state->losses >= LOSSES_MAX) {
            state->rest_until =
                clock_now() + fmin(exp2((double)(state->losses - LOSSES_MAX)), REST_MAX);
        }
    }
}

void jobs_remotes_note(struct jobs_remotes *remotes, const char *who, enum jobs_remote_event event,
                       const char *kind)
{
    struct jobs_remote_state *state;

    pthread_mutex_lock(&remotes->mutex);
    state = find(remotes, who);
    if (state) {
        struct jobs_remote_counts *of = &state->of[index_of(kind)];

        if (event != REMOTE_LOST && event != REMOTE_OVER) {
            state->last_ms = store_now_ms();
            state->last = clock_now();
            state->until = state->last + remotes->lease_seconds + 1.0;
        }
        count_losses(state, event);
        if (event == REMOTE_DONE || event == REMOTE_LOST) {
            jobs_credit_note(remotes, &state->remote, event == REMOTE_DONE);
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
    double now = clock_now();
    size_t count;

    pthread_mutex_lock(&remotes->mutex);
    forget(remotes);
    count = remotes->count;
    copy = count > 0 ? malloc(count * sizeof *copy) : NULL;
    for (size_t i = 0; copy && i < count; i++) {
        copy[i] = remotes->list[i];
        copy[i].alive = jobs_remote_leased(&copy[i]) > 0 || now < copy[i].until;
        copy[i].barred = jobs_bars_find(remotes, &copy[i].remote) != NULL;
    }
    pthread_mutex_unlock(&remotes->mutex);
    for (size_t i = 0; copy && i < count && visit(user, &copy[i]); i++) {
    }
    free(copy);
}

void jobs_remotes_count(struct jobs *jobs, size_t *workers, size_t *leased)
{
    struct jobs_remotes *remotes = &jobs->remotes;

    *leased = 0;
    pthread_mutex_lock(&jobs->rounds.mutex);
    for (const struct jobs_open_round *round = jobs->rounds.first; round; round = round->link) {
        *leased += round->leased;
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    pthread_mutex_lock(&remotes->mutex);
    forget(remotes);
    *workers = remotes->count;
    pthread_mutex_unlock(&remotes->mutex);
}
