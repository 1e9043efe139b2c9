/*
 * mean.c - the Karcher mean of a group (the paper, Algorithm 2).
 *
 * Minimizes the objective G of mean.h over the mean mu, the value rotations O_i and the warps
 * gamma_i:
 *
 *   1. start (mean_start.c): mu is the q of the medoid, the surface with the least sum of
 *      unregistered distances; in a common pose, and where nothing is registered, the plain mean of
 *      all q
 *   2. every subject is registered to mu from nothing (mean_register.c); mu <- the mean of the
 *      registered q, exactly evaluated on the grid, in the order of the subjects
 *   3. the penalties are measured from where they are least (mean_center.c)
 *   4. the first time, every subject is looked at once more from nothing (mean_anew.c): those that
 *      lie better in another basin move there
 *   5. all warps take one Gauss-Newton step together, and mu follows (mean_step.c)
 *   6. again from 3, until mu changes by no more than the tolerance, relative to its norm
 *      (mean_change.c), or G has twice in a row fallen by less than that part of itself. Very
 *      different surfaces end the second way: their warps can be refined without end, each time
 *      for less
 *   7. if step 4 moved anybody, another look, and on from 5 if that moves anybody
 *   8. the surfaces of one subject are laid alike, where they lie otherwise on each other than on
 *      the mean (mean_visits.c); if any are, on from 5 to a second look at them
 *   9. mu is inverted once, from the average of the registered surfaces (mean_surface.c)
 *
 * G never rises where domains are warped, but by 8. No inversion happens inside the loop: mu need
 * not be the SRNF of any surface, and how far it is from one is told as the relative energy of step
 * 9. Where nothing is registered one iteration is exact; where the domain is only rotated, step 2
 * is all there is.
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

/* ---- Iterations ------------------------------------------------------------------------------ */

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

static int move_all(struct mean_run *run, struct srnf_error *error)
{
    int status;

    if (!run->registered) {
        mean_average_plain(run);
        return mean_landmarks_follow(run, false, error);
    }
    if (!mean_is_warped(run)) {
        status = mean_register_all(run, progress_of(run), error);
        return status ? status : mean_landmarks_follow(run, false, error);
    }
    status = run->started ? mean_descend(run, progress_of(run), error)
                          : mean_register_all(run, progress_of(run), error);
    status = status ? status : mean_landmarks_follow(run, false, error);
    return status ? status : mean_center(run, error);
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
        square == 0.0 ? 0.0 : sqrt(stats_distance2(run->grid, run->mean_q, run->previous) / square);
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

/* Since subjects were last moved elsewhere. */
static bool is_converged(const struct mean_run *run, double tolerance)
{
    size_t last = run->iterations - 1;

    if (run->iterations <= run->anew) {
        return false;
    }
    return run->history[last].change <= tolerance ||
           (mean_is_warped(run) && last >= run->anew + 2 && is_flat(run, last, tolerance) &&
            is_flat(run, last - 1, tolerance));
}

/* Whether another iteration is due; subjects are looked at before where that is, and visits laid
   alike in the end. */
static int goes_on(struct mean_run *run, const struct srnf_mean_options *options, bool *on,
                   struct srnf_error *error)
{
    bool more = run->iterations < options->max_iterations;
    bool rests = is_converged(run, options->tolerance);
    bool moved = false;
    int status = SRNF_OK;

    if ((more || rests) && mean_looks_anew(run, rests)) {
        status = mean_look_anew(run, progress_of(run), &moved, error);
    }
    *on = more && (moved || !rests);
    if (status == SRNF_OK && !*on && mean_has_visits(run)) {
        status = mean_join_visits(run, progress_of(run), &moved, error);
        *on = moved && more;
    }
    return status;
}

static int iterate_all(struct mean_run *run, const struct srnf_mean_options *options,
                       struct srnf_error *error)
{
    double start = srnf_seconds(run->context);
    double before = run->iterations > 0 ? run->history[run->iterations - 1].seconds : 0.0;
    bool on;
    int status = goes_on(run, options, &on, error);

    while (status == SRNF_OK && on) {
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
        status = status ? status : goes_on(run, options, &on, error);
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
    status = status ? status : mean_run_create(&run, options, &first);
    status = status ? status : mean_begin(&run, &first);
    if (status) {
        goto out;
    }
    if (run.registered) {
        run.series = mean_series(&run, start);
    }
    status = options->resume ? mean_resume(&run, options, &first) : mean_start(&run, start, &first);
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
    mean_run_clear(&run);
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
    srnf_free(mean->apart);
    *mean = (struct srnf_mean){0};
}
