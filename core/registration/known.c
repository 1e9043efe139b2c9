/*
 * known.c - warps that need not be searched: two maps from one mesh to the sphere are
 * related by the mesh itself.
 *
 * With a, b the maps from the mesh to the sphere, surfaces f_a, f_b satisfy f_a = f_b o gamma with
 * gamma = b o a^-1. It is sampled on a grid, each node in the spherical triangle of a that holds
 * it, and kept as the harmonic series g of its values in R^3, analysed to a degree d: gamma(p) =
 * g(p) / |g(p)|, a link of the kind SRNF_WARP_SERIES. With t1, t2 orthonormal tangents, t1 x t2 =
 * p, its Jacobian is
 *
 *   J = det(g, dg t1, dg t2) / |g|^3.
 *
 * A map may be given by vectors of any length (the vertices about a centre, for the radial map): in
 * a triangle x = sum b_k x_k the direction is then that of sum b_k v_k, which is what radial
 * projection does. With s = sum l_k v_k / |v_k|, b_k is in proportion to l_k / |v_k|; since the
 * other map needs the direction of its sum only, the values at the vertices are divided by |v_k|.
 *
 * Series have no closed inverse; the inverse of b o a^-1 is a o b^-1.
 */
#include "registration.h"
#include "sphere_map/sphere_map.h"

#include <string.h>

#define DEGREE_MAX 255
#define OVERSAMPLING ((size_t)2) /* rows of the samples against the degree */

/* Two tangents with t1 x t2 = p. */
static void tangents(const double p[3], double t1[3], double t2[3])
{
    size_t least = fabs(p[0]) <= fabs(p[1]) ? (size_t)0 : (size_t)1;
    double axis[3] = {0.0, 0.0, 0.0};
    double length;

    least = fabs(p[2]) < fabs(p[least]) ? (size_t)2 : least;
    axis[least] = 1.0;
    vector_cross(p, axis, t1);
    length = vector_norm(t1);
    for (size_t k = 0; k < 3; k++) {
        t1[k] /= length;
    }
    vector_cross(p, t1, t2);
}

/* One point: its image, and J multiplied. g and its gradients are [3] apart by n and 3 n. */
static void map_point(const double *g, const double *gradients, size_t n, size_t i, double *point,
                      double *jacobian)
{
    double t1[3];
    double t2[3];
    double value[3];
    double d1[3];
    double d2[3];
    double cross[3];
    double length;

    tangents(point, t1, t2);
    for (size_t k = 0; k < 3; k++) {
        const double *gradient = gradients + 3 * (k * n + i);

        value[k] = g[k * n + i];
        d1[k] = vector_dot(gradient, t1);
        d2[k] = vector_dot(gradient, t2);
    }
    length = vector_norm(value);
    vector_cross(d1, d2, cross);
    *jacobian *= vector_dot(value, cross) / (length * length * length);
    for (size_t k = 0; k < 3; k++) {
        point[k] = value[k] / length;
    }
}

int warp_follow_series(size_t degree, const double *values, const struct srnf_context *context,
                       size_t n, double *points, double *jacobian)
{
    double *g = srnf_alloc(12 * n, sizeof(double));
    int status = g ? sphere_harmonics_at_points(context, degree, 3, values, n, points, g, g + 3 * n)
                   : SRNF_ENOMEM;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        map_point(g, g + 3 * n, n, i, points + 3 * i, jacobian + i);
    }
    srnf_free(g);
    return status;
}

/* Unit samples of gamma on the grid: double[3][nodes]. */
static int sample(const struct srnf_mesh *mesh, const double *from, const double *to,
                  const struct srnf_grid *grid, const struct srnf_context *context, double *values)
{
    struct srnf_mesh images = *mesh;
    size_t nodes = grid->n_theta * grid->n_phi;
    double *points = srnf_alloc(6 * mesh->n_vertices, sizeof(double));
    int status = SRNF_OK;

    if (!points) {
        return SRNF_ENOMEM;
    }
    images.vertices = points + 3 * mesh->n_vertices;
    for (size_t i = 0; i < mesh->n_vertices && status == SRNF_OK; i++) {
        double length = vector_norm(from + 3 * i);

        status = length > 0.0 && isfinite(length) ? SRNF_OK : SRNF_ENUMERIC;
        for (size_t k = 0; k < 3; k++) {
            points[3 * i + k] = from[3 * i + k] / length;
            images.vertices[3 * i + k] = to[3 * i + k] / length;
        }
    }
    if (status == SRNF_OK) {
        status = spherical_sample(&images, points, grid, context, values);
    }
    for (size_t i = 0; i < nodes && status == SRNF_OK; i++) {
        double g[3] = {values[i], values[nodes + i], values[2 * nodes + i]};
        double length = vector_norm(g);

        for (size_t k = 0; k < 3; k++) {
            values[k * nodes + i] /= length;
        }
    }
    srnf_free(points);
    return status;
}

/* SRNF_ENUMERIC where the warp folds at a node of the grid. */
static int check_warp(const struct srnf_warp *warp, const struct srnf_grid *grid,
                      const struct srnf_context *context)
{
    size_t n = grid->n_theta * grid->n_phi;
    double *points = srnf_alloc(4 * n, sizeof(double));
    int status;

    if (!points) {
        return SRNF_ENOMEM;
    }
    registration_nodes(grid, points, points + 3 * n);
    status = warp_apply(warp, context, n, points, points, points + 3 * n);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        status = points[3 * n + i] > 0.0 ? SRNF_OK : SRNF_ENUMERIC;
    }
    srnf_free(points);
    return status;
}

int srnf_warp_between(const struct srnf_mesh *mesh, const double *from, const double *to,
                      size_t degree, const struct srnf_context *context, struct srnf_warp *warp)
{
    struct srnf_sht *sht = NULL;
    const struct srnf_grid *grid;
    double *values = NULL;
    double *series = NULL;
    void *workspace = NULL;
    int status;

    *warp = (struct srnf_warp){0};
    if (degree < 1 || degree > DEGREE_MAX) {
        return SRNF_EINVAL;
    }
    status = srnf_sht_create(&sht, degree, SRNF_GRID_GAUSS_LEGENDRE, OVERSAMPLING * (degree + 1),
                             2 * OVERSAMPLING * (degree + 1));
    if (status) {
        return status;
    }
    grid = srnf_sht_grid(sht);
    values = srnf_alloc(3 * grid->n_theta * grid->n_phi, sizeof(double));
    series = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
    workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    status = SRNF_ENOMEM;
    if (!values || !series || !workspace) {
        goto out;
    }
    status = sample(mesh, from, to, grid, context, values);
    if (status == SRNF_OK) {
        srnf_sht_analysis(sht, 3, values, series, workspace);
        status = warp_append(warp, SRNF_WARP_SERIES, degree, series);
    }
    if (status == SRNF_OK) {
        status = check_warp(warp, grid, context);
    }
out:
    if (status) {
        srnf_warp_clear(warp);
    }
    srnf_free(values);
    srnf_free(series);
    srnf_free(workspace);
    srnf_sht_destroy(sht);
    return status;
}

int srnf_warp_join(const struct srnf_warp *more, struct srnf_warp *warp)
{
    int status = SRNF_OK;

    for (size_t k = 0; k < more->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &more->links[k];

        status = warp_append(warp, link->kind, link->degree, link->values);
    }
    return status;
}
