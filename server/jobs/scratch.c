/*
 * scratch.c - what a job has no room for in memory, in a file of its own (store/scratch.c).
 *
 * What an earlier attempt has left is there for the next if the numeric build is the same, as it is
 * with checkpoints. A disk that is full, or fails, fails the job with that, whatever its process
 * makes of it: a result without what was to be written is none.
 */
#include "jobs/internal.h"

#include "store/job.h"
#include "store/scratch.h"

#include <stdio.h>
#include <string.h>

/* Notes the first failure. */
static int judge(struct jobs_scratch *scratch, int status)
{
    int none = STORE_OK;

    if (status == STORE_OK) {
        return SRNF_OK;
    }
    (void)atomic_compare_exchange_strong(&scratch->failed, &none, status);
    return SRNF_EIO;
}

static int on_write(void *user, uint64_t offset, const void *bytes, size_t size)
{
    struct jobs_scratch *scratch = user;
    uint_fast64_t end = atomic_load(&scratch->end);

    while (end < offset + size &&
           !atomic_compare_exchange_weak(&scratch->end, &end, offset + size)) {
    }
    return judge(scratch, store_scratch_write(scratch->file, offset, bytes, size));
}

/* What is missing or damaged is for the reader to judge: it may be that of an earlier attempt. */
static int on_read(void *user, uint64_t offset, void *bytes, size_t size)
{
    struct jobs_scratch *scratch = user;
    int status = store_scratch_read(scratch->file, offset, bytes, size);

    return status == STORE_CORRUPT ? SRNF_EIO : judge(scratch, status);
}

const struct srnf_scratch *jobs_run_scratch(struct jobs_run *run)
{
    struct jobs_scratch *scratch = &run->scratch;
    const struct store_job *job = run->job;
    const char *build = jobs_numeric_build(run->jobs);
    bool same = job->numeric_build && strcmp(job->numeric_build, build) == 0;

    if (!scratch->file && judge(scratch, store_scratch_open(run->jobs->config.store, job->id, same,
                                                            &scratch->file, &scratch->lent.used))) {
        return NULL;
    }
    /* Who asks again goes on behind what was written: parts have a mean each. */
    if (scratch->lent.used < atomic_load(&scratch->end)) {
        scratch->lent.used = atomic_load(&scratch->end);
    }
    scratch->lent.user = scratch;
    scratch->lent.write = on_write;
    scratch->lent.read = on_read;
    return &scratch->lent;
}

size_t jobs_cache_limit(const struct jobs *jobs)
{
    return jobs->config.job_cache;
}

void jobs_scratch_judge(const struct jobs_run *run, struct jobs_result *result)
{
    int failed = atomic_load(&run->scratch.failed);

    if (failed != STORE_OK) {
        result->problem_code = failed == STORE_FULL    ? "storage-full"
                               : failed == STORE_NOMEM ? "out-of-memory"
                                                       : "storage-unavailable";
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       failed == STORE_FULL
                           ? "The disk has no room for what the job keeps outside of memory while "
                             "it runs. Free some of it, or let jobs hold more in memory "
                             "(--job-cache); then run it again."
                           : "What the job keeps outside of memory while it runs could not be "
                             "written or read: %s.",
                       store_strerror(failed));
    }
}

void jobs_scratch_close(struct jobs_run *run)
{
    store_scratch_close(run->scratch.file);
}
