/*
 * pointwise.c - SRNF, its differential and the adjoint of that, point by point.
 *
 *   n = f_theta x f_phi,  q = n / |n|^(1/2)
 *   Q_* w = (n_w - <n~, n_w> n~ / 2) / |n|^(1/2),  n_w = f_theta x w_phi + w_theta x f_phi,  n~ = n
 *   / |n|
 *
 * (the paper, section 3; f_phi stands for f_phi / sin theta throughout). Fields are double[3][n],
 * so that every loop runs over contiguous memory in each component; restrict tells the compiler
 * that outputs are apart. The cost is some 40 operations a point, well below that of the transform
 * that feeds it.
 */
#include "linear/linear.h"
#include "field.h"
#include "harmonics/simd.h"

#include <math.h>

SRNF_HOT void pointwise_normals(size_t n, const double *restrict f_theta,
                                const double *restrict f_phi, double *restrict unit,
                                double *restrict root, double *restrict inverse)
{
    const double *restrict ay = f_theta + n;
    const double *restrict az = f_theta + 2 * n;
    const double *restrict by = f_phi + n;
    const double *restrict bz = f_phi + 2 * n;
    double *restrict uy = unit + n;
    double *restrict uz = unit + 2 * n;

    for (size_t i = 0; i < n; i++) {
        double x = ay[i] * bz[i] - az[i] * by[i];
        double y = az[i] * f_phi[i] - f_theta[i] * bz[i];
        double z = f_theta[i] * by[i] - ay[i] * f_phi[i];
        double length = sqrt(x * x + y * y + z * z);
        double reciprocal = length > 0.0 ? 1.0 / length : 0.0;

        unit[i] = x * reciprocal;
        uy[i] = y * reciprocal;
        uz[i] = z * reciprocal;
        root[i] = sqrt(length);
        inverse[i] = sqrt(reciprocal);
    }
}

SRNF_HOT void pointwise_residual(size_t n, const double *restrict unit, const double *restrict root,
                                 const double *restrict q, double *restrict residual)
{
    for (size_t c = 0; c < 3; c++) {
        const double *restrict u = unit + c * n;
        const double *restrict target = q + c * n;
        double *restrict out = residual + c * n;

        for (size_t i = 0; i < n; i++) {
            out[i] = u[i] * root[i] - target[i];
        }
    }
}

SRNF_HOT void pointwise_differential(size_t n, const double *restrict f_theta,
                                     const double *restrict f_phi, const double *restrict unit,
                                     const double *restrict inverse, const double *restrict w_theta,
                                     const double *restrict w_phi, double *restrict out)
{
    size_t m = 2 * n;

    for (size_t i = 0; i < n; i++) {
        double ax = f_theta[i], ay = f_theta[n + i], az = f_theta[m + i];
        double bx = f_phi[i], by = f_phi[n + i], bz = f_phi[m + i];
        double cx = w_theta[i], cy = w_theta[n + i], cz = w_theta[m + i];
        double dx = w_phi[i], dy = w_phi[n + i], dz = w_phi[m + i];
        double x = ay * dz - az * dy + cy * bz - cz * by;
        double y = az * dx - ax * dz + cz * bx - cx * bz;
        double z = ax * dy - ay * dx + cx * by - cy * bx;
        double half = 0.5 * (unit[i] * x + unit[n + i] * y + unit[m + i] * z);

        out[i] = (x - half * unit[i]) * inverse[i];
        out[n + i] = (y - half * unit[n + i]) * inverse[i];
        out[m + i] = (z - half * unit[m + i]) * inverse[i];
    }
}

SRNF_HOT void
pointwise_differential_adjoint(size_t n, const double *restrict f_theta,
                               const double *restrict f_phi, const double *restrict unit,
                               const double *restrict inverse, const double *restrict weight,
                               const double *restrict field, double *restrict a, double *restrict b)
{
    size_t m = 2 * n;

    for (size_t i = 0; i < n; i++) {
        double scale = weight[i] * inverse[i];
        double half =
            0.5 * (unit[i] * field[i] + unit[n + i] * field[n + i] + unit[m + i] * field[m + i]);
        double x = (field[i] - half * unit[i]) * scale;
        double y = (field[n + i] - half * unit[n + i]) * scale;
        double z = (field[m + i] - half * unit[m + i]) * scale;

        a[i] = f_phi[n + i] * z - f_phi[m + i] * y;
        a[n + i] = f_phi[m + i] * x - f_phi[i] * z;
        a[m + i] = f_phi[i] * y - f_phi[n + i] * x;
        b[i] = y * f_theta[m + i] - z * f_theta[n + i];
        b[n + i] = z * f_theta[i] - x * f_theta[m + i];
        b[m + i] = x * f_theta[n + i] - y * f_theta[i];
    }
}

SRNF_HOT void pointwise_normal_part(size_t n, const double *restrict u,
                                    const double *restrict weight, double *restrict w_theta,
                                    double *restrict w_phi)
{
    size_t m = 2 * n;

    for (size_t i = 0; i < n; i++) {
        double s =
            weight[i] * (w_theta[i] * u[i] + w_theta[n + i] * u[n + i] + w_theta[m + i] * u[m + i]);
        double t =
            weight[i] * (w_phi[i] * u[i] + w_phi[n + i] * u[n + i] + w_phi[m + i] * u[m + i]);

        w_theta[i] = s * u[i];
        w_theta[n + i] = s * u[n + i];
        w_theta[m + i] = s * u[m + i];
        w_phi[i] = t * u[i];
        w_phi[n + i] = t * u[n + i];
        w_phi[m + i] = t * u[m + i];
    }
}

double pointwise_norm2(size_t n, const double *weight, const double *a)
{
    double sum = 0.0;

    for (size_t c = 0; c < 3; c++) {
        sum += linear_dot_weighted(n, weight, a + c * n, a + c * n);
    }
    return sum;
}

void pointwise_weights(const struct srnf_grid *grid, double *weight)
{
    for (size_t row = 0; row < grid->n_theta; row++) {
        for (size_t j = 0; j < grid->n_phi; j++) {
            weight[row * grid->n_phi + j] = grid->weight[row];
        }
    }
}
