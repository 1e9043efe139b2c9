/*
 * verify.c - results of workers that the daemon computes again. All machines of one numeric build
 * compute the same bits, so one bit that differs tells a machine that computes wrong, or somebody
 * who makes results up.
 *
 * Then the job fails: what the worker returned before is in its numbers. Asked for again it is
 * computed without that worker.
 *
 * What is computed again takes its memory of what the job has left, and a job without room for it
 * is not refused: the result is then taken as it is, and counted as uncompared.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "log.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MEMORY_MAX ((size_t)256 << 20) /* bytes for the computation of one task */

/* Whether this result is one of the share. */
static bool is_chosen(double share)
{
    return (double)randombytes_random() < share * 4294967296.0;
}

/* 1: these are the bits; 0: they are not; negative: that cannot be told now. */
static int compute_again(struct jobs_run *run, const struct jobs_round *what, size_t index,
                         const struct tasks_bytes *bytes)
{
    struct srnf_context context = run->context;
    struct jobs_memory lent, *before;
    struct tasks_bytes own = {.bytes = NULL};
    struct srnf_error error;
    struct jobs_task task;
    int status = what->describe(what->user, index, &task);

    if (status) {
        return status;
    }
    /* Nothing that is known already, and nothing that workers compute. */
    context.progress = NULL;
    context.recall = NULL;
    context.keep = NULL;
    context.search = NULL;
    context.measure = NULL;
    context.parallel_for = NULL;
    jobs_memory_lend(run->memory, MEMORY_MAX, &lent);
    before = jobs_memory_enter(&lent);
    status = what->kind->run(task.inputs.bytes, task.inputs.size, task.contents, task.n_contents,
                             &context, &own, &error);
    (void)jobs_memory_enter(before);
    jobs_memory_return(run->memory, &lent);
    jobs_task_clear(&task);
    if (status >= 0) {
        status = own.size == bytes->size && memcmp(own.bytes, bytes->bytes, own.size) == 0;
    } else if (status != SRNF_ENOMEM && status != SRNF_ECANCELED) {
        status = 0; /* there is no such result */
    }
    free(own.bytes);
    return status;
}

/* Leases of those that are barred expire at the next look of their rounds. */
static void end_leases(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->rounds.mutex);
    for (struct jobs_open_round *round = jobs->rounds.first; round; round = round->link) {
        for (size_t i = round->first_leased; i != SIZE_MAX; i = round->slots[i].after) {
            if (jobs_remotes_barred(&jobs->remotes, round->slots[i].who)) {
                round->slots[i].expires = 0.0;
            }
        }
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
}

bool jobs_verify(struct jobs_run *run, const struct jobs_open_round *round, size_t index,
                 const struct tasks_bytes *bytes, struct jobs_result *result)
{
    const struct jobs_slot *slot = &round->slots[index];
    const struct jobs_round *what = round->what;
    struct jobs *jobs = run->jobs;
    char why[160];
    bool barred = false;
    /* Of a worker that was found false since it has brought this, all is computed again. */
    bool false_before = slot->who[0] && jobs_remotes_barred(&jobs->remotes, slot->who);
    bool chosen = false_before || is_chosen(jobs->config.verify_tasks);
    int same = chosen ? compute_again(run, what, index, bytes) : 1;

    if (same == SRNF_ENOMEM) {
        metrics_add(jobs->config.metrics, METRIC_TASKS,
                    METRIC_LABELS(what->kind->name, "uncompared"), 1);
    }
    if (same < 0 && same != SRNF_ECANCELED && false_before) {
        result->problem_code = "out-of-memory";
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "Worker %s, whose results were false elsewhere, returned task %zu of %zu "
                       "(%s), and there is no memory to compute that again; ask for the job again.",
                       slot->row.worker, index + 1, what->n, what->kind->name);
        return false;
    }
    if (same != 0) {
        return true;
    }
    LOG_ERROR("result-differs", log_text("job", round->job), log_text("task", slot->row.id),
              log_text("worker", slot->row.worker));
    metrics_add(jobs->config.metrics, METRIC_TASKS, METRIC_LABELS(what->kind->name, "differs"), 1);
    if (slot->who[0]) { /* not where the result came before the daemon was started again */
        (void)snprintf(why, sizeof why,
                       "Other bits for a task of %s (%s) than the service computes.", round->job,
                       what->kind->name);
        barred = jobs_remotes_bar(&jobs->remotes, slot->who, why);
        end_leases(jobs);
    }
    result->problem_code = "task-failed";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "Worker %s returned other bits for task %zu of %zu (%s) than the service "
                   "computes. %s; ask for the job again.",
                   slot->row.worker, index + 1, what->n, what->kind->name,
                   barred ? "Neither it nor others on its host with its token get tasks for a day"
                   : slot->who[0]
                       ? "It has given no sign since: see that it is not started again"
                       : "That was before the service was started again: end that worker");
    return false;
}
