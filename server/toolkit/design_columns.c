/*
 * design_columns.c - see design_columns.h.
 */
#include "toolkit/design_columns.h"

#include <stdio.h>
#include <string.h>

#define COLUMN_NAME_MAX 256

bool design_has_factor(const struct formula *formula, size_t term, size_t factor)
{
    return formula->term[term] >> factor & 1;
}

/* Whether the model has the term without one of its factors; the constant it has. */
static bool has_margin(const struct formula *formula, size_t term, size_t factor)
{
    uint32_t margin = formula->term[term] & ~(UINT32_C(1) << factor);
    bool found = margin == 0;

    for (size_t t = 0; t < formula->terms; t++) {
        found = found || formula->term[t] == margin;
    }
    return found;
}

/* The next combination of levels of a term; false after the last. */
static bool next_levels(const struct design_build *build, size_t term, struct design_column *column)
{
    for (size_t f = 0; f < build->formula->factors; f++) {
        const struct design_factor *factor = &build->factor[f];

        if (!design_has_factor(build->formula, term, f) || !factor->categorical) {
            continue;
        }
        if (++column->level[f] < json_array_size(factor->levels)) {
            return true;
        }
        column->level[f] = has_margin(build->formula, term, f) ? 1 : 0;
    }
    return false;
}

bool design_columns_make(const struct design_build *build, struct design_columns *columns)
{
    columns->count = 0;
    for (size_t t = 0; t < build->formula->terms; t++) {
        struct design_column column = {.term = t};

        for (size_t f = 0; f < build->formula->factors; f++) {
            column.level[f] = has_margin(build->formula, t, f) ? 1 : 0;
        }
        do {
            if (columns->count == DESIGN_COLUMNS_MAX) {
                problem_add(build->given->list, DESIGN_POINTER,
                            "makes more than %d columns: take fewer levels or interactions",
                            DESIGN_COLUMNS_MAX);
                return false;
            }
            columns->column[columns->count++] = column;
        } while (next_levels(build, t, &column));
    }
    return true;
}

/* row: [factors] numbers and levels. */
static double column_value(const struct design_build *build, const struct design_column *column,
                           const double *row)
{
    double value = 1.0;

    for (size_t f = 0; f < build->formula->factors; f++) {
        if (design_has_factor(build->formula, column->term, f)) {
            value *= !build->factor[f].categorical        ? row[f]
                     : (size_t)row[f] == column->level[f] ? 1.0
                                                          : 0.0;
        }
    }
    return value;
}

json_t *design_columns_row(const struct design_build *build, const struct design_columns *columns,
                           const double *row)
{
    json_t *values = json_array();

    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(values,
                                    json_real(column_value(build, &columns->column[c], row)));
    }
    return values;
}

json_t *design_column_name(const struct design_build *build, const struct design_column *column)
{
    char name[COLUMN_NAME_MAX];
    size_t used = 0;

    name[0] = '\0';
    for (size_t f = 0; f < build->formula->factors && used < sizeof name; f++) {
        const struct design_factor *factor = &build->factor[f];
        int written = 0;

        if (design_has_factor(build->formula, column->term, f) && factor->categorical) {
            written = snprintf(name + used, sizeof name - used, "%s%s[%s%s]", used ? ":" : "",
                               factor->source->text,
                               has_margin(build->formula, column->term, f) ? "T." : "",
                               json_string_value(json_array_get(factor->levels, column->level[f])));
        } else if (design_has_factor(build->formula, column->term, f)) {
            written = snprintf(name + used, sizeof name - used, "%s%s", used ? ":" : "",
                               factor->source->text);
        }
        used += written > 0 ? (size_t)written : 0;
    }
    return json_pack("{s:o, s:I}", "name", json_stringn_nocheck(name, strlen(name)), "term",
                     (json_int_t)column->term);
}
