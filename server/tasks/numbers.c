/*
 * numbers.c - the numbers of tasks as bytes: eight each, least significant first, whatever the
 * machine; and which bytes are a sentence.
 */
#include "tasks/internal.h"

#include <math.h>
#include <string.h>

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

bool tasks_get_doubles(const unsigned char *bytes, size_t count, double *values)
{
    bool finite = true;

    for (size_t i = 0; i < count; i++) {
        values[i] = tasks_get_double(bytes + 8 * i);
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

void tasks_put_point(unsigned char *bytes, const double x[3])
{
    tasks_put_doubles(bytes, x, 3);
}

void tasks_get_point(const unsigned char *bytes, double x[3])
{
    (void)tasks_get_doubles(bytes, 3, x); /* what is not finite the core refuses */
}

bool tasks_is_sentence(const unsigned char *bytes, size_t size)
{
    size_t length = 0;

    while (length < size && bytes[length] >= ' ' && bytes[length] <= '~') {
        length++;
    }
    for (size_t i = length; i < size; i++) {
        if (bytes[i] != 0) {
            return false;
        }
    }
    return length < size;
}
