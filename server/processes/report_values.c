/*
 * report_values.c - the results of any process as HTML.
 *
 * It goes by what values are, and knows no process: scalars and short lists become rows of a table,
 * lists of objects tables with a row each, square matrices tables, records of surfaces and models
 * figures. Other objects become parts of their own. Long arrays of numbers are left to the API, and
 * so is what the head of a section tells in words.
 */
#include "processes/report.h"

#include <string.h>

#define DEPTH_MAX 4
#define SHORT_MAX 8   /* elements of what fits into a cell */
#define TEXTS_MAX 200 /* the same of texts */
#define MATRIX_MAX 24 /* rows of a matrix that is shown as a table */
#define COLUMNS_MAX 16

static const char *const passed_over[] = {"inputs", "warnings", "numericBuild",
                                          "links",  "history",  "registration",
                                          "map",    "madeFrom", NULL};

static bool is_passed_over(const char *name)
{
    size_t i = 0;

    while (passed_over[i] && strcmp(passed_over[i], name) != 0) {
        i++;
    }
    return passed_over[i] != NULL;
}

/* What json_object_foreach takes: it does not change the object. */
static json_t *object_of(const json_t *value)
{
    return (json_t *)(uintptr_t)value;
}

static bool is_record(const json_t *value, const char *kind)
{
    const char *id = json_string_value(json_object_get(value, "id"));

    return id && strncmp(id, kind, strlen(kind)) == 0;
}

static bool is_scalar(const json_t *value)
{
    return value && !json_is_object(value) && !json_is_array(value);
}

/* ---- Cells ----------------------------------------------------------------------------------- */

/* Scalars, and lists of a few. */
static bool is_list(const json_t *value)
{
    size_t n = json_array_size(value), i;
    const json_t *one;

    if (!json_is_array(value) || n == 0 ||
        n > (json_is_string(json_array_get(value, 0)) ? TEXTS_MAX : SHORT_MAX)) {
        return false;
    }
    json_array_foreach(value, i, one)
    {
        if (!is_scalar(one)) {
            return false;
        }
    }
    return true;
}

/* An object of a few scalars or short lists, such as {age: 50, site: A}. */
static bool is_small(const json_t *value)
{
    json_t *member;
    const char *name;

    if (!json_is_object(value) || json_object_size(value) == 0 ||
        json_object_size(value) > SHORT_MAX) {
        return false;
    }
    json_object_foreach(object_of(value), name, member)
    {
        if (!is_scalar(member) && !is_list(member)) {
            return false;
        }
    }
    return true;
}

static bool is_cell(const json_t *value)
{
    return is_scalar(value) || is_list(value) || (is_small(value) && !is_record(value, ""));
}

static void put_list(FILE *out, const json_t *list)
{
    const json_t *one;
    size_t i;

    json_array_foreach(list, i, one)
    {
        (void)fputs(i ? ", " : "", out);
        report_scalar(out, one);
    }
}

static void put_cell(FILE *out, const json_t *value)
{
    json_t *member;
    const char *name, *before = "";

    if (json_is_array(value)) {
        put_list(out, value);
        return;
    }
    if (!json_is_object(value)) {
        report_scalar(out, value);
        return;
    }
    json_object_foreach(object_of(value), name, member)
    {
        (void)fputs(before, out);
        report_words(out, name);
        (void)fputs(": ", out);
        put_cell(out, member);
        before = "; ";
    }
}

/* ---- Tables ---------------------------------------------------------------------------------- */

/* The members of an object that are cells, a row each. */
static void put_figures(FILE *out, const json_t *object)
{
    bool any = false;
    json_t *member;
    const char *name;

    json_object_foreach(object_of(object), name, member)
    {
        if (is_passed_over(name) || !is_cell(member) || json_is_null(member)) {
            continue;
        }
        (void)fputs(any ? "<tr><th scope=\"row\">" : "<table><tbody><tr><th scope=\"row\">", out);
        report_words(out, name);
        (void)fputs("</th><td>", out);
        put_cell(out, member);
        (void)fputs("</td></tr>", out);
        any = true;
    }
    (void)fputs(any ? "</tbody></table>" : "", out);
}

