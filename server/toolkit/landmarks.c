/*
 * landmarks.c - where landmarks lie, and what a registration leaves between them.
 *
 * A surface is a smooth approximation of its mesh, so that neither vertices nor positions lie on
 * it: the nearest point of it stands for each, whatever route the surface came by. How far it is
 * from the point is told; that is the error of the encoding, unless the position is wrong.
 */
#include "toolkit/landmarks.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/surfaces.h"
#include "api/warnings.h"
#include "compute/prepared.h"

/* Of the root of the area, which is about the width of a surface: farther off it a point is none of
   it. Encodings of real structures are off their meshes by less than a hundredth. */
#define OFF_LIMIT 0.05

/* Ten pairs of ventricles are 6 % further apart with twelve landmarks that correspond than without
   (core/README.md). Of one of them and a bent copy, 11 %; with two of six landmarks exchanged three
   times as far, with numbers off by one six times. The least is in units of the root of the area,
   the norm of an SRNF. Of a surface and itself the landmarks make all of the distance: numbers off
   by one, each next to the right vertex, 0.025 to 0.1; points that are off by a hundredth of the
   root of the area 0.005 to 0.015. */
#define RAISED 2.0
#define RAISED_LEAST 0.05
#define RAISED_FAR 10.0
#define RAISED_FAR_LEAST 0.02

/* ---- Placing --------------------------------------------------------------------------------- */

/* f = R (x - origin) / scale. */
static void to_surface(const struct surface_place *place, const double x[3], double f[3])
{
    double d[3];

    for (size_t c = 0; c < 3; c++) {
        d[c] = (x[c] - place->origin[c]) / place->scale;
    }
    for (size_t c = 0; c < 3; c++) {
        const double *row = place->rotation + 3 * c;

        f[c] = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
    }
}

static bool has_vertices(const json_t *points)
{
    for (size_t i = 0; i < json_array_size(points); i++) {
        if (json_is_integer(json_array_get(points, i))) {
            return true;
        }
    }
    return false;
}

/* The points of one end in the coordinates of its surface, [n][3]. mesh: that of the vertices. */
static int read_positions(const json_t *points, const struct srnf_mesh *mesh,
                          const struct surface_place *place, double *positions,
                          struct srnf_error *error)
{
    for (size_t i = 0; i < json_array_size(points); i++) {
        const json_t *point = json_array_get(points, i);
        double x[3];

        if (json_is_integer(point)) {
            size_t vertex = (size_t)json_integer_value(point);

            if (vertex >= mesh->n_vertices) {
                (void)snprintf(error->message, sizeof error->message,
                               "landmark %zu is vertex %zu of %zu", i, vertex, mesh->n_vertices);
                return SRNF_EINVAL;
            }
            memcpy(x, mesh->vertices + 3 * vertex, sizeof x);
        } else {
            for (size_t c = 0; c < 3; c++) {
                x[c] = json_number_value(json_array_get(point, c));
            }
        }
        to_surface(place, x, positions + 3 * i);
    }
    return SRNF_OK;
}

int landmarks_place_points(struct jobs_run *run, const json_t *given,
                           const struct surface_place *place, size_t degree,
                           const double *coefficients, double *points, double *off,
                           struct jobs_result *result)
{
    size_t n = json_array_size(given);
    double *positions = srnf_alloc(3 * n, sizeof(double));
    struct srnf_error error = {.element = -1};
    struct srnf_mesh mesh = {0};
    int status = positions ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && has_vertices(given)) {
        status = compute_mesh_read(run, place->mesh, &mesh, result);
        if (status) {
            srnf_free(positions);
            return status;
        }
    }
    status = status ? status : read_positions(given, &mesh, place, positions, &error);
    status = status ? status
                    : srnf_surface_nearest(degree, coefficients, n, positions,
                                           jobs_run_context(run), points, off);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        off[i] *= place->scale;
    }
    srnf_mesh_clear(&mesh);
    srnf_free(positions);
    return status ? compute_fail(result, status, &error, "placing the landmarks") : 0;
}

static int place_end(struct jobs_run *run, struct landmarks *l, const struct pair *pair, size_t end,
                     struct jobs_result *result)
{
    const struct surface_place place = process_place(run, &pair->ends[end]);

    return landmarks_place_points(run, l->input->ends[end], &place, pair->degree,
                                  pair->coefficients + end * pair->count, l->points[end],
                                  l->off[end], result);
}

