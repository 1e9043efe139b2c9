/*
 * tabulated_points.c - templates and clouds of points as structures of arrays, and the closest
 * rotation without a singular value decomposition.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define TARGET_ARRAYS ((size_t)7)
#define NEWTON_STEPS 60
/* Of x^3, that the eigenvalues apart from x must differ from it by, multiplied: below it the root
   is nearly double, and Newton's method loses digits. */
#define SIMPLE_ROOT 1e-3

static size_t padded(size_t n)
{
    return (n + SRNF_LANES - 1) / SRNF_LANES * SRNF_LANES;
}

int tabulated_target_create(struct tabulated_target *target, const struct target *from)
{
    size_t n = padded(from->n);

    *target = (struct tabulated_target){.n = n, .norm2 = from->norm2};
    target->memory = srnf_alloc(TARGET_ARRAYS * n, sizeof(double));
    if (!target->memory) {
        return SRNF_ENOMEM;
    }
    target->weight = target->memory + 6 * n;
    for (size_t c = 0; c < 3; c++) {
        target->node[c] = target->memory + c * n;
        target->q[c] = target->memory + (3 + c) * n;
    }
    for (size_t i = 0; i < n; i++) {
        size_t at = i < from->n ? i : from->n - 1;

        for (size_t c = 0; c < 3; c++) {
            target->node[c][i] = from->points[3 * at + c];
            target->q[c][i] = from->q ? from->q[3 * at + c] : 0.0;
        }
        target->weight[i] = i < from->n && from->weight ? from->weight[i] : 0.0;
    }
    return SRNF_OK;
}

void tabulated_target_clear(struct tabulated_target *target)
{
    srnf_free(target->memory);
    *target = (struct tabulated_target){0};
}

void cloud_place(struct cloud *cloud, size_t n, double *memory)
{
    double **const arrays[] = {cloud->point,   cloud->q,         cloud->q_1,      cloud->q_2,
                               cloud->carried, cloud->carried_1, cloud->carried_2};

    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        for (size_t c = 0; c < 3; c++) {
            arrays[k][c] = memory + (3 * k + c) * n;
        }
    }
    cloud->jacobian = memory + (CLOUD_ARRAYS - 1) * n;
}

int cloud_create(struct cloud *cloud, size_t n)
{
    *cloud = (struct cloud){.n = n};
    cloud->memory = srnf_alloc(CLOUD_ARRAYS * n, sizeof(double));
    if (!cloud->memory) {
        return SRNF_ENOMEM;
    }
    cloud_place(cloud, n, cloud->memory);
    return SRNF_OK;
}

void cloud_clear(struct cloud *cloud)
{
    srnf_free(cloud->memory);
    *cloud = (struct cloud){0};
}

void cloud_rotate(struct cloud *cloud, const struct tabulated_target *target,
                  const double rotation[9])
{
    for (size_t i = 0; i < cloud->n; i++) {
        for (size_t c = 0; c < 3; c++) {
            cloud->point[c][i] = rotation[3 * c] * target->node[0][i] +
                                 rotation[3 * c + 1] * target->node[1][i] +
                                 rotation[3 * c + 2] * target->node[2][i];
        }
        cloud->jacobian[i] = 1.0;
    }
    for (size_t k = 0; k < 9; k++) {
        cloud->rotation[k] = cloud->displacement[k] = k % 4 == 0 ? 1.0 : 0.0;
    }
}

void cloud_turn(struct cloud *cloud, const double rotation[9])
{
    for (size_t i = 0; i < cloud->n; i++) {
        const double p[3] = {cloud->point[0][i], cloud->point[1][i], cloud->point[2][i]};

        for (size_t k = 0; k < 3; k++) {
            cloud->point[k][i] = vector_dot(rotation + 3 * k, p);
        }
    }
}

/* ---- Closest rotation ------------------------------------------------------------------------ */

/* The largest root of the characteristic polynomial x^4 + c2 x^2 + c1 x + c0 of Horn's matrix, from
   above, where it is convex and rises: the sum of the singular values, the least with the sign of
   the determinant. minors: cofactors of b. */
