/*
 * rounds.c - the job's side of its tasks: offers a round, and takes the results as they come until
 * all tasks are done.
 *
 * The thread of the run sleeps. Requests of workers change slots and wake it; four times a second
 * it looks for leases that have expired, by the monotonic clock, and whether the job is to stop. A
 * task that was lost too often (losers.c) is poison: the job fails with what was said of it.
 *
 * A result is charged to the memory of the job from when it comes until it is taken. Where the job
 * has no room it stays in the store alone, and is read when its turn has come.
 */
#include "jobs/rounds.h"

#include "clock.h"
#include "jobs/internal.h"
#include "store/job.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REASONS_TOLD ((size_t)280) /* bytes of what workers said */
#define LOOK_SECONDS 0.25

void jobs_rounds_init(struct jobs_rounds *rounds)
{
    pthread_mutex_init(&rounds->mutex, NULL);
}

void jobs_rounds_destroy(struct jobs_rounds *rounds)
{
    pthread_mutex_destroy(&rounds->mutex);
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

bool jobs_task_suits(const struct tasks_kind *kind, const struct jobs_task *task,
                     const void *result, size_t size)
{
    return kind->check(task->inputs.bytes, task->inputs.size, result, size) &&
           (!kind->possible || kind->possible(task->inputs.bytes, task->inputs.size, task->contents,
                                              task->n_contents, result, size));
}

/* ---- Waiting --------------------------------------------------------------------------------- */

/* The first lease that has expired, or SIZE_MAX. The mutex is held. */
static size_t find_expired(const struct jobs_open_round *round, double now)
{
    size_t i = round->first_leased;

    while (i != SIZE_MAX && (round->slots[i].losing || round->slots[i].expires > now)) {
        i = round->slots[i].after;
    }
    return i;
}

/* The store says that the lease has ended, and the round was not told, or is about to be: what came
   while the round was opened, after a restart, only the store knows. The mutex is held, but let go
   of meanwhile. */
static void catch_up(struct jobs_run *run, struct jobs_open_round *round, size_t index)
{
    struct jobs *jobs = run->jobs;
    struct jobs_slot *slot = &round->slots[index];
    struct store_task row = slot->row;
    int status;

    pthread_mutex_unlock(&jobs->rounds.mutex);
    status = store_task_get(jobs->config.store, &row);
    pthread_mutex_lock(&jobs->rounds.mutex);
    if (status != STORE_OK || slot->state != SLOT_LEASED || slot->row.attempt != row.attempt) {
        return;
    }
    if (row.status == STORE_TASK_DONE) {
        jobs_remotes_note(&jobs->remotes, slot->who, REMOTE_DONE, round->what->kind->name);
        jobs_slot_finish(round, index, NULL);
    } else if (row.status == STORE_TASK_WAITING) {
        jobs_remotes_note(&jobs->remotes, slot->who, REMOTE_OVER, round->what->kind->name);
        slot->row.lost = row.lost;
        jobs_slot_free(round, index);
    }
}

/* Asks the store to lose the lease of a slot, which is not extended meanwhile. The mutex is held,
   but let go of: only this thread ends the round. */
static void lose(struct jobs_run *run, struct jobs_open_round *round, size_t index)
{
    struct jobs *jobs = run->jobs;
    struct jobs_slot *slot = &round->slots[index];
    double limit = jobs->config.task_seconds;
    int64_t attempt = slot->row.attempt;
    char worker[STORE_ID_MAX], reason[STORE_ID_MAX + 80], who[JOBS_WHO_SIZE];
    int status;

    slot->losing = true;
    (void)snprintf(worker, sizeof worker, "%s", slot->row.worker);
    memcpy(who, slot->who, sizeof who);
    if (clock_now() - slot->since > limit) {
        (void)snprintf(reason, sizeof reason, "attempt %lld: no result of %s in %.0f s",
                       (long long)attempt, worker, limit);
    } else if (slot->expires <= 0.0) {
        (void)snprintf(reason, sizeof reason, "attempt %lld: %s gets no more tasks",
                       (long long)attempt, worker);
    } else {
        (void)snprintf(reason, sizeof reason, "attempt %lld: no sign of %s", (long long)attempt,
                       worker);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    status = store_task_lose(jobs->config.store, slot->row.id, attempt, reason);
    if (status == STORE_OK) {
        metrics_add(jobs->config.metrics, METRIC_TASKS,
                    METRIC_LABELS(round->what->kind->name, "lost"), 1);
        jobs_remotes_note(&jobs->remotes, who, REMOTE_LOST, round->what->kind->name);
        jobs_log(jobs, "task-lost", run->job, reason);
    }
    pthread_mutex_lock(&jobs->rounds.mutex);
    if (status == STORE_OK && slot->state == SLOT_LEASED && slot->row.attempt == attempt) {
        jobs_slot_lose(jobs, round, index, NULL);
    }
    if (status == STORE_CONFLICT) {
        catch_up(run, round, index);
    }
}

/* Leases that have expired are lost, where the store agrees: it does not where they have ended. The
   mutex is held, but let go of meanwhile. */
static void expire(struct jobs_run *run, struct jobs_open_round *round)
{
    double now = clock_now();
    size_t i;

    while ((i = find_expired(round, now)) != SIZE_MAX) {
        lose(run, round, i);
    }
    for (i = round->first_leased; i != SIZE_MAX; i = round->slots[i].after) {
        round->slots[i].losing = false; /* the store may fail: the next look tries again */
    }
}

/* Whether those who wait for tasks are to be asked again, from now on not any more. The mutex is
   held. */
static bool must_offer(struct jobs_open_round *round)
{
    bool due = round->offer_at > 0.0 && clock_now() >= round->offer_at;

    round->offer_at = due ? 0.0 : round->offer_at;
    return due;
}

static double progress_of(const struct jobs_round *round, size_t done)
{
    double part = (double)done / (double)round->n;

    return round->to > 0.0 ? round->from + (round->to - round->from) * part : part;
}

/* The mutex is held, but let go of meanwhile. */
static void tell(struct jobs_run *run, struct jobs_open_round *round, size_t told[2])
{
    size_t done = round->done, leased = round->leased, n = round->what->n;
    char message[JOBS_MESSAGE_MAX + JOBS_REMARK_MAX], work[40] = "waiting for workers";
    char remark[JOBS_REMARK_MAX];

    if (told[0] == done && told[1] == leased && !round->remarked) {
        return;
    }
    told[0] = done;
    told[1] = leased;
    round->remarked = false;
    memcpy(remark, round->remark, sizeof remark);
    pthread_mutex_unlock(&run->jobs->rounds.mutex);
    if (leased > 0) {
        (void)snprintf(work, sizeof work, "%zu at work", leased);
    }
    (void)snprintf(message, sizeof message, "%zu of %zu tasks done, %s%s%s", done, n, work,
                   remark[0] ? "; " : "", remark);
    run->context.progress(run, progress_of(round->what, done), message);
    pthread_mutex_lock(&run->jobs->rounds.mutex);
}

/* ---- Taking ---------------------------------------------------------------------------------- */

/* The result of a task that is done, charged to the job. False: it cannot be one. */
static bool check_result(const struct jobs_round *what, size_t index,
                         const struct tasks_bytes *result, int *status)
{
    struct jobs_task task;
    bool good = false;

    *status = what->describe(what->user, index, &task);
    if (*status == 0) {
        good = jobs_task_suits(what->kind, &task, result->bytes, result->size);
        jobs_task_clear(&task);
    }
    return good;
}

/* As the store has it. *good false: it cannot be one, and the task is to be computed again. */
static int load_result(struct jobs_run *run, struct jobs_open_round *round, size_t index,
                       struct tasks_bytes *loaded, bool *good, struct jobs_result *result)
{
    struct store *store = run->jobs->config.store;
    const char *id = round->slots[index].row.id;
    int status = store_task_result(store, id, &loaded->bytes, &loaded->size);

    if (status != STORE_OK) {
        return status == STORE_NOMEM ? SRNF_ENOMEM : jobs_fail_store(result, status);
    }
    if (!jobs_memory_charge(run->memory, loaded->size)) {
        free(loaded->bytes);
        loaded->bytes = NULL;
        return SRNF_ENOMEM;
    }
    *good = check_result(round->what, index, loaded, &status);
    if (status == 0 && !*good) {
        status = store_task_reset(store, id);
        status = status ? jobs_fail_store(result, status) : 0;
    }
    return status;
}

/* Takes the result of one task. */
static int take_one(struct jobs_run *run, struct jobs_open_round *round, size_t index, bool *good,
                    struct jobs_result *result)
{
    struct jobs_slot *slot = &round->slots[index];
    struct tasks_bytes bytes = {.bytes = slot->result, .size = slot->size};
    int status = 0;

    *good = true;
    slot->result = NULL;
    if (!bytes.bytes) {
        status = load_result(run, round, index, &bytes, good, result);
    }
    if (status == 0 && *good && !jobs_verify(run, round, index, &bytes, result)) {
        status = JOBS_TASK_FAILED;
    }
    if (status == 0 && *good) {
        status = round->what->take(round->what->user, index, bytes.bytes, bytes.size);
    }
    if (bytes.bytes) {
        jobs_memory_discharge(run->memory, bytes.size);
    }
    free(bytes.bytes);
    return status;
}

/* Takes what has come since. The mutex is held, but let go of meanwhile. */
static int take_arrived(struct jobs_run *run, struct jobs_open_round *round, size_t *taken,
                        struct jobs_result *result)
{
    struct jobs *jobs = run->jobs;
    int status = 0;

    while (status == 0 && *taken < round->done && !round->failed) {
        size_t index = round->arrived[*taken];
        bool good;

        pthread_mutex_unlock(&jobs->rounds.mutex);
        status = take_one(run, round, index, &good, result);
        pthread_mutex_lock(&jobs->rounds.mutex);
        if (good) {
            ++*taken;
        } else { /* its place goes to the last that came */
            round->arrived[*taken] = round->arrived[--round->done];
            jobs_slot_lose(jobs, round, index, NULL);
        }
    }
    return status;
}

static int wait_for_all(struct jobs_run *run, struct jobs_open_round *round,
                        struct jobs_result *result)
{
    struct jobs *jobs = run->jobs;
    size_t told[2] = {SIZE_MAX, SIZE_MAX}, taken = 0;
    double look = clock_now() + LOOK_SECONDS;
    int status = 0;

    pthread_mutex_lock(&jobs->rounds.mutex);
    while (status == 0 && taken < round->what->n && !round->failed) {
        struct timespec until = clock_timespec(look);
        bool offer;

        status = take_arrived(run, round, &taken, result);
        tell(run, round, told);
        if (status || round->failed || taken == round->what->n) {
            continue;
        }
        if (taken == round->done) {
            (void)pthread_cond_clockwait(&round->changed, &jobs->rounds.mutex, CLOCK_MONOTONIC,
                                         &until);
        }
        if (clock_now() < look) {
            continue;
        }
        look = clock_now() + LOOK_SECONDS;
        expire(run, round);
        offer = must_offer(round);
        offer = jobs_remotes_withheld(&jobs->remotes) || offer;
        pthread_mutex_unlock(&jobs->rounds.mutex);
        if (offer) {
            jobs_rounds_offer(jobs);
        }
        if (atomic_load(&jobs->draining)) {
            jobs_run_yield(run); /* what workers bring meanwhile the store keeps */
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
    for (size_t i = round->first_leased; i != SIZE_MAX; i = round->slots[i].after) {
        jobs_remotes_note(&jobs->remotes, round->slots[i].who, REMOTE_OVER,
                          round->what->kind->name);
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
    size_t workers = slot->n_losers;

    (void)store_task_reasons(run->jobs->config.store, slot->row.id, reasons);
    for (char *at = reasons; (at = strchr(at, '\n')) != NULL;) {
        *at = ';';
    }
    if (strlen(reasons) > REASONS_TOLD) {
        reasons[REASONS_TOLD] = '\0';
        text_trim_cut(reasons);
    }
    result->problem_code = "task-failed";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "Task %zu of %zu (%s) was lost %lld times by %zu worker%s, which said: %.*s.",
                   round->poison + 1, round->what->n, round->what->kind->name,
                   (long long)slot->row.lost, workers, plural(workers), (int)REASONS_TOLD,
                   reasons[0] ? reasons : "nothing");
    return JOBS_TASK_FAILED;
}

static void clear_round(struct jobs_open_round *round)
{
    for (size_t i = 0; round->slots && i < round->what->n; i++) {
        if (round->slots[i].result) {
            jobs_memory_discharge(round->memory, round->slots[i].size);
            free(round->slots[i].result);
        }
    }
    srnf_free(round->slots);
    srnf_free(round->order);
    srnf_free(round->arrived);
    pthread_cond_destroy(&round->changed);
}

int jobs_run_round(struct jobs_run *run, const struct jobs_round *what, struct jobs_result *result)
{
    struct jobs_open_round round = {
        .what = what, .job = run->job->id, .memory = run->memory, .first_leased = SIZE_MAX};
    int status;

    pthread_cond_init(&round.changed, NULL);
    status = jobs_open_round(run, &round, result);
    if (status == 0) {
        publish(run->jobs, &round);
        status = wait_for_all(run, &round, result);
        withdraw(run->jobs, &round);
    }
    if (status == 0 && round.failed) {
        status = fail_poisoned(run, &round, result);
    }
    clear_round(&round);
    return status;
}
