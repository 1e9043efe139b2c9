/*
 * sphere_start.c - the unit sphere as a start: R e with R in SO(3) maximizing integral <R e, q>,
 * at the area of q.
 *
 * With B = integral q e', the maximum of trace(R' B) over rotations is R = U diag(1, 1, det(U V'))
 * V' for the singular value decomposition B = U S V' (orthogonal Procrustes problem, W. Kabsch
 * 1976). In the basis of core/harmonics the coordinates of e are the three harmonics of degree 1,
 * so R e is three coefficients a coordinate.
 */
#include "inversion.h"

#include <math.h>

static double determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/* B[c][k] = integral q_c e_k, stored column-major. */
static void moments(const struct gauss_newton *system, double b[9])
{
    const struct srnf_grid *grid = srnf_sht_grid(system->sht);

    for (size_t c = 0; c < 3; c++) {
        double sum[3] = {0.0, 0.0, 0.0};

        for (size_t row = 0; row < grid->n_theta; row++) {
            const double *q = system->q + c * system->points + row * grid->n_phi;
            double total = 0.0;
            double x = 0.0;
            double y = 0.0;

            for (size_t j = 0; j < grid->n_phi; j++) {
                double phi = 2.0 * SRNF_PI * (double)j / (double)grid->n_phi;

                total += q[j];
                x += q[j] * cos(phi);
                y += q[j] * sin(phi);
            }
            sum[0] += grid->weight[row] * grid->sin_theta[row] * x;
            sum[1] += grid->weight[row] * grid->sin_theta[row] * y;
            sum[2] += grid->weight[row] * grid->cos_theta[row] * total;
        }
        for (size_t k = 0; k < 3; k++) {
            b[c + 3 * k] = sum[k];
        }
    }
}

void inversion_sphere_start(const struct gauss_newton *system, double *f)
{
    static const size_t degree_one[3] = {3, 1, 2}; /* x: cos, y: sin, z: m = 0 */
    double b[9];
    double s[3];
    double u[9];
    double vt[9];
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    size_t count = system->count / 3;
    /* |R e| = radius has area 4 pi radius^2; e_k has coefficient sqrt(4 pi / 3) on its harmonic. */
    double scale = sqrt(system->q_norm2 / (4.0 * SRNF_PI)) * sqrt(4.0 * SRNF_PI / 3.0);

    moments(system, b);
    if (linear_singular(b, s, u, vt) == SRNF_OK) {
        double sign = determinant(u) * determinant(vt) < 0.0 ? -1.0 : 1.0;

        for (size_t i = 0; i < 3; i++) {
            for (size_t j = 0; j < 3; j++) {
                rotation[3 * i + j] =
                    u[i] * vt[3 * j] + u[i + 3] * vt[1 + 3 * j] + sign * u[i + 6] * vt[2 + 3 * j];
            }
        }
    }
    for (size_t i = 0; i < system->count; i++) {
        f[i] = 0.0;
    }
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            f[i * count + degree_one[j]] = scale * rotation[3 * i + j];
        }
    }
}