static double largest_root(const double b[9], const double minors[9])
{
    double det = b[0] * minors[0] + b[1] * minors[1] + b[2] * minors[2];
    double n2 = 0.0, m2 = 0.0;
    double x;

    for (size_t i = 0; i < 9; i++) {
        n2 += b[i] * b[i];
        m2 += minors[i] * minors[i];
    }
    x = sqrt(3.0 * n2);
    for (int step = 0; step < NEWTON_STEPS; step++) {
        double value = ((x * x - 2.0 * n2) * x - 8.0 * det) * x + n2 * n2 - 4.0 * m2;
        double slope = (4.0 * x * x - 4.0 * n2) * x - 8.0 * det;
        double change = slope > 0.0 ? value / slope : 0.0;

        x -= change;
        if (!(fabs(change) > 1e-15 * x)) {
            break;
        }
    }
    return x;
}

/* A vector of the kernel of a symmetric 4 x 4 matrix of rank 3: the largest of its adjugate's
   columns. Returns its length, which is no more than the product of the other eigenvalues. */
static double kernel_vector(double m[4][4], double out[4])
{
    double best = 0.0;

    for (size_t c = 0; c < 4; c++) {
        double v[4];
        double norm = 0.0;

        for (size_t r = 0; r < 4; r++) {
            double s[9];
            size_t t = 0;

            for (size_t i = 0; i < 4; i++) {
                for (size_t j = 0; j < 4; j++) {
                    if (i != c && j != r) {
                        s[t++] = m[i][j];
                    }
                }
            }
            v[r] = s[0] * (s[4] * s[8] - s[5] * s[7]) - s[1] * (s[3] * s[8] - s[5] * s[6]) +
                   s[2] * (s[3] * s[7] - s[4] * s[6]);
            v[r] = (r + c) % 2 ? -v[r] : v[r];
            norm += v[r] * v[r];
        }
        if (norm > best) {
            best = norm;
            memcpy(out, v, sizeof v);
        }
    }
    return sqrt(best);
}

double tabulated_closest_rotation(const double b[9], double rotation[9])
{
    const double minors[9] = {
        b[4] * b[8] - b[5] * b[7], b[5] * b[6] - b[3] * b[8], b[3] * b[7] - b[4] * b[6],
        b[2] * b[7] - b[1] * b[8], b[0] * b[8] - b[2] * b[6], b[1] * b[6] - b[0] * b[7],
        b[1] * b[5] - b[2] * b[4], b[2] * b[3] - b[0] * b[5], b[0] * b[4] - b[1] * b[3]};
    double x = largest_root(b, minors);
    double m[4][4] = {{b[0] + b[4] + b[8] - x, b[7] - b[5], b[2] - b[6], b[3] - b[1]},
                      {b[7] - b[5], b[0] - b[4] - b[8] - x, b[1] + b[3], b[2] + b[6]},
                      {b[2] - b[6], b[1] + b[3], b[4] - b[0] - b[8] - x, b[5] + b[7]},
                      {b[3] - b[1], b[2] + b[6], b[5] + b[7], b[8] - b[0] - b[4] - x}};
    double q[4];
    double norm;

    if (!rotation) {
        return x;
    }
    if (!(kernel_vector(m, q) > SIMPLE_ROOT * x * x * x)) {
        return registration_closest_rotation(b, rotation);
    }
    norm = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (size_t k = 0; k < 4; k++) {
        q[k] *= norm;
    }
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            size_t k = 3 - i - j;
            double sign = (i + 1) % 3 == j ? -1.0 : 1.0;

            rotation[3 * i + j] = i == j ? 1.0 - 2.0 * (q[1 + (i + 1) % 3] * q[1 + (i + 1) % 3] +
                                                        q[1 + (i + 2) % 3] * q[1 + (i + 2) % 3])
                                         : 2.0 * (q[1 + i] * q[1 + j] + sign * q[0] * q[1 + k]);
        }
    }
    return x;
}
