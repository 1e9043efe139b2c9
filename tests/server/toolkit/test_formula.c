/*
 * test_formula.c - formulas against the rules of R, functions, and what is refused.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "toolkit/formula.h"

/* The labels of the terms, with spaces between them. */
static void labels_of(const char *text, char *labels, size_t size)
{
    struct formula *formula = calloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];
    size_t used = 0;

    assert_non_null(formula);
    if (!formula_parse(text, formula, problem)) {
        fail_msg("%s: %s", text, problem);
    }
    for (size_t t = 0; t < formula->terms; t++) {
        char name[200];

        formula_term_name(formula, t, sizeof name, name);
        used += (size_t)snprintf(labels + used, size - used, "%s%s", t ? " " : "", name);
        assert_true(used < size);
    }
    free(formula);
}

/* What R documents (?formula, ?terms): its labels; powers and names are spelled as here. */
static void terms_are_those_of_r(void **state)
{
    static const struct {
        const char *text, *labels;
    } cases[] = {
        {"shape ~ age", "age"},
        {"~a+b", "a b"},
        {"shape ~ a:b + a", "a a:b"},
        {"shape ~ a*b*c", "a b c a:b a:c b:c a:b:c"},
        {"shape ~ (a + b + c)^2", "a b c a:b a:c b:c"},
        {"shape ~ (a + b)**3", "a b a:b"},
        {"shape ~ a*b - b", "a a:b"},
        {"shape ~ a/b", "a a:b"},
        {"shape ~ (a + b)/c", "a b a:b:c"},
        {"shape ~ a:(b + c)", "a:b a:c"},
        {"shape ~ a + a + a:a", "a"},
        {"shape ~ 1 + a", "a"},
        {"shape ~ a*b - a:b + log( v )", "a b log(v)"},
        {"shape ~ np.log(v) + log(v)", "log(v)"},
        {"shape ~ I(age ^ 2) + I(age**3)", "I(age^2) I(age^3)"},
        {"shape ~ C(site, Treatment(\"B\")) * age", "C(site) age C(site):age"},
        {"shape ~ factor(site)", "C(site)"},
        {"shape ~ Q(\"a b\") + `c d`", "`a b` `c d`"},
        {"shape ~ shape.index + a_1", "shape.index a_1"},
        {"shape ~ Q(\"plain\")", "plain"},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char labels[1000] = "";

        labels_of(cases[i].text, labels, sizeof labels);
        assert_string_equal(labels, cases[i].labels);
    }
}

static void references_are_read(void **state)
{
    static const char *const texts[] = {"~ C(site, Treatment(\"B\"))",
                                        "~ C(site, Treatment(reference='B'))", "~ C(site, 'B')",
                                        "~ C(site) + C( site , \"B\" )"};

    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct formula *formula = calloc(1, sizeof *formula);
        char problem[FORMULA_PROBLEM_MAX];

        assert_non_null(formula);
        assert_true(formula_parse(texts[i], formula, problem));
        assert_int_equal(formula->factors, 1);
        assert_string_equal(formula->factor[0].reference, "B");
        free(formula);
    }
}

static void functions_are_applied(void **state)
{
    const struct {
        enum formula_function function;
        double x, y;
    } cases[] = {
        {FORMULA_PLAIN, 3.0, 3.0},  {FORMULA_LOG, exp(2.0), 2.0}, {FORMULA_LOG2, 8.0, 3.0},
        {FORMULA_LOG10, 1e3, 3.0},  {FORMULA_LOG1P, 0.0, 0.0},    {FORMULA_EXP, 0.0, 1.0},
        {FORMULA_SQRT, 9.0, 3.0},   {FORMULA_POWER, -2.0, -8.0},  {FORMULA_LOG, 0.0, NAN},
        {FORMULA_LOG2, -1.0, NAN},  {FORMULA_LOG10, 0.0, NAN},    {FORMULA_LOG1P, -1.0, NAN},
        {FORMULA_SQRT, -1e-9, NAN},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct formula_factor factor = {.function = cases[i].function, .power = 3};
        double y = formula_apply(&factor, cases[i].x);

        assert_true(isnan(cases[i].y) ? isnan(y) : fabs(y - cases[i].y) < 1e-14);
    }
}

static void wrong_formulas_are_told(void **state)
{
    static const struct {
        const char *text, *part;
    } cases[] = {
        {"", "must begin"},
        {"age", "must begin"},
        {"y ~ age", "must begin"},
        {"shape ~", "ends where a covariate"},
        {"shape ~ 1", "has no term"},
        {"shape ~ a - a", "has no term"},
        {"shape ~ a +", "ends where a covariate"},
        {"shape ~ (a", "closing bracket"},
        {"shape ~ a)", "at character 10"},
        {"shape ~ a b", "at character 11"},
        {"shape ~ a ^ x", "a power from 1 to 9"},
        {"shape ~ b + age^2", "write I(age^2)"},
        {"shape ~ log(a)**3", "log(a)^3, which is log(a) itself"},
        {"shape ~ a + (1 | subject)", "no random effects"},
        {"shape ~ a | b", "no random effects"},
        {"shape ~ 0 + a", "constant"},
        {"shape ~ a - 1", "constant"},
        {"shape ~ -1 + a", "constant"},
        {"shape ~ 2", "a covariate"},
        {"shape ~ .", "a covariate"},
        {"shape ~ spline(a)", "function spline"},
        {"shape ~ I(a)", "power"},
        {"shape ~ I(a^1)", "power from 2"},
        {"shape ~ log(a", "closing bracket"},
        {"shape ~ log()", "name of a covariate"},
        {"shape ~ `a", "quotation"},
        {"shape ~ Q(a)", "Q("},
        {"shape ~ Q(\"\")", "quotation"},
        {"shape ~ C(a, b)", "reference level"},
        {"shape ~ C(a, 'x') + C(a, 'y')", "two reference"},
        {"shape ~ ((((((((((((((((((a))))))))))))))))))", "brackets 17 deep"},
        {"shape ~ (a+b+c+d+e+f+g)^7", "more than 64 terms"},
        {"shape ~ a+b+c+d+e+f+g+h+i+j+k+l+m+n+o+p+q+r+s+t+u+v+w+x+y", "more than 24"},
    };
    struct formula *formula = calloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];
    char *text = calloc(1, FORMULA_TEXT_MAX + 10);

    (void)state;
    assert_non_null(formula);
    assert_non_null(text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (formula_parse(cases[i].text, formula, problem) || !strstr(problem, cases[i].part)) {
            fail_msg("%s: \"%s\"", cases[i].text, problem);
        }
    }
    memset(text, 'a', FORMULA_TEXT_MAX + 1);
    assert_false(formula_parse(text, formula, problem));
    assert_non_null(strstr(problem, "1001 bytes"));
    memcpy(text, "shape ~ ", 8);
    text[FORMULA_TEXT_MAX] = '\0';
    assert_false(formula_parse(text, formula, problem));
    assert_non_null(strstr(problem, "a name of"));
    free(text);
    free(formula);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(terms_are_those_of_r),
        cmocka_unit_test(references_are_read),
        cmocka_unit_test(functions_are_applied),
        cmocka_unit_test(wrong_formulas_are_told),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
