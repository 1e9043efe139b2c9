/*
 * codes.c - see codes.h.
 */
#include "toolkit/codes.h"

#include <math.h>
#include <stdlib.h>

#include "toolkit/outliers.h"

#define OTHERS_MIN 3
#define TORN_MIN 10         /* others that are enough to see how they lie */
#define DEVIATIONS_TORN 3.5 /* Iglewicz and Hoaglin's (outliers.c) */

static const double codes[] = {-9.0,    -77.0,   -88.0,    -99.0,    -777.0,   -888.0, -999.0,
                               -8888.0, -9999.0, 99.0,     777.0,    888.0,    999.0,  8888.0,
                               9999.0,  99999.0, 999999.0, -99999.0, -999999.0};
#define CODES (sizeof codes / sizeof codes[0])

/* What is also measured or counted, and what spreadsheets make of empty cells: one of these is a
   code only where few have it, and where the others lie far above it. */
static const double soft_codes[] = {0.0, -1.0};
#define SOFT_CODES (sizeof soft_codes / sizeof soft_codes[0])
#define SOFT_SHARE 5 /* at most one of so many members has it */

static bool is_same(double a, double b)
{
    return !(a < b) && !(a > b);
}

static bool is_code(double value)
{
    for (size_t k = 0; k < CODES; k++) {
        if (is_same(value, codes[k])) {
            return true;
        }
    }
    return false;
}

/* Whether the value is too far from others that lie from lowest to highest, and scatter so much. */
static bool is_apart(const struct code *code, double scatter)
{
    double span = code->highest - code->lowest;

    if (code->value < 0.0 && code->lowest >= 0.0) {
        return code->lowest - code->value > scatter;
    }
    return code->value < code->lowest ? code->lowest - code->value > span
                                      : code->value - code->highest > span;
}

/* Whether it is below 0 where many others are not. */
static bool is_only_negative(size_t n, const struct code *code)
{
    return code->value < 0.0 && code->lowest >= 0.0 && n - code->members >= TORN_MIN;
}

/* How the values that are no codes, and are not the value of this one, lie; how many they are. */
static size_t describe(size_t n, const double *values, double *scratch, struct code *code,
                       double *scatter)
{
    size_t count = 0;
    double middle;

    for (size_t i = 0; i < n; i++) {
        if (!is_code(values[i]) && !is_same(values[i], code->value)) {
            scratch[count++] = values[i];
        }
    }
    if (count < OTHERS_MIN) {
        return count;
    }
    middle = sorted_median(count, scratch);
    code->lowest = scratch[0];
    code->highest = scratch[count - 1];
    for (size_t i = 0; i < count; i++) {
        scratch[i] = fabs(scratch[i] - middle);
    }
    *scatter = NORMAL_MAD * sorted_median(count, scratch);
    return count;
}

static void count_members(size_t n, const double *values, struct code *code)
{
    code->members = 0;
    for (size_t i = n; i-- > 0;) {
        if (is_same(values[i], code->value)) {
            code->members++;
            code->first = i;
        }
    }
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* Whether others are no continuation down to the value, which lies below: it is further from them
   than neighbours of their lower half are from each other, and too far from the middle. Leaves the
   others in scratch. */
static bool is_torn_off(size_t n, const double *values, double scatter, const struct code *code,
                        double *scratch)
{
    size_t count = 0;
    double gap = 0.0;

    for (size_t i = 0; i < n; i++) {
        if (!is_code(values[i]) && !is_same(values[i], code->value)) {
            scratch[count++] = values[i];
        }
    }
    qsort(scratch, count, sizeof *scratch, compare);
    for (size_t i = 1; i <= count / 2; i++) {
        gap = fmax(gap, scratch[i] - scratch[i - 1]);
    }
    return count >= TORN_MIN && code->lowest > 0.0 && scatter > 0.0 &&
           code->lowest - code->value > 2.0 * gap &&
           scratch[count / 2] - code->value > DEVIATIONS_TORN * scatter;
}

/* Whether two or more have the value, and no two of the others have one. */
static bool is_repeated_alone(size_t n, const double *values, const struct code *code,
                              double *scratch)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        if (!is_same(values[i], code->value)) {
            scratch[count++] = values[i];
        }
    }
    qsort(scratch, count, sizeof *scratch, compare);
    for (size_t i = 1; i < count; i++) {
        if (is_same(scratch[i], scratch[i - 1])) {
            return false;
        }
    }
    return code->members >= 2 && count >= TORN_MIN;
}

/* The soft code that most have, where there is one. */
static void find_soft(size_t n, const double *values, double *scratch, struct code *found)
{
    for (size_t k = 0; k < SOFT_CODES; k++) {
        struct code code = {.value = soft_codes[k]};
        double scatter = 0.0, span;

        count_members(n, values, &code);
        if (code.members <= found->members || code.members * SOFT_SHARE > n ||
            describe(n, values, scratch, &code, &scatter) < OTHERS_MIN) {
            continue;
        }
        span = code.highest - code.lowest;
        if (span > 0.0 &&
            (code.lowest - code.value > span || is_torn_off(n, values, scatter, &code, scratch))) {
            *found = code;
        }
    }
}

bool code_find(size_t n, const double *values, double *scratch, struct code *found)
{
    struct code code = {.value = codes[0]};
    double scatter = 0.0;

    *found = (struct code){.members = 0};
    if (describe(n, values, scratch, &code, &scatter) < OTHERS_MIN) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        code.value = values[i];
        if (!is_code(values[i])) {
            continue;
        }
        count_members(n, values, &code);
        if (code.first < i) {
            continue;
        }
        if (is_apart(&code, scatter) || is_only_negative(n, &code) ||
            is_repeated_alone(n, values, &code, scratch)) {
            *found = code.members > found->members ? code : *found;
        }
    }
    if (found->members == 0) {
        find_soft(n, values, scratch, found);
    }
    return found->members > 0;
}
