/*
 * jobs.c - the engine's life: opening recovers the queue and starts the workers, closing drains
 * them.
 *
 * The queue is the table of jobs in the store, and nothing else; memory only knows how many rows
 * wait (tickets) and who runs what (slots). Hence kill -9 at any moment costs at most the work of
 * the running attempts.
 */
#include "jobs/internal.h"

#include "clock.h"
#include "store/job.h"
#include "store/page.h"

#include <cblas.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define CACHE_PART 8 /* of a job's memory */
#define CACHE_MOST ((size_t)128 << 20)

/* Ids go on where the last run of the daemon stopped, even if the clock has gone back since. */
static bool note_newest(void *user, const struct store_job *job)
{
    struct jobs_ids *ids = user;

    ids->last_ms = job->created_ms > 0 ? (uint64_t)job->created_ms : 0;
    ids->counter = 0xfff;
    return false;
}

static int recover(struct jobs *jobs)
{
    const struct store_page newest = {.limit = 1};
    struct store *store = jobs->config.store;
    size_t requeued = 0, failed = 0;
    char detail[120];
    int status = store_job_recover(store, JOBS_DEATHS_MAX, jobs->config.faulty, &requeued, &failed);

    if (status == STORE_OK) {
        fault_clear();
        status = store_job_list(store, &newest, note_newest, &jobs->ids);
    }
    if (status == STORE_OK) {
        status = store_job_count(store, STORE_JOB_ACCEPTED, &jobs->accepted);
    }
    if (status == STORE_OK) {
        status = store_job_count_alone(store, &jobs->alone.waiting);
    }
    if (status == STORE_OK) {
        atomic_store(&jobs->tickets, jobs->accepted - jobs->alone.waiting);
        jobs->express_issued = jobs->accepted > 0;
        jobs->alone.from = clock_now() + jobs->config.calm_seconds;
        snprintf(detail, sizeof detail,
                 "%zu queued, of these %zu again and %zu to run alone, %zu given up",
                 jobs->accepted, requeued, jobs->alone.waiting, failed);
        jobs_log(jobs, "jobs-recovered", NULL, detail);
    }
    return status;
}

/* One thread more of those that `started` and `alive` count. */
static int start_thread(struct jobs *jobs, pthread_t *thread, void *(*entry)(void *), size_t number,
                        size_t *started, size_t *alive)
{
    struct jobs_worker *worker = malloc(sizeof *worker);

    if (!worker) {
        return STORE_NOMEM;
    }
    *worker = (struct jobs_worker){.jobs = jobs, .number = number};
    if (pthread_create(thread, NULL, entry, worker) != 0) {
        free(worker);
        return STORE_NOMEM;
    }
    (*started)++;
    pthread_mutex_lock(&jobs->mutex);
    (*alive)++;
    pthread_mutex_unlock(&jobs->mutex);
    return STORE_OK;
}

static int start_workers(struct jobs *jobs)
{
    int status = STORE_OK;

    while (status == STORE_OK && jobs->n_started < jobs->n_workers) {
        status = start_thread(jobs, &jobs->threads[jobs->n_started], jobs_worker_main,
                              jobs->n_started, &jobs->n_started, &jobs->alive);
    }
    while (status == STORE_OK && jobs->express_started < JOBS_EXPRESS_THREADS) {
        status = start_thread(jobs, &jobs->express[jobs->express_started], jobs_express_main,
                              jobs->n_workers + jobs->express_started, &jobs->express_started,
                              &jobs->express_alive);
    }
    return status;
}

static size_t count_workers(size_t asked)
{
    long online = sysconf(_SC_NPROCESSORS_ONLN);

    return asked > 0 ? asked : online > 0 ? (size_t)online : 1;
}

static size_t cache_of(const struct jobs_config *config)
{
    size_t part = config->job_memory / CACHE_PART;

    return config->job_cache ? config->job_cache : part < CACHE_MOST ? part : CACHE_MOST;
}

