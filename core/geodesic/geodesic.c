/*
 * geodesic.c - geodesics of the SRNF metric between two surfaces as they are parameterized (the
 * paper, section 4.1).
 *
 * In Q the geodesic is the straight line q_t = (1 - t) Q(f_0) + t Q(f_1); each of its points is
 * inverted:
 *   srnf         by Levenberg-Marquardt, in order of t, from the best of three starts: the path
 *                extrapolated linearly from the last two surfaces, the blend
 *                (1 - t) f_0 + t f_1, and the closed form. A step of it never raises E, so the
 *                curve of the geodesic lies below the other two
 *   closed-form  by r = sqrt(|q| <q, e>), which is right where both ends are star-shaped, and in
 *                their radial parameterization, and so is the way between
 *   linear       not at all: the blend itself
 * The line leaves the image of Q in general, so that the energy E_t = ||Q(f_t) - q_t||^2 has a
 * positive minimum; the three curves of it are those of the paper's Fig. 4. Q knows no
 * translations: they are blended linearly.
 *
 * Costs some 200 to 300 transforms a surface for method srnf.
 */
#include "inversion/inversion.h"

#include <math.h>

#define STEPS_MIN 2
#define STEPS_MAX 101
#define DECREASE 1e-3   /* of E: the minimum is then known to a few parts in a thousand */
#define TOLERANCE 1e-14 /* relative E, where the line stays in the image of Q */

struct geodesic_work {
    const struct srnf_sht *sht;
    size_t points, count;
    double *memory, *q_from, *q_to, *q, *field; /* fields */
    double *surfaces, *blend, *extrapolated, *closed;
    void *workspace;
    struct gauss_newton *system;
};

struct srnf_geodesic_options srnf_geodesic_options_defaults(void)
{
    return (struct srnf_geodesic_options){.method = SRNF_GEODESIC_SRNF, .steps = 7};
}

static int create_work(struct geodesic_work *work, const struct srnf_sht *sht)
{
    size_t fields = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;

    work->sht = sht;
    work->points = fields / 3;
    work->count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    work->memory = srnf_alloc(4 * fields, sizeof(double));
    work->surfaces = srnf_alloc(3 * work->count, sizeof(double));
    work->workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    if (!work->memory || !work->surfaces || !work->workspace) {
        return SRNF_ENOMEM;
    }
    work->q_from = work->memory;
    work->q_to = work->memory + fields;
    work->q = work->memory + 2 * fields;
    work->field = work->memory + 3 * fields;
    work->blend = work->surfaces;
    work->extrapolated = work->surfaces + work->count;
    work->closed = work->surfaces + 2 * work->count;
    return gauss_newton_create(&work->system, sht, work->q);
}

static void destroy_work(struct geodesic_work *work)
{
    gauss_newton_destroy(work->system);
    srnf_free(work->memory);
    srnf_free(work->surfaces);
    srnf_free(work->workspace);
}

static void mix(size_t n, double t, const double *a, const double *b, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = (1.0 - t) * a[i] + t * b[i];
    }
}

static double distance(const struct geodesic_work *work, const double *a, const double *b,
                       double *difference)
{
    const struct srnf_grid *grid = srnf_sht_grid(work->sht);

    for (size_t i = 0; i < 3 * work->points; i++) {
        difference[i] = a[i] - b[i];
    }
    return sqrt(srnf_inner_product(grid, difference, difference));
}

/* Surface k of the path; the ones before it are there. */
static int path_point(struct geodesic_work *work, const struct srnf_geodesic_options *options,
                      const struct srnf_context *context, struct srnf_geodesic *result, size_t k)
{
    double *f = result->coefficients + k * work->count;
    const struct continuation inversion = {.tolerance = TOLERANCE, .decrease = DECREASE};
    size_t each = work->count / 3;
    int status = SRNF_OK;

    if (options->method == SRNF_GEODESIC_LINEAR) {
        linear_copy(work->count, work->blend, f);
        return SRNF_OK;
    }
    if (options->method == SRNF_GEODESIC_CLOSED_FORM) {
        linear_copy(work->count, work->closed, f);
    } else {
        double start = result->energy_linear[k];

        linear_copy(work->count, work->blend, f);
        if (k >= 2) {
            double energy;

            mix(work->count, 2.0, f - 2 * work->count, f - work->count, work->extrapolated);
            energy = gauss_newton_try(work->system, work->extrapolated);
            if (energy < start) {
                start = energy;
                linear_copy(work->count, work->extrapolated, f);
            }
        }
        if (result->energy_closed_form[k] < start) {
            linear_copy(work->count, work->closed, f);
        }
        status = inversion_continue(work->system, &inversion, context, f, &start);
    }
    for (size_t c = 0; c < 3; c++) {
        f[c * each] = work->blend[c * each];
    }
    return status;
}

