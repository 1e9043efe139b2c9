/*
 * polish.c - alternating right and left steps (theory: exact.c).
 *
 * Each stage takes right steps, then left steps of one degree while a step at least halves what is
 * left or so; the next stage has finer fields. Why it ends is told of the last stage, by the side
 * that has more left to gain. Steps are accepted as everywhere: the energy must
 * fall, and the Jacobian of the step itself must be at least one half on the nodes.
 */
#include "exact.h"

#include <math.h>
#include <string.h>

#define LAMBDA_START 1e-3
#define LAMBDA_MIN 1e-10
#define LAMBDA_MAX 1e2
#define STEP_JACOBIAN_MIN 0.5
#define ENERGY_ZERO 1e-13 /* of ||q1||^2: registered to rounding */
#define STEPS_OF_STAGE 8
#define PROGRESS 0.3 /* a stage ends after a step that gains less than this part */
#define INNER_TOLERANCE 0.02
#define INNER_CAP 80

static const size_t stages[] = {12, 16, 24, 32, 32, 32};
#define STAGES (sizeof stages / sizeof stages[0])

struct polish {
    const struct problem *problem;
    const struct srnf_sht *sht;
    const struct moving *template_moving;
    struct warp *warp;
    struct samples samples; /* of the warp */
    struct fields fields;
    struct tangent tangent;
    double *memory;
    double *rhs, *x, *solver; /* [unknowns], [unknowns], [4 unknowns] */
    double *moments, *adjoint, *values, *gradients;
    double *points, *jacobian, *kept; /* trial and what it replaces: [n][3], [n], [4 n] */
    double *scratch;                  /* of the fields */
};

static void clear(struct polish *p)
{
    fields_clear(&p->fields);
    tangent_clear(&p->tangent);
    srnf_free(p->memory);
    p->memory = NULL;
}

static int prepare_degree(struct polish *p, size_t degree, size_t n_theta, size_t n_phi)
{
    size_t n = p->problem->target.n;
    size_t unknowns = 2 * srnf_coefficient_count(degree) + 3;
    size_t count = srnf_coefficient_count(degree);
    int status = fields_create(&p->fields, degree, moving_context(p->problem->moving));
    double *next;

    if (status == SRNF_OK) {
        status = tangent_create(&p->tangent, degree, n_theta, n_phi);
        p->tangent.context = moving_context(p->problem->moving);
    }
    p->memory = srnf_alloc(6 * unknowns + 15 * count + (20 + FIELDS_SCRATCH) * n, sizeof(double));
    if (status || !p->memory) {
        clear(p);
        return SRNF_ENOMEM;
    }
    p->rhs = next = p->memory;
    p->x = next += unknowns;
    p->solver = next += unknowns;
    p->moments = next += 4 * unknowns;
    p->adjoint = next += 3 * count;
    p->values = next += 12 * count;
    p->gradients = next += 3 * n;
    p->points = next += 9 * n;
    p->jacobian = next += 3 * n;
    p->kept = next += n;
    p->scratch = next + 4 * n;
    return SRNF_OK;
}

/* ---- Right side ------------------------------------------------------------------------------ */

/* Derivatives of the template's q from its own harmonics, to the degree that its grid resolves. */
static int spectral_derivative(struct tangent *t, const struct srnf_grid *grid)
{
    struct srnf_sht *fine = NULL;
    size_t n = t->n;
    size_t degree = grid->n_theta - 1;
    double *field = srnf_alloc(9 * n, sizeof(double));
    double *coefficients = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
    void *workspace = NULL;
    int status =
        srnf_sht_create(&fine, degree, SRNF_GRID_GAUSS_LEGENDRE, grid->n_theta, grid->n_phi);

    if (status == SRNF_OK) {
        workspace = srnf_alloc(1, srnf_sht_workspace_size(fine, 3));
    }
    if (!field || !coefficients || !workspace) {
        status = SRNF_ENOMEM;
        goto out;
    }
    for (size_t i = 0; i < 3 * n; i++) {
        field[i % 3 * n + i / 3] = t->q[i];
    }
    srnf_sht_analysis(fine, 3, field, coefficients, workspace);
    srnf_sht_gradient(fine, 3, coefficients, field + 3 * n, field + 6 * n, workspace);
    for (size_t i = 0; i < 3 * n; i++) {
        t->q_theta[i] = field[3 * n + i % 3 * n + i / 3];
        t->q_phi[i] = field[6 * n + i % 3 * n + i / 3];
    }
out:
    srnf_free(field);
    srnf_free(coefficients);
    srnf_free(workspace);
    srnf_sht_destroy(fine);
    return status;
}

