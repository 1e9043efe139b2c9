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

/* The three columns of the domain's rotation at one node. */
static void domain_columns(const struct samples *s, size_t i, const double *p, double columns[3][3])
{
    const double *t1 = s->t1 + 3 * i, *t2 = s->t2 + 3 * i;
    const double *q_1 = s->q_1 + 3 * i, *q_2 = s->q_2 + 3 * i;

    for (size_t j = 0; j < 3; j++) {
        size_t u = (j + 1) % 3;
        size_t v = (j + 2) % 3;
        /* e_j x p has -p_v at u and p_u at v. */
        double w_1 = t1[v] * p[u] - t1[u] * p[v];
        double w_2 = t2[v] * p[u] - t2[u] * p[v];

        for (size_t k = 0; k < 3; k++) {
            columns[j][k] = w_1 * q_1[k] + w_2 * q_2[k];
        }
    }
}

static double dot(double sum, const double a[3], const double b[3])
{
    return sum + a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* sum + <a, e_l x q> */
static double cross_dot(double sum, size_t l, const double a[3], const double q[3])
{
    return l == 0   ? sum - a[1] * q[2] + a[2] * q[1]
           : l == 1 ? sum + a[0] * q[2] - a[2] * q[0]
                    : sum - a[0] * q[1] + a[1] * q[0];
}

/* Sums of the normal equations: arrays of constant size, which become registers. */
struct normal_sums {
    double domain[3][3], mixed[3][3]; /* of the domain's rotation, and of both */
    double space[6];                  /* of the rotation in space, column by column */
    double rhs[6];
};

static void add_node(struct normal_sums *sums, double weight, const double columns[3][3],
                     const double q[3], const double y[3])
{
    const double moved[3] = {weight * q[0], weight * q[1], weight * q[2]};

    for (size_t j = 0; j < 3; j++) {
        const double scaled[3] = {weight * columns[j][0], weight * columns[j][1],
                                  weight * columns[j][2]};

        sums->rhs[j] = dot(sums->rhs[j], scaled, y);
        sums->rhs[3 + j] = cross_dot(sums->rhs[3 + j], j, y, moved);
        for (size_t l = j; l < 3; l++) {
            sums->domain[j][l] = dot(sums->domain[j][l], scaled, columns[l]);
        }
        for (size_t l = 0; l < 3; l++) {
            sums->mixed[j][l] = cross_dot(sums->mixed[j][l], l, scaled, q);
        }
    }
    sums->space[0] = sums->space[0] + moved[2] * q[2] + moved[1] * q[1];
    sums->space[1] -= moved[1] * q[0];
    sums->space[2] -= moved[2] * q[0];
    sums->space[3] = sums->space[3] + moved[2] * q[2] + moved[0] * q[0];
    sums->space[4] -= moved[2] * q[1];
    sums->space[5] = sums->space[5] + moved[1] * q[1] + moved[0] * q[0];
}

/* Normal equations of the six unknowns; a: column-major 6 x 6, its lower triangle. */
static void normal_equations(const struct problem *problem, const struct warp *warp,
                             const struct samples *s, double a[36], double rhs[6])
{
    const struct target *t = &problem->target;
    struct normal_sums sums = {0};

    for (size_t i = 0; i < t->n; i++) {
        const double q[3] = {s->q[3 * i], s->q[3 * i + 1], s->q[3 * i + 2]};
        double columns[3][3], y[3];

        domain_columns(s, i, warp->points + 3 * i, columns);
        for (size_t k = 0; k < 3; k++) {
            y[k] = -q[k];
            for (size_t j = 0; j < 3; j++) {
                y[k] += warp->rotation[3 * j + k] * t->q[3 * i + j];
            }
        }
        add_node(&sums, t->weight[i] / t->norm2, columns, q, y);
    }
    memset(a, 0, 36 * sizeof *a);
    memcpy(rhs, sums.rhs, sizeof sums.rhs);
    for (size_t j = 0, next = 0; j < 3; j++) {
        memcpy(a + 7 * j, sums.domain[j] + j, (3 - j) * sizeof(double));
        memcpy(a + 6 * j + 3, sums.mixed[j], sizeof sums.mixed[j]);
        memcpy(a + 7 * (3 + j), sums.space + next, (3 - j) * sizeof(double));
        next += 3 - j;
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
    int status = warp_rotate(warp, &problem->target, rotation);

    registration_objective(problem, warp, samples, NULL);
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
