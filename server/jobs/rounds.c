/*
 * rounds.c - the job's side of its tasks: opens a round, waits until all tasks are done, and hands
 * the results over in the order of the tasks.
 *
 * The thread of the run sleeps. Requests of workers change slots and wake it; four times a second
 * it looks for leases that have expired and whether the job is to stop. A task that has lost as
 * many attempts as it may is poison: the job fails with what was said of them.
 */
#include "jobs/rounds.h"

#include "clock.h"
#include "jobs/internal.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOOK_SECONDS 0.25

void jobs_rounds_init(struct jobs_rounds *rounds)
{
    pthread_mutex_init(&rounds->mutex, NULL);
}

void jobs_rounds_destroy(struct jobs_rounds *rounds)
{
    pthread_mutex_destroy(&rounds->mutex);
}

void jobs_rounds_offer(struct jobs *jobs)
{
    if (jobs->config.offered) {
        jobs->config.offered(jobs->config.user);
    }
}

bool jobs_offers_tasks(const struct jobs *jobs)
{
    return jobs->config.offers_tasks;
}

void jobs_task_clear(struct jobs_task *task)
{
    free(task->inputs.bytes);
    free(task->contents);
    *task = (struct jobs_task){.n_contents = 0};
}

void jobs_slot_free(struct jobs_open_round *round, size_t index, bool lost)
{
    struct jobs_slot *slot = &round->slots[index];

    round->leased -= slot->state == SLOT_LEASED;
    slot->state = SLOT_WAITING;
    slot->row.lost += lost;
    if (slot->row.lost >= JOBS_TASK_LOST_MAX && !round->failed) {
        round->failed = true;
        round->poison = index;
    }
    round->cursor = index < round->cursor ? index : round->cursor;
    pthread_cond_signal(&round->changed);
}

/* ---- Opening --------------------------------------------------------------------------------- */

/* "task-" and 32 digits of a digest of the job and all that the task is computed from. */
static int make_id(const struct jobs_run *run, const struct jobs_round *round, size_t index,
                   char id[STORE_ID_MAX])
{
    struct jobs_task task = {.n_contents = 0};
    char *text = NULL;
    size_t size = 0;
    int status = round->describe(round->user, index, &task);
    FILE *out = status == 0 ? open_memstream(&text, &size) : NULL;

    if (status == 0 && !out) {
        status = SRNF_ENOMEM;
    }
    if (out) {
        (void)fprintf(out, "%s\n%s\n%s\n", run->job->id, jobs_numeric_build(run->jobs),
                      round->kind->name);
        for (size_t i = 0; i < task.n_contents; i++) {
            (void)fprintf(out, "%s\n", task.contents[i].digest);
        }
        (void)fwrite(task.inputs.bytes, 1, task.inputs.size, out);
        if (fclose(out) == 0) {
            store_content_id(id, "task-", text, size);
        } else {
            status = SRNF_ENOMEM;
        }
    }
    free(text);
    jobs_task_clear(&task);
    return status;
}

static int by_id(const void *a, const void *b, void *slots)
{
    const struct jobs_slot *list = slots;

    return strcmp(list[*(const size_t *)a].row.id, list[*(const size_t *)b].row.id);
}

/* The problem of a job whose tasks the store cannot keep. */
static int fail_store(struct jobs_result *result, int status)
{
    result->problem_code = status == STORE_FULL ? "storage-full" : "storage-unavailable";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "The tasks of the job could not be kept: %s.", store_strerror(status));
    return JOBS_TASK_FAILED;
}

/* A slot from its row. A result that cannot be one is none: the task is computed again. */
static int enter_slot(struct jobs_run *run, struct jobs_open_round *round, size_t index,
                      struct jobs_result *result)
{
    struct jobs_slot *slot = &round->slots[index];
    const struct tasks_kind *kind = round->what->kind;
    struct jobs_task task = {.n_contents = 0};
    bool good = false;
    int status = 0;

