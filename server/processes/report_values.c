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
#define MATRIX_MAX 24 /* rows of a matrix that is shown as a table */

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

/* ---- Tables ---------------------------------------------------------------------------------- */

/* A table under construction: its columns, and the rows so far. */
struct rows {
    FILE *out;
    const char *columns[REPORT_COLUMNS_MAX];
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
        const json_t *value = json_object_get(row, called[i]);

        if (value && !json_is_null(value) && !json_is_object(value) && !json_is_array(value)) {
            rows->columns[rows->n_columns++] = called[i];
        }
    }
    json_object_foreach(object_of(row), name, member)
    {
        size_t k = 0;

        while (k < rows->n_columns && strcmp(rows->columns[k], name) != 0) {
            k++;
        }
        if (k == rows->n_columns && k < REPORT_COLUMNS_MAX && report_is_told(name, member) &&
            report_is_cell(member)) {
            rows->columns[rows->n_columns++] = name;
        }
    }
}

/* After add_columns of all rows; key: NULL in a list; of: what the key is of, or NULL. */
static void put_row(struct rows *rows, const char *of, const char *key, const json_t *row)
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
        report_text(rows->out, of ? of : "");
        (void)fputs(of ? ", " : "", rows->out);
        report_text(rows->out, key);
        (void)fputs("</th>", rows->out);
    }
    for (size_t k = 0; k < rows->n_columns; k++) {
        (void)fputs("<td>", rows->out);
        report_put_cell(rows->out, row, rows->columns[k]);
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

    return json_array_size(first) > 0 && !json_is_array(json_array_get(first, 0)) &&
           !json_is_object(json_array_get(first, 0)) && json_array_size(value) <= MATRIX_MAX &&
           json_array_size(first) <= MATRIX_MAX;
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

/* What is keyed in the rows of a list, such as what each method says of each structure: a table. */
static void put_keyed(FILE *out, const json_t *list, int depth)
{
    const char *name = NULL, *key;
    struct rows rows = {.out = out};
    const json_t *one;
    json_t *member;
    size_t i;

    json_object_foreach(object_of(json_array_get(list, 0)), key, member)
    {
        if (!name && report_is_told(key, member) && !is_record(member, "") && is_keyed(member)) {
            name = key;
        }
    }
    if (!name) {
        return;
    }
    put_heading(out, name, depth + 1);
    json_array_foreach(list, i, one)
    {
        json_object_foreach(json_object_get(one, name), key, member)
        {
            add_columns(&rows, member);
        }
    }
    json_array_foreach(list, i, one)
    {
        json_object_foreach(json_object_get(one, name), key, member)
        {
            put_row(&rows, json_string_value(json_object_get(one, "name")), key, member);
        }
    }
    end_rows(&rows);
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
        put_row(&rows, NULL, NULL, one);
    }
    end_rows(&rows);
    put_keyed(page->body, list, depth);
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
        put_row(&rows, NULL, key, member);
    }
    end_rows(&rows);
    json_object_foreach(object_of(value), key, member)
    {
        json_t *rest = json_object();
        const char *inner;
        json_t *one;

        json_object_foreach(member, inner, one)
        {
            if (!report_is_cell(one)) {
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

/* What matters of a mesh. */
static void put_mesh(FILE *out, const char *name, const json_t *mesh, int depth)
{
    static const char *const kept[] = {"area", "volume", "genus", "components", "route"};
    const json_t *report = json_object_get(mesh, "report");
    json_t *figures = json_object();

    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; i++) {
        (void)json_object_set(figures, kept[i], json_object_get(report, kept[i]));
    }
    (void)json_object_set(figures, "name", json_object_get(mesh, "name"));
    (void)json_object_set(figures, "vertices", json_object_get(mesh, "vertices"));
    (void)json_object_set(figures, "faces", json_object_get(mesh, "faces"));
    (void)json_object_set(figures, "canBeAnalysed", json_object_get(report, "analysable"));
    put_heading(out, name, depth);
    report_figures(out, figures);
    json_decref(figures);
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
    if (is_record(value, "mesh-")) {
        put_mesh(page->body, name, value, depth);
        return true;
    }
    if (report_is_landmarks(name, value)) {
        put_heading(page->body, name, depth);
        report_landmarks(page->body, value, json_object_get(object, "labels"));
        return true;
    }
    if (report_is_replicates(name, value)) {
        put_heading(page->body, "repeated measurements", depth);
        report_replicates(page->body, value,
                          json_array_size(json_object_get(object, "perSubject")));
        return true;
    }
    if (json_is_object(first)) {
        return put_objects(page, name, value, depth);
    }
    if (is_matrix(value)) {
        put_heading(page->body, name, depth);
        report_matrix(page, object, name, value);
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
    report_figures(page->body, object);
    if (!neighbours) {
        report_beside(page->body, object);
    } else {
        report_neighbours(page->body, object);
    }
    json_object_foreach(object_of(object), name, member)
    {
        bool told = neighbours && json_is_array(json_array_get(member, 0));

        if (good && !told && report_is_told(name, member) && !report_is_cell(member)) {
            good = put_member(page, object, name, member, depth) &&
                   !(context->canceled && context->canceled(context->user));
        }
    }
    return good;
}
