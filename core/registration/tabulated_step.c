/*
 * tabulated_step.c - moving points by exp(w), q at the points, and the objective.
 *
 * The formulae are those of step.c, moving.c and objective.c; the frame of the derivatives is
 * e_theta, e_phi at each point. The energy is ||q1||^2 + sum w J |q|^2 - 2 tr(O' B): below some
 * 1e-15 of ||q1||^2 it is rounding.
 */
#include "tabulated.h"
#include "tabulated_lanes.h"

#include <math.h>

/* ---- Steps ----------------------------------------------------------------------------------- */

SIMD_INLINE void move_four(const struct sphere_spline *field, size_t order, simd p[3],
                           simd *jacobian)
{
    struct four_steps f;

    step_four(field, order, p, &f);
    *jacobian = SIMD_SELECT(f.square < SIMD_SET(LONG_STEP2), f.jacobian, SIMD_SET(-1.0));
    step_image(&f, p);
}

SIMD_INLINE double move_all(const struct sphere_spline *field, size_t order,
                            const struct cloud *from, struct cloud *to)
{
    simd least = SIMD_SET(INFINITY);

    for (size_t i = 0; i < from->n; i += SRNF_LANES) {
        simd p[3], jacobian, before;

        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(p[c], from->point[c] + i);
        }
        SIMD_LOAD(before, from->jacobian + i);
        move_four(field, order, p, &jacobian);
        least = SIMD_MIN(jacobian, least);
        jacobian *= before;
        for (size_t c = 0; c < 3; c++) {
            SIMD_STORE(to->point[c] + i, p[c]);
        }
        SIMD_STORE(to->jacobian + i, jacobian);
    }
    return fmin(fmin(least[0], least[1]), fmin(least[2], least[3]));
}

SRNF_HOT double cloud_move(const struct sphere_spline *field, const struct cloud *from,
                           struct cloud *to)
{
    return field->order == 4   ? move_all(field, 4, from, to)
           : field->order == 6 ? move_all(field, 6, from, to)
                               : move_all(field, 8, from, to);
}

/* ---- The moving field at the points ---------------------------------------------------------- */

SIMD_INLINE void store(double *const out[3], size_t i, const simd v[3], const simd *scale)
{
    for (size_t c = 0; c < 3; c++) {
        simd x = v[c] * *scale;

        SIMD_STORE(out[c] + i, x);
    }
}

/* |n| and <n, d n> / (2 |n|^2) along both directions. */
SIMD_INLINE void lengths(const simd n[3], const simd n_1[3], const simd n_2[3], simd *length,
                         simd *along, simd *across)
{
    simd square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];

    square = SIMD_MAX(square, SIMD_SET(1e-280));
    simd_sqrt(&square, length);
    *along = SIMD_SET(0.5) * (n[0] * n_1[0] + n[1] * n_1[1] + n[2] * n_1[2]) / square;
    *across = SIMD_SET(0.5) * (n[0] * n_2[0] + n[1] * n_2[1] + n[2] * n_2[2]) / square;
}

/* q, q_1, q_2 of four points: of SRNFs from n and its derivatives. */
SIMD_INLINE void represent_srnf(const struct tabulated_moving *m, size_t order,
                                const struct spline_place *place, struct cloud *cloud, size_t i)
{
    simd n[3], n_1[3], n_2[3];
    simd length, root, along, across;

    gather(&m->normal, order, place, n, n_1, n_2);
    lengths(n, n_1, n_2, &length, &along, &across);
    simd_sqrt(&length, &root);
    root = SIMD_SET(1.0) / root;
    for (size_t c = 0; c < 3; c++) {
        n_1[c] -= along * n[c];
        n_2[c] -= across * n[c];
    }
    store(cloud->q, i, n, &root);
    store(cloud->q_1, i, n_1, &root);
    store(cloud->q_2, i, n_2, &root);
}

/* Of square-root maps from f and its derivatives, too. */
SIMD_INLINE void represent_srm(const struct tabulated_moving *m, size_t order,
                               const struct spline_place *place, struct cloud *cloud, size_t i)
{
    simd n[3], n_1[3], n_2[3], f[3], f_1[3], f_2[3];
    simd length, root, along, across;

    gather(&m->normal, order, place, n, n_1, n_2);
    lengths(n, n_1, n_2, &length, &along, &across);
    simd_sqrt(&length, &root);
    gather(&m->position, order, place, f, f_1, f_2);
    for (size_t c = 0; c < 3; c++) {
        f_1[c] += along * f[c];
        f_2[c] += across * f[c];
    }
    store(cloud->q, i, f, &root);
    store(cloud->q_1, i, f_1, &root);
    store(cloud->q_2, i, f_2, &root);
}

/* What a pulled surface carries for the penalties. */
SIMD_INLINE void evaluate_carried(const struct tabulated_moving *m, size_t order,
                                  const struct spline_place *place, struct cloud *cloud, size_t i)
{
    const simd one = SIMD_SET(1.0);
    simd g[3], g_1[3], g_2[3];

    gather(&m->carried, order, place, g, g_1, g_2);
    store(cloud->carried, i, g, &one);
    store(cloud->carried_1, i, g_1, &one);
    store(cloud->carried_2, i, g_2, &one);
}

