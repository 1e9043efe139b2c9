/*
 * design.c - see design.h.
 *
 * A column is a term with one level of each of its categorical factors; its value in a row is the
 * product of the numbers of the others where the row has those levels, and 0 elsewhere.
 */
#include "toolkit/design.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/design_factors.h"

#define TERM_NAME_MAX 256
#define POINTER "/inputs/formula"

struct column {
    size_t term;
    size_t level[FORMULA_FACTORS_MAX]; /* of the categorical factors of the term */
};

struct columns {
    size_t count;
    struct column column[DESIGN_COLUMNS_MAX];
};

/* ---- Columns --------------------------------------------------------------------------------- */

static bool has_factor(const struct formula *formula, size_t term, size_t factor)
{
    return formula->term[term] >> factor & 1;
}

/* Whether the model has the term without one of its factors; the constant it has. */
static bool has_margin(const struct formula *formula, size_t term, size_t factor)
{
    uint32_t margin = formula->term[term] & ~(UINT32_C(1) << factor);
    bool found = margin == 0;

    for (size_t t = 0; t < formula->terms; t++) {
        found = found || formula->term[t] == margin;
    }
    return found;
}

/* The next combination of levels of a term; false after the last. */
static bool next_levels(const struct design_build *build, size_t term, struct column *column)
{
    for (size_t f = 0; f < build->formula->factors; f++) {
        const struct design_factor *factor = &build->factor[f];

        if (!has_factor(build->formula, term, f) || !factor->categorical) {
            continue;
        }
        if (++column->level[f] < json_array_size(factor->levels)) {
            return true;
        }
        column->level[f] = has_margin(build->formula, term, f) ? 1 : 0;
    }
    return false;
}

static bool make_columns(const struct design_build *build, struct columns *columns)
{
    columns->count = 0;
    for (size_t t = 0; t < build->formula->terms; t++) {
        struct column column = {.term = t};

        for (size_t f = 0; f < build->formula->factors; f++) {
            column.level[f] = has_margin(build->formula, t, f) ? 1 : 0;
        }
        do {
            if (columns->count == DESIGN_COLUMNS_MAX) {
                problem_add(build->given->list, POINTER,
                            "makes more than %d columns: take fewer levels or interactions",
                            DESIGN_COLUMNS_MAX);
                return false;
            }
            columns->column[columns->count++] = column;
        } while (next_levels(build, t, &column));
    }
    return true;
}

/* row: [factors] numbers and levels. */
static double column_value(const struct design_build *build, const struct column *column,
                           const double *row)
{
    double value = 1.0;

    for (size_t f = 0; f < build->formula->factors; f++) {
        if (has_factor(build->formula, column->term, f)) {
            value *= !build->factor[f].categorical        ? row[f]
                     : (size_t)row[f] == column->level[f] ? 1.0
                                                          : 0.0;
        }
    }
    return value;
}

static json_t *row_json(const struct design_build *build, const struct columns *columns,
                        const double *row)
{
    json_t *values = json_array();

    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(values,
                                    json_real(column_value(build, &columns->column[c], row)));
    }
    return values;
}

/* As patsy has it: age, C(site)[T.B], and C(site)[A] where all levels have a column. */
static json_t *column_name(const struct design_build *build, const struct column *column)
{
    char name[TERM_NAME_MAX];
    size_t used = 0;

    name[0] = '\0';
    for (size_t f = 0; f < build->formula->factors && used < sizeof name; f++) {
        const struct design_factor *factor = &build->factor[f];
        int written = 0;

        if (has_factor(build->formula, column->term, f) && factor->categorical) {
            written = snprintf(name + used, sizeof name - used, "%s%s[%s%s]", used ? ":" : "",
                               factor->source->text,
                               has_margin(build->formula, column->term, f) ? "T." : "",
                               json_string_value(json_array_get(factor->levels, column->level[f])));
        } else if (has_factor(build->formula, column->term, f)) {
            written = snprintf(name + used, sizeof name - used, "%s%s", used ? ":" : "",
                               factor->source->text);
        }
        used += written > 0 ? (size_t)written : 0;
    }
    return json_pack("{s:o, s:I}", "name", json_stringn_nocheck(name, strlen(name)), "term",
                     (json_int_t)column->term);
}

/* ---- The parts of the design ----------------------------------------------------------------- */

