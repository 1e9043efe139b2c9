/*
 * invert.c - the SRNF to invert is given as values on a grid, or named as that of a
 * surface; then it is sampled on the working grid of the larger of the two degrees, so that both
 * the truth and the result are resolved.
 *
 * The result is moved to its area centroid: an SRNF does not know translations, and stored surfaces
 * are centred by convention. Its orientation follows the core: positive volume.
 *
 * The error against a known truth leaves the l = 0 terms out and divides by the square root of the
 * area, so that it is the L2 distance at unit area. Q(-f) = Q(f), so a truth of negative volume is
 * compared with its mirror image.
 */
#include "compute/invert.h"

#include <math.h>
#include <string.h>

#define SHARE_MESH 30.0 /* percent of the job that encoding a mesh takes */

/* The transforms and arrays of one inversion. */
struct work {
    struct jobs *jobs;
    const struct srnf_sht *sht;     /* degree of the result on the grid of q */
    const struct srnf_sht *forward; /* degree of the truth on the same grid */
    double *q;                      /* owned; NULL when q is the caller's */
    double *initial;                /* coefficients at the degree of the result */
    void *workspace;
};

void compute_invert_clear(struct compute_invert_outputs *outputs)
{
    compute_surface_clear(&outputs->truth);
    srnf_inversion_clear(&outputs->inversion);
}

static void work_clear(struct work *work)
{
    srnf_free(work->workspace);
    srnf_free(work->initial);
    srnf_free(work->q);
    if (work->forward) {
        jobs_transform_release(work->jobs, work->forward);
    }
    if (work->sht) {
        jobs_transform_release(work->jobs, work->sht);
    }
}

/* The SRNF of the truth, on the grid of the larger degree. */
static int sample_truth(struct work *work, const struct compute_surface *truth, size_t degree,
                        struct jobs_result *result)
{
    size_t rows = srnf_working_rows(truth->degree > degree ? truth->degree : degree);
    size_t count = 3 * rows * 2 * rows;
    int status = jobs_transform_acquire(work->jobs, truth->degree, SRNF_GRID_GAUSS_LEGENDRE, rows,
                                        2 * rows, &work->forward);

    if (status == 0) {
        status = jobs_transform_acquire(work->jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, rows,
                                        2 * rows, &work->sht);
    }
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    work->q = srnf_alloc(count, sizeof(double));
    work->workspace = srnf_alloc(srnf_surface_workspace_size(work->forward), 1);
    if (!work->q || !work->workspace) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "sampling the SRNF");
    }
    srnf_field(work->forward, truth->coefficients, work->q, work->workspace);
    return 0;
}

static int load_initial(struct jobs_run *run, struct work *work, const char *id, size_t degree,
                        struct jobs_result *result)
{
    struct compute_surface surface = {0};
    int status = compute_surface_load(run, id, SHARE_MESH, &surface, result);

    if (status) {
        return status;
    }
    work->initial = srnf_alloc(srnf_coefficient_count(degree), 3 * sizeof(double));
    if (work->initial) {
        compute_change_degree(surface.degree, surface.coefficients, degree, work->initial);
    } else {
        status = compute_fail(result, SRNF_ENOMEM, NULL, "preparing the initial surface");
    }
    compute_surface_clear(&surface);
    return status;
}

/* L2 distance without l = 0 at unit area; the sign is that of the truth's volume. */
static double distance_to_truth(struct work *work, const struct compute_surface *truth,
                                size_t degree, const double *coefficients)
{
    struct srnf_surface_measures measures;
    size_t n = srnf_coefficient_count(degree);
    double sign, sum = 0.0;

    if (truth->degree != degree) {
        return -1.0;
    }
    srnf_surface_measure(work->forward, truth->coefficients, &measures, work->workspace);
    sign = measures.volume < 0.0 ? -1.0 : 1.0;
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 1; i < n; i++) {
            double d = coefficients[k * n + i] - sign * truth->coefficients[k * n + i];
            sum += d * d;
        }
    }
    return sqrt(sum / measures.area);
}

/* Everything the inversion needs: the transform, q (of the truth or given) and the initial
   surface. */
static int prepare(struct jobs_run *run, const struct compute_invert_inputs *inputs,
                   struct work *work, struct compute_surface *truth, struct jobs_result *result)
{
    enum srnf_parameterization route = SRNF_PARAMETERIZATION_AUTO;
    int status;

    if (inputs->options.method == SRNF_INVERT_CLOSED_FORM) {
        route = SRNF_PARAMETERIZATION_STAR; /* what the formula holds for */
    }
    if (inputs->surface) {
        status = compute_surface_load_by(run, inputs->surface, route, SHARE_MESH, truth, result);
        if (status == 0) {
            status = sample_truth(work, truth, inputs->degree, result);
        }
    } else {
        status = jobs_transform_acquire(work->jobs, inputs->degree, SRNF_GRID_GAUSS_LEGENDRE,
                                        inputs->n_theta, inputs->n_phi, &work->sht);
        if (status) {
            (void)compute_fail(result, status, NULL, "preparing the harmonic transform");
        }
    }
    if (status == 0 && inputs->initial_surface) {
        status = load_initial(run, work, inputs->initial_surface, inputs->degree, result);
    }
    return status;
}

int compute_invert(struct jobs_run *run, const struct compute_invert_inputs *inputs,
                   struct compute_invert_outputs *outputs, struct jobs_result *result)
{
    struct work work = {.jobs = jobs_run_jobs(run)};
    struct srnf_invert_options options = inputs->options;
    struct srnf_error error = {0};
    const double origin[3] = {0.0, 0.0, 0.0};
    const double *q;
    int status;

    *outputs = (struct compute_invert_outputs){.surface_error = -1.0};
    status = prepare(run, inputs, &work, &outputs->truth, result);
    if (status) {
        goto out;
    }
    q = work.q ? work.q : inputs->q;
    options.surface = work.initial;
    jobs_run_phase(run, 100.0);
    outputs->squared_norm = srnf_inner_product(srnf_sht_grid(work.sht), q, q);
    status = srnf_invert(work.sht, q, &options, jobs_run_context(run), &outputs->inversion, &error);
    if (status < 0) {
        status = compute_fail(result, status, &error, "inverting the SRNF");
        goto out;
    }
    status = compute_measure(run, inputs->degree, 1, outputs->inversion.coefficients,
                             &outputs->measures, result);
    if (status) {
        goto out;
    }
    compute_move(inputs->degree, outputs->inversion.coefficients, &outputs->measures, origin);
    if (outputs->truth.coefficients) {
        outputs->surface_error = distance_to_truth(&work, &outputs->truth, inputs->degree,
                                                   outputs->inversion.coefficients);
    }
out:
    work_clear(&work);
    if (status) {
        compute_invert_clear(outputs);
    }
    return status;
}
