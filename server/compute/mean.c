/*
 * mean.c - means and principal components of a group.
 *
 * The mean tells after each iteration all that it needs to go on; the engine keeps that as the
 * job's checkpoint. A checkpoint that the core refuses (damaged, or of other surfaces) costs only
 * the work that it stood for: the mean then begins anew.
 *
 * An SRNF does not know translations: the mean surface is moved to its area centroid.
 */
#include "compute/mean.h"

#include "compute/searches.h"

#include <stdlib.h>

/* Percent that the mean SRNF takes before the pulled-back mean, registered or not. */
#define SHARE_FIRST_REGISTERED 50.0
#define SHARE_FIRST_PLAIN 2.0

void compute_mean_clear(struct compute_mean_outputs *outputs)
{
    compute_group_clear(&outputs->group);
    srnf_mean_clear(&outputs->mean);
    srnf_pullback_mean_clear(&outputs->pullback);
    srnf_pca_clear(&outputs->pca);
    srnf_calibration_clear(&outputs->calibration);
    srnf_free(outputs->residuals);
    srnf_free(outputs->angles);
    srnf_free(outputs->pairs);
    outputs->residuals = outputs->pairs = NULL;
    outputs->angles = NULL;
}

/* A checkpoint that cannot be kept is told in the log; the mean goes on. */
static void keep_checkpoint(void *user, const void *bytes, size_t size)
{
    (void)jobs_run_checkpoint_save(user, bytes, size);
}

/* The mean itself, from the checkpoint of an earlier attempt if there is one. */
static int iterate(struct jobs_run *run, const struct srnf_sht *sht,
                   const struct compute_mean_inputs *inputs, struct compute_mean_outputs *outputs,
                   struct srnf_error *error)
{
    const struct compute_group *group = &outputs->group;
    struct srnf_mean_options options = srnf_mean_options_defaults();
    unsigned char *bytes = NULL;
    size_t size = 0;
    int status;

    options.registration = inputs->registration;
    options.landmarks = inputs->landmarks;
    options.subjects = inputs->subjects;
    options.tolerance = inputs->tolerance;
    options.max_iterations = inputs->max_iterations;
    options.checkpoint = inputs->one_of_many ? NULL : keep_checkpoint;
    options.checkpoint_user = run;
    options.scratch = inputs->registration ? jobs_run_scratch(run) : NULL;
    options.held_bytes = jobs_cache_limit(jobs_run_jobs(run));
    jobs_run_keep_parts(run); /* the registrations of the first iteration */
    compute_searches_spread(run);
    if (!inputs->one_of_many && jobs_run_checkpoint_load(run, &bytes, &size) == STORE_OK) {
        options.resume = bytes;
        options.resume_size = size;
    }
    status = srnf_karcher_mean(sht, group->n, group->surfaces, &options, jobs_run_context(run),
                               &outputs->mean, error);
    if (status == SRNF_EINVAL && options.resume) {
        options.resume = NULL;
        options.resume_size = 0;
        status = srnf_karcher_mean(sht, group->n, group->surfaces, &options, jobs_run_context(run),
                                   &outputs->mean, error);
    }
    free(bytes);
    return status;
}

/* By the Gram matrix, or of a large group its largest components. */
static int fit_any(struct jobs_run *run, const struct srnf_sht *sht,
                   const struct compute_mean_inputs *inputs, struct compute_mean_outputs *outputs)
{
    const struct srnf_mean *mean = &outputs->mean;
    size_t most = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    size_t components = inputs->components < most ? inputs->components : most;
    double worst = 0.0;
    double *bounds;
    int status;

    if (mean->n <= COMPUTE_PAIRS_MAX) {
        return srnf_pca_fit_within(srnf_sht_grid(sht), mean->n, mean->mean_q, mean->registered_q,
                                   inputs->components, jobs_run_context(run), &outputs->pca);
    }
    bounds = srnf_alloc(components ? components : 1, sizeof(double));
    if (!bounds) {
        return SRNF_ENOMEM;
    }
    status = srnf_pca_fit_largest(srnf_sht_grid(sht), mean->n, mean->mean_q, mean->registered_q,
                                  components, jobs_run_context(run), &outputs->pca, bounds);
    for (size_t k = 0; status == 0 && k < components; k++) {
        worst = bounds[k] > worst ? bounds[k] : worst;
    }
    outputs->eigenvalue_bound = worst;
    srnf_free(bounds);
    return status;
}

