/*
 * operations.c - jobs that have pilots: how many each gets, when it may ask again, and what it
 * says.
 *
 * A job wants so many pilots that each of their slots has SLOT_SECONDS of work: a pilot takes about
 * a second to start, and one that has nothing to do afterwards was for nothing. What a task takes
 * is measured; before the first is done it counts as TASK_SECONDS, which is what tasks are cut to.
 * The pilots are shared evenly where the jobs want more than there may be.
 */
#include "slurm/internal.h"

#include "clock.h"
#include "log.h"
#include "text.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SLOT_SECONDS 4.0
#define TASK_SECONDS 1.0
#define DEMANDS_MAX 256
#define PAUSE_MAX 300.0   /* seconds between two tries that do nothing */
#define SILENT_LEASES 3.0 /* times of a lease without a sign, after which a pilot does not count */

/* ---- How many -------------------------------------------------------------------------------- */

size_t slurm_pilots_wanted(size_t tasks, double seconds, size_t cpus)
{
    double slots = ceil((double)tasks * (seconds > 0.0 ? seconds : TASK_SECONDS) / SLOT_SECONDS);
    double most = (double)((tasks + cpus - 1) / cpus);

    return tasks == 0 ? 0 : (size_t)fmin(fmax(ceil(slots / (double)cpus), 1.0), most);
}

void slurm_share(size_t most, size_t n, size_t *wishes)
{
    size_t *given = calloc(n + 1, sizeof *given);
    size_t left = most;
    bool gave = given != NULL;

    /* One more for each in turn; n and most are small. */
    while (gave && left > 0) {
        gave = false;
        for (size_t i = 0; i < n && left > 0; i++) {
            if (given[i] < wishes[i]) {
                given[i]++;
                left--;
                gave = true;
            }
        }
    }
    for (size_t i = 0; i < n; i++) {
        wishes[i] = given ? given[i] : 0;
    }
    free(given);
}

/* ---- The list -------------------------------------------------------------------------------- */

struct slurm_operation *slurm_operation_of(struct slurm *slurm, const char *job)
{
    struct slurm_operation **link = &slurm->operations;

    while (*link && strcmp((*link)->job, job) != 0) {
        link = &(*link)->link;
    }
    if (!*link) {
        *link = calloc(1, sizeof **link);
        if (*link) {
            (void)snprintf((*link)->job, sizeof(*link)->job, "%s", job);
            (*link)->memory = (int64_t)slurm->config.memory;
            (*link)->wanted = true;
        }
    }
    return *link;
}

void slurm_operations_free(struct slurm *slurm)
{
    while (slurm->operations) {
        struct slurm_operation *operation = slurm->operations;

        slurm->operations = operation->link;
        free(operation);
    }
}

/* Rounds follow each other, as the iterations of a mean do, and each counts from 0. */
static void take_demand(struct slurm_operation *operation, const struct jobs_demand *demand)
{
    size_t before = demand->done < operation->round_done ? 0 : operation->round_done;

    operation->waits = true;
    operation->left = demand->left;
    operation->alive = demand->alive;
    operation->done += demand->done - before;
    operation->round_done = demand->done;
    if (demand->seconds > 0.0) {
        operation->seconds = demand->seconds;
    }
}

static void take_demands(struct slurm *slurm)
{
    struct jobs_demand *demands = calloc(DEMANDS_MAX, sizeof *demands);
    size_t n = demands ? jobs_demands(slurm->config.jobs, demands, DEMANDS_MAX) : 0;

    for (struct slurm_operation *o = slurm->operations; o; o = o->link) {
        o->waits = false;
        o->left = 0;
    }
    for (size_t i = 0; i < n; i++) {
        struct slurm_operation *operation = slurm_operation_of(slurm, demands[i].job);

        if (operation) {
            take_demand(operation, &demands[i]);
        }
    }
    free(demands);
}

/* Whether the jobs go on. Where the store does not say, they do. */
static void ask_store(struct slurm *slurm)
{
    for (struct slurm_operation *o = slurm->operations; o; o = o->link) {
        bool wanted = true;

        o->wanted = o->waits ||
                    store_pilots_wanted(slurm->config.store, o->job, &wanted) != STORE_OK || wanted;
    }
}

static void count_arrays(struct slurm *slurm)
{
    for (struct slurm_operation *o = slurm->operations; o; o = o->link) {
        o->pending = o->running = 0;
        o->unclear = false;
        o->reason[0] = '\0';
    }
    for (const struct slurm_array *array = slurm->arrays; array; array = array->next) {
        struct slurm_operation *o = slurm_operation_of(slurm, array->row.job);

        if (!o) {
            continue;
        }
        o->attempt = array->row.attempt > o->attempt ? array->row.attempt : o->attempt;
        o->memory = array->row.memory > o->memory ? array->row.memory : o->memory;
        if (array->row.status == STORE_PILOTS_ENDING && !(array->row.vanished && o->failures > 1)) {
            continue;
        }
        o->pending += array->pending > array->delayed ? array->pending - array->delayed : 0;
        o->running += array->running;
        o->unclear = o->unclear || array->row.status == STORE_PILOTS_INTENDED;
        if (array->pending > 0) {
            memcpy(o->reason, array->reason, sizeof o->reason);
        }
    }
}

