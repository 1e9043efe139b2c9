/*
 * encode.c - from a triangle mesh to a surface of a given degree: chooses the route, runs it, and
 * does what all routes need after it.
 *
 *   1. the star kernel, or the measures of the centre given
 *   2. the route: encode_star.c, encode_area.c, encode_given.c
 *   3. distances between the surface and the mesh, both ways
 *   4. centred at the area centroid, scaled to unit area
 */
#include "encode.h"
#include "fit.h"
#include "mesh/index.h"
#include "linear/linear.h"
#include "surface.h"

#include <math.h>
#include <stdio.h>

/* Frequency of the triangulation that the fit is measured on, for degree L: four vertices to the
   shortest wave. */
#define FIT_FREQUENCY_MIN ((size_t)24)
#define FIT_FREQUENCY_MAX ((size_t)96)

static const struct {
    const char *name;
    int (*run)(const struct encode_task *task, struct encode_result *result);
} routes[] = {
    [SRNF_PARAMETERIZATION_AUTO] = {"auto", NULL},
    [SRNF_PARAMETERIZATION_STAR] = {"star", encode_star},
    [SRNF_PARAMETERIZATION_AREA] = {"area", encode_area},
    [SRNF_PARAMETERIZATION_GIVEN] = {"given", encode_given},
};
#define ROUTES (sizeof routes / sizeof routes[0])

const char *srnf_parameterization_name(enum srnf_parameterization parameterization)
{
    return (size_t)parameterization < ROUTES ? routes[parameterization].name : "?";
}

struct srnf_encode_options srnf_encode_options_defaults(void)
{
    return (struct srnf_encode_options){
        .degree = 31, .parameterization = SRNF_PARAMETERIZATION_AUTO, .unit_area = true};
}

enum srnf_parameterization srnf_encode_route(const struct srnf_encode_options *options)
{
    if (options->parameterization != SRNF_PARAMETERIZATION_AUTO) {
        return options->parameterization;
    }
    return options->center_given ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AREA;
}

static int measure_fit(const struct encode_task *task, const double *coefficients,
                       const double frame[3], struct srnf_fit *fit)
{
    size_t degree = task->options->degree;
    struct srnf_mesh triangulation = {0};
    size_t frequency = degree < FIT_FREQUENCY_MIN ? FIT_FREQUENCY_MIN : degree;
    int status;

    frequency = frequency < FIT_FREQUENCY_MAX ? frequency : FIT_FREQUENCY_MAX;
    status =
        surface_triangulate(task->context, degree, coefficients, frequency, &triangulation, NULL);
    if (status) {
        return status;
    }
    for (size_t i = 0; i < triangulation.n_vertices; i++) {
        for (size_t c = 0; c < 3; c++) {
            triangulation.vertices[3 * i + c] += frame[c];
        }
    }
    status = srnf_fit_measure(task->mesh, task->index, &triangulation, task->context, fit);
    srnf_mesh_clear(&triangulation);
    return status;
}

/* Centres at the area centroid and scales; sets scale, origin and measures. */
static int normalize(const struct srnf_sht *sht, bool unit_area, const double frame[3],
                     struct srnf_encoded *encoded)
{
    size_t count = srnf_coefficient_count(encoded->degree);
    double *f = encoded->coefficients;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    srnf_surface_measure(sht, f, &encoded->measures, workspace);
    encoded->scale = unit_area ? sqrt(encoded->measures.area) : 1.0;
    for (size_t c = 0; c < 3; c++) {
        encoded->origin[c] = frame[c] + encoded->measures.centroid[c];
        /* A constant x is the coefficient x sqrt(4 pi) of Y_00. */
        f[c * count] -= encoded->measures.centroid[c] * sqrt(4.0 * SRNF_PI);
    }
    linear_scale(3 * count, 1.0 / encoded->scale, f);
    srnf_surface_measure(sht, f, &encoded->measures, workspace);
    srnf_free(workspace);
    return SRNF_OK;
}

