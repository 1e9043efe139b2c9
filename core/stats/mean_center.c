/*
 * mean_center.c - keeps the parameterization of a group mean centred.
 *
 * The mean is defined up to a common warp of all subjects: (q_i, gamma_i) may be replaced by (q_i,
 * gamma_i o c) for any diffeomorphism c, which moves the mean along its orbit and changes no
 * distance. Left alone it stays wherever the first template put it, because a warp that follows its
 * subject alone is held by the mean. What does depend on c is the penalties: centring takes the c
 * that makes them least. (Making the mean of the logarithms of the warps vanish is the same to
 * first order; but it is not the minimum, and an iteration that alternates between the two does not
 * come to rest.)
 *
 * While the mean is sought, no subject is moved for that. What is kept is d = c^-1, and penalties
 * are measured from it: R(gamma o d^-1) is an integral over the nodes of gamma and d, since
 * ||e - O'(e, gamma o d^-1)|| = ||(e, d) - O'(e, gamma)||, and rho(J / K) K takes the place of
 * rho(J), K the Jacobian of d. Only what is handed over in the end is evaluated at gamma o d^-1.
 *
 * With (e, gamma) = sqrt(J) gamma and c <- c o exp(v), that is d <- exp(v)^-1 o d, the derivative
 * of the mean penalty is
 *
 *   integral over the nodes t, at s = d(t):
 *     2 b sqrt(K) (<X, v> + div v <X, s> / 2) + a K S div v,
 *   X = (1/n) sum_i O'_i sqrt(J_i) gamma_i,  S = (1/n) sum_i u_i rho'(u_i) - rho(u_i), u_i = J_i /
 *   K
 *
 * (for the displacement because D_v x = grad_v x + x div v / 2 is skew; for rho(u) = (1 + u)(log
 * u)^4 by substitution). About the identity the second derivative is diagonal in the harmonics:
 * 2 b (1 + l (l + 1) / 4) for gradients and 2 b for curls, and l (l + 1) times the mean curvature
 * of rho. v is the Newton step with that, halved until the penalties fall. Where there are no
 * penalties, the displacement alone decides, with any weight.
 *
 * Cost: one evaluation and one adjoint of a field, and one pass over all warps.
 */
#include "mean.h"

#include <math.h>
#include <string.h>

/* Bounds of the Jacobian of one step on the grid: beyond them it could fold between the nodes. */
#define JACOBIAN_MIN 0.5
#define JACOBIAN_MAX 2.0
#define HALVINGS_MAX 6
#define ROUNDING 1e-9 /* radians: no step */

struct center {
    struct mean_run *run;
    size_t count;                  /* (D+1)^2 */
    double jacobian, displacement; /* a and b */
    double stiffness;              /* b, or where that is 0 what keeps the curvature positive */
    bool penalized;                /* not both 0 */
    double *moments;               /* [blocks][3][count]: gradients, curls, divergence */
    double *curvature;             /* [blocks] of the Jacobian penalty */
    double *potentials;            /* [2][count] of v */
    struct mean_pull pull;         /* X, S, and the curvature */
    double *old_center, *old_area; /* before the step */
};

/* ---- The step -------------------------------------------------------------------------------- */

/* Subjects whose warps are looked at together. */
#define GATHERED ((size_t)32)

struct gathering {
    struct center *center;
    size_t first, count;
    struct mean_points points[GATHERED];
};

static int open_one(void *argument, size_t index, const struct srnf_context *context,
                    struct srnf_error *error)
{
    struct gathering *g = argument;

    (void)context;
    (void)error;
    return mean_points_open(g->center->run, g->first + index, true, &g->points[index]);
}

static int add_block(void *argument, size_t block, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct gathering *g = argument;
    const struct mean_run *run = g->center->run;
    size_t first = block * MEAN_BLOCK;
    size_t last = first + MEAN_BLOCK < run->padded ? first + MEAN_BLOCK : run->padded;

    (void)context;
    (void)error;
    for (size_t i = 0; i < g->count; i++) {
        mean_gather(run->subjects[g->first + i].at.displacement, &g->points[i], run->area,
                    1.0 / (double)run->n, first, last, &g->center->pull);
    }
    return SRNF_OK;
}

/* X, S and the curvature at all nodes, each summed in the order of the subjects. */
static int gather(struct center *center, struct srnf_error *error)
{
    const struct stats_progress quiet = {0};
    const struct mean_run *run = center->run;
    struct gathering g = {.center = center};
    int status = SRNF_OK;

    for (; g.first < run->n && status == SRNF_OK; g.first += g.count) {
        g.count = run->n - g.first < GATHERED ? run->n - g.first : GATHERED;
        memset(g.points, 0, sizeof g.points);
        status = stats_run(run->context, g.count, open_one, &g, quiet, error);
        status = status ? status
                        : stats_run(run->context, mean_blocks(run), add_block, &g, quiet, error);
        for (size_t i = 0; i < g.count; i++) {
            mean_points_drop(&g.points[i]);
        }
    }
    return status;
}