static int prepare_right(struct polish *p, size_t degree)
{
    const struct srnf_grid *grid = srnf_sht_grid(p->sht);
    const struct target *target = &p->problem->target;
    struct samples s = {0};
    int status = prepare_degree(p, degree, grid->n_theta, grid->n_phi);

    if (status) {
        return status;
    }
    memcpy(p->tangent.q, target->q, 3 * target->n * sizeof(double));
    if (p->template_moving) {
        status = samples_create(&s, target->n);
        if (status == SRNF_OK) {
            moving_evaluate(p->template_moving, target->points, &s);
            memcpy(p->tangent.q_theta, s.q_1, 3 * target->n * sizeof(double));
            memcpy(p->tangent.q_phi, s.q_2, 3 * target->n * sizeof(double));
            samples_clear(&s);
        }
    } else {
        status = spectral_derivative(&p->tangent, grid);
    }
    if (status) {
        clear(p);
        return status;
    }
    tangent_prepare(&p->tangent, target->norm2);
    return SRNF_OK;
}

static void right_gradient(struct polish *p)
{
    const struct target *target = &p->problem->target;
    const double *o = p->warp->rotation;

    for (size_t i = 0; i < target->n; i++) {
        const double *q = p->samples.q + 3 * i;
        double root = sqrt(p->warp->jacobian[i]);

        for (size_t k = 0; k < 3; k++) {
            p->tangent.image[3 * i + k] = target->q[3 * i + k] - root * vector_dot(o + 3 * k, q);
        }
    }
    tangent_transpose(&p->tangent, p->rhs);
}

/* gamma o exp(v) at the nodes; the least Jacobian of the step, or 0 when the chain cannot be
   replayed there. */
static double right_move(struct polish *p, int *status)
{
    const struct target *target = &p->problem->target;
    double *ones = p->kept;
    double least;

    for (size_t i = 0; i < target->n; i++) {
        ones[i] = 1.0;
    }
    least = fields_apply(&p->fields, p->tangent.potentials, target->n, target->points, ones,
                         p->points, ones, p->scratch);
    if (least < STEP_JACOBIAN_MIN) {
        return least;
    }
    *status = warp_apply(&p->warp->chain, moving_context(p->problem->moving), target->n, p->points,
                         p->points, p->jacobian);
    for (size_t i = 0; i < target->n; i++) {
        p->jacobian[i] *= ones[i];
    }
    return least;
}

/* ---- Left side ------------------------------------------------------------------------------- */

static int prepare_left(struct polish *p, size_t degree)
{
    const struct moving *moving = p->problem->moving;
    size_t rows = (3 * (moving->degree + 1) / 2 + degree) / 2 + 4;
    struct samples s = {0};
    int status;

    rows = rows > degree + 2 ? rows : degree + 2;
    status = prepare_degree(p, degree, rows, 2 * rows);
    if (status) {
        return status;
    }
    status = samples_create(&s, p->tangent.n);
    if (status) {
        clear(p);
        return status;
    }
    moving_evaluate(moving, p->tangent.points, &s);
    memcpy(p->tangent.q, s.q, 3 * s.n * sizeof(double));
    memcpy(p->tangent.q_theta, s.q_1, 3 * s.n * sizeof(double));
    memcpy(p->tangent.q_phi, s.q_2, 3 * s.n * sizeof(double));
    samples_clear(&s);
    tangent_prepare(&p->tangent, p->problem->target.norm2);
    return SRNF_OK;
}

