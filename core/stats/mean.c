/*
 * mean.c - the Karcher mean of a group (the paper, Algorithm 2).
 *
 * Minimizes the objective G of mean.h over the mean mu, the value rotations O_i and the warps
 * gamma_i:
 *
 *   1. start: mu is the q of the medoid, the surface with the least sum of unregistered distances;
 *      in a common pose, and where nothing is registered, the plain mean of all q
 *   2. every subject is registered to mu from nothing (mean_subject.c); mu <- the mean of the
 *      registered q, exactly evaluated on the grid, in the order of the subjects
 *   3. the penalties are measured from where they are least (mean_center.c)
 *   4. all warps take one Gauss-Newton step together, and mu follows (mean_step.c)
 *   5. again from 3, until mu changes by no more than the tolerance, relative to its norm
 *      (mean_change.c), or G has twice in a row fallen by less than that part of itself. Very
 *      different surfaces end the second way: their warps can be refined without end, each time
 *      for less
 *   6. mu is inverted once, from the average of the registered surfaces (mean_surface.c)
 *
 * G never rises. No inversion happens inside the loop: mu need not be the SRNF of any surface, and
 * how far it is from one is told as the relative energy of step 6. Where nothing is registered one
 * iteration is exact; where the domain is only rotated, step 2 is all there is.
 *
 * Between iterations the state is mu, the centre, and O_i and a chain for each subject: that is
 * what a checkpoint holds (mean_checkpoint.c). A resumed run ends with the same bits as one that
 * was never stopped, and so does a run on any number of threads.
 *
 * Memory, on a working grid of P nodes: 32 P bytes a subject for its warp, its chain, and 24 bytes
 * a node of the caller's grid for the field that is handed over. At the default degree, 12, P is
 * 4608 at least, and a subject takes 0.15 MB beside its chain of some 0.05. Tools, 1.2 MB a
 * subject, and .3 MB of what was evaluated, are kept up to options.keep_bytes, and made anew for
 * each use beyond: the same bits. With options.scratch warps and chains are in memory up to
 * options.held_bytes alone (mean_spill.c).
 */
#include "mean.h"

#include <math.h>
#include <string.h>

#define TOLERANCE 1e-3
#define MAX_ITERATIONS 20
#define MAX_ITERATIONS_ALLOWED 10000
#define KEEP_BYTES ((size_t)256 << 20)
#define HELD_BYTES ((size_t)128 << 20)
#define MEDOID_AMONG ((size_t)500) /* members, of larger groups: n^2 distances */
/* Progress: each iteration is expected to be this part of what is left, the inversion the rest. */
#define PROGRESS_PART 0.4

struct srnf_mean_options srnf_mean_options_defaults(void)
{
    return (struct srnf_mean_options){.tolerance = TOLERANCE,
                                      .max_iterations = MAX_ITERATIONS,
                                      .keep_bytes = KEEP_BYTES,
                                      .held_bytes = HELD_BYTES};
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
    if (options->registration &&
        options->registration->representation != SRNF_REPRESENTATION_SRNF) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "representation of the registration is not the SRNF, whose mean this is");
    }
    return SRNF_OK;
}

static void clear_run(struct mean_run *run)
{
    for (size_t i = 0; run->subjects && i < run->n; i++) {
        mean_subject_clear(&run->subjects[i]);
    }
    srnf_warp_clear(&run->centring);
    srnf_free(run->center);
    srnf_free(run->area);
    srnf_free(run->reference);
    srnf_free(run->nodes);
    srnf_free(run->weight);
    srnf_free(run->mean_q);
    srnf_free(run->previous);
    srnf_free(run->target);
    srnf_free(run->subjects);
    srnf_free(run->q);
    mean_spill_clear(run);
    tabulated_target_clear(&run->aim);
    mean_places_clear(run);
    srnf_free(run->history);
    srnf_free(run->average);
    srnf_free(run->potentials);
    srnf_free(run->taken);
    srnf_free(run->marks);
    srnf_free(run->centred);
    srnf_free(run->old_centred);
    srnf_sht_destroy(run->analysis);
    srnf_sht_destroy(run->view);
    srnf_sht_destroy(run->own);
}

