/*
 * cancel.c - pilots that are not needed: those that wait beyond what a job can use, those of arrays
 * that are to end, and strays.
 *
 * A stray is an element that waits or runs by a name of this installation and belongs to no array
 * that is known here. A controller that was killed may come back with a state of seconds ago, in
 * which elements that had ended run, and starts them again when it does not find them on their
 * nodes; a database may come from a backup. Strays could do nothing, as their tokens have ended.
 * They are looked for while there are arrays and for some minutes after the last.
 */
#include "slurm/internal.h"

#include "clock.h"
#include "log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CANCELS_MAX 64     /* ids of one call */
#define SWEEP_EACH 10.0    /* looks at the queue between two for strays */
#define SWEEP_WINDOW 100.0 /* looks, after the last array has gone */

/* ---- Cancelling ------------------------------------------------------------------------------ */

struct cancels {
    const char *arguments[CANCELS_MAX + 2];
    size_t n; /* with the program */
};

static void cancel(struct slurm *slurm, struct cancels *cancels)
{
    struct slurm_answer answer;

    if (cancels->n > 1) {
        cancels->arguments[cancels->n] = NULL;
        slurm_run(&(struct slurm_command){.arguments = cancels->arguments,
                                          .seconds = slurm->config.seconds},
                  &answer);
        if (answer.status == 0) {
            LOG("pilots-cancelled", log_number("ids", (double)(cancels->n - 1)),
                log_text("first", cancels->arguments[1]));
        } else {
            LOG_WARN("pilots-not-cancelled", log_number("ids", (double)(cancels->n - 1)),
                     log_text("first", cancels->arguments[1]), log_text("message", answer.why));
        }
        slurm_answer_clear(&answer);
    }
    cancels->n = 1;
}

static void add_cancel(struct slurm *slurm, struct cancels *cancels, const char *id)
{
    cancels->arguments[cancels->n++] = id;
    if (cancels->n == CANCELS_MAX + 1) {
        cancel(slurm, cancels);
    }
}

void slurm_shrink(struct slurm *slurm, const struct slurm_operation *operation, size_t most)
{
    struct cancels cancels = {.arguments = {"scancel"}, .n = 1};

    for (struct slurm_array *array = slurm->arrays; array; array = array->next) {
        bool poor = array->row.memory < operation->memory;

        if (strcmp(array->row.job, operation->job) != 0 ||
            array->row.status != STORE_PILOTS_SUBMITTED) {
            continue;
        }
        for (size_t i = slurm->n_elements; i-- > 0 && (most > 0 || poor);) {
            struct slurm_element *element = &slurm->elements[i];

            if (element->state == SLURM_PENDING && strcmp(element->name, array->row.name) == 0) {
                add_cancel(slurm, &cancels, element->id);
                element->state = SLURM_ENDED;
                array->pending -= array->pending > 0;
                array->cut = true;
                most -= most > 0;
            }
        }
    }
    cancel(slurm, &cancels);
}

void slurm_cancel_ending(struct slurm *slurm, bool all)
{
    struct cancels cancels = {.arguments = {"scancel"}, .n = 1};

    for (struct slurm_array *array = slurm->arrays; array; array = array->next) {
        bool lives = array->pending + array->running > 0 || (all && !array->seen);
        bool again = array->row.vanished && array->told && !array->seen;

        if (array->row.status == STORE_PILOTS_ENDING && array->row.number[0] && lives && !again) {
            add_cancel(slurm, &cancels, array->row.number);
            array->told = true;
        }
    }
    cancel(slurm, &cancels);
}

/* ---- Strays ---------------------------------------------------------------------------------- */

double slurm_sweep_due(const struct slurm *slurm)
{
    double each = slurm->config.poll_seconds, now = clock_now();

    return now < slurm->active + SWEEP_WINDOW * each ? slurm->swept + SWEEP_EACH * each : 0.0;
}

/* Leaves only lines that begin with the prefix: other jobs may be called anything. */
static void keep_lines(char *text, const char *prefix)
{
    char *to = text;

    for (const char *at = text; *at;) {
        size_t length = strcspn(at, "\n");

        length += at[length] == '\n';
        if (strncmp(at, prefix, strlen(prefix)) == 0) {
            memmove(to, at, length);
            to += length;
        }
        at += length;
    }
    *to = '\0';
}

static bool is_known(const struct slurm *slurm, const char *name)
{
    const struct slurm_array *array = slurm->arrays;

    while (array && strcmp(array->row.name, name) != 0) {
        array = array->next;
    }
    return array != NULL;
}

static void cancel_strays(struct slurm *slurm, struct slurm_element *elements, size_t n)
{
    struct cancels cancels = {.arguments = {"scancel"}, .n = 1};

    for (size_t i = 0; i < n; i++) {
        struct slurm_element *element = &elements[i];
        bool lives = element->state == SLURM_PENDING || element->state == SLURM_RUNNING;

        if (lives && !is_known(slurm, element->name)) {
            LOG_WARN("pilot-stray", log_text("name", element->name), log_text("id", element->id),
                     log_text("state", element->word));
            add_cancel(slurm, &cancels, element->id);
        }
    }
    cancel(slurm, &cancels);
}

void slurm_sweep(struct slurm *slurm)
{
    static const char *const arguments[] = {"squeue", "-h", "-r", "-o", SLURM_FORMAT, "--me", NULL};
    double due = slurm_sweep_due(slurm);
    char prefix[SLURM_PREFIX_MAX];
    struct slurm_element *elements = NULL;
    struct slurm_answer answer;
    size_t n;

    if (due <= 0.0 || clock_now() < due) {
        return;
    }
    slurm->swept = clock_now();
    slurm_run(&(struct slurm_command){.arguments = arguments,
                                      .seconds = slurm->config.seconds,
                                      .hurry = &slurm->closing},
              &answer);
    if (answer.status == 0 && answer.text) {
        slurm_name_prefix(slurm, prefix);
        keep_lines(answer.text, prefix);
        if (slurm_queue_read(answer.text, &elements, &n)) {
            cancel_strays(slurm, elements, n);
        }
    }
    free(elements);
    slurm_answer_clear(&answer);
}