/* Sets the target of time t and the energies that cost no inversion. */
static void prepare_point(struct geodesic_work *work, const double *from, const double *to,
                          struct srnf_geodesic *result, size_t k)
{
    double t = result->times[k];
    double relative;
    double norm2;

    mix(3 * work->points, t, work->q_from, work->q_to, work->q);
    mix(work->count, t, from, to, work->blend);
    norm2 = pointwise_norm2(work->points, work->system->weight, work->q);
    work->system->q_norm2 = norm2;
    srnf_invert_closed_form(work->sht, work->q, work->closed, &relative, work->workspace);
    result->energy_closed_form[k] = relative * norm2;
    if (k == 0 || k + 1 == result->steps) { /* q is that of an end */
        result->closed_form_applies =
            (k == 0 || result->closed_form_applies) && relative <= SRNF_CLOSED_FORM_APPLIES;
    }
    result->energy_linear[k] = srnf_energy(work->sht, work->blend, work->q, NULL, work->workspace);
    work->system->transforms += 2.0;
}

static int walk(struct geodesic_work *work, const double *from, const double *to,
                const struct srnf_geodesic_options *options, const struct srnf_context *context,
                struct srnf_geodesic *result)
{
    size_t last = result->steps - 1;

    srnf_field(work->sht, from, work->q_from, work->workspace);
    srnf_field(work->sht, to, work->q_to, work->workspace);
    result->distance = distance(work, work->q_from, work->q_to, work->field);
    linear_copy(work->count, from, result->coefficients);
    linear_copy(work->count, to, result->coefficients + last * work->count);
    for (size_t k = 0; k <= last; k++) {
        double *f = result->coefficients + k * work->count;

        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        result->times[k] = (double)k / (double)last;
        prepare_point(work, from, to, result, k);
        if (k > 0 && k < last) {
            int status = path_point(work, options, context, result, k);

            if (status) {
                return status;
            }
        }
        result->energy_geodesic[k] = srnf_energy(work->sht, f, work->q, NULL, work->workspace);
        srnf_report_progress(context, (double)(k + 1) / (double)(last + 1), "inverting the path");
    }
    return SRNF_OK;
}

/* Sum of the distances between neighbours, in the two field buffers that are free by then. */
static int measure_length(struct geodesic_work *work, const struct srnf_context *context,
                          struct srnf_geodesic *result)
{
    double *here = work->q_from;
    double *next = work->q_to;

    srnf_field(work->sht, result->coefficients, here, work->workspace);
    for (size_t k = 1; k < result->steps; k++) {
        double *swap = here;

        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        srnf_field(work->sht, result->coefficients + k * work->count, next, work->workspace);
        result->length += distance(work, here, next, work->field);
        here = next;
        next = swap;
    }
    return SRNF_OK;
}

int srnf_geodesic(const struct srnf_sht *sht, const double *from, const double *to,
                  const struct srnf_geodesic_options *options, const struct srnf_context *context,
                  struct srnf_geodesic *result, struct srnf_error *error)
{
    struct srnf_geodesic_options defaults = srnf_geodesic_options_defaults();
    struct geodesic_work work = {0};
    int status = SRNF_ENOMEM;
    size_t steps;

    options = options ? options : &defaults;
    steps = options->steps;
    *result = (struct srnf_geodesic){0};
    if (steps < STEPS_MIN || steps > STEPS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "steps is %zu, not %d to %d", steps, STEPS_MIN,
                         STEPS_MAX);
    }
    for (size_t i = 0; i < 3 * srnf_coefficient_count(srnf_sht_degree(sht)); i++) {
        if (!isfinite(from[i]) || !isfinite(to[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "a coefficient of an end is not finite");
        }
    }
    status = create_work(&work, sht);
    if (status) {
        goto out;
    }
    result->degree = srnf_sht_degree(sht);
    result->steps = steps;
    result->coefficients = srnf_alloc(steps * work.count, sizeof(double));
    result->times = srnf_alloc(4 * steps, sizeof(double));
    status = SRNF_ENOMEM;
    if (!result->coefficients || !result->times) {
        goto out;
    }
    result->energy_geodesic = result->times + steps;
    result->energy_closed_form = result->times + 2 * steps;
    result->energy_linear = result->times + 3 * steps;
    status = walk(&work, from, to, options, context, result);
    if (status == SRNF_OK) {
        status = measure_length(&work, context, result);
        result->transforms = work.system->transforms;
    }
out:
    if (status) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
        srnf_geodesic_clear(result);
    }
    destroy_work(&work);
    return status;
}

void srnf_geodesic_clear(struct srnf_geodesic *result)
{
    srnf_free(result->coefficients);
    srnf_free(result->times);
    *result = (struct srnf_geodesic){0};
}
