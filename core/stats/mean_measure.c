/*
 * mean_measure.c - the loops over the nodes of the working grid that all subjects of a group mean
 * go through: rotations, energies and penalties at given points.
 *
 * Penalties are those of gamma o d^-1 (mean_center.c), integrals over s = d(t). So is the energy,
 * of the fields at t = d^-1(s): with weights K w at the points d(t), mu / sqrt(K) for the mean and
 * J / K for the Jacobian, the objective of registration/objective.c is that of the group, and the
 * right-hand sides of registration/tabulated_load.c are those of its steps. Energies are sums of
 * squares, so that they do not cancel where a subject meets the mean.
 *
 * Four nodes at a time, the last ones repeated with weight 0 up to a multiple of four.
 */
#include "harmonics/lanes.h"
#include "mean.h"

#include <math.h>

/* ---- The target ------------------------------------------------------------------------------ */

int mean_aim(struct mean_run *run)
{
    const struct target from = {run->points, run->center, run->weight, run->target,
                                run->norm2,  NULL,        NULL};
    struct tabulated_target *aim = &run->aim;
    int status = SRNF_OK;

    tabulated_target_clear(aim);
    status = tabulated_target_create(aim, &from);
    for (size_t k = 0; status == SRNF_OK && k < run->points; k++) {
        double area = run->area[k];

        aim->weight[k] *= area;
        for (size_t c = 0; c < 3; c++) {
            aim->q[c][k] /= sqrt(area);
        }
    }
    return status;
}

SRNF_HOT void mean_divide(size_t padded, const double *jacobian, const double *area, double *ratio)
{
    for (size_t k = 0; k < padded; k++) {
        ratio[k] = jacobian[k] / area[k];
    }
}

/* ---- Measuring ------------------------------------------------------------------------------- */

/* sum of weight sqrt(u) a b' */
SRNF_HOT static void sum_moments(const struct tabulated_target *t, const double *jacobian,
                                 double *const a[3], const double *const b[3], double out[9])
{
    simd sums[9];

    for (size_t k = 0; k < 9; k++) {
        sums[k] = SIMD_SET(0.0);
    }
    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        simd weight, u, root, y[3];

        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(u, jacobian + i);
        simd_sqrt(&u, &root);
        root *= weight;
        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(y[c], b[c] + i);
        }
        for (size_t r = 0; r < 3; r++) {
            simd x;

            SIMD_LOAD(x, a[r] + i);
            x *= root;
            for (size_t c = 0; c < 3; c++) {
                sums[3 * r + c] += x * y[c];
            }
        }
    }
    for (size_t k = 0; k < 9; k++) {
        out[k] = SIMD_SUM(sums[k]);
    }
}

/* sum of weight |a - O sqrt(u) b|^2 */
SRNF_HOT static double sum_squares(const struct tabulated_target *t, const double *jacobian,
                                   double *const a[3], const double *const b[3], const double o[9])
{
    simd sum = SIMD_SET(0.0);

    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        simd weight, u, root, y[3], square = SIMD_SET(0.0);

        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(u, jacobian + i);
        simd_sqrt(&u, &root);
        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(y[c], b[c] + i);
        }
        for (size_t r = 0; r < 3; r++) {
            simd x;

            SIMD_LOAD(x, a[r] + i);
            x -= root * (SIMD_SET(o[3 * r]) * y[0] + SIMD_SET(o[3 * r + 1]) * y[1] +
                         SIMD_SET(o[3 * r + 2]) * y[2]);
            square += x * x;
        }
        sum += weight * square;
    }
    return SIMD_SUM(sum);
}

/* sum of weight (1 + u) (log u)^4 */
SRNF_HOT static double sum_areas(const struct tabulated_target *t, const double *jacobian)
{
    simd sum = SIMD_SET(0.0);

    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        simd weight, u, l;

        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(u, jacobian + i);
        simd_log(&u, &l);
        l *= l;
        sum += weight * (SIMD_SET(1.0) + u) * l * l;
    }
    return SIMD_SUM(sum);
}

/* sum of weight u */
SRNF_HOT static double sum_weighted(const struct tabulated_target *t, const double *ratio)
{
    simd sum = SIMD_SET(0.0);

    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        simd weight, u;

        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(u, ratio + i);
        sum += weight * u;
    }
    return SIMD_SUM(sum);
}

