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
        {"shape ~ + a + (+ b):c", "a b:c"},
        {"shape ~ I(a) + a + I(log(b))", "a log(b)"},
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
        {"shape ~ C(site,Treatment( reference='B'))*age",
         "C(site, Treatment(reference='B')) age C(site, Treatment(reference='B')):age"},
        {"shape ~ C(site) + age + C(site, Treatment(\"B\"))", "C(site, Treatment(\"B\")) age"},
        {"shape ~ as.factor(site) + C(stage, Treatment(2))", "C(site) C(stage, Treatment(2))"},
        {"shape ~ scale( x,ddof = 1 ) + center(np.log(`a b`))",
         "scale(x, ddof=1) center(log(`a b`))"},
        {"shape ~ factor(site)", "C(site)"},
        {"shape ~ Q(\"a b\") + `c d`", "`a b` `c d`"},
        {"shape ~ shape.index + a_1", "shape.index a_1"},
        {"shape ~ Q(\"plain\")", "plain"},
        {"shape ~ Q('a \"b\"') + Q(\"a \\\"c\\\"\") + log(Q('it\\'s'))",
         "`a \"b\"` `a \"c\"` log(`it's`)"},
        {"shape ~ Q('a\\\\b') + Q(\"c\\d\") + `e\\`", "`a\\b` `c\\d` `e\\`"},
        {"shape ~ Q(\"it's\") + Q('it\\'s')", "`it's`"},
        {"shape ~ Q('a`b') + Q('\"`\\\\')", "Q(\"a`b\") Q(\"\\\"`\\\\\")"},
        {"shape ~ C(site, Treatment('it\\'s'))", "C(site, Treatment('it\\'s'))"},
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
        {FORMULA_LOG, exp(2.0), 2.0}, {FORMULA_LOG2, 8.0, 3.0},   {FORMULA_LOG10, 1e3, 3.0},
        {FORMULA_LOG1P, 0.0, 0.0},    {FORMULA_EXP, 0.0, 1.0},    {FORMULA_SQRT, 9.0, 3.0},
        {FORMULA_POWER, -2.0, -8.0},  {FORMULA_LOG, 0.0, NAN},    {FORMULA_LOG2, -1.0, NAN},
        {FORMULA_LOG10, 0.0, NAN},    {FORMULA_LOG1P, -1.0, NAN}, {FORMULA_SQRT, -1e-9, NAN},
    };
    const struct formula_factor plain = {0};
    const struct formula_state none = {0};

    (void)state;
    assert_true(formula_apply(&plain, &none, 3.0) == 3.0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct formula_factor factor = {
            .steps = 1, .step[0] = {.function = cases[i].function, .power = 3}};
        double y = formula_apply(&factor, &none, cases[i].x);

        assert_true(isnan(cases[i].y) ? isnan(y) : fabs(y - cases[i].y) < 1e-14);
    }
}

/* The columns that patsy 0.5.3 makes of the same formula and numbers, and the point 5 with their
   mean and deviation:
       x = numpy.array([1, 2, 4, 8, 10.5]); info = patsy.dmatrix(FORMULA, {"x": x}).design_info
       patsy.build_design_matrices([info], {"x": numpy.array([1, 10.5, 5])})
   with the functions under the names that they have here, and R's scale() under ddof=1. */
static void members_standardize(void **state)
{
    static const struct {
        const char *text, *name;
        double first, last, at_five;
    } cases[] = {
        {"~ center(x)", "center(x)", -4.0999999999999996, 5.4000000000000004,
         -0.099999999999999645},
        {"~ scale(x)", "scale(x)", -1.1353899900245081, 1.4953916941786207, -0.027692438781085568},
        {"~ standardize(x)", "standardize(x)", -1.1353899900245081, 1.4953916941786207,
         -0.027692438781085568},
        {"~ scale(x, ddof=1)", "scale(x, ddof=1)", -1.0155236794670432, 1.3375189924687889,
         -0.024768870230903496},
        {"~ scale(x, scale=FALSE)", "scale(x, rescale=False)", -4.0999999999999996,
         5.4000000000000004, -0.10000000000000001},
        {"~ standardize(x, center=False)", "standardize(x, center=False)", 0.27692438781085565,
         2.9077060720139842, 1.3846219390542782},
        {"~ scale(np.log(x))", "scale(log(x))", -1.4977760946023262, 1.2070579268812569,
         0.35359254923920136},
        {"~ I(center(x)**2)", "I(center(x)^2)", 16.809999999999999, 29.160000000000004,
         0.0099999999999999291},
        {"~ center(I(x^3))", "center(I(x^3))", -347.52499999999998, 809.10000000000002,
         -223.52499999999998},
    };
    struct formula *formula = calloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];

    (void)state;
    assert_non_null(formula);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double values[5] = {1.0, 2.0, 4.0, 8.0, 10.5}, x;
        struct formula_state learned;

        if (!formula_parse(cases[i].text, formula, problem)) {
            fail_msg("%s: %s", cases[i].text, problem);
        }
        assert_string_equal(formula->factor[0].text, cases[i].name);
        formula_learn(&formula->factor[0], 5, values, &learned);
        x = formula_apply(&formula->factor[0], &learned, 5.0);
        assert_true(fabs(values[0] - cases[i].first) < 1e-12);
        assert_true(fabs(values[4] - cases[i].last) < 1e-12);
        assert_true(fabs(x - cases[i].at_five) < 1e-12);
    }
    free(formula);
}

