/*
 * inversions.h - one inversion as the tests run it, and the line that tells what came of it.
 */
#ifndef TESTS_SHAPE_INVERSIONS_H
#define TESTS_SHAPE_INVERSIONS_H

#include "core/figures.h"
#include "support/timing.h"

static inline double inversion_seconds(void *user)
{
    (void)user;
    return timing_cpu();
}

/* Inverts s->q from the sphere, or from `initial` when that is not NULL; the result is to be
   cleared. Warnings are returned like success. */
static inline int inversion_run(const struct shapes_surface *s, double tolerance, bool certify,
                                const double *initial, struct srnf_inversion *result)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_context context = {.seconds = inversion_seconds};
    int status;

    options.initial = initial ? SRNF_INITIAL_SURFACE : SRNF_INITIAL_SPHERE;
    options.surface = initial;
    options.tolerance = tolerance;
    options.certify = certify;
    status = srnf_invert(s->sht, s->q, &options, &context, result, NULL);
    assert_true(status >= 0);
    return status;
}

/* Prints and returns the L2 error against s->f. */
static inline double inversion_error(const char *name, const struct shapes_surface *s,
                                     const struct srnf_inversion *result)
{
    double error = shapes_distance(s->degree, result->coefficients, s->f);

    printf("# %-14s L=%-3zu E %.1e  error %.1e", name, s->degree, result->relative_energy, error);
    if (result->surface_error_bound >= 0.0) {
        printf("  bound %.1e  sigma %.3f", result->surface_error_bound,
               result->smallest_singular_value);
    }
    printf("  %zu steps  %.0f U", result->iterations, result->transforms);
    if (result->n_history > 0) {
        printf("  %.3f s", result->history[result->n_history - 1].seconds);
    }
    printf("\n");
    return error;
}

#endif
