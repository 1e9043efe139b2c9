/*
 * mean.c - the Karcher mean of a group (the paper, Algorithm 2).
 *
 * Minimises the mean of ||mu - O_i (q_i, gamma_i)||^2 over mu, the O_i and the gamma_i in turn:
 *
 *   1. start: mu is the q of the medoid, the surface with the least sum of unregistered distances;
 *      in a common pose, and where nothing is registered, the plain mean of all q
 *   2. every subject is registered to mu, from where its last registration left it
 *      (mean_subject.c); in parallel
 *   3. all warps take one right step that centres them (mean_center.c)
 *   4. mu <- the mean of the registered q, exactly evaluated on the grid, in the order of the
 *      subjects
 *   5. again from 2, until ||mu_k - mu_k-1|| <= tolerance ||mu_k||
 *   6. mu is inverted once, from the average of the registered surfaces
 *
 * No inversion happens inside the loop: mu need not be the SRNF of any surface, and how far it is
 * from one is told as the relative energy of step 6. Where nothing is registered steps 2 and 3 are
 * void, and one iteration is exact.
 *
 * Between iterations the state is mu, the centring, and O_i and a chain for each subject: that is
 * what a checkpoint holds (mean_checkpoint.c). A resumed run ends with the same bits as one that
 * was never stopped, and so does a run on any number of threads.
 *
 * Memory: 24 P bytes a subject for its q, and 32 P for its warp on the grid; the chains. Cost of an
 * iteration: n registrations, the first time from a cold start, then warm.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

#define TOLERANCE 1e-3
#define MAX_ITERATIONS 20
#define MAX_ITERATIONS_ALLOWED 10000
/* Progress: each iteration is expected to be this part of what is left, the inversion the rest. */
#define PROGRESS_PART 0.4
#define PROGRESS_LOOP 0.95

struct srnf_mean_options srnf_mean_options_defaults(void)
{
    return (struct srnf_mean_options){.tolerance = TOLERANCE, .max_iterations = MAX_ITERATIONS};
}

static int check_options(const struct srnf_mean_options *options, struct srnf_error *error)
{
    if (!(options->tolerance >= 0.0) || !isfinite(options->tolerance)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "tolerance %g is not a number from 0 up",
                         options->tolerance);
    }
    if (options->max_iterations == 0 || options->max_iterations > MAX_ITERATIONS_ALLOWED) {
        return srnf_fail(error, SRNF_EINVAL, -1, "max_iterations is %zu, not 1 to %d",
                         options->max_iterations, MAX_ITERATIONS_ALLOWED);
    }
    return SRNF_OK;
}

static void clear_run(struct mean_run *run)
{
    for (size_t i = 0; run->subjects && i < run->n; i++) {
        srnf_warp_clear(&run->subjects[i].warp);
    }
    srnf_warp_clear(&run->centring);
    srnf_free(run->base);
    srnf_free(run->base_jacobian);
    srnf_free(run->nodes);
    srnf_free(run->mean_q);
    srnf_free(run->previous);
    srnf_free(run->subjects);
    srnf_free(run->q);
    srnf_free(run->gamma);
    srnf_free(run->jacobian);
    srnf_free(run->history);
}