/* The working grid: that of the caller, unless it is too coarse for the fields. */
static int create_grid(struct mean_run *run)
{
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    size_t rows = run->registered ? registration_rows(run->degree) : 0;
    int status = SRNF_OK;

    run->work = run->sht;
    if (mean_is_warped(run) && (grid->n_theta < rows || grid->n_phi < 2 * rows)) {
        status = srnf_sht_create(&run->own, srnf_sht_degree(run->sht), SRNF_GRID_GAUSS_LEGENDRE,
                                 rows, 2 * rows);
        run->work = run->own;
    }
    if (status == SRNF_OK) {
        run->grid = srnf_sht_grid(run->work);
        run->points = stats_points(run->grid);
        run->padded = (run->points + SRNF_LANES - 1) / SRNF_LANES * SRNF_LANES;
    }
    return status;
}

/* What registration needs beside the fields. */
static int create_warps(struct mean_run *run, const struct srnf_mean_options *options,
                        struct srnf_error *error)
{
    int status = mean_spill_create(run, options);

    status = status ? status : mean_places_create(run);
    run->center = srnf_alloc(3 * run->points, sizeof(double));
    run->area = srnf_alloc(run->padded, sizeof(double));
    run->reference = srnf_alloc(3 * run->points, sizeof(double));
    run->average = srnf_alloc(3 * run->points, sizeof(double));
    if (status || !run->center || !run->area || !run->reference || !run->average) {
        return SRNF_ENOMEM;
    }
    if (mean_is_warped(run)) {
        size_t size = 2 * srnf_coefficient_count(run->degree) * sizeof(double);

        run->potentials = srnf_alloc(run->n, size);
        run->taken = srnf_alloc(run->n, size);
        if (!run->potentials || !run->taken) {
            return SRNF_ENOMEM;
        }
    }
    if (mean_is_warped(run)) {
        status = mean_change_create(run);
    }
    return status ? status : mean_place_center(run, error);
}

static int create_run(struct mean_run *run, const struct srnf_mean_options *options,
                      struct srnf_error *error)
{
    size_t all;
    int status = SRNF_OK;

    if (options->registration) {
        run->registered = true;
        run->registration = *options->registration;
        run->registration.symmetric = false; /* the mean is a field, not a surface */
        run->degree = run->registration.degree;
        status = registration_check(&run->registration, error);
    }
    run->landmarks = options->landmarks;
    status = status ? status : mean_landmarks_create(run, error);
    status = status ? status : create_grid(run);
    if (status) {
        return status;
    }
    if (__builtin_mul_overflow(run->n, 3 * run->points, &all)) {
        return SRNF_ENOMEM;
    }
    run->history_capacity = options->max_iterations;
    run->nodes = srnf_alloc(3 * run->points, sizeof(double));
    run->weight = srnf_alloc(run->points, sizeof(double));
    run->mean_q = srnf_alloc(3 * run->points, sizeof(double));
    run->previous = srnf_alloc(3 * run->points, sizeof(double));
    run->target = srnf_alloc(3 * run->points, sizeof(double));
    run->subjects = srnf_alloc(run->n, sizeof *run->subjects);
    run->q = run->registered ? NULL : srnf_alloc(all, sizeof(double));
    run->history = srnf_alloc(run->history_capacity, sizeof *run->history);
    if (!run->nodes || !run->weight || !run->mean_q || !run->previous || !run->target ||
        !run->subjects || (!run->registered && !run->q) || !run->history) {
        return SRNF_ENOMEM;
    }
    mean_tools_decide(run, options->keep_bytes);
    registration_nodes(run->grid, run->nodes, run->weight);
    return run->registered ? create_warps(run, options, error) : SRNF_OK;
}

/* ---- The mean and the objective -------------------------------------------------------------- */

static void set_target(struct mean_run *run)
{
    for (size_t k = 0; k < run->points; k++) {
        for (size_t c = 0; c < 3; c++) {
            run->target[3 * k + c] = run->mean_q[c * run->points + k];
        }
    }
}

double mean_variance_about(const struct mean_run *run, const double *average)
{
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        sum += run->subjects[i].at.energy / (double)run->n;
    }
    /* fmax would hide what is no number */
    sum = run->norm2 * sum - stats_distance2(run->grid, average, run->mean_q);
    return sum < 0.0 ? 0.0 : sum;
}

void mean_adopt(struct mean_run *run, double variance)
{
    memcpy(run->mean_q, run->average, 3 * run->points * sizeof(double));
    run->variance = variance;
    set_target(run);
}

double mean_objective(const struct mean_run *run, double variance)
{
    double penalties = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        penalties += (run->subjects[i].at.penalty + run->subjects[i].at.apart) / (double)run->n;
    }
    return variance / run->norm2 + penalties;
}

double mean_measured(const struct mean_run *run)
{
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        const struct mean_stand *at = &run->subjects[i].at;

        sum += (at->energy + at->penalty + at->apart) / (double)run->n;
    }
    return sum;
}

