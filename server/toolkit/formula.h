/*
 * formula.h - formulas of linear models in the notation of G. Wilkinson and C. Rogers ("Symbolic
 * description of factorial models for analysis of variance", 1973), as R and patsy read them.
 *
 *     shape ~ age + sex + age:sex + C(site) + log(volume)
 *
 *     a + b     both              a:b       their interaction       a * b     a + b + a:b
 *     a / b     a + a:b           (a+b)^2   all up to pairs         a*b - b   without b
 *     log(x)    also log2, log10, log1p, exp, sqrt; with np. before them
 *     I(x^2)    a power           C(x), factor(x)  categorical     C(x, Treatment("ref"))
 *     Q("a b"), `a b`             a name that is no word
 *
 * The constant is always in the model. Terms come in the order of R: by the number of their
 * factors, then as they are written.
 */
#ifndef SRNFD_TOOLKIT_FORMULA_H
#define SRNFD_TOOLKIT_FORMULA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FORMULA_TEXT_MAX 1000
#define FORMULA_NAME_MAX 804 /* COHORT_TEXT_MAX characters of four bytes and the zero, and more */
#define FORMULA_FACTORS_MAX 24
#define FORMULA_TERMS_MAX 64

enum formula_function {
    FORMULA_PLAIN = 0,
    FORMULA_LOG,
    FORMULA_LOG2,
    FORMULA_LOG10,
    FORMULA_LOG1P,
    FORMULA_EXP,
    FORMULA_SQRT,
    FORMULA_POWER,
    FORMULA_LEVELS, /* C(x) */
};

struct formula_factor {
    char name[FORMULA_NAME_MAX]; /* of the covariate */
    char
        reference[FORMULA_NAME_MAX]; /* of LEVELS: the level that others are compared with, or "" */
    char text[FORMULA_NAME_MAX + 32]; /* as it is written, without spaces */
    enum formula_function function;
    int power;
};

struct formula {
    size_t factors, terms;
    struct formula_factor factor[FORMULA_FACTORS_MAX];
    uint32_t term[FORMULA_TERMS_MAX]; /* the factors of each, as bits */
};

#define FORMULA_PROBLEM_MAX 400
/* False: problem has a sentence, beginning with a small letter. */
bool formula_parse(const char *text, struct formula *formula, char problem[FORMULA_PROBLEM_MAX]);
/* What a function makes of a number; NaN where it is not defined. */
double formula_apply(const struct formula_factor *factor, double value);
/* "age:sex" of a term. */
void formula_term_name(const struct formula *formula, size_t term, size_t size, char *name);

#endif
