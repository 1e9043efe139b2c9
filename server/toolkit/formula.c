/*
 * formula.c - see formula.h. A descent by precedence, lowest first: + and -, * and /, :, ^, then
 * names, functions and brackets. What an expression stands for is a set of terms, and a term a set
 * of factors, a bit each; the constant is the empty one.
 */
#include "toolkit/formula.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEPTH_MAX 16 /* of brackets */
#define POWER_MAX 9

struct terms {
    size_t count;
    uint32_t term[FORMULA_TERMS_MAX];
};

struct parser {
    const char *start, *at;
    struct formula *formula;
    char *problem;
    int depth;
    bool failed;
};

static void fail(struct parser *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void fail(struct parser *p, const char *format, ...)
{
    va_list arguments;

    if (!p->failed) {
        va_start(arguments, format);
        (void)vsnprintf(p->problem, FORMULA_PROBLEM_MAX, format, arguments);
        va_end(arguments);
    }
    p->failed = true;
}

static void skip(struct parser *p)
{
    while (*p->at && isspace((unsigned char)*p->at)) {
        p->at++;
    }
}

static bool take(struct parser *p, const char *what)
{
    skip(p);
    if (p->failed || strncmp(p->at, what, strlen(what)) != 0) {
        return false;
    }
    p->at += strlen(what);
    return true;
}

static void fail_here(struct parser *p, const char *expected)
{
    skip(p);
    if (*p->at) {
        fail(p, "has \"%.20s\" at character %zu where %s is expected", p->at,
             (size_t)(p->at - p->start) + 1, expected);
    } else {
        fail(p, "ends where %s is expected", expected);
    }
}

/* ---- Sets of terms --------------------------------------------------------------------------- */

static void add_term(struct parser *p, struct terms *terms, uint32_t term)
{
    for (size_t i = 0; i < terms->count; i++) {
        if (terms->term[i] == term) {
            return;
        }
    }
    if (terms->count == FORMULA_TERMS_MAX) {
        fail(p, "has more than %d terms", FORMULA_TERMS_MAX);
        return;
    }
    terms->term[terms->count++] = term;
}

static void add_terms(struct parser *p, struct terms *terms, const struct terms *more)
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
static struct terms interact(struct parser *p, const struct terms *a, const struct terms *b)
{
    struct terms product = {0};

    for (size_t i = 0; i < a->count; i++) {
        for (size_t j = 0; j < b->count; j++) {
            add_term(p, &product, a->term[i] | b->term[j]);
        }
    }
    return product;
}

/* ---- Names and functions --------------------------------------------------------------------- */

static bool is_name(char c, bool first)
{
    unsigned char u = (unsigned char)c;

    return isalpha(u) || c == '_' || u >= 0x80 || (!first && (isdigit(u) || c == '.'));
}

/* Up to the closing quote. */
static bool take_quoted(struct parser *p, char quote, char name[FORMULA_NAME_MAX])
{
    const char *end = strchr(p->at, quote);
    size_t length = end ? (size_t)(end - p->at) : 0;

    if (!end || length == 0 || length >= FORMULA_NAME_MAX) {
        fail(p, "has a quotation at character %zu that does not end, or is empty",
             (size_t)(p->at - p->start));
        return false;
    }
    memcpy(name, p->at, length);
    name[length] = '\0';
    p->at = end + 1;
    return true;
}

static bool take_word(struct parser *p, char name[FORMULA_NAME_MAX])
{
    size_t length = 0;

    skip(p);
    if (!is_name(*p->at, true)) {
        return false;
    }
    while (is_name(p->at[length], length == 0)) {
        length++;
    }
    if (length >= FORMULA_NAME_MAX) {
        fail(p, "has a name of %zu bytes", length);
        return false;
    }
    memcpy(name, p->at, length);
    name[length] = '\0';
    p->at += length;
    return true;
}

static bool take_text(struct parser *p, char text[FORMULA_NAME_MAX])
{
    skip(p);
    return (take(p, "\"") && take_quoted(p, '"', text)) ||
           (take(p, "'") && take_quoted(p, '\'', text));
}

/* The name of a covariate: a word, `..` or Q("..") */
static bool take_name(struct parser *p, char name[FORMULA_NAME_MAX])
{
    if (take(p, "`")) {
        return take_quoted(p, '`', name);
    }
    if (!take_word(p, name)) {
        fail_here(p, "the name of a covariate");
        return false;
    }
    if (strcmp(name, "Q") == 0 && take(p, "(")) {
        if (!take_text(p, name) || !take(p, ")")) {
            fail_here(p, "the end of Q(\"name\")");
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

static void read_power(struct parser *p, struct formula_factor *factor)
{
    if (!take(p, "**") && !take(p, "^")) {
        fail_here(p, "^ and a power, as in I(age^2),");
        return;
    }
    skip(p);
    if (*p->at < '2' || *p->at > '0' + POWER_MAX) {
        fail_here(p, "a power from 2 to 9");
        return;
    }
    factor->power = *p->at++ - '0';
}

/* , Treatment("x"), Treatment(reference="x") or "x" */
static void read_reference(struct parser *p, struct formula_factor *factor)
{
    bool named = take(p, "Treatment");

    if (named && !take(p, "(")) {
        fail_here(p, "Treatment(\"level\")");
        return;
    }
    if (named && take(p, "reference") && !take(p, "=")) {
        fail_here(p, "=");
    }
    if (!take_text(p, factor->reference) || (named && !take(p, ")"))) {
        fail_here(p, "the reference level in quotes, as in C(site, Treatment(\"A\")),");
    }
}

static void spell(struct formula_factor *factor)
{
    const char *name = factor->name;
    bool plain = is_name(name[0], true);
    char quoted[FORMULA_NAME_MAX + 2];

    for (const char *c = name; *c; c++) {
        plain = plain && is_name(*c, false);
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
static uint32_t intern(struct parser *p, struct formula_factor *factor)
{
    struct formula *formula = p->formula;

    spell(factor);
    for (size_t i = 0; i < formula->factors; i++) {
        struct formula_factor *known = &formula->factor[i];

        if (strcmp(known->text, factor->text) == 0) {
            if (factor->reference[0] && known->reference[0] &&
                strcmp(factor->reference, known->reference) != 0) {
                fail(p, "gives \"%.60s\" two reference levels", factor->name);
            }
            if (factor->reference[0]) {
                memcpy(known->reference, factor->reference, sizeof known->reference);
            }
            return UINT32_C(1) << i;
        }
    }
    if (formula->factors == FORMULA_FACTORS_MAX) {
        fail(p, "has more than %d different factors", FORMULA_FACTORS_MAX);
        return 0;
    }
    formula->factor[formula->factors] = *factor;
    return UINT32_C(1) << formula->factors++;
}

static void read_call(struct parser *p, const char *word, struct formula_factor *factor)
{
    size_t i = 0;
    size_t count = sizeof functions / sizeof functions[0];
    const char *name = strncmp(word, "np.", 3) == 0 ? word + 3 : word;

    while (i < count && strcmp(functions[i].name, name) != 0) {
        i++;
    }
    if (i == count) {
        fail(p,
             "has the function %.40s, which is not known; there are log, log2, log10, log1p, exp, "
             "sqrt, I(x^2), C and Q",
             word);
        return;
    }
    factor->function = functions[i].function;
    if (!take_name(p, factor->name)) {
        return;
    }
    if (factor->function == FORMULA_POWER) {
        read_power(p, factor);
    } else if (factor->function == FORMULA_LEVELS && take(p, ",")) {
        read_reference(p, factor);
    }
    if (!take(p, ")")) {
        fail_here(p, "a closing bracket");
    }
}

/* ---- Expressions ----------------------------------------------------------------------------- */

static struct terms read_sum(struct parser *p);

static struct terms read_atom(struct parser *p)
{
    struct terms terms = {0};
    struct formula_factor factor = {.function = FORMULA_PLAIN};
    char word[FORMULA_NAME_MAX];

    skip(p);
    if (take(p, "(")) {
        if (++p->depth > DEPTH_MAX) {
            fail(p, "has brackets %d deep", p->depth);
            return terms;
        }
        terms = read_sum(p);
        p->depth--;
        if (!take(p, ")")) {
            fail_here(p, "a closing bracket");
        }
        return terms;
    }
    if (*p->at == '1' && !isalnum((unsigned char)p->at[1]) && p->at[1] != '.') {
        p->at++;
        add_term(p, &terms, 0);
        return terms;
    }
    if (*p->at == '0' || strncmp(p->at, "-1", 2) == 0) {
        fail(p, "leaves out the constant; shape without covariates is the mean, never nothing");
        return terms;
    }
    if (*p->at == '`' || strncmp(p->at, "Q(", 2) == 0) {
        (void)take_name(p, factor.name);
    } else if (!take_word(p, word)) {
        fail_here(p, "a covariate");
    } else if (take(p, "(")) {
        read_call(p, word, &factor);
    } else {
        memcpy(factor.name, word, sizeof factor.name);
    }
    if (!p->failed) {
        add_term(p, &terms, intern(p, &factor));
    }
    return terms;
}

static struct terms read_power_of(struct parser *p)
{
    struct terms base = read_atom(p);
    struct terms all = base;

    if (take(p, "**") || take(p, "^")) {
        skip(p);
        if (*p->at < '1' || *p->at > '0' + POWER_MAX) {
            fail_here(p, "a power from 1 to 9");
            return all;
        }
        for (int k = *p->at++ - '0'; k > 1 && !p->failed; k--) {
            struct terms more = interact(p, &all, &base);

            add_terms(p, &all, &more);
        }
    }
    return all;
}

static struct terms read_interaction(struct parser *p)
{
    struct terms left = read_power_of(p);

    while (!p->failed && take(p, ":")) {
        struct terms right = read_power_of(p);

        left = interact(p, &left, &right);
    }
    return left;
}

static struct terms read_product(struct parser *p)
{
    struct terms left = read_interaction(p);

    for (;;) {
        bool nested;
        struct terms right;
        struct terms both;

        skip(p);
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

static struct terms read_sum(struct parser *p)
{
    struct terms sum = read_product(p);

    while (!p->failed) {
        if (take(p, "+")) {
            struct terms more = read_product(p);

            add_terms(p, &sum, &more);
        } else if (take(p, "-")) {
            struct terms less = read_product(p);

            for (size_t i = 0; i < less.count; i++) {
                if (less.term[i] == 0) {
                    fail(p, "leaves out the constant; shape without covariates is the mean, never "
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

static int order_of(uint32_t term)
{
    int order = 0;

    for (; term; term >>= 1) {
        order += (int)(term & 1);
    }
    return order;
}

bool formula_parse(const char *text, struct formula *formula, char problem[FORMULA_PROBLEM_MAX])
{
    struct parser p = {.start = text, .at = text, .formula = formula, .problem = problem};
    struct terms terms;

    *formula = (struct formula){0};
    problem[0] = '\0';
    if (strlen(text) > FORMULA_TEXT_MAX) {
        fail(&p, "has %zu bytes; at most %d are taken", strlen(text), FORMULA_TEXT_MAX);
        return false;
    }
    (void)take(&p, "shape");
    if (!take(&p, "~")) {
        fail(&p, "must begin with \"shape ~\", as in shape ~ age + sex");
        return false;
    }
    terms = read_sum(&p);
    skip(&p);
    if (!p.failed && *p.at) {
        fail_here(&p, "+, -, *, /, :, ^ or the end");
    }
    for (int order = 1; !p.failed && order <= FORMULA_FACTORS_MAX; order++) {
        for (size_t i = 0; i < terms.count; i++) {
            if (order_of(terms.term[i]) == order) {
                formula->term[formula->terms++] = terms.term[i];
            }
        }
    }
    if (!p.failed && formula->terms == 0) {
        fail(&p, "has no term; the mean without covariates is the process mean");
    }
    return !p.failed;
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
