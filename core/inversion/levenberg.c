/*
 * levenberg.c - Levenberg-Marquardt for E(f) = ||Q(f) - q||^2.
 *
 * Each step solves (J' W J + lambda D) d = -J' W (Q(f) - q), D = diag(1 + l (l + 1) / 4), by
 * conjugate gradients (normal_equations.c). The inner tolerance follows sqrt(E), which makes the
 * outer convergence superlinear where the residual vanishes; where a goal is set, they end as soon
 * as the model's E is below it, which spares a last step most of its products. An accepted step
 * divides lambda by 5, a refused one multiplies it by 8.
 *
 * Where little energy is left, what is left slides along the surface, and sliding.c helps the
 * conjugate gradients to find it where they need help.
 *
 * A product costs one gradient transform and one adjoint, and some .9 transforms more with
 * sliding.c; a step one transform and one adjoint more, and some five with sliding.c.
 */
#include "inversion.h"

#include <math.h>

#define LAMBDA_DOWN 0.2
#define LAMBDA_UP 8.0
#define LAMBDA_MIN 1e-14 /* below rounding of J' W J */
#define LAMBDA_MAX 1e8   /* the step is then shorter than rounding: stationary */
#define INNER_TOLERANCE_MIN 1e-6
#define INNER_TOLERANCE_MAX 0.1
/* Where sliding.c is wanted. It makes random stars dearer: of 48 of degree 10 to 31 method auto
   came to it so in four, which then took up to 1.23 times the transforms and ended at a hundredth
   of the energy. With 60 products for 55 it is two, but thalami of degree 15 take half as much
   again. Of 1e-3, 1e-4 and 1e-5 the middle takes least. */
#define SLIDING_BELOW 1e-4 /* relative energy */
#define LONG 55            /* products of the solve before */
#define ROUND 2.0          /* of sliding_turning */

struct levenberg {
    double *memory;
    double *gradient, *step, *candidate;
    struct normal_equations conjugate;
};

static int allocate(struct levenberg *work, const struct gauss_newton *system)
{
    size_t n = system->count;

    work->memory = srnf_alloc(3 * n, sizeof(double));
    if (!work->memory) {
        return SRNF_ENOMEM;
    }
    work->gradient = work->memory;
    work->step = work->memory + n;
    work->candidate = work->memory + 2 * n;
    return normal_equations_create(&work->conjugate, system);
}

static void release(struct levenberg *work)
{
    normal_equations_destroy(&work->conjugate);
    srnf_free(work->memory);
}

static double inner_tolerance(const struct inversion_run *run,
                              const struct levenberg_options *options)
{
    double tolerance = sqrt(inversion_run_relative(run));

    if (options->inner_tolerance > 0.0) {
        return options->inner_tolerance;
    }
    tolerance = tolerance < INNER_TOLERANCE_MAX ? tolerance : INNER_TOLERANCE_MAX;
    return tolerance > INNER_TOLERANCE_MIN ? tolerance : INNER_TOLERANCE_MIN;
}

/* What a step has to take off E at most, by the model; 0: all there is. */
static double gain_enough(const struct inversion_run *run, const struct levenberg_options *options)
{
    double goal = options->goal * run->tolerance * run->system->q_norm2;

    return options->goal > 0.0 ? fmax(0.0, run->energy - goal) : 0.0;
}

/* Whether sliding.c helps more than it costs. Far from a solution it does not: without it steps
   hardly slide, and are accepted more often. Near one it does where a solve took long, and on
   surfaces that are round, whose points slide most easily. */
static bool wants_sliding(struct inversion_run *run, struct levenberg *work)
{
    if (inversion_run_relative(run) > SLIDING_BELOW) {
        return false;
    }
    if (work->conjugate.iterations >= LONG) {
        return true;
    }
    if (run->turning == 0.0) {
        run->turning = sliding_turning(run->system, work->step);
    }
    return run->turning < ROUND;
}

/* What sliding.c adds to the preconditioner, for the equations at the state; once wanted, for the
   rest of the run. */
static int prepare_sliding(struct inversion_run *run, struct levenberg *work,
                           const struct levenberg_options *options, double lambda)
{
    work->conjugate.sliding = NULL;
    if (options->inner_tolerance > 0.0 || !(run->sliding || wants_sliding(run, work))) {
        return SRNF_OK;
    }
    if (!run->sliding) {
        int status = sliding_create(&run->sliding, run->system);

        if (status) {
            return status;
        }
    }
    work->conjugate.sliding = run->sliding;
    sliding_prepare(run->sliding, run->system, run->f, work->conjugate.diagonal, lambda);
    return SRNF_OK;
}

/* One step, solved anew with a larger lambda until it is accepted. Sets run->stopped, and *more to
   false to stop. */
static int advance(struct inversion_run *run, struct levenberg *work,
                   const struct levenberg_options *options, double *lambda, size_t *steps,
                   bool *more)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;

    gauss_newton_gradient(system, work->gradient);
    work->conjugate.enough = gain_enough(run, options);
    *more = false;
    while (*steps < options->max_steps) {
        double energy;
        int status;

        if (srnf_is_canceled(run->context)) {
            run->stopped = SRNF_STOP_CANCELED;
            return SRNF_OK;
        }
        status = prepare_sliding(run, work, options, *lambda);
        if (status) {
            return status;
        }
        /* The gradient at the state: the step goes against it. */
        (void)normal_equations_solve(&work->conjugate, system, work->gradient, *lambda,
                                     inner_tolerance(run, options), options->inner_cap, work->step);
        linear_copy(n, run->f, work->candidate);
        linear_axpy(n, -1.0, work->step, work->candidate);
        energy = gauss_newton_try(system, work->candidate);
        (*steps)++;
        run->iterations++;
        if (energy < run->energy) {
            bool small = run->energy - energy < options->decrease * run->energy;

            gauss_newton_accept(system);
            linear_copy(n, work->candidate, run->f);
            run->energy = energy;
            inversion_run_record(run);
            *lambda = fmax(LAMBDA_MIN, *lambda * LAMBDA_DOWN);
            run->stopped = small ? SRNF_STOP_STATIONARY : SRNF_STOP_MAX_ITERATIONS;
            *more = !small;
            return SRNF_OK;
        }
        *lambda *= LAMBDA_UP;
        if (*lambda > LAMBDA_MAX) {
            run->stopped = SRNF_STOP_STATIONARY;
            return SRNF_OK;
        }
    }
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    return SRNF_OK;
}

int inversion_levenberg(struct inversion_run *run, const struct levenberg_options *options)
{
    struct levenberg work = {0};
    double lambda = options->lambda;
    size_t steps = 0;
    bool more = true;
    int status = SRNF_OK;

    if (allocate(&work, run->system)) {
        release(&work);
        return SRNF_ENOMEM;
    }
    work.conjugate.context = run->context;
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    while (status == SRNF_OK && more && inversion_run_relative(run) > run->tolerance) {
        more = steps < options->max_steps && run->iterations < run->max_iterations;
        if (more) {
            status = advance(run, &work, options, &lambda, &steps, &more);
        }
    }
    if (inversion_run_relative(run) <= run->tolerance) {
        run->stopped = SRNF_STOP_TOLERANCE;
    }
    release(&work);
    return status != SRNF_OK                    ? status
           : run->stopped == SRNF_STOP_CANCELED ? SRNF_ECANCELED
                                                : SRNF_OK;
}
