/*
 * mean_step.c - one step of all the warps of a group mean together.
 *
 * mu is the average of the registered fields, a function of the warps, so G is a function of the
 * warps alone; since mu is its minimum, the derivative of G along a left step of subject i is that
 * of the subject's own objective with mu held fixed. Each subject takes the Gauss-Newton step of
 * its own objective, all at once; then the mean follows. If G does not fall, all go back along
 * their chains, and halves of the steps are tried; the step of one subject is shortened by itself
 * until its Jacobian is at least one half on the grid (between the nodes it then stays positive).
 * If nothing lowers G, nothing moves.
 *
 * One step an iteration, not a whole registration: what further steps toward a mean that stands
 * still would gain, the mean would take back by moving.
 *
 * Cost: for each subject one field moved, one right-hand side, and one evaluation of q at P points,
 * or two where tools are not kept but made twice; all of it in parallel over the subjects.
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

static int go_back_one(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_replay(argument, i);
}

/* The step becomes a link of every chain. */
static int keep_step(struct mean_run *run)
{
    size_t count = srnf_coefficient_count(run->degree);
    int status = SRNF_OK;

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
    int status = mean_aim(run);

    status = status ? status : stats_run(run->context, run->n, measure_one, run, quiet, error);
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
            return keep_step(run);
        }
        for (size_t i = 0; i < run->n; i++) {
            run->subjects[i].at = run->subjects[i].before;
        }
        status = stats_run(run->context, run->n, go_back_one, run, quiet, error);
        trial.length *= 0.5;
    }
    return status;
}
