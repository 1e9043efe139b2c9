/*
 * outliers.c - see outliers.h.
 *
 * A value x is judged by z = |x - median| / (1.4826 MAD), MAD the median of |x - median|, whose
 * factor makes it a standard deviation of normal values (Iglewicz and Hoaglin, "How to detect and
 * handle outliers", 1993, who tell of 3.5 and more; a covariate may well be skewed).
 */
#include "toolkit/outliers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/alike.h"
#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/codes.h"
#include "toolkit/dates.h"
#include "toolkit/names.h"

#define DEVIATIONS_FAR 10.0
#define MEMBERS_MIN 5

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

double sorted_median(size_t n, double *values)
{
    qsort(values, n, sizeof *values, compare_doubles);
    return n ? 0.5 * (values[(n - 1) / 2] + values[n / 2]) : 0.0;
}

/* A member in words, within a sentence. */
static void name_member(struct jobs_run *run, const json_t *cohort, size_t i, char who[GROUP_WHO])
{
    group_who(run, json_object_get(cohort, "surfaces"), json_object_get(cohort, "subjects"), i,
              who);
    who[0] = 'm';
}

/* Whether the covariate has a code for what is missing, and warns of it. scratch: [n]. */
static bool warn_code(struct jobs_run *run, const json_t *cohort, const char *name, size_t n,
                      const double *values, double *scratch, json_t *document)
{
    struct code code;
    char who[GROUP_WHO];

    if (!code_find(n, values, scratch, &code)) {
        return false;
    }
    name_member(run, cohort, code.first, who);
    warning_add(warnings_of(document), "covariate-far",
                json_pack("{s:s, s:I, s:f, s:I, s:b, s:f, s:f}", "covariate", name, "member",
                          (json_int_t)code.first, "value", code.value, "members",
                          (json_int_t)code.members, "code", 1, "lowest", code.lowest, "highest",
                          code.highest),
                "%.60s is %.6g in %zu of %zu members, %s first, where the others "
                "have %.6g to %.6g. Is it a code for what is missing? Here it counts as a number, "
                "and may decide coefficients, p-values and accuracies: leave these members out, or "
                "give them what was measured.",
                name, code.value, code.members, n, who, code.lowest, code.highest);
    return true;
}

/* values: [n], and as many of scratch. */
static void judge(struct jobs_run *run, const json_t *cohort, const char *name, size_t n,
                  double *values, json_t *document)
{
    double *sorted = values + n;
    double middle, deviation, most = 0.0;
    size_t far = 0, worst = 0;
    char who[GROUP_WHO];

    if (dates_warn(name, n, values, warnings_of(document)) ||
        warn_code(run, cohort, name, n, values, sorted, document)) {
        return;
    }
    memcpy(sorted, values, n * sizeof *sorted);
    middle = sorted_median(n, sorted);
    for (size_t i = 0; i < n; i++) {
        sorted[i] = fabs(values[i] - middle);
    }
    deviation = NORMAL_MAD * sorted_median(n, sorted);
    for (size_t i = 0; i < n && deviation > 0.0; i++) {
        double z = fabs(values[i] - middle) / deviation;

        far += z >= DEVIATIONS_FAR;
        worst = z > most ? i : worst;
        most = fmax(most, z);
    }
    if (far > 0) {
        name_member(run, cohort, worst, who);
        warning_add(
            warnings_of(document), "covariate-far",
            json_pack("{s:s, s:I, s:f, s:f, s:f, s:I, s:b}", "covariate", name, "member",
                      (json_int_t)worst, "value", values[worst], "median", middle,
                      "standardDeviations", most, "members", (json_int_t)far, "code", 0),
            "%.60s is %.6g in %s, %.3g standard deviations from the median %.6g of "
            "all. Is it a code for what is missing, in another unit, or a slip? One such value may "
            "decide coefficients, p-values and accuracies: correct it, or leave the member out.",
            name, values[worst], who, most, middle);
    }
}