/* Loads of the nodes of one block: value on div v; gradient and turned for v. */
static void load_block(struct center *center, size_t block, size_t first, size_t n, double *value,
                       double *gradient, double *turned)
{
    const struct mean_run *run = center->run;

    for (size_t k = 0; k < n; k++) {
        const double *d = run->center + 3 * (first + k);
        double weight = run->weight[first + k];
        double area = run->area[first + k];
        double b = 2.0 * center->displacement * weight * sqrt(area);
        double a = center->jacobian * weight * area;
        double *const *moment = center->pull.moment;
        const double x[3] = {moment[0][first + k], moment[1][first + k], moment[2][first + k]};

        value[k] = 0.5 * b * vector_dot(x, d) + a * center->pull.pressure[first + k];
        center->curvature[block] += a * center->pull.stiffness[first + k] / (4.0 * SRNF_PI);
        vector_cross(x, d, turned + 3 * k); /* <X, d x g> = <X x d, g> */
        for (size_t c = 0; c < 3; c++) {
            gradient[3 * k + c] = b * x[c];
            turned[3 * k + c] *= b;
        }
    }
}

/* The block's share of the derivative. Blocks are the same however many threads there are. */
static int differentiate_block(void *argument, size_t block, const struct srnf_context *context,
                               struct srnf_error *error)
{
    struct center *center = argument;
    const struct mean_run *run = center->run;
    size_t first = block * MEAN_BLOCK;
    size_t n = run->points - first < MEAN_BLOCK ? run->points - first : MEAN_BLOCK;
    double *values = srnf_alloc(12 * n + 3 * center->count * SRNF_LANES, sizeof(double));
    struct sphere_points plan = {0};
    int status = values ? sphere_points_create(&plan, run->degree, context) : SRNF_ENOMEM;

    (void)error;
    if (status == SRNF_OK) { /* in the order of the moments; the others' values stay 0 */
        load_block(center, block, first, n, values + 2 * n, values + 3 * n, values + 6 * n);
        sphere_points_adjoint(&plan, 3, n, run->center + 3 * first, values, values + 3 * n,
                              center->moments + 3 * block * center->count, values + 12 * n);
        sphere_points_clear(&plan);
    }
    srnf_free(values);
    return status;
}

/* Potentials of v; returns the root of the mean square of v, in radians. */
static double find_step(struct center *center)
{
    const struct mean_run *run = center->run;
    size_t count = center->count;
    double b = 2.0 * center->stiffness;
    double square = 0.0;

    for (size_t block = 1; block < mean_blocks(run); block++) {
        for (size_t i = 0; i < 3 * count; i++) {
            center->moments[i] += center->moments[3 * block * count + i];
        }
        center->curvature[0] += center->curvature[block];
    }
    for (size_t l = 1; l <= run->degree; l++) {
        double eigen = (double)(l * (l + 1));

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            double *phi = center->potentials + i;
            double *psi = center->potentials + count + i;

            *phi = -(center->moments[i] / eigen - center->moments[2 * count + i]) /
                   (b * (1.0 + 0.25 * eigen) + center->curvature[0] * eigen);
            *psi = -center->moments[count + i] / (eigen * b);
            square += eigen * (*phi * *phi + *psi * *psi);
        }
    }
    return sqrt(square / (4.0 * SRNF_PI));
}

/* ---- The centre ------------------------------------------------------------------------------ */

struct placing {
    struct mean_run *run;
    const struct srnf_warp *warp; /* that d is moved along */
};

static int place_block(void *argument, size_t block, const struct srnf_context *context,
                       struct srnf_error *error)
{
    const struct placing *placing = argument;
    const struct mean_run *run = placing->run;
    size_t first = block * MEAN_BLOCK;
    size_t n = run->points - first < MEAN_BLOCK ? run->points - first : MEAN_BLOCK;
    int status = warp_follow(placing->warp, context, n, run->center + 3 * first, run->area + first);

    (void)error;
    for (size_t k = first; k < first + n; k++) {
        for (size_t c = 0; c < 3; c++) {
            run->reference[3 * k + c] = sqrt(run->area[k]) * run->center[3 * k + c];
        }
    }
    return status;
}

static int move_center(struct mean_run *run, const struct srnf_warp *warp, struct srnf_error *error)
{
    struct placing placing = {run, warp};

    return stats_run(run->context, mean_blocks(run), place_block, &placing,
                     (struct stats_progress){0}, error);
}

