/*
 * report_facts.c - what the inputs and the results of a job say that was done, as sentences of its
 * paragraph on methods.
 *
 * Nothing is told by defaults: where a result counts what was done, that is told, and not what was
 * asked for.
 */
#include "processes/report.h"

/* Options that a reader looks for, as sentences. */
static const struct told {
    const char *name, *before, *after;
} told[] = {
    {"formula", " The formula was ", "."},
    {"covariates", " Covariates were ", "."},
    {"lmax", " Shapes were described by spherical harmonics up to degree ", "."},
    {"bootstraps", " There were ", " bootstrap samples."},
};

static void put_list(FILE *out, const json_t *list)
{
    const json_t *one;
    size_t k;

    json_array_foreach(list, k, one)
    {
        (void)fputs(k ? ", " : "", out);
        report_scalar(out, one);
    }
}

static void put_told(FILE *out, const json_t *given)
{
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++) {
        const json_t *value = json_object_get(given, told[i].name);

        if (!value || json_is_null(value) || json_is_object(value) ||
            (json_is_integer(value) && json_integer_value(value) == 0) ||
            (json_is_array(value) && json_array_size(value) == 0)) {
            continue;
        }
        (void)fputs(told[i].before, out);
        if (json_is_array(value)) {
            put_list(out, value);
        } else {
            report_scalar(out, value);
        }
        (void)fputs(told[i].after, out);
    }
}

/* ---- Tests ----------------------------------------------------------------------------------- */

/* How many a test took. Of those that exist the observed one is one, which permutations leaves
   out. */
static void put_test(FILE *out, const json_t *test, const char *drawn, const char *all,
                     const char *of)
{
    json_int_t n = json_integer_value(json_object_get(test, "permutations"));

    if (n > 0 && json_is_true(json_object_get(test, "exact"))) {
        (void)fprintf(out, " All %.0f %s%s were taken, the observed one among them.",
                      json_number_value(json_object_get(test, "relabellings")), all, of);
    } else if (n > 0) {
        (void)fprintf(out, " There were %lld %s%s.", (long long)n, drawn, of);
    }
}

static void put_tests(FILE *out, const json_t *results)
{
    const json_t *slope = json_object_get(results, "slope");
    const json_t *terms = json_object_get(results, "terms");
    const json_t *replicates = json_object_get(results, "replicates");
    const char *flips = "flips of signs";

    put_test(out, slope, flips, flips, " of slopes");
    if (json_object_get(results, "individual")) {
        put_test(out, results, flips, flips, "");
    } else if (!terms || json_array_size(terms) > 0) {
        put_test(out, results, "permutations", "different relabellings", slope ? " of terms" : "");
    }
    if (json_is_object(replicates)) {
        put_test(out, replicates, "permutations", "different permutations",
                 " of measurements within subjects");
    }
}

void report_facts(FILE *out, const json_t *results)
{
    put_told(out, json_object_get(results, "inputs"));
    put_tests(out, results);
}
