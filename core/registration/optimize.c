/*
 * optimize.c - Levenberg-Marquardt over left steps gamma <- exp(w) o gamma.
 *
 * With y = O' q1 - sqrt(J) q (q at the warped points) and y' = O'' e - sqrt(J) gamma, minus half
 * the derivative of the objective along X is
 *
 *   sum w sqrt(J) [<y, q_1> X_1 + <y, q_2> X_2 + <y, q> div X / 2] / ||q1||^2
 *   + b sum w sqrt(J) [<y', X> + <y', gamma> div X / 2]  -  a sum w J rho'(J) div X / 2,  rho(J) =
 *   (1 + J)(log J)^4,
 *
 * one adjoint evaluation of harmonics at the points. The matrix is that of the data term and the
 * displacement penalty (matrix.c), plus a multiple of l (l + 1) for the Jacobian
 * penalty, plus damping. A step is accepted if the objective falls and the Jacobian of the step is
 * at least one half on the grid: between the nodes it then stays positive. Steps shorten until one
 * is accepted; where none is, however short, the objective is at its minimum to rounding.
 */
#include "registration.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define LAMBDA_START 1e-2
#define LAMBDA_MIN 1e-9
#define LAMBDA_MAX 1e6
#define GAIN_GOOD 0.7
#define GAIN_FAIR 0.3
#define STEP_JACOBIAN_MIN 0.5
#define ENERGY_ZERO 1e-13 /* of ||q1||^2: registered to rounding */

int level_create(struct level *level, const struct problem *problem, size_t degree)
{
    size_t k = registration_unknowns(degree);
    double norm2 = problem->target.norm2;
    int status = fields_create(&level->fields, degree, moving_context(problem->moving));

    level->matrix = NULL;
    if (status) {
        return status;
    }
    level->matrix = srnf_alloc(k * k, sizeof(double));
    status = level->matrix
                 ? registration_matrix(problem->moving, degree,
                                       problem->penalty.displacement * norm2, level->matrix)
                 : SRNF_ENOMEM;
    if (status) {
        level_clear(level);
        return status;
    }
    linear_scale(k * k, 1.0 / norm2, level->matrix);
    return SRNF_OK;
}

void registration_restrict(size_t from_degree, const double *from, size_t degree, double *matrix)
{
    size_t k = registration_unknowns(degree);
    size_t each = srnf_coefficient_count(degree) - 1;
    size_t of = registration_unknowns(from_degree);
    size_t skip = srnf_coefficient_count(from_degree) - 1 - each;

    /* Gradients, curls and rotations each keep their order. */
    for (size_t j = 0; j < k; j++) {
        size_t column = j + (j >= each ? skip : 0) + (j >= 2 * each ? skip : 0);

        for (size_t i = j; i < k; i++) {
            size_t row = i + (i >= each ? skip : 0) + (i >= 2 * each ? skip : 0);

            matrix[j * k + i] = from[column * of + row];
        }
    }
}

void level_clear(struct level *level)
{
    fields_clear(&level->fields);
    srnf_free(level->matrix);
    level->matrix = NULL;
}

struct optimizer {
    const struct problem *problem;
    const struct level *level;
    size_t unknowns, fields; /* all, and those of one kind of field */
    double *memory;
    double *factor, *rhs, *step, *damping, *potentials;
    double *functional_values, *functional_gradients, *moments, *scratch;
    double *new_points, *new_jacobian, *fields_scratch;
    double curvature; /* of the Jacobian penalty */
};

static int create(struct optimizer *o, const struct problem *problem, const struct level *level)
{
    size_t n = problem->target.n;
    size_t count = level->fields.count;
    size_t k = registration_unknowns(level->fields.degree);
    double *next;

    *o = (struct optimizer){.problem = problem, .level = level, .fields = count - 1};
    o->unknowns = problem->free_rotation ? k : k - 3;
    o->memory = srnf_alloc(k * k + 3 * k + 17 * count + (16 + FIELDS_SCRATCH) * n, sizeof(double));
    if (!o->memory) {
        return SRNF_ENOMEM;
    }
    next = o->memory;
    o->factor = next;
    o->rhs = next += k * k;
    o->step = next += k;
    o->damping = next += k;
    o->potentials = next += k;
    o->moments = next += 2 * count;
    o->scratch = next += 3 * count;
    o->functional_values = next += 12 * count;
    o->functional_gradients = next += 3 * n;
    o->new_points = next += 9 * n;
    o->new_jacobian = next += 3 * n;
    o->fields_scratch = next + n;
    return SRNF_OK;
}

