/*
 * tasks.c - a parallel loop whose bodies may fail, be cancelled and tell their progress.
 *
 * Which body runs when is left to the caller's threads, and yet a failure must be the same one on
 * every run: a body is skipped only if one with a lower index has failed, so the lowest index that
 * can fail always runs. Failures are pushed onto a list without a lock (nothing is taken off it
 * before the loop is over) and the lowest one is looked up at the end.
 */
#include "stats.h"

#include <stdatomic.h>

struct failure {
    size_t index;
    int status;
    struct srnf_error error;
    struct failure *next;
};

struct tasks {
    const struct srnf_context *context;
    struct srnf_context quiet;
    size_t count;
    stats_body *body;
    void *argument;
    struct stats_progress progress;
    atomic_size_t done;
    atomic_size_t lowest; /* index that has failed; count: none */
    atomic_bool canceled;
    atomic_bool exhausted; /* a failure could not even be noted down */
    _Atomic(struct failure *) failures;
};

static void note_failure(struct tasks *tasks, const struct failure *what)
{
    struct failure *failure = srnf_alloc(1, sizeof *failure);
    size_t lowest = atomic_load(&tasks->lowest);

    while (what->index < lowest &&
           !atomic_compare_exchange_weak(&tasks->lowest, &lowest, what->index)) {
    }
    if (!failure) {
        atomic_store(&tasks->exhausted, true);
        return;
    }
    *failure = *what;
    failure->next = atomic_load(&tasks->failures);
    while (!atomic_compare_exchange_weak(&tasks->failures, &failure->next, failure)) {
    }
}

static void run_one(void *argument, size_t index)
{
    struct tasks *tasks = argument;
    struct failure failure = {.index = index};

    if (index > atomic_load(&tasks->lowest) || atomic_load(&tasks->canceled)) {
        return;
    }
    failure.status = tasks->body(tasks->argument, index, &tasks->quiet, &failure.error);
    /* What a body has left unfinished it need not have noticed. */
    if (failure.status == SRNF_ECANCELED || srnf_is_canceled(tasks->context)) {
        atomic_store(&tasks->canceled, true);
    } else if (failure.status < 0) {
        note_failure(tasks, &failure);
    } else if (tasks->progress.message) {
        double part = (double)(atomic_fetch_add(&tasks->done, 1) + 1) / (double)tasks->count;

        srnf_report_progress(tasks->context,
                             tasks->progress.from +
                                 part * (tasks->progress.to - tasks->progress.from),
                             tasks->progress.message);
    }
}

/* Status and error of the failure with the lowest index; frees the list. */
static int judge(struct tasks *tasks, struct srnf_error *error)
{
    struct failure *failure = atomic_load(&tasks->failures);
    const struct failure *first = NULL;
    int status = SRNF_OK;

    for (struct failure *f = failure; f; f = f->next) {
        first = !first || f->index < first->index ? f : first;
    }
    if (atomic_load(&tasks->canceled)) {
        status = SRNF_ECANCELED;
    } else if (atomic_load(&tasks->exhausted)) {
        status = SRNF_ENOMEM;
    } else if (first) {
        status = first->status;
    }
    if (status) {
        (void)stats_fail(error, status, first ? &first->error : NULL);
    }
    while (failure) {
        struct failure *next = failure->next;

        srnf_free(failure);
        failure = next;
    }
    return status;
}

int stats_run(const struct srnf_context *context, size_t count, stats_body *body, void *argument,
              struct stats_progress progress, struct srnf_error *error)
{
    struct tasks tasks = {.context = context,
                          .quiet = context ? *context : (struct srnf_context){0},
                          .count = count,
                          .body = body,
                          .argument = argument,
                          .progress = progress};

    tasks.quiet.progress = NULL;
    tasks.quiet.parallel_for = NULL;
    tasks.quiet.search = NULL;
    tasks.quiet.measure = NULL;
    atomic_init(&tasks.done, 0);
    atomic_init(&tasks.lowest, count);
    atomic_init(&tasks.canceled, false);
    atomic_init(&tasks.exhausted, false);
    atomic_init(&tasks.failures, NULL);
    if (srnf_parallel_for(context, count, run_one, &tasks)) {
        atomic_store(&tasks.canceled, true);
    }
    return judge(&tasks, error);
}

int stats_fail(struct srnf_error *error, int status, const struct srnf_error *first)
{
    bool explained = first && first->status == status;

    return srnf_fail(error, status, explained ? first->element : -1, "%s",
                     explained ? first->message : srnf_strerror(status));
}
