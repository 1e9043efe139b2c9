/*
 * demands.c - what the open rounds have to do, for whoever brings workers, and what that says of
 * them.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include <stdio.h>
#include <string.h>

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
            .seconds = round->measured > 0 ? round->seconds / (double)round->measured : 0.0};
        (void)snprintf(demand->job, sizeof demand->job, "%s", round->job);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
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