/* Those that are not held out, side by side. */
static void gather(struct landmarks *l)
{
    size_t count = 0;

    for (size_t i = 0; i < l->n; i++) {
        if (!l->input->held_out[i]) {
            memcpy(l->guiding + 3 * count, l->points[0] + 3 * i, 3 * sizeof(double));
            memcpy(l->guiding + 3 * (l->n + count), l->points[1] + 3 * i, 3 * sizeof(double));
            count++;
        }
    }
    l->pairs = (struct srnf_landmarks){count, l->guiding, l->guiding + 3 * l->n, l->input->weight};
}

int landmarks_place(struct jobs_run *run, const struct landmarks_input *input, struct pair *pair,
                    struct landmarks *l, struct jobs_result *result)
{
    int status = 0;

    *l = (struct landmarks){.input = input, .n = input->n};
    if (l->n == 0) {
        return 0;
    }
    l->points[0] = srnf_alloc(14 * l->n, sizeof(double));
    if (!l->points[0]) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "placing the landmarks");
    }
    l->points[1] = l->points[0] + 3 * l->n;
    l->off[0] = l->points[1] + 3 * l->n;
    l->off[1] = l->off[0] + l->n;
    l->guiding = l->off[1] + l->n;
    for (size_t end = 0; end < 2 && status == 0; end++) {
        status = place_end(run, l, pair, end, result);
    }
    if (status == 0) {
        gather(l);
        pair->landmarks = l->pairs.n ? &l->pairs : NULL;
    }
    return status;
}

void landmarks_clear(struct landmarks *l)
{
    srnf_free(l->points[0]);
    *l = (struct landmarks){.n = 0};
}

/* ---- Report ---------------------------------------------------------------------------------- */

int landmarks_distances(size_t degree, const double *coefficients, size_t n, const double *a,
                        const double *b, double *distances)
{
    double *points = srnf_alloc(12 * n, sizeof(double));
    double *values = points ? points + 6 * n : NULL;
    int status = SRNF_ENOMEM;

    if (points) {
        memcpy(points, a, 3 * n * sizeof(double));
        memcpy(points + 3 * n, b, 3 * n * sizeof(double));
        status = srnf_harmonics_at_points(degree, 3, coefficients, 2 * n, points, values, NULL);
    }
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        double square = 0.0;

        for (size_t c = 0; c < 3; c++) {
            double d = values[2 * n * c + i] - values[2 * n * c + n + i];

            square += d * d;
        }
        distances[i] = sqrt(square);
    }
    srnf_free(points);
    return status;
}

/* What is left of all of them: angles, and distances on the moving surface as it is stored. */
static int measure(const struct landmarks *l, const struct pair *pair, double *angles,
                   double *distances)
{
    const struct srnf_landmarks all = {l->n, l->points[0], l->points[1], INFINITY};
    double *points = srnf_alloc(3 * l->n, sizeof(double));
    int status =
        points ? srnf_landmarks_measure(&pair->registration.warp, &all, angles) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        status = srnf_warp_apply(&pair->registration.warp, l->n, l->points[0], points, NULL);
    }
    if (status == SRNF_OK) {
        status = landmarks_distances(pair->degree, pair->coefficients + pair->count, l->n, points,
                                     l->points[1], distances);
    }
    srnf_free(points);
    return status;
}

json_t *landmarks_summary(size_t members, size_t n, const bool *held_out, bool kind,
                          const double *angles, const double *distances)
{
    double most[2] = {0.0, 0.0}, squares[2] = {0.0, 0.0};
    size_t count = 0;

    for (size_t i = 0; i < members * n; i++) {
        if (held_out[i % n] == kind) {
            most[0] = fmax(most[0], angles[i]);
            most[1] = fmax(most[1], distances[i]);
            squares[0] += angles[i] * angles[i];
            squares[1] += distances[i] * distances[i];
            count++;
        }
    }
    if (count == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:o, s:o, s:o, s:o}", "count", (json_int_t)(count / members),
                     "maxAngle", json_finite(most[0]), "rmsAngle",
                     json_finite(sqrt(squares[0] / (double)count)), "maxDistance",
                     json_finite(most[1]), "rmsDistance",
                     json_finite(sqrt(squares[1] / (double)count)));
}

void landmarks_warn_off(json_t *document, const char *input, const char *id, double scale,
                        double area, size_t n, const double *off)
{
    double limit = OFF_LIMIT * scale * sqrt(area);
    size_t worst = 0, beyond = 0;
    char count[64];

    for (size_t i = 0; i < n; i++) {
        worst = off[i] > off[worst] ? i : worst;
        beyond += off[i] > limit;
    }
    if (beyond == 0) {
        return;
    }
    (void)snprintf(count, sizeof count, beyond == n ? "All %zu" : "%zu of %zu", beyond, n);
    warning_add(warnings_of(document), "landmark-off-surface",
                json_pack("{s:s, s:s, s:I, s:f, s:f, s:I, s:I}", "input", input, "surface", id,
                          "landmark", (json_int_t)worst, "distance", off[worst], "limit", limit,
                          "beyond", (json_int_t)beyond, "of", (json_int_t)n),
                "%s landmarks of %s (%s) are off the surface, whose nearest points were taken for "
                "them: landmark %zu by %.3g in the units of its mesh, where a twentieth of the "
                "root of the area is %.3g. %s",
                count, input, id, worst, off[worst], limit,
                beyond == n && n > 1 ? "Check their units, and that they are of this mesh."
                                     : "Check the position and its coordinates.");
}

