/*
 * mean_step.c - one step of all the warps of a group mean together.
 *
 * mu is the average of the registered fields, a function of the warps, so G is a function of the
 * warps alone; since mu is its minimum, the derivative of G along a left step of subject i is that
 * of the subject's own objective with mu held fixed. Each subject takes the Gauss-Newton step of
 * its own objective, all at once; then the mean follows. Steps are tried first: if G does not fall,
 * halves of them are; the step of one subject is shortened by itself until its Jacobian is at least
 * one half on the grid (between the nodes it then stays positive). If nothing lowers G, nothing
 * moves.
 *
 * One step an iteration, not a whole registration: what further steps toward a mean that stands
 * still would gain, the mean would take back by moving.
 *
 * Cost: for each subject two evaluations of f and two of its fields at P points, one adjoint, one
 * Cholesky factor; all of it in parallel over the subjects. Tools that are not kept are made twice.
 */
#include "mean.h"

#define HALVINGS_MAX 4

static int measure_one(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    const struct mean_run *run = argument;

    (void)context;
    (void)error;
    return mean_measure(run, i, NULL,
                        run->potentials + 2 * i * srnf_coefficient_count(run->degree));
}

struct trial {
    const struct mean_run *run;
    double length; /* part of the Gauss-Newton step */
};

static int try_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                   struct srnf_error *error)
{
    const struct trial *trial = argument;

    (void)error;
    return mean_try(trial->run, i, trial->length, context, field);
}

static int move_one(void *argument, size_t i, const struct srnf_context *context,
                    struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_move(argument, i);
}

/* All move, and the step becomes a link of every chain. */
static int keep_step(struct mean_run *run, struct srnf_error *error)
{
    size_t count = srnf_coefficient_count(run->degree);
    int status = stats_run(run->context, run->n, move_one, run, (struct stats_progress){0}, error);

    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        status = mean_chain_step(run, i, run->taken + 2 * i * count);
        run->subjects[i].tabulated += !run->registration.exact;
    }
    return status;
}

int mean_descend(struct mean_run *run, struct stats_progress progress, struct srnf_error *error)
{
    const struct stats_progress quiet = {0};
    struct trial trial = {run, 1.0};
    double before;
    int status = stats_run(run->context, run->n, measure_one, run, quiet, error);

    before = mean_measured(run);
    for (size_t i = 0; i < run->n; i++) {
        run->subjects[i].before = run->subjects[i].at;
    }
    for (size_t k = 0; status == SRNF_OK && k <= HALVINGS_MAX; k++) {
        double variance;

        status = mean_average_of(run, try_one, &trial, run->points, progress, run->average, error);
        if (status) {
            return status;
        }
        variance = mean_variance_about(run, run->average);
        if (mean_objective(run, variance) < before) {
            mean_adopt(run, variance);
            return keep_step(run, error);
        }
        for (size_t i = 0; i < run->n; i++) {
            run->subjects[i].at = run->subjects[i].before;
        }
        trial.length *= 0.5;
    }
    return status;
}
