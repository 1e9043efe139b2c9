/*
 * tasks.c - the table of kinds.
 */
#include "tasks/internal.h"

#include <string.h>

static const struct tasks_kind *const kinds[] = {&tasks_pairs_kind, &tasks_searches_kind,
                                                 &tasks_encodings_kind};

_Static_assert(sizeof kinds / sizeof kinds[0] < TASKS_KINDS_MAX, "tables of kinds hold them");

const struct tasks_kind *tasks_kind_at(size_t index)
{
    return index < sizeof kinds / sizeof kinds[0] ? kinds[index] : NULL;
}

const struct tasks_kind *tasks_kind_find(const char *name)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(kinds[i]->name, name) == 0) {
            return kinds[i];
        }
    }
    return NULL;
}
