/*
 * report_rows.c - what of a result is seen as a whole: surfaces predicted at points of covariates,
 * structures of a subject with their joint modes, neighbours by their names, landmarks, and the
 * analysis of variance of repeated measurements.
 *
 * A view of rows names the section and the list, whose results the page has, and has the shape of
 * each row or -1: the page decides by the rows what moves what (web/src/report_view.tsx).
 */
#include "processes/report.h"

#include <string.h>

#define NEIGHBOURS_MAX 10 /* of a member, in a table */

/* The surface of a row, or NULL. */
static const json_t *surface_of(const json_t *row)
{
    const json_t *surface = json_object_get(row, "surface");

    return surface ? surface : json_object_get(row, "mean");
}

static bool has_surface(const json_t *row)
{
    const char *id = json_string_value(json_object_get(surface_of(row), "id"));

    return id && strncmp(id, "surf-", 5) == 0;
}

bool report_is_rows(const json_t *list)
{
    const json_t *first = json_array_get(list, 0);

    return has_surface(first) &&
           (json_is_object(json_object_get(first, "at")) ||
            json_is_string(json_object_get(first, "part")) || json_object_get(first, "mean"));
}

bool report_rows(struct report_page *page, const char *name, const json_t *list)
{
    const json_t *row;
    json_t *shapes = json_array();
    bool good = true;
    size_t i, kept = 0;

    json_array_foreach(list, i, row)
    {
        long shape = good && has_surface(row) ? report_shape(page, surface_of(row)) : REPORT_NONE;

        good = good && shape != REPORT_FAILED;
        kept += shape >= 0;
        (void)json_array_append_new(shapes, json_integer(shape >= 0 ? shape : REPORT_NONE));
    }
    if (good && kept > 0) {
        json_t *view = json_pack("{s:s, s:I, s:s, s:O}", "kind", "rows", "section",
                                 (json_int_t)page->n_sections, "list", name, "shapes", shapes);

        good = report_figure(page, view, "wide");
        report_words(page->body, name);
        (void)fprintf(page->body, "%s</figcaption></figure>",
                      kept < json_array_size(list) ? ", not all of them shown" : "");
    } else if (good) {
        report_not_shown(page, name);
    }
    json_decref(shapes);
    return good;
}

/* ---- Neighbours ------------------------------------------------------------------------------ */

bool report_is_neighbours(const json_t *object)
{
    const json_t *indices = json_object_get(object, "indices");
    const json_t *distances = json_object_get(object, "distances");
    size_t n = json_array_size(json_object_get(object, "labels"));

    return n > 0 && json_array_size(indices) == n && json_array_size(distances) == n &&
           json_is_integer(json_array_get(json_array_get(indices, 0), 0));
}

static void put_member(FILE *out, const json_t *labels, json_int_t i)
{
    report_text(out, json_string_value(json_array_get(labels, (size_t)i)));
}

void report_neighbours(FILE *out, const json_t *object)
{
    const json_t *labels = json_object_get(object, "labels");
    const json_t *indices = json_object_get(object, "indices"), *row;
    const json_t *distances = json_object_get(object, "distances");
    size_t i;

    (void)fputs("<h3>nearest, with distances</h3><table><tbody>", out);
    json_array_foreach(indices, i, row)
    {
        if (i >= REPORT_ROWS_MAX) {
            break;
        }
        (void)fputs("<tr><th scope=\"row\">", out);
        put_member(out, labels, (json_int_t)i);
        (void)fputs("</th>", out);
        for (size_t k = 0; k < json_array_size(row) && k < NEIGHBOURS_MAX; k++) {
            (void)fputs("<td>", out);
            put_member(out, labels, json_integer_value(json_array_get(row, k)));
            (void)fputs(" (", out);
            report_scalar(out, json_array_get(json_array_get(distances, i), k));
            (void)fputs(")</td>", out);
        }
        (void)fputs("</tr>", out);
    }
    (void)fputs("</tbody></table>", out);
    if (json_array_size(indices) > REPORT_ROWS_MAX) {
        (void)fprintf(out, "<p class=\"quiet\">and %zu more members.</p>",
                      json_array_size(indices) - REPORT_ROWS_MAX);
    }
}

/* ---- Landmarks ------------------------------------------------------------------------------- */

