/*
 * formula_factor.c - the factors of a formula: covariates by their names, and functions of them.
 */
#include <stdio.h>
#include <string.h>

#include "toolkit/formula_scan.h"

/* The name of a covariate: a word, `..`, Q("..") or Q('..') */
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
    {"log", FORMULA_LOG},           {"log2", FORMULA_LOG2},
    {"log10", FORMULA_LOG10},       {"log1p", FORMULA_LOG1P},
    {"exp", FORMULA_EXP},           {"sqrt", FORMULA_SQRT},
    {"I", FORMULA_POWER},           {"center", FORMULA_STANDARDIZE},
    {"scale", FORMULA_STANDARDIZE}, {"standardize", FORMULA_STANDARDIZE},
};

#define FUNCTIONS_KNOWN \
    "there are log, log2, log10, log1p, exp, sqrt, I(x^2), center, scale, standardize, C and Q"

/* What R or patsy have besides, and what says the same here. */
static const struct {
    const char *name, *instead;
} strangers[] = {
    {"poly", ". For a polynomial write its powers, x + I(x^2)"},
    {"bs", ". For a curve write powers, x + I(x^2)"},
    {"cr", ". For a curve write powers, x + I(x^2)"},
    {"cc", ". For a curve write powers, x + I(x^2)"},
    {"te", ". For a curve write powers, x + I(x^2)"},
    {"ns", ". For a curve write powers, x + I(x^2)"},
    {"s", ". For a curve write powers, x + I(x^2)"},
    {"relevel", ". For another reference write C(x, Treatment(\"level\"))"},
    {"as.numeric", ". Numbers of a cohort are numbers without it"},
};

/* ---- Arguments ------------------------------------------------------------------------------- */

/* ^2; of I(x) alone the power is 1, and of others the end of the call says what is wrong. */
static void read_power(struct formula_parser *p, struct formula_step *step)
{
    step->power = 1;
    if (!formula_take(p, "**") && !formula_take(p, "^")) {
        return;
    }
    formula_skip(p);
    if (*p->at < '2' || *p->at > '0' + FORMULA_POWER_MAX) {
        formula_fail_here(p, "a power from 2 to 9");
        return;
    }
    step->power = *p->at++ - '0';
}

/* True, False and what R writes for them; another is a problem. */
static bool read_truth(struct formula_parser *p)
{
    bool truth = formula_take(p, "True") || formula_take(p, "TRUE");

    if (!truth && !formula_take(p, "False") && !formula_take(p, "FALSE")) {
        formula_fail_here(p, "True or False");
    }
    return truth;
}

/* , center=False, rescale=False (in R scale=FALSE) and ddof=1 */
static void read_standard(struct formula_parser *p, struct formula_step *step)
{
    char word[FORMULA_NAME_MAX];
    bool center = strcmp(step->name, "center") == 0;
    bool given[3] = {false}; /* center, rescale, ddof */

    step->uncentred = false;
    step->unscaled = center;
    while (!center && !p->failed && formula_take(p, ",")) {
        bool named = formula_take_word(p, word) && formula_take(p, "=");
        size_t which = 2;

        if (named && strcmp(word, "center") == 0) {
            step->uncentred = !read_truth(p);
            which = 0;
        } else if (named && (strcmp(word, "rescale") == 0 || strcmp(word, "scale") == 0)) {
            step->unscaled = !read_truth(p);
            which = 1;
        } else if (named && strcmp(word, "ddof") == 0 && formula_take(p, "1")) {
            step->ddof = 1;
        } else if (!named || strcmp(word, "ddof") != 0 || !formula_take(p, "0")) {
            formula_fail_here(p, "center=, rescale=, ddof=0 or ddof=1");
        }
        if (given[which] && !p->failed) {
            formula_fail(p, "has %.20s= twice in %.20s", word, step->name);
        }
        given[which] = true;
    }
    if (step->uncentred && step->unscaled) {
        formula_fail(p, "has %.20s without center and rescale, which changes nothing", step->name);
    }
}