static void left_gradient(struct polish *p)
{
    const struct target *target = &p->problem->target;
    const struct samples *s = &p->samples;
    const double *o = p->warp->rotation;
    size_t n = target->n;
    size_t count = p->fields.count;
    double *torque = p->rhs + 2 * count;

    memset(p->values, 0, 12 * n * sizeof(double));
    memset(p->rhs, 0, p->tangent.unknowns * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        double root = sqrt(p->warp->jacobian[i]);
        double weight = target->weight[i] * root / target->norm2;
        const double *q1 = target->q + 3 * i;
        const double *q = s->q + 3 * i;
        double *v = p->gradients + 3 * i;
        double y[3];
        double turned[3];

        for (size_t k = 0; k < 3; k++) {
            y[k] = weight * (o[k] * q1[0] + o[3 + k] * q1[1] + o[6 + k] * q1[2] - root * q[k]);
        }
        for (size_t k = 0; k < 3; k++) {
            v[k] = vector_dot(y, s->q_1 + 3 * i) * s->t1[3 * i + k] +
                   vector_dot(y, s->q_2 + 3 * i) * s->t2[3 * i + k];
        }
        p->values[2 * n + i] = 0.5 * vector_dot(y, q);
        vector_cross(v, p->warp->points + 3 * i, p->gradients + 3 * (n + i));
        vector_cross(q, y, turned);
        for (size_t k = 0; k < 3; k++) {
            torque[k] += turned[k];
        }
    }
    sphere_points_adjoint(&p->fields.plan.points, 3, n, p->warp->points, p->values, p->gradients,
                          p->moments, p->adjoint);
    for (size_t l = 1; l <= p->fields.degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            p->rhs[i] = p->fields.scale[i] *
                        (p->moments[i] - (double)(l * (l + 1)) * p->moments[2 * count + i]);
            p->rhs[count + i] = p->fields.scale[i] * p->moments[count + i];
        }
    }
}

static double left_move(struct polish *p, int *status)
{
    (void)status;
    return fields_apply(&p->fields, p->tangent.potentials, p->warp->n, p->warp->points,
                        p->warp->jacobian, p->points, p->jacobian, p->scratch);
}

/* ---- Steps ----------------------------------------------------------------------------------- */

static const struct side {
    int (*prepare)(struct polish *p, size_t degree);
    void (*gradient)(struct polish *p);
    double (*move)(struct polish *p, int *status);
    bool first; /* where the link goes in the chain */
} sides[] = {
    {prepare_right, right_gradient, right_move, true},
    {prepare_left, left_gradient, left_move, false},
};

static int add_link(struct polish *p, bool first)
{
    struct srnf_warp *chain = &p->warp->chain;
    int status = warp_append(chain, SRNF_WARP_EXP, p->fields.degree, p->tangent.potentials);

    if (status == SRNF_OK && first) {
        struct srnf_warp_link link = chain->links[chain->n_links - 1];

        memmove(chain->links + 1, chain->links, (chain->n_links - 1) * sizeof link);
        chain->links[0] = link;
    }
    return status;
}

/* Puts the trial in place if it is better; otherwise the samples are those of the warp again. */
static bool try_points(struct polish *p)
{
    struct warp *warp = p->warp;
    double ignored[9];
    double before = warp->objective;
    struct warp old = *warp;

    warp->points = p->points;
    warp->jacobian = p->jacobian;
    registration_objective(p->problem, warp, &p->samples, ignored);
    if (warp->objective < before) {
        memcpy(old.points, p->points, 3 * warp->n * sizeof(double));
        memcpy(old.jacobian, p->jacobian, warp->n * sizeof(double));
        warp->points = old.points;
        warp->jacobian = old.jacobian;
        return true;
    }
    *warp = old;
    return false;
}

