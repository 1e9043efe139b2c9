/*
 * tabulated_optimize.c - Levenberg-Marquardt over left steps, from tables.
 *
 * The rules are those of optimize.c: a step is accepted if the objective falls and its Jacobian is
 * at least one half at the nodes; damping shrinks by the gain ratio and grows on refusal. The last
 * steps correct the matrix (secant.c), until one is refused. Nothing is allocated in the loop but
 * the links of the chain. Landmarks correct each step (landmarks.h), and what they cost is added to
 * the objective; what steps teach is left out then.
 */
#include "tabulated.h"
#include "landmarks.h"

#include <math.h>
#include <string.h>

#define LAMBDA_START 1e-2
#define LAMBDA_MIN 1e-9
#define LAMBDA_MAX 1e6
#define GAIN_GOOD 0.7
#define GAIN_FAIR 0.3
#define STEP_JACOBIAN_MIN 0.5
#define TO_COME 0.5       /* of the last gain: what later steps may gain in all */
#define ENERGY_ZERO 1e-13 /* of ||q1||^2: registered to rounding */

struct vectors {
    double *rhs, *step, *potentials;
    double *last, *work; /* the right-hand side of the step before */
    struct secant secant;
};

static int open_vectors(struct vectors *v, const struct tabulated_optimizer *o)
{
    size_t k = registration_unknowns(o->fields->degree);
    double *memory = srnf_alloc(5 * k, sizeof(double));

    *v = (struct vectors){0};
    if (!memory) {
        return SRNF_ENOMEM;
    }
    *v = (struct vectors){memory, memory + k, memory + 2 * k, memory + 3 * k, memory + 4 * k, {0}};
    return secant_create(&v->secant, o->level->unknowns);
}

static void close_vectors(struct vectors *v)
{
    srnf_free(v->rhs);
    secant_clear(&v->secant);
}

/* The level at one damping, for the landmarks. */
struct damped {
    struct tabulated_level *level;
    double lambda, curvature;
};

static bool solve_damped(void *system, const double *rhs, double *out)
{
    const struct damped *d = system;
    double ignored;

    return tabulated_level_solve(d->level, d->lambda, d->curvature, rhs, out, &ignored);
}

/* The step of one damping that earlier steps correct. */
static bool solve_corrected(const struct tabulated_optimizer *o, double lambda, double curvature,
                            struct vectors *v, double *expected)
{
    memcpy(v->work, v->rhs, o->level->unknowns * sizeof *v->work);
    secant_before(&v->secant, v->work);
    if (!tabulated_level_solve(o->level, lambda, curvature, v->work, v->step, expected)) {
        return false;
    }
    secant_after(&v->secant, v->step);
    *expected = linear_dot(o->level->unknowns, v->rhs, v->step);
    return true;
}

/* The step of one damping, which goes a part of the way to the landmarks, and the gain that is
   expected of it. */
static bool solve(const struct tabulated_optimizer *o, double lambda, double part, double curvature,
                  struct vectors *v, double *expected)
{
    struct damped system = {o->level, lambda, curvature};
    double promise;

    if (v->secant.count > 0) {
        return solve_corrected(o, lambda, curvature, v, expected);
    }
    if (!tabulated_level_solve(o->level, lambda, curvature, v->rhs, v->step, expected)) {
        return false;
    }
    if (o->track) {
        if (!landmark_track_correct(o->track, solve_damped, &system, part, v->step, &promise)) {
            return false;
        }
        /* Without what the damping takes of it, which the model does not know. */
        *expected = linear_dot(o->level->unknowns, v->rhs, v->step) + promise;
    }
    return true;
}

/* The right-hand side where the cloud is. Returns the curvature of the Jacobian penalty. */
static double linearize(const struct tabulated_optimizer *o, const struct cloud *cloud, bool first,
                        struct vectors *v)
{
    double torque[3];
    struct tabulated_fields *loads = o->loads ? o->loads : o->fields;
    double curvature = cloud_load(o->problem, cloud, &loads->table, torque);

