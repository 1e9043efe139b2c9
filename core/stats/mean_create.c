/*
 * mean_create.c - the memory of a mean, and the grid that it works on.
 */
#include "mean.h"

void mean_run_clear(struct mean_run *run)
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
    subjects_clear(&run->owners);
    srnf_free(run->apart);
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

int mean_run_create(struct mean_run *run, const struct srnf_mean_options *options,
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
    status = status ? status : subjects_open(&run->owners, run->n, options->subjects, error);
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
    run->apart = srnf_alloc(run->owners.count, sizeof *run->apart);
    if (!run->nodes || !run->weight || !run->mean_q || !run->previous || !run->target ||
        !run->subjects || (!run->registered && !run->q) || !run->history || !run->apart) {
        return SRNF_ENOMEM;
    }
    mean_tools_decide(run, options->keep_bytes);
    registration_nodes(run->grid, run->nodes, run->weight);
    return run->registered ? create_warps(run, options, error) : SRNF_OK;
}
