/*
 * ellipsoid.c - alignment of domain and pose by the first-order ellipsoid, as in SPHARM-PDM (C.
 * Brechbuehler, G. Gerig, O. Kuebler, CVIU 1995; M. Styner et al., "Framework for the statistical
 * shape analysis of brain structures using SPHARM-PDM", Insight Journal 2006).
 *
 * The degree-1 part of f is the linear map e -> A e, whose image of the sphere is an ellipsoid. The
 * harmonics Y_1m are sqrt(3 / 4 pi) times y, z, x for m = -1, 0, 1. With A = U S V' the surface
 * e -> U' f(V e) has the ellipsoid S, along the axes of space, with the axes of the domain at its
 * vertices. It is evaluated at the turned nodes and analysed, which is exact for its degree.
 *
 * Cost: one singular value decomposition of 3 x 3, one evaluation at P points, one analysis.
 */
#include "registration.h"

#include <math.h>

/* Column-major 3 x 3 factors, both turned into rotations: the last column takes the sign. */
static int decompose(const double a[9], double u[9], double v[9])
{
    double s[3];
    double vt[9];
    double *factors[2] = {u, v};

    if (linear_singular(a, s, u, vt) != SRNF_OK) {
        return SRNF_ENUMERIC;
    }
    for (size_t i = 0; i < 9; i++) {
        v[i] = vt[3 * (i % 3) + i / 3];
    }
    for (size_t f = 0; f < 2; f++) {
        double *m = factors[f];
        double normal[3];

        vector_cross(m, m + 3, normal);
        for (size_t k = 0; k < 3; k++) {
            m[6 + k] = normal[k];
        }
    }
    return SRNF_OK;
}

int srnf_align_ellipsoid(const struct srnf_sht *sht, const double *coefficients, double *aligned)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t n = grid->n_theta * grid->n_phi;
    size_t each = srnf_coefficient_count(srnf_sht_degree(sht));
    double *points = srnf_alloc(10 * n, sizeof(double));
    double *values;
    double *turned;
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    double a[9];
    double u[9];
    double v[9];
    int status = SRNF_ENOMEM;

    if (!points || !workspace) {
        goto out;
    }
    values = points + 3 * n;
    turned = points + 6 * n;
    for (size_t c = 0; c < 3; c++) {
        a[c] = coefficients[c * each + 3];     /* x */
        a[3 + c] = coefficients[c * each + 1]; /* y */
        a[6 + c] = coefficients[c * each + 2]; /* z */
    }
    status = decompose(a, u, v);
    if (status) {
        goto out;
    }
    registration_nodes(grid, turned, points + 9 * n);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++) {
            points[3 * i + k] =
                v[k] * turned[3 * i] + v[3 + k] * turned[3 * i + 1] + v[6 + k] * turned[3 * i + 2];
        }
    }
    status =
        srnf_harmonics_at_points(srnf_sht_degree(sht), 3, coefficients, n, points, values, NULL);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        const double x[3] = {values[i], values[n + i], values[2 * n + i]};

        for (size_t k = 0; k < 3; k++) {
            turned[k * n + i] = vector_dot(u + 3 * k, x);
        }
    }
    if (status == SRNF_OK) {
        srnf_sht_analysis(sht, 3, turned, aligned, workspace);
    }
out:
    srnf_free(points);
    srnf_free(workspace);
    return status;
}
