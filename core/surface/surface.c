/*
 * surface.c - a surface given by coefficients as a triangle mesh, for viewing and for measuring
 * fits.
 *
 * The vertices are the values of f at the vertices of a geodesic sphere. With the tangential
 * gradients g_x, g_y, g_z of the three coordinates as vectors of R^3, the normal is n = (<e, g_y x
 * g_z>, <e, g_z x g_x>, <e, g_x x g_y>), which is f_theta x f_phi / sin theta written without the
 * frame: regular at the poles.
 */
#include "surface.h"
#include "harmonics/points.h"

#include <math.h>

/* <e, a x b> */
static double triple(const double *e, const double *a, const double *b)
{
    return e[0] * (a[1] * b[2] - a[2] * b[1]) + e[1] * (a[2] * b[0] - a[0] * b[2]) +
           e[2] * (a[0] * b[1] - a[1] * b[0]);
}

/* gradients: [3][n][3]; points and normals: [n][3] */
static void unit_normals(size_t n, const double *points, const double *gradients, double *normals)
{
    for (size_t i = 0; i < n; i++) {
        const double *e = points + 3 * i;
        const double *g[3] = {gradients + 3 * i, gradients + 3 * (n + i),
                              gradients + 3 * (2 * n + i)};
        double *out = normals + 3 * i;
        double length = 0.0;

        for (size_t c = 0; c < 3; c++) {
            out[c] = triple(e, g[(c + 1) % 3], g[(c + 2) % 3]);
            length += out[c] * out[c];
        }
        length = sqrt(length);
        for (size_t c = 0; c < 3; c++) {
            out[c] = length > 0.0 ? out[c] / length : 0.0;
        }
    }
}

int surface_triangulate(const struct srnf_context *context, size_t degree,
                        const double *coefficients, size_t frequency, struct srnf_mesh *mesh,
                        double **normals)
{
    double *values = NULL;
    double *gradients = NULL;
    double *directions = NULL;
    size_t n;
    int status = srnf_mesh_icosphere(frequency, mesh);

    if (status) {
        return status;
    }
    n = mesh->n_vertices;
    values = srnf_alloc(3 * n, sizeof(double));
    status = SRNF_ENOMEM;
    if (!values) {
        goto out;
    }
    if (normals) {
        gradients = srnf_alloc(9 * n, sizeof(double));
        directions = srnf_alloc(3 * n, sizeof(double));
        if (!gradients || !directions) {
            goto out;
        }
    }
    status = sphere_harmonics_at_points(context, degree, 3, coefficients, n, mesh->vertices, values,
                                        gradients);
    if (status) {
        goto out;
    }
    if (normals) {
        unit_normals(n, mesh->vertices, gradients, directions);
        *normals = directions;
        directions = NULL;
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t c = 0; c < 3; c++) {
            mesh->vertices[3 * i + c] = values[c * n + i];
        }
    }
out:
    srnf_free(values);
    srnf_free(gradients);
    srnf_free(directions);
    if (status) {
        srnf_mesh_clear(mesh);
    }
    return status;
}

int srnf_surface_triangulate(size_t degree, const double *coefficients, size_t frequency,
                             struct srnf_mesh *mesh, double **normals)
{
    return surface_triangulate(NULL, degree, coefficients, frequency, mesh, normals);
}