/* ---- Nothing registered ---------------------------------------------------------------------- */

/* The mean of all as they are parameterized, and the variance. */
static void average_plain(struct mean_run *run)
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

static int start_run(struct mean_run *run, size_t start, struct srnf_error *error)
{
    int status = SRNF_OK;

    if (!run->registered && start == STATS_START_DEFAULT) {
        average_plain(run);
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

static int prepare_one(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_prepare(argument, i);
}

static int replay_one(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_replay(argument, i);
}

static int resume_run(struct mean_run *run, const struct srnf_mean_options *options,
                      struct srnf_error *error)
{
    int status = mean_checkpoint_read(run, options->resume, options->resume_size, error);

    if (status || !run->started) {
        return status;
    }
    run->variance = run->history[run->iterations - 1].variance;
    set_target(run);
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

/* ---- Iterations ------------------------------------------------------------------------------ */

static int register_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct mean_run *run = argument;
    int status = mean_register(run, i, context, error);

    status = status ? status : mean_replay(run, i);
    return status ? status : mean_measure(run, i, field, NULL);
}

/* The part of the progress that the coming iteration has. */
static struct stats_progress progress_of(const struct mean_run *run)
{
    double left = 1.0;

    for (size_t k = 0; k < run->iterations; k++) {
        left *= 1.0 - PROGRESS_PART;
    }
    return (struct stats_progress){MEAN_PROGRESS_LOOP * (1.0 - left),
                                   MEAN_PROGRESS_LOOP * (1.0 - left * (1.0 - PROGRESS_PART)),
                                   "registering to the mean"};
}

/* Of one that was registered elsewhere. */
static int lay_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                   struct srnf_error *error)
{
    const struct mean_run *run = argument;
    int status = mean_replay(run, i);

    (void)context;
    (void)error;
    return status ? status : mean_measure(run, i, field, NULL);
}

/* A search on other machines, and the first surface that cannot meet its landmarks. */
struct elsewhere {
    struct mean_run *run;
    size_t failed; /* SIZE_MAX: none */
    struct srnf_error why;
};

static int take_one(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    const struct elsewhere *elsewhere = argument;

    return mean_take_registered(elsewhere->run, i, rotation, warp);
}

static void landmarks_of_one(void *argument, size_t i, struct srnf_landmarks *landmarks)
{
    const struct elsewhere *elsewhere = argument;

    *landmarks = mean_landmarks_of(elsewhere->run, i);
}

/* The others go on: which fails does not depend on who comes first. */
static int unmet_one(void *argument, size_t i, const struct srnf_error *why)
{
    struct elsewhere *elsewhere = argument;

    if (i < elsewhere->failed) {
        elsewhere->failed = i;
        elsewhere->why = *why;
    }
    return SRNF_OK;
}

/* All to the mean from nothing where the caller has other machines for it (srnf_context.search), or
   SRNF_SEARCH_HERE. */
static int register_elsewhere(struct mean_run *run, struct stats_progress progress,
                              struct srnf_error *error)
{
    const struct srnf_context *context = run->context;
    struct elsewhere elsewhere = {.run = run, .failed = SIZE_MAX};
    const struct srnf_field_search search = {.sht = run->work,
                                             .field = run->mean_q,
                                             .norm2 = run->norm2,
                                             .options = &run->registration,
                                             .n = run->n,
                                             .surfaces = run->surfaces,
                                             .from = progress.from,
                                             .to = progress.to,
                                             .take = take_one,
                                             .landmarks =
                                                 mean_is_guided(run) ? landmarks_of_one : NULL,
                                             .unmet = unmet_one,
                                             .argument = &elsewhere};
    int status = context && context->search ? context->search(context->user, &search, error)
                                            : SRNF_SEARCH_HERE;

    return status == SRNF_OK && elsewhere.failed != SIZE_MAX
               ? mean_register_failed(elsewhere.failed, elsewhere.why.status, &elsewhere.why, error)
               : status;
}

/* All to the mean from nothing, and the mean after it. */
static int register_all(struct mean_run *run, struct srnf_error *error)
{
    struct stats_progress progress = progress_of(run);
    mean_body *body = lay_one;
    int status;

    set_target(run);
    status = mean_aim(run);
    status = status ? status : register_elsewhere(run, progress, error);
    if (status == SRNF_SEARCH_HERE) {
        body = register_one;
        status = SRNF_OK;
    } else {
        progress.message = NULL; /* all of it is told */
    }
    if (status) {
        return status;
    }
    status = mean_average_of(run, body, run, run->points, progress, run->average, error);
    run->started = status == SRNF_OK;
    if (status == SRNF_OK) {
        mean_adopt(run, mean_variance_about(run, run->average));
    }
    return status;
}

static int move_all(struct mean_run *run, struct srnf_error *error)
{
    double moved;
    int status;

    if (!run->registered) {
        average_plain(run);
        return mean_landmarks_follow(run, false, error);
    }
    if (!mean_is_warped(run)) {
        status = register_all(run, error);
        return status ? status : mean_landmarks_follow(run, false, error);
    }
    status = run->started ? mean_descend(run, progress_of(run), error) : register_all(run, error);
    status = status ? status : mean_landmarks_follow(run, false, error);
    return status ? status : mean_center(run, &moved, error);
}

/* One iteration, and the change of the mean in it. */
static int iterate_once(struct mean_run *run, double *change, struct srnf_error *error)
{
    double *swap = run->old_centred;
    double square;
    int status;

    memcpy(run->previous, run->mean_q, 3 * run->points * sizeof(double));
    status = move_all(run, error);
    if (status == SRNF_OK && mean_is_warped(run)) {
        run->old_centred = run->centred;
        run->centred = swap;
        status = mean_view(run, error);
        *change = mean_change(run);
        return status;
    }
    square = srnf_inner_product(run->grid, run->mean_q, run->mean_q);
    *change =
        square > 0.0 ? sqrt(stats_distance2(run->grid, run->mean_q, run->previous) / square) : 0.0;
    return status;
}

/* One iteration, and its entry in the history. */
static int iterate(struct mean_run *run, double seconds, struct srnf_error *error)
{
    struct srnf_mean_iteration *entry = &run->history[run->iterations];
    int status = iterate_once(run, &entry->change, error);

    if (status) {
        return status;
    }
    entry->variance = run->variance;
    entry->objective = run->norm2 > 0.0 ? mean_objective(run, run->variance) : 0.0;
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

/* Whether G has hardly fallen from one iteration to the next. */
static bool is_flat(const struct mean_run *run, size_t k, double tolerance)
{
    double before = run->history[k - 1].objective;

    return before - run->history[k].objective < tolerance * before;
}

static bool is_converged(const struct mean_run *run, double tolerance)
{
    size_t last = run->iterations - 1;

    if (run->iterations == 0) {
        return false;
    }
    return run->history[last].change <= tolerance ||
           (mean_is_warped(run) && last >= 2 && is_flat(run, last, tolerance) &&
            is_flat(run, last - 1, tolerance));
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
            if (run->registered && run->iterations == 1 && options->checkpoint) {
                stats_keep(run->context, run->series, 0, 0, NULL); /* the checkpoint has them */
            }
            status = tell_checkpoint(run, options);
        }
        if (status == SRNF_OK && srnf_is_canceled(run->context)) {
            status = SRNF_ECANCELED;
        }
    }
    return status;
}

