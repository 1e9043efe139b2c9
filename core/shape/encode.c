/*
 * encode.c - from a triangle mesh to a surface of a given degree, by the star route.
 *
 *   1. a centre c in the kernel of the mesh (or the one given), from which every ray meets the
 *   surface once
 *   2. r(s) = distance from c along the rays of a Gauss-Legendre grid with twice the rows of the
 *   working grid: real
 *      meshes are rougher than the degree, and the finer grid folds less of that roughness into the
 *      coefficients
 *   3. harmonic analysis of r to degree L - 1, optionally damped by the heat kernel exp(-sigma l (l
 *   + 1))
 *   4. f = r e, of degree L exactly, since e is of degree 1: the closed-form inverse of its SRNF is
 *   exact
 *   5. distances between f and the mesh, both ways
 *   6. centred at the area centroid, scaled to unit area
 *
 * Rays are cast row by row, in parallel where the context can.
 */
#include "shape.h"
#include "fit.h"

#include <math.h>

#define OVERSAMPLING ((size_t)2)
/* Frequency of the triangulation that the fit is measured on, for degree L: four vertices to the
   shortest wave. */
#define FIT_FREQUENCY_MIN ((size_t)24)
#define FIT_FREQUENCY_MAX ((size_t)96)

struct srnf_encode_options srnf_encode_options_defaults(void)
{
    return (struct srnf_encode_options){
        .degree = 31, .parameterization = SRNF_PARAMETERIZATION_AUTO, .unit_area = true};
}

struct rays {
    const struct srnf_index *index;
    const struct srnf_grid *grid;
    const double *center;
    double *r; /* -1 where the ray meets nothing */
};

static void cast_row(void *argument, size_t row)
{
    struct rays *rays = argument;
    const struct srnf_grid *grid = rays->grid;

    for (size_t j = 0; j < grid->n_phi; j++) {
        double phi = 2.0 * SRNF_PI * (double)j / (double)grid->n_phi;
        double direction[3] = {grid->sin_theta[row] * cos(phi), grid->sin_theta[row] * sin(phi),
                               grid->cos_theta[row]};
        double t = -1.0;

        (void)srnf_index_ray(rays->index, rays->center, direction, &t, NULL);
        rays->r[row * grid->n_phi + j] = t;
    }
}

/* Coefficients of r to degree L - 1. */
static int analyse_radius(const struct srnf_index *index, const struct srnf_encode_options *options,
                          const struct srnf_star *star, const struct srnf_context *context,
                          double *radius, struct srnf_error *error)
{
    struct srnf_sht *fine = NULL;
    struct rays rays = {index, NULL, star->center, NULL};
    void *workspace = NULL;
    size_t points;
    int status = srnf_sht_create(&fine, options->degree - 1, SRNF_GRID_GAUSS_LEGENDRE,
                                 OVERSAMPLING * srnf_working_rows(options->degree), 0);

    if (status) {
        goto out;
    }
    rays.grid = srnf_sht_grid(fine);
    points = rays.grid->n_theta * rays.grid->n_phi;
    rays.r = srnf_alloc(points, sizeof(double));
    workspace = srnf_alloc(1, srnf_sht_workspace_size(fine, 1));
    status = SRNF_ENOMEM;
    if (!rays.r || !workspace) {
        goto out;
    }
    srnf_parallel_for(context, rays.grid->n_theta, cast_row, &rays);
    status = SRNF_OK;
    for (size_t i = 0; i < points && status == SRNF_OK; i++) {
        if (!(rays.r[i] > 0.0)) {
            status = srnf_fail(error, SRNF_ENOT_STAR, -1,
                               "a ray from the centre (%g, %g, %g) does not meet the surface",
                               star->center[0], star->center[1], star->center[2]);
        }
    }
    if (status == SRNF_OK) {
        srnf_sht_analysis(fine, 1, rays.r, radius, workspace);
        for (size_t l = 0; l < options->degree; l++) {
            double damping = exp(-options->smoothing * (double)l * (double)(l + 1));

            shape_scale(2 * l + 1, damping, radius + l * l);
        }
    }
out:
    srnf_free(rays.r);
    srnf_free(workspace);
    srnf_sht_destroy(fine);
    return status;
}

/* f = r e on the working grid, analysed to degree L. radius has room for degree L; its last degree
   is 0. */
