/*
 * descent.c - the paper's inversion (Eq. 1 to 5): steepest descent of E in the orthonormal basis of
 * harmonics.
 *
 * f <- f - step grad E, with backtracking by halves until the Armijo condition holds and a step
 * twice as long tried after each success. Kept as the baseline: the eigenvalues of J' W J grow as l
 * (l + 1), so the steps that the highest degree bears are far too short for the lowest. An
 * iteration costs at least one transform and one adjoint.
 */
#include "shape.h"

#define ARMIJO 1e-4
#define STEP_START 0.1
#define STEP_MIN 1e-14 /* shorter steps change nothing: stationary */

int shape_descend(struct shape_run *run)
{
    struct shape_system *system = run->system;
    size_t n = system->count;
    double *gradient = srnf_alloc(2 * n, sizeof(double));
    double *candidate;
    double step = STEP_START;

    if (!gradient) {
        return SRNF_ENOMEM;
    }
    candidate = gradient + n;
    run->stopped = SRNF_STOP_MAX_ITERATIONS;
    while (run->iterations < run->max_iterations && shape_run_relative(run) > run->tolerance &&
           step > STEP_MIN) {
        double energy;
        double slope;

        if (srnf_is_canceled(run->context)) {
            run->stopped = SRNF_STOP_CANCELED;
            break;
        }
        shape_system_gradient(system, gradient);
        shape_scale(n, 2.0, gradient);
        slope = shape_dot(n, gradient, gradient);
        for (;;) {
            shape_copy(n, run->f, candidate);
            shape_axpy(n, -step, gradient, candidate);
            energy = shape_system_try(system, candidate);
            if (energy <= run->energy - ARMIJO * step * slope || step <= STEP_MIN) {
                break;
            }
            step *= 0.5;
        }
        if (energy < run->energy) {
            shape_system_accept(system);
            shape_copy(n, candidate, run->f);
            run->energy = energy;
            step *= 2.0;
        }
        run->iterations++;
        shape_run_record(run);
    }
    if (shape_run_relative(run) <= run->tolerance) {
        run->stopped = SRNF_STOP_TOLERANCE;
    } else if (step <= STEP_MIN) {
        run->stopped = SRNF_STOP_STATIONARY;
    }
    srnf_free(gradient);
    return run->stopped == SRNF_STOP_CANCELED ? SRNF_ECANCELED : SRNF_OK;
}
