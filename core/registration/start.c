/*
 * start.c - global start over rotations of the domain and of the values.
 *
 * Screening: super-Fibonacci rotations (M. Alexa, "Super-Fibonacci spirals: fast, low-discrepancy
 * sampling of SO(3)", CVPR 2022) turn the degree-6 part of q2 on a small grid; the best value
 * rotation of each is in closed form. The best are thinned to be 20 degrees apart.
 *
 * Rigid refinement: Levenberg-Marquardt over R <- exp(omega) R and O, exact q2 at the turned nodes.
 * With y = O' q1 - q2(R s): the columns are grad q2 . (e_j x p) and e_j x q2, six unknowns.
 */
#include "registration.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define SCREEN_COUNT 600
#define SCREEN_DEGREE 6
#define THIN_DEGREES 20.0
#define RIGID_STEPS 30
#define RIGID_DECREASE 1e-6
#define RIGID_ZERO 1e-28

/* ---- Screening ------------------------------------------------------------------------------- */

static void super_fibonacci(size_t i, size_t n, double rotation[9])
{
    double s = (double)i + 0.5;
    double r = sqrt(s / (double)n);
    double big = sqrt(1.0 - s / (double)n);
    double alpha = 2.0 * SRNF_PI * s / sqrt(2.0);
    double beta = 2.0 * SRNF_PI * s / 1.533751168755204288118041;
    double q[4] = {r * sin(alpha), r * cos(alpha), big * sin(beta), big * cos(beta)};
    double w = q[3];

    for (size_t a = 0; a < 3; a++) {
        for (size_t b = 0; b < 3; b++) {
            size_t c = 3 - a - b;
            double sign = (a + 1) % 3 == b ? -1.0 : 1.0;

            rotation[3 * a + b] = a == b ? 1.0 - 2.0 * (q[(a + 1) % 3] * q[(a + 1) % 3] +
                                                        q[(a + 2) % 3] * q[(a + 2) % 3])
                                         : 2.0 * (q[a] * q[b] + sign * w * q[c]);
        }
    }
}

static double angle_between(const double a[9], const double b[9])
{
    double trace = 0.0;

    for (size_t i = 0; i < 9; i++) {
        trace += a[i] * b[i];
    }
    return acos(fmax(-1.0, fmin(1.0, 0.5 * (trace - 1.0))));
}

struct screen {
    size_t n;
    double *memory;
    double *nodes, *weight, *q1, *turned, *q2; /* [n][3], [n], [3][n], [n][3], [3][n] */
    double coefficients1[3 * (SCREEN_DEGREE + 1) * (SCREEN_DEGREE + 1)];
    double coefficients2[3 * (SCREEN_DEGREE + 1) * (SCREEN_DEGREE + 1)];
    struct sphere_points plan;
};

/* Degree-6 coefficients of a field given at weighted nodes. values: [n][3] */
static int low_coefficients(struct screen *s, size_t n, const double *nodes, const double *weight,
                            const double *values, double *coefficients)
{
    double *fields = srnf_alloc(3 * n, sizeof(double));
    double scratch[12 * (SCREEN_DEGREE + 1) * (SCREEN_DEGREE + 1)];

    if (!fields) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t c = 0; c < 3; c++) {
            fields[c * n + i] = weight[i] * values[3 * i + c];
        }
    }
    sphere_points_adjoint(&s->plan, 3, n, nodes, fields, NULL, coefficients, scratch);
    srnf_free(fields);
    return SRNF_OK;
}

static void screen_clear(struct screen *s)
{
    srnf_free(s->memory);
    sphere_points_clear(&s->plan);
}

static int screen_create(struct screen *s, const struct target *target, const struct moving *moving)
{
    struct srnf_sht *sht = NULL;
    const struct srnf_grid *grid;
    struct samples samples = {0};
    int status = srnf_sht_create(&sht, SCREEN_DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0);

    *s = (struct screen){0};
    if (status) {
        return status;
    }
    grid = srnf_sht_grid(sht);
    s->n = grid->n_theta * grid->n_phi;
    s->memory = srnf_alloc(13 * s->n, sizeof(double));
    status = sphere_points_create(&s->plan, SCREEN_DEGREE, moving_context(moving));
    if (status == SRNF_OK) {
        status = samples_create(&samples, target->n);
    }
    if (status || !s->memory) {
        status = SRNF_ENOMEM;
        goto out;
    }
    s->nodes = s->memory;
    s->weight = s->memory + 3 * s->n;
    s->q1 = s->memory + 4 * s->n;
    s->turned = s->memory + 7 * s->n;
    s->q2 = s->memory + 10 * s->n;
    for (size_t i = 0; i < s->n; i++) {
        size_t row = i / grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

        s->nodes[3 * i] = grid->sin_theta[row] * cos(phi);
        s->nodes[3 * i + 1] = grid->sin_theta[row] * sin(phi);
        s->nodes[3 * i + 2] = grid->cos_theta[row];
        s->weight[i] = grid->weight[row];
    }
    moving_evaluate(moving, target->points, &samples);
    status =
        low_coefficients(s, target->n, target->points, target->weight, target->q, s->coefficients1);
    if (status == SRNF_OK) {
        status = low_coefficients(s, target->n, target->points, target->weight, samples.q,
                                  s->coefficients2);
    }
    sphere_points_evaluate(&s->plan, 3, s->coefficients1, s->n, s->nodes, s->q1, NULL);
out:
    samples_clear(&samples);
    srnf_sht_destroy(sht);
    if (status) {
        screen_clear(s);
    }
    return status;
}