static int check(const struct srnf_mesh_report *report, const struct srnf_encode_options *options,
                 struct srnf_error *error)
{
    if (report->n_problems > 0) {
        return srnf_fail(error, report->problems[0].status, report->problems[0].first, "%s",
                         report->problems[0].detail);
    }
    if (options->degree < SRNF_DEGREE_MIN || options->degree > SRNF_DEGREE_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "degree %zu is not in %d to %d", options->degree,
                         SRNF_DEGREE_MIN, SRNF_DEGREE_MAX);
    }
    if (!(options->smoothing >= 0.0) || !isfinite(options->smoothing)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "smoothing %g is not a number from 0 up",
                         options->smoothing);
    }
    if ((size_t)options->parameterization >= ROUTES) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%d is no parameterization",
                         (int)options->parameterization);
    }
    if (options->center_given && options->parameterization != SRNF_PARAMETERIZATION_AUTO &&
        options->parameterization != SRNF_PARAMETERIZATION_STAR) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the route %s has no centre to be given",
                         routes[options->parameterization].name);
    }
    return SRNF_OK;
}

/* The kernel's star where none is needed to go on: how star-shaped the mesh is belongs to every
   result, but a linear program that breaks down must not stop the other routes. */
static int measure_star(const struct encode_task *task, struct srnf_star *star)
{
    int status;

    if (task->options->kernel && !task->options->center_given) {
        *star = *task->options->kernel;
        return SRNF_OK;
    }
    status = task->options->center_given ? srnf_star_at(task->mesh, task->options->center, star)
                                         : srnf_star_kernel_within(task->mesh, task->context, star);
    if (status == SRNF_ENUMERIC && task->options->parameterization != SRNF_PARAMETERIZATION_STAR) {
        status = srnf_star_at(task->mesh, task->report->centroid, star);
    }
    return status;
}

/* The route and the sentence that says why. */
static enum srnf_parameterization choose(const struct encode_task *task, char *reason, size_t size)
{
    enum srnf_parameterization route = srnf_encode_route(task->options);

    if (task->options->parameterization != SRNF_PARAMETERIZATION_AUTO) {
        (void)snprintf(reason, size, "the route %s was asked for", routes[route].name);
    } else if (route == SRNF_PARAMETERIZATION_STAR) {
        (void)snprintf(reason, size, "a centre was given, which only the route star has");
    } else {
        (void)snprintf(reason, size,
                       "area is the route of every mesh unless another is asked for, so that all "
                       "that are compared came by one");
    }
    return route;
}

/* Runs the route that was chosen. No other one takes its place where it fails: that surface would
   be compared with those of this route, and nobody would know. The message says what would do. */
static int run_route(const struct encode_task *task, struct srnf_encoded *encoded,
                     struct encode_result *result)
{
    const struct srnf_star *star = task->star;
    struct srnf_error first;
    int status;

    encoded->route = choose(task, encoded->reason, sizeof encoded->reason);
    status = routes[encoded->route].run(task, result);
    if (status == SRNF_ENUMERIC && encoded->route == SRNF_PARAMETERIZATION_AREA && star->value) {
        first = *task->error;
        *task->error = (struct srnf_error){0};
        (void)srnf_fail(task->error, status, first.status ? first.element : -1,
                        "%.150s; a point sees the whole mesh, so the route star would do, but what "
                        "it is compared with must go by that route too",
                        first.status ? first.message : srnf_strerror(status));
    }
    return status;
}

/* Everything between the checks and the clearing up; what is allocated belongs to the caller. */
static int encode(struct encode_task *task, struct srnf_index **index, struct srnf_sht **sht,
                  struct srnf_encoded *encoded)
{
    struct encode_result result = {0};
    int status = measure_star(task, &encoded->star);

