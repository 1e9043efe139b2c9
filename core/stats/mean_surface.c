/*
 * mean_surface.c - what a group mean hands to the caller: fields on the caller's grid, and the mean
 * surface.
 *
 * The registered fields are evaluated anew on the grid of the caller, from the chains, centred: at
 * gamma_i o d^-1, d the centre of mean_center.c. Their
 * average there is the mean that is handed over. It is inverted once, from the average of the
 * registered surfaces O_i f_i o gamma_i, analysed to the degree of the group.
 */
#include "mean.h"

#include <math.h>
#include <string.h>

struct output {
    struct mean_run *run;
    const struct srnf_grid *grid; /* of the caller */
    size_t points;
    double *base,
        *base_jacobian; /* the centre's inverse on that grid: what comes before all warps */
    double *q;          /* [n][3][P] */
};

/* q and values of a subject at gamma: [3][P]. field: [P][3] its q there. */
static void place(const struct output *o, size_t i, const double *jacobian, const double *field,
                  const double *surface, double *values)
{
    const struct mean_subject *subject = &o->run->subjects[i];
    size_t n = o->points;

    for (size_t k = 0; k < n; k++) {
        const double *q = field + 3 * k;
        double root = sqrt(jacobian[k]);

        for (size_t c = 0; c < 3; c++) {
            const double *r = subject->at.rotation + 3 * c;

            o->q[(3 * i + c) * n + k] = root * (r[0] * q[0] + r[1] * q[1] + r[2] * q[2]);
            values[c * n + k] =
                r[0] * surface[k] + r[1] * surface[n + k] + r[2] * surface[2 * n + k];
        }
    }
}

static int place_one(void *argument, size_t i, double *values, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct output *o = argument;
    size_t degree = srnf_sht_degree(o->run->sht);
    struct moving moving = {.table = NULL};
    size_t n = o->points;
    double *gamma = srnf_alloc(10 * n, sizeof(double));
    double *surface = gamma ? gamma + 4 * n : NULL;
    struct srnf_warp chain = {0};
    int status = gamma ? mean_chain_open(o->run, i, &chain) : SRNF_ENOMEM;

    (void)error;
    if (status == SRNF_OK) {
        memcpy(gamma, o->base, 3 * n * sizeof(double));
        memcpy(gamma + 3 * n, o->base_jacobian, n * sizeof(double));
        status = warp_follow(&chain, context, n, gamma, gamma + 3 * n);
        mean_chain_close(o->run, &chain);
    }
    if (status == SRNF_OK) {
        status = moving_create(&moving, degree, o->run->surfaces[i], degree, context);
    }
    if (status == SRNF_OK) {
        moving_values(&moving, n, gamma, surface, surface + 3 * n);
        place(o, i, gamma + 3 * n, surface + 3 * n, surface, values);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
        moving_clear(&moving);
    }
    srnf_free(gamma);
    return status;
}

static int evaluate(struct output *o, double *coefficients, struct srnf_error *error)
{
    struct mean_run *run = o->run;
    size_t n = o->points;
    double *average = srnf_alloc(3 * n, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(run->sht, 3));
    struct srnf_warp inverse = {0};
    int status = SRNF_ENOMEM;

    o->base = srnf_alloc(4 * n, sizeof(double));
    if (!average || !workspace || !o->base) {
        goto out;
    }
    o->base_jacobian = o->base + 3 * n;
    stats_nodes(o->grid, o->base);
    status = warp_invert(&run->centring, &inverse);
    if (status == SRNF_OK) {
        status = warp_apply(&inverse, run->context, n, o->base, o->base, o->base_jacobian);
    }
    if (status == SRNF_OK) {
        status = mean_average_of(run, place_one, o, n, (struct stats_progress){0}, average, error);
    }
    if (status == SRNF_OK) {
        srnf_sht_analysis(run->sht, 3, average, coefficients, workspace);
    }
out:
    srnf_warp_clear(&inverse);
    srnf_free(average);
    srnf_free(workspace);
    srnf_free(o->base);
    return status;
}

/* coefficients: those of the average surface. */
static int average_plain(const struct mean_run *run, double *coefficients)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));

    for (size_t i = 0; i < run->n; i++) {
        for (size_t k = 0; k < count; k++) {
            coefficients[k] += run->surfaces[i][k] / (double)run->n;
        }
    }
    return SRNF_OK;
}

static int invert(const struct mean_run *run, const double *start, struct srnf_mean *mean,
                  struct srnf_error *error)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion inversion = {0};
    struct srnf_context quiet = srnf_quiet(run->context);
    int status;

    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = start;
    options.certify = false;
    status = srnf_invert(run->sht, mean->mean_q, &options, &quiet, &inversion, error);
    if (status >= 0) { /* a mean that is no SRNF has no exact inverse: that is no failure */
        mean->coefficients = inversion.coefficients;
        inversion.coefficients = NULL;
        mean->relative_energy = inversion.relative_energy;
        srnf_inversion_clear(&inversion);
        status = SRNF_OK;
    }
    return status;
}

/* The fields on the caller's grid; those of the run themselves where nothing is registered. */
static int place_fields(struct mean_run *run, struct srnf_mean *mean, double *start,
                        struct srnf_error *error)
{
    struct output output = {.run = run, .grid = srnf_sht_grid(run->sht)};
    int status;

    output.points = stats_points(output.grid);
    if (!run->registered) {
        mean->registered_q = run->q;
        mean->mean_q = run->mean_q;
        run->q = run->mean_q = NULL;
        return average_plain(run, start);
    }
    mean->registered_q = output.q = srnf_alloc(run->n, 3 * output.points * sizeof(double));
    mean->mean_q = srnf_alloc(3 * output.points, sizeof(double));
    status = mean->registered_q && mean->mean_q ? evaluate(&output, start, error) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        stats_average(output.grid, run->n, mean->registered_q, mean->mean_q);
    }
    return status;
}

static int tell_apart(const struct mean_run *run, struct srnf_mean *mean)
{
    if (!mean_has_visits(run)) {
        return SRNF_OK;
    }
    mean->apart = srnf_alloc(run->n, sizeof *mean->apart);
    for (size_t i = 0; mean->apart && i < run->n; i++) {
        mean->apart[i] = run->apart[run->owners.of[i]];
    }
    return mean->apart ? SRNF_OK : SRNF_ENOMEM;
}

int mean_hand_over(struct mean_run *run, struct srnf_mean *mean, struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    double *start =
        srnf_alloc(3 * srnf_coefficient_count(srnf_sht_degree(run->sht)), sizeof(double));
    int status = SRNF_ENOMEM;

    mean->distances = srnf_alloc(run->n, sizeof(double));
    srnf_report_progress(run->context, MEAN_PROGRESS_LOOP, "inverting the mean");
    if (start && mean->distances) {
        status = place_fields(run, mean, start, error);
    }
    status = status ? status : mean_landmarks_hand_over(run, mean, error);
    status = status ? status : tell_apart(run, mean);
    status = status ? status : invert(run, start, mean, error);
    srnf_free(start);
    if (status) {
        return status;
    }
    for (size_t i = 0; i < run->n; i++) {
        mean->distances[i] = sqrt(
            stats_distance2(grid, mean->registered_q + i * 3 * stats_points(grid), mean->mean_q));
    }
    mean->n = run->n;
    mean->iterations = run->iterations;
    mean->history = run->history;
    run->history = NULL;
    return SRNF_OK;
}
