/*
 * run.c - one job from its claim to its end: what its process sees of the engine, and what
 * becomes of what the process returns.
 *
 *   results                        successful (also when cancellation came too late to be seen)
 *   problem                        failed with that code
 *   either, but told to stop       as neither: loops that are told break off where they are, so
 *                                  what comes of them says nothing
 *   neither, a user asked to stop  dismissed
 *   neither, the daemon stops      accepted again, the attempt not counted
 *   neither, its time was over     failed with time-limit
 *   neither, nobody asked          failed with internal-error: the process breaks its contract
 *
 * Whatever a process returns, a job that was refused memory because of its limit failed with
 * memory-limit: results that depend on how much there was are none.
 *
 * Results for which the owner's quota has no room fail the job with storage-quota-exceeded, those
 * that the store has no room for with storage-full; if even that cannot be
 * written, it is tried again until the daemon stops, and the next start finds the job running and
 * queues it anew.
 *
 * Progress and message live in memory only (run->mutex, rank 21).
 */
#include "jobs/internal.h"
#include "store/job.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* No seconds are estimated before this much has been done, and for so long. */
#define ESTIMATE_PERCENT 1.0
#define ESTIMATE_SECONDS 0.5
#define RUNNING_MAX 99.9 /* 100 is told of jobs that have ended */

double jobs_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double on_seconds(void *user)
{
    (void)user;
    return jobs_now();
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
        atomic_load_explicit(&run->jobs->abandoned, memory_order_relaxed)) {
        atomic_store_explicit(&run->told, true, memory_order_relaxed);
        return true;
    }
    return false;
}

bool jobs_run_told(const struct jobs_run *run)
{
    return atomic_load(&run->told);
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
    atomic_init(&run->told, false);
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
    free(run->doubts.list);
    pthread_mutex_destroy(&run->mutex);
    pthread_cond_destroy(&run->loop.left);
}

struct store *jobs_run_store(struct jobs_run *run)
{
    return run->jobs->config.store;
}

const char *jobs_run_job_id(const struct jobs_run *run)
{
    return run->job->id;
}

const char *jobs_run_process(const struct jobs_run *run)
{
    return run->job->process;
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

int jobs_run_checkpoint_write(struct jobs_run *run, const void *bytes, size_t size)
{
    const struct store_job *job = run->job;
    char detail[80];
    int status = STORE_CONFLICT;

    if (jobs_run_told(run)) {
        return status; /* of what was broken off nothing is kept */
    }
    status = store_checkpoint_put(run->jobs->config.store, job->id, job->attempt, bytes, size);
    if (status == STORE_OK) {
        (void)snprintf(detail, sizeof detail, "%zu bytes", size);
    } else {
        (void)snprintf(detail, sizeof detail, "%s", store_strerror(status));
    }
    jobs_log(run->jobs, status == STORE_OK ? "job-checkpoint" : "job-checkpoint-failed", job,
             detail);
    return status;
}

int jobs_run_checkpoint_read(struct jobs_run *run, unsigned char **bytes, size_t *size)
{
    const struct store_job *job = run->job;
    const char *build = run->jobs->config.numeric_build ? run->jobs->config.numeric_build : "";
    char detail[80];
    int status = STORE_NOT_FOUND;

    *bytes = NULL;
    *size = 0;
    /* Another build may lay its checkpoints out differently, and would mix its numbers in. */
    if (job->attempt > 0 && job->numeric_build && strcmp(job->numeric_build, build) == 0) {
        status = store_checkpoint_get(run->jobs->config.store, job->id, bytes, size);
    }
    if (status == STORE_OK) {
        (void)snprintf(detail, sizeof detail, "%zu bytes, attempt %lld", *size,
                       (long long)job->attempt);
        jobs_log(run->jobs, "job-resumed", job, detail);
        jobs_run_resumed(run);
    }
    return status;
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
             "bytes. Delete jobs or cohorts, or ask for a larger quota; then run it again.",
             what, (long long)bytes, (long long)most);
}

/* How the run is to be written down. */
struct ending {
    enum store_job_status to;
    const char *results, *code, *detail;
};

static struct ending judge(struct jobs_run *run, const struct jobs_result *result)
{
    struct ending ending = {.to = STORE_JOB_FAILED};
    bool told = jobs_run_told(run);

    if (result->problem_code && !told) {
        ending.code = result->problem_code;
        ending.detail = result->problem_detail;
    } else if (result->results && !told) {
        ending.to = STORE_JOB_SUCCESSFUL;
        ending.results = result->results;
    } else if (atomic_load(&run->cancel)) {
        ending.to = STORE_JOB_DISMISSED;
    } else if (atomic_load(&run->overran)) {
        ending.code = "time-limit";
        ending.detail = "The job took longer than this service allows.";
    } else if (atomic_load(&run->jobs->abandoned)) {
        ending.to = STORE_JOB_ACCEPTED;
    } else {
        ending.code = "internal-error";
        ending.detail = "The process ended with neither results nor a problem.";
    }
    return ending;
}

