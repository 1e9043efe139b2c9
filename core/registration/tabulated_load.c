/*
 * tabulated_load.c - the right-hand side of a step: loads at the points, spread over a table.
 *
 * At each point the load on a field X is <v, X> + alpha div X; the formulae are those of
 * optimize.c. v in R^3 and alpha are the four components that go to the nodes, by the weights that
 * X and div X would be interpolated with.
 */
#include "harmonics/spline_lanes.h"
#include "tabulated.h"

struct load {
    simd along, across, alpha; /* of v in the frame of the point */
};

/* y = R' a - root b, times weight; r: row-major */
SIMD_INLINE void residual(const double r[9], const simd a[3], const simd *root, const simd b[3],
                          const simd *weight, simd y[3])
{
    for (size_t k = 0; k < 3; k++) {
        y[k] = *weight * (SIMD_SET(r[k]) * a[0] + SIMD_SET(r[3 + k]) * a[1] +
                          SIMD_SET(r[6 + k]) * a[2] - *root * b[k]);
    }
}

SIMD_INLINE void load_three(double *const in[3], size_t i, simd out[3])
{
    for (size_t c = 0; c < 3; c++) {
        SIMD_LOAD(out[c], in[c] + i);
    }
}

#define DOT(a, b) ((a)[0] * (b)[0] + (a)[1] * (b)[1] + (a)[2] * (b)[2])

/* The data term. */
SIMD_INLINE void add_data(const struct tabulated_target *t, const struct cloud *cloud, size_t i,
                          const simd *weight, const simd *root, struct load *load, simd torque[3])
{
    simd a[3], q[3], q_1[3], q_2[3], y[3];
    simd scaled = *weight * *root * SIMD_SET(1.0 / t->norm2);

    load_three(t->q, i, a);
    load_three(cloud->q, i, q);
    load_three(cloud->q_1, i, q_1);
    load_three(cloud->q_2, i, q_2);
    residual(cloud->rotation, a, root, q, &scaled, y);
    load->along = DOT(y, q_1);
    load->across = DOT(y, q_2);
    load->alpha = SIMD_SET(0.5) * DOT(y, q);
    torque[0] += q[1] * y[2] - q[2] * y[1];
    torque[1] += q[2] * y[0] - q[0] * y[2];
    torque[2] += q[0] * y[1] - q[1] * y[0];
}

/* What the penalties measure at four points, and its derivatives: the points themselves, or sqrt(J)
   gamma of the warp that a surface was pulled back by. */
struct measured {
    simd p[3], p_1[3], p_2[3];
};

SIMD_INLINE void load_measured(const struct cloud *cloud, bool pulled, size_t i, const simd p[3],
                               const simd a[3], const simd b[2], struct measured *m)
{
    if (pulled) {
        load_three(cloud->carried, i, m->p);
        load_three(cloud->carried_1, i, m->p_1);
        load_three(cloud->carried_2, i, m->p_2);
        return;
    }
    for (size_t c = 0; c < 3; c++) {
        m->p[c] = p[c];
        m->p_1[c] = a[c];
        m->p_2[c] = c < 2 ? b[c] : SIMD_SET(0.0);
    }
}

/* The displacement penalty. */
SIMD_INLINE void add_displacement(const struct tabulated_problem *problem,
                                  const struct cloud *cloud, size_t i, const simd *weight,
                                  const simd *root, const struct measured *m, struct load *load)
{
    simd scaled = *weight * *root * SIMD_SET(problem->penalty.displacement);
    simd e[3], y[3];

    load_three(problem->target->node, i, e);
    residual(cloud->displacement, e, root, m->p, &scaled, y);
    load->along += DOT(y, m->p_1);
    load->across += DOT(y, m->p_2);
    load->alpha += SIMD_SET(0.5) * DOT(y, m->p);
}

/* The Jacobian penalty; its curvature is returned in *curvature. Of a pulled surface J is that of
   both warps, K = |p|^2 that of the first: a field X changes log J by div X + X . grad log K. */
SIMD_INLINE void add_jacobian(double penalty, bool pulled, const simd *weights,
                              const simd *jacobians, const struct measured *m, struct load *load,
                              simd *curvature)
{
    simd weight = *weights;
    simd area = pulled ? DOT(m->p, m->p) : SIMD_SET(1.0);
    simd jacobian = *jacobians * area;
    simd l, l2, l3, l4, pull;

    simd_log(&jacobian, &l);
    l2 = l * l;
    l3 = l2 * l;
    l4 = l2 * l2;
    pull = SIMD_SET(0.5 * penalty) * weight *
           (jacobian * l4 + SIMD_SET(4.0) * (SIMD_SET(1.0) + jacobian) * l3);
    load->alpha -= pull;
    if (pulled) {
        load->along -= SIMD_SET(2.0) * pull * DOT(m->p, m->p_1) / area;
        load->across -= SIMD_SET(2.0) * pull * DOT(m->p, m->p_2) / area;
    }
    *curvature += weight * (jacobian * l4 + SIMD_SET(8.0) * SIMD_ABS(jacobian * l3) +
                            SIMD_SET(12.0) * (SIMD_SET(1.0) + jacobian) * l2);
}

SIMD_INLINE double load_all(const struct tabulated_problem *problem, const struct cloud *cloud,
                            size_t order, struct sphere_spline *field, double torque[3])
{
    const struct tabulated_target *t = problem->target;
    bool pulled = problem->moving->pulled;
    simd turns[3] = {SIMD_SET(0.0), SIMD_SET(0.0), SIMD_SET(0.0)};
    simd curvature = SIMD_SET(0.0);

    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        struct spline_place place;
        struct load load;
        struct measured measured;
        simd p[3], a[3], b[2], weight, jacobian, root, v[3];

        load_three(cloud->point, i, p);
        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(jacobian, cloud->jacobian + i);
        simd_sqrt(&jacobian, &root);
        spline_place(field, order, p, false, &place);
        spline_frame(&place, a, b);
        add_data(t, cloud, i, &weight, &root, &load, turns);
        load_measured(cloud, pulled, i, p, a, b, &measured);
        if (problem->penalty.displacement > 0.0) {
            add_displacement(problem, cloud, i, &weight, &root, &measured, &load);
        }
        if (problem->penalty.jacobian > 0.0) {
            add_jacobian(problem->penalty.jacobian, pulled, &weight, &jacobian, &measured, &load,
                         &curvature);
        }
        v[0] = load.along * a[0] + load.across * b[0];
        v[1] = load.along * a[1] + load.across * b[1];
        v[2] = load.along * a[2];
        for (size_t k = 0; k < SRNF_LANES; k++) {
            simd four = {v[0][k], v[1][k], v[2][k], load.alpha[k]};

            spline_spread(field, order, &place, k, &four);
        }
    }
    for (size_t k = 0; k < 3; k++) {
        torque[k] = SIMD_SUM(turns[k]);
    }
    return 0.5 * problem->penalty.jacobian / (4.0 * SRNF_PI) * SIMD_SUM(curvature);
}

SRNF_HOT double cloud_load(const struct tabulated_problem *problem, const struct cloud *cloud,
                           struct sphere_spline *field, double torque[3])
{
    sphere_spline_zero(field);
    return field->order == 4   ? load_all(problem, cloud, 4, field, torque)
           : field->order == 6 ? load_all(problem, cloud, 6, field, torque)
                               : load_all(problem, cloud, 8, field, torque);
}
