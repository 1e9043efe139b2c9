/*
 * numbers.h - integers and doubles as the store writes them: eight bytes each, least significant
 * first, whatever the machine.
 */
#ifndef SRNFD_STORE_NUMBERS_H
#define SRNFD_STORE_NUMBERS_H

#include <stddef.h>
#include <stdint.h>

void store_put_integer(unsigned char bytes[8], int64_t value);
/* -0 is written as 0. */
void store_put_doubles(unsigned char *bytes, const double *values, size_t count);
void store_get_doubles(const unsigned char *bytes, double *values, size_t count);

#endif
