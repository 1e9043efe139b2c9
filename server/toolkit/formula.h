/*
 * formula.h - formulas of linear models in the notation of G. Wilkinson and C. Rogers ("Symbolic
 * description of factorial models for analysis of variance", 1973), as R and patsy read them.
 *
 *     shape ~ age + sex + age:sex + C(site) + log(volume)
 *
 *     a + b     both              a:b       their interaction       a * b     a + b + a:b
 *     a / b     a + a:b           (a+b)^2   all up to pairs         a*b - b   without b
 *     log(x)    also log2, log10, log1p, exp, sqrt; with np. before them
 *     I(x^2)    a power, I(x) x   C(x), factor(x)  categorical     C(x, Treatment("ref"))
 *     center(x)                   less its mean over the members
 *     scale(x), standardize(x)    by its deviation, too: of n as in patsy, with ddof=1 of n - 1
 *     Q("a b"), `a b`             a name that is no word; in quotes, single or double, \" is "
 *
 * Functions of numbers may be of each other: scale(log(x)), I(center(x)^2).
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

#define FORMULA_FACTOR_MAX (3 * FORMULA_NAME_MAX + 300) /* spelled, with a level */
#define FORMULA_STEPS_MAX 4                             /* functions of functions */

enum formula_function {
    FORMULA_LOG = 0,
    FORMULA_LOG2,
    FORMULA_LOG10,
    FORMULA_LOG1P,
    FORMULA_EXP,
    FORMULA_SQRT,
    FORMULA_POWER,
    FORMULA_STANDARDIZE, /* center, scale, standardize */
};

struct formula_step {
    const char *name; /* as it is written, without "np." */
    enum formula_function function;
    int power, ddof;
    bool uncentred, unscaled; /* of STANDARDIZE: without the one or the other */
};

struct formula_factor {
    char name[FORMULA_NAME_MAX];          /* of the covariate */
    bool levels;                          /* C(x) */
    char reference[FORMULA_NAME_MAX];     /* of levels: the one others are compared with, or "" */
    char contrast[FORMULA_NAME_MAX + 32]; /* the same as it is written: Treatment("A") */
    char text[FORMULA_FACTOR_MAX];        /* the factor, with the white space of patsy */
    size_t steps;                         /* functions, the innermost first */
    struct formula_step step[FORMULA_STEPS_MAX];
};

/* What functions take of all members: subtracted and divided by, of each step. */
struct formula_state {
    double mean[FORMULA_STEPS_MAX], deviation[FORMULA_STEPS_MAX];
};

struct formula {
    size_t factors, terms;
    struct formula_factor factor[FORMULA_FACTORS_MAX];
    uint32_t term[FORMULA_TERMS_MAX]; /* the factors of each, as bits */
};

#define FORMULA_PROBLEM_MAX 400
/* False: problem has a sentence, beginning with a small letter. */
bool formula_parse(const char *text, struct formula *formula, char problem[FORMULA_PROBLEM_MAX]);
/* Puts what the factor's functions make of all members in the place of their numbers, NaN where it
   is not defined, and what they took of all into state. */
void formula_learn(const struct formula_factor *factor, size_t n, double *values,
                   struct formula_state *state);
/* What the functions make of one more number, with the state of the members. */
double formula_apply(const struct formula_factor *factor, const struct formula_state *state,
                     double value);
/* Why the functions make no number of a value: "scale(x) is -2 there, and log takes numbers above
   0". Text is "" where they do. */
#define FORMULA_WHY_MAX 400
void formula_why(const struct formula_factor *factor, const struct formula_state *state,
                 double value, char text[FORMULA_WHY_MAX]);
/* The factor with so many of its functions, the innermost first. */
void formula_spell(const struct formula_factor *factor, size_t steps,
                   char text[FORMULA_FACTOR_MAX]);
/* "age:sex" of a term. */
void formula_term_name(const struct formula *formula, size_t term, size_t size, char *name);

#endif
