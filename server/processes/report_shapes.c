/*
 * report_shapes.c - surfaces as a report carries them.
 *
 * All are triangulated over one geodesic sphere, so that their faces are written once and a shape
 * between two is found by interpolation. Positions are 16 bits each, about the middle of the shape
 * in parts of its radius; maps 16 bits between the least and the largest value. That is finer than
 * a screen shows: 1/30,000 of the radius, and of the range of a map.
 *
 * A view refers to one shape or to several along a path: {"shapes", "at", "texts"}. Beyond
 * REPORT_SHAPES_MAX bytes a surface is named only, and counted for the warning shapes-omitted.
 */
#include "processes/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/surfaces.h"
#include "compute/model.h"
#include "store/surface.h"

#define CHUNK 256          /* vertices that are computed between two questions for cancellation */
#define PATH_MAX_SHAPES 11 /* of a path; longer ones are thinned out */
#define MODE_POINTS 4      /* along a mode, beside the mean */
#define TOO_LARGE "not shown, as the report would become too large."

/* ---- Numbers --------------------------------------------------------------------------------- */

struct base64 {
    FILE *out;
    unsigned char held[3];
    size_t n;
};

static void base64_write(struct base64 *text)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned char *b = text->held;
    const unsigned bits = (unsigned)b[0] << 16 | (unsigned)b[1] << 8 | b[2];
    char four[4] = {digits[bits >> 18], digits[bits >> 12 & 63], digits[bits >> 6 & 63],
                    digits[bits & 63]};

    for (size_t i = text->n + 1; i < 4; i++) {
        four[i] = '=';
    }
    (void)fwrite(four, 1, 4, text->out);
    *text = (struct base64){.out = text->out};
}

/* A number of 16 bits, little-endian. */
static void base64_put(struct base64 *text, unsigned value)
{
    for (int i = 0; i < 2; i++) {
        text->held[text->n++] = (unsigned char)(value >> 8 * i & 255);
        if (text->n == 3) {
            base64_write(text);
        }
    }
}

static void base64_end(struct base64 *text)
{
    if (text->n > 0) {
        base64_write(text);
    }
}

void report_faces(FILE *out, const struct srnf_mesh *sphere)
{
    struct base64 text = {.out = out};

    for (size_t i = 0; i < 3 * sphere->n_faces; i++) {
        base64_put(&text, sphere->faces[i]);
    }
    base64_end(&text);
}

/* ---- A shape --------------------------------------------------------------------------------- */

static bool canceled(const struct report_page *page)
{
    const struct srnf_context *context = jobs_run_context(page->run);

    return context->canceled && context->canceled(context->user);
}

/* Vertices of a surface, double[3][n], or NULL with the problem set or the run canceled. */
static double *vertices_of(struct report_page *page, size_t degree, const double *coefficients)
{
    const struct srnf_mesh *sphere = &page->sphere;
    size_t n = sphere->n_vertices;
    double *vertices = srnf_alloc(3 * n, sizeof(double));
    double part[3 * CHUNK];
    int status = vertices ? 0 : SRNF_ENOMEM;

    for (size_t i = 0; i < n && status == 0; i += CHUNK) {
        size_t count = n - i < CHUNK ? n - i : CHUNK;

        status = canceled(page) ? SRNF_ECANCELED
                                : srnf_harmonics_at_points(degree, 3, coefficients, count,
                                                           sphere->vertices + 3 * i, part, NULL);
        for (size_t k = 0; k < 3 && status == 0; k++) {
            memcpy(vertices + k * n + i, part + k * count, count * sizeof(double));
        }
    }
    if (status) {
        (void)compute_fail(page->result, status, NULL, "the shapes of the report");
        srnf_free(vertices);
        vertices = NULL;
    }
    return vertices;
}

/* The middle of the box around n points, and the radius about it. */
static double bounds_of(size_t n, const double *vertices, double middle[3])
{
    double radius = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double low = vertices[k * n], high = low;

        for (size_t i = 1; i < n; i++) {
            low = fmin(low, vertices[k * n + i]);
            high = fmax(high, vertices[k * n + i]);
        }
        middle[k] = 0.5 * (low + high);
    }
    for (size_t i = 0; i < n; i++) {
        double x = vertices[i] - middle[0], y = vertices[n + i] - middle[1];
        double z = vertices[2 * n + i] - middle[2];

        radius = fmax(radius, sqrt(x * x + y * y + z * z));
    }
    return radius > 0.0 ? radius : 1.0;
}