int mean_place_center(struct mean_run *run, struct srnf_error *error)
{
    memcpy(run->center, run->nodes, 3 * run->points * sizeof(double));
    for (size_t k = 0; k < run->padded; k++) {
        run->area[k] = 1.0;
    }
    return move_center(run, &run->centring, error);
}

static int penalize_one(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_penalize(argument, i);
}

static int penalize_all(struct mean_run *run, struct srnf_error *error)
{
    int status = mean_aim(run);

    return status ? status
                  : stats_run(run->context, run->n, penalize_one, run, (struct stats_progress){0},
                              error);
}

/* Whether no area has changed too much under the step. */
static bool is_gentle(const struct center *center)
{
    const struct mean_run *run = center->run;
    bool gentle = true;

    for (size_t k = 0; k < run->points; k++) {
        double ratio = run->area[k] / center->old_area[k];

        gentle = gentle && ratio >= JACOBIAN_MIN && ratio <= JACOBIAN_MAX;
    }
    return gentle;
}

static void take_back(const struct center *center)
{
    struct mean_run *run = center->run;

    memcpy(run->center, center->old_center, 3 * run->points * sizeof(double));
    memcpy(run->area, center->old_area, run->points * sizeof(double));
}

/* Along the step, ever shorter, until the penalties fall; else all stays as it was. */
static int take(struct center *center, struct srnf_error *error)
{
    struct mean_run *run = center->run;
    struct srnf_warp_link link = {SRNF_WARP_EXP_INVERSE, run->degree, center->potentials};
    const struct srnf_warp step = {1, 1, &link};
    const struct srnf_warp none = {0};
    double before = mean_objective(run, run->variance);
    int status;

    memcpy(center->old_center, run->center, 3 * run->points * sizeof(double));
    memcpy(center->old_area, run->area, run->points * sizeof(double));
    for (size_t k = 0; k < HALVINGS_MAX; k++) {
        status = move_center(run, &step, error);
        status = status ? status : penalize_all(run, error);
        if (status && status != SRNF_ENUMERIC) { /* that step cannot be inverted: a shorter one */
            return status;
        }
        if (status == SRNF_OK && is_gentle(center) &&
            (!center->penalized || mean_objective(run, run->variance) < before)) {
            return warp_append(&run->centring, SRNF_WARP_EXP_INVERSE, run->degree,
                               center->potentials);
        }
        take_back(center);
        linear_scale(2 * center->count, 0.5, center->potentials);
    }
    status = move_center(run, &none, error);
    return status ? status : penalize_all(run, error);
}

static int create(struct center *center, struct mean_run *run)
{
    const struct srnf_register_options *o = &run->registration;
    size_t blocks = mean_blocks(run);
    size_t count = srnf_coefficient_count(run->degree);

    *center = (struct center){.run = run, .count = count};
    if (!o->exact) {
        center->jacobian = o->penalty_jacobian;
        center->displacement = o->penalty_displacement;
    }
    center->penalized = center->jacobian > 0.0 || center->displacement > 0.0;
    if (!center->penalized) {
        center->displacement = 1.0;
    }
    center->stiffness = center->displacement > 0.0 ? center->displacement : center->jacobian;
    center->moments = srnf_alloc(
        (3 * count + 1) * blocks + 2 * count + 4 * run->points + 5 * run->padded, sizeof(double));
    if (!center->moments) {
        return SRNF_ENOMEM;
    }
    center->curvature = center->moments + 3 * count * blocks;
    center->potentials = center->curvature + blocks;
    center->old_center = center->potentials + 2 * count;
    center->old_area = center->old_center + 3 * run->points;
    center->pull.pressure = center->old_area + run->points;
    center->pull.stiffness = center->pull.pressure + run->padded;
    for (size_t c = 0; c < 3; c++) {
        center->pull.moment[c] = center->pull.stiffness + (1 + c) * run->padded;
    }
    return SRNF_OK;
}

int mean_center(struct mean_run *run, struct srnf_error *error)
{
    struct center center;
    int status = create(&center, run);

    status = status ? status : gather(&center, error);
    if (status == SRNF_OK) {
        status = stats_run(run->context, mean_blocks(run), differentiate_block, &center,
                           (struct stats_progress){0}, error);
    }
    if (status == SRNF_OK) {
        double step = find_step(&center);

        if (!isfinite(step)) {
            status = srnf_fail(error, SRNF_ENUMERIC, -1, "the step of the centre is not finite");
        } else if (step > ROUNDING) {
            status = take(&center, error);
        }
    }
    srnf_free(center.moments);
    return status;
}