/* Largest overlap of q1 with the turned q2, over rotations of the values. */
static double screen_score(struct screen *s, const double rotation[9])
{
    double b[9] = {0};
    double best[9];

    for (size_t i = 0; i < s->n; i++) {
        const double *x = s->nodes + 3 * i;

        for (size_t k = 0; k < 3; k++) {
            s->turned[3 * i + k] =
                rotation[3 * k] * x[0] + rotation[3 * k + 1] * x[1] + rotation[3 * k + 2] * x[2];
        }
    }
    sphere_points_evaluate(&s->plan, 3, s->coefficients2, s->n, s->turned, s->q2, NULL);
    for (size_t i = 0; i < s->n; i++) {
        for (size_t r = 0; r < 3; r++) {
            for (size_t c = 0; c < 3; c++) {
                b[3 * r + c] += s->weight[i] * s->q1[r * s->n + i] * s->q2[c * s->n + i];
            }
        }
    }
    return registration_closest_rotation(b, best);
}

size_t registration_screen(const struct target *target, const struct moving *moving,
                           size_t capacity, struct start_rotation *starts, int *status)
{
    struct screen screen;
    struct start_rotation *all = srnf_alloc(SCREEN_COUNT, sizeof *all);
    size_t count = 0;

    *status = all ? screen_create(&screen, target, moving) : SRNF_ENOMEM;
    if (*status) {
        srnf_free(all);
        return 0;
    }
    for (size_t i = 0; i < SCREEN_COUNT; i++) {
        super_fibonacci(i, SCREEN_COUNT, all[i].rotation);
        all[i].energy = -screen_score(&screen, all[i].rotation);
    }
    while (count < capacity) {
        size_t best = SCREEN_COUNT;

        for (size_t i = 0; i < SCREEN_COUNT; i++) {
            if (isfinite(all[i].energy) &&
                (best == SCREEN_COUNT || all[i].energy < all[best].energy)) {
                best = i;
            }
        }
        if (best == SCREEN_COUNT) {
            break;
        }
        starts[count] = all[best];
        for (size_t i = 0; i < SCREEN_COUNT; i++) {
            if (angle_between(all[i].rotation, starts[count].rotation) <
                THIN_DEGREES * SRNF_PI / 180.0) {
                all[i].energy = INFINITY;
            }
        }
        count++;
    }
    screen_clear(&screen);
    srnf_free(all);
    return count;
}

/* ---- Rigid refinement ------------------------------------------------------------------------ */

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
            for (size_t k = 0; k < 3; k++) {
                rhs[j] += t->weight[i] / t->norm2 * columns[j][k] * y[k];
                for (size_t l = 0; l < 6; l++) {
                    a[6 * j + l] += t->weight[i] / t->norm2 * columns[j][k] * columns[l][k];
                }
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

int registration_rigid(const struct problem *problem, struct start_rotation *start,
                       double *curvature)
{
    struct warp warp;
    struct samples samples = {0};
    double ignored[9];
    double a[36];
    double rhs[6];
    double lambda = 1e-3;
    struct problem plain = *problem;
    int status = warp_create(&warp, &problem->target);

    plain.penalty = (struct penalty){0.0, 0.0};
    if (status == SRNF_OK) {
        status = samples_create(&samples, problem->target.n);
    }
    if (status) {
        warp_clear(&warp);
        return status;
    }
    status = warp_rotate(&warp, &problem->target, start->rotation);
    registration_objective(&plain, &warp, &samples, ignored);
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
        status = warp_rotate(&warp, &problem->target, candidate);
        registration_objective(&plain, &warp, &samples, ignored);
        if (warp.energy < before) {
            memcpy(start->rotation, candidate, sizeof candidate);
            lambda *= 0.2;
            if (before - warp.energy < RIGID_DECREASE * before) {
                start->stopped = SRNF_REGISTER_STATIONARY;
                break;
            }
        } else {
            status = warp_rotate(&warp, &problem->target, start->rotation);
            registration_objective(&plain, &warp, &samples, ignored);
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