static int create_run(struct mean_run *run, const struct srnf_mean_options *options)
{
    size_t field = 3 * run->points;
    size_t all;

    if (__builtin_mul_overflow(run->n, field, &all)) {
        return SRNF_ENOMEM;
    }
    run->history_capacity = options->max_iterations;
    run->nodes = srnf_alloc(field, sizeof(double));
    run->mean_q = srnf_alloc(field, sizeof(double));
    run->previous = srnf_alloc(field, sizeof(double));
    run->subjects = srnf_alloc(run->n, sizeof *run->subjects);
    run->q = srnf_alloc(all, sizeof(double));
    run->history = srnf_alloc(run->history_capacity, sizeof *run->history);
    if (!run->nodes || !run->mean_q || !run->previous || !run->subjects || !run->q ||
        !run->history) {
        return SRNF_ENOMEM;
    }
    if (options->registration) {
        run->registered = true;
        run->registration = *options->registration;
        run->registration.symmetric = false; /* the mean is a field, not a surface */
        run->gamma = srnf_alloc(all, sizeof(double));
        run->jacobian = srnf_alloc(all / 3, sizeof(double));
        run->base = srnf_alloc(field, sizeof(double));
        run->base_jacobian = srnf_alloc(run->points, sizeof(double));
        if (!run->gamma || !run->jacobian || !run->base || !run->base_jacobian) {
            return SRNF_ENOMEM;
        }
    }
    stats_nodes(run->grid, run->nodes);
    return run->registered ? mean_replay_base(run) : SRNF_OK;
}

/* ---- Start ----------------------------------------------------------------------------------- */

struct medoid {
    const struct mean_run *run;
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
    for (size_t j = 0; j < run->n; j++) {
        sum += sqrt(stats_distance2(run->grid, run->q + i * field, run->q + j * field));
    }
    medoid->sums[i] = sum;
    return SRNF_OK;
}

static int find_medoid(const struct mean_run *run, size_t *index, struct srnf_error *error)
{
    struct medoid medoid = {run, srnf_alloc(run->n, sizeof(double))};
    int status = SRNF_ENOMEM;

    if (medoid.sums) {
        status = stats_run(run->context, run->n, sum_distances, &medoid, (struct stats_progress){0},
                           error);
    }
    *index = 0;
    for (size_t i = 1; i < run->n && status == SRNF_OK; i++) {
        *index = medoid.sums[i] < medoid.sums[*index] ? i : *index;
    }
    srnf_free(medoid.sums);
    return status;
}

static int start_run(struct mean_run *run, size_t start, struct srnf_error *error)
{
    size_t field = 3 * run->points;
    int status = stats_fields(run->sht, run->n, run->surfaces, run->context, run->q, error);

    if (status) {
        return status;
    }
    if (start == STATS_START_DEFAULT && (!run->registered || run->registration.common_pose)) {
        stats_average(run->grid, run->n, run->q, run->mean_q);
        return SRNF_OK;
    }
    if (start == STATS_START_DEFAULT) {
        status = find_medoid(run, &start, error);
    }
    if (status == SRNF_OK) {
        memcpy(run->mean_q, run->q + start * field, field * sizeof(double));
    }
    return status;
}

static int replay_one(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_replay(argument, i);
}

static int replay_all(struct mean_run *run, struct srnf_error *error)
{
    return stats_run(run->context, run->n, replay_one, run, (struct stats_progress){0}, error);
}

static int resume_run(struct mean_run *run, const struct srnf_mean_options *options,
                      struct srnf_error *error)
{
    int status = mean_checkpoint_read(run, options->resume, options->resume_size, error);

    if (status) {
        return status;
    }
    if (!run->started) {
        return stats_fields(run->sht, run->n, run->surfaces, run->context, run->q, error);
    }
    status = mean_replay_base(run);
    return status ? status : replay_all(run, error);
}

/* ---- Iterations ------------------------------------------------------------------------------ */

static int register_one(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    return mean_register(argument, i, context, error);
}

static int register_all(struct mean_run *run, struct srnf_error *error)
{
    struct stats_progress progress = {0.0, 0.0, "registering to the mean"};
    double left = 1.0;
    int status;

    for (size_t k = 0; k < run->iterations; k++) {
        left *= 1.0 - PROGRESS_PART;
    }
    progress.from = PROGRESS_LOOP * (1.0 - left);
    progress.to = PROGRESS_LOOP * (1.0 - left * (1.0 - PROGRESS_PART));
    status = stats_run(run->context, run->n, register_one, run, progress, error);
    if (status == SRNF_OK) {
        run->started = true;
    }
    if (status == SRNF_OK && run->registration.reparameterization) {
        status = mean_center(run, NULL);
    }
    return status ? status : replay_all(run, error);
}

