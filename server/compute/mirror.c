/*
 * mirror.c - trials with mirror images (srnf_surface_mirror), bounded in their number.
 *
 * They run without progress: they are few beside what the job is there for.
 */
#include "compute/mirror.h"

#include <string.h>

/* Of the surfaces that are registered rigidly to see whether a mirrored match is worth its time. Of
   the 36 pairs of a left and a right nucleus (bench_mirror) rigid distances at degree 8 are below
   0.8 of themselves, mirrored, for the 6 homologues (0.42 to 0.76) and for no other (0.82 and
   more); a pair costs 0.23 s, its registration at degree 15 0.6 s or, symmetric, 1.7 s. */
#define SCREEN_DEGREE ((size_t)8)

bool compute_mirror_better(const struct compute_mirror_trial *trial, bool opposite)
{
    double limit = opposite ? COMPUTE_MIRROR_CLEARLY : COMPUTE_MIRROR_UNTOLD;

    return trial->mirrored < limit * trial->distance;
}

void compute_mirror_columns(size_t rows, size_t columns, double *values)
{
    for (size_t row = 0; row < rows; row++) {
        double *of = values + row * columns;

        for (size_t j = 0; j < columns; j++) {
            size_t other = (columns / 2 + columns - j) % columns;
            double value = of[j];

            if (j < other) {
                of[j] = of[other];
                of[other] = value;
            }
        }
    }
}

/* The context of the run without its progress. */
static struct srnf_context quiet_context(struct jobs_run *run)
{
    struct srnf_context context = *jobs_run_context(run);

    context.progress = NULL;
    return context;
}

/* A copy that is mirrored; srnf_free. */
static double *mirror_image(size_t degree, const double *coefficients)
{
    size_t count = 3 * srnf_coefficient_count(degree);
    double *image = srnf_alloc(count, sizeof(double));

    if (image) {
        memcpy(image, coefficients, count * sizeof(double));
        srnf_surface_mirror(degree, image);
    }
    return image;
}

/* ---- Groups ---------------------------------------------------------------------------------- */

/* Keeps the nearest pairs, each once, in increasing order. */
static void add_trial(struct compute_handedness *handedness, struct compute_mirror_trial trial)
{
    struct compute_mirror_trial *trials = handedness->trials;
    size_t at = handedness->n_trials;

    for (size_t k = 0; k < handedness->n_trials; k++) {
        if (trials[k].first == trial.first && trials[k].second == trial.second) {
            return;
        }
    }
    if (at == COMPUTE_MIRROR_TRIALS_MAX) {
        if (!(trial.distance < trials[at - 1].distance)) {
            return;
        }
        at--;
    } else {
        handedness->n_trials++;
    }
    for (; at > 0 && trial.distance < trials[at - 1].distance; at--) {
        trials[at] = trials[at - 1];
    }
    trials[at] = trial;
}

/* The pairs to try, from the matrix. */
static void choose_pairs(size_t n, const double *matrix, struct compute_handedness *handedness)
{
    handedness->n_trials = 0;
    for (size_t i = 0; i < n; i++) {
        size_t nearest = n;

        for (size_t j = 0; j < n; j++) {
            if (handedness->opposite(handedness->user, i, j) &&
                (nearest == n || matrix[i * n + j] < matrix[i * n + nearest])) {
                nearest = j;
            }
        }
        if (nearest < n) {
            struct compute_mirror_trial trial = {.first = i < nearest ? i : nearest,
                                                 .second = i < nearest ? nearest : i,
                                                 .distance = matrix[i * n + nearest]};

            trial.mirrored = trial.distance;
            add_trial(handedness, trial);
        }
    }
}

int compute_mirror_group(struct jobs_run *run, const struct srnf_sht *sht, enum srnf_metric metric,
                         const struct compute_group *group,
                         const struct srnf_register_options *registration, const double *matrix,
                         struct compute_handedness *handedness, struct srnf_error *error)
{
    struct srnf_context context = quiet_context(run);
    int status = 0;