static int fit_components(struct jobs_run *run, const struct srnf_sht *sht,
                          const struct compute_mean_inputs *inputs,
                          struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_mean *mean = &outputs->mean;
    int status = fit_any(run, sht, inputs, outputs);

    if (status == 0 && outputs->pca.components == 0) {
        return compute_fail_alike(result, "surfaces");
    }
    if (status >= 0) {
        outputs->residuals = srnf_alloc(mean->n, sizeof(double));
        status = outputs->residuals
                     ? srnf_pca_residuals(srnf_sht_grid(sht), &outputs->pca, mean->mean_q, mean->n,
                                          mean->registered_q, outputs->residuals)
                     : SRNF_ENOMEM;
    }
    if (status >= 0 && mean->n <= COMPUTE_PAIRS_MAX &&
        srnf_subject_count(mean->n, inputs->subjects) >= 3) {
        struct srnf_context quiet = *jobs_run_context(run);

        quiet.progress = NULL;
        status = srnf_calibrate(srnf_sht_grid(sht), &outputs->pca, mean->mean_q, mean->registered_q,
                                inputs->subjects, &quiet, &outputs->calibration);
    }
    return status < 0 ? compute_fail(result, status, NULL, "fitting the principal components") : 0;
}

/* Where nothing was rotated, how far each surface is turned against the others. */
static int measure_angles(const struct srnf_grid *grid, const struct compute_mean_inputs *inputs,
                          struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_mean *mean = &outputs->mean;
    int status;

    if ((inputs->registration && !inputs->registration->common_pose) ||
        srnf_subject_count(mean->n, inputs->subjects) < 2) {
        return 0;
    }
    outputs->angles = srnf_alloc(mean->n, sizeof(double));
    status = outputs->angles ? srnf_pose_angles(grid, mean->n, mean->registered_q, inputs->subjects,
                                                outputs->angles)
                             : SRNF_ENOMEM;
    return status < 0 ? compute_fail(result, status, NULL, "comparing poses") : 0;
}

static int measure_pairs(const struct srnf_grid *grid, struct compute_mean_outputs *outputs,
                         struct jobs_result *result)
{
    const struct srnf_mean *mean = &outputs->mean;
    int status = SRNF_ENOMEM;

    if (mean->n > COMPUTE_PAIRS_MAX) {
        return 0;
    }
    outputs->pairs = srnf_alloc(mean->n, mean->n * sizeof(double));
    if (outputs->pairs) {
        status = srnf_twins_distances(grid, mean->n, mean->registered_q, outputs->pairs);
    }
    return status ? compute_fail(result, status, NULL, "comparing the members") : 0;
}

static int compare(const struct srnf_grid *grid, const struct compute_mean_inputs *inputs,
                   struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    int status = measure_angles(grid, inputs, outputs, result);

    return status ? status : measure_pairs(grid, outputs, result);
}

/* Mean, and components where they are asked for, of the group that was loaded. */
static int analyse(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                   struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    struct srnf_mean *mean = &outputs->mean;
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status =
        jobs_transform_acquire(jobs, outputs->group.degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    outputs->n_theta = srnf_sht_grid(sht)->n_theta;
    outputs->n_phi = srnf_sht_grid(sht)->n_phi;
    status = iterate(run, sht, inputs, outputs, &error);
    if (status >= 0 && inputs->pullback) {
        struct srnf_pullback_mean_options options =
            srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);

        jobs_run_phase(run, 100.0);
        options.max_iterations = inputs->max_iterations;
        status = srnf_mean_pull_back(sht, outputs->group.n, outputs->group.coefficients,
                                     inputs->registration, &options, jobs_run_context(run), mean,
                                     &outputs->pullback, &error);
    }
    if (status < 0) {
        (void)compute_fail(result, status, &error, "computing the mean");
        goto out;
    }
    status = compare(srnf_sht_grid(sht), inputs, outputs, result);
    if (status == 0 && inputs->fit) {
        status = fit_components(run, sht, inputs, outputs, result);
    }
    if (status == 0) {
        status = compute_measure(run, outputs->group.degree, 1, mean->coefficients,
                                 &outputs->measures, result);
    }
    if (status == 0) {
        srnf_surface_move(outputs->group.degree, mean->coefficients, &outputs->measures, origin);
        outputs->seconds = mean->iterations ? mean->history[mean->iterations - 1].seconds : 0.0;
    }
out:
    jobs_transform_release(jobs, sht);
    return status;
}

/* Percent of the job that the mean SRNF takes, of what encoding leaves. */
static double share_of_mean(const struct compute_mean_inputs *inputs)
{
    if (!inputs->pullback) {
        return 100.0;
    }
    return inputs->registration ? SHARE_FIRST_REGISTERED : SHARE_FIRST_PLAIN;
}

int compute_mean(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                 struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    jobs_run_phase(run, inputs->share > 0.0 ? inputs->share : share_of_mean(inputs));
    return analyse(run, inputs, outputs, result);
}