static void set_identity(double m[9])
{
    for (size_t i = 0; i < 9; i++) {
        m[i] = i % 4 == 0 ? 1.0 : 0.0;
    }
}

void mean_penalty_at(const struct mean_run *run, const double *const point[3], const double *ratio,
                     struct mean_stand *at)
{
    const struct srnf_register_options *o = &run->registration;
    double b[9];

    set_identity(at->displacement);
    if (mean_rotates(run)) {
        sum_moments(&run->aim, ratio, run->aim.node, point, b);
        (void)registration_closest_rotation(b, at->displacement);
    }
    at->penalty = registration_hidden(sum_weighted(&run->aim, ratio));
    if (!o->exact && o->penalty_jacobian > 0.0) {
        at->penalty += o->penalty_jacobian * sum_areas(&run->aim, ratio);
    }
    if (!o->exact && o->penalty_displacement > 0.0) {
        at->penalty += o->penalty_displacement *
                       sum_squares(&run->aim, ratio, run->aim.node, point, at->displacement);
    }
}

void mean_stand_at(const struct mean_run *run, const struct cloud *cloud, struct mean_stand *at)
{
    const double *const q[3] = {cloud->q[0], cloud->q[1], cloud->q[2]};
    const double *const point[3] = {cloud->point[0], cloud->point[1], cloud->point[2]};
    double b[9];

    if (mean_rotates(run)) {
        sum_moments(&run->aim, cloud->jacobian, run->aim.q, q, b);
        (void)registration_closest_rotation(b, at->rotation);
    }
    at->energy = sum_squares(&run->aim, cloud->jacobian, run->aim.q, q, at->rotation) / run->norm2;
    mean_penalty_at(run, point, cloud->jacobian, at);
}

/* ---- Fields ---------------------------------------------------------------------------------- */

SRNF_HOT void mean_lay_field(const double rotation[9], const double *jacobian, double *const q[3],
                             size_t n, double *field)
{
    for (size_t k = 0; k < n; k++) {
        double root = __builtin_sqrt(jacobian[k]);

        for (size_t c = 0; c < 3; c++) {
            const double *o = rotation + 3 * c;

            field[c * n + k] = root * (o[0] * q[0][k] + o[1] * q[1][k] + o[2] * q[2][k]);
        }
    }
}

/* ---- What moves the centre ------------------------------------------------------------------- */

SRNF_HOT void mean_gather(const double rotation[9], const struct mean_points *points,
                          const double *area, double share, size_t first, size_t last,
                          const struct mean_pull *pull)
{
    for (size_t i = first; i < last; i += SRNF_LANES) {
        simd p[3], u, k, l, root, l2, l3, l4, sum;

        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(p[c], points->gamma[c] + i);
        }
        SIMD_LOAD(u, points->jacobian + i);
        SIMD_LOAD(k, area + i);
        simd_sqrt(&u, &root);
        root *= SIMD_SET(share);
        for (size_t c = 0; c < 3; c++) {
            const double *o = rotation + 3 * c;

            SIMD_LOAD(sum, pull->moment[c] + i);
            sum += root * (SIMD_SET(o[0]) * p[0] + SIMD_SET(o[1]) * p[1] + SIMD_SET(o[2]) * p[2]);
            SIMD_STORE(pull->moment[c] + i, sum);
        }
        u /= k;
        simd_log(&u, &l);
        l2 = l * l;
        l3 = l2 * l;
        l4 = l2 * l2;
        SIMD_LOAD(sum, pull->pressure + i);
        sum += SIMD_SET(share) * l3 * (SIMD_SET(4.0) * (SIMD_SET(1.0) + u) - l);
        SIMD_STORE(pull->pressure + i, sum);
        SIMD_LOAD(sum, pull->stiffness + i);
        sum += SIMD_SET(share) * (u * l4 + SIMD_SET(8.0) * SIMD_ABS(u * l3) +
                                  SIMD_SET(12.0) * (SIMD_SET(1.0) + u) * l2);
        SIMD_STORE(pull->stiffness + i, sum);
    }
}
