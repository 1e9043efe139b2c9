/*
 * parts.c - joint components of several structures (srnf/parts.h), from surfaces to surfaces.
 *
 * Each part has its own mean, to which its surfaces are registered; a component has one score of a
 * subject and a mode of each part. Surfaces along it are inverted from the means.
 */
#include "compute/parts.h"

#include <math.h>

#define SHARE_MEANS 80.0 /* percent of what encoding leaves */

void compute_parts_clear(struct compute_parts_outputs *o)
{
    for (size_t p = 0; o->means && p < o->n_parts; p++) {
        o->means[p].group = (struct compute_group){.n = 0};
        compute_mean_clear(&o->means[p]);
    }
    srnf_free(o->means);
    srnf_free(o->parts);
    srnf_free(o->coefficients);
    srnf_free(o->relative_energy);
    srnf_free(o->mode_measures);
    srnf_joint_pca_clear(&o->joint);
    srnf_joint_model_clear(&o->kept);
    compute_group_clear(&o->group);
    *o = (struct compute_parts_outputs){.n_parts = 0};
}

/* Members [from, from + n). */
static struct compute_group view_of(const struct compute_group *group, size_t from, size_t n)
{
    return (struct compute_group){
        .n = n,
        .degree = group->degree,
        .coefficients = group->coefficients + from * 3 * srnf_coefficient_count(group->degree),
        .surfaces = group->surfaces + from,
        .scales = group->scales + from,
        .origins = group->origins + from,
        .bridged = group->bridged + from,
        .contents = group->contents + from,
        .ids = group->ids + from,
    };
}

static int find_means(struct jobs_run *run, const struct compute_parts_inputs *inputs,
                      struct compute_parts_outputs *o, struct jobs_result *result)
{
    const struct compute_mean_inputs more = {
        .registration = inputs->registration,
        .tolerance = inputs->tolerance,
        .max_iterations = inputs->max_iterations,
        .share = SHARE_MEANS / (double)inputs->n_parts,
        .one_of_many = inputs->n_parts > 1,
    };
    int status = 0;

    for (size_t p = 0; p < o->n_parts && status == 0; p++) {
        const struct srnf_mean *mean = &o->means[p].mean;

        o->means[p].group = view_of(&o->group, p * inputs->n, inputs->n);
        status = compute_mean(run, &more, &o->means[p], result);
        o->parts[p] = (struct srnf_part){mean->mean_q, mean->registered_q, inputs->weights[p]};
    }
    return status;
}

/* ---- Surfaces along the components ----------------------------------------------------------- */

struct inverting {
    const struct srnf_sht *sht;
    const struct compute_parts_inputs *inputs;
    struct compute_parts_outputs *out;
    struct srnf_context context; /* the run's, without its progress */
    int *status;
    struct srnf_error *errors;
};

static int invert(const struct inverting *work, size_t index, struct srnf_error *error)
{
    struct compute_parts_outputs *o = work->out;
    size_t part = index % o->n_parts, mode = index / o->n_parts / 2;
    double sign = index / o->n_parts % 2 ? 1.0 : -1.0;
    size_t count = 3 * srnf_coefficient_count(o->group.degree);
    const struct srnf_grid *grid = srnf_sht_grid(work->sht);
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion = {0};
    double *q = srnf_alloc(3 * grid->n_theta * grid->n_phi, sizeof(double));
    double *scores = srnf_alloc(o->joint.components, sizeof(double));
    int status = SRNF_ENOMEM;

    if (q && scores) {
        scores[mode] = sign * work->inputs->deviations * sqrt(o->joint.eigenvalues[mode]);
        srnf_joint_pca_reconstruct(grid, &o->joint, o->parts, scores, part, q);
        options.initial = SRNF_INITIAL_SURFACE;
        options.surface = o->means[part].mean.coefficients;
        options.certify = false;
        status = srnf_invert(work->sht, q, &options, &work->context, &inversion, error);
    }
    if (status >= 0) {
        for (size_t i = 0; i < count; i++) {
            o->coefficients[index * count + i] = inversion.coefficients[i];
        }
        o->relative_energy[index] = inversion.relative_energy;
        status = SRNF_OK;
    }
    srnf_inversion_clear(&inversion);
    srnf_free(scores);
    srnf_free(q);
    return status;
}

