/*
 * mean_start.c - where a mean starts: the fields of the group, the medoid or the plain mean, or
 * what a checkpoint holds.
 */
#include "mean.h"

#include <math.h>

#define MEDOID_AMONG ((size_t)500) /* members, of larger groups: n^2 distances */

/* ---- Nothing registered ---------------------------------------------------------------------- */

/* The mean of all as they are parameterized, and the variance. */
void mean_average_plain(struct mean_run *run)
{
    size_t field = 3 * run->points;
    double sum = 0.0;

    stats_average(run->grid, run->n, run->q, run->mean_q);
    for (size_t i = 0; i < run->n; i++) {
        sum += stats_distance2(run->grid, run->q + i * field, run->mean_q);
    }
    run->variance = sum / (double)run->n;
}

/* q of all, and N. */
static int find_plain(struct mean_run *run, struct srnf_error *error)
{
    int status = stats_fields(run->work, run->n, run->surfaces, run->context, run->q, error);

    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        const double *q = run->q + i * 3 * run->points;

        run->norm2 += srnf_inner_product(run->grid, q, q) / (double)run->n;
    }
    return status;
}

/* ---- Start ----------------------------------------------------------------------------------- */

struct medoid {
    const struct mean_run *run;
    size_t n;
    double *q;    /* [n][3][P] */
    double *sums; /* [n] of the distances to all */
};

static int sum_distances(void *argument, size_t i, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const struct medoid *medoid = argument;
    const struct mean_run *run = medoid->run;
    size_t field = 3 * run->points;
    double sum = 0.0;

    (void)context;
    (void)error;
    for (size_t j = 0; j < medoid->n; j++) {
        sum += sqrt(stats_distance2(run->grid, medoid->q + i * field, medoid->q + j * field));
    }
    medoid->sums[i] = sum;
    return SRNF_OK;
}

/* Among all members, or some of a large group at equal steps. */
static int find_medoid(const struct mean_run *run, size_t *index, struct srnf_error *error)
{
    size_t step = (run->n + MEDOID_AMONG - 1) / MEDOID_AMONG;
    size_t n = (run->n + step - 1) / step;
    struct medoid medoid = {run, n, srnf_alloc(n, 3 * run->points * sizeof(double)),
                            srnf_alloc(n, sizeof(double))};
    const double **surfaces = srnf_alloc(n, sizeof *surfaces);
    int status = SRNF_ENOMEM;

    if (medoid.q && medoid.sums && surfaces) {
        for (size_t i = 0; i < n; i++) {
            surfaces[i] = run->surfaces[i * step];
        }
        status = stats_fields(run->work, n, surfaces, run->context, medoid.q, error);
    }
    if (status == SRNF_OK) {
        status =
            stats_run(run->context, n, sum_distances, &medoid, (struct stats_progress){0}, error);
    }
    *index = 0;
    for (size_t i = 1; i < n && status == SRNF_OK; i++) {
        *index = medoid.sums[i] < medoid.sums[*index] ? i : *index;
    }
    *index *= step;
    srnf_free(surfaces);
    srnf_free(medoid.q);
    srnf_free(medoid.sums);
    return status;
}

/* q as the subject is parameterized; its square norm in place of its energy. */
static int field_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct mean_run *run = argument;
    int status = stats_fields(run->work, 1, run->surfaces + i, context, field, error);
    double square = status ? 0.0 : srnf_inner_product(run->grid, field, field);

    if (status == SRNF_OK && (!(square > 0.0) || !isfinite(square))) {
        return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                         "the SRNF of surface %zu is zero or not finite", i);
    }
    run->subjects[i].at.energy = square;
    return status;
}

/* The plain average, and N. */
static int find_fields(struct mean_run *run, struct srnf_error *error)
{
    int status = mean_average_of(run, field_one, run, run->points, (struct stats_progress){0},
                                 run->average, error);

    for (size_t i = 0; i < run->n; i++) {
        run->norm2 += run->subjects[i].at.energy / (double)run->n;
    }
    return status;
}

static int prepare_one(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_prepare(argument, i);
}

int mean_begin(struct mean_run *run, struct srnf_error *error)
{
    int status = run->registered ? find_fields(run, error) : find_plain(run, error);

    return status || !run->registered ? status
                                      : stats_run(run->context, run->n, prepare_one, run,
                                                  (struct stats_progress){0}, error);
}

int mean_start(struct mean_run *run, size_t start, struct srnf_error *error)
{
    int status = SRNF_OK;

    if (!run->registered && start == STATS_START_DEFAULT) {
        mean_average_plain(run);
        mean_landmarks_start(run, start);
        return SRNF_OK;
    }
    if (start == STATS_START_DEFAULT && run->registration.common_pose) {
        mean_adopt(run, 0.0);
        mean_landmarks_start(run, start);
        return SRNF_OK;
    }
    if (start == STATS_START_DEFAULT) {
        status = find_medoid(run, &start, error);
    }
    if (status == SRNF_OK) {
        mean_landmarks_start(run, start);
    }
    return status ? status
                  : stats_fields(run->work, 1, run->surfaces + start, run->context, run->mean_q,
                                 error);
}

static int replay_one(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_replay(argument, i);
}

int mean_resume(struct mean_run *run, const struct srnf_mean_options *options,
                struct srnf_error *error)
{
    int status = mean_checkpoint_read(run, options->resume, options->resume_size, error);

    if (status || !run->started) {
        return status;
    }
    run->variance = run->history[run->iterations - 1].variance;
    mean_set_target(run);
    status = mean_place_center(run, error);
    if (status == SRNF_OK) {
        status =
            stats_run(run->context, run->n, replay_one, run, (struct stats_progress){0}, error);
    }
    return status != SRNF_EIO
               ? status
               : srnf_fail(error, SRNF_EINVAL, -1,
                           "the scratch to resume from does not hold what the bytes say");
}
