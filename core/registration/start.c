/*
 * start.c - rigid refinement of a start.
 *
 * Levenberg-Marquardt over R <- exp(omega) R and O, exact q2 at the turned nodes. With y = O' q1 -
 * q2(R s): the columns are grad q2 . (e_j x p) and e_j x q2, six unknowns.
 */
#include "registration.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define RIGID_STEPS 30
#define RIGID_DECREASE 1e-6
#define RIGID_ZERO 1e-28

/* exp of a rotation vector (Rodrigues) times m */
static void rotate_by(const double omega[3], double m[9])
{
    double angle = sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]);
    double s = angle > 1e-12 ? sin(angle) / angle : 1.0;
    double c = angle > 1e-6 ? (1.0 - cos(angle)) / (angle * angle) : 0.5;
    double k[9] = {0, -omega[2], omega[1], omega[2], 0, -omega[0], -omega[1], omega[0], 0};
    double out[9];
    double product[9];

    for (size_t i = 0; i < 9; i++) {
        double square = 0.0;

        for (size_t j = 0; j < 3; j++) {
            square += k[i / 3 * 3 + j] * k[3 * j + i % 3];
        }
        out[i] = (i % 4 == 0) + s * k[i] + c * square;
    }
    for (size_t i = 0; i < 9; i++) {
        product[i] = 0.0;
        for (size_t j = 0; j < 3; j++) {
            product[i] += out[i / 3 * 3 + j] * m[3 * j + i % 3];
        }
    }
    /* Rounding drifts away from a rotation: back to the closest one. */
    (void)registration_closest_rotation(product, m);
}

/* Normal equations of the six unknowns; a: column-major 6 x 6. */
static void normal_equations(const struct problem *problem, const struct warp *warp,
                             const struct samples *s, double a[36], double rhs[6])
{
    const struct target *t = &problem->target;

    memset(a, 0, 36 * sizeof *a);
    memset(rhs, 0, 6 * sizeof *rhs);
    for (size_t i = 0; i < t->n; i++) {
        const double *p = warp->points + 3 * i;
        const double *q = s->q + 3 * i;
        const double weight = t->weight[i] / t->norm2;
        double columns[6][3];
        double y[3];

        for (size_t k = 0; k < 3; k++) {
            y[k] = -q[k];
            for (size_t j = 0; j < 3; j++) {
                y[k] += warp->rotation[3 * j + k] * t->q[3 * i + j];
            }
        }
        for (size_t j = 0; j < 3; j++) {
            size_t u = (j + 1) % 3;
            size_t v = (j + 2) % 3;
            /* e_j x p has -p_v at u and p_u at v. */
            double w_1 = s->t1[3 * i + v] * p[u] - s->t1[3 * i + u] * p[v];
            double w_2 = s->t2[3 * i + v] * p[u] - s->t2[3 * i + u] * p[v];

            for (size_t k = 0; k < 3; k++) {
                columns[j][k] = w_1 * s->q_1[3 * i + k] + w_2 * s->q_2[3 * i + k];
                columns[3 + j][k] = 0.0;
            }
            columns[3 + j][u] = -q[v];
            columns[3 + j][v] = q[u];
        }
        for (size_t j = 0; j < 6; j++) {
            double scaled[3];

            for (size_t k = 0; k < 3; k++) {
                scaled[k] = weight * columns[j][k];
                rhs[j] += scaled[k] * y[k];
            }
            for (size_t l = 0; l < 6; l++) {
                double sum = a[6 * j + l];

                for (size_t k = 0; k < 3; k++) {
                    sum += scaled[k] * columns[l][k];
                }
                a[6 * j + l] = sum;
            }
        }
    }
}

/* Smallest eigenvalue of the Schur complement on the domain's rotations: the value rotation
   follows. */
static double domain_curvature(const double a[36])
{
    double m[9];
    double inverse[9];
    double cross_block[9];
    double values[3];
    double work[64];

    for (size_t i = 0; i < 9; i++) {
        m[i] = a[6 * (i / 3) + i % 3];
        inverse[i] = a[6 * (3 + i / 3) + 3 + i % 3];
        cross_block[i] = a[6 * (i / 3) + 3 + i % 3];
    }
    if (LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', 3, inverse, 3) != 0) {
        return 0.0;
    }
    {
        double solved[9];

        memcpy(solved, cross_block, sizeof solved);
        (void)LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', 3, 3, inverse, 3, solved, 3);
        for (size_t i = 0; i < 3; i++) {
            for (size_t j = 0; j < 3; j++) {
                for (size_t k = 0; k < 3; k++) {
                    m[3 * i + j] -= cross_block[3 * i + k] * solved[3 * j + k];
                }
            }
        }
    }
    return LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'N', 'L', 3, m, 3, values, work, 64) == 0
               ? fmax(0.0, values[0])
               : 0.0;
}

/* The domain turned, and what is there. */
static int place(const struct problem *problem, const double rotation[9], struct warp *warp,
                 struct samples *samples)
{
    double ignored[9];
    int status = warp_rotate(warp, &problem->target, rotation);

    registration_objective(problem, warp, samples, ignored);
    return status;
}

int registration_rigid(const struct problem *problem, struct start_rotation *start,
                       double *curvature)
{
    struct warp warp;
    struct samples samples = {0};
    double a[36], rhs[6];
    double lambda = 1e-3;
    struct problem plain = *problem;
    int status = warp_create(&warp, &problem->target);

    plain.penalty = (struct penalty){0.0, 0.0};
    status = status ? status : samples_create(&samples, problem->target.n);
    if (status) {
        warp_clear(&warp);
        return status;
    }
    status = place(&plain, start->rotation, &warp, &samples);
    start->stopped = SRNF_REGISTER_MAX_ITERATIONS;
    for (int step = 0; step < RIGID_STEPS && warp.energy > RIGID_ZERO && status == SRNF_OK;
         step++) {
        double before = warp.energy;
        double candidate[9];

        normal_equations(problem, &warp, &samples, a, rhs);
        for (size_t j = 0; j < 6; j++) {
            a[7 * j] *= 1.0 + lambda;
        }
        if (LAPACKE_dposv_work(LAPACK_COL_MAJOR, 'L', 6, 1, a, 6, rhs, 6) != 0) {
            start->stopped = SRNF_REGISTER_REFUSED;
            break;
        }
        memcpy(candidate, start->rotation, sizeof candidate);
        rotate_by(rhs, candidate);
        status = place(&plain, candidate, &warp, &samples);
        if (warp.energy < before) {
            memcpy(start->rotation, candidate, sizeof candidate);
            lambda *= 0.2;
            if (before - warp.energy < RIGID_DECREASE * before) {
                start->stopped = SRNF_REGISTER_STATIONARY;
                break;
            }
        } else {
            status = place(&plain, start->rotation, &warp, &samples);
            lambda *= 10.0;
            if (lambda > 1e4) {
                start->stopped = SRNF_REGISTER_REFUSED;
                break;
            }
        }
    }
    start->energy = warp.energy;
    if (warp.energy <= RIGID_ZERO) {
        start->stopped = SRNF_REGISTER_TOLERANCE;
    }
    if (curvature) {
        normal_equations(problem, &warp, &samples, a, rhs);
        *curvature = domain_curvature(a);
    }
    warp_clear(&warp);
    samples_clear(&samples);
    return status;
}
