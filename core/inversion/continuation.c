/*
 * continuation.c - inversion from a surface nearby: the points of geodesics and of shooting, each
 * started from those before it.
 *
 * Levenberg-Marquardt with little damping and a loose inner tolerance: the line in Q has left the
 * image of Q in general, E has a positive minimum, and the inner iterations need no more digits
 * than the outer ones. Where E falls so far that the target turns out to be an exact SRNF, refine
 * adds a second round with tight inner iterations: the loose ones hardly move the directions of the
 * small singular values, in which the surface may be off while E is small.
 *
 * Costs some 200 to 300 transforms a surface.
 */
#include "inversion.h"

#define LAMBDA 1e-6
#define INNER_CAP 40
#define INNER_TOLERANCE 0.05
#define LM_STEPS 60
#define EXACT 1e-8 /* relative E from which on the target counts as exact */
#define LAMBDA_FINE 1e-10
#define CAP_FINE 500
#define LM_STEPS_FINE 10
#define DECREASE_FINE 0.1

int inversion_continue(struct gauss_newton *system, const struct continuation *options,
                       const struct srnf_context *context, double *f, double *energy)
{
    const struct levenberg_options coarse = {.lambda = LAMBDA,
                                             .max_steps = LM_STEPS,
                                             .inner_cap = INNER_CAP,
                                             .inner_tolerance = INNER_TOLERANCE,
                                             .decrease = options->decrease};
    const struct levenberg_options fine = {.lambda = LAMBDA_FINE,
                                           .max_steps = LM_STEPS_FINE,
                                           .inner_cap = CAP_FINE,
                                           .decrease = DECREASE_FINE};
    struct srnf_context quiet = srnf_quiet(context); /* progress is told in surfaces */
    struct inversion_run run = {.system = system,
                                .context = &quiet,
                                .f = f,
                                .tolerance = options->tolerance,
                                .max_iterations = LM_STEPS + LM_STEPS_FINE};
    int status;

    run.energy = gauss_newton_try(system, f);
    gauss_newton_accept(system);
    status = inversion_levenberg(&run, &coarse);
    if (status == SRNF_OK && options->refine && inversion_run_relative(&run) <= EXACT) {
        status = inversion_levenberg(&run, &fine);
    }
    sliding_destroy(run.sliding);
    *energy = run.energy;
    return status;
}