/* Load of one node: v (tangent) and alpha, from a residual y, the value q and its derivative at the
   point. */
static void add_load(const struct samples *s, size_t i, const double y[3], double weight,
                     const double *q, const double *q_1, const double *q_2, double v[3],
                     double *alpha)
{
    double y_1 = weight * (y[0] * q_1[0] + y[1] * q_1[1] + y[2] * q_1[2]);
    double y_2 = weight * (y[0] * q_2[0] + y[1] * q_2[1] + y[2] * q_2[2]);

    for (size_t k = 0; k < 3; k++) {
        v[k] += y_1 * s->t1[3 * i + k] + y_2 * s->t2[3 * i + k];
    }
    *alpha += 0.5 * weight * (y[0] * q[0] + y[1] * q[1] + y[2] * q[2]);
}

/* y = R' a - root b */
static void residual(const double r[9], const double *a, double root, const double *b, double y[3])
{
    for (size_t k = 0; k < 3; k++) {
        y[k] = r[k] * a[0] + r[3 + k] * a[1] + r[6 + k] * a[2] - root * b[k];
    }
}

/* Loads of all nodes; sums of the value rotation; curvature of the Jacobian penalty. */
static void load_nodes(struct optimizer *o, const struct warp *warp, const struct samples *s,
                       const double displacement_rotation[9], double torque[3])
{
    const struct target *t = &o->problem->target;
    const struct penalty *penalty = &o->problem->penalty;
    size_t n = t->n;

    memset(torque, 0, 3 * sizeof *torque);
    memset(o->functional_values, 0, 12 * n * sizeof(double));
    o->curvature = 0.0;
    for (size_t i = 0; i < n; i++) {
        double jacobian = warp->jacobian[i];
        double root = sqrt(jacobian);
        double weight = t->weight[i] * root / t->norm2;
        const double *p = warp->points + 3 * i;
        const double *q = s->q + 3 * i;
        double area = target_area(t, i);
        double ratio = jacobian / area;
        double l = log(ratio);
        double v[3] = {0.0, 0.0, 0.0};
        double alpha = 0.0;
        double y[3];

        residual(warp->rotation, t->q + 3 * i, root, q, y);
        add_load(s, i, y, weight, q, s->q_1 + 3 * i, s->q_2 + 3 * i, v, &alpha);
        torque[0] += weight * (q[1] * y[2] - q[2] * y[1]);
        torque[1] += weight * (q[2] * y[0] - q[0] * y[2]);
        torque[2] += weight * (q[0] * y[1] - q[1] * y[0]);
        if (penalty->displacement > 0.0) {
            residual(displacement_rotation, target_reference(t) + 3 * i, root, p, y);
            add_load(s, i, y, penalty->displacement * t->weight[i] * root, p, s->t1 + 3 * i,
                     s->t2 + 3 * i, v, &alpha);
        }
        /* J rho' and J^2 rho'' + J rho' of rho = (1 + J) (log J)^4. */
        alpha -= 0.5 * penalty->jacobian * t->weight[i] * area *
                 (ratio * l * l * l * l + 4.0 * (1.0 + ratio) * l * l * l);
        o->curvature +=
            0.5 * penalty->jacobian * t->weight[i] * area / (4.0 * SRNF_PI) *
            (ratio * l * l * l * l + 8.0 * fabs(ratio * l * l * l) + 12.0 * (1.0 + ratio) * l * l);
        o->functional_values[2 * n + i] = alpha;
        memcpy(o->functional_gradients + 3 * i, v, sizeof v);
        o->functional_gradients[3 * n + 3 * i] = v[1] * p[2] - v[2] * p[1];
        o->functional_gradients[3 * n + 3 * i + 1] = v[2] * p[0] - v[0] * p[2];
        o->functional_gradients[3 * n + 3 * i + 2] = v[0] * p[1] - v[1] * p[0];
    }
}

