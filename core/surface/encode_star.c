/*
 * encode_star.c - the route star: a mesh that one point sees whole, radially from that point.
 *
 *   1. a centre c in the kernel of the mesh (or the one given), from which every ray meets the
 *      surface once
 *   2. r(s) = distance from c along the rays of a Gauss-Legendre grid with twice the rows of the
 *      working grid
 *   3. harmonic analysis of r to degree L - 1, optionally damped by the heat kernel
 *      exp(-sigma l (l + 1))
 *   4. f = r e, of degree L exactly, since e is of degree 1: the closed-form inverse of its SRNF is
 *      exact
 *
 * Rays are cast row by row, in parallel where the context can.
 */
#include "encode.h"
#include "sphere_map/sphere_map.h"
#include "linear/linear.h"

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
static int analyse_radius(const struct encode_task *task, double *radius)
{
    const struct srnf_encode_options *options = task->options;
    const double *center = task->star->center;
    struct srnf_sht *fine = NULL;
    struct rays rays = {task->index, NULL, center, NULL};
    void *workspace = NULL;
    size_t points;
    int status = srnf_sht_create(&fine, options->degree - 1, SRNF_GRID_GAUSS_LEGENDRE,
                                 ENCODE_OVERSAMPLING * srnf_working_rows(options->degree), 0);

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
    status = srnf_parallel_for(task->context, rays.grid->n_theta, cast_row, &rays);
    for (size_t i = 0; i < points && status == SRNF_OK; i++) {
        if (!(rays.r[i] > 0.0)) {
            status = srnf_fail(task->error, SRNF_ENOT_STAR, -1,
                               "a ray from the centre (%g, %g, %g) does not meet the surface",
                               center[0], center[1], center[2]);
        }
    }
    if (status == SRNF_OK) {
        srnf_sht_analysis(fine, 1, rays.r, radius, workspace);
        for (size_t l = 0; l < options->degree; l++) {
            double damping = exp(-options->smoothing * (double)l * (double)(l + 1));

            linear_scale(2 * l + 1, damping, radius + l * l);
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
    double *r;
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    int status = SRNF_ENOMEM;

    if (!values || !workspace) {
        goto out;
    }
    status = SRNF_OK;
    r = values + 3 * points;
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

/* Of the radial projection of the vertices from the centre. */
static int measure_projection(const struct encode_task *task, struct srnf_distortion *distortion)
{
    const struct srnf_mesh *mesh = task->mesh;
    double *points = srnf_alloc(3 * mesh->n_vertices, sizeof(double));
    int status;

    if (!points) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double *p = points + 3 * i;
        double length;

        vector_subtract(mesh->vertices + 3 * i, task->star->center, p);
        length = vector_norm(p);
        for (size_t c = 0; c < 3; c++) {
            p[c] /= length;
        }
    }
    status = spherical_distortion(mesh, points, distortion);
    srnf_free(points);
    return status;
}

int encode_star(const struct encode_task *task, struct encode_result *result)
{
    double *radius;
    int status;

    if (!task->star->value) {
        return srnf_fail(task->error, SRNF_ENOT_STAR, -1,
                         "%s (%g, %g, %g) sees %.3g %% of the area from behind",
                         task->options->center_given ? "the given centre" : "even the best centre",
                         task->star->center[0], task->star->center[1], task->star->center[2],
                         100.0 * task->star->violating_area_fraction);
    }
    radius = srnf_alloc(srnf_coefficient_count(task->options->degree), sizeof(double));
    if (!radius) {
        return SRNF_ENOMEM;
    }
    status = analyse_radius(task, radius);
    if (status == SRNF_OK) {
        status = lift_radius(task->sht, radius, result->coefficients, task->error);
    }
    if (status == SRNF_OK) {
        status = measure_projection(task, &result->distortion);
    }
    for (size_t c = 0; c < 3; c++) {
        result->frame[c] = task->star->center[c];
    }
    srnf_free(radius);
    return status;
}
