/*
 * codes.h - numbers in a covariate that stand for what is missing, as -9 and 999 do.
 */
#ifndef SRNFD_TOOLKIT_CODES_H
#define SRNFD_TOOLKIT_CODES_H

#include <stdbool.h>
#include <stddef.h>

struct code {
    double value;
    size_t members, first;  /* that have it, and the first of them */
    double lowest, highest; /* of those that have no code */
};

/*
 * Looks for the code that most of n values have. One is a code where it is a number that people
 * write for what is missing, three values or more are no such numbers, and it lies further from
 * them than they lie from each other. A negative one among others that are not has to be below
 * them only by what they scatter (1.4826 median deviations), or among ten others by nothing. Among
 * ten others that all differ, two are enough wherever they lie. 0 and -1 are codes where a fifth of
 * the values at most have it, and the others differ and lie further above it than from each other,
 * or, ten or more, twice as far as any two neighbours of their lower half are apart, and 3.5
 * standard deviations in the middle.
 * False: there is none.
 *   scratch  [n]
 */
bool code_find(size_t n, const double *values, double *scratch, struct code *found);

#endif