/* A table under construction: its columns, and the rows so far. */
struct rows {
    FILE *out;
    const char *columns[COLUMNS_MAX];
    size_t n_columns, n;
};

/* Adds the names of the cells of a row that other rows did not have; what rows are called by stands
   first. */
static void add_columns(struct rows *rows, const json_t *row)
{
    static const char *const called[] = {"name", "subject", "member"};
    json_t *member;
    const char *name;

    for (size_t i = 0; rows->n_columns == 0 && i < sizeof called / sizeof called[0]; i++) {
        if (is_scalar(json_object_get(row, called[i]))) {
            rows->columns[rows->n_columns++] = called[i];
        }
    }
    json_object_foreach(object_of(row), name, member)
    {
        size_t k = 0;

        while (k < rows->n_columns && strcmp(rows->columns[k], name) != 0) {
            k++;
        }
        if (k == rows->n_columns && k < COLUMNS_MAX && !is_passed_over(name) && is_cell(member)) {
            rows->columns[rows->n_columns++] = name;
        }
    }
}

/* After add_columns of all rows; key: NULL in a list. */
static void put_row(struct rows *rows, const char *key, const json_t *row)
{
    if (rows->n == 0) {
        (void)fputs(rows->n_columns ? "<table><thead><tr>" : "", rows->out);
        (void)fputs(rows->n_columns && key ? "<td></td>" : "", rows->out);
        for (size_t k = 0; k < rows->n_columns; k++) {
            (void)fputs("<th scope=\"col\">", rows->out);
            report_words(rows->out, rows->columns[k]);
            (void)fputs("</th>", rows->out);
        }
        (void)fputs(rows->n_columns ? "</tr></thead><tbody>" : "", rows->out);
    }
    if (rows->n++ >= REPORT_ROWS_MAX || rows->n_columns == 0) {
        return;
    }
    (void)fputs("<tr>", rows->out);
    if (key) {
        (void)fputs("<th scope=\"row\">", rows->out);
        report_text(rows->out, key);
        (void)fputs("</th>", rows->out);
    }
    for (size_t k = 0; k < rows->n_columns; k++) {
        const json_t *cell = json_object_get(row, rows->columns[k]);

        (void)fputs("<td>", rows->out);
        put_cell(rows->out, cell && is_cell(cell) ? cell : json_null());
        (void)fputs("</td>", rows->out);
    }
    (void)fputs("</tr>", rows->out);
}

static void end_rows(struct rows *rows)
{
    if (rows->n_columns > 0) {
        (void)fputs("</tbody></table>", rows->out);
    }
    if (rows->n > REPORT_ROWS_MAX) {
        (void)fprintf(rows->out, "<p class=\"quiet\">and %zu more rows.</p>",
                      rows->n - REPORT_ROWS_MAX);
    }
}

/* A matrix, named by the labels of the result where they are as many. */
static void put_matrix(FILE *out, const json_t *matrix, const json_t *labels)
{
    size_t n = json_array_size(matrix), i;
    const json_t *row;

    (void)fputs("<table><tbody>", out);
    json_array_foreach(matrix, i, row)
    {
        (void)fputs("<tr>", out);
        if (json_array_size(labels) == n) {
            (void)fputs("<th scope=\"row\">", out);
            report_text(out, json_string_value(json_array_get(labels, i)));
            (void)fputs("</th>", out);
        }
        for (size_t k = 0; k < json_array_size(row); k++) {
            (void)fputs("<td>", out);
            report_scalar(out, json_array_get(row, k));
            (void)fputs("</td>", out);
        }
        (void)fputs("</tr>", out);
    }
    (void)fputs("</tbody></table>", out);
}

/* ---- Members --------------------------------------------------------------------------------- */

static void put_heading(FILE *out, const char *name, int depth)
{
    int level = depth < 3 ? depth + 3 : 6;

    (void)fprintf(out, "<h%d>", level);
    report_words(out, name);
    (void)fprintf(out, "</h%d>", level);
}