/* One accepted step, or none; *gain is the part of the energy that it removed. */
static int advance(struct polish *p, const struct side *side, double *lambda, double *gain)
{
    double before = p->warp->objective;
    double ignored[9];
    bool stale = false;
    int status = SRNF_OK;

    *gain = 0.0;
    side->gradient(p);
    if (!p->problem->free_rotation) {
        memset(p->rhs + 2 * p->tangent.count, 0, 3 * sizeof(double));
    }
    while (*lambda <= LAMBDA_MAX && status == SRNF_OK) {
        double least;

        (void)tangent_solve(&p->tangent, p->rhs, *lambda, INNER_TOLERANCE, INNER_CAP, p->x,
                            p->solver);
        tangent_apply(&p->tangent, p->x); /* leaves the potentials of x */
        least = side->move(p, &status);
        if (status == SRNF_OK && least >= STEP_JACOBIAN_MIN) {
            if (try_points(p)) {
                *gain = 1.0 - p->warp->objective / before;
                *lambda = fmax(LAMBDA_MIN, *lambda / (*gain > 0.5 ? 8.0 : 2.0));
                return add_link(p, side->first);
            }
            stale = true;
        }
        *lambda *= 6.0;
    }
    if (stale) {
        registration_objective(p->problem, p->warp, &p->samples, ignored);
    }
    /* A chain that cannot be replayed where a step leads ends the polish, not the registration. */
    return status == SRNF_ENUMERIC ? SRNF_OK : status;
}

static int run_side(struct polish *p, const struct side *side, size_t degree,
                    const struct srnf_context *context, size_t *iterations,
                    enum srnf_register_stop *stopped)
{
    double lambda = LAMBDA_START;
    double gain = 1.0;
    int status = side->prepare(p, degree);

    if (status) {
        return status;
    }
    for (size_t step = 0; step < STEPS_OF_STAGE && status == SRNF_OK && gain > PROGRESS &&
                          p->warp->energy > ENERGY_ZERO;
         step++) {
        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
            break;
        }
        status = advance(p, side, &lambda, &gain);
        (*iterations)++;
    }
    *stopped = gain > PROGRESS ? SRNF_REGISTER_MAX_ITERATIONS
               : gain > 0.0    ? SRNF_REGISTER_STATIONARY
                               : SRNF_REGISTER_REFUSED;
    clear(p);
    return status;
}

int registration_polish(const struct problem *problem, const struct srnf_sht *sht,
                        const struct moving *template_moving, const struct srnf_context *context,
                        struct warp *warp, size_t *iterations)
{
    struct polish p = {
        .problem = problem, .sht = sht, .template_moving = template_moving, .warp = warp};
    size_t most = srnf_sht_grid(sht)->n_theta - 1;
    double ignored[9];
    int status = samples_create(&p.samples, problem->target.n);

    if (status) {
        return status;
    }
    registration_objective(problem, warp, &p.samples, ignored);
    for (size_t k = 0; k < STAGES && status == SRNF_OK; k++) {
        size_t degree = stages[k] < most ? stages[k] : most;
        enum srnf_register_stop stopped[2] = {SRNF_REGISTER_DIRECT, SRNF_REGISTER_DIRECT};

        for (size_t s = 0; s < 2 && status == SRNF_OK && warp->energy > ENERGY_ZERO; s++) {
            status = run_side(&p, &sides[s], degree, context, iterations, &stopped[s]);
        }
        warp->stopped = warp->energy <= ENERGY_ZERO
                            ? SRNF_REGISTER_TOLERANCE
                            : registration_worse_stop(stopped[0], stopped[1]);
    }
    samples_clear(&p.samples);
    return status;
}