/* Pilots that run as Slurm says, on a node that has gone, or that cannot reach the service, are not
   to keep the job from getting others. Those that have just begun are given time, and where some
   begin at each look, as many count as were without a sign at all of them. */
static void notice_silent(struct slurm *slurm)
{
    double now = clock_now();

    for (struct slurm_operation *o = slurm->operations; o; o = o->link) {
        size_t missing = o->running > o->alive ? o->running - o->alive : 0;
        bool known = !o->waits || slurm->blind || missing <= o->silent;

        if (known || o->heard <= 0.0) {
            o->silent = missing < o->silent ? missing : o->silent;
            o->heard = now;
            o->fewest = SIZE_MAX;
            continue;
        }
        o->fewest = missing < o->fewest ? missing : o->fewest;
        if (now - o->heard > SILENT_LEASES * slurm->config.lease_seconds) {
            char trouble[SLURM_WHY_MAX];

            (void)snprintf(trouble, sizeof trouble, "%zu pilot%s gave no sign for long", o->fewest,
                           plural(o->fewest));
            LOG_WARN("pilots-silent", log_text("job", o->job),
                     log_number("pilots", (double)o->fewest));
            o->silent = o->fewest;
            o->heard = now;
            o->fewest = SIZE_MAX;
            slurm_operation_fail(o, trouble);
        }
    }
}

static bool has_array(const struct slurm *slurm, const char *job)
{
    for (const struct slurm_array *array = slurm->arrays; array; array = array->next) {
        if (strcmp(array->row.job, job) == 0) {
            return true;
        }
    }
    return false;
}

static void forget(struct slurm *slurm)
{
    struct slurm_operation **link = &slurm->operations, *o;

    while ((o = *link) != NULL) {
        if (o->wanted || has_array(slurm, o->job)) {
            link = &o->link;
        } else {
            *link = o->link;
            free(o);
        }
    }
}

static void share(struct slurm *slurm)
{
    size_t n = 0, i = 0, *wishes;

    for (const struct slurm_operation *o = slurm->operations; o; o = o->link) {
        n++;
    }
    wishes = calloc(n + 1, sizeof *wishes);
    for (const struct slurm_operation *o = slurm->operations; wishes && o; o = o->link) {
        wishes[i++] = slurm_pilots_wanted(o->left, o->seconds, slurm->config.cpus);
    }
    if (wishes) {
        slurm_share(slurm->config.workers, n, wishes);
    }
    i = 0;
    for (struct slurm_operation *o = slurm->operations; o; o = o->link) {
        o->most = wishes ? wishes[i++] : 0;
    }
    free(wishes);
}

void slurm_operations_update(struct slurm *slurm)
{
    take_demands(slurm);
    count_arrays(slurm);
    notice_silent(slurm);
    ask_store(slurm);
    forget(slurm);
    share(slurm);
}

/* ---- What goes wrong, and what is said ------------------------------------------------------- */

void slurm_operation_fail(struct slurm_operation *operation, const char *trouble)
{
    double pause = ldexp(1.0, (int)(operation->failures < 20 ? operation->failures + 1 : 20));

    operation->failures++;
    operation->next = clock_now() + fmin(pause, PAUSE_MAX);
    (void)snprintf(operation->trouble, sizeof operation->trouble, "%s", trouble);
}

/* What there is, and what is wrong; what does not fit is cut by whoever takes it. */
static void remark_of(const struct slurm *slurm, const struct slurm_operation *o, char *text,
                      size_t size)
{
    char pilots[SLURM_REASON_MAX + 64] = "";

    if (slurm->blind) {
        (void)snprintf(text, size, "Slurm: %s", slurm->why);
        return;
    }
    if (o->pending > 0) {
        (void)snprintf(pilots, sizeof pilots, "%zu running, %zu pending (%s)", o->running,
                       o->pending, o->reason[0] ? o->reason : "submitted");
    } else if (o->running > 0) {
        (void)snprintf(pilots, sizeof pilots, "%zu running", o->running);
    } else if (!o->trouble[0]) {
        (void)snprintf(pilots, sizeof pilots, "no pilot yet");
    }
    (void)snprintf(text, size, "Slurm: %s%s%s", pilots, pilots[0] && o->trouble[0] ? "; " : "",
                   o->trouble);
}

void slurm_operations_tell(struct slurm *slurm)
{
    size_t pending = 0, running = 0;
    char text[SLURM_WHY_MAX + SLURM_REASON_MAX + 80];

    for (const struct slurm_operation *o = slurm->operations; o; o = o->link) {
        pending += o->pending;
        running += o->running;
        if (o->waits) {
            remark_of(slurm, o, text, sizeof text);
            jobs_remark(slurm->config.jobs, o->job, text);
        }
    }
    metrics_set(slurm->config.metrics, METRIC_PILOTS, METRIC_LABELS("pending"), (double)pending);
    metrics_set(slurm->config.metrics, METRIC_PILOTS, METRIC_LABELS("running"), (double)running);
}