#define MET 1e-9 /* radians: rounding */

bool report_is_landmarks(const char *name, const json_t *value)
{
    return strcmp(name, "landmarks") == 0 &&
           json_is_object(json_array_get(json_object_get(value, "points"), 0));
}

static bool is_met(const json_t *angle)
{
    return json_is_number(angle) && json_number_value(angle) < MET;
}

/* What is left at the landmarks of a kind, in a sentence. */
static void put_kind(FILE *out, const char *before, const json_t *of)
{
    if (!json_is_object(of)) {
        return;
    }
    (void)fprintf(out, "<p>%s", before);
    report_scalar(out, json_object_get(of, "count"));
    if (is_met(json_object_get(of, "maxAngle"))) {
        (void)fputs(", all of them met exactly.</p>", out);
        return;
    }
    (void)fputs(": a root mean square of ", out);
    report_scalar(out, json_object_get(of, "rmsDistance"));
    (void)fputs(", at most ", out);
    report_scalar(out, json_object_get(of, "maxDistance"));
    (void)fputs(".</p>", out);
}

/* The heads of a table with a column for each landmark. */
static void put_numbers(FILE *out, const json_t *points)
{
    const json_t *point;
    size_t i;

    (void)fputs("<table><thead><tr><th scope=\"col\">member</th>", out);
    json_array_foreach(points, i, point)
    {
        (void)fprintf(out, "<th scope=\"col\">landmark %zu%s</th>", i + 1,
                      json_is_true(json_object_get(point, "heldOut")) ? " (held out)" : "");
    }
    (void)fputs("</tr></thead><tbody>", out);
}

/* The distances that are left in each member of a group. */
static void put_members(FILE *out, const json_t *landmarks, const json_t *labels)
{
    const json_t *members = json_object_get(landmarks, "members"), *one;
    size_t i;

    put_numbers(out, json_object_get(landmarks, "points"));
    json_array_foreach(members, i, one)
    {
        const json_t *distances = json_object_get(one, "distances");
        const json_t *angles = json_object_get(one, "angles");

        if (i >= REPORT_ROWS_MAX) {
            break;
        }
        (void)fputs("<tr><th scope=\"row\">", out);
        report_scalar(out, json_array_get(labels, i));
        for (size_t k = 0; k < json_array_size(distances); k++) {
            (void)fputs(k ? "</td><td>" : "</th><td>", out);
            if (is_met(json_array_get(angles, k))) {
                (void)fputs("met", out);
            } else {
                report_scalar(out, json_array_get(distances, k));
            }
        }
        (void)fputs("</td></tr>", out);
    }
    (void)fputs("</tbody></table>", out);
}

/* The columns of what is left at each landmark: of a group, and of a pair. */
static const char *const of_group[] = {"heldOut",  "rmsDistance", "maxDistance",
                                       "rmsAngle", "maxAngle",    "position"};
static const char *const of_pair[] = {"heldOut", "distance", "angle", "offFixed", "offMoving"};

static void put_points(FILE *out, const json_t *points, const char *const *columns, size_t n)
{
    const json_t *point;
    size_t i;

    (void)fputs("<table><thead><tr><th scope=\"col\">landmark</th>", out);
    for (size_t k = 0; k < n; k++) {
        (void)fputs("<th scope=\"col\">", out);
        report_words(out, columns[k]);
        (void)fputs("</th>", out);
    }
    (void)fputs("</tr></thead><tbody>", out);
    json_array_foreach(points, i, point)
    {
        (void)fprintf(out, "<tr><th scope=\"row\">%zu</th>", i + 1);
        for (size_t k = 0; k < n; k++) {
            (void)fputs("<td>", out);
            report_put_cell(out, point, columns[k]);
            (void)fputs("</td>", out);
        }
        (void)fputs("</tr>", out);
    }
    (void)fputs("</tbody></table>", out);
}

void report_landmarks(FILE *out, const json_t *landmarks, const json_t *labels)
{
    const json_t *points = json_object_get(landmarks, "points");
    bool group = json_is_array(json_object_get(landmarks, "members"));

    put_kind(out, "Landmarks that guided: ", json_object_get(landmarks, "guiding"));
    put_kind(out, "Held out: ", json_object_get(landmarks, "heldOut"));
    if (group) {
        put_points(out, points, of_group, sizeof of_group / sizeof of_group[0]);
        put_members(out, landmarks, labels);
    } else {
        put_points(out, points, of_pair, sizeof of_pair / sizeof of_pair[0]);
    }
}