static void invert_one(void *argument, size_t index)
{
    struct inverting *work = argument;

    work->status[index] = invert(work, index, &work->errors[index]);
}

static int invert_all(struct inverting *work, struct jobs_run *run, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    size_t n = 2 * work->out->modes * work->out->n_parts;

    context->parallel_for(context->user, n, invert_one, work);
    for (size_t i = 0; i < n; i++) {
        if (work->status[i]) {
            return compute_fail(result, work->status[i], &work->errors[i], "inverting a mode");
        }
    }
    return 0;
}

static int find_surfaces(struct jobs_run *run, const struct srnf_sht *sht,
                         const struct compute_parts_inputs *inputs, struct compute_parts_outputs *o,
                         struct jobs_result *result)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    size_t n, count = 3 * srnf_coefficient_count(o->group.degree);
    struct inverting work = {sht, inputs, o, *jobs_run_context(run), NULL, NULL};
    int status = 0;

    o->modes = inputs->modes < o->joint.components ? inputs->modes : o->joint.components;
    n = 2 * o->modes * o->n_parts;
    if (n == 0) {
        return 0;
    }
    work.context.progress = NULL;
    work.status = srnf_alloc(n, sizeof *work.status);
    work.errors = srnf_alloc(n, sizeof *work.errors);
    o->coefficients = srnf_alloc(n, count * sizeof(double));
    o->relative_energy = srnf_alloc(n, sizeof(double));
    o->mode_measures = srnf_alloc(n, sizeof *o->mode_measures);
    if (work.status && work.errors && o->coefficients && o->relative_energy && o->mode_measures) {
        status = invert_all(&work, run, result);
    } else {
        status = compute_fail(result, SRNF_ENOMEM, NULL, "inverting the modes");
    }
    if (status == 0) {
        status =
            compute_measure(run, o->group.degree, n, o->coefficients, o->mode_measures, result);
    }
    for (size_t i = 0; i < n && status == 0; i++) {
        srnf_surface_move(o->group.degree, o->coefficients + i * count, &o->mode_measures[i],
                          origin);
    }
    srnf_free(work.status);
    srnf_free(work.errors);
    return status;
}

/* ---- All of it ------------------------------------------------------------------------------- */

static int fit(struct jobs_run *run, const struct srnf_sht *sht,
               const struct compute_parts_inputs *inputs, struct compute_parts_outputs *o,
               struct jobs_result *result)
{
    int status;

    jobs_run_phase(run, 100.0);
    status = srnf_joint_pca_fit(srnf_sht_grid(sht), inputs->n, o->n_parts, o->parts,
                                inputs->positions, inputs->position_weight, inputs->components,
                                jobs_run_context(run), &o->joint);
    if (status == 0 && o->joint.components == 0) {
        return compute_fail_alike(result, "subjects");
    }
    if (status == 0) {
        struct srnf_context quiet = *jobs_run_context(run);

        quiet.progress = NULL;
        status = srnf_joint_model_make(srnf_sht_grid(sht), &o->joint, o->parts, inputs->positions,
                                       inputs->position_weight, &quiet, &o->kept);
    }
    return status < 0 ? compute_fail(result, status, NULL, "fitting the joint components") : 0;
}

int compute_parts(struct jobs_run *run, const struct compute_parts_inputs *inputs,
                  struct compute_parts_outputs *o, struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    int status =
        jobs_transform_acquire(jobs, o->group.degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    o->n_parts = inputs->n_parts;
    o->means = srnf_alloc(o->n_parts, sizeof *o->means);
    o->parts = srnf_alloc(o->n_parts, sizeof *o->parts);
    status = o->means && o->parts ? find_means(run, inputs, o, result)
                                  : compute_fail(result, SRNF_ENOMEM, NULL, "computing the means");
    status = status ? status : fit(run, sht, inputs, o, result);
    status = status ? status : find_surfaces(run, sht, inputs, o, result);
    jobs_transform_release(jobs, sht);
    return status;
}