int jobs_open(struct jobs **out, const struct jobs_config *config)
{
    struct jobs *jobs = calloc(1, sizeof *jobs);
    int status;

    *out = NULL;
    if (!jobs) {
        return STORE_NOMEM;
    }
    jobs->config = *config;
    jobs->config.calm_seconds =
        config->calm_seconds > 0.0 ? config->calm_seconds : JOBS_CALM_DEFAULT;
    jobs->config.max_queued = config->max_queued ? config->max_queued : JOBS_QUEUE_DEFAULT;
    jobs->config.lease_seconds =
        config->lease_seconds > 0.0 ? config->lease_seconds : JOBS_LEASE_SECONDS;
    jobs->config.task_seconds =
        config->task_seconds > 0.0 ? config->task_seconds : JOBS_TASK_SECONDS;
    jobs->n_workers = count_workers(config->workers);
    jobs->n_slots = jobs->n_workers + JOBS_EXPRESS_THREADS;
    jobs->lane = JOBS_NO_LANE;
    jobs->config.job_memory =
        config->job_memory ? config->job_memory : jobs_memory_share(jobs->n_slots);
    jobs->config.job_cache = cache_of(&jobs->config);
    pthread_mutex_init(&jobs->mutex, NULL);
    pthread_cond_init(&jobs->wake, NULL);
    pthread_cond_init(&jobs->ended, NULL);
    pthread_cond_init(&jobs->express_wake, NULL);
    pthread_mutex_init(&jobs->ids.mutex, NULL);
    jobs_transforms_init(&jobs->transforms);
    jobs_figures_init(&jobs->figures);
    jobs_rounds_init(&jobs->rounds);
    jobs_remotes_init(&jobs->remotes);
    jobs->remotes.lease_seconds = jobs->config.lease_seconds;
    jobs_passes_init(&jobs->passes);
    openblas_set_num_threads(1);

    jobs->threads = calloc(jobs->n_workers, sizeof *jobs->threads);
    jobs->slots = calloc(jobs->n_slots, sizeof *jobs->slots);
    jobs->memories = calloc(jobs->n_slots, sizeof *jobs->memories);
    status = jobs->threads && jobs->slots && jobs->memories ? recover(jobs) : STORE_NOMEM;
    if (status == STORE_OK) {
        status = start_workers(jobs);
    }
    if (status == STORE_OK) {
        status = jobs_retention_start(jobs);
    }
    if (status != STORE_OK) {
        jobs_close(jobs, 0.0);
        return status;
    }
    *out = jobs;
    return JOBS_OK;
}

/* Waits for the running jobs to end, at most so long. */
static void wait_for_runs(struct jobs *jobs, double seconds)
{
    struct timespec until = clock_timespec(clock_now() + seconds);

    pthread_mutex_lock(&jobs->mutex);
    while (jobs->running > 0 &&
           pthread_cond_clockwait(&jobs->ended, &jobs->mutex, CLOCK_MONOTONIC, &until) == 0) {
    }
    pthread_mutex_unlock(&jobs->mutex);
}

void jobs_drain(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->mutex);
    atomic_store(&jobs->draining, true);
    pthread_mutex_unlock(&jobs->mutex);
}

void jobs_close(struct jobs *jobs, double grace_seconds)
{
    if (!jobs) {
        return;
    }
    jobs_retention_stop(jobs);
    jobs_drain(jobs);
    pthread_mutex_lock(&jobs->mutex);
    atomic_store(&jobs->closing, true);
    pthread_cond_broadcast(&jobs->wake);
    pthread_cond_broadcast(&jobs->express_wake);
    pthread_mutex_unlock(&jobs->mutex);
    wait_for_runs(jobs, grace_seconds > 0.0 ? grace_seconds : 0.0);
    atomic_store(&jobs->abandoned, true);
    for (size_t i = 0; i < jobs->n_started; i++) {
        pthread_join(jobs->threads[i], NULL);
    }
    for (size_t i = 0; i < jobs->express_started; i++) {
        pthread_join(jobs->express[i], NULL);
    }
    jobs_transforms_destroy(&jobs->transforms);
    jobs_figures_destroy(&jobs->figures);
    jobs_remotes_destroy(&jobs->remotes);
    jobs_passes_destroy(&jobs->passes);
    jobs_rounds_destroy(&jobs->rounds);
    pthread_mutex_destroy(&jobs->ids.mutex);
    pthread_cond_destroy(&jobs->express_wake);
    pthread_cond_destroy(&jobs->ended);
    pthread_cond_destroy(&jobs->wake);
    pthread_mutex_destroy(&jobs->mutex);
    free(jobs->threads);
    free(jobs->slots);
    free(jobs->memories);
    free(jobs);
}