    slot->state = slot->row.status == STORE_TASK_LEASED ? SLOT_LEASED : SLOT_WAITING;
    round->leased += slot->state == SLOT_LEASED;
    if (slot->row.status != STORE_TASK_DONE) {
        return 0;
    }
    status = round->what->describe(round->what->user, index, &task);
    if (status == 0) {
        good = kind->check(task.inputs.bytes, task.inputs.size, slot->row.result,
                           slot->row.result_size);
        jobs_task_clear(&task);
    }
    if (good) {
        slot->state = SLOT_DONE;
        round->done++;
    } else if (status == 0) {
        free(slot->row.result);
        slot->row.result = NULL;
        status = store_task_reset(run->jobs->config.store, slot->row.id);
        status = status ? fail_store(result, status) : 0;
    }
    return status;
}

static int open_round(struct jobs_run *run, struct jobs_open_round *round,
                      struct jobs_result *result)
{
    size_t n = round->what->n;
    struct store_task *rows = srnf_alloc(n, sizeof *rows);
    int status = SRNF_ENOMEM;

    round->slots = srnf_alloc(n, sizeof *round->slots);
    round->order = srnf_alloc(n, sizeof *round->order);
    if (rows && round->slots && round->order) {
        status = 0;
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        status = make_id(run, round->what, i, rows[i].id);
        round->order[i] = i;
        if (status == 0 && run->context.canceled(run)) {
            status = SRNF_ECANCELED;
        }
    }
    if (status == 0) {
        status = store_tasks_open(run->jobs->config.store, run->job->id, round->what->kind->name, n,
                                  rows);
        status = status ? fail_store(result, status) : 0;
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        round->slots[i].row = rows[i];
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        status = enter_slot(run, round, i, result);
    }
    if (status == 0) {
        qsort_r(round->order, n, sizeof *round->order, by_id, round->slots);
    }
    srnf_free(rows);
    return status;
}

/* ---- Waiting --------------------------------------------------------------------------------- */

/* Leases that have expired are lost, where the store agrees. The mutex is held, but let go of
   meanwhile: only this thread ends the round. True: there are tasks to lease again. */
static bool expire(struct jobs_run *run, struct jobs_open_round *round)
{
    struct jobs *jobs = run->jobs;
    int64_t now = store_now_ms();
    bool freed = false;

    for (size_t i = 0; i < round->what->n && round->leased > 0; i++) {
        struct jobs_slot *slot = &round->slots[i];
        int64_t attempt = slot->row.attempt;
        char worker[STORE_ID_MAX];

        if (slot->state != SLOT_LEASED || slot->row.expires_ms > now) {
            continue;
        }
        (void)snprintf(worker, sizeof worker, "%s", slot->row.worker);
        pthread_mutex_unlock(&jobs->rounds.mutex);
        if (store_task_lose(jobs->config.store, slot->row.id, attempt, now) == STORE_OK) {
            metrics_add(jobs->config.metrics, METRIC_TASKS,
                        METRIC_LABELS(round->what->kind->name, "lost"), 1);
            jobs_remotes_note(&jobs->remotes, worker, REMOTE_LOST);
            jobs_log(jobs, "task-lost", run->job, worker);
            pthread_mutex_lock(&jobs->rounds.mutex);
            if (slot->state == SLOT_LEASED && slot->row.attempt == attempt) {
                jobs_slot_free(round, i, true);
                freed = true;
            }
        } else {
            pthread_mutex_lock(&jobs->rounds.mutex);
        }
    }
    return freed;
}

/* The mutex is held, but let go of meanwhile. */
static void tell(struct jobs_run *run, const struct jobs_open_round *round, size_t told[2])
{
    size_t done = round->done, leased = round->leased, n = round->what->n;
    char message[80];

    if (told[0] == done && told[1] == leased) {
        return;
    }
    told[0] = done;
    told[1] = leased;
    pthread_mutex_unlock(&run->jobs->rounds.mutex);
    if (leased > 0) {
        (void)snprintf(message, sizeof message, "%zu of %zu tasks done, %zu at work", done, n,
                       leased);
    } else {
        (void)snprintf(message, sizeof message, "%zu of %zu tasks done, waiting for workers", done,
                       n);
    }
    run->context.progress(run, (double)done / (double)n, message);
    pthread_mutex_lock(&run->jobs->rounds.mutex);
}

