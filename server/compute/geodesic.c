/*
 * geodesic.c - loads both ends, brings them to the larger degree and follows the path.
 *
 * The second end is registered to the first where that is asked for; its registered surface, cut to
 * the degree of the pair, is then the end of the path. ||q_t||^2 along the straight line q_t = (1 -
 * t) q_0 + t q_1 follows from the areas of the ends and their distance d: with <q_0, q_1> = (a_0 +
 * a_1 - d^2) / 2 it is (1 - t)^2 a_0 + t^2 a_1 + 2 t (1 - t) <q_0, q_1>.
 *
 * The geodesic of the pulled-back metric takes the place of the surfaces of the straight line
 * between the surfaces, for which the curves of energy are computed first.
 *
 * An SRNF does not know translations. The surfaces between the ends are placed so that their area
 * centroids move on the straight line between those of the ends; the ends stay bit for bit.
 */
#include "compute/geodesic.h"

#include <string.h>

/* Percent of the job: encoding a mesh, and registering one end to the other. */
#define SHARE_END 15.0
#define SHARE_REGISTRATION 50.0

void compute_geodesic_clear(struct compute_geodesic_outputs *outputs)
{
    compute_surface_clear(&outputs->ends[0]);
    compute_surface_clear(&outputs->ends[1]);
    srnf_registration_clear(&outputs->registration);
    srnf_geodesic_clear(&outputs->geodesic);
    srnf_pullback_geodesic_clear(&outputs->pullback);
    srnf_free(outputs->measures);
    srnf_free(outputs->squared_norm);
    outputs->measures = NULL;
    outputs->squared_norm = NULL;
}

static void fill_squared_norms(struct compute_geodesic_outputs *outputs)
{
    const struct srnf_geodesic *geodesic = &outputs->geodesic;
    double a0 = outputs->measures[0].area, a1 = outputs->measures[geodesic->steps - 1].area;
    double inner = 0.5 * (a0 + a1 - geodesic->distance * geodesic->distance);

    for (size_t i = 0; i < geodesic->steps; i++) {
        double t = geodesic->times[i], s = 1.0 - t;
        outputs->squared_norm[i] = s * s * a0 + t * t * a1 + 2.0 * s * t * inner;
    }
}

static void place(struct compute_geodesic_outputs *outputs)
{
    struct srnf_geodesic *geodesic = &outputs->geodesic;
    size_t count = 3 * srnf_coefficient_count(geodesic->degree), last = geodesic->steps - 1;

    for (size_t i = 1; i < last; i++) {
        double t = geodesic->times[i], target[3];
        for (size_t k = 0; k < 3; k++) {
            target[k] = (1.0 - t) * outputs->measures[0].centroid[k] +
                        t * outputs->measures[last].centroid[k];
        }
        compute_move(geodesic->degree, geodesic->coefficients + i * count, &outputs->measures[i],
                     target);
    }
}

/* Replaces the second of the padded ends by itself registered to the first. */
static int register_end(struct jobs_run *run, const struct compute_geodesic_inputs *inputs,
                        const struct srnf_sht *sht, double *padded, size_t count,
                        struct compute_geodesic_outputs *outputs, struct jobs_result *result)
{
    int status = compute_register_pair(run, sht, padded, padded + count, inputs->origins,
                                       inputs->registration, &outputs->registration,
                                       &outputs->bridged, result);
    struct srnf_error error = {0};

    if (status) {
        return status;
    }
    if (inputs->handedness) {
        status = compute_mirror_pair(run, sht, padded, padded + count, inputs->registration,
                                     inputs->opposite, outputs->registration.distance,
                                     &outputs->mirror, &error);
        if (status < 0) {
            return compute_fail(result, status, &error, "registering the mirror image");
        }
    }
    memcpy(padded + count, outputs->registration.coefficients, count * sizeof(double));
    return 0;
}

/* Squared distances of the surfaces of the path from the straight line in Q. */
static int measure_energies(const struct srnf_context *context, const struct srnf_sht *sht,
                            struct srnf_geodesic *geodesic)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t field = 3 * grid->n_theta * grid->n_phi;
    size_t count = 3 * srnf_coefficient_count(geodesic->degree), last = geodesic->steps - 1;
    double *q = srnf_alloc(3 * field, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));

    if (!q || !workspace) {
        srnf_free(q);
        srnf_free(workspace);
        return SRNF_ENOMEM;
    }
    srnf_field(sht, geodesic->coefficients, q, workspace);
    srnf_field(sht, geodesic->coefficients + last * count, q + field, workspace);
    for (size_t i = 0; i <= last && !context->canceled(context->user); i++) {
        double t = geodesic->times[i];
        for (size_t k = 0; k < field; k++) {
            q[2 * field + k] = (1.0 - t) * q[k] + t * q[field + k];
        }
        geodesic->energy_geodesic[i] =
            srnf_energy(sht, geodesic->coefficients + i * count, q + 2 * field, NULL, workspace);
    }
    srnf_free(q);
    srnf_free(workspace);
    return context->canceled(context->user) ? SRNF_ECANCELED : 0;
}

