/*
 * digits.c - numbers as decimal text without printf(3).
 *
 * digits_number takes the short way for what logs and headers are full of: whole numbers, and those
 * with at most three decimals, when these digits read back are the very number; "%.15g" writes the
 * same then, since it gives the shortest text of a number with up to 15 digits. Anything else goes
 * to snprintf.
 */
#include "digits.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define WHOLE_MAX 1e15 /* from where on "%.15g" has an exponent */
#define THOUSANDTHS_MAX 1e12

size_t digits_unsigned(char text[DIGITS_MAX], uint64_t value)
{
    char reversed[DIGITS_MAX];
    size_t n = 0;

    do {
        reversed[n++] = (char)('0' + value % 10);
        value /= 10;
    } while (value > 0);
    for (size_t i = 0; i < n; i++) {
        text[i] = reversed[n - 1 - i];
    }
    text[n] = '\0';
    return n;
}

/* count thousandths as whole part, point and three decimals. */
static size_t put_thousandths(char *text, uint64_t count)
{
    size_t n = digits_unsigned(text, count / 1000);

    text[n++] = '.';
    text[n++] = (char)('0' + count / 100 % 10);
    text[n++] = (char)('0' + count / 10 % 10);
    text[n++] = (char)('0' + count % 10);
    text[n] = '\0';
    return n;
}

size_t digits_thousandths(char text[DIGITS_MAX], double value)
{
    if (!(value > 0)) {
        value = 0;
    }
    return put_thousandths(text, (uint64_t)llround(1000 * fmin(value, THOUSANDTHS_MAX)));
}

size_t digits_number(char text[DIGITS_MAX], double value)
{
    size_t sign = signbit(value) ? 1 : 0, n;
    double size = fabs(value), count = round(1000 * size);

    text[0] = '-';
    if (size < WHOLE_MAX && size == floor(size)) {
        return sign + digits_unsigned(text + sign, (uint64_t)size);
    }
    if (size >= 0.001 && size < WHOLE_MAX / 1000 && count / 1000 == size) {
        n = sign + put_thousandths(text + sign, (uint64_t)count);
        while (text[n - 1] == '0') {
            n--;
        }
        text[n] = '\0';
        return n;
    }
    return (size_t)snprintf(text, DIGITS_MAX, "%.15g", value);
}
