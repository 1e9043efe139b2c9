/*
 * spreads.c - see spreads.h. Permutations have one spread for all: where few subjects scatter
 * further p is too small for the means alone, and where many do, too large.
 */
#include "toolkit/spreads.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/process.h"

#define INFLATION 1.5 /* of a variance: p of .05 is then one of some .1 */

bool spreads_matter(double inflation)
{
    return !(inflation < INFLATION && inflation > 1.0 / INFLATION);
}

void spreads_warn(json_t *warnings, const struct spreads *spreads, json_t *figures)
{
    size_t groups = json_array_size(spreads->groups), wide = 0, narrow = 0;

    if (!spreads_matter(spreads->inflation)) {
        json_decref(figures);
        return;
    }
    for (size_t k = 1; k < groups; k++) {
        wide = spreads->spread[k] > spreads->spread[wide] ? k : wide;
        narrow = spreads->spread[k] < spreads->spread[narrow] ? k : narrow;
    }
    figures = figures ? figures : json_object();
    (void)json_object_set_new(figures, "spreads", json_vector(spreads->spread, groups));
    (void)json_object_set_new(figures, "subjects", json_deep_copy(spreads->subjects));
    (void)json_object_set_new(figures, "inflation", json_finite(spreads->inflation));
    warning_add(warnings, "spreads-differ", figures,
                "The %lld subjects of \"%.60s\" scatter %.2g times as far about their mean as the "
                "%lld of \"%.60s\". %.200s in any way: for their means alone pValue is too %s. "
                "%.60s for it%s.",
                (long long)json_integer_value(json_array_get(spreads->subjects, wide)),
                json_string_value(json_array_get(spreads->groups, wide)),
                spreads->spread[wide] / fmax(spreads->spread[narrow], DBL_MIN),
                (long long)json_integer_value(json_array_get(spreads->subjects, narrow)),
                json_string_value(json_array_get(spreads->groups, narrow)), spreads->test,
                spreads->inflation > 1.0 ? "small" : "large",
                spreads->intervals ? spreads->intervals : "Groups of one size allow",
                spreads->intervals ? ", as groups of one size do" : "");
}

/* ---- Terms ----------------------------------------------------------------------------------- */

struct levels {
    const json_t *names;
    json_t *sizes;
    size_t *of; /* [subjects] */
    double *spread;
};

/* A level has the column before it, in treatment coding; the first has none. */
static size_t level_of(const json_t *columns, const double *row)
{
    for (size_t k = 0; k < json_array_size(columns); k++) {
        if (row[json_integer_value(json_array_get(columns, k))] > 0.5) {
            return k + 1;
        }
    }
    return 0;
}

/* Subjects come in the order of their first members. */
static void read_levels(const json_t *columns, const struct srnf_regress_design *numbers, size_t n,
                        const size_t *subjects, struct levels *levels)
{
    size_t count[DESIGN_LEVELS_MAX] = {0};

    for (size_t i = 0, k = 0; i < n; i++) {
        if (!subjects || subjects[i] == i) {
            levels->of[k] = level_of(columns, numbers->values + i * numbers->columns);
            count[levels->of[k++]]++;
        }
    }
    for (size_t k = 0; k < json_array_size(levels->names); k++) {
        (void)json_array_append_new(levels->sizes, json_integer((json_int_t)count[k]));
    }
}

/* The test of a term, or of a pair of its levels, whose p is furthest off. */
static size_t worst_of(const json_t *tests, size_t term, const struct srnf_regression *found,
                       const struct levels *levels)
{
    size_t worst = term;
    double most = -1.0;

    for (size_t t = 0; t < found->tests; t++) {
        const json_t *test = json_array_get(tests, t), *of = json_object_get(test, "term");
        double off;

        if (!of || (size_t)json_integer_value(of) != term) {
            continue;
        }
        off = fabs(log(srnf_spreads(found->subjects, json_array_size(levels->names), levels->of,
                                    found->squares, found->rest, found->test_of[t].diagonal,
                                    levels->spread)));
        worst = off > most ? t : worst;
        most = fmax(most, off);
    }
    return worst;
}

static void warn_term(json_t *warnings, const json_t *design, size_t term,
                      const struct srnf_regression *found, const struct levels *levels)
{
    const json_t *tests = json_object_get(design, "tests");
    size_t worst = worst_of(tests, term, found, levels);
    const json_t *pair = json_object_get(json_array_get(tests, worst), "levels");
    const char *name = json_string_value(
        json_object_get(json_array_get(json_object_get(design, "terms"), term), "name"));
    char text[200];
    struct spreads spreads = {levels->names,
                              levels->sizes,
                              levels->spread,
                              srnf_spreads(found->subjects, json_array_size(levels->names),
                                           levels->of, found->squares, found->rest,
                                           found->test_of[worst].diagonal, levels->spread),
                              text,
                              "r2Interval and normInterval allow"};

    if (worst == term) {
        (void)snprintf(text, sizeof text, "The test of %.60s asks whether its levels differ", name);
    } else {
        (void)snprintf(text, sizeof text,
                       "The pair of \"%.60s\" and \"%.60s\" asks whether they "
                       "differ",
                       json_string_value(json_array_get(pair, 0)),
                       json_string_value(json_array_get(pair, 1)));
    }
    spreads_warn(warnings, &spreads,
                 json_pack("{s:s, s:O}", "term", name, "levels", levels->names));
}

void spreads_warn_terms(json_t *warnings, const json_t *design,
                        const struct srnf_regress_design *numbers, size_t n, const size_t *subjects,
                        const struct srnf_regression *found)
{
    const json_t *tests = json_object_get(design, "tests"), *test;
    size_t t;

    json_array_foreach(tests, t, test)
    {
        const char *kind = json_string_value(json_object_get(test, "kind"));
        struct levels levels = {.names = json_object_get(test, "levels")};

        if (!levels.names || strcmp(kind, "term") != 0) {
            continue;
        }
        levels.sizes = json_array();
        levels.of = srnf_alloc(found->subjects, sizeof *levels.of);
        levels.spread = srnf_alloc(DESIGN_LEVELS_MAX, sizeof(double));
        if (levels.of && levels.spread) {
            read_levels(json_object_get(test, "tested"), numbers, n, subjects, &levels);
            warn_term(warnings, design, t, found, &levels); /* terms come first */
        } else {
            json_memory_fail(); /* a warning may be missing */
        }
        srnf_free(levels.of);
        srnf_free(levels.spread);
        json_decref(levels.sizes);
    }
}