/* One iteration, and its entry in the history. */
static int iterate(struct mean_run *run, double seconds, struct srnf_error *error)
{
    struct srnf_mean_iteration *entry = &run->history[run->iterations];
    double *swap = run->previous;
    double norm;
    int status = run->registered ? register_all(run, error) : SRNF_OK;

    if (status) {
        return status;
    }
    run->previous = run->mean_q;
    run->mean_q = swap;
    stats_average(run->grid, run->n, run->q, run->mean_q);
    norm = sqrt(srnf_inner_product(run->grid, run->mean_q, run->mean_q));
    entry->change = sqrt(stats_distance2(run->grid, run->mean_q, run->previous));
    entry->change = norm > 0.0 ? entry->change / norm : 0.0;
    entry->variance = 0.0;
    for (size_t i = 0; i < run->n; i++) {
        entry->variance +=
            stats_distance2(run->grid, run->q + i * 3 * run->points, run->mean_q) / (double)run->n;
    }
    entry->seconds = seconds;
    run->iterations++;
    return SRNF_OK;
}

static int tell_checkpoint(const struct mean_run *run, const struct srnf_mean_options *options)
{
    struct mean_bytes bytes;
    int status;

    if (!options->checkpoint) {
        return SRNF_OK;
    }
    status = mean_checkpoint_write(run, &bytes);
    if (status == SRNF_OK) {
        options->checkpoint(options->checkpoint_user, bytes.data, bytes.size);
        srnf_free(bytes.data);
    }
    return status;
}

static bool is_converged(const struct mean_run *run, double tolerance)
{
    return run->iterations > 0 && run->history[run->iterations - 1].change <= tolerance;
}

static int iterate_all(struct mean_run *run, const struct srnf_mean_options *options,
                       struct srnf_error *error)
{
    double start = srnf_seconds(run->context);
    double before = run->iterations > 0 ? run->history[run->iterations - 1].seconds : 0.0;
    int status = SRNF_OK;

    while (status == SRNF_OK && run->iterations < options->max_iterations &&
           !is_converged(run, options->tolerance)) {
        status = iterate(run, 0.0, error);
        if (status == SRNF_OK) {
            run->history[run->iterations - 1].seconds = before + srnf_seconds(run->context) - start;
            status = tell_checkpoint(run, options);
        }
        if (status == SRNF_OK && srnf_is_canceled(run->context)) {
            status = SRNF_ECANCELED;
        }
    }
    return status;
}

/* ---- The mean surface ------------------------------------------------------------------------ */

/* The registered surface of one subject, in the place of its gamma, which has served its turn. */
static int place_values(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct mean_run *run = argument;
    size_t field = 3 * run->points;
    double *values = srnf_alloc(field, sizeof(double));
    int status = values ? mean_values(run, i, values) : SRNF_ENOMEM;

    (void)context;
    (void)error;
    if (status == SRNF_OK) {
        memcpy(run->gamma + i * field, values, field * sizeof(double));
    }
    srnf_free(values);
    return status;
}

/* The average of the surfaces, as they are registered. */
static int blend(const struct mean_run *run, double *coefficients, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));
    double *values = NULL;
    void *workspace = NULL;
    int status;

    if (!run->registered) {
        for (size_t i = 0; i < run->n; i++) {
            for (size_t k = 0; k < count; k++) {
                coefficients[k] += run->surfaces[i][k] / (double)run->n;
            }
        }
        return SRNF_OK;
    }
    values = srnf_alloc(3 * run->points, sizeof(double));
    workspace = srnf_alloc(1, srnf_sht_workspace_size(run->sht, 3));
    status = SRNF_ENOMEM;
    if (values && workspace) {
        struct mean_run copy = *run;

        status =
            stats_run(run->context, run->n, place_values, &copy, (struct stats_progress){0}, error);
    }
    if (status == SRNF_OK) {
        stats_average(run->grid, run->n, run->gamma, values);
        srnf_sht_analysis(run->sht, 3, values, coefficients, workspace);
    }
    srnf_free(values);
    srnf_free(workspace);
    return status;
}