    if (status == SRNF_OK) {
        status = index_create(index, task->mesh, task->context);
    }
    if (status == SRNF_OK) {
        status = srnf_sht_create(sht, encoded->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0);
    }
    if (status) {
        return status;
    }
    encoded->coefficients = srnf_alloc(3 * srnf_coefficient_count(encoded->degree), sizeof(double));
    if (!encoded->coefficients) {
        return SRNF_ENOMEM;
    }
    result.coefficients = encoded->coefficients;
    task->index = *index;
    task->sht = *sht;
    task->star = &encoded->star;
    srnf_report_progress(task->context, 0.1, "sampling");
    status = run_route(task, encoded, &result);
    encoded->distortion = result.distortion;
    if (status == SRNF_OK && srnf_is_canceled(task->context)) {
        status = SRNF_ECANCELED;
    }
    if (status == SRNF_OK) {
        srnf_report_progress(task->context, 0.6, "measuring the fit");
        status = measure_fit(task, encoded->coefficients, result.frame, &encoded->fit);
    }
    if (status == SRNF_OK) {
        status = normalize(*sht, task->options->unit_area, result.frame, encoded);
    }
    if (status == SRNF_OK) {
        double scale = encoded->scale;

        encoded->volume_ratio =
            encoded->measures.volume * scale * scale * scale / task->report->volume;
        encoded->area_ratio = encoded->measures.area * scale * scale / task->report->area;
    }
    return status;
}

int srnf_encode(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                const struct srnf_encode_options *options, const struct srnf_context *context,
                struct srnf_encoded *encoded, struct srnf_error *error)
{
    struct srnf_encode_options defaults = srnf_encode_options_defaults();
    struct srnf_index *index = NULL;
    struct srnf_sht *sht = NULL;
    struct srnf_error first = {0};
    struct encode_task task = {.mesh = mesh, .report = report, .context = context, .error = &first};
    int status;

    task.options = options ? options : &defaults;
    *encoded = (struct srnf_encoded){.degree = task.options->degree,
                                     .route = task.options->parameterization};
    status = check(report, task.options, &first);
    if (status == SRNF_OK) {
        status = encode(&task, &index, &sht, encoded);
    }
    if (srnf_is_canceled(context)) {
        first = (struct srnf_error){0};
        status = SRNF_ECANCELED;
    }
    if (status) {
        (void)srnf_fail(error, status, first.status ? first.element : -1, "%s",
                        first.status ? first.message : srnf_strerror(status));
        srnf_free(encoded->coefficients);
        encoded->coefficients = NULL;
    }
    srnf_index_destroy(index);
    srnf_sht_destroy(sht);
    return status;
}

/* ---- The map alone --------------------------------------------------------------------------- */

static int star_points(const struct encode_task *task, double *points)
{
    struct srnf_star star;
    int status = measure_star(task, &star);

    if (status) {
        return status;
    }
    if (!star.value) {
        return srnf_fail(task->error, SRNF_ENOT_STAR, -1,
                         "the centre (%g, %g, %g) does not see the whole surface", star.center[0],
                         star.center[1], star.center[2]);
    }
    for (size_t i = 0; i < 3 * task->mesh->n_vertices; i++) {
        points[i] = task->mesh->vertices[i] - star.center[i % 3];
    }
    return SRNF_OK;
}

static int area_points(const struct encode_task *task, double *points)
{
    struct srnf_spherical_map map = {0};
    int status = srnf_spherical_map(task->mesh, task->context, &map, task->error);

    for (size_t i = 0; i < 3 * task->mesh->n_vertices && status == SRNF_OK; i++) {
        points[i] = map.points[i];
    }
    srnf_free(map.points);
    return status;
}

int srnf_encode_points(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                       const struct srnf_encode_options *options,
                       const struct srnf_context *context, double *points, struct srnf_error *error)
{
    struct srnf_encode_options defaults = srnf_encode_options_defaults();
    struct srnf_error first = {0};
    struct encode_task task = {.mesh = mesh, .report = report, .context = context, .error = &first};
    enum srnf_parameterization route;
    int status;

    task.options = options ? options : &defaults;
    status = check(report, task.options, &first);
    route = srnf_encode_route(task.options);
    if (status == SRNF_OK && route == SRNF_PARAMETERIZATION_STAR) {
        status = star_points(&task, points);
    } else if (status == SRNF_OK && route == SRNF_PARAMETERIZATION_AREA) {
        status = area_points(&task, points);
    } else if (status == SRNF_OK) {
        status = encode_given_points(&task, points);
    }
    if (status) {
        (void)srnf_fail(error, status, first.status ? first.element : -1, "%s",
                        first.status ? first.message : srnf_strerror(status));
    }
    return status;
}