/* Treatment("x"), Treatment(reference="x"), "x", and numbers without quotes. */
static void read_reference(struct formula_parser *p, struct formula_factor *factor)
{
    bool named = formula_take(p, "Treatment"), by_name = false, quoted;
    const char *written;

    if (named && !formula_take(p, "(")) {
        formula_fail_here(p, "Treatment(\"level\")");
        return;
    }
    if (named && formula_take(p, "reference")) {
        by_name = formula_take(p, "=");
        if (!by_name) {
            formula_fail_here(p, "=");
        }
    }
    formula_skip(p);
    if (!named && formula_take_word(p, factor->contrast)) {
        formula_fail(p, "has the contrast %.40s, which is not known; there is Treatment(\"level\")",
                     factor->contrast);
        return;
    }
    written = p->at;
    quoted = *written == '"' || *written == '\'';
    if (!formula_take_text(p, factor->reference) &&
        !(named && formula_take_number(p, factor->reference))) {
        formula_fail_here(p, "the reference level in quotes, as in C(site, Treatment(\"A\")),");
        return;
    }
    (void)snprintf(factor->contrast, sizeof factor->contrast, "%s%s%.*s%s",
                   named ? "Treatment(" : "", by_name ? "reference=" : "",
                   quoted ? (int)(p->at - written) : (int)sizeof factor->reference,
                   quoted ? written : factor->reference, named ? ")" : "");
    if (named && !formula_take(p, ")")) {
        formula_fail_here(p, "a closing bracket");
    }
}

/* ---- Calls ----------------------------------------------------------------------------------- */

static bool says_levels(const char *word)
{
    return strcmp(word, "C") == 0 || strcmp(word, "factor") == 0 || strcmp(word, "as.factor") == 0;
}

static void refuse_function(struct formula_parser *p, const char *word)
{
    const char *instead = "";

    for (size_t i = 0; i < sizeof strangers / sizeof strangers[0]; i++) {
        instead = strcmp(strangers[i].name, word) == 0 ? strangers[i].instead : instead;
    }
    formula_fail(p, "has the function %.40s, which is not known; " FUNCTIONS_KNOWN "%s", word,
                 instead);
}

/* The closing bracket of a call. */
static void read_end(struct formula_parser *p)
{
    formula_skip(p);
    if (*p->at && strchr("+-*/", *p->at)) {
        formula_fail(p,
                     "has \"%.20s\" at character %zu, within a function: functions take one "
                     "covariate, and log1p(x) is log(x + 1). Make a covariate of other numbers",
                     p->at, (size_t)(p->at - p->start) + 1);
    } else if (!formula_take(p, ")")) {
        formula_fail_here(p, "a closing bracket");
    }
}

/* The functions within it, or the name of the covariate. */
static void read_argument(struct formula_parser *p, struct formula_factor *factor)
{
    bool quoted;

    formula_skip(p);
    if (*p->at == '-' || *p->at == '+') {
        formula_fail(
            p,
            "has \"%.20s\" at character %zu, a sign within a function: functions take one "
            "covariate. For I(-x) write x, whose coefficient has the other sign; else make "
            "a covariate of such numbers",
            p->at, (size_t)(p->at - p->start) + 1);
        return;
    }
    quoted = *p->at == '`' || strncmp(p->at, "Q(", 2) == 0;
    if (formula_take_name(p, factor->name) && !quoted && formula_take(p, "(")) {
        char word[FORMULA_NAME_MAX];

        memcpy(word, factor->name, sizeof word);
        formula_read_call(p, word, factor);
    }
}

void formula_read_call(struct formula_parser *p, const char *word, struct formula_factor *factor)
{
    size_t i = 0, count = sizeof functions / sizeof functions[0];
    const char *name = strncmp(word, "np.", 3) == 0 ? word + 3 : word;
    struct formula_step step;

    while (i < count && strcmp(functions[i].name, name) != 0) {
        i++;
    }
    if (i == count && !says_levels(word)) {
        refuse_function(p, word);
        return;
    }
    if (++p->calls > FORMULA_STEPS_MAX) {
        formula_fail(p, "has functions of functions %d deep; %d are taken", p->calls,
                     FORMULA_STEPS_MAX);
        return;
    }
    read_argument(p, factor);
    p->calls--;
    if (p->failed) {
        return;
    }
    if (i == count) {
        if (factor->steps > 0 || factor->levels || p->calls > 0) {
            formula_fail(p,
                         "has %.12s(..) and another function of \"%.60s\": levels have no "
                         "numbers to take it of",
                         word, factor->name);
        } else if (formula_take(p, ",")) {
            read_reference(p, factor);
        }
        factor->levels = true;
    } else {
        step = (struct formula_step){.name = functions[i].name, .function = functions[i].function};
        if (step.function == FORMULA_POWER) {
            read_power(p, &step);
        } else if (step.function == FORMULA_STANDARDIZE) {
            read_standard(p, &step);
        }
        if (step.function != FORMULA_POWER || step.power > 1) {
            factor->step[factor->steps++] = step;
        }
    }
    read_end(p);
}

