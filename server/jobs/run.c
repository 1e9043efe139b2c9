/*
 * run.c - what a process sees of the engine while its job runs: whose job it is, progress, phases,
 * and whether it is to stop.
 *
 * Progress and message live in memory only (run->mutex, rank 21).
 */
#include "jobs/internal.h"

#include "clock.h"
#include "store/job.h"
#include "store/holdings.h"
#include "store/store.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* No seconds are estimated before this much has been done, and for so long. */
#define ESTIMATE_PERCENT 1.0
#define ESTIMATE_SECONDS 0.5
#define RUNNING_MAX 99.9 /* 100 is told of jobs that have ended */

static double on_seconds(void *user)
{
    (void)user;
    return clock_now();
}

/* What is left, at the pace of this run so far; run->mutex is held. A run that goes on from a
   checkpoint is not credited with the work of the attempt before. */
static void estimate(struct jobs_run *run)
{
    double now = on_seconds(run), done = run->progress - run->base;

    if (run->resumed && run->progress > run->base) {
        run->resumed = false;
        run->base = run->progress;
        run->base_seconds = now;
    } else if (done >= ESTIMATE_PERCENT && now - run->base_seconds >= ESTIMATE_SECONDS) {
        run->seconds_left = (now - run->base_seconds) * (100.0 - run->progress) / done;
    }
}

/* Progress from `fraction` of the phase that runs; run->mutex is held. What a computation reports
   may fall where it begins anew or its parts run beside each other; what is told does not. */
static void advance(struct jobs_run *run, double fraction)
{
    double percent = run->from + (run->to - run->from) * fmin(fmax(fraction, 0.0), 1.0);

    if (isfinite(fraction)) {
        run->progress = fmax(run->progress, fmin(percent, RUNNING_MAX));
        run->updated_ms = store_now_ms();
        estimate(run);
    }
}

void jobs_run_phase(struct jobs_run *run, double share)
{
    pthread_mutex_lock(&run->mutex);
    run->from = run->phased ? run->to : 0.0;
    run->to = fmin(run->from + share, 100.0);
    run->phased = true;
    advance(run, 0.0);
    pthread_mutex_unlock(&run->mutex);
}

static void on_progress(void *user, double fraction, const char *message)
{
    struct jobs_run *run = user;

    pthread_mutex_lock(&run->mutex);
    advance(run, fraction);
    if (message) {
        snprintf(run->message, sizeof run->message, "%s", message);
    }
    pthread_mutex_unlock(&run->mutex);
    if (run->jobs->config.progressed) {
        run->jobs->config.progressed(run->jobs->config.user, run->job->id);
    }
}

/* From the first time on that this is true it stays so, as the core asks for (srnf.h). */
static bool on_canceled(void *user)
{
    struct jobs_run *run = user;

    if (isfinite(run->deadline) && on_seconds(user) > run->deadline) {
        atomic_store_explicit(&run->overran, true, memory_order_relaxed);
    }
    if (atomic_load_explicit(&run->overran, memory_order_relaxed) ||
        atomic_load_explicit(&run->cancel, memory_order_relaxed) ||
        atomic_load_explicit(&run->yields, memory_order_relaxed) ||
        atomic_load_explicit(&run->jobs->abandoned, memory_order_relaxed)) {
        atomic_store_explicit(&run->stopping, true, memory_order_relaxed);
        return true;
    }
    return false;
}

void jobs_run_yield(struct jobs_run *run)
{
    atomic_store(&run->yields, true);
}

bool jobs_run_stopping(const struct jobs_run *run)
{
    return atomic_load(&run->stopping);
}

