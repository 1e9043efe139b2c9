/*
 * execute.c - one job from its claim to its end: runs its process, and writes down what becomes
 * of what that returns.
 *
 *   results                        successful (also when cancellation came too late to be seen)
 *   problem                        failed with that code
 *   either, but told to stop       as neither: loops that are told break off where they are, so
 *                                  what comes of them says nothing
 *   neither, a user asked to stop  dismissed
 *   neither, the daemon stops      accepted again, and begun anew by the next
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
 */
#include "jobs/internal.h"

#include "clock.h"
#include "store/job.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How the run is to be written down. */
struct ending {
    enum store_job_status to;
    const char *results, *code, *detail;
};

static struct ending judge(struct jobs_run *run, const struct jobs_result *result)
{
    struct ending ending = {.to = STORE_JOB_FAILED};
    bool stopping = jobs_run_stopping(run);

    if (result->problem_code && !stopping) {
        ending.code = result->problem_code;
        ending.detail = result->problem_detail;
    } else if (result->results && !stopping) {
        ending.to = STORE_JOB_SUCCESSFUL;
        ending.results = result->results;
    } else if (atomic_load(&run->cancel)) {
        ending.to = STORE_JOB_DISMISSED;
    } else if (atomic_load(&run->overran)) {
        ending.code = "time-limit";
        ending.detail = "The job took longer than this service allows.";
    } else if (atomic_load(&run->jobs->abandoned) || atomic_load(&run->yields)) {
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
    double started = clock_now();
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
        run->definition = process->definition;
        process->run(run, jobs->config.user, run->job->inputs, &result);
        fault_enter(NULL, NULL);
        (void)jobs_memory_enter(NULL);
        if (!result.results && run->failed.problem_code) {
            result = run->failed;
        }
        jobs_scratch_judge(run, &result);
        judge_memory(run, &result);
    } else {
        result.problem_code = "no-such-process";
        snprintf(result.problem_detail, sizeof result.problem_detail,
                 "This version has no process of that name.");
    }
    result.problem_detail[sizeof result.problem_detail - 1] = '\0';
    text_trim_cut(result.problem_detail);
    ended = write_ending(run, judge(run, &result));
    if (ended != STORE_JOB_RUNNING) {
        count_ending(run, ended, clock_now() - started);
    }
    if (atomic_load(&run->memory->used) > 0) {
        jobs_log(jobs, "job-memory-kept", run->job, "blocks of the job were not freed");
    }
    free(result.results);
}
