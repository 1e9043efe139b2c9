/*
 * digits.h - numbers as decimal text without printf(3), which takes microseconds where a request
 * has some ten.
 */
#ifndef SRNFD_DIGITS_H
#define SRNFD_DIGITS_H

#include <stddef.h>
#include <stdint.h>

#define DIGITS_MAX 32 /* bytes of any text here, with its zero */

/* Each returns the length of the text, which ends with a zero. */

size_t digits_unsigned(char text[DIGITS_MAX], uint64_t value);
/* Rounded to three decimals, "0.040": value in [0, 1e12], what is not is taken for the nearer
   end. */
size_t digits_thousandths(char text[DIGITS_MAX], double value);
/* As "%.15g" would have it; finite. */
size_t digits_number(char text[DIGITS_MAX], double value);

#endif
