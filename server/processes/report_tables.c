/*
 * report_tables.c - tables of an object's members: its figures, the lists that go with its labels,
 * and matrices with the names of their rows.
 */
#include "processes/report.h"

#include <string.h>

/* What the rows of an object's lists are called: its labels, or its subjects. */
static const char *const namers[] = {"labels", "subjects"};

static const char *namer_of(const json_t *object)
{
    bool labels = json_is_array(json_object_get(object, namers[0]));

    return namers[labels ? 0 : 1];
}

/* Whether a member is a list that goes with the names of rows: a column of the table of these. */
static bool is_beside(const json_t *names, const json_t *value)
{
    return json_array_size(names) > 1 && json_array_size(value) == json_array_size(names) &&
           !json_is_object(json_array_get(value, 0)) && !json_is_array(json_array_get(value, 0));
}

/* What is looked for first is said first. */
static const char *const answers[] = {"pValue", "pValueInterval", "distance", "distanceInterval"};

static bool is_answer(const char *name)
{
    for (size_t i = 0; i < sizeof answers / sizeof answers[0]; i++) {
        if (strcmp(answers[i], name) == 0) {
            return true;
        }
    }
    return false;
}

static void put_figure(FILE *out, const json_t *object, const char *name, bool *any)
{
    const json_t *names = json_object_get(object, namer_of(object));
    const json_t *member = json_object_get(object, name);

    if (!member || !report_is_told(name, member) || !report_is_cell(member) ||
        is_beside(names, member)) {
        return;
    }
    (void)fputs(*any ? "" : "<table class=\"figures\"><tbody>", out);
    (void)fputs("<tr><th scope=\"row\">", out);
    report_words(out, name);
    (void)fputs("</th><td>", out);
    report_put_cell(out, object, name);
    (void)fputs("</td></tr>", out);
    *any = true;
}

void report_figures(FILE *out, const json_t *object)
{
    bool any = false;
    json_t *member;
    const char *name;

    for (size_t i = 0; i < sizeof answers / sizeof answers[0]; i++) {
        put_figure(out, object, answers[i], &any);
    }
    json_object_foreach((json_t *)(uintptr_t)object, name, member)
    {
        if (!is_answer(name)) {
            put_figure(out, object, name, &any);
        }
    }
    (void)fputs(any ? "</tbody></table>" : "", out);
}

void report_beside(FILE *out, const json_t *object)
{
    const json_t *names = json_object_get(object, namer_of(object));
    const json_t *columns[REPORT_COLUMNS_MAX] = {names};
    size_t n_columns = 1, n = json_array_size(names);
    json_t *member;
    const char *name;

    if (!is_beside(names, names)) {
        return;
    }
    (void)fputs("<table><thead><tr><th scope=\"col\">", out);
    report_words(out, namer_of(object));
    json_object_foreach((json_t *)(uintptr_t)object, name, member)
    {
        if (member != names && report_is_told(name, member) && is_beside(names, member) &&
            n_columns < REPORT_COLUMNS_MAX) {
            columns[n_columns++] = member;
            (void)fputs("</th><th scope=\"col\">", out);
            report_words(out, name);
        }
    }
    (void)fputs("</th></tr></thead><tbody>", out);
    for (size_t i = 0; i < n && i < REPORT_ROWS_MAX; i++) {
        for (size_t k = 0; k < n_columns; k++) {
            (void)fputs(k ? "</td><td>" : "<tr><td>", out);
            report_scalar(out, json_array_get(columns[k], i));
        }
        (void)fputs("</td></tr>", out);
    }
    (void)fputs("</tbody></table>", out);
    if (n > REPORT_ROWS_MAX) {
        (void)fprintf(out, "<p class=\"quiet\">and %zu more rows.</p>", n - REPORT_ROWS_MAX);
    }
}

/* Names of as many rows or columns, by what the result calls them, or NULL. */
static const json_t *names_of(const struct report_page *page, const json_t *object, size_t n)
{
    static const char *const lists[] = {"labels", "subjects", "classes"};

    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
        const json_t *own = json_object_get(object, lists[i]);
        const json_t *names = own ? own : json_object_get(page->results, lists[i]);

        if (json_array_size(names) == n && json_is_string(json_array_get(names, 0))) {
            return names;
        }
    }
    return NULL;
}

/* Whether a matrix is of points or directions, with a column for each axis. */
static bool has_axes(const char *name, size_t columns)
{
    return columns == 3 && (strcmp(name, "rotation") == 0 || strcmp(name, "mean") == 0);
}

static const char *const axes[] = {"x", "y", "z"};

/* The name of the k-th part, or NULL. */
static const json_t *part_of(const struct report_page *page, size_t k)
{
    return json_object_get(json_array_get(json_object_get(page->results, "parts"), k), "name");
}

/* The name of a column: of a square matrix as its rows; scores are of components, shares of parts
   and of their positions, points of axes. */
static void put_column(const struct report_page *page, const char *name, const json_t *square,
                       size_t k, size_t columns)
{
    const json_t *part = part_of(page, k);
    FILE *out = page->body;

    (void)fputs("<th scope=\"col\">", out);
    if (square) {
        (void)fputs(strcmp(name, "confusion") == 0 ? "taken for " : "", out);
        report_text(out, json_string_value(json_array_get(square, k)));
    } else if (strcmp(name, "scores") == 0) {
        (void)fprintf(out, "component %zu", k + 1);
    } else if (strcmp(name, "shares") == 0) {
        report_text(out, part ? json_string_value(part) : "positions");
    } else if (has_axes(name, columns)) {
        (void)fputs(axes[k], out);
    } else {
        (void)fprintf(out, "%zu", k + 1);
    }
    (void)fputs("</th>", out);
}

/* The name of a row: of names, or of a part or axis. */
static void put_row_name(const struct report_page *page, const char *name, const json_t *names,
                         size_t rows, size_t i)
{
    FILE *out = page->body;
    size_t n_parts = json_array_size(json_object_get(page->results, "parts"));

    if (names) {
        report_text(out, json_string_value(json_array_get(names, i)));
    } else if (strcmp(name, "mean") == 0 && rows == n_parts && part_of(page, i)) {
        report_text(out, json_string_value(part_of(page, i)));
    } else if (strcmp(name, "rotation") == 0 && rows == 3) {
        (void)fputs(axes[i], out);
    } else {
        (void)fprintf(out, "%zu", i + 1);
    }
}

void report_matrix(const struct report_page *page, const json_t *object, const char *name,
                   const json_t *matrix)
{
    size_t n = json_array_size(matrix), m = json_array_size(json_array_get(matrix, 0)), i;
    const json_t *names = names_of(page, object, n), *row;
    FILE *out = page->body;

    (void)fputs("<table class=\"matrix\"><thead><tr><td></td>", out);
    for (size_t k = 0; k < m; k++) {
        put_column(page, name, m == n ? names : NULL, k, m);
    }
    (void)fputs("</tr></thead><tbody>", out);
    json_array_foreach(matrix, i, row)
    {
        (void)fputs("<tr><th scope=\"row\">", out);
        put_row_name(page, name, names, n, i);
        (void)fputs("</th>", out);
        for (size_t k = 0; k < json_array_size(row); k++) {
            (void)fputs("<td>", out);
            report_scalar(out, json_array_get(row, k));
            (void)fputs("</td>", out);
        }
        (void)fputs("</tr>", out);
    }
    (void)fputs("</tbody></table>", out);
}