/* Points that are none of their surface. areas: of the ends. */
static void warn_off(const struct landmarks *l, const struct pair *pair, const double scales[2],
                     const double areas[2], json_t *document)
{
    for (size_t end = 0; end < 2; end++) {
        landmarks_warn_off(document, l->input->names[end], pair->ends[end].id, scales[end],
                           areas[end], l->n, l->off[end]);
    }
}

/* Landmarks that belong together cost little. */
static void warn_raised(const struct pair *pair, double area, json_t *document)
{
    double distance = pair->registration.distance, without = pair->free_distance;
    double least = distance > RAISED_FAR * without ? RAISED_FAR_LEAST : RAISED_LEAST;

    if (!pair->landmarks || !(distance > RAISED * without) ||
        !(distance - without > least * sqrt(area))) {
        return;
    }
    warning_add(warnings_of(document), "landmarks-raise-distance",
                json_pack("{s:f, s:f}", "distance", distance, "free", without),
                "The landmarks raise the distance from %.3g to %.3g: the surfaces match far better "
                "without them. Check that both lists have the same order, that numbers of "
                "vertices count from 0, and that positions are in the coordinates of each mesh.",
                without, distance);
}

/* Both kinds; none where the surfaces cannot be measured. */
static void warn(const struct landmarks *l, const struct pair *pair, const double scales[2],
                 json_t *document)
{
    struct srnf_surface_measures measures[2];

    if (srnf_surfaces_measure(pair->sht, 2, pair->coefficients, NULL, measures) == SRNF_OK) {
        const double areas[2] = {measures[0].area, measures[1].area};

        warn_off(l, pair, scales, areas, document);
        warn_raised(pair, areas[0], document);
    }
}

int landmarks_report(struct jobs_run *run, const struct landmarks *l, const struct pair *pair,
                     json_t *document, struct jobs_result *result)
{
    const double scales[2] = {process_place(run, &pair->ends[0]).scale,
                              process_place(run, &pair->ends[1]).scale};
    double *angles, *distances;
    json_t *points;
    int status;

    if (l->n == 0) {
        (void)json_object_set_new(document, "landmarks", json_null());
        return 0;
    }
    angles = srnf_alloc(2 * l->n, sizeof(double));
    distances = angles ? angles + l->n : NULL;
    status = angles ? measure(l, pair, angles, distances) : SRNF_ENOMEM;
    if (status) {
        srnf_free(angles);
        return compute_fail(result, status, NULL, "measuring the landmarks");
    }
    points = json_array();
    for (size_t i = 0; i < l->n; i++) {
        distances[i] *= scales[1];
        (void)json_array_append_new(
            points,
            json_pack("{s:o, s:o, s:b, s:o, s:o}", "angle", json_finite(angles[i]), "distance",
                      json_finite(distances[i]), "heldOut", (int)l->input->held_out[i], "offFixed",
                      json_finite(l->off[0][i]), "offMoving", json_finite(l->off[1][i])));
    }
    (void)json_object_set_new(
        document, "landmarks",
        json_pack("{s:o, s:o, s:o, s:o}", "points", points, "guiding",
                  landmarks_summary(1, l->n, l->input->held_out, false, angles, distances),
                  "heldOut",
                  landmarks_summary(1, l->n, l->input->held_out, true, angles, distances), "weight",
                  isinf(l->input->weight) ? json_string("exact") : json_real(l->input->weight)));
    warn(l, pair, scales, document);
    landmarks_settle(document);
    srnf_free(angles);
    return 0;
}

void landmarks_settle(json_t *document)
{
    json_t *warnings = json_object_get(document, "warnings"), *entry;
    bool raised = false;
    size_t i;

    json_array_foreach(warnings, i, entry)
    {
        const char *code = json_string_value(json_object_get(entry, "code"));

        raised = raised || strcmp(code ? code : "", "landmarks-raise-distance") == 0;
    }
    for (i = json_array_size(warnings); raised && i-- > 0;) {
        const char *code = json_string_value(json_object_get(json_array_get(warnings, i), "code"));

        if (strcmp(code ? code : "", "registration-truncated") == 0) {
            (void)json_array_remove(warnings, i);
        }
    }
}