/* The geodesic of the pulled-back metric; a path that was not straight in time is a result too. */
static int follow_pullback(struct jobs_run *run, const struct srnf_sht *sht, const double *from,
                           const double *to, const struct compute_geodesic_inputs *inputs,
                           struct compute_geodesic_outputs *outputs, struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_geodesic_options line = inputs->options;
    struct srnf_geodesic *geodesic = &outputs->geodesic;
    struct srnf_pullback_geodesic *pullback = &outputs->pullback;
    struct srnf_context quiet = *jobs_run_context(run);
    double *straight;
    int status;

    options.segments = inputs->options.steps - 1;
    line.method = SRNF_GEODESIC_LINEAR;
    quiet.progress = NULL;
    status = srnf_geodesic(sht, from, to, &line, &quiet, geodesic, error);
    if (status >= 0) {
        status =
            srnf_pullback_geodesic(sht, from, to, &options, jobs_run_context(run), pullback, error);
    }
    if (status < 0) {
        return status;
    }
    straight = geodesic->coefficients;
    geodesic->coefficients = pullback->coefficients;
    pullback->coefficients = straight;
    geodesic->length = pullback->path.length;
    geodesic->transforms += pullback->transforms;
    return measure_energies(&quiet, sht, geodesic);
}

/* The path itself, between ends already loaded. */
static int follow(struct jobs_run *run, const struct compute_geodesic_inputs *inputs,
                  struct compute_geodesic_outputs *outputs, struct jobs_result *result)
{
    const struct compute_surface *ends = outputs->ends;
    size_t degree = ends[0].degree > ends[1].degree ? ends[0].degree : ends[1].degree;
    size_t count = 3 * srnf_coefficient_count(degree);
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    double *padded = srnf_alloc(count, 2 * sizeof(double));
    int status = SRNF_ENOMEM;

    if (!padded) {
        (void)compute_fail(result, status, NULL, "preparing the ends");
        goto out;
    }
    compute_change_degree(ends[0].degree, ends[0].coefficients, degree, padded);
    compute_change_degree(ends[1].degree, ends[1].coefficients, degree, padded + count);
    status = jobs_transform_acquire(jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    if (status) {
        (void)compute_fail(result, status, NULL, "preparing the harmonic transform");
        goto out;
    }
    if (inputs->registration) {
        jobs_run_phase(run, SHARE_REGISTRATION);
        status = register_end(run, inputs, sht, padded, count, outputs, result);
        if (status) {
            goto out;
        }
    }
    jobs_run_phase(run, 100.0);
    if (inputs->pullback) {
        status = follow_pullback(run, sht, padded, padded + count, inputs, outputs, &error);
    } else {
        status = srnf_geodesic(sht, padded, padded + count, &inputs->options, jobs_run_context(run),
                               &outputs->geodesic, &error);
    }
    if (status < 0) {
        (void)compute_fail(result, status, &error, "following the geodesic");
        goto out;
    }
    status = 0;
out:
    if (sht) {
        jobs_transform_release(jobs, sht);
    }
    srnf_free(padded);
    return status;
}

int compute_geodesic(struct jobs_run *run, const struct compute_geodesic_inputs *inputs,
                     struct compute_geodesic_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_geodesic *geodesic = &outputs->geodesic;
    enum srnf_parameterization route = SRNF_PARAMETERIZATION_AUTO;
    int status;

    if (!inputs->pullback && inputs->options.method == SRNF_GEODESIC_CLOSED_FORM) {
        route = SRNF_PARAMETERIZATION_STAR; /* what the formula holds for */
    }
    *outputs = (struct compute_geodesic_outputs){0};
    status =
        compute_surface_load_by(run, inputs->from, route, SHARE_END, &outputs->ends[0], result);
    if (status == 0) {
        status =
            compute_surface_load_by(run, inputs->to, route, SHARE_END, &outputs->ends[1], result);
    }
    if (status == 0) {
        status = follow(run, inputs, outputs, result);
    }
    if (status) {
        goto out;
    }
    outputs->measures = srnf_alloc(geodesic->steps, sizeof *outputs->measures);
    outputs->squared_norm = srnf_alloc(geodesic->steps, sizeof(double));
    if (!outputs->measures || !outputs->squared_norm) {
        status = compute_fail(result, SRNF_ENOMEM, NULL, "measuring the path");
        goto out;
    }
    status = compute_measure(run, geodesic->degree, geodesic->steps, geodesic->coefficients,
                             outputs->measures, result);
    if (status == 0) {
        fill_squared_norms(outputs);
        place(outputs);
    }
out:
    if (status) {
        compute_geodesic_clear(outputs);
    }
    return status;
}
