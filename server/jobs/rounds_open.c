/*
 * rounds_open.c - opens a round: names its tasks, so that they are found again after a restart, and
 * takes their state from the store.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "store/digest.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "task-" and 32 digits of a digest of the job and all that the task is computed from. Tasks keep
   it when a job begins again with fewer of them. */
static int make_id(const struct jobs_run *run, const struct jobs_open_round *open, size_t index,
                   char id[STORE_ID_MAX])
{
    const struct jobs_round *round = open->what;
    struct jobs_task task = {.n_contents = 0};
    char *text = NULL;
    size_t size = 0;
    int status = round->describe(round->user, index, &task);
    FILE *out = status == 0 ? open_memstream(&text, &size) : NULL;

    if (status == 0 && !out) {
        status = SRNF_ENOMEM;
    }
    if (out) {
        (void)fprintf(out, "%s\n%s\n%s\n", open->job, jobs_numeric_build(run->jobs),
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

static int by_digest(const void *a, const void *b, void *rows)
{
    const struct store_task *list = rows;
    size_t x = *(const size_t *)a, y = *(const size_t *)b;
    int order = strcmp(list[x].id, list[y].id);

    return order ? order : (x > y) - (x < y);
}

/* Tasks about equal surfaces have one digest: all but the first get their number among these into
   theirs, so that no two tasks of a round have one id. */
static void tell_apart(struct store_task *rows, size_t *order, size_t n)
{
    size_t first = 0;

    qsort_r(order, n, sizeof *order, by_digest, rows);
    for (size_t i = 1; i < n; i++) {
        char *id = rows[order[i]].id, text[STORE_ID_MAX + 24];

        if (strcmp(id, rows[order[first]].id) != 0) {
            first = i;
        } else {
            (void)snprintf(text, sizeof text, "%s %zu", id, i - first);
            store_content_id(id, "task-", text, strlen(text));
        }
    }
}

static int by_id(const void *a, const void *b, void *slots)
{
    const struct jobs_slot *list = slots;

    return strcmp(list[*(const size_t *)a].row.id, list[*(const size_t *)b].row.id);
}

int jobs_fail_store(struct jobs_result *result, int status)
{
    result->problem_code = status == STORE_FULL ? "storage-full" : "storage-unavailable";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "The tasks of the job could not be kept: %s.", store_strerror(status));
    return JOBS_TASK_FAILED;
}

/* A slot from its row. Leases that an earlier attempt of the job has given hold from now on. */
static void enter_slot(struct jobs_run *run, struct jobs_open_round *round, size_t index)
{
    struct jobs_slot *slot = &round->slots[index];

    if (slot->row.status == STORE_TASK_LEASED) {
        jobs_slot_lease(round, index, run->jobs->config.lease_seconds);
        slot->restored = true;
    } else if (slot->row.status == STORE_TASK_DONE) {
        jobs_slot_finish(round, index, NULL);
    }
}

int jobs_open_round(struct jobs_run *run, struct jobs_open_round *round, struct jobs_result *result)
{
    size_t n = round->what->n;
    struct store_task *rows = srnf_alloc(n, sizeof *rows);
    int status = SRNF_ENOMEM;

    round->slots = srnf_alloc(n, sizeof *round->slots);
    round->order = srnf_alloc(n, sizeof *round->order);
    round->arrived = srnf_alloc(n, sizeof *round->arrived);
    if (rows && round->slots && round->order && round->arrived) {
        status = 0;
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        status = make_id(run, round, i, rows[i].id);
        round->order[i] = i;
        if (status == 0 && run->context.canceled(run)) {
            status = SRNF_ECANCELED;
        }
    }
    if (status == 0) {
        tell_apart(rows, round->order, n);
        status =
            store_tasks_open(run->jobs->config.store, round->job, round->what->kind->name, n, rows);
        status = status ? jobs_fail_store(result, status) : 0;
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        round->slots[i].row = rows[i];
        enter_slot(run, round, i);
    }
    if (status == 0) {
        qsort_r(round->order, n, sizeof *round->order, by_id, round->slots);
    }
    srnf_free(rows);
    return status;
}
