/*
 * formula_factor.c - the factors of a formula: covariates by their names, and functions of them.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/formula_scan.h"

/* The name of a covariate: a word, `..` or Q("..") */
bool formula_take_name(struct formula_parser *p, char name[FORMULA_NAME_MAX])
{
    if (formula_take(p, "`")) {
        return formula_take_quoted(p, '`', name);
    }
    if (!formula_take_word(p, name)) {
        formula_fail_here(p, "the name of a covariate");
        return false;
    }
    if (strcmp(name, "Q") == 0 && formula_take(p, "(")) {
        if (!formula_take_text(p, name) || !formula_take(p, ")")) {
            formula_fail_here(p, "the end of Q(\"name\")");
        }
    }
    return !p->failed;
}

static const struct {
    const char *name;
    enum formula_function function;
} functions[] = {
    {"log", FORMULA_LOG},     {"log2", FORMULA_LOG2}, {"log10", FORMULA_LOG10},
    {"log1p", FORMULA_LOG1P}, {"exp", FORMULA_EXP},   {"sqrt", FORMULA_SQRT},
    {"I", FORMULA_POWER},     {"C", FORMULA_LEVELS},  {"factor", FORMULA_LEVELS},
};

static void read_power(struct formula_parser *p, struct formula_factor *factor)
{
    if (!formula_take(p, "**") && !formula_take(p, "^")) {
        formula_fail_here(p, "^ and a power, as in I(age^2),");
        return;
    }
    formula_skip(p);
    if (*p->at < '2' || *p->at > '0' + FORMULA_POWER_MAX) {
        formula_fail_here(p, "a power from 2 to 9");
        return;
    }
    factor->power = *p->at++ - '0';
}

/* , Treatment("x"), Treatment(reference="x") or "x" */
static void read_reference(struct formula_parser *p, struct formula_factor *factor)
{
    bool named = formula_take(p, "Treatment");

    if (named && !formula_take(p, "(")) {
        formula_fail_here(p, "Treatment(\"level\")");
        return;
    }
    if (named && formula_take(p, "reference") && !formula_take(p, "=")) {
        formula_fail_here(p, "=");
    }
    if (!formula_take_text(p, factor->reference) || (named && !formula_take(p, ")"))) {
        formula_fail_here(p, "the reference level in quotes, as in C(site, Treatment(\"A\")),");
    }
}

static void spell(struct formula_factor *factor)
{
    const char *name = factor->name;
    bool plain = formula_is_name(name[0], true);
    char quoted[FORMULA_NAME_MAX + 2];

    for (const char *c = name; *c; c++) {
        plain = plain && formula_is_name(*c, false);
    }
    (void)snprintf(quoted, sizeof quoted, plain ? "%s" : "`%s`", name);
    if (factor->function == FORMULA_PLAIN) {
        (void)snprintf(factor->text, sizeof factor->text, "%s", quoted);
    } else if (factor->function == FORMULA_POWER) {
        (void)snprintf(factor->text, sizeof factor->text, "I(%s^%d)", quoted, factor->power);
    } else {
        size_t i = 0;

        while (functions[i].function != factor->function) {
            i++;
        }
        (void)snprintf(factor->text, sizeof factor->text, "%s(%s)", functions[i].name, quoted);
    }
}

/* The number of a factor, known or new. */
uint32_t formula_intern(struct formula_parser *p, struct formula_factor *factor)
{
    struct formula *formula = p->formula;

    spell(factor);
    for (size_t i = 0; i < formula->factors; i++) {
        struct formula_factor *known = &formula->factor[i];

        if (strcmp(known->text, factor->text) == 0) {
            if (factor->reference[0] && known->reference[0] &&
                strcmp(factor->reference, known->reference) != 0) {
                formula_fail(p, "gives \"%.60s\" two reference levels", factor->name);
            }
            if (factor->reference[0]) {
                memcpy(known->reference, factor->reference, sizeof known->reference);
            }
            return UINT32_C(1) << i;
        }
    }
    if (formula->factors == FORMULA_FACTORS_MAX) {
        formula_fail(p, "has more than %d different factors", FORMULA_FACTORS_MAX);
        return 0;
    }
    formula->factor[formula->factors] = *factor;
    return UINT32_C(1) << formula->factors++;
}

void formula_read_call(struct formula_parser *p, const char *word, struct formula_factor *factor)
{
    size_t i = 0;
    size_t count = sizeof functions / sizeof functions[0];
    const char *name = strncmp(word, "np.", 3) == 0 ? word + 3 : word;

    while (i < count && strcmp(functions[i].name, name) != 0) {
        i++;
    }
    if (i == count) {
        formula_fail(
            p,
            "has the function %.40s, which is not known; there are log, log2, log10, log1p, exp, "
            "sqrt, I(x^2), C and Q",
            word);
        return;
    }
    factor->function = functions[i].function;
    if (!formula_take_name(p, factor->name)) {
        return;
    }
    if (factor->function == FORMULA_POWER) {
        read_power(p, factor);
    } else if (factor->function == FORMULA_LEVELS && formula_take(p, ",")) {
        read_reference(p, factor);
    }
    if (!formula_take(p, ")")) {
        formula_fail_here(p, "a closing bracket");
    }
}

double formula_apply(const struct formula_factor *factor, double x)
{
    double power = 1.0;

    switch (factor->function) {
    case FORMULA_LOG:
        return x > 0.0 ? log(x) : NAN;
    case FORMULA_LOG2:
        return x > 0.0 ? log2(x) : NAN;
    case FORMULA_LOG10:
        return x > 0.0 ? log10(x) : NAN;
    case FORMULA_LOG1P:
        return x > -1.0 ? log1p(x) : NAN;
    case FORMULA_EXP:
        return exp(x);
    case FORMULA_SQRT:
        return x >= 0.0 ? sqrt(x) : NAN;
    case FORMULA_POWER:
        for (int k = 0; k < factor->power; k++) {
            power *= x;
        }
        return power;
    default:
        return x;
    }
}
