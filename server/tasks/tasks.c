/*
 * tasks.c - the table of kinds.
 */
#include "tasks/internal.h"

#include <string.h>

static const struct tasks_kind *const kinds[] = {&tasks_pairs_kind};

const struct tasks_kind *tasks_kind_find(const char *name)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(kinds[i]->name, name) == 0) {
            return kinds[i];
        }
    }
    return NULL;
}

void tasks_put(unsigned char bytes[8], uint64_t value)
{
    for (unsigned i = 0; i < 8; i++) {
        bytes[i] = (unsigned char)(value >> (8 * i));
    }
}

uint64_t tasks_get(const unsigned char bytes[8])
{
    uint64_t value = 0;

    for (unsigned i = 0; i < 8; i++) {
        value |= (uint64_t)bytes[i] << (8 * i);
    }
    return value;
}

void tasks_put_double(unsigned char bytes[8], double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    tasks_put(bytes, bits);
}

void tasks_put_doubles(unsigned char *bytes, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        tasks_put_double(bytes + 8 * i, values[i]);
    }
}

double tasks_get_double(const unsigned char bytes[8])
{
    uint64_t bits = tasks_get(bytes);
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}
