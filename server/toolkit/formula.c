/*
 * formula.c - see formula.h. A descent by precedence, lowest first: + and -, * and /, :, ^, then
 * names, functions and brackets. What an expression stands for is a set of terms, and a term a set
 * of factors, a bit each; the constant is the empty one.
 */
#include "toolkit/formula.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/formula_scan.h"

#define DEPTH_MAX 16 /* of brackets */

struct terms {
    size_t count;
    uint32_t term[FORMULA_TERMS_MAX];
};

/* ---- Sets of terms --------------------------------------------------------------------------- */

static void add_term(struct formula_parser *p, struct terms *terms, uint32_t term)
{
    for (size_t i = 0; i < terms->count; i++) {
        if (terms->term[i] == term) {
            return;
        }
    }
    if (terms->count == FORMULA_TERMS_MAX) {
        formula_fail(
            p,
            "has more than %d terms, which is the most; leave out those that you do not ask about",
            FORMULA_TERMS_MAX);
        return;
    }
    terms->term[terms->count++] = term;
}

static void add_terms(struct formula_parser *p, struct terms *terms, const struct terms *more)
{
    for (size_t i = 0; i < more->count; i++) {
        add_term(p, terms, more->term[i]);
    }
}

static void remove_terms(struct terms *terms, const struct terms *less)
{
    size_t kept = 0;

    for (size_t i = 0; i < terms->count; i++) {
        bool there = false;

        for (size_t j = 0; j < less->count; j++) {
            there = there || less->term[j] == terms->term[i];
        }
        if (!there) {
            terms->term[kept++] = terms->term[i];
        }
    }
    terms->count = kept;
}

/* a:b for all a and b. */
static struct terms interact(struct formula_parser *p, const struct terms *a, const struct terms *b)
{
    struct terms product = {0};

    for (size_t i = 0; i < a->count; i++) {
        for (size_t j = 0; j < b->count; j++) {
            add_term(p, &product, a->term[i] | b->term[j]);
        }
    }
    return product;
}

/* ---- Expressions ----------------------------------------------------------------------------- */

static struct terms read_sum(struct formula_parser *p);

static struct terms read_atom(struct formula_parser *p)
{
    struct terms terms = {0};
    struct formula_factor factor = {0};
    char word[FORMULA_NAME_MAX];

    formula_skip(p);
    if (formula_take(p, "(")) {
        if (++p->depth > DEPTH_MAX) {
            formula_fail(
                p, "has brackets %d deep; the most is %d, and those around a single name can go",
                p->depth, DEPTH_MAX);
            return terms;
        }
        terms = read_sum(p);
        p->depth--;
        if (!formula_take(p, ")")) {
            formula_fail_here(p, "a closing bracket");
        }
        return terms;
    }
    if (*p->at == '1' && !isalnum((unsigned char)p->at[1]) && p->at[1] != '.') {
        p->at++;
        add_term(p, &terms, 0);
        return terms;
    }
    if (*p->at == '0' || strncmp(p->at, "-1", 2) == 0) {
        formula_fail(
            p, "leaves out the constant; shape without covariates is the mean, never nothing");
        return terms;
    }
    if (*p->at == '`' || strncmp(p->at, "Q(", 2) == 0) {
        (void)formula_take_name(p, factor.name);
    } else if (!formula_take_word(p, word)) {
        formula_fail_here(p, "a covariate");
    } else if (formula_take(p, "(")) {
        formula_read_call(p, word, &factor);
    } else {
        memcpy(factor.name, word, sizeof factor.name);
    }
    if (!p->failed) {
        add_term(p, &terms, formula_intern(p, &factor));
    }
    return terms;
}

static int order_of(uint32_t term)
{
    int order = 0;

    for (; term; term >>= 1) {
        order += (int)(term & 1);
    }
    return order;
}

/* A term crossed with itself is itself, where the square is meant. */
static void refuse_power(struct formula_parser *p, uint32_t term, char power)
{
    const struct formula_factor *factor;
    size_t f = 0;

    while (!(term >> f & 1)) {
        f++;
    }
    factor = &p->formula->factor[f];
    if (!factor->levels && factor->steps == 0) {
        formula_fail(p,
                     "has %.60s^%c, which is %.60s itself in this notation, as in R: write "
                     "I(%.60s^%c) for the power of its numbers",
                     factor->text, power, factor->text, factor->text, power);
    } else {
        formula_fail(p,
                     "has %.60s^%c, which is %.60s itself in this notation, as in R: leave the "
                     "power out, or make a covariate of its numbers",
                     factor->text, power, factor->text);
    }
}