static int invert(const struct mean_run *run, struct srnf_mean *mean, struct srnf_error *error)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion = {0};
    struct srnf_context quiet = run->context ? *run->context : (struct srnf_context){0};
    double *start =
        srnf_alloc(3 * srnf_coefficient_count(srnf_sht_degree(run->sht)), sizeof(double));
    int status = start ? blend(run, start, error) : SRNF_ENOMEM;

    if (status) {
        goto out;
    }
    srnf_report_progress(run->context, PROGRESS_LOOP, "inverting the mean");
    quiet.progress = NULL;
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = start;
    options.certify = false;
    status = srnf_invert(run->sht, run->mean_q, &options, &quiet, &inversion, error);
    if (status >= 0) { /* a mean that is no SRNF has no exact inverse: that is no failure */
        mean->coefficients = inversion.coefficients;
        inversion.coefficients = NULL;
        mean->relative_energy = inversion.relative_energy;
        srnf_inversion_clear(&inversion);
        status = SRNF_OK;
    }
out:
    srnf_free(start);
    return status;
}

/* Distances, and the arrays of the run as those of the result. */
static int hand_over(struct mean_run *run, struct srnf_mean *mean)
{
    mean->distances = srnf_alloc(run->n, sizeof(double));
    if (!mean->distances) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < run->n; i++) {
        mean->distances[i] =
            sqrt(stats_distance2(run->grid, run->q + i * 3 * run->points, run->mean_q));
    }
    mean->n = run->n;
    mean->iterations = run->iterations;
    mean->mean_q = run->mean_q;
    mean->registered_q = run->q;
    mean->history = run->history;
    run->mean_q = run->q = NULL;
    run->history = NULL;
    return SRNF_OK;
}

int stats_mean(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
               const struct srnf_mean_options *options, size_t start,
               const struct srnf_context *context, struct srnf_mean *mean, struct srnf_error *error)
{
    struct srnf_mean_options defaults = srnf_mean_options_defaults();
    struct mean_run run = {.sht = sht,
                           .grid = srnf_sht_grid(sht),
                           .points = stats_points(srnf_sht_grid(sht)),
                           .context = context,
                           .n = n,
                           .surfaces = surfaces};
    struct srnf_error first = {0};
    int status;

    options = options ? options : &defaults;
    *mean = (struct srnf_mean){0};
    status = stats_check_surfaces(sht, n, surfaces, &first);
    status = status ? status : check_options(options, &first);
    status = status ? status : create_run(&run, options);
    if (status) {
        goto out;
    }
    status = options->resume ? resume_run(&run, options, &first) : start_run(&run, start, &first);
    status = status ? status : iterate_all(&run, options, &first);
    status = status ? status : invert(&run, mean, &first);
    status = status ? status : hand_over(&run, mean);
    if (status == SRNF_OK) {
        mean->converged = mean->history[mean->iterations - 1].change <= options->tolerance;
        status = mean->converged ? SRNF_OK : SRNF_WNOT_CONVERGED;
    }
out:
    if (status < 0) {
        (void)stats_fail(error, status, &first);
        srnf_mean_clear(mean);
    }
    clear_run(&run);
    return status;
}

int srnf_karcher_mean(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                      const struct srnf_mean_options *options, const struct srnf_context *context,
                      struct srnf_mean *mean, struct srnf_error *error)
{
    return stats_mean(sht, n, surfaces, options, STATS_START_DEFAULT, context, mean, error);
}

void srnf_mean_clear(struct srnf_mean *mean)
{
    srnf_free(mean->coefficients);
    srnf_free(mean->mean_q);
    srnf_free(mean->registered_q);
    srnf_free(mean->distances);
    srnf_free(mean->history);
    *mean = (struct srnf_mean){0};
}