static void put_positions(FILE *out, size_t n, const double *vertices)
{
    struct base64 text = {.out = out};
    double middle[3], radius = bounds_of(n, vertices, middle);

    (void)fprintf(out, "\"list\":0,\"centre\":[%.9g,%.9g,%.9g],\"radius\":%.9g,\"positions\":\"",
                  middle[0], middle[1], middle[2], radius);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++) {
            long value = lround(32767.0 * (vertices[k * n + i] - middle[k]) / radius);

            base64_put(&text, (unsigned)value & 0xffffu);
        }
    }
    base64_end(&text);
    (void)fputs("\"", out);
}

/* One map at the vertices. Its least and largest values are those of its nodes, which results tell,
   and which need not lie at a vertex. */
static void put_map(FILE *out, const char *name, size_t points, const double *nodes, size_t n,
                    const double *values)
{
    struct base64 text = {.out = out};
    const char *unit = "1", *meaning = "";
    double low = nodes[0], high = low;

    for (size_t i = 0; i < points; i++) {
        low = fmin(low, nodes[i]);
        high = fmax(high, nodes[i]);
    }
    for (size_t i = 0; i < n; i++) {
        low = fmin(low, values[i]);
        high = fmax(high, values[i]);
    }
    surface_map_meaning(name, &unit, &meaning);
    (void)fprintf(out,
                  "{\"name\":\"%s\",\"unit\":\"%s\",\"meaning\":\"%s\",\"low\":%.9g,\"high\":%.9g,"
                  "\"values\":\"",
                  name, unit, meaning, low, high);
    for (size_t i = 0; i < n; i++) {
        base64_put(&text,
                   high > low ? (unsigned)lround(65535.0 * (values[i] - low) / (high - low)) : 0u);
    }
    base64_end(&text);
    (void)fputs("\"}", out);
}

/* The maps that are stored with a surface, and finite. */
static int put_maps(struct report_page *page, const struct store_surface *surface)
{
    struct jobs *jobs = jobs_run_jobs(page->run);
    struct store_maps maps = {.count = 0};
    const struct srnf_sht *sht = NULL;
    size_t n = page->sphere.n_vertices, points, put = 0;
    double *values = srnf_alloc(n, sizeof(double));
    int status = values ? 0 : SRNF_ENOMEM;

    if (status == 0 &&
        process_read(store_surface_maps(jobs_run_store(page->run), surface->id, &maps))) {
        status = jobs_transform_acquire(jobs, (size_t)surface->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                                        (size_t)maps.n_theta, (size_t)maps.n_phi, &sht);
    }
    points = (size_t)maps.n_theta * (size_t)maps.n_phi;
    for (size_t i = 0; sht && i < maps.count; i++) {
        bool finite = true;

        for (size_t p = 0; p < points; p++) {
            finite = finite && isfinite(maps.values[i * points + p]);
        }
        if (finite) {
            srnf_grid_interpolate(srnf_sht_grid(sht), maps.values + i * points, n,
                                  page->sphere.vertices, values);
            (void)fputs(put++ ? "," : "", page->shapes);
            put_map(page->shapes, maps.names[i], points, maps.values + i * points, n, values);
        }
    }
    if (sht) {
        jobs_transform_release(jobs, sht);
    }
    store_maps_clear(&maps);
    srnf_free(values);
    return status ? compute_fail(page->result, status, NULL, "the maps of the report") : 0;
}

/* Adds a shape with the maps of the surface (NULL: none). Its number, or -1 as vertices_of. */
static long add_shape(struct report_page *page, size_t degree, const double *coefficients,
                      const struct store_surface *surface)
{
    double *vertices = vertices_of(page, degree, coefficients);
    int status = 0;

    if (!vertices) {
        return -1;
    }
    (void)fputs(page->n_shapes ? ",{" : "{", page->shapes);
    put_positions(page->shapes, page->sphere.n_vertices, vertices);
    (void)fputs(",\"maps\":[", page->shapes);
    if (surface) {
        status = put_maps(page, surface);
    }
    (void)fputs("]}", page->shapes);
    srnf_free(vertices);
    return status ? -1 : (long)page->n_shapes++;
}

/* ---- Figures --------------------------------------------------------------------------------- */

static bool is_full(struct report_page *page)
{
    (void)fflush(page->shapes);
    return page->sizes[1] > REPORT_SHAPES_MAX;
}