static struct terms read_power_of(struct formula_parser *p)
{
    struct terms base = read_atom(p);
    struct terms all = base;

    if (formula_take(p, "**") || formula_take(p, "^")) {
        formula_skip(p);
        if (*p->at < '1' || *p->at > '0' + FORMULA_POWER_MAX) {
            formula_fail_here(p, "a power from 1 to 9");
            return all;
        }
        if (*p->at > '1' && base.count == 1 && order_of(base.term[0]) == 1) {
            refuse_power(p, base.term[0], *p->at);
            return all;
        }
        for (int k = *p->at++ - '0'; k > 1 && !p->failed; k--) {
            struct terms more = interact(p, &all, &base);

            add_terms(p, &all, &more);
        }
    }
    return all;
}

static struct terms read_interaction(struct formula_parser *p)
{
    struct terms left = read_power_of(p);

    while (!p->failed && formula_take(p, ":")) {
        struct terms right = read_power_of(p);

        left = interact(p, &left, &right);
    }
    return left;
}

static struct terms read_product(struct formula_parser *p)
{
    struct terms left = read_interaction(p);

    for (;;) {
        bool nested;
        struct terms right;
        struct terms both;

        formula_skip(p);
        if (p->failed || (*p->at != '*' && *p->at != '/')) {
            return left;
        }
        nested = *p->at++ == '/';
        right = read_interaction(p);
        if (nested) { /* within all of what is on the left */
            struct terms whole = {.count = 1};

            for (size_t i = 0; i < left.count; i++) {
                whole.term[0] |= left.term[i];
            }
            both = interact(p, &whole, &right);
        } else {
            both = interact(p, &left, &right);
            add_terms(p, &left, &right);
        }
        add_terms(p, &left, &both);
    }
}

static struct terms read_sum(struct formula_parser *p)
{
    struct terms sum;

    (void)formula_take(p, "+"); /* of the first term, as in patsy */
    sum = read_product(p);
    while (!p->failed) {
        if (formula_take(p, "+")) {
            struct terms more = read_product(p);

            add_terms(p, &sum, &more);
        } else if (formula_take(p, "-")) {
            struct terms less = read_product(p);

            for (size_t i = 0; i < less.count; i++) {
                if (less.term[i] == 0) {
                    formula_fail(
                        p, "leaves out the constant; shape without covariates is the mean, never "
                           "nothing");
                }
            }
            remove_terms(&sum, &less);
        } else {
            break;
        }
    }
    return sum;
}

bool formula_parse(const char *text, struct formula *formula, char problem[FORMULA_PROBLEM_MAX])
{
    struct formula_parser p = {.start = text, .at = text, .formula = formula, .problem = problem};
    struct terms terms;

    *formula = (struct formula){0};
    problem[0] = '\0';
    if (strlen(text) > FORMULA_TEXT_MAX) {
        formula_fail(&p, "has %zu bytes; at most %d are taken", strlen(text), FORMULA_TEXT_MAX);
        return false;
    }
    (void)formula_take(&p, "shape");
    if (!formula_take(&p, "~")) {
        formula_fail(&p, "must begin with \"shape ~\", as in shape ~ age + sex");
        return false;
    }
    terms = read_sum(&p);
    formula_skip(&p);
    if (!p.failed && *p.at) {
        formula_fail_here(&p, "+, -, *, /, :, ^ or the end");
    }
    for (int order = 1; !p.failed && order <= FORMULA_FACTORS_MAX; order++) {
        for (size_t i = 0; i < terms.count; i++) {
            if (order_of(terms.term[i]) == order) {
                formula->term[formula->terms++] = terms.term[i];
            }
        }
    }
    if (!p.failed && formula->terms == 0) {
        formula_fail(&p, "has no term; the mean without covariates is the process mean");
    }
    return !p.failed;
}

void formula_term_name(const struct formula *formula, size_t term, size_t size, char *name)
{
    size_t used = 0;

    name[0] = '\0';
    for (size_t f = 0; f < formula->factors; f++) {
        if (formula->term[term] >> f & 1) {
            int written = snprintf(name + used, size - used, "%s%s", used ? ":" : "",
                                   formula->factor[f].text);

            if (written < 0 || (size_t)written >= size - used) {
                return;
            }
            used += (size_t)written;
        }
    }
}
