/*
 * levenberg.c - Levenberg-Marquardt for E(f) = ||Q(f) - q||^2.
 *
 * Each step solves (J' W J + lambda D) d = -J' W (Q(f) - q), D = diag(1 + l (l + 1) / 4), by
 * conjugate gradients (normal_equations.c). The inner tolerance follows sqrt(E), which makes the
 * outer convergence superlinear where the residual vanishes; where a goal is set, they end as soon
 * as the model's E is below it, which spares a last step most of its products. An accepted step
 * divides lambda by 5, a refused one multiplies it by 8.
 *
 * A product costs one gradient transform and one adjoint; a step one transform and one adjoint
 * more.
 */
#include "inversion.h"

#include <math.h>

#define LAMBDA_DOWN 0.2
#define LAMBDA_UP 8.0
#define LAMBDA_MIN 1e-14 /* below rounding of J' W J */
#define LAMBDA_MAX 1e8   /* the step is then shorter than rounding: stationary */
#define INNER_TOLERANCE_MIN 1e-6
#define INNER_TOLERANCE_MAX 0.1

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

/* One step, solved anew with a larger lambda until it is accepted. Sets run->stopped and returns
   false to stop. */
static bool advance(struct inversion_run *run, struct levenberg *work,
                    const struct levenberg_options *options, double *lambda, size_t *steps)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;

    gauss_newton_gradient(system, work->gradient);
    work->conjugate.enough = gain_enough(run, options);
    while (*steps < options->max_steps) {
        double energy;

        if (srnf_is_canceled(run->context)) {
            run->stopped = SRNF_STOP_CANCELED;
            return false;
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
            return !small;
        }
        *lambda *= LAMBDA_UP;
        if (*lambda > LAMBDA_MAX) {
            run->stopped = SRNF_STOP_STATIONARY;
            return false;
        }
    }
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    return false;
}

int inversion_levenberg(struct inversion_run *run, const struct levenberg_options *options)
{
    struct levenberg work = {0};
    double lambda = options->lambda;
    size_t steps = 0;
    bool more = true;

    if (allocate(&work, run->system)) {
        release(&work);
        return SRNF_ENOMEM;
    }
    work.conjugate.context = run->context;
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    while (more && inversion_run_relative(run) > run->tolerance) {
        more = steps < options->max_steps && run->iterations < run->max_iterations &&
               advance(run, &work, options, &lambda, &steps);
    }
    if (inversion_run_relative(run) <= run->tolerance) {
        run->stopped = SRNF_STOP_TOLERANCE;
    }
    release(&work);
    return run->stopped == SRNF_STOP_CANCELED ? SRNF_ECANCELED : SRNF_OK;
}
