/*
 * bars.c - who gets no tasks since a result was false, and how many tasks one token may hold.
 *
 * A name costs a worker nothing, so a bar holds for what is behind it: every worker on that host
 * with that token, the pilots of all jobs being one token, the service's own. A host is what a
 * worker says, too: a token that has been false on BARS_OF_TOKEN hosts is barred on every host; of
 * the service's own only hosts are. A bar ends after JOBS_BAR_SECONDS, when an administrator lifts
 * it, or with the daemon. Of more than JOBS_BARS_MAX bars the oldest ends.
 *
 * A token's leases are as many as its results have earned: CREDIT_FIRST, two more for each result
 * that was taken, and fewer for each lease that was lost; one given back costs nothing. So a token
 * that holds tasks and brings nothing holds few, and workers that compute double their number with
 * each task. Whoever needs no token, and the pilots, which are the service's own, are held to their
 * slots alone.
 *
 * All of it is guarded by remotes.mutex, which callers hold.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "clock.h"
#include "store/store.h"

#include <stdio.h>
#include <string.h>

#define BARS_OF_TOKEN 3
#define CREDIT_FIRST 32
#define CREDIT_MAX 4096
#define CREDIT_OF_RESULT 2
#define CREDIT_OF_LOSS 16

/* ---- Bars ------------------------------------------------------------------------------------ */

/* Whether both came with the same token. */
static bool same_token(const struct jobs_bar *bar, const struct jobs_remote *remote)
{
    return bar->pilots == (remote->job[0] != '\0') &&
           (bar->pilots || strcmp(bar->token, remote->owner) == 0);
}

/* Lets go of bars that have ended. */
static void forget_bars(struct jobs_remotes *remotes)
{
    double now = clock_now();
    size_t left = 0;

    for (size_t i = 0; i < remotes->n_bars; i++) {
        if (remotes->bars[i].until > now) {
            remotes->bars[left++] = remotes->bars[i];
        }
    }
    remotes->n_bars = left;
}

const struct jobs_bar *jobs_bars_find(struct jobs_remotes *remotes,
                                      const struct jobs_remote *remote)
{
    double now = clock_now();

    for (size_t i = 0; i < remotes->n_bars; i++) {
        const struct jobs_bar *bar = &remotes->bars[i];

        if (bar->until > now && same_token(bar, remote) &&
            (!bar->host[0] || strcmp(bar->host, remote->host) == 0)) {
            return bar;
        }
    }
    return NULL;
}

void jobs_bars_add(struct jobs_remotes *remotes, const struct jobs_remote *remote, const char *why)
{
    struct jobs_bar bar = {.number = ++remotes->last_bar, .pilots = remote->job[0] != '\0'};
    size_t hosts = 1;

    forget_bars(remotes);
    for (size_t i = 0; i < remotes->n_bars; i++) {
        hosts += same_token(&remotes->bars[i], remote) &&
                 strcmp(remotes->bars[i].host, remote->host) != 0;
    }
    (void)snprintf(bar.worker, sizeof bar.worker, "%s", remote->name);
    (void)snprintf(bar.token, sizeof bar.token, "%s", remote->owner);
    (void)snprintf(bar.why, sizeof bar.why, "%s", why);
    if (hosts < BARS_OF_TOKEN || bar.pilots) {
        (void)snprintf(bar.host, sizeof bar.host, "%s", remote->host);
    }
    bar.since_ms = store_now_ms();
    bar.until = clock_now() + JOBS_BAR_SECONDS;
    if (remotes->n_bars == JOBS_BARS_MAX) {
        memmove(remotes->bars, remotes->bars + 1, (JOBS_BARS_MAX - 1) * sizeof *remotes->bars);
        remotes->n_bars--;
    }
    remotes->bars[remotes->n_bars++] = bar;
}

size_t jobs_bars(struct jobs *jobs, struct jobs_bar bars[JOBS_BARS_MAX])
{
    struct jobs_remotes *remotes = &jobs->remotes;
    size_t n;

    pthread_mutex_lock(&remotes->mutex);
    forget_bars(remotes);
    n = remotes->n_bars;
    memcpy(bars, remotes->bars, n * sizeof *bars);
    pthread_mutex_unlock(&remotes->mutex);
    return n;
}

bool jobs_bars_lift(struct jobs *jobs, int64_t number)
{
    struct jobs_remotes *remotes = &jobs->remotes;
    bool lifted = false;

    pthread_mutex_lock(&remotes->mutex);
    forget_bars(remotes);
    for (size_t i = 0; i < remotes->n_bars; i++) {
        if (remotes->bars[i].number == number) {
            remotes->bars[i].until = 0.0;
            lifted = true;
        }
    }
    forget_bars(remotes);
    pthread_mutex_unlock(&remotes->mutex);
    if (lifted) {
        jobs_rounds_offer(jobs);
    }
    return lifted;
}

/* ---- Credit ---------------------------------------------------------------------------------- */

/* That of the token; one without takes the place of the one that was idle for longest. */
static struct jobs_credit *credit_of(struct jobs_remotes *remotes, const char *token)
{
    struct jobs_credit *credit = &remotes->credits[0];

    for (size_t i = 0; i < JOBS_CREDITS_MAX; i++) {
        if (strcmp(remotes->credits[i].token, token) == 0) {
            credit = &remotes->credits[i];
            break;
        }
        if (remotes->credits[i].last < credit->last) {
            credit = &remotes->credits[i];
        }
    }
    if (strcmp(credit->token, token) != 0) {
        *credit = (struct jobs_credit){.earned = 0};
        (void)snprintf(credit->token, sizeof credit->token, "%s", token);
    }
    credit->last = clock_now();
    return credit;
}

static bool is_capped(const struct jobs_remote *remote)
{
    return remote->owner[0] && !remote->job[0];
}

void jobs_credit_note(struct jobs_remotes *remotes, const struct jobs_remote *remote, bool result)
{
    struct jobs_credit *credit;

    if (!is_capped(remote)) {
        return;
    }
    credit = credit_of(remotes, remote->owner);
    if (result) {
        credit->earned += credit->earned < CREDIT_MAX ? CREDIT_OF_RESULT : 0;
    } else {
        credit->earned -= credit->earned < CREDIT_OF_LOSS ? credit->earned : CREDIT_OF_LOSS;
    }
}

bool jobs_credit_allows(struct jobs_remotes *remotes, const struct jobs_remote *remote)
{
    size_t leased = 0;

    if (!is_capped(remote)) {
        return true;
    }
    for (size_t i = 0; i < remotes->count; i++) {
        const struct jobs_remote_state *state = &remotes->list[i];

        if (is_capped(&state->remote) && strcmp(state->remote.owner, remote->owner) == 0) {
            leased += jobs_remote_leased(state);
        }
    }
    if (leased < CREDIT_FIRST + credit_of(remotes, remote->owner)->earned) {
        return true;
    }
    remotes->withheld = true;
    return false;
}