static void assemble_rhs(struct optimizer *o, const struct warp *warp, const double torque[3])
{
    const struct fields *f = &o->level->fields;
    size_t degree = f->degree;
    size_t count = f->count;

    sphere_points_adjoint(&f->plan.points, 3, o->problem->target.n, warp->points,
                          o->functional_values, o->functional_gradients, o->moments, o->scratch);
    for (size_t l = 1; l <= degree; l++) {
        double eigen = (double)(l * (l + 1));

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            o->rhs[i - 1] = f->scale[i] * (o->moments[i] - eigen * o->moments[2 * count + i]);
            o->rhs[o->fields + i - 1] = f->scale[i] * o->moments[count + i];
        }
    }
    memcpy(o->rhs + 2 * o->fields, torque, 3 * sizeof *torque);
}

void registration_damping(const struct level *level, size_t unknowns, double *damping)
{
    size_t k = registration_unknowns(level->fields.degree);
    size_t fields = level->fields.count - 1;
    double trace = 0.0;
    double mean = 0.0;

    for (size_t l = 1; l <= level->fields.degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            damping[i - 1] = damping[fields + i - 1] = (double)(l * (l + 1));
        }
    }
    damping[k - 3] = damping[k - 2] = damping[k - 1] = 2.0;
    for (size_t i = 0; i < unknowns; i++) {
        trace += level->matrix[i * k + i] / (double)unknowns;
        mean += damping[i] / (double)unknowns;
    }
    for (size_t i = 0; i < k; i++) {
        damping[i] *= trace / mean;
    }
}

bool registration_factor(const struct level *level, size_t unknowns, double curvature,
                         double lambda, const double *damping, double *factor)
{
    size_t k = registration_unknowns(level->fields.degree);
    lapack_int n = (lapack_int)unknowns;

    for (size_t j = 0; j < unknowns; j++) {
        for (size_t i = j; i < unknowns; i++) {
            factor[j * unknowns + i] = level->matrix[j * k + i];
        }
        factor[j * unknowns + j] += lambda * damping[j];
    }
    for (size_t l = 1; l <= level->fields.degree; l++) {
        for (size_t i = l * l - 1; i + 1 < (l + 1) * (l + 1); i++) {
            factor[i * unknowns + i] += curvature * (double)(l * (l + 1));
        }
    }
    return LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', n, factor, n) == 0;
}

/* Step for a damping lambda and the gain that the model expects of it; false when the matrix has no
   factor. */
static bool solve(struct optimizer *o, double lambda, double *expected)
{
    lapack_int n = (lapack_int)o->unknowns;

    memcpy(o->step, o->rhs, o->unknowns * sizeof(double));
    if (!registration_factor(o->level, o->unknowns, o->curvature, lambda, o->damping, o->factor) ||
        LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, o->factor, n, o->step, n) != 0) {
        return false;
    }
    /* 2 <rhs, c> - <c, (H + lambda D) c> + lambda <c, D c> = <rhs, c> + lambda <c, D c> */
    *expected = linear_dot(o->unknowns, o->rhs, o->step);
    for (size_t i = 0; i < o->unknowns; i++) {
        *expected += lambda * o->damping[i] * o->step[i] * o->step[i];
    }
    return true;
}

void registration_potentials(const struct fields *fields, const double *step, double *potentials)
{
    size_t each = fields->count - 1;

    potentials[0] = potentials[fields->count] = 0.0;
    for (size_t i = 1; i < fields->count; i++) {
        potentials[i] = fields->scale[i] * step[i - 1];
        potentials[fields->count + i] = fields->scale[i] * step[each + i - 1];
    }
}

static void swap_points(struct optimizer *o, struct warp *warp)
{
    size_t n = warp->n;

    memcpy(o->fields_scratch, warp->points, 3 * n * sizeof(double));
    memcpy(o->fields_scratch + 3 * n, warp->jacobian, n * sizeof(double));
    memcpy(warp->points, o->new_points, 3 * n * sizeof(double));
    memcpy(warp->jacobian, o->new_jacobian, n * sizeof(double));
    memcpy(o->new_points, o->fields_scratch, 3 * n * sizeof(double));
    memcpy(o->new_jacobian, o->fields_scratch + 3 * n, n * sizeof(double));
}