SIMD_INLINE void evaluate_all(const struct tabulated_moving *m, size_t order, struct cloud *cloud)
{
    for (size_t i = 0; i < cloud->n; i += SRNF_LANES) {
        struct spline_place place;
        simd p[3];

        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(p[c], cloud->point[c] + i);
        }
        spline_place(&m->normal, order, p, true, &place);
        if (m->representation == SRNF_REPRESENTATION_SRM) {
            represent_srm(m, order, &place, cloud, i);
        } else {
            represent_srnf(m, order, &place, cloud, i);
        }
        if (m->pulled) {
            evaluate_carried(m, order, &place, cloud, i);
        }
    }
}

SRNF_HOT void cloud_evaluate(const struct tabulated_moving *m, struct cloud *cloud)
{
    if (m->normal.order == 4) {
        evaluate_all(m, 4, cloud);
    } else if (m->normal.order == 6) {
        evaluate_all(m, 6, cloud);
    } else {
        evaluate_all(m, 8, cloud);
    }
}

/* ---- The objective --------------------------------------------------------------------------- */

struct sums {
    double fields[9], points[9];  /* sum w sqrt(J) q1 q', sum w sqrt(J) e gamma' */
    double square, area, penalty; /* sum w J |q|^2, sum w J, sum w (1 + J) (log J)^4 */
};

/* What the penalties measure, the points or what a pulled surface carries there; of the latter, J
   is that of both warps. */
SIMD_INLINE void load_measured(const struct cloud *cloud, bool pulled, size_t i, simd p[3],
                               simd *jacobian)
{
    for (size_t c = 0; c < 3; c++) {
        SIMD_LOAD(p[c], (pulled ? cloud->carried : cloud->point)[c] + i);
    }
    if (pulled) {
        *jacobian *= p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    }
}

SRNF_HOT static void sum_points(const struct tabulated_target *t, const struct cloud *cloud,
                                bool pulled, bool penalty, struct sums *sums)
{
    simd fields[9], points[9];
    simd square = SIMD_SET(0.0), area = SIMD_SET(0.0), rho = SIMD_SET(0.0);

    for (size_t k = 0; k < 9; k++) {
        fields[k] = points[k] = SIMD_SET(0.0);
    }
    for (size_t i = 0; i < t->n; i += SRNF_LANES) {
        simd weight, jacobian, root, scaled, q[3], p[3], l, length = SIMD_SET(0.0);

        SIMD_LOAD(weight, t->weight + i);
        SIMD_LOAD(jacobian, cloud->jacobian + i);
        simd_sqrt(&jacobian, &root);
        scaled = weight * root;
        for (size_t c = 0; c < 3; c++) {
            SIMD_LOAD(q[c], cloud->q[c] + i);
            length += q[c] * q[c];
        }
        square += weight * jacobian * length;
        load_measured(cloud, pulled, i, p, &jacobian);
        for (size_t r = 0; r < 3; r++) {
            simd a, e;

            SIMD_LOAD(a, t->q[r] + i);
            SIMD_LOAD(e, t->node[r] + i);
            a *= scaled;
            e *= scaled;
            for (size_t c = 0; c < 3; c++) {
                fields[3 * r + c] += a * q[c];
                points[3 * r + c] += e * p[c];
            }
        }
        area += weight * jacobian;
        if (penalty) {
            simd_log(&jacobian, &l);
            l *= l;
            rho += weight * (SIMD_SET(1.0) + jacobian) * l * l;
        }
    }
    for (size_t k = 0; k < 9; k++) {
        sums->fields[k] = SIMD_SUM(fields[k]);
        sums->points[k] = SIMD_SUM(points[k]);
    }
    sums->square = SIMD_SUM(square);
    sums->area = SIMD_SUM(area);
    sums->penalty = SIMD_SUM(rho);
}

void cloud_measure(const struct tabulated_problem *problem, struct cloud *cloud)
{
    const struct tabulated_target *t = problem->target;
    struct sums sums;
    double fields, points;

    sum_points(t, cloud, problem->moving->pulled, problem->penalty.jacobian > 0.0, &sums);
    if (!isfinite(sums.fields[0] + sums.points[0] + sums.square + sums.area + sums.penalty)) {
        /* The warp folds the sphere over: rotations of no numbers, and fmax below, would hide it */
        cloud->energy = cloud->objective = INFINITY;
        return;
    }
    if (problem->free_rotation) {
        fields = tabulated_closest_rotation(sums.fields, cloud->rotation);
        points = tabulated_closest_rotation(sums.points, cloud->displacement);
    } else {
        fields = sums.fields[0] + sums.fields[4] + sums.fields[8];
        points = sums.points[0] + sums.points[4] + sums.points[8];
    }
    cloud->energy = fmax(0.0, t->norm2 + sums.square - 2.0 * fields) / t->norm2;
    cloud->objective =
        cloud->energy + registration_hidden(sums.area) + problem->penalty.jacobian * sums.penalty +
        problem->penalty.displacement * fmax(0.0, 4.0 * SRNF_PI + sums.area - 2.0 * points);
}