static int lift_radius(const struct srnf_sht *sht, const double *radius, double *coefficients,
                       struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = grid->n_theta * grid->n_phi;
    double *values = srnf_alloc(4 * points, sizeof(double));
    double *r = values + 3 * points;
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    int status = SRNF_ENOMEM;

    if (!values || !workspace) {
        goto out;
    }
    status = SRNF_OK;
    srnf_sht_synthesis(sht, 1, radius, r, workspace);
    for (size_t i = 0; i < points; i++) {
        size_t row = i / grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

        if (!(r[i] > 0.0)) {
            status = srnf_fail(
                error, SRNF_ENOT_STAR, -1,
                "the radius fitted with degree %zu is not positive everywhere: the centre lies "
                "too close to the surface for this degree",
                srnf_sht_degree(sht));
            goto out;
        }
        values[i] = r[i] * grid->sin_theta[row] * cos(phi);
        values[points + i] = r[i] * grid->sin_theta[row] * sin(phi);
        values[2 * points + i] = r[i] * grid->cos_theta[row];
    }
    srnf_sht_analysis(sht, 3, values, coefficients, workspace);
out:
    srnf_free(values);
    srnf_free(workspace);
    return status;
}

static int measure_fit(const struct srnf_mesh *mesh, const struct srnf_index *index, size_t degree,
                       const double *coefficients, const double center[3], struct srnf_fit *fit)
{
    struct srnf_mesh triangulation = {0};
    size_t frequency = degree < FIT_FREQUENCY_MIN ? FIT_FREQUENCY_MIN : degree;
    int status;

    frequency = frequency < FIT_FREQUENCY_MAX ? frequency : FIT_FREQUENCY_MAX;
    status = srnf_surface_triangulate(degree, coefficients, frequency, &triangulation, NULL);
    if (status) {
        return status;
    }
    for (size_t i = 0; i < triangulation.n_vertices; i++) {
        for (size_t c = 0; c < 3; c++) {
            triangulation.vertices[3 * i + c] += center[c];
        }
    }
    status = srnf_fit_measure(mesh, index, &triangulation, fit);
    srnf_mesh_clear(&triangulation);
    return status;
}

/* Centres at the area centroid and scales; sets scale, origin and measures. */
static int normalise(const struct srnf_sht *sht, bool unit_area, struct srnf_encoded *encoded)
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
        encoded->origin[c] = encoded->star.center[c] + encoded->measures.centroid[c];
        /* A constant x is the coefficient x sqrt(4 pi) of Y_00. */
        f[c * count] -= encoded->measures.centroid[c] * sqrt(4.0 * SRNF_PI);
    }
    shape_scale(3 * count, 1.0 / encoded->scale, f);
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
    return SRNF_OK;
}

static int find_center(const struct srnf_mesh *mesh, const struct srnf_encode_options *options,
                       struct srnf_star *star, struct srnf_error *error)
{
    int status = options->center_given ? srnf_star_at(mesh, options->center, star)
                                       : srnf_star_kernel(mesh, star);

    if (status == SRNF_OK && !star->value) {
        status = srnf_fail(
            error, SRNF_ENOT_STAR, -1, "%s (%g, %g, %g) sees %.3g %% of the area from behind",
            options->center_given ? "the given centre" : "even the best centre", star->center[0],
            star->center[1], star->center[2], 100.0 * star->violating_area_fraction);
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
    double *radius = NULL;
    struct srnf_error first = {0};
    int status;

    options = options ? options : &defaults;
    *encoded =
        (struct srnf_encoded){.degree = options->degree, .route = SRNF_PARAMETERIZATION_STAR};
    status = check(report, options, &first);
    if (status == SRNF_OK) {
        status = find_center(mesh, options, &encoded->star, &first);
    }
    if (status) {
        goto out;
    }
    srnf_report_progress(context, 0.1, "sampling");
    status = srnf_index_create(&index, mesh);
    if (status == SRNF_OK) {
        status = srnf_sht_create(&sht, options->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0);
    }
    radius = srnf_alloc(srnf_coefficient_count(options->degree), sizeof(double));
    encoded->coefficients = srnf_alloc(3 * srnf_coefficient_count(options->degree), sizeof(double));
    if (status == SRNF_OK && (!radius || !encoded->coefficients)) {
        status = SRNF_ENOMEM;
    }
    if (status == SRNF_OK) {
        status = analyse_radius(index, options, &encoded->star, context, radius, &first);
    }
    if (status == SRNF_OK) {
        status = lift_radius(sht, radius, encoded->coefficients, &first);
    }
    if (status == SRNF_OK && srnf_is_canceled(context)) {
        status = SRNF_ECANCELED;
    }
    if (status == SRNF_OK) {
        srnf_report_progress(context, 0.6, "measuring the fit");
        status = measure_fit(mesh, index, options->degree, encoded->coefficients,
                             encoded->star.center, &encoded->fit);
    }
    if (status == SRNF_OK) {
        status = normalise(sht, options->unit_area, encoded);
    }
out:
    if (status) {
        (void)srnf_fail(error, status, first.status ? first.element : -1, "%s",
                        first.status ? first.message : srnf_strerror(status));
        srnf_free(encoded->coefficients);
        encoded->coefficients = NULL;
    }
    srnf_free(radius);
    srnf_index_destroy(index);
    srnf_sht_destroy(sht);
    return status;
}