    memcpy(v->last, v->rhs, o->level->unknowns * sizeof *v->last);
    tabulated_fields_transpose(loads, torque, v->rhs);
    if (o->track) {
        landmark_track_linearize(o->track);
    } else if (!first) {
        secant_add(&v->secant, v->step, v->last, v->rhs);
    }
    return curvature;
}

/* One accepted step, or none: *gain is what it lowered the objective by. */
static int advance(const struct tabulated_optimizer *o, bool first, struct vectors *v,
                   struct cloud *cloud, struct srnf_warp *chain, double *lambda, double *gain)
{
    double before = cloud->objective + (o->track ? landmark_track_cost(o->track) : 0.0);
    double curvature = linearize(o, cloud, first, v);
    double part = 1.0; /* damping alone shortens no way to landmarks that weigh much */

    *gain = 0.0;
    for (; *lambda <= LAMBDA_MAX; *lambda *= 6.0, part *= 0.5, secant_forget(&v->secant)) {
        double expected;
        double after;
        struct cloud accepted;

        if (!solve(o, *lambda, part, curvature, v, &expected)) {
            continue;
        }
        tabulated_fields_potentials(o->fields, v->step, v->potentials);
        tabulated_fields_fill(o->fields, v->potentials);
        if (!(cloud_move(&o->fields->table, cloud, o->spare) >= STEP_JACOBIAN_MIN)) {
            continue;
        }
        cloud_evaluate(o->problem->moving, o->spare);
        memcpy(o->spare->rotation, cloud->rotation, sizeof cloud->rotation);
        memcpy(o->spare->displacement, cloud->displacement, sizeof cloud->displacement);
        cloud_measure(o->problem, o->spare);
        after = o->spare->objective;
        after += o->track ? landmark_track_try(o->track, v->potentials) : 0.0;
        if (!(after < before)) {
            continue;
        }
        accepted = *o->spare;
        *o->spare = *cloud;
        *cloud = accepted;
        *gain = before - after;
        if (o->track) {
            landmark_track_accept(o->track);
        }
        *lambda /= *gain > GAIN_GOOD * expected ? 8.0 : *gain > GAIN_FAIR * expected ? 3.0 : 1.0;
        *lambda = fmax(*lambda, LAMBDA_MIN);
        return warp_append(chain, SRNF_WARP_EXP, o->fields->degree, v->potentials);
    }
    return SRNF_OK;
}

int tabulated_optimize(const struct tabulated_optimizer *o, const struct schedule *schedule,
                       struct cloud *cloud, struct srnf_warp *chain,
                       enum srnf_register_stop *stopped, size_t *iterations)
{
    struct vectors v;
    double lambda = LAMBDA_START;
    size_t small = 0;
    int status = open_vectors(&v, o);

    *stopped = SRNF_REGISTER_MAX_ITERATIONS;
    for (size_t step = 0; step < schedule->max_steps && small < 2 && status == SRNF_OK; step++) {
        double before = cloud->objective + (o->track ? landmark_track_cost(o->track) : 0.0);
        double gain;

        if (cloud->energy < ENERGY_ZERO) {
            break;
        }
        if (srnf_is_canceled(o->context)) {
            status = SRNF_ECANCELED;
            break;
        }
        status = advance(o, step == 0, &v, cloud, chain, &lambda, &gain);
        (*iterations)++;
        if (!(gain > 0.0)) {
            *stopped = SRNF_REGISTER_REFUSED;
            break;
        }
        small = gain < schedule->decrease * before ? small + 1 : 0;
        if (o->limit > 0.0 && cloud->objective - TO_COME * gain > o->limit) {
            break;
        }
    }
    if (cloud->energy < ENERGY_ZERO) {
        *stopped = SRNF_REGISTER_TOLERANCE;
    } else if (small >= 2) {
        *stopped = SRNF_REGISTER_STATIONARY;
    }
    close_vectors(&v);
    return status;
}
