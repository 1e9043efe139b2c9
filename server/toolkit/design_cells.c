/*
 * design_cells.c - columns that cannot be fitted: those that say nothing beside the others, as
 * where no member has two levels together, and those whose numbers are out of proportion.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/covariates.h"
#include "toolkit/design_columns.h"

#define CELL_TEXT 400

/* ---- Levels that no member has together ------------------------------------------------------ */

static bool is_of_cell(const struct design_build *build, size_t term, size_t f)
{
    return design_has_factor(build->formula, term, f) && build->factor[f].categorical;
}

static bool has_member(const struct design_build *build, size_t term, const size_t *level)
{
    for (size_t i = 0; i < build->n; i++) {
        bool same = true;

        for (size_t f = 0; f < build->formula->factors; f++) {
            same = same &&
                   (!is_of_cell(build, term, f) || (size_t)build->factor[f].value[i] == level[f]);
        }
        if (same) {
            return true;
        }
    }
    return false;
}

/* The next cell of a term; false after the last. */
static bool next_cell(const struct design_build *build, size_t term, size_t *level)
{
    for (size_t f = 0; f < build->formula->factors; f++) {
        if (is_of_cell(build, term, f)) {
            if (++level[f] < json_array_size(build->factor[f].levels)) {
                return true;
            }
            level[f] = 0;
        }
    }
    return false;
}

static void write_cell(const struct design_build *build, size_t term, const size_t *level,
                       char text[CELL_TEXT])
{
    size_t used = 0;

    text[0] = '\0';
    for (size_t f = 0; f < build->formula->factors && used < CELL_TEXT; f++) {
        if (is_of_cell(build, term, f)) {
            int written =
                snprintf(text + used, CELL_TEXT - used, "%s%.60s \"%.60s\"", used ? " and " : "",
                         build->formula->factor[f].name,
                         json_string_value(json_array_get(build->factor[f].levels, level[f])));

            used += written > 0 ? (size_t)written : 0;
        }
    }
}

bool design_refuse_cell(const struct design_build *build, size_t term)
{
    size_t level[FORMULA_FACTORS_MAX] = {0}, factors = 0;
    char cell[CELL_TEXT], name[DESIGN_TERM_MAX];

    for (size_t f = 0; f < build->formula->factors; f++) {
        factors += is_of_cell(build, term, f);
    }
    if (factors < 2) {
        return false;
    }
    do {
        if (!has_member(build, term, level)) {
            write_cell(build, term, level, cell);
            formula_term_name(build->formula, term, sizeof name, name);
            problem_add(build->given->list, DESIGN_POINTER,
                        "no member has %s together, so that %.120s cannot be fitted: leave this "
                        "interaction out (a + b), or join levels in the cohort",
                        cell, name);
            return true;
        }
    } while (next_cell(build, term, level));
    return false;
}

/* ---- Single columns -------------------------------------------------------------------------- */

void design_refuse_column(const struct design_build *build, const char *name,
                          enum srnf_covariate verdict, const double *values, size_t subjects)
{
    const char *whom = subjects < build->n ? "subjects" : "members";
    const char *averaged = subjects < build->n ? " once the members of each are averaged" : "";
    double least = values[0], most = values[0];

    for (size_t i = 1; i < subjects; i++) {
        least = fmin(least, values[i]);
        most = fmax(most, values[i]);
    }
    if (verdict != SRNF_COVARIATE_CONSTANT) {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the column %.120s follows from the constant and the columns before it%s: "
                    "leave its term out, or write an interaction with all it is made of (a * b)",
                    name, averaged);
    } else if (most > least) {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the column %.120s hardly differs between %s%s, from %.17g to %.17g: take the "
                    "covariate less its mean, center(x), or leave the term out",
                    name, whom, averaged, least, most);
    } else {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the column %.120s is the same for all %s%s: leave its term out", name, whom,
                    averaged);
    }
}

bool design_refuse_numbers(const struct design_build *build, const char *name, const double *values,
                           size_t subjects)
{
    double spread = covariate_spread(subjects, values);

    if (strcmp(name, "Intercept") == 0) {
        problem_add(build->given->list, DESIGN_POINTER,
                    "has a column \"Intercept\", which is the name of the constant: give the "
                    "covariate another name in the cohort");
        return true;
    }
    if (!covariate_spread_takes(spread)) {
        problem_add(
            build->given->list, DESIGN_POINTER,
            "the numbers of the column %.120s differ by %.3g at most, and " COVARIATE_SPREAD, name,
            spread);
        return true;
    }
    return false;
}