/* Sleeps before the next try to write; false when the daemon stops. */
static bool may_retry(struct jobs *jobs, unsigned failures)
{
    return !atomic_load(&jobs->closing) && jobs_pause(failures);
}

/* Where memory was refused because of the limit, that is the problem. */
static void judge_memory(const struct jobs_run *run, struct jobs_result *result)
{
    const struct jobs_memory *memory = run->memory;
    size_t refused = atomic_load(&memory->refused);

    if (refused > 0) {
        result->problem_code = "memory-limit";
        snprintf(result->problem_detail, sizeof result->problem_detail,
                 "The job needs more memory than this service allows: with %zu bytes in use it "
                 "asked for %zu more, and the limit is %zu bytes.",
                 atomic_load(&memory->held), refused, memory->limit);
    }
}

/* Counts the end of a run, how long it took and what it had in use. */
static void count_ending(struct jobs_run *run, enum store_job_status to, double seconds)
{
    struct metrics *metrics = run->jobs->config.metrics;
    const char *process = run->job->process;

    if (to != STORE_JOB_ACCEPTED) {
        metrics_observe(metrics, METRIC_JOB_SECONDS, METRIC_LABELS(process), seconds);
        metrics_observe(metrics, METRIC_JOB_MEMORY, METRIC_LABELS(process),
                        (double)atomic_load(&run->memory->peak));
        metrics_add(metrics, METRIC_JOBS_ENDED, METRIC_LABELS(process, store_job_status_name(to)),
                    1);
    }
}

/* Returns the state that was written, or STORE_JOB_RUNNING where none was. */
static enum store_job_status write_ending(struct jobs_run *run, struct ending ending)
{
    struct jobs *jobs = run->jobs;
    const struct store_job *job = run->job;
    unsigned failures = 0;
    char event[32], quota[JOBS_DETAIL_MAX], what[80];
    int status;

    for (;;) {
        status = store_job_transition(jobs->config.store, job->id, job->attempt, ending.to,
                                      ending.results, ending.code, ending.detail);
        if (status == STORE_OK || status == STORE_CONFLICT || status == STORE_NOT_FOUND) {
            break;
        }
        if (status == STORE_QUOTA && ending.to == STORE_JOB_SUCCESSFUL) {
            snprintf(what, sizeof what, "the results, %zu bytes", strlen(ending.results));
            jobs_run_quota_detail(run, what, quota);
            ending = (struct ending){
                .to = STORE_JOB_FAILED, .code = "storage-quota-exceeded", .detail = quota};
            continue;
        }
        jobs_log(jobs, "job-not-written", job, store_strerror(status));
        if (ending.to == STORE_JOB_SUCCESSFUL) {
            ending.to = STORE_JOB_FAILED;
            ending.results = NULL;
            ending.code = status == STORE_FULL    ? "storage-full"
                          : status == STORE_IO    ? "storage-unavailable"
                          : status == STORE_NOMEM ? "out-of-memory"
                                                  : "internal-error";
            ending.detail = "The results could not be stored.";
        } else if (!may_retry(jobs, ++failures)) {
            break;
        }
    }
    if (status == STORE_OK) {
        snprintf(event, sizeof event, "job-%s", store_job_status_name(ending.to));
        jobs_log(jobs, event, job, ending.code ? ending.code : "");
        return ending.to;
    }
    jobs_log(jobs, "job-lost", job, store_strerror(status));
    return STORE_JOB_RUNNING;
}

void jobs_run_execute(struct jobs_run *run)
{
    struct jobs *jobs = run->jobs;
    const struct jobs_process *process = jobs_process_find(jobs, run->job->process);
    struct jobs_result result = {0};
    double started = on_seconds(run);
    enum store_job_status ended;

    if (run->job->attempt == 1) {
        metrics_observe(jobs->config.metrics, METRIC_JOB_WAIT_SECONDS,
                        METRIC_LABELS(run->job->process),
                        1e-3 * (double)(run->job->started_ms - run->job->created_ms));
    }
    jobs_log(jobs, "job-running", run->job, run->job->process);
    jobs_changed(jobs, run->job->id);
    if (process) {
        (void)jobs_memory_enter(run->memory);
        fault_enter(run->job->id, run->job->process);
        process->run(run, jobs->config.user, run->job->inputs, &result);
        fault_enter(NULL, NULL);
        (void)jobs_memory_enter(NULL);
        judge_memory(run, &result);
    } else {
        result.problem_code = "no-such-process";
        snprintf(result.problem_detail, sizeof result.problem_detail,
                 "This version has no process of that name.");
    }
    result.problem_detail[sizeof result.problem_detail - 1] = '\0';
    ended = write_ending(run, judge(run, &result));
    if (ended != STORE_JOB_RUNNING) {
        count_ending(run, ended, on_seconds(run) - started);
    }
    if (atomic_load(&run->memory->used) > 0) {
        jobs_log(jobs, "job-memory-kept", run->job, "blocks of the job were not freed");
    }
    free(result.results);
}
