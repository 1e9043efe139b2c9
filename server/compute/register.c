/*
 * register.c - loads both surfaces, brings them to the larger degree and registers one to
 * the other. The registered surface stays where the rotation about the origin has put it: stored
 * surfaces are centred by convention, and a centred one stays so up to its truncation.
 */
#include "compute/register.h"

#define SHARE_END 15.0 /* percent of the job that encoding a mesh takes */

void compute_register_clear(struct compute_register_outputs *outputs)
{
    compute_surface_clear(&outputs->ends[0]);
    compute_surface_clear(&outputs->ends[1]);
    srnf_registration_clear(&outputs->registration);
}

static int register_ends(struct jobs_run *run, const struct compute_register_inputs *inputs,
                         struct compute_register_outputs *outputs, struct jobs_result *result)
{
    const struct compute_surface *ends = outputs->ends;
    size_t degree = ends[0].degree > ends[1].degree ? ends[0].degree : ends[1].degree;
    size_t count = 3 * srnf_coefficient_count(degree);
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    double *padded = srnf_alloc(count, 2 * sizeof(double));
    int status = padded ? 0 : SRNF_ENOMEM;

    if (status == 0) {
        compute_change_degree(ends[0].degree, ends[0].coefficients, degree, padded);
        compute_change_degree(ends[1].degree, ends[1].coefficients, degree, padded + count);
        status = jobs_transform_acquire(jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    }
    if (status) {
        (void)compute_fail(result, status, NULL, "preparing the registration");
        goto out;
    }
    outputs->degree = degree;
    outputs->n_theta = srnf_sht_grid(sht)->n_theta;
    outputs->n_phi = srnf_sht_grid(sht)->n_phi;
    status =
        compute_register_pair(run, sht, padded, padded + count, inputs->origins, &inputs->options,
                              &outputs->registration, &outputs->bridged, result);
    if (status == 0 && inputs->handedness) {
        status = compute_mirror_pair(run, sht, padded, padded + count, &inputs->options,
                                     inputs->opposite, outputs->registration.distance,
                                     &outputs->mirror, &error);
        status =
            status < 0 ? compute_fail(result, status, &error, "registering the mirror image") : 0;
    }
out:
    if (sht) {
        jobs_transform_release(jobs, sht);
    }
    srnf_free(padded);
    return status;
}

int compute_register(struct jobs_run *run, const struct compute_register_inputs *inputs,
                     struct compute_register_outputs *outputs, struct jobs_result *result)
{
    int status;

    *outputs = (struct compute_register_outputs){0};
    status = compute_surface_load(run, inputs->template_id, SHARE_END, &outputs->ends[0], result);
    if (status == 0) {
        status = compute_surface_load(run, inputs->moving, SHARE_END, &outputs->ends[1], result);
    }
    if (status == 0) {
        jobs_run_phase(run, 100.0);
        status = register_ends(run, inputs, outputs, result);
    }
    if (status == 0) {
        status = compute_measure(run, outputs->degree, 1, outputs->registration.coefficients,
                                 &outputs->measures, result);
    }
    if (status) {
        compute_register_clear(outputs);
    }
    return status;
}
