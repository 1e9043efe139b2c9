/*
 * numbers.c - numbers as the store writes them: 64-bit integers and IEEE 754 doubles, eight bytes
 * each, least significant first, whatever the machine. What is hashed into a content id and what
 * is kept as a blob are these same bytes.
 *
 * -0 is written as 0: the two are equal, and equal content has one id.
 */
#include "store/numbers.h"

#include <string.h>

static void put_bits(unsigned char bytes[8], uint64_t bits)
{
    for (size_t i = 0; i < 8; i++) {
        bytes[i] = (unsigned char)(bits >> (8 * i));
    }
}

void store_put_integer(unsigned char bytes[8], int64_t value)
{
    put_bits(bytes, (uint64_t)value);
}

void store_put_doubles(unsigned char *bytes, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        /* Adding 0 turns -0 into 0 and changes nothing else. */
        double value = values[i] + 0.0;
        uint64_t bits;

        memcpy(&bits, &value, sizeof bits);
        put_bits(bytes + 8 * i, bits);
    }
}

void store_get_doubles(const unsigned char *bytes, double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t bits = 0;

        for (size_t k = 0; k < 8; k++) {
            bits |= (uint64_t)bytes[8 * i + k] << (8 * k);
        }
        memcpy(&values[i], &bits, sizeof bits);
    }
}
