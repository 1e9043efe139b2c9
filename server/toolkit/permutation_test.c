/*
 * permutation_test.c - p-values by permutation in result documents.
 *
 * A p at the floor says only that it is not above: the interval beside it, and more permutations,
 * say more. Where all relabellings were taken nothing is left open, and the interval is the point.
 */
#include "toolkit/permutation_test.h"

#include <math.h>
#include <stdio.h>

#include "toolkit/process.h"
#include "api/warnings.h"

#define NAME_MAX_BYTES 64

void permutation_set_p(json_t *object, const char *name, double p,
                       const struct srnf_permutation_test *test)
{
    char text[NAME_MAX_BYTES];
    double interval[2];

    (void)json_object_set_new(object, name, test->permutations ? json_finite(p) : json_null());
    (void)snprintf(text, sizeof text, "%sIsFloor", name);
    (void)json_object_set_new(object, text,
                              test->permutations ? json_boolean(srnf_permutation_at_floor(test, p))
                                                 : json_null());
    (void)snprintf(text, sizeof text, "%sInterval", name);
    srnf_permutation_interval(test, p, interval);
    (void)json_object_set_new(object, text,
                              test->permutations ? json_pack("[f, f]", interval[0], interval[1])
                                                 : json_null());
}

void permutation_set_test(json_t *object, const struct srnf_permutation_test *test)
{
    bool taken = test->permutations > 0;

    (void)json_object_set_new(object, "permutations", json_integer((json_int_t)test->permutations));
    (void)json_object_set_new(object, "relabellings",
                              taken ? json_finite(test->relabellings) : json_null());
    (void)json_object_set_new(object, "exact", taken ? json_boolean(test->exact) : json_null());
}

void permutation_warn(json_t *warnings, const struct srnf_permutation_test *test,
                      const char *opening)
{
    json_t *figures;

    if (!test->permutations || !(test->least > PERMUTATION_LEVEL)) {
        return;
    }
    figures =
        json_pack("{s:f, s:I, s:o}", "leastP", test->least, "permutations",
                  (json_int_t)test->permutations, "relabellings", json_finite(test->relabellings));
    if (test->exact) {
        warning_add(warnings, "p-floor", figures,
                    "%s below %.3g: of the %.0f different relabellings of the subjects %.0f always "
                    "give what was observed. A difference cannot be significant at %.2f, whatever "
                    "its size; take more subjects.",
                    opening, test->least, test->relabellings,
                    round(test->least * test->relabellings), PERMUTATION_LEVEL);
    } else {
        warning_add(warnings, "p-floor", figures,
                    "%s below %.3g, since %zu permutations were asked for. A difference cannot be "
                    "significant at %.2f, whatever its size; ask for more permutations.",
                    opening, test->least, test->permutations, PERMUTATION_LEVEL);
    }
}
