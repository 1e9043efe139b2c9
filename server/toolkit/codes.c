/*
 * codes.c - see codes.h.
 */
#include "toolkit/codes.h"

#include <math.h>

#include "toolkit/outliers.h"

#define OTHERS_MIN 3

static const double codes[] = {-9.0,    -77.0,   -88.0,    -99.0,    -777.0,   -888.0, -999.0,
                               -8888.0, -9999.0, 99.0,     777.0,    888.0,    999.0,  8888.0,
                               9999.0,  99999.0, 999999.0, -99999.0, -999999.0};
#define CODES (sizeof codes / sizeof codes[0])

static bool is_code(double value)
{
    for (size_t k = 0; k < CODES; k++) {
        if (!(value < codes[k]) && !(value > codes[k])) {
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

/* How the values that are no codes lie; how many they are. */
static size_t describe(size_t n, const double *values, double *scratch, struct code *code,
                       double *scatter)
{
    size_t count = 0;
    double middle;

    for (size_t i = 0; i < n; i++) {
        if (!is_code(values[i])) {
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

bool code_find(size_t n, const double *values, double *scratch, struct code *found)
{
    struct code code;
    double scatter = 0.0;

    *found = (struct code){.members = 0};
    if (describe(n, values, scratch, &code, &scatter) < OTHERS_MIN) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        code.value = values[i];
        code.members = 0;
        code.first = i;
        if (!is_code(values[i]) || !is_apart(&code, scatter)) {
            continue;
        }
        for (size_t k = 0; k < n; k++) {
            code.members += !(values[k] < code.value) && !(values[k] > code.value);
        }
        *found = code.members > found->members ? code : *found;
    }
    return found->members > 0;
}
