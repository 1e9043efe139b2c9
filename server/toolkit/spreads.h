/*
 * spreads.h - groups whose subjects scatter unequally, which permutations do not allow for.
 */
#ifndef SRNFD_TOOLKIT_SPREADS_H
#define SRNFD_TOOLKIT_SPREADS_H

#include <jansson.h>
#include <stddef.h>

#include "toolkit/design.h"

struct spreads {
    const json_t *groups, *subjects; /* their names; how many are in each */
    const double *spread;            /* [groups], as of srnf_spreads */
    double inflation;                /* the same */
    const char *test;                /* "The test asks whether the two groups differ" */
    const char *intervals;           /* "distanceInterval allows"; NULL: none is known */
};
/* Whether a variance is so much larger or smaller than p takes it to be. */
bool spreads_matter(double inflation);
/* Warns (spreads-differ) where it is. figures: more of them, taken over, or NULL. */
void spreads_warn(json_t *warnings, const struct spreads *spreads, json_t *figures);
/*
 * The same of each categorical term of a linear model, by its own test or one of its pairs,
 * whichever is worst.
 *   design    [in] as design_describe makes it
 *   numbers   [in] those of it, of n members
 *   subjects  [in] [n] the first member of the subject of each, or NULL
 */
void spreads_warn_terms(json_t *warnings, const json_t *design,
                        const struct srnf_regress_design *numbers, size_t n, const size_t *subjects,
                        const struct srnf_regression *found);

#endif
