/*
 * permutation_test.h - p-values by permutation in result documents: each with whether it is the
 * smallest that the test could give and what is left open by drawing relabellings at random.
 */
#ifndef SRNFD_TOOLKIT_PERMUTATION_TEST_H
#define SRNFD_TOOLKIT_PERMUTATION_TEST_H

#include <jansson.h>

#include "srnf.h"

/* Sets name, nameIsFloor and nameInterval of an object; null all three where the test had no
   permutations. */
void permutation_set_p(json_t *object, const char *name, double p,
                       const struct srnf_permutation_test *test);
/* Sets permutations (that were taken), relabellings (that there are) and exact (all were taken). */
void permutation_set_test(json_t *object, const struct srnf_permutation_test *test);
/* The warning p-floor, where no outcome can be significant at PERMUTATION_LEVEL. opening: which p,
   as "pValue cannot be". */
void permutation_warn(json_t *warnings, const struct srnf_permutation_test *test,
                      const char *opening);
#define PERMUTATION_LEVEL 0.05

#endif
