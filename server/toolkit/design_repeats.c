/*
 * design_repeats.c - two terms that say the same: group and label of a cohort, an age in years and
 * in months, a site and its city. The problem names both.
 */
#include <string.h>

#include "toolkit/design_columns.h"

/* A design whose rows are those of subjects. values: [columns x subjects]. */
struct told {
    const struct design_columns *columns;
    size_t subjects;
    const double *values;
};

/* Whether a column follows from the constant and the columns of a term. */
static bool tells_column(const struct told *told, size_t term, size_t column)
{
    const struct design_columns *columns = told->columns;
    size_t n = told->subjects, m = 0;
    enum srnf_covariate verdicts[DESIGN_COLUMNS_MAX + 1];
    double *own = srnf_alloc((columns->count + 1) * n, sizeof *own);
    bool follows;

    for (size_t c = 0; own && c < columns->count; c++) {
        if (columns->column[c].term == term) {
            memcpy(own + m++ * n, told->values + c * n, n * sizeof *own);
        }
    }
    if (own) {
        memcpy(own + m * n, told->values + column * n, n * sizeof *own);
    }
    follows = own && srnf_covariates_check(m + 1, n, own, verdicts) == 0 &&
              verdicts[m] == SRNF_COVARIATE_FOLLOWS;
    srnf_free(own);
    return follows;
}

/* Whether all columns of another term do. */
static bool tells_term(const struct told *told, size_t term, size_t other)
{
    bool follow = true;

    for (size_t c = 0; follow && c < told->columns->count; c++) {
        follow = told->columns->column[c].term != other || tells_column(told, term, c);
    }
    return follow;
}

static void refuse_pair(const struct design_build *build, const struct told *told, size_t first,
                        size_t later)
{
    char known[DESIGN_TERM_MAX], name[DESIGN_TERM_MAX];

    formula_term_name(build->formula, first, sizeof known, known);
    formula_term_name(build->formula, later, sizeof name, name);
    if (!tells_term(told, first, later)) {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the terms %.120s and %.120s say the same in part: a column of %.120s follows "
                    "from the first. Leave one out",
                    known, name, name);
    } else if (!tells_term(told, later, first)) {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the term %.120s follows from %.120s, which says more: leave %.120s out", name,
                    known, name);
    } else {
        problem_add(build->given->list, DESIGN_POINTER,
                    "the terms %.120s and %.120s say the same: %.120s repeats the first. Leave one "
                    "out",
                    known, name, name);
    }
}

bool design_refuse_repeat(const struct design_build *build, const struct design_columns *columns,
                          size_t subjects, const double *values, size_t column)
{
    const struct told told = {columns, subjects, values};
    size_t later = columns->column[column].term;

    for (size_t t = 0; t < later; t++) {
        if (tells_column(&told, t, column)) {
            refuse_pair(build, &told, t, later);
            return true;
        }
    }
    return false;
}
