/*
 * report_facts.c - what the inputs and the results of a job say that was done, as sentences of its
 * paragraph on methods.
 *
 * Nothing is told by defaults: where a result counts what was done, that is told, and not what was
 * asked for.
 */
#include "processes/report.h"

#include <string.h>

/* Options that a reader looks for, as sentences. */
static const struct told {
    const char *name, *before, *after;
} told[] = {
    {"formula", " The formula was ", "."},
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

/* ---- Numbers beside shape -------------------------------------------------------------------- */

static bool chose(const json_t *given, const char *name, const char *value)
{
    const char *text = json_string_value(json_object_get(given, name));

    return text && strcmp(text, value) == 0;
}

/* Covariates by what was done with them, and sizes. */
static void put_numbers(FILE *out, const json_t *results)
{
    const json_t *given = json_object_get(results, "inputs");
    const json_t *features = json_object_get(results, "features");
    const json_t *removed = json_object_get(results, "regressedOut");
    const json_t *covariates = json_object_get(given, "covariates");

    if (json_is_array(features)) {
        (void)fputs(json_array_size(features) ? " Beside shape these numbers counted: "
                                              : " Shape alone counted, without size",
                    out);
        put_list(out, features);
        (void)fputs(".", out);
    } else if (json_array_size(removed) > 0) {
        (void)fputs(" Regressed out were ", out);
        put_list(out, removed);
        (void)fputs(": what the model without groups leaves was permuted (Freedman and Lane).",
                    out);
    } else if (json_array_size(covariates) > 0) {
        (void)fputs(" Covariates were ", out);
        put_list(out, covariates);
        (void)fputs(".", out);
    }
    if (chose(given, "priors", "cohort")) {
        (void)fputs(" Priors of the classes were their shares among the subjects.", out);
    } else if (chose(given, "priors", "equal")) {
        (void)fputs(" Priors of the classes were equal.", out);
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

/* ---- Classifiers ----------------------------------------------------------------------------- */

static const struct method {
    const char *name, *words;
} methods[] = {
    {"srnf-gauss", "normal distributions on principal components of square-root normal fields"},
    {"srnf-nn", "nearest neighbour by square-root normal fields"},
    {"srm-gauss", "normal distributions on principal components of square-root maps"},
    {"srm-nn", "nearest neighbour by square-root maps"},
    {"harmonic-nn", "nearest neighbour by surfaces as parameterized"},
    {"icp-nn", "nearest neighbour by closest points"},
    {"spharm-pdm", "nearest neighbour by points that the first-order ellipsoids make correspond"},
};

static void put_method(FILE *out, const char *name)
{
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
        if (strcmp(methods[m].name, name) == 0) {
            (void)fprintf(out, " The method %s was %s", name, methods[m].words);
            return;
        }
    }
    (void)fputs(" The method was ", out);
    report_text(out, name);
}

/* As a list in a sentence: "template: the medoid" as "template (the medoid)". */
static void put_things(FILE *out, const json_t *things)
{
    const json_t *one;
    size_t k;

    json_array_foreach(things, k, one)
    {
        const char *text = json_string_value(one), *more = text ? strstr(text, ": ") : NULL;
        char first[64];

        (void)fputs(k ? "; " : "", out);
        (void)snprintf(first, sizeof first, "%.*s", more ? (int)(more - text) : 0,
                       text ? text : "");
        report_text(out, more ? first : (text ? text : ""));
        if (more) {
            (void)fputs(" (", out);
            report_text(out, more + 2);
            (void)fputs(")", out);
        }
    }
}

/* What each fold made anew, and what was made once for all of them. */
static void put_refitted(FILE *out, const json_t *method)
{
    const json_t *refitted = json_object_get(method, "refitted");
    const json_t *shared = json_object_get(method, "shared");

    if (json_array_size(refitted) > 0) {
        (void)fputs("; made anew in each fold, without the subject that was left out: ", out);
        put_things(out, refitted);
    }
    if (json_array_size(shared) > 0) {
        (void)fputs("; made once for all folds, of all subjects: ", out);
        put_things(out, shared);
    }
    if (json_is_array(refitted) && json_array_size(refitted) == 0) {
        (void)fputs("; nothing was made anew in a fold", out);
    }
}

static void put_methods(FILE *out, const json_t *results)
{
    json_t *all = json_object_get(results, "methods"), *one;
    const char *name =
        json_string_value(json_object_get(json_object_get(results, "inputs"), "method"));

    if (name && json_is_array(json_object_get(results, "refitted"))) {
        put_method(out, name);
        put_refitted(out, results);
        (void)fputs(".", out);
    }
    json_object_foreach(all, name, one)
    {
        put_method(out, name);
        put_refitted(out, one);
        (void)fputs(".", out);
    }
}

/* ---- Paths ----------------------------------------------------------------------------------- */

static const struct path {
    const char *name, *words;
} paths[] = {
    {"srnf", "the straight line between their square-root normal fields (SRNFs), each point of "
             "which was inverted numerically"},
    {"closed-form", "the straight line between their square-root normal fields (SRNFs), each point "
                    "of which was inverted by the formula for star-shaped surfaces"},
    {"linear", "the straight line between the surfaces themselves"},
    {"pullback", "the geodesic in the space of surfaces, by the metric that square-root normal "
                 "fields (SRNFs) pull back to it"},
};

static void put_path(FILE *out, const json_t *results)
{
    for (size_t p = 0; json_object_get(results, "times") && p < sizeof paths / sizeof paths[0];
         p++) {
        if (chose(json_object_get(results, "inputs"), "method", paths[p].name)) {
            (void)fprintf(out, " It is %s.", paths[p].words);
        }
    }
}

/* ---- Registrations and means ----------------------------------------------------------------- */

static const struct measure {
    const char *name, *words;
    bool warps;
} metrics[] = {
    {"srnf", "the L2 distance of their square-root normal fields (SRNFs)", true},
    {"srm", "the L2 distance of their square-root maps", true},
    {"harmonic", "the L2 distance of the surfaces as parameterized, after a rotation", false},
    {"icp", "the root mean square distance of closest points, after rigid alignment", false},
};

/* NULL: of a process without the choice. */
static const struct measure *metric_of(const json_t *results)
{
    for (size_t m = 0; m < sizeof metrics / sizeof metrics[0]; m++) {
        if (chose(json_object_get(results, "inputs"), "metric", metrics[m].name)) {
            return &metrics[m];
        }
    }
    return NULL;
}

/* Whether one of the methods, if there are some, has a name that begins so. */
static bool has_method(const json_t *results, const char *start)
{
    json_t *all = json_object_get(results, "methods"), *one;
    const char *name;

    json_object_foreach(all, name, one)
    {
        if (strncmp(name, start, strlen(start)) == 0) {
            return true;
        }
    }
    return !json_is_object(all);
}

bool report_uses_srnfs(const json_t *results)
{
    const struct measure *metric = metric_of(results);

    return (!metric || metric == &metrics[0]) && has_method(results, "srnf-");
}

bool report_warps(const json_t *results)
{
    const struct measure *metric = metric_of(results);

    return (!metric || metric->warps) && has_method(results, "sr");
}

/* Whether the mean came to rest, which makes a Karcher mean of it. */
static void put_mean(FILE *out, const json_t *results)
{
    const json_t *pullback = json_object_get(results, "pullback");
    const json_t *last = json_is_object(pullback) ? pullback : results;
    const json_t *converged = json_object_get(results, "converged");
    json_int_t n = json_integer_value(json_object_get(last, "iterations"));

    if (json_is_object(pullback)) {
        (void)fputs(" From there the mean by the elastic metric that SRNFs pull back to surfaces "
                    "was sought.",
                    out);
    }
    if (json_is_boolean(converged) && n > 0) {
        (void)fprintf(out,
                      json_is_true(converged)
                          ? " The mean, a Karcher mean, came to rest in %lld iteration%s."
                          : " The mean is where it was stopped, after %lld iteration%s, before it "
                            "came to rest.",
                      (long long)n, n == 1 ? "" : "s");
    }
}

/* Of the surfaces of a subject, whether their sizes counted. */
static void put_scale(FILE *out, const json_t *results)
{
    const json_t *given = json_object_get(results, "inputs");

    if (!json_object_get(results, "individual") && !json_object_get(results, "slope")) {
        return;
    }
    if (chose(given, "scale", "shape")) {
        (void)fputs(" Size was taken out: the surfaces of each subject were brought to one area, "
                    "at their mean size.",
                    out);
    } else if (chose(given, "scale", "shape-and-size")) {
        (void)fputs(" Surfaces were as large as they are, so that size counts.", out);
    }
}

static void put_registration(FILE *out, const json_t *results)
{
    const json_t *given = json_object_get(results, "inputs");
    const struct measure *metric = metric_of(results);

    if (metric) {
        (void)fprintf(out, " Distances were %s.", metric->words);
    }
    if (json_is_true(json_object_get(given, "commonPose")) && report_warps(results) &&
        !json_is_false(json_object_get(given, "register"))) {
        (void)fputs(" Registrations rotated nothing, as for shapes that share a pose.", out);
    }
    put_mean(out, results);
}

/* Tests whose level holds in the limit of many subjects alone: of the result, or of some terms. */
static void put_level(FILE *out, const json_t *results)
{
    const char *asymptotic = "asymptotic", *before = " The level is asymptotic of the test of ";
    const json_t *terms = json_object_get(results, "terms"), *term;
    bool some = false;
    size_t k;

    if (chose(results, "level", asymptotic)) {
        (void)fputs(" The level of the test is asymptotic: it holds in the limit of many subjects.",
                    out);
    }
    json_array_foreach(terms, k, term)
    {
        if (chose(term, "level", asymptotic)) {
            (void)fputs(some ? ", " : before, out);
            report_scalar(out, json_object_get(term, "name"));
            some = true;
        }
    }
    (void)fputs(some ? ": it holds in the limit of many subjects." : "", out);
}

void report_facts(FILE *out, const json_t *results)
{
    put_told(out, json_object_get(results, "inputs"));
    put_path(out, results);
    put_registration(out, results);
    put_scale(out, results);
    put_numbers(out, results);
    put_methods(out, results);
    put_tests(out, results);
    put_level(out, results);
}
