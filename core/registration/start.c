/*
 * start.c - rigid refinement of a start.
 *
 * Levenberg-Marquardt over R <- exp(omega) R and O, q2 at the turned nodes by the
 * surface itself or by its table. With y = O' q1 -
 * q2(R s): the columns are grad q2 . (e_j x p) and e_j x q2, six unknowns, or the first three where
 * values are not rotated.
 *
 * What is left of different surfaces is large, and Gauss-Newton steps alone gain a part of what the
 * one before gained. So the last steps correct the matrix, as in secant.c (BFGS: J. Nocedal, S.
 * Wright, "Numerical Optimization", 2006, equation 6.19), until one is refused.
 */
#include "registration.h"

#include "harmonics/simd.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define RIGID_STEPS 30
#define RIGID_DECREASE 1e-6
#define RIGID_ZERO 1e-28
#define RIGID_PAIRS ((size_t)5) /* steps that correct the matrix */

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
SRNF_HOT static void normal_equations(const struct problem *problem, const struct warp *warp,
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

/* The two places of a step: where it begins, and where it is tried. */
struct stands {
    struct warp warp[2];
    struct samples samples[2];
};

static void close_stands(struct stands *s)
{
    for (size_t k = 0; k < 2; k++) {
        warp_clear(&s->warp[k]);
        samples_clear(&s->samples[k]);
    }
}

static int open_stands(const struct target *target, struct stands *s)
{
    int status = SRNF_OK;

    *s = (struct stands){.warp = {{.n = 0}}};
    for (size_t k = 0; k < 2 && status == SRNF_OK; k++) {
        status = warp_create(&s->warp[k], target);
        status = status ? status : samples_create(&s->samples[k], target->n);
    }
    return status;
}

/* Steps, and by how much the right-hand side has fallen along them; the last ones. */
struct pairs {
    size_t count;
    double step[RIGID_PAIRS][6], change[RIGID_PAIRS][6];
};

static double product(const double x[6], const double y[6])
{
    double sum = 0.0;

    for (size_t i = 0; i < 6; i++) {
        sum += x[i] * y[i];
    }
    return sum;
}

/* Nothing where the energy is not convex along the step. */
static void add_pair(struct pairs *p, const double step[6], const double before[6],
                     const double after[6])
{
    double change[6];

    for (size_t i = 0; i < 6; i++) {
        change[i] = before[i] - after[i];
    }
    if (!(product(step, change) > 0.0)) {
        return;
    }
    if (p->count == RIGID_PAIRS) {
        p->count--;
        memmove(p->step[0], p->step[1], p->count * sizeof p->step[0]);
        memmove(p->change[0], p->change[1], p->count * sizeof p->change[0]);
    }
    memcpy(p->step[p->count], step, sizeof change);
    memcpy(p->change[p->count], change, sizeof change);
    p->count++;
}

/* The lower triangle of a, corrected. */
static void correct(const struct pairs *p, double a[36])
{
    for (size_t k = 0; k < p->count; k++) {
        const double *s = p->step[k], *y = p->change[k];
        double along[6], length, share = product(s, y);

        for (size_t i = 0; i < 6; i++) {
            along[i] = 0.0;
            for (size_t j = 0; j < 6; j++) {
                along[i] += a[i > j ? 6 * j + i : 6 * i + j] * s[j];
            }
        }
        length = product(s, along);
        for (size_t j = 0; j < 6 && length > 0.0; j++) {
            for (size_t i = j; i < 6; i++) {
                a[6 * j + i] += y[i] * y[j] / share - along[i] * along[j] / length;
            }
        }
    }
}

/* The step of one damping; false: there is none. a, rhs: of normal_equations. unknowns: 3, where
   values are not rotated. */
static bool damped_step(lapack_int unknowns, const double a[36], const struct pairs *pairs,
                        const double rhs[6], double lambda, double step[6])
{
    double damped[36];

    memcpy(damped, a, sizeof damped);
    correct(pairs, damped);
    memset(step, 0, 6 * sizeof *step);
    memcpy(step, rhs, (size_t)unknowns * sizeof *step);
    for (size_t j = 0; j < 6; j++) {
        damped[7 * j] *= 1.0 + lambda;
    }
    return LAPACKE_dposv_work(LAPACK_COL_MAJOR, 'L', unknowns, 1, damped, 6, step, 6) == 0;
}

/* Steps until nothing is gained; *at: which of the places holds the end. */
static int optimize(const struct problem *plain, struct stands *s, struct start_rotation *start,
                    size_t *at)
{
    double a[36], rhs[6] = {0.0}, step[6], last[6];
    double lambda = 1e-3;
    struct pairs pairs = {.count = 0};
    bool moved = true;
    int status = place(plain, start->rotation, &s->warp[0], &s->samples[0]);

    start->stopped = SRNF_REGISTER_MAX_ITERATIONS;
    for (int k = 0; k < RIGID_STEPS && s->warp[*at].energy > RIGID_ZERO && status == SRNF_OK; k++) {
        double before = s->warp[*at].energy, after;
        double candidate[9];

        if (moved) {
            memcpy(last, rhs, sizeof last);
            normal_equations(plain, &s->warp[*at], &s->samples[*at], a, rhs);
            if (k > 0) {
                add_pair(&pairs, step, last, rhs);
            }
        }
        if (!damped_step(plain->free_rotation ? 6 : 3, a, &pairs, rhs, lambda, step)) {
            start->stopped = SRNF_REGISTER_REFUSED;
            break;
        }
        memcpy(candidate, start->rotation, sizeof candidate);
        rotate_by(step, candidate);
        status = place(plain, candidate, &s->warp[1 - *at], &s->samples[1 - *at]);
        after = s->warp[1 - *at].energy;
        moved = after < before;
        if (moved) {
            memcpy(start->rotation, candidate, sizeof candidate);
            *at = 1 - *at;
            lambda *= 0.2;
            if (before - after < RIGID_DECREASE * before) {
                start->stopped = SRNF_REGISTER_STATIONARY;
                break;
            }
        } else {
            pairs.count = 0;
            lambda *= 10.0;
            if (lambda > 1e4) {
                start->stopped = SRNF_REGISTER_REFUSED;
                break;
            }
        }
    }
    return status;
}

int registration_rigid(const struct problem *problem, struct start_rotation *start,
                       double *curvature)
{
    struct problem plain = *problem;
    struct stands s;
    size_t at = 0;
    int status = open_stands(&problem->target, &s);

    plain.penalty = (struct penalty){0.0, 0.0};
    if (status == SRNF_OK) {
        status = optimize(&plain, &s, start, &at);
        start->energy = s.warp[at].energy;
        if (start->energy <= RIGID_ZERO) {
            start->stopped = SRNF_REGISTER_TOLERANCE;
        }
    }
    if (status == SRNF_OK && curvature) {
        double a[36], rhs[6];

        normal_equations(&plain, &s.warp[at], &s.samples[at], a, rhs);
        *curvature = domain_curvature(a);
    }
    close_stands(&s);
    return status;
}
