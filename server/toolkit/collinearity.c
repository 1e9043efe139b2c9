/*
 * collinearity.c - see collinearity.h. The inflation is that of core/stats/covariates.c.
 */
#include "toolkit/collinearity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/covariates.h"

#define LARGER (1.0 + 1e-6) /* than by rounding: two terms alone inflate each other alike */
#define TERM_NAME_MAX 256

struct judged {
    const json_t *design;
    const struct srnf_regress_design *numbers;
    size_t n;
    const size_t *subjects;
    struct formula *formula;
    enum srnf_column roles[DESIGN_COLUMNS_MAX];
};

static bool share_covariate(const struct formula *formula, size_t a, size_t b)
{
    for (size_t f = 0; f < formula->factors; f++) {
        for (size_t g = 0; g < formula->factors; g++) {
            if ((formula->term[a] >> f & 1u) && (formula->term[b] >> g & 1u) &&
                strcmp(formula->factor[f].name, formula->factor[g].name) == 0) {
                return true;
            }
        }
    }
    return false;
}

static void set_role(struct judged *j, size_t term, enum srnf_column role)
{
    const json_t *term_of = json_array_get(json_object_get(j->design, "terms"), term);
    const json_t *columns = json_object_get(term_of, "columns"), *column;
    size_t k;

    json_array_foreach(columns, k, column)
    {
        size_t c = (size_t)json_integer_value(column);

        if (c < DESIGN_COLUMNS_MAX) {
            j->roles[c] = role;
        }
    }
}

/* Inflation of a term by another, or, where that is the term itself, by all that share no covariate
   with it; 1 where nothing is to be judged. */
static double inflation_of(struct judged *j, size_t term, size_t by)
{
    double inflation = 1.0;

    memset(j->roles, 0, sizeof j->roles);
    for (size_t t = 0; t < j->formula->terms; t++) {
        if (t != term && (by == term || by == t) && !share_covariate(j->formula, term, t)) {
            set_role(j, t, SRNF_COLUMN_BESIDE);
        }
    }
    set_role(j, term, SRNF_COLUMN_OF_TERM);
    if (srnf_term_inflation(j->n, j->subjects, j->numbers->columns, j->numbers->values, j->roles,
                            &inflation)) {
        json_memory_fail(); /* a warning may be missing */
        return 1.0;
    }
    return isfinite(inflation) ? inflation : 1.0;
}

static size_t closest_to(struct judged *j, size_t term)
{
    size_t closest = term;
    double most = 0.0;

    for (size_t t = 0; t < j->formula->terms; t++) {
        double inflation =
            t != term && !share_covariate(j->formula, term, t) ? inflation_of(j, term, t) : 0.0;

        closest = inflation > LARGER * most ? t : closest;
        most = closest == t ? inflation : most;
    }
    return closest;
}

static void warn(struct judged *j, size_t term, double inflation, json_t *terms, json_t *warnings)
{
    char name[TERM_NAME_MAX], closest[TERM_NAME_MAX];

    formula_term_name(j->formula, term, sizeof name, name);
    formula_term_name(j->formula, closest_to(j, term), sizeof closest, closest);
    warning_add(
        warnings, "covariates-collinear",
        json_pack("{s:s, s:s, s:f, s:f, s:O}", "term", name, "covariate", closest, "inflation",
                  inflation, "tolerance", 1.0 / inflation, "terms", terms),
        "The other terms of the formula all but tell \"%.60s\", \"%.60s\" most of all: beside them "
        "the variance of its coefficients is %.3g times what it is without (tolerance %.3g). What "
        "they have in common is found for neither, and neither may be significant though both "
        "together are; leave one out, or take subjects in whom they do not go together.",
        name, closest, inflation, 1.0 / inflation);
}

static void judge(struct judged *j, json_t *warnings)
{
    json_t *terms = json_array();
    size_t worst = 0;
    double most = 0.0;

    for (size_t t = 0; t < j->formula->terms; t++) {
        double inflation = inflation_of(j, t, t);
        char name[TERM_NAME_MAX];

        if (inflation >= COVARIATES_INFLATION_WARNED) {
            formula_term_name(j->formula, t, sizeof name, name);
            (void)json_array_append_new(terms, json_string(name));
        }
        worst = inflation > LARGER * most ? t : worst;
        most = worst == t ? inflation : most;
    }
    if (most >= COVARIATES_INFLATION_WARNED) {
        warn(j, worst, most, terms, warnings);
    }
    json_decref(terms);
}

void collinearity_warn(json_t *warnings, const json_t *design,
                       const struct srnf_regress_design *numbers, size_t n, const size_t *subjects)
{
    const char *text = json_string_value(json_object_get(design, "formula"));
    char problem[FORMULA_PROBLEM_MAX];
    struct judged j = {.design = design, .numbers = numbers, .n = n, .subjects = subjects};

    if (!text || numbers->columns > DESIGN_COLUMNS_MAX) {
        return;
    }
    j.formula = srnf_alloc(1, sizeof *j.formula);
    if (!j.formula) {
        json_memory_fail(); /* a warning may be missing */
    } else if (formula_parse(text, j.formula, problem)) {
        judge(&j, warnings);
    }
    srnf_free(j.formula);
}