bool report_figure(struct report_page *page, json_t *view, const char *kind)
{
    bool whole;

    (void)fputs(page->n_views ? "," : "", page->views);
    whole = view && report_json(page->views, view);
    (void)fprintf(page->body, "<figure class=\"shape%s%s\" data-view=\"%zu\"><figcaption>",
                  kind[0] ? " " : "", kind, page->n_views++);
    json_decref(view);
    if (!whole) {
        (void)compute_fail(page->result, SRNF_ENOMEM, NULL, "the views of the report");
    }
    return whole;
}

static void name_only(struct report_page *page, const char *name, const char *why)
{
    (void)fputs("<p class=\"quiet\">", page->body);
    report_text(page->body, name);
    (void)fprintf(page->body, ": %s</p>", why);
}

/* Loads a surface by its record. 1: it is not there any more; below 0 with the problem set. */
static int load(struct report_page *page, const json_t *record, struct store_surface *surface)
{
    const char *id = json_string_value(json_object_get(record, "id"));
    int status = store_surface_get(jobs_run_store(page->run), id, true, surface);

    if (status == STORE_NOT_FOUND) {
        return 1;
    }
    return status ? compute_fail_store(page->result, status, id) : 0;
}

static const char *name_of(const json_t *record)
{
    const char *name = json_string_value(json_object_get(record, "name"));

    return name && name[0] ? name : json_string_value(json_object_get(record, "id"));
}

long report_shape(struct report_page *page, const json_t *record)
{
    struct store_surface surface = {0};
    long shape = REPORT_NONE;
    int status;

    if (is_full(page)) {
        page->n_omitted++;
        return REPORT_NONE;
    }
    status = load(page, record, &surface);
    if (status == 0) {
        shape = add_shape(page, (size_t)surface.lmax, surface.coefficients, &surface);
    }
    store_surface_clear(&surface);
    return status < 0 || (status == 0 && shape < 0) ? REPORT_FAILED : shape;
}

void report_not_shown(struct report_page *page, const char *name)
{
    name_only(page, name, is_full(page) ? TOO_LARGE : "not shown, as it was deleted.");
}

bool report_surface(struct report_page *page, const json_t *record)
{
    long shape = report_shape(page, record);
    bool good = true;

    if (shape == REPORT_NONE) {
        report_not_shown(page, name_of(record));
    } else if (shape >= 0) {
        good = report_figure(page, json_pack("{s:[I]}", "shapes", (json_int_t)shape), "");
        report_text(page->body, name_of(record));
        (void)fputs("</figcaption></figure>", page->body);
    }
    return good && shape != REPORT_FAILED;
}

/* The view of shapes in a row, whose numbers follow each other from `first` on. */
static json_t *path_of(long first, json_t *texts, const char *kind)
{
    json_t *shapes = json_array();

    for (size_t i = 0; i < json_array_size(texts); i++) {
        (void)json_array_append_new(shapes, json_integer(first + (json_int_t)i));
    }
    return json_pack("{s:s, s:o, s:O}", "kind", kind, "shapes", shapes, "texts", texts);
}

bool report_path(struct report_page *page, const json_t *records)
{
    size_t n = json_array_size(records), kept = n > PATH_MAX_SHAPES ? PATH_MAX_SHAPES : n;
    json_t *texts = json_array();
    long first = (long)page->n_shapes;
    bool good = true;

    for (size_t i = 0; i < kept && good; i++) {
        const json_t *record =
            json_array_get(records, kept > 1 ? (i * (n - 1) + (kept - 1) / 2) / (kept - 1) : 0);
        long shape = report_shape(page, record);

        good = shape != REPORT_FAILED;
        if (shape >= 0) {
            (void)json_array_append_new(texts, json_string(name_of(record)));
        }
    }
    if (good && json_array_size(texts) > 0) {
        good = report_figure(page, path_of(first, texts, "path"), "");
        (void)fprintf(page->body, "%zu surfaces%s</figcaption></figure>", n,
                      json_array_size(texts) < n ? ", not all of them shown" : "");
    } else if (good) {
        report_not_shown(page, "Surfaces");
    }
    json_decref(texts);
    return good;
}

/* ---- Models ---------------------------------------------------------------------------------- */