/* ---- Repeated measurements ------------------------------------------------------------------- */

bool report_is_replicates(const char *name, const json_t *value)
{
    return strcmp(name, "replicates") == 0 && json_is_number(json_object_get(value, "interaction"));
}

static void put_interval(FILE *out, const json_t *interval)
{
    if (json_is_null(json_array_get(interval, 0)) && json_is_null(json_array_get(interval, 1))) {
        (void)fputs("unknown", out);
    } else {
        report_scalar(out, json_array_get(interval, 0));
        (void)fputs(" to ", out);
        report_scalar(out, json_array_get(interval, 1));
    }
}

/* interval: NULL where there is none. */
static void put_mean_square(FILE *out, const char *source, const json_t *square,
                            const json_t *interval, const json_t *freedom)
{
    (void)fprintf(out, "<tr><th scope=\"row\">%s</th><td>", source);
    report_scalar(out, square);
    (void)fputs("</td><td>", out);
    if (interval) {
        put_interval(out, interval);
    }
    (void)fputs("</td><td>", out);
    report_scalar(out, freedom);
    (void)fputs("</td></tr>", out);
}

static void put_estimate(FILE *out, const char *name, const json_t *estimate)
{
    (void)fprintf(out, "<tr><th scope=\"row\">%s</th><td>", name);
    report_scalar(out, json_object_get(estimate, "value"));
    (void)fputs("</td><td>", out);
    put_interval(out, json_object_get(estimate, "interval"));
    (void)fputs("</td></tr>", out);
}

void report_replicates(FILE *out, const json_t *replicates, size_t subjects)
{
    const json_t *freedom = json_object_get(replicates, "degreesOfFreedom");
    json_t *of_subjects = json_integer((json_int_t)subjects - 1), *of_sides = json_integer(1);

    (void)fputs("<p>Whether sides of a subject differ by more than measurements of one side do: p ",
                out);
    (void)fputs(json_is_true(json_object_get(replicates, "pValueIsFloor")) ? "≤ " : "= ", out);
    report_scalar(out, json_object_get(replicates, "pValue"));
    (void)fputs(", of ", out);
    report_scalar(out, json_object_get(replicates, "measurements"));
    (void)fputs(" measurements, by ", out);
    report_scalar(out, json_object_get(replicates, "permutations"));
    (void)fputs(" permutations of them within subjects.</p><table><thead><tr><th scope=\"col\">"
                "source</th><th scope=\"col\">mean square</th><th scope=\"col\">95 % "
                "interval</th><th scope=\"col\">degrees of "
                "freedom</th></tr></thead><tbody>",
                out);
    put_mean_square(out, "individual", json_object_get(replicates, "individual"),
                    json_object_get(replicates, "individualInterval"), of_subjects);
    put_mean_square(out, "side", json_object_get(replicates, "side"), NULL, of_sides);
    put_mean_square(out, "individual by side", json_object_get(replicates, "interaction"),
                    json_object_get(replicates, "interactionInterval"), json_array_get(freedom, 0));
    put_mean_square(out, "error of measurement", json_object_get(replicates, "error"),
                    json_object_get(replicates, "errorInterval"), json_array_get(freedom, 1));
    (void)fputs("</tbody></table><table><thead><tr><th scope=\"col\">quantity</th>"
                "<th scope=\"col\">value</th><th scope=\"col\">95 % interval</th></tr></thead>"
                "<tbody>",
                out);
    put_estimate(out, "F, individual by side over error", json_object_get(replicates, "f"));
    put_estimate(out, "fluctuating asymmetry without error (L2 of SRNFs)",
                 json_object_get(replicates, "fluctuating"));
    put_estimate(out, "error of one measurement (L2 of SRNFs)",
                 json_object_get(replicates, "measured"));
    put_estimate(out, "repeatability", json_object_get(replicates, "repeatability"));
    (void)fputs("</tbody></table>", out);
    json_decref(of_subjects);
    json_decref(of_sides);
}