static bool is_matrix(const json_t *value)
{
    const json_t *first = json_array_get(value, 0);

    return json_is_array(first) && is_scalar(json_array_get(first, 0)) &&
           json_array_size(value) <= MATRIX_MAX && json_array_size(first) <= MATRIX_MAX;
}

/* A list of objects: a table, and what its rows have beside cells. */
static bool put_objects(struct report_page *page, const char *name, const json_t *list, int depth)
{
    struct rows rows = {.out = page->body};
    const json_t *one;
    bool good = true;
    size_t i;

    put_heading(page->body, name, depth);
    json_array_foreach(list, i, one)
    {
        add_columns(&rows, one);
    }
    json_array_foreach(list, i, one)
    {
        put_row(&rows, NULL, one);
    }
    end_rows(&rows);
    if (depth == 0 && report_is_rows(list)) {
        return report_rows(page, name, list);
    }
    json_array_foreach(list, i, one)
    {
        const json_t *surface = json_object_get(one, "surface");

        good = good && (!is_record(surface, "surf-") || report_surface(page, surface));
    }
    return good;
}

/* An object whose members are all objects, such as one for each method. */
static bool is_keyed(const json_t *value)
{
    json_t *member;
    const char *name;

    json_object_foreach(object_of(value), name, member)
    {
        if (!json_is_object(member) || is_record(member, "")) {
            return false;
        }
    }
    return json_object_size(value) > 0;
}

static bool put_part(struct report_page *page, const char *name, const json_t *value, int depth)
{
    struct rows rows = {.out = page->body};
    bool good = true;
    json_t *member;
    const char *key;

    put_heading(page->body, name, depth);
    if (!is_keyed(value)) {
        return report_members(page, value, depth + 1);
    }
    json_object_foreach(object_of(value), key, member)
    {
        add_columns(&rows, member);
    }
    json_object_foreach(object_of(value), key, member)
    {
        put_row(&rows, key, member);
    }
    end_rows(&rows);
    json_object_foreach(object_of(value), key, member)
    {
        json_t *rest = json_object();
        const char *inner;
        json_t *one;

        json_object_foreach(member, inner, one)
        {
            if (!is_cell(one)) {
                (void)json_object_set(rest, inner, one);
            }
        }
        if (good && json_object_size(rest) > 0) {
            put_heading(page->body, key, depth + 1);
            good = report_members(page, rest, depth + 2);
        }
        json_decref(rest);
    }
    return good;
}

static bool put_member(struct report_page *page, const json_t *object, const char *name,
                       const json_t *value, int depth)
{
    const json_t *first = json_array_get(value, 0);

    if (is_record(value, "surf-")) {
        return report_surface(page, value);
    }
    if (is_record(value, "model-")) {
        return report_model(page, value);
    }
    if (is_record(first, "surf-")) {
        return report_path(page, value);
    }
    if (json_is_object(first)) {
        return put_objects(page, name, value, depth);
    }
    if (is_matrix(value)) {
        put_heading(page->body, name, depth);
        put_matrix(page->body, value, json_object_get(object, "labels"));
        return true;
    }
    return !json_is_object(value) || json_object_size(value) == 0 ||
           put_part(page, name, value, depth);
}

bool report_members(struct report_page *page, const json_t *object, int depth)
{
    const struct srnf_context *context = jobs_run_context(page->run);
    bool good = true, neighbours = report_is_neighbours(object);
    json_t *member;
    const char *name;

    if (depth > DEPTH_MAX) {
        return true;
    }
    put_figures(page->body, object);
    if (neighbours) {
        report_neighbours(page->body, object);
    }
    json_object_foreach(object_of(object), name, member)
    {
        bool told = neighbours && json_is_array(json_array_get(member, 0));

        if (good && !told && !is_passed_over(name) && !is_cell(member)) {
            good = put_member(page, object, name, member, depth) &&
                   !(context->canceled && context->canceled(context->user));
        }
    }
    return good;
}