bool outliers_read(const json_t *table, bool rows, size_t c, size_t n, double *values)
{
    for (size_t i = 0; i < n; i++) {
        const json_t *one = rows ? json_array_get(json_array_get(table, i), c)
                                 : json_array_get(json_array_get(table, c), i);

        values[i] = json_is_boolean(one) ? (double)json_is_true(one) : json_number_value(one);
        if (!(json_is_number(one) || json_is_boolean(one)) || !isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

static void judge_all(struct jobs_run *run, const json_t *cohort, const json_t *names,
                      const json_t *table, bool rows, json_t *document)
{
    size_t count = json_array_size(names), first = json_array_size(json_array_get(table, 0));
    size_t n = rows ? json_array_size(table) : first;
    double *values = n >= MEMBERS_MIN ? srnf_alloc(n, 2 * sizeof *values) : NULL;

    if (n >= MEMBERS_MIN && !values) {
        json_memory_fail(); /* a warning may be missing */
    }
    for (size_t c = 0; c < count && values; c++) {
        const json_t *one = json_array_get(names, c);
        const char *name =
            json_string_value(json_is_object(one) ? json_object_get(one, "name") : one);

        /* Products and levels follow from the columns that they are made of. */
        if (name && !strpbrk(name, ":[") && outliers_read(table, rows, c, n, values)) {
            judge(run, cohort, name, n, values, document);
        }
    }
    srnf_free(values);
}

void outliers_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    const json_t *values = json_object_get(cohort, "values"); /* where members are classified */

    if (json_is_object(cohort)) {
        judge_all(run, cohort, json_object_get(inputs, "covariates"),
                  values ? values : json_object_get(cohort, "covariates"), false, document);
    }
}

/* Levels that are all numbers with a unit, or all written as numbers or dates are. */
static void warn_levels(const char *name, const char *unit, const char *written,
                        const json_t *figures, json_t *document)
{
    char quoted[400];

    alike_quote(json_object_get(figures, "cells"), quoted, sizeof quoted);
    if (unit) {
        warning_add(warnings_of(document), "column-is-text", json_deep_copy(figures),
                    "\"%.60s\" is taken as levels: it is text in the cohort, numbers with the unit "
                    "\"%.20s\": %s. Give numbers alone for it to count as a number, or write "
                    "C(%.60s) where levels are meant.",
                    name ? name : "", unit, quoted, name ? name : "");
        return;
    }
    warning_add(warnings_of(document), "column-is-text", json_deep_copy(figures),
                "\"%.60s\" is taken as levels: it is text in the cohort. %s are %s for it to count "
                "as one, or write C(%.60s) where levels are meant.",
                name ? name : "", quoted, alike_written_advice(written), name ? name : "");
}

/* mixed: of a design. */
static void warn_mixed(const json_t *mixed, json_t *document)
{
    const json_t *one;
    size_t i;

    json_array_foreach(mixed, i, one)
    {
        const char *name = json_string_value(json_object_get(one, "column"));
        json_int_t numbers = json_integer_value(json_object_get(one, "numbers"));
        json_int_t others = json_integer_value(json_object_get(one, "others"));
        const char *unit = json_string_value(json_object_get(one, "unit"));
        const char *written = json_string_value(json_object_get(one, "written"));

        if (unit || written) {
            warn_levels(name, unit, written, one, document);
            continue;
        }
        warning_add(warnings_of(document), "column-is-text", json_deep_copy(one),
                    "\"%.60s\" is taken as levels: it is text in the cohort, since it is no number "
                    "in %lld members, \"%.60s\" first, and one in the other %lld. Correct it in "
                    "the cohort, or leave members out of whom it is not known, for it to count as "
                    "a number.",
                    name ? name : "", (long long)others,
                    json_string_value(json_object_get(one, "cell")), (long long)numbers);
    }
}

void outliers_warn_design(struct jobs_run *run, const json_t *cohort, json_t *document)
{
    const json_t *design = json_object_get(cohort, "design"), *one;
    size_t i;

    judge_all(run, cohort, json_object_get(design, "columns"), json_object_get(design, "rows"),
              true, document);
    warn_mixed(json_object_get(design, "mixed"), document);
    json_array_foreach(json_object_get(design, "alike"), i, one)
    {
        alike_warn(warnings_of(document), json_string_value(json_object_get(one, "of")),
                   json_object_get(one, "found"));
    }
    json_array_foreach(json_object_get(design, "missing"), i, one)
    {
        alike_warn_missing(warnings_of(document), json_string_value(json_object_get(one, "of")),
                           json_object_get(one, "found"));
    }
}
