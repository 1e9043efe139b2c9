/*
 * queue.c - what squeue prints, one element of an array a line:
 *
 *   srnfd-1f2e3d4c-job-0190..-1-07af|123_4|PENDING|Priority
 *
 * A state that is not known here counts as running: a new release of Slurm must not make arrays be
 * asked for twice. A line of another form makes all of the answer none.
 */
#include "slurm/internal.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *word;
    enum slurm_state state;
} states[] = {
    {"PENDING", SLURM_PENDING},      {"REQUEUED", SLURM_PENDING},
    {"REQUEUE_HOLD", SLURM_PENDING}, {"REQUEUE_FED", SLURM_PENDING},
    {"SPECIAL_EXIT", SLURM_PENDING}, {"RESV_DEL_HOLD", SLURM_PENDING},
    {"COMPLETING", SLURM_LEAVING},   {"COMPLETED", SLURM_ENDED},
    {"CANCELLED", SLURM_ENDED},      {"FAILED", SLURM_ENDED},
    {"TIMEOUT", SLURM_ENDED},        {"NODE_FAIL", SLURM_ENDED},
    {"PREEMPTED", SLURM_ENDED},      {"BOOT_FAIL", SLURM_ENDED},
    {"DEADLINE", SLURM_ENDED},       {"OUT_OF_MEMORY", SLURM_ENDED},
    {"REVOKED", SLURM_ENDED},
};

static enum slurm_state state_of(const char *word)
{
    for (size_t i = 0; i < sizeof states / sizeof states[0]; i++) {
        if (strcmp(states[i].word, word) == 0) {
            return states[i].state;
        }
    }
    return SLURM_RUNNING;
}

/* The next field of a line, up to `end`: of 1 byte at least where it must not be empty. */
static bool read_field(const char **at, char end, bool empty, char *field, size_t size)
{
    size_t length = strcspn(*at, end == '|' ? "|\n" : "\n");

    if ((*at)[length] != end || (length == 0 && !empty)) {
        return false;
    }
    for (size_t i = 0; i < length && i < size - 1; i++) {
        field[i] = isprint((unsigned char)(*at)[i]) ? (*at)[i] : '?';
    }
    field[length < size - 1 ? length : size - 1] = '\0';
    *at += length + 1;
    return true;
}

/* "123" or "123_4". */
static bool is_id(const char *id)
{
    size_t digits = strspn(id, "0123456789");

    return digits > 0 && digits < SLURM_ID_MAX - 2 &&
           (!id[digits] || (id[digits] == '_' && id[digits + 1] &&
                            !id[digits + 1 + strspn(id + digits + 1, "0123456789")]));
}

static bool read_line(const char **at, struct slurm_element *element)
{
    bool good = read_field(at, '|', false, element->name, sizeof element->name) &&
                read_field(at, '|', false, element->id, sizeof element->id) &&
                read_field(at, '|', false, element->word, sizeof element->word) &&
                read_field(at, '\n', true, element->reason, sizeof element->reason) &&
                is_id(element->id) &&
                strspn(element->word, "ABCDEFGHIJKLMNOPQRSTUVWXYZ_") == strlen(element->word);

    if (good) {
        element->state = state_of(element->word);
    }
    return good;
}

bool slurm_queue_read(const char *text, struct slurm_element **elements, size_t *n)
{
    size_t lines = 0;

    *n = 0;
    for (const char *at = text; *at; at++) {
        lines += *at == '\n';
    }
    *elements = calloc(lines + 1, sizeof **elements);
    if (!*elements) {
        return false;
    }
    while (*text) {
        if (*n == lines || !read_line(&text, &(*elements)[*n])) {
            free(*elements);
            *elements = NULL;
            *n = 0;
            return false;
        }
        (*n)++;
    }
    return true;
}