    handedness->unnamed = false;
    if (!handedness->opposite) {
        return 0;
    }
    handedness->registered = registration != NULL;
    if (group->n == 2 && registration && metric == SRNF_METRIC_SRNF &&
        !handedness->opposite(handedness->user, 0, 1)) {
        handedness->unnamed = true;
        handedness->n_trials = 1;
        return compute_mirror_pair(run, sht, group->surfaces[0], group->surfaces[1], registration,
                                   false, matrix[1], &handedness->trials[0], error);
    }
    choose_pairs(group->n, matrix, handedness);
    for (size_t k = 0; k < handedness->n_trials && status >= 0; k++) {
        struct compute_mirror_trial *trial = &handedness->trials[k];
        double *image = mirror_image(group->degree, group->surfaces[trial->second]);
        const double *pair[2] = {group->surfaces[trial->first], image};
        double distances[4];

        if (!image) {
            return SRNF_ENOMEM;
        }
        status =
            srnf_metric_distances(sht, metric, 2, pair, registration, &context, distances, error);
        if (status >= 0) {
            trial->mirrored = distances[1];
        }
        srnf_free(image);
    }
    return status;
}

/* ---- Pairs ----------------------------------------------------------------------------------- */

static int measure(const struct srnf_sht *sht, const double *fixed, const double *moving,
                   const struct srnf_register_options *options, const struct srnf_context *context,
                   double *distance, struct srnf_error *error)
{
    struct srnf_registration registration;
    int status =
        srnf_register(sht, fixed, NULL, moving, options, NULL, context, &registration, error);

    if (status >= 0) {
        *distance = registration.distance;
        srnf_registration_clear(&registration);
    }
    return status;
}

/* Rigid distances of the surfaces cut to a low degree, as they are and mirrored. */
static int screen(struct jobs_run *run, size_t degree, const double *fixed, const double *moving,
                  const struct srnf_register_options *registration, double distances[2],
                  struct srnf_error *error)
{
    struct srnf_context context = quiet_context(run);
    struct srnf_register_options options = *registration;
    size_t low = degree < SCREEN_DEGREE ? degree : SCREEN_DEGREE;
    size_t count = 3 * srnf_coefficient_count(low);
    const struct srnf_sht *sht = NULL;
    double *ends = srnf_alloc(count, 2 * sizeof(double));
    int status =
        ends ? jobs_transform_acquire(jobs_run_jobs(run), low, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht)
             : SRNF_ENOMEM;

    options.reparameterization = false;
    options.symmetric = false;
    options.exact = false;
    if (options.start == SRNF_START_TOURNAMENT) {
        options.start = SRNF_START_RIGID;
    }
    if (status == 0) {
        srnf_surface_change_degree(degree, fixed, low, ends);
        srnf_surface_change_degree(degree, moving, low, ends + count);
        for (size_t k = 0; k < 2 && status >= 0; k++) {
            status = measure(sht, ends, ends + count, &options, &context, &distances[k], error);
            srnf_surface_mirror(low, ends + count);
        }
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    srnf_free(ends);
    return status;
}

int compute_mirror_pair(struct jobs_run *run, const struct srnf_sht *sht, const double *fixed,
                        const double *moving, const struct srnf_register_options *registration,
                        bool opposite, double distance, struct compute_mirror_trial *trial,
                        struct srnf_error *error)
{
    struct srnf_context context = quiet_context(run);
    size_t degree = srnf_sht_degree(sht);
    double rigid[2] = {1.0, 0.0}, *image;
    int status = 0;

    *trial = (struct compute_mirror_trial){.second = 1, .distance = distance, .mirrored = distance};
    if (!opposite) {
        status = screen(run, degree, fixed, moving, registration, rigid, error);
    }
    if (status < 0 || !(rigid[1] < COMPUTE_MIRROR_UNTOLD * rigid[0])) {
        return status;
    }
    image = mirror_image(degree, moving);
    status = image ? measure(sht, fixed, image, registration, &context, &trial->mirrored, error)
                   : SRNF_ENOMEM;
    srnf_free(image);
    return status;
}
