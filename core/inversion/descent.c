/*
 * descent.c - the paper's inversion (Eq. 1 to 5): steepest descent of E in the orthonormal basis of
 * harmonics.
 *
 * f <- f - step grad E, with backtracking by halves until the Armijo condition holds and a step
 * twice as long tried after each success. Kept as the baseline: the eigenvalues of J' W J grow as l
 * (l + 1), so the steps that the highest degree bears are far too short for the lowest. An
 * iteration costs at least one transform and one adjoint.
 */
#include "inversion.h"

#define ARMIJO 1e-4
#define STEP_START 0.1
#define STEP_MIN 1e-14 /* shorter steps change nothing: stationary */

int inversion_descend(struct inversion_run *run)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;
    double *gradient = srnf_alloc(2 * n, sizeof(double));
    double *candidate;
    double step = STEP_START;

    if (!gradient) {
        return SRNF_ENOMEM;
    }
    candidate = gradient + n;
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    while (run->iterations < run->max_iterations && inversion_run_relative(run) > run->tolerance &&
           step > STEP_MIN) {
        double energy;
        double slope;

        if (srnf_is_canceled(run->context)) {
            run->stopped = SRNF_STOP_CANCELED;
            break;
        }
        gauss_newton_gradient(system, gradient);
        linear_scale(n, 2.0, gradient);
        slope = linear_dot(n, gradient, gradient);
        for (;;) {
            linear_copy(n, run->f, candidate);
            linear_axpy(n, -step, gradient, candidate);
            energy = gauss_newton_try(system, candidate);
            if (energy <= run->energy - ARMIJO * step * slope || step <= STEP_MIN) {
                break;
            }
            step *= 0.5;
        }
        if (energy < run->energy) {
            gauss_newton_accept(system);
            linear_copy(n, candidate, run->f);
            run->energy = energy;
            step *= 2.0;
        }
        run->iterations++;
        inversion_run_record(run);
    }
    if (inversion_run_relative(run) <= run->tolerance) {
        run->stopped = SRNF_STOP_TOLERANCE;
    } else if (step <= STEP_MIN) {
        run->stopped = SRNF_STOP_STATIONARY;
    }
    srnf_free(gradient);
    return run->stopped == SRNF_STOP_CANCELED ? SRNF_ECANCELED : SRNF_OK;
}
