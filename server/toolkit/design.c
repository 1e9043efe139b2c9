/*
 * design.c - see design.h. Factors, columns, tests and points have files of their own; here they
 * are put together.
 */
#include "toolkit/design.h"

#include "text.h"
#include "toolkit/design_columns.h"
#include "toolkit/group.h"

#define SUBJECTS_BESIDE ((size_t)4) /* the constant, and a covariance of three dimensions */

static json_t *terms_json(const struct design_build *build, const struct design_columns *columns)
{
    json_t *terms = json_array();

    for (size_t t = 0; t < build->formula->terms; t++) {
        char name[DESIGN_TERM_MAX];
        json_t *own = json_array();

        formula_term_name(build->formula, t, sizeof name, name);
        for (size_t c = 0; c < columns->count; c++) {
            if (columns->column[c].term == t) {
                (void)json_array_append_new(own, json_integer((json_int_t)c));
            }
        }
        (void)json_array_append_new(terms, json_pack("{s:s, s:o}", "name", name, "columns", own));
    }
    return terms;
}

/* The rows of subjects, column after column: those of the members of each averaged, as regress
   does. NULL without memory; *count gets the subjects. */
static double *average_rows(const struct design_build *build, const json_t *rows, size_t m,
                            size_t *count)
{
    const json_t *cohort = json_object_get(build->given->canonical, "cohort");
    size_t n = build->n, largest, next = 0;
    size_t *of = group_subject_numbers(json_object_get(cohort, "subjects"), n, count, &largest);
    double *values = of ? srnf_alloc((m + 1) * n, sizeof *values) : NULL;
    size_t *place = values ? srnf_alloc(n, sizeof *place) : NULL;

    for (size_t i = 0; place && i < n; i++) {
        place[i] = of[i] == i ? next++ : place[of[i]]; /* a subject has the number of its first */
        values[m * n + place[i]] += 1.0;
    }
    for (size_t k = 0; place && k < m * n; k++) {
        double value = json_number_value(json_array_get(json_array_get(rows, k % n), k / n));
        size_t s = place[k % n];

        values[k / n * *count + s] += value / values[m * n + s];
    }
    srnf_free(of);
    if (!place) {
        srnf_free(values);
        return NULL;
    }
    srnf_free(place);
    return values;
}

/* Notes that there are more columns than the subjects can tell, and the term that has most. */
static void refuse_many(const struct design_build *build, const struct design_columns *columns,
                        size_t subjects)
{
    size_t most = 0, of_term = 0;
    char name[DESIGN_TERM_MAX];

    for (size_t t = 0; t < build->formula->terms; t++) {
        size_t own = 0;

        for (size_t c = 0; c < columns->count; c++) {
            own += columns->column[c].term == t;
        }
        of_term = own > most ? t : of_term;
        most = own > most ? own : most;
    }
    formula_term_name(build->formula, of_term, sizeof name, name);
    if (subjects <= SUBJECTS_BESIDE) {
        problem_add(build->given->list, "/inputs/cohort",
                    "has %zu subject%s; a formula of one column needs %zu at least", subjects,
                    plural(subjects), SUBJECTS_BESIDE + 1);
        return;
    }
    problem_add(build->given->list, DESIGN_POINTER,
                "makes %zu columns, and with %zu subjects at most %zu can be fitted: leave terms "
                "out; %.120s alone has %zu",
                columns->count, subjects, subjects - SUBJECTS_BESIDE, name, most);
}

/* Notes that there are too many columns, or one that says nothing that those before it do not. */
static bool check_columns(const struct design_build *build, const struct design_columns *columns,
                          const json_t *rows, const json_t *names)
{
    size_t m = json_array_size(names), subjects = 0;
    double *values = average_rows(build, rows, m, &subjects);
    enum srnf_covariate *verdicts = srnf_alloc(m, sizeof *verdicts);
    bool good = values && verdicts;

    if (!good) {
        json_memory_fail();
    } else if (m + SUBJECTS_BESIDE > subjects) {
        refuse_many(build, columns, subjects);
        good = false;
    }
    good = good && srnf_covariates_check(m, subjects, values, verdicts) == 0;
    for (size_t c = 0; good && c < m; c++) {
        const char *name = json_string_value(json_object_get(json_array_get(names, c), "name"));

        if (design_refuse_numbers(build, name, values + c * subjects, subjects)) {
            good = false;
        } else if (verdicts[c] != SRNF_COVARIATE_FREE) {
            if (!design_refuse_cell(build, columns->column[c].term) &&
                (verdicts[c] != SRNF_COVARIATE_FOLLOWS ||
                 !design_refuse_repeat(build, columns, subjects, values, c))) {
                design_refuse_column(build, name, verdicts[c], values + c * subjects, subjects);
            }
            good = false;
        }
    }
    srnf_free(values);
    srnf_free(verdicts);
    return good;
}

static void set_design(const struct design_build *build, const struct design_columns *columns,
                       json_t *cohort, const json_t *at)
{
    json_t *design = json_object(), *rows = json_array(), *names = json_array();
    json_t *terms = terms_json(build, columns);

    for (size_t i = 0; i < build->n; i++) {
        double row[FORMULA_FACTORS_MAX] = {0};

        for (size_t f = 0; f < build->formula->factors; f++) {
            row[f] = build->factor[f].value ? build->factor[f].value[i] : 0.0;
        }
        (void)json_array_append_new(rows, design_columns_row(build, columns, row));
    }
    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(names, design_column_name(build, &columns->column[c]));
    }
    (void)json_object_set(design, "formula", json_object_get(build->given->canonical, "formula"));
    (void)json_object_set_new(design, "rows", rows);
    (void)json_object_set_new(design, "columns", names);
    (void)json_object_set_new(design, "terms", terms);
    if (build->alike) {
        (void)json_object_set(design, "alike", build->alike);
    }
    if (build->missing) {
        (void)json_object_set(design, "missing", build->missing);
    }
    if (build->mixed) {
        (void)json_object_set(design, "mixed", build->mixed);
    }
    if (check_columns(build, columns, rows, names)) {
        (void)json_object_set_new(design, "tests", design_tests(build, columns, terms));
        design_set_points(build, columns, at, design);
    }
    (void)json_object_set_new(cohort, "design", design);
}

void design_describe(struct process_inputs *given, const struct formula *formula,
                     const json_t *members, json_t *cohort, const json_t *at, const char *where)
{
    struct design_build build = {
        .given = given, .formula = formula, .members = members, .where = where};
    struct design_columns *columns = srnf_alloc(1, sizeof *columns);

    build.n = json_array_size(members);
    if (!columns) {
        json_memory_fail();
    } else if (design_factors_read(&build) && design_columns_make(&build, columns)) {
        set_design(&build, columns, cohort, at);
    }
    design_factors_clear(&build);
    srnf_free(columns);
}