/* No deviation to divide by, and numbers that a function within has none for. */
static void standardizing_ends_well(void **state)
{
    struct formula *formula = calloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];
    double same[3] = {2.0, 2.0, 2.0}, one[3] = {1.0, -1.0, exp(2.0)};
    struct formula_state learned;

    (void)state;
    assert_non_null(formula);
    assert_true(formula_parse("~ scale(log(x))", formula, problem));
    formula_learn(&formula->factor[0], 3, same, &learned);
    assert_true(same[0] == 0.0 && same[2] == 0.0);
    formula_learn(&formula->factor[0], 3, one, &learned);
    assert_true(isnan(one[1]));
    assert_true(fabs(one[0] + 1.0) < 1e-14 && fabs(one[2] - 1.0) < 1e-14);
    free(formula);
}

static const struct {
    const char *text, *part;
} wrong[] = {
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
    {"shape ~ poly(a, 2)", "poly, which is not known; there are log, log2"},
    {"shape ~ poly(a, 2)", "write its powers, x + I(x^2)"},
    {"shape ~ bs(a, df=4)", "C and Q. For a curve write powers"},
    {"shape ~ relevel(a, ref='b')", "write C(x, Treatment(\"level\"))"},
    {"shape ~ C(a, Sum)", "contrast Sum, which is not known; there is Treatment"},
    {"shape ~ C(log(a))", "C(..) and another function of \"a\""},
    {"shape ~ log(C(a))", "C(..) and another function of \"a\""},
    {"shape ~ log(log(log(log(log(a)))))", "functions of functions 5 deep; 4 are taken"},
    {"shape ~ log(a + 1)", "log1p(x) is log(x + 1)"},
    {"shape ~ I(a * b)", "functions take one covariate"},
    {"shape ~ I(a + b)", "Make a covariate of other numbers"},
    {"shape ~ I(-a)", "For I(-x) write x"},
    {"shape ~ I(a, 2)", "closing bracket"},
    {"shape ~ scale(a, 1)", "center=, rescale=, ddof=0 or ddof=1"},
    {"shape ~ scale(a, ddof=2)", "ddof=0 or ddof=1"},
    {"shape ~ scale(a, center=maybe)", "True or False"},
    {"shape ~ scale(a, FALSE, FALSE)", "center=, rescale="},
    {"shape ~ scale(a, center=F)", "True or False"},
    {"shape ~ scale(a, center=False, scale=FALSE)", "which changes nothing"},
    {"shape ~ center(a, ddof=1)", "closing bracket"},
    {"shape ~ I(a^1)", "power from 2"},
    {"shape ~ log(a", "closing bracket"},
    {"shape ~ log()", "name of a covariate"},
    {"shape ~ `a", "quotation"},
    {"shape ~ Q(a)", "Q("},
    {"shape ~ Q(\"\")", "quotation"},
    {"shape ~ Q(\"a\\\")", "quotation"},
    {"shape ~ Q('a\")", "quotation"},
    {"shape ~ C(a, b)", "contrast b"},
    {"shape ~ C(a, 3)", "reference level in quotes"},
    {"shape ~ C(a, Treatment(b))", "reference level in quotes"},
    {"shape ~ C(a, 'x') + C(a, 'y')", "two reference"},
    {"shape ~ ((((((((((((((((((a))))))))))))))))))", "brackets 17 deep; the most is 16, and"},
    {"shape ~ (a+b+c+d+e+f+g)^7", "more than 64 terms, which is the most; leave out"},
    {"shape ~ a+b+c+d+e+f+g+h+i+j+k+l+m+n+o+p+q+r+s+t+u+v+w+x+y",
     "more than 24 different factors, which is the most; leave some out"},
};

static void wrong_formulas_are_told(void **state)
{
    struct formula *formula = calloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];
    char *text = calloc(1, FORMULA_TEXT_MAX + 10);

    (void)state;
    assert_non_null(formula);
    assert_non_null(text);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        if (formula_parse(wrong[i].text, formula, problem) || !strstr(problem, wrong[i].part)) {
            fail_msg("%s: \"%s\"", wrong[i].text, problem);
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
        cmocka_unit_test(terms_are_those_of_r),    cmocka_unit_test(references_are_read),
        cmocka_unit_test(functions_are_applied),   cmocka_unit_test(members_standardize),
        cmocka_unit_test(standardizing_ends_well), cmocka_unit_test(wrong_formulas_are_told),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
