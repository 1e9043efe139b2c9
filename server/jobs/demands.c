/*
 * demands.c - what the open rounds have to do, for whoever brings workers, and what that says of
 * them.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* Whether another restored lease, further down the list, is of the same worker. */
static bool comes_again(const struct jobs_open_round *round, const struct jobs_slot *slot)
{
    for (size_t i = slot->after; i != SIZE_MAX; i = round->slots[i].after) {
        if (round->slots[i].restored && strcmp(round->slots[i].row.worker, slot->row.worker) == 0) {
            return true;
        }
    }
    return false;
}

/* Workers with leases of before a restart that have asked for nothing since, as they are busy: only
   that these leases hold tells of them. The mutex is held. */
static size_t count_restored(struct jobs *jobs, const struct jobs_open_round *round)
{
    size_t n = 0;

    for (size_t i = round->first_leased; i != SIZE_MAX; i = round->slots[i].after) {
        const struct jobs_slot *slot = &round->slots[i];

        n += slot->restored && !comes_again(round, slot) &&
             !jobs_remotes_know(&jobs->remotes, slot->who);
    }
    return n;
}

size_t jobs_demands(struct jobs *jobs, struct jobs_demand *demands, size_t most)
{
    size_t n = 0;

    pthread_mutex_lock(&jobs->rounds.mutex);
    for (const struct jobs_open_round *round = jobs->rounds.first; round && n < most;
         round = round->link) {
        struct jobs_demand *demand = &demands[n++];

        *demand = (struct jobs_demand){
            .left = round->what->n - round->done,
            .done = round->done,
            .alive = count_restored(jobs, round),
            .seconds = round->measured > 0 ? round->seconds / (double)round->measured : 0.0};
        (void)snprintf(demand->job, sizeof demand->job, "%s", round->job);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    for (size_t i = 0; i < n; i++) {
        demands[i].alive += jobs_remotes_alive(&jobs->remotes, demands[i].job);
    }
    return n;
}

void jobs_remark(struct jobs *jobs, const char *job, const char *remark)
{
    char text[JOBS_REMARK_MAX];

    (void)snprintf(text, sizeof text, "%s", remark);
    pthread_mutex_lock(&jobs->rounds.mutex);
    for (struct jobs_open_round *round = jobs->rounds.first; round; round = round->link) {
        if (strcmp(round->job, job) == 0 && strcmp(round->remark, text) != 0) {
            memcpy(round->remark, text, sizeof text);
            round->remarked = true;
            pthread_cond_signal(&round->changed);
        }
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
}

void jobs_rounds_offer(struct jobs *jobs)
{
    if (jobs->config.offered) {
        jobs->config.offered(jobs->config.user);
    }
}
