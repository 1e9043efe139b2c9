/*
 * objective.c - energy and penalties of a warp.
 *
 *   objective = ||q1 - O sqrt(J) q2 o gamma||^2 / ||q1||^2
 *             + a integral (1 + J) (log J)^4 + b min over O' of integral |e - O' sqrt(J) gamma|^2
 *
 * The first penalty keeps J away from 0, the second keeps displacements down; both are unchanged
 * under gamma -> gamma^-1, so the objective is symmetric but for the norm of q1. O and O' are the
 * closest rotations to the cross moments, in closed form.
 */
#include "registration.h"

#include <math.h>
#include <string.h>

/* Pairs of nuclei that the full grid resolves are below .0045 of the sphere there, most below
   .0005; searches that this did not stop hid .07 to .2. */
#define HIDDEN_FREE 0.01
#define HIDDEN_WEIGHT 10.0

double registration_closest_rotation(const double b[9], double rotation[9])
{
    double a[9];
    double s[3];
    double u[9];
    double vt[9];
    double sign;

    for (size_t i = 0; i < 9; i++) {
        a[i] = b[3 * (i % 3) + i / 3]; /* to column-major */
        rotation[i] = i % 4 == 0 ? 1.0 : 0.0;
    }
    if (linear_singular(a, s, u, vt) != SRNF_OK) {
        return 0.0;
    }
    sign = (u[0] * (u[4] * u[8] - u[5] * u[7]) - u[3] * (u[1] * u[8] - u[2] * u[7]) +
            u[6] * (u[1] * u[5] - u[2] * u[4])) *
           (vt[0] * (vt[4] * vt[8] - vt[5] * vt[7]) - vt[3] * (vt[1] * vt[8] - vt[2] * vt[7]) +
            vt[6] * (vt[1] * vt[5] - vt[2] * vt[4]));
    sign = sign < 0.0 ? -1.0 : 1.0;
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            rotation[3 * i + j] =
                u[i] * vt[3 * j] + u[i + 3] * vt[1 + 3 * j] + sign * u[i + 6] * vt[2 + 3 * j];
        }
    }
    return s[0] + s[1] + sign * s[2];
}

static void set_identity(double m[9])
{
    for (size_t i = 0; i < 9; i++) {
        m[i] = i % 4 == 0 ? 1.0 : 0.0;
    }
}

/* sum of weight sqrt(J) a b' */
static void moments(const struct target *t, const struct warp *warp, const double *a,
                    const double *b, double out[9])
{
    double sums[9] = {0.0}; /* of constant size: registers */

    for (size_t i = 0; i < t->n; i++) {
        double w = t->weight[i] * sqrt(warp->jacobian[i]);
        const double from[3] = {w * a[3 * i], w * a[3 * i + 1], w * a[3 * i + 2]};
        const double to[3] = {b[3 * i], b[3 * i + 1], b[3 * i + 2]};

        for (size_t k = 0; k < 9; k++) {
            sums[k] += from[k / 3] * to[k % 3];
        }
    }
    memcpy(out, sums, sizeof sums);
}

/* sum of weight |a - O sqrt(J) b|^2 */
static double residual_norm2(const struct target *t, const struct warp *warp, const double *a,
                             const double *b, const double o[9])
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        double root = sqrt(warp->jacobian[i]);
        double square = 0.0;

        for (size_t r = 0; r < 3; r++) {
            double value =
                o[3 * r] * b[3 * i] + o[3 * r + 1] * b[3 * i + 1] + o[3 * r + 2] * b[3 * i + 2];
            double d = a[3 * i + r] - root * value;

            square += d * d;
        }
        sum += t->weight[i] * square;
    }
    return sum;
}

static double jacobian_penalty(const struct target *t, const struct warp *warp)
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        double area = target_area(t, i);
        double jacobian = warp->jacobian[i] / area;
        double l = log(jacobian);

        sum += t->weight[i] * area * (1.0 + jacobian) * l * l * l * l;
    }
    return sum;
}

double registration_hidden(double area)
{
    double hidden = fabs(area / (4.0 * SRNF_PI) - 1.0) - HIDDEN_FREE;

    return hidden <= 0.0 ? 0.0 : HIDDEN_WEIGHT * hidden; /* what is no number stays so */
}

static double warp_area(const struct target *t, const struct warp *warp)
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        sum += t->weight[i] * warp->jacobian[i];
    }
    return sum;
}

void registration_objective(const struct problem *problem, struct warp *warp,
                            struct samples *samples, double displacement_rotation[9])
{
    moving_evaluate(problem->moving, warp->points, samples);
    registration_measure(problem, warp, samples, displacement_rotation);
}

void registration_measure(const struct problem *problem, struct warp *warp,
                          const struct samples *samples, double displacement_rotation[9])
{
    const struct target *t = &problem->target;
    double b[9];

    if (problem->free_rotation) {
        moments(t, warp, t->q, samples->q, b);
        (void)registration_closest_rotation(b, warp->rotation);
    }
    if (displacement_rotation) {
        set_identity(displacement_rotation);
        if (problem->free_rotation) {
            moments(t, warp, target_reference(t), warp->points, b);
            (void)registration_closest_rotation(b, displacement_rotation);
        }
    }
    warp->energy = residual_norm2(t, warp, t->q, samples->q, warp->rotation) / t->norm2;
    warp->objective = warp->energy + registration_hidden(warp_area(t, warp));
    if (problem->penalty.jacobian > 0.0) {
        warp->objective += problem->penalty.jacobian * jacobian_penalty(t, warp);
    }
    if (problem->penalty.displacement > 0.0) {
        warp->objective +=
            problem->penalty.displacement *
            residual_norm2(t, warp, target_reference(t), warp->points, displacement_rotation);
    }
}