/* One accepted step, or none: *gain is what it lowered the objective by. */
static int advance(struct optimizer *o, struct warp *warp, struct samples *samples,
                   double rotation[9], double *lambda, double *gain)
{
    double torque[3];
    double before = warp->objective;
    double kept[9];

    *gain = 0.0;
    load_nodes(o, warp, samples, rotation, torque);
    assemble_rhs(o, warp, torque);
    memcpy(kept, warp->rotation, sizeof warp->rotation);
    while (*lambda <= LAMBDA_MAX) {
        double expected = 0.0;
        double least = 0.0;
        bool solved = solve(o, *lambda, &expected);

        if (solved) {
            registration_potentials(&o->level->fields, o->step, o->potentials);
            least = fields_apply(&o->level->fields, o->potentials, warp->n, warp->points,
                                 warp->jacobian, o->new_points, o->new_jacobian, o->fields_scratch);
        }
        if (least >= STEP_JACOBIAN_MIN) {
            swap_points(o, warp);
            registration_objective(o->problem, warp, samples, rotation);
            if (warp->objective < before) {
                *gain = before - warp->objective;
                *lambda /= *gain > GAIN_GOOD * expected   ? 8.0
                           : *gain > GAIN_FAIR * expected ? 3.0
                                                          : 1.0;
                *lambda = fmax(*lambda, LAMBDA_MIN);
                return warp_append(&warp->chain, SRNF_WARP_EXP, o->level->fields.degree,
                                   o->potentials);
            }
            swap_points(o, warp);
        }
        *lambda *= 6.0;
    }
    /* Nothing was found: the samples must again belong to the warp. */
    memcpy(warp->rotation, kept, sizeof warp->rotation);
    registration_objective(o->problem, warp, samples, rotation);
    return SRNF_OK;
}

int registration_gradient(const struct problem *problem, const struct level *level,
                          const struct warp *warp, const struct samples *samples,
                          const double displacement_rotation[9], double *gradient,
                          double *curvature)
{
    struct optimizer o;
    double torque[3];
    int status = create(&o, problem, level);

    if (status == SRNF_OK) {
        load_nodes(&o, warp, samples, displacement_rotation, torque);
        assemble_rhs(&o, warp, torque);
        memcpy(gradient, o.rhs, registration_unknowns(level->fields.degree) * sizeof(double));
        if (curvature) {
            *curvature = o.curvature;
        }
        srnf_free(o.memory);
    }
    return status;
}

int registration_optimize(const struct problem *problem, const struct level *level,
                          const struct schedule *schedule, const struct srnf_context *context,
                          struct warp *warp, struct samples *samples, size_t *iterations)
{
    struct optimizer o;
    double rotation[9];
    double lambda = LAMBDA_START;
    size_t small = 0;
    int status = create(&o, problem, level);

    if (status) {
        return status;
    }
    registration_damping(level, o.unknowns, o.damping);
    registration_objective(problem, warp, samples, rotation);
    warp->stopped = SRNF_REGISTER_MAX_ITERATIONS;
    for (size_t step = 0; step < schedule->max_steps && small < 2 && status == SRNF_OK; step++) {
        double gain;
        double before = warp->objective;

        if (warp->energy < ENERGY_ZERO) {
            break;
        }
        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
            break;
        }
        status = advance(&o, warp, samples, rotation, &lambda, &gain);
        (*iterations)++;
        if (!(gain > 0.0)) {
            warp->stopped = SRNF_REGISTER_REFUSED;
            break;
        }
        small = gain < schedule->decrease * before ? small + 1 : 0;
    }
    if (warp->energy < ENERGY_ZERO) {
        warp->stopped = SRNF_REGISTER_TOLERANCE;
    } else if (small >= 2) {
        warp->stopped = SRNF_REGISTER_STATIONARY;
    }
    srnf_free(o.memory);
    return status;
}