/* ---- Names ----------------------------------------------------------------------------------- */

/* text gets a function of itself. */
static void spell_step(const struct formula_step *step, char text[FORMULA_FACTOR_MAX])
{
    char inner[FORMULA_FACTOR_MAX - 100];
    const size_t size = FORMULA_FACTOR_MAX;

    (void)snprintf(inner, sizeof inner, "%.*s", (int)sizeof inner - 1, text);
    if (step->function == FORMULA_POWER) {
        (void)snprintf(text, size, "I(%s^%d)", inner, step->power);
    } else {
        bool center = strcmp(step->name, "center") == 0;

        (void)snprintf(
            text, size, "%s(%s%s%s%s)", step->name, inner, step->uncentred ? ", center=False" : "",
            step->unscaled && !center ? ", rescale=False" : "", step->ddof ? ", ddof=1" : "");
    }
}

/* A word as it is, another name between `..`, or in Q("..") where it has such a quote. */
static void spell_name(const char *name, char text[2 * FORMULA_NAME_MAX + 6])
{
    bool plain = formula_is_name(name[0], true);
    size_t length = 3;

    for (const char *c = name; *c; c++) {
        plain = plain && formula_is_name(*c, false);
    }
    if (plain || !strchr(name, '`')) {
        (void)snprintf(text, FORMULA_NAME_MAX + 2, plain ? "%s" : "`%s`", name);
        return;
    }
    memcpy(text, "Q(\"", length);
    for (const char *c = name; *c; c++) {
        if (*c == '"' || *c == '\\') {
            text[length++] = '\\';
        }
        text[length++] = *c;
    }
    memcpy(text + length, "\")", 3);
}

void formula_spell(const struct formula_factor *factor, size_t steps, char text[FORMULA_FACTOR_MAX])
{
    char quoted[2 * FORMULA_NAME_MAX + 6];

    spell_name(factor->name, quoted);
    if (factor->levels) {
        (void)snprintf(text, FORMULA_FACTOR_MAX, "C(%s%s%s)", quoted,
                       factor->contrast[0] ? ", " : "", factor->contrast);
        return;
    }
    (void)snprintf(text, FORMULA_FACTOR_MAX, "%s", quoted);
    for (size_t k = 0; k < steps; k++) {
        spell_step(&factor->step[k], text);
    }
}

/* Levels of one covariate are one factor, whichever of its calls names the reference. */
static bool is_same(const struct formula_factor *a, const struct formula_factor *b)
{
    return a->levels && b->levels ? strcmp(a->name, b->name) == 0 : strcmp(a->text, b->text) == 0;
}

uint32_t formula_intern(struct formula_parser *p, struct formula_factor *factor)
{
    struct formula *formula = p->formula;

    formula_spell(factor, factor->steps, factor->text);
    for (size_t i = 0; i < formula->factors; i++) {
        struct formula_factor *known = &formula->factor[i];

        if (is_same(known, factor)) {
            if (factor->reference[0] && known->reference[0] &&
                strcmp(factor->reference, known->reference) != 0) {
                formula_fail(p, "gives \"%.60s\" two reference levels", factor->name);
            }
            if (factor->reference[0] && !known->reference[0]) {
                *known = *factor;
            }
            return UINT32_C(1) << i;
        }
    }
    if (formula->factors == FORMULA_FACTORS_MAX) {
        formula_fail(p,
                     "has more than %d different factors, which is the most; leave some out, or "
                     "make two formulas",
                     FORMULA_FACTORS_MAX);
        return 0;
    }
    formula->factor[formula->factors] = *factor;
    return UINT32_C(1) << formula->factors++;
}