static json_t *terms_json(const struct design_build *build, const struct columns *columns)
{
    json_t *terms = json_array();

    for (size_t t = 0; t < build->formula->terms; t++) {
        char name[TERM_NAME_MAX];
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

/* Notes each column that says nothing that those before it do not. */
static bool check_columns(const struct design_build *build, const json_t *rows, const json_t *names)
{
    size_t m = json_array_size(names), n = build->n;
    double *values = srnf_alloc(m * n, sizeof *values);
    enum srnf_covariate *verdicts = srnf_alloc(m, sizeof *verdicts);
    bool good = values && verdicts;

    for (size_t k = 0; good && k < m * n; k++) {
        values[k] = json_number_value(json_array_get(json_array_get(rows, k % n), k / n));
    }
    good = good && srnf_covariates_check(m, n, values, verdicts) == 0;
    for (size_t c = 0; good && c < m; c++) {
        if (verdicts[c] != SRNF_COVARIATE_FREE) {
            problem_add(build->given->list, POINTER,
                        "the column %.120s %s: leave its term out, or write an interaction with "
                        "all it is made of (a * b)",
                        json_string_value(json_object_get(json_array_get(names, c), "name")),
                        verdicts[c] == SRNF_COVARIATE_CONSTANT
                            ? "is the same for all members"
                            : "follows from the constant and the columns before it");
            good = false;
        }
    }
    srnf_free(values);
    srnf_free(verdicts);
    return good;
}

/* ---- Tests ----------------------------------------------------------------------------------- */

/* A term is tested beside all terms that do not hold it. */
static json_t *reduced_of(const struct design_build *build, const struct columns *columns,
                          size_t term)
{
    uint32_t tested = build->formula->term[term];
    json_t *reduced = json_array();

    for (size_t c = 0; c < columns->count; c++) {
        if ((build->formula->term[columns->column[c].term] & tested) != tested) {
            (void)json_array_append_new(reduced, json_integer((json_int_t)c));
        }
    }
    return reduced;
}

/* The two levels of a pair are one in the smaller model: its columns are those of the others, and,
   where neither is the reference, the sum of both. */
static json_t *pair_json(const struct design_build *build, const struct columns *columns,
                         size_t term, const json_t *own, size_t a, size_t b)
{
    const struct design_factor *factor = NULL;
    json_t *reduced = reduced_of(build, columns, term), *merged = json_array();

    for (size_t f = 0; f < build->formula->factors; f++) {
        factor = has_factor(build->formula, term, f) ? &build->factor[f] : factor;
    }
    for (size_t k = 1; k <= json_array_size(own); k++) {
        if (k != a && k != b) {
            (void)json_array_append(reduced, json_array_get(own, k - 1));
        } else if (a > 0) {
            (void)json_array_append(merged, json_array_get(own, k - 1));
        }
    }
    return json_pack("{s:s, s:I, s:[O, O], s:o, s:[O], s:o}", "kind", "pair", "term",
                     (json_int_t)term, "levels", json_array_get(factor->levels, a),
                     json_array_get(factor->levels, b), "reduced", reduced, "tested",
                     json_array_get(own, b - 1), "merged", merged);
}

static bool has_pairs(const struct design_build *build, size_t term, size_t columns)
{
    bool one = false;

    for (size_t f = 0; f < build->formula->factors; f++) {
        one =
            one || (build->formula->term[term] == UINT32_C(1) << f && build->factor[f].categorical);
    }
    return one && columns >= 2 && columns < DESIGN_PAIRS_LEVELS;
}

static json_t *tests_json(const struct design_build *build, const struct columns *columns,
                          const json_t *terms)
{
    json_t *tests = json_array(), *all = json_array();

    for (size_t t = 0; t < json_array_size(terms); t++) {
        const json_t *own = json_object_get(json_array_get(terms, t), "columns");

        (void)json_array_append_new(
            tests, json_pack("{s:s, s:I, s:o, s:O, s:[]}", "kind", "term", "term", (json_int_t)t,
                             "reduced", reduced_of(build, columns, t), "tested", own, "merged"));
    }
    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(all, json_integer((json_int_t)c));
    }
    (void)json_array_append_new(tests, json_pack("{s:s, s:[], s:o, s:[]}", "kind", "model",
                                                 "reduced", "tested", all, "merged"));
    for (size_t t = 0; t < json_array_size(terms); t++) {
        const json_t *own = json_object_get(json_array_get(terms, t), "columns");
        size_t levels = json_array_size(own) + 1;

        for (size_t b = 1; has_pairs(build, t, levels - 1) && b < levels; b++) {
            for (size_t a = 0; a < b; a++) {
                (void)json_array_append_new(tests, pair_json(build, columns, t, own, a, b));
            }
        }
    }
    return tests;
}

/* ---- Points ---------------------------------------------------------------------------------- */

/* One factor at a point, into the row; notes what is wrong, and what is beyond the members. */
static void read_point(const struct design_build *build, size_t f, size_t index, json_t *point,
                       json_t *beyond, double *row)
{
    const struct design_factor *factor = &build->factor[f];
    const char *name = factor->source->name;
    const json_t *value = json_object_get(point, name);
    char text[FORMULA_NAME_MAX], pointer[64];

    (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu", index);
    if (!value) {
        (void)json_object_set_new(point, name,
                                  factor->categorical ? json_copy(json_array_get(factor->levels, 0))
                                                      : json_real(factor->mean));
        value = json_object_get(point, name);
    }
    if (factor->categorical) {
        bool known = design_level(value, sizeof text, text) &&
                     design_find_level(factor, text) < json_array_size(factor->levels);

        row[f] = known ? (double)design_find_level(factor, text) : 0.0;
        (void)json_object_set_new(point, name, json_string(known ? text : ""));
        if (!known) {
            problem_add(build->given->list, pointer, "\"%.60s\" must be a level that members have",
                        name);
        }
        return;
    }
    (void)json_object_set_new(point, name,
                              json_is_number(value) ? json_real(json_number_value(value) + 0.0)
                                                    : json_null());
    value = json_object_get(point, name);
    row[f] = json_is_number(value) ? formula_apply(factor->source, json_number_value(value)) : NAN;
    if (!isfinite(row[f])) {
        problem_add(build->given->list, pointer, "%.80s must be a number there",
                    factor->source->text);
    } else if (json_number_value(value) < factor->lowest ||
               json_number_value(value) > factor->highest) {
        (void)json_array_append_new(beyond, json_pack("{s:I, s:s, s:f, s:f, s:f}", "index",
                                                      (json_int_t)index, "covariate", name, "value",
                                                      json_number_value(value), "lowest",
                                                      factor->lowest, "highest", factor->highest));
    }
}

static void check_point_names(const struct design_build *build, size_t index, json_t *point)
{
    const char *key;
    json_t *value;
    char pointer[64];

    (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu", index);
    json_object_foreach(point, key, value)
    {
        bool known = false;

        for (size_t f = 0; f < build->formula->factors; f++) {
            known = known ||
                    (build->factor[f].value && strcmp(build->formula->factor[f].name, key) == 0);
        }
        if (!known) {
            problem_add(build->given->list, pointer, "\"%.60s\" is no covariate of the formula",
                        key);
        }
    }
}

static void set_points(const struct design_build *build, const struct columns *columns,
                       const json_t *at, json_t *design)
{
    json_t *points = json_array(), *rows = json_array(), *beyond = json_array();

    for (size_t k = 0; k < json_array_size(at); k++) {
        json_t *point = json_deep_copy(json_array_get(at, k));
        double row[FORMULA_FACTORS_MAX] = {0};

        check_point_names(build, k, point);
        for (size_t f = 0; f < build->formula->factors; f++) {
            if (build->factor[f].value) {
                read_point(build, f, k, point, beyond, row);
            }
        }
        (void)json_array_append_new(rows, row_json(build, columns, row));
        (void)json_array_append_new(points, point);
    }
    (void)json_object_set_new(design, "at", points);
    (void)json_object_set_new(design, "atRows", rows);
    (void)json_object_set_new(design, "beyond", beyond);
}

/* ---- The whole ------------------------------------------------------------------------------- */

static void set_design(const struct design_build *build, const struct columns *columns,
                       json_t *cohort, const json_t *at)
{
    json_t *design = json_object(), *rows = json_array(), *names = json_array();
    json_t *terms = terms_json(build, columns);

    for (size_t i = 0; i < build->n; i++) {
        double row[FORMULA_FACTORS_MAX] = {0};

        for (size_t f = 0; f < build->formula->factors; f++) {
            row[f] = build->factor[f].value ? build->factor[f].value[i] : 0.0;
        }
        (void)json_array_append_new(rows, row_json(build, columns, row));
    }
    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(names, column_name(build, &columns->column[c]));
    }
    (void)json_object_set(design, "formula", json_object_get(build->given->canonical, "formula"));
    (void)json_object_set_new(design, "rows", rows);
    (void)json_object_set_new(design, "columns", names);
    (void)json_object_set_new(design, "terms", terms);
    if (check_columns(build, rows, names)) {
        (void)json_object_set_new(design, "tests", tests_json(build, columns, terms));
        set_points(build, columns, at, design);
    }
    (void)json_object_set_new(cohort, "design", design);
}

void design_describe(struct process_inputs *given, const struct formula *formula,
                     const json_t *members, json_t *cohort, const json_t *at)
{
    struct design_build build = {.given = given, .formula = formula, .members = members};
    struct columns *columns = srnf_alloc(1, sizeof *columns);

    build.n = json_array_size(members);
    if (!columns) {
        json_memory_fail();
    } else if (design_factors_read(&build) && make_columns(&build, columns)) {
        set_design(&build, columns, cohort, at);
    }
    design_factors_clear(&build);
    srnf_free(columns);
}

/* ---- Typed ----------------------------------------------------------------------------------- */

static double *type_rows(const json_t *rows, size_t n, size_t columns)
{
    double *values = srnf_alloc(n * columns + 1, sizeof *values);

    for (size_t k = 0; values && k < n * columns; k++) {
        values[k] =
            json_number_value(json_array_get(json_array_get(rows, k / columns), k % columns));
    }
    return values;
}

/* The columns of the design with these numbers, and the sum of those to be merged as one more. */
static double *pick(const struct design_input *input, size_t n, const json_t *numbers,
                    const json_t *merged)
{
    size_t more = json_array_size(merged) > 0, count = json_array_size(numbers) + more;
    size_t columns = input->design.columns;
    double *values = srnf_alloc(n * count + 1, sizeof *values);

    for (size_t i = 0; values && i < n; i++) {
        const double *row = input->values + i * columns;

        for (size_t k = 0; k + more < count; k++) {
            values[i * count + k] = row[json_integer_value(json_array_get(numbers, k))];
        }
        for (size_t k = 0; k < json_array_size(merged); k++) {
            values[i * count + count - 1] += row[json_integer_value(json_array_get(merged, k))];
        }
    }
    return values;
}

bool design_type(const json_t *design, size_t n, struct design_input *input)
{
    const json_t *tests = json_object_get(design, "tests");
    size_t columns = json_array_size(json_object_get(design, "columns"));
    size_t points = json_array_size(json_object_get(design, "atRows"));
    size_t count = json_array_size(tests);
    bool good;

    *input =
        (struct design_input){.design = {.columns = columns, .tests = count, .points = points}};
    input->values = type_rows(json_object_get(design, "rows"), n, columns);
    input->at = type_rows(json_object_get(design, "atRows"), points, columns);
    input->nested = srnf_alloc(count + 1, sizeof *input->nested);
    input->columns = srnf_alloc(2 * count + 1, sizeof *input->columns);
    good = input->values && input->at && input->nested && input->columns;
    for (size_t t = 0; good && t < count; t++) {
        const json_t *test = json_array_get(tests, t);
        const json_t *reduced = json_object_get(test, "reduced");
        const json_t *tested = json_object_get(test, "tested");
        const json_t *merged = json_object_get(test, "merged");

        input->columns[2 * t] = pick(input, n, reduced, merged);
        input->columns[2 * t + 1] = pick(input, n, tested, NULL);
        input->nested[t] = (struct srnf_nested){
            json_array_size(reduced) + (json_array_size(merged) > 0), json_array_size(tested),
            input->columns[2 * t], input->columns[2 * t + 1]};
        good = input->columns[2 * t] && input->columns[2 * t + 1];
    }
    input->design.values = input->values;
    input->design.at = input->at;
    input->design.nested = input->nested;
    return good;
}

void design_clear(struct design_input *input)
{
    for (size_t t = 0; input->columns && t < 2 * input->design.tests; t++) {
        srnf_free(input->columns[t]);
    }
    srnf_free(input->columns);
    srnf_free(input->nested);
    srnf_free(input->values);
    srnf_free(input->at);
    *input = (struct design_input){0};
}
