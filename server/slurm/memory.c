/*
 * memory.c - pilots that ran out of memory: the next ones of the job get twice as much.
 *
 * Twice what was asked for; where nothing was, twice what squeue says that Slurm gave. A cluster
 * that does not count memory says nothing: then it is MEMORY_LEAST that they had.
 */
#include "slurm/internal.h"

#include "log.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MEMORY_LEAST 1024 /* MiB */
#define MEMORY_MOST (INT64_C(1) << 20)

int64_t slurm_memory_read(const char *text)
{
    static const char units[] = "KMGTP";
    const char *at = strstr(text, "mem="), *unit;
    char *end;
    double number;

    if (!at || (at > text && at[-1] != ',')) {
        return 0;
    }
    number = strtod(at + 4, &end);
    unit = *end ? strchr(units, *end) : NULL;
    if (!unit || !(number > 0.0) || !isfinite(number)) {
        return 0;
    }
    number = ceil(ldexp(number, 10 * ((int)(unit - units) - 1)));
    return number < (double)MEMORY_MOST ? (int64_t)number : MEMORY_MOST;
}

/* MiB that the elements of an array had that was not asked for any. */
static int64_t ask(struct slurm *slurm, const struct slurm_array *array)
{
    char jobs[sizeof "--jobs=" + STORE_PILOTS_NUMBER_MAX];
    const char *const arguments[] = {"squeue",         "-h", "-t", "all", "-O",
                                     "tres-alloc:200", jobs, NULL};
    struct slurm_answer answer;
    int64_t had = 0;

    (void)snprintf(jobs, sizeof jobs, "--jobs=%s", array->row.number);
    if (array->row.number[0]) {
        slurm_run(&(struct slurm_command){.arguments = arguments,
                                          .seconds = slurm->config.seconds,
                                          .hurry = &slurm->closing},
                  &answer);
        if (answer.status == 0 && answer.text) {
            had = slurm_memory_read(answer.text);
        }
        slurm_answer_clear(&answer);
    }
    return had > 0 ? had : MEMORY_LEAST;
}

void slurm_memory_note(struct slurm *slurm, struct slurm_array *array,
                       struct slurm_operation *operation)
{
    int64_t had;

    if (strncmp(array->ended, "OUT_OF_MEMORY", 13) != 0 || array->spent) {
        return;
    }
    array->spent = true;
    had = array->row.memory > 0 ? array->row.memory : ask(slurm, array);
    if (operation->memory < 2 * had) {
        operation->memory = had < MEMORY_MOST ? 2 * had : had;
    }
    LOG_WARN("pilot-out-of-memory", log_text("job", array->row.job),
             log_text("name", array->row.name), log_number("memory", (double)had),
             log_number("next", (double)operation->memory));
}
