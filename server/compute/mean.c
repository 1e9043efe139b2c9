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

#include <stdlib.h>
#include <string.h>

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
    options.tolerance = inputs->tolerance;
    options.max_iterations = inputs->max_iterations;
    options.checkpoint = keep_checkpoint;
    options.checkpoint_user = run;
    if (jobs_run_checkpoint_load(run, &bytes, &size) == STORE_OK) {
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

/* Registers every member to the mean surface, in its place. */
static int register_members(const struct srnf_sht *sht, const struct compute_mean_inputs *inputs,
                            const struct srnf_context *context,
                            struct compute_mean_outputs *outputs, struct srnf_error *error)
{
    struct compute_group *group = &outputs->group;
    size_t count = 3 * srnf_coefficient_count(group->degree);

    for (size_t i = 0; i < group->n; i++) {
        struct srnf_registration registration;
        int status = srnf_register(sht, outputs->mean.coefficients, NULL, group->surfaces[i],
                                   inputs->registration, NULL, context, &registration, error);

        if (status < 0) {
            return status;
        }
        memcpy(group->coefficients + i * count, registration.coefficients, count * sizeof(double));
        srnf_registration_clear(&registration);
    }
    return 0;
}

/* How far the surface's SRNF is from the mean SRNF, relative to that. */
static int measure_loss(const struct srnf_sht *sht, struct srnf_mean *mean)
{
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    mean->relative_energy = srnf_energy(sht, mean->coefficients, mean->mean_q, NULL, workspace) /
                            srnf_inner_product(srnf_sht_grid(sht), mean->mean_q, mean->mean_q);
    srnf_free(workspace);
    return 0;
}

/* The mean in the pulled-back metric takes the place of the other one. */
static int pull_back(struct jobs_run *run, const struct srnf_sht *sht,
                     const struct compute_mean_inputs *inputs, struct compute_mean_outputs *outputs,
                     struct srnf_error *error)
{
    struct srnf_pullback_mean_options options =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    const struct compute_group *group = &outputs->group;
    struct srnf_context quiet = *jobs_run_context(run);
    struct srnf_mean *mean = &outputs->mean;
    int status = 0;

    quiet.progress = NULL;
    jobs_run_phase(run, 100.0);
    if (inputs->registration) {
        status = register_members(sht, inputs, &quiet, outputs, error);
    }
    options.max_iterations = inputs->max_iterations;
    if (status == 0) {
        status = srnf_pullback_mean(sht, group->n, group->surfaces, &options, jobs_run_context(run),
                                    &outputs->pullback, error);
    }
    if (status < 0) {
        return status;
    }
    memcpy(mean->coefficients, outputs->pullback.coefficients,
           3 * srnf_coefficient_count(group->degree) * sizeof(double));
    memcpy(mean->distances, outputs->pullback.distances, group->n * sizeof(double));
    mean->converged = mean->converged && outputs->pullback.converged;
    return measure_loss(sht, mean);
}

/* What the components that are kept cannot represent of each surface. */
static int measure_residuals(const struct srnf_grid *grid, struct compute_mean_outputs *outputs)
{
    const struct srnf_mean *mean = &outputs->mean;
    size_t count = 3 * outputs->n_theta * outputs->n_phi;
    double *scores = srnf_alloc(outputs->pca.components, sizeof(double));
    int status;

    outputs->residuals = srnf_alloc(mean->n, sizeof(double));
    for (size_t i = 0; scores && outputs->residuals && i < mean->n; i++) {
        srnf_pca_project(grid, &outputs->pca, mean->mean_q, mean->registered_q + i * count, scores,
                         &outputs->residuals[i]);
    }
    status = scores && outputs->residuals ? 0 : SRNF_ENOMEM;
    srnf_free(scores);
    return status;
}

/* As many as there are subjects. */
static size_t count_subjects(size_t n, const struct compute_mean_inputs *inputs)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        size_t first = 0;

        while (inputs->subjects && inputs->subjects[first] != inputs->subjects[i]) {
            first++;
        }
        count += !inputs->subjects || first == i;
    }
    return count;
}

static int fit_components(struct jobs_run *run, const struct srnf_sht *sht,
                          const struct compute_mean_inputs *inputs,
                          struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_mean *mean = &outputs->mean;
    int status = srnf_pca_fit_within(srnf_sht_grid(sht), mean->n, mean->mean_q, mean->registered_q,
                                     inputs->components, jobs_run_context(run), &outputs->pca);

    if (status == 0 && outputs->pca.components == 0) {
        return compute_fail(result, SRNF_EDEGENERATE, NULL,
                            "principal components of surfaces that do not differ");
    }
    if (status >= 0) {
        status = measure_residuals(srnf_sht_grid(sht), outputs);
    }
    if (status >= 0 && count_subjects(mean->n, inputs) >= 3) {
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
        count_subjects(mean->n, inputs) < 2) {
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

    outputs->pairs = srnf_alloc(mean->n, mean->n * sizeof(double));
    if (outputs->pairs) {
        status = srnf_twins_distances(grid, mean->n, mean->registered_q, outputs->pairs);
    }
    return status ? compute_fail(result, status, NULL, "comparing the members") : 0;
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
        status = pull_back(run, sht, inputs, outputs, &error);
    }
    if (status < 0) {
        (void)compute_fail(result, status, &error, "computing the mean");
        goto out;
    }
    status = measure_angles(srnf_sht_grid(sht), inputs, outputs, result);
    if (status == 0) {
        status = measure_pairs(srnf_sht_grid(sht), outputs, result);
    }
    if (status == 0 && inputs->fit) {
        status = fit_components(run, sht, inputs, outputs, result);
    }
    if (status == 0) {
        status = compute_measure(run, outputs->group.degree, 1, mean->coefficients,
                                 &outputs->measures, result);
    }
    if (status == 0) {
        compute_move(outputs->group.degree, mean->coefficients, &outputs->measures, origin);
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
    int status;

    jobs_run_phase(run, inputs->share > 0.0 ? inputs->share : share_of_mean(inputs));
    status = analyse(run, inputs, outputs, result);
    if (status) {
        compute_mean_clear(outputs);
    }
    return status;
}