int stats_mean(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
               const struct srnf_mean_options *options, size_t start,
               const struct srnf_context *context, struct srnf_mean *mean, struct srnf_error *error)
{
    struct srnf_mean_options defaults = srnf_mean_options_defaults();
    struct mean_run run = {.sht = sht, .context = context, .n = n, .surfaces = surfaces};
    struct srnf_error first = {0};
    bool converged;
    int status;

    options = options ? options : &defaults;
    *mean = (struct srnf_mean){0};
    status = stats_check_surfaces(sht, n, surfaces, &first);
    status = status ? status : check_options(options, &first);
    status = status ? status : create_run(&run, options, &first);
    if (status == SRNF_OK) {
        status = run.registered ? find_fields(&run, &first) : find_plain(&run, &first);
    }
    status = status || !run.registered
                 ? status
                 : stats_run(context, n, prepare_one, &run, (struct stats_progress){0}, &first);
    if (status) {
        goto out;
    }
    if (run.registered) {
        run.series = mean_series(&run, start);
    }
    status = options->resume ? resume_run(&run, options, &first) : start_run(&run, start, &first);
    if (status == SRNF_OK && mean_is_warped(&run)) {
        status = mean_view(&run, &first); /* what the first iteration changes */
    }
    status = status ? status : iterate_all(&run, options, &first);
    converged = is_converged(&run, options->tolerance);
    status = status ? status : mean_hand_over(&run, mean, &first);
    if (status == SRNF_OK) {
        mean->converged = converged;
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
    srnf_free(mean->landmarks);
    srnf_free(mean->landmark_points);
    *mean = (struct srnf_mean){0};
}