void jobs_run_init(struct jobs_run *run, struct jobs *jobs, struct store_job *job,
                   struct jobs_memory *memory)
{
    *run = (struct jobs_run){.jobs = jobs,
                             .job = job,
                             .memory = memory,
                             .to = 100.0,
                             .updated_ms = job->updated_ms,
                             .seconds_left = -1.0,
                             .base_seconds = on_seconds(NULL)};
    jobs_memory_begin(memory, jobs->config.job_memory);
    run->context = (struct srnf_context){
        .user = run,
        .progress = on_progress,
        .canceled = on_canceled,
        .parallel_for = jobs_parallel_for,
        .seconds = on_seconds,
    };
    run->deadline = jobs->config.job_seconds > 0.0 ? on_seconds(run) + jobs->config.job_seconds
                                                   : (double)INFINITY;
    atomic_init(&run->overran, false);
    atomic_init(&run->yields, false);
    atomic_init(&run->stopping, false);
    atomic_init(&run->cancel, false);
    atomic_init(&run->loop.next, 0);
    atomic_init(&run->loop.open, false);
    pthread_cond_init(&run->loop.left, NULL);
    pthread_mutex_init(&run->mutex, NULL);
    jobs_kept_init(&run->kept);
}

void jobs_run_destroy(struct jobs_run *run)
{
    jobs_kept_destroy(&run->kept);
    jobs_scratch_close(run);
    free(run->doubts.list);
    pthread_mutex_destroy(&run->mutex);
    pthread_cond_destroy(&run->loop.left);
}

struct store *jobs_run_store(struct jobs_run *run)
{
    return run->jobs->config.store;
}

int64_t jobs_run_encodings_limit(const struct jobs_run *run)
{
    return (int64_t)run->jobs->config.kept_encodings;
}

void jobs_run_count_encoding(struct jobs_run *run, bool kept)
{
    metrics_add(run->jobs->config.metrics, METRIC_ENCODINGS, METRIC_LABELS(kept ? "kept" : "made"),
                1);
}

void jobs_run_count_mesh(struct jobs_run *run, bool kept)
{
    metrics_add(run->jobs->config.metrics, METRIC_MESHES, METRIC_LABELS(kept ? "kept" : "made"), 1);
}

const char *jobs_run_job_id(const struct jobs_run *run)
{
    return run->job->id;
}

const void *jobs_run_definition(const struct jobs_run *run)
{
    return run->definition;
}

const char *jobs_run_numeric_build(const struct jobs_run *run)
{
    return run->job->numeric_build ? run->job->numeric_build : "";
}

const char *jobs_run_owner(const struct jobs_run *run)
{
    return run->job->owner;
}

const struct srnf_context *jobs_run_context(struct jobs_run *run)
{
    return &run->context;
}

struct jobs *jobs_run_jobs(struct jobs_run *run)
{
    return run->jobs;
}

void jobs_run_search_by(struct jobs_run *run,
                        int (*search)(void *user, const struct srnf_field_search *search,
                                      struct srnf_error *error))
{
    run->context.search = search;
}

void jobs_run_measure_by(struct jobs_run *run,
                         int (*measure)(void *user, const struct srnf_pair_search *pairs,
                                        struct srnf_error *error))
{
    run->context.measure = measure;
}

void jobs_run_fail(struct jobs_run *run, const struct jobs_result *result)
{
    if (!run->failed.problem_code) {
        run->failed = *result;
        run->failed.results = NULL;
    }
}

void jobs_run_resumed(struct jobs_run *run)
{
    pthread_mutex_lock(&run->mutex);
    run->base = run->progress;
    run->resumed = true;
    pthread_mutex_unlock(&run->mutex);
}

void jobs_run_quota_detail(const struct jobs_run *run, const char *what,
                           char detail[JOBS_DETAIL_MAX])
{
    int64_t bytes = 0, most = 0;

    (void)store_owner_bytes(run->jobs->config.store, run->job->owner, &bytes, &most);
    snprintf(detail, JOBS_DETAIL_MAX,
             "The quota \"bytes\" has no room for %.100s: the owner of the job holds %lld of %lld "
             "bytes. Delete some of that, or ask for a larger quota; then run it again.",
             what, (long long)bytes, (long long)most);
}