static int wait_for_all(struct jobs_run *run, struct jobs_open_round *round)
{
    struct jobs *jobs = run->jobs;
    size_t told[2] = {SIZE_MAX, SIZE_MAX};
    double look = clock_now() + LOOK_SECONDS;
    int status = 0;

    pthread_mutex_lock(&jobs->rounds.mutex);
    while (status == 0 && round->done < round->what->n && !round->failed) {
        struct timespec until = clock_timespec(look);
        bool freed = false;

        tell(run, round, told);
        (void)pthread_cond_clockwait(&round->changed, &jobs->rounds.mutex, CLOCK_MONOTONIC, &until);
        if (clock_now() < look) {
            continue;
        }
        look = clock_now() + LOOK_SECONDS;
        freed = expire(run, round);
        pthread_mutex_unlock(&jobs->rounds.mutex);
        if (freed) {
            jobs_rounds_offer(jobs);
        }
        status = run->context.canceled(run) ? SRNF_ECANCELED : 0;
        pthread_mutex_lock(&jobs->rounds.mutex);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return status;
}

static void publish(struct jobs *jobs, struct jobs_open_round *round)
{
    pthread_mutex_lock(&jobs->rounds.mutex);
    round->link = jobs->rounds.first;
    jobs->rounds.first = round;
    pthread_mutex_unlock(&jobs->rounds.mutex);
    jobs_rounds_offer(jobs);
}

static void withdraw(struct jobs *jobs, struct jobs_open_round *round)
{
    struct jobs_open_round **link = &jobs->rounds.first;

    pthread_mutex_lock(&jobs->rounds.mutex);
    while (*link != round) {
        link = &(*link)->link;
    }
    *link = round->link;
    while (round->users > 0) {
        pthread_cond_wait(&round->changed, &jobs->rounds.mutex);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
}

/* ---- The end --------------------------------------------------------------------------------- */

/* The problem of a job whose task was lost too often. */
static int fail_poisoned(struct jobs_run *run, const struct jobs_open_round *round,
                         struct jobs_result *result)
{
    const struct jobs_slot *slot = &round->slots[round->poison];
    char reasons[STORE_TASK_REASONS_MAX] = "";

    (void)store_task_reasons(run->jobs->config.store, slot->row.id, reasons);
    for (char *at = reasons; (at = strchr(at, '\n')) != NULL;) {
        *at = ';';
    }
    result->problem_code = "task-failed";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "Task %zu of %zu (%s) was lost %lld times; the workers said: %.280s.",
                   round->poison + 1, round->what->n, round->what->kind->name,
                   (long long)slot->row.lost, reasons[0] ? reasons : "nothing");
    return JOBS_TASK_FAILED;
}

static void clear_round(struct jobs_open_round *round)
{
    for (size_t i = 0; round->slots && i < round->what->n; i++) {
        free(round->slots[i].row.result);
    }
    srnf_free(round->slots);
    srnf_free(round->order);
    pthread_cond_destroy(&round->changed);
}

int jobs_run_round(struct jobs_run *run, const struct jobs_round *what, struct jobs_result *result)
{
    struct jobs_open_round round = {.what = what};
    int status;

    pthread_cond_init(&round.changed, NULL);
    status = open_round(run, &round, result);
    if (status == 0) {
        publish(run->jobs, &round);
        status = wait_for_all(run, &round);
        withdraw(run->jobs, &round);
    }
    if (status == 0 && round.failed) {
        status = fail_poisoned(run, &round, result);
    }
    for (size_t i = 0; status == 0 && i < what->n; i++) {
        what->take(what->user, i, round.slots[i].row.result, round.slots[i].row.result_size);
    }
    clear_round(&round);
    return status;
}
