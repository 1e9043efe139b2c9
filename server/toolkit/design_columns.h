/*
 * design_columns.h - the columns of a design, and what the files of the design make of them. A
 * column is a term with one level of each of its categorical factors; its value in a row is the
 * product of the numbers of the others where the row has those levels, and 0 elsewhere.
 */
#ifndef SRNFD_TOOLKIT_DESIGN_COLUMNS_H
#define SRNFD_TOOLKIT_DESIGN_COLUMNS_H

#include "toolkit/design_factors.h"

#define DESIGN_POINTER "/inputs/formula"
#define DESIGN_TERM_MAX 256 /* of a term's name */

struct design_column {
    size_t term;
    size_t level[FORMULA_FACTORS_MAX]; /* of the categorical factors of the term */
};

struct design_columns {
    size_t count;
    struct design_column column[DESIGN_COLUMNS_MAX];
};

bool design_has_factor(const struct formula *formula, size_t term, size_t factor);
/* All columns of the formula; false with a problem noted if they are too many. */
bool design_columns_make(const struct design_build *build, struct design_columns *columns);
/* The values of all columns, [columns]. row: [factors] numbers and levels. */
json_t *design_columns_row(const struct design_build *build, const struct design_columns *columns,
                           const double *row);
/* {name, term}. The name is as patsy has it: age, C(site)[T.B], and C(site)[A] where all levels
   have a column. */
json_t *design_column_name(const struct design_build *build, const struct design_column *column);

/* Of a column that follows from those before it: whether one earlier term alone says it, with a
   problem noted that names both terms. values: [columns x subjects]. */
bool design_refuse_repeat(const struct design_build *build, const struct design_columns *columns,
                          size_t subjects, const double *values, size_t column);

/* Of a term with a column that says nothing: whether no member has some levels of it together, with
   a problem noted that names them. */
bool design_refuse_cell(const struct design_build *build, size_t term);
/* Notes why a column says nothing. values: [subjects] */
void design_refuse_column(const struct design_build *build, const char *name,
                          enum srnf_covariate verdict, const double *values, size_t subjects);
/* Whether a column has the name of the constant, or numbers that no coefficient fits, with a
   problem noted. values: [subjects] */
bool design_refuse_numbers(const struct design_build *build, const char *name, const double *values,
                           size_t subjects);

/* The tests of a design (design.h). terms: as there. */
json_t *design_tests(const struct design_build *build, const struct design_columns *columns,
                     const json_t *terms);
/* Sets at, atRows and beyond of a design (design.h), or notes problems. at: array of objects. */
void design_set_points(const struct design_build *build, const struct design_columns *columns,
                       const json_t *at, json_t *design);

#endif