static void put_components(FILE *out, const json_t *record)
{
    const json_t *values = json_object_get(record, "eigenvalues");
    const json_t *explained = json_object_get(record, "explained");
    const json_t *cumulative = json_object_get(record, "cumulative");

    (void)fputs("<table><thead><tr><th scope=\"col\">component</th><th scope=\"col\">eigenvalue"
                "</th><th scope=\"col\">share of the variance</th><th scope=\"col\">cumulative</th>"
                "</tr></thead><tbody>",
                out);
    for (size_t k = 0; k < json_array_size(values) && k < 20; k++) {
        (void)fprintf(out, "<tr><td>%zu</td><td>", k + 1);
        report_scalar(out, json_array_get(values, k));
        (void)fputs("</td><td>", out);
        report_scalar(out, json_array_get(explained, k));
        (void)fputs("</td><td>", out);
        report_scalar(out, json_array_get(cumulative, k));
        (void)fputs("</td></tr>", out);
    }
    (void)fputs("</tbody></table>", out);
}

static void put_energies(struct report_page *page, const double *energies)
{
    (void)fprintf(page->body,
                  " Relative energy at -2, -1, 1 and 2: %.3g, %.3g, %.3g, %.3g (0: the shape "
                  "exists).",
                  energies[0], energies[1], energies[2], energies[3]);
}

/* Five shapes along one component, the mean among them. */
static bool put_mode(struct report_page *page, const struct compute_model *model, size_t mode)
{
    static const double at[MODE_POINTS] = {-2.0, -1.0, 1.0, 2.0};
    static const size_t before[MODE_POINTS] = {1, MODE_POINTS, MODE_POINTS, 2};
    size_t components = model->pca.components, degree = (size_t)model->stored.lmax;
    size_t count = 3 * srnf_coefficient_count(degree);
    double *scores = srnf_alloc(MODE_POINTS * components, sizeof(double));
    struct compute_reconstruction points = {0};
    json_t *texts = json_pack("[s,s,s,s,s]", "-2 sd", "-1 sd", "mean", "+1 sd", "+2 sd");
    long first = (long)page->n_shapes;
    bool good = scores != NULL;

    for (size_t i = 0; good && i < MODE_POINTS; i++) {
        scores[i * components + mode] = at[i] * sqrt(model->pca.eigenvalues[mode]);
    }
    if (!good) {
        (void)compute_fail(page->result, SRNF_ENOMEM, NULL, "the modes of the report");
    }
    good = good && compute_reconstruct(page->run, model, MODE_POINTS, scores, before, &points,
                                       page->result) == 0;
    for (size_t i = 0; good && i < MODE_POINTS; i++) {
        good = (i != 2 || add_shape(page, degree, model->mean.coefficients, NULL) >= 0) &&
               add_shape(page, degree, points.coefficients + i * count, NULL) >= 0;
    }
    if (good) {
        good = report_figure(page, path_of(first, texts, "mode"), "");
        (void)fprintf(page->body, "Component %zu, in standard deviations from the mean.", mode + 1);
        put_energies(page, points.relative_energy);
        (void)fputs("</figcaption></figure>", page->body);
    }
    compute_reconstruction_clear(&points);
    srnf_free(scores);
    json_decref(texts);
    return good;
}

/* As many as were asked for, and as fit. */
static bool put_modes(struct report_page *page, const struct compute_model *model)
{
    size_t asked = (size_t)page->asked->modes, k = 0;
    size_t n = asked < model->pca.components ? asked : model->pca.components;
    bool good = true;

    for (; good && k < n && !is_full(page); k++) {
        good = put_mode(page, model, k);
    }
    if (good && k < n) {
        page->n_omitted += (n - k) * (MODE_POINTS + 1);
        name_only(page, n - k > 1 ? "Further components" : "Another component", TOO_LARGE);
    }
    return good;
}

bool report_model(struct report_page *page, const json_t *record)
{
    const char *id = json_string_value(json_object_get(record, "id"));
    const char *kind = json_string_value(json_object_get(record, "kind"));
    struct compute_model model = {0};
    bool good;

    if (kind && strcmp(kind, "parts") == 0) {
        return true; /* the result has the mean of each part */
    }
    good = report_surface(page, json_object_get(record, "mean"));
    if (!good || (kind && strcmp(kind, "components") != 0)) {
        return good;
    }
    put_components(page->body, record);
    if (page->asked->modes > 0) {
        good = compute_model_load(page->run, id, &model, page->result) == 0;
        good = good && put_modes(page, &model);
        compute_model_clear(&model);
    }
    return good;
}
