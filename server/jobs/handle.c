/*
 * handle.c - what may be asked of the engine at any time, by its own files and by others: its
 * processes, its limits, how it is doing; and whom it tells what happens.
 */
#include "jobs/internal.h"

#include "store/job.h"

#include <string.h>

void jobs_log(struct jobs *jobs, const char *event, const struct store_job *job, const char *detail)
{
    if (jobs->config.log) {
        jobs->config.log(jobs->config.user, event, job ? job->id : "", job ? job->trace : "",
                         detail);
    }
}

void jobs_changed(struct jobs *jobs, const char *job_id)
{
    if (jobs->config.changed) {
        jobs->config.changed(jobs->config.user, job_id);
    }
}

const struct jobs_process *jobs_process_find(const struct jobs *jobs, const char *id)
{
    for (const struct jobs_process *process = jobs->config.table; process->id; process++) {
        if (strcmp(process->id, id) == 0) {
            return process;
        }
    }
    return NULL;
}

size_t jobs_worker_count(const struct jobs *jobs)
{
    return jobs->n_workers;
}

const char *jobs_numeric_build(const struct jobs *jobs)
{
    return jobs->config.numeric_build ? jobs->config.numeric_build : "";
}

size_t jobs_memory_limit(const struct jobs *jobs)
{
    return jobs->config.job_memory;
}

void jobs_health(struct jobs *jobs, struct jobs_health *health)
{
    *health = (struct jobs_health){.workers = jobs->n_workers,
                                   .express = JOBS_EXPRESS_THREADS,
                                   .queue_limit = jobs->config.max_queued,
                                   .closing = atomic_load(&jobs->closing)};
    pthread_mutex_lock(&jobs->mutex);
    health->alive = jobs->alive;
    health->express_alive = jobs->express_alive;
    health->queued = jobs->accepted;
    for (size_t i = 0; i < jobs->n_slots; i++) {
        *(i < jobs->n_workers ? &health->busy : &health->express_busy) += jobs->slots[i] != NULL;
    }
    pthread_mutex_unlock(&jobs->mutex);
}
