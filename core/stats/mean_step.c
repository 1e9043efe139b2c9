/*
 * mean_step.c - one step of all the warps of a group mean together.
 *
 * mu is the average of the registered fields, a function of the warps, so G is a function of the
 * warps alone; since mu is its minimum, the derivative of G along a left step of subject i is that
 * of the subject's own objective with mu held fixed. Each subject takes the Gauss-Newton step of
 * its own objective, all at once; then the mean follows. A step that does not lower G is taken back
 * and halved; the step of one subject is shortened by itself until its Jacobian is at least one
 * half on the grid (between the nodes it then stays positive). If nothing lowers G, nothing moves.
 *
 * One step an iteration, not a whole registration: what further steps toward a mean that stands
 * still would gain, the mean would take back by moving.
 *
 * Cost: for each subject one evaluation of f and one of its fields at P points, one adjoint, one
 * Cholesky factor; all of it in parallel over the subjects.
 */
#include "mean.h"

#include <string.h>

#define STEP_JACOBIAN_MIN 0.5
#define SHORTENINGS_MAX 8
#define HALVINGS_MAX 4

struct trial {
    struct mean_run *run;
    double length; /* part of the Gauss-Newton step */
};

/* gamma and J of subject i from the old ones. potentials: of the whole step; what is left of them
   is what was taken, which is nothing where even a short step would fold. */
static int move(const struct mean_run *run, size_t i, double length,
                const struct srnf_context *context, double *potentials)
{
    const struct fields *fields = &run->subjects[i].level.fields;
    size_t n = run->points;
    double *scratch = srnf_alloc(FIELDS_SCRATCH * n, sizeof(double));
    double least = 0.0;

    if (!scratch) {
        return SRNF_ENOMEM;
    }
    linear_scale(2 * fields->count, length, potentials);
    for (size_t k = 0; !(least >= STEP_JACOBIAN_MIN) && !srnf_is_canceled(context); k++) {
        least = fields_apply(fields, potentials, n, run->old_gamma + 3 * i * n,
                             run->old_jacobian + i * n, run->gamma + 3 * i * n,
                             run->jacobian + i * n, scratch);
        if (!(least >= STEP_JACOBIAN_MIN) && k < SHORTENINGS_MAX) {
            linear_scale(2 * fields->count, 0.5, potentials);
        } else if (!(least >= STEP_JACOBIAN_MIN)) {
            memset(potentials, 0, 2 * fields->count * sizeof(double));
        }
    }
    srnf_free(scratch);
    return SRNF_OK;
}

static int step_one(void *argument, size_t i, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct trial *trial = argument;
    const struct mean_run *run = trial->run;
    double *potentials = run->potentials + 2 * i * srnf_coefficient_count(run->degree);
    int status = mean_potentials(run, i, potentials);

    (void)error;
    status = status ? status : move(run, i, trial->length, context, potentials);
    if (status == SRNF_OK) {
        mean_evaluate(run, i);
        mean_field(run, i);
    }
    return status;
}

static int measure_one(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    (void)context;
    (void)error;
    mean_measure(argument, i);
    return SRNF_OK;
}

/* The step becomes a link of every chain. */
static int keep_step(struct mean_run *run)
{
    size_t count = srnf_coefficient_count(run->degree);
    int status = SRNF_OK;

    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        status = warp_append(&run->subjects[i].warp, SRNF_WARP_EXP, run->degree,
                             run->potentials + 2 * i * count);
    }
    return status;
}

int mean_descend(struct mean_run *run, struct stats_progress progress, struct srnf_error *error)
{
    const struct stats_progress quiet = {0};
    struct trial trial = {run, 1.0};
    double before;
    int status = stats_run(run->context, run->n, measure_one, run, quiet, error);

    if (status) {
        return status;
    }
    before = mean_measured(run);
    mean_remember(run);
    for (size_t k = 0; k <= HALVINGS_MAX; k++) {
        status = stats_run(run->context, run->n, step_one, &trial, progress, error);
        status = status ? status : mean_average(run, error);
        if (status) {
            return status;
        }
        if (mean_objective(run) < before) {
            return keep_step(run);
        }
        status = mean_take_back(run, error);
        if (status) {
            return status;
        }
        trial.length *= 0.5;
    }
    return SRNF_OK;
}
