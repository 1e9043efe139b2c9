/*
 * invert.c - finding the surface with a given SRNF: methods, starts, and what is reported of the
 * result.
 *
 * auto, in order, until the relative energy is at the tolerance:
 *   1. the closed form, where the start is left to the library;
 *   2. a few Levenberg-Marquardt steps from the start;
 *   3. if they end far from a solution, the linear eigenproblem without a matrix (spectral.c); the
 *   better one goes on;
 *   4. Levenberg-Marquardt to the end, with little damping and a large cap on the inner iterations;
 *   5. if that stalls, the eigenproblem by its matrix, up to SRNF_CERTIFIED_DEGREE_MAX, and step 4
 *   again.
 * A start that the caller gives means a neighbour is known: then only Levenberg-Marquardt runs,
 * because the eigenproblem knows nothing of neighbours and q may have no exact inverse.
 *
 * A surface that has reached the tolerance is then taken two orders of magnitude further, mostly
 * at no cost, since the last steps converge quadratically: a relative energy E leaves a surface
 * error of up to sqrt(E) / sigma, and sigma is 0.04 on elongated surfaces of degree 31. When the
 * result is to be certified it is polished as far as rounding permits: the certificate must tell
 * the error of f from that of q.
 *
 * The result is turned to positive volume (Q(-f) = Q(f)). The bound on the surface error is
 *   2 sqrt(E) / sigma + 8 eps ||q|| / sigma,
 * to first order the largest L2 distance from f to a surface g nearby with ||Q(g) - q|| <= ||Q(f) -
 * q||; sigma is the smallest singular value of Q_* at f. See core/README.md for what it can and
 * cannot promise.
 */
#include "inversion.h"

#include <math.h>

#define LM_STEPS_DEFAULT 200
#define DESCENT_STEPS_DEFAULT 20000
#define MAX_ITERATIONS ((size_t)1000000)
#define LAMBDA_COARSE 1e-3
#define LAMBDA_FINE 1e-8
#define COARSE_STEPS 5
#define COARSE_CAP 60
#define ALONE_CAP 120 /* of Levenberg-Marquardt alone, while damped */
#define ALONE_GOAL 0.5
#define FINE_CAP 500
#define NEIGHBOUR_CAP 60
#define NEAR 1e-5 /* relative energy from which Levenberg-Marquardt needs no other start */
#define FINE_DECREASE \
    1e-4 /* a step that gains less than this has reached a minimum with positive energy */
#define POLISH_STEPS 3
#define POLISH_TOLERANCE 1e-22 /* the surface is then known to 1e-9 or so */
#define MARGIN 1e-2            /* of the tolerance, towards which a solution is taken in any case */
#define EXACT 1e-9 /* relative energy up to which q counts as exact, and may be certified */
/* Sizes of q whose energy, of the order of its square, and area are far from the ends of the range
   of doubles. */
#define FIELD_MIN 1e-120
#define FIELD_MAX 1e120
#define BOUND_ROUNDING (8 * 2.2e-16)

struct srnf_invert_options srnf_invert_options_defaults(void)
{
    return (struct srnf_invert_options){.method = SRNF_INVERT_AUTO,
                                        .initial = SRNF_INITIAL_AUTO,
                                        .tolerance = 1e-12,
                                        .certify = true};
}

static const char *const stop_names[] = {
    [SRNF_STOP_TOLERANCE] = "tolerance",          [SRNF_STOP_STATIONARY] = "stationary",
    [SRNF_STOP_MAX_ITERATIONS] = "maxIterations", [SRNF_STOP_CANCELED] = "canceled",
    [SRNF_STOP_CLOSED_FORM] = "closedForm",
};

const char *srnf_stop_name(enum srnf_stop stop)
{
    return (size_t)stop < sizeof stop_names / sizeof stop_names[0] ? stop_names[stop] : "unknown";
}

void inversion_run_record(struct inversion_run *run)
{
    if (run->n_history < run->history_capacity) {
        struct srnf_iteration *entry = &run->history[run->n_history++];

        entry->energy = run->energy;
        entry->seconds = srnf_seconds(run->context) - run->start_seconds;
        entry->transforms = run->system->transforms;
    }
    /* Orders of magnitude gained are the honest measure of how far an inversion has come. */
    if (run->energy > 0.0 && run->tolerance < 1.0) {
        double part = log(fmin(1.0, inversion_run_relative(run))) / log(run->tolerance);

        srnf_report_progress(run->context, fmin(0.9, 0.9 * part), "inverting");
    }
}

/* Makes f the current surface of the run. */
static void run_set(struct inversion_run *run, const double *f)
{
    if (f != run->f) {
        linear_copy(run->system->count, f, run->f);
    }
    run->energy = gauss_newton_try(run->system, run->f);
    gauss_newton_accept(run->system);
}

static bool run_done(const struct inversion_run *run)
{
    return inversion_run_relative(run) <= run->tolerance;
}

static int fine_levenberg(struct inversion_run *run, double lambda)
{
    struct levenberg_options options = {.lambda = lambda,
                                        .max_steps = run->max_iterations,
                                        .inner_cap = FINE_CAP,
                                        .decrease = FINE_DECREASE};

    return inversion_levenberg(run, &options);
}

static int coarse_levenberg(struct inversion_run *run, size_t steps, size_t cap)
{
    struct levenberg_options options = {
        .lambda = LAMBDA_COARSE, .max_steps = steps, .inner_cap = cap, .decrease = FINE_DECREASE};

    return inversion_levenberg(run, &options);
}

/* ---- Methods --------------------------------------------------------------------------------- */

/* Levenberg-Marquardt alone: damped at first, then with room for long inner solves; down to the
   tolerance and no further. */
static int method_gauss_newton(struct inversion_run *run)
{
    struct levenberg_options options = {.lambda = LAMBDA_COARSE,
                                        .max_steps = run->max_iterations,
                                        .inner_cap = ALONE_CAP,
                                        .decrease = FINE_DECREASE,
                                        .goal = ALONE_GOAL};
    int status = inversion_levenberg(run, &options);

    if (status == SRNF_OK && !run_done(run)) {
        options.lambda = LAMBDA_FINE;
        options.inner_cap = FINE_CAP;
        status = inversion_levenberg(run, &options);
    }
    return status;
}

/* Replaces the current surface by candidate where that has the lower energy; otherwise restores it.
   */
static void keep_better(struct inversion_run *run, const double *candidate, double *spare)
{
    double before = run->energy;

    linear_copy(run->system->count, run->f, spare);
    run_set(run, candidate);
    if (!(run->energy < before)) {
        run_set(run, spare);
    } else {
        inversion_run_record(run);
    }
}

/* matrix: the dense eigenproblem instead of the iteration. start is what both set out from. */
static int improve_spectrally(struct inversion_run *run, const double *start, bool matrix,
                              bool always)
{
    size_t n = run->system->count;
    double *candidate = srnf_alloc(2 * n, sizeof(double));
    double mu;
    int status;

    if (!candidate) {
        return SRNF_ENOMEM;
    }
    status =
        matrix ? spectral_dense(run, start, candidate) : spectral_start(run, start, candidate, &mu);
    if (status == SRNF_OK && always) {
        run_set(run, candidate);
        inversion_run_record(run);
    } else if (status == SRNF_OK) {
        keep_better(run, candidate, candidate + n);
    }
    srnf_free(candidate);
    return status;
}

static int method_spectral(struct inversion_run *run, const double *sphere)
{
    int status = improve_spectrally(run, sphere, true, true);

    if (status == SRNF_ELIMIT || status == SRNF_ENUMERIC) {
        status = improve_spectrally(run, sphere, false, true);
    }
    if (status == SRNF_OK && !run_done(run)) {
        status = fine_levenberg(run, LAMBDA_FINE);
    }
    return status;
}

static int method_auto(struct inversion_run *run, const double *sphere)
{
    int status = coarse_levenberg(run, COARSE_STEPS, COARSE_CAP);

    if (status == SRNF_OK && !run_done(run) && inversion_run_relative(run) > NEAR) {
        status = improve_spectrally(run, sphere, false, false);
        status = status == SRNF_ENUMERIC ? SRNF_OK : status;
    }
    if (status == SRNF_OK && !run_done(run)) {
        status = fine_levenberg(run, LAMBDA_FINE);
    }
    if (status == SRNF_OK && !run_done(run)) {
        status = improve_spectrally(run, sphere, true, false);
        if (status == SRNF_OK) {
            status = fine_levenberg(run, LAMBDA_FINE);
        }
        status = status == SRNF_ENUMERIC || status == SRNF_ELIMIT ? SRNF_OK : status;
    }
    return status;
}

/* A few steps beyond the tolerance, for a solution that is close to it already. Why the method
   stopped stays what it was: running out of these few says nothing. */
static int polish(struct inversion_run *run, bool certify)
{
    double tolerance = run->tolerance;
    enum srnf_stop stopped = run->stopped;
    struct levenberg_options options = {
        .lambda = LAMBDA_FINE, .max_steps = POLISH_STEPS, .inner_cap = FINE_CAP, .decrease = 0.5};
    int status;

    if (inversion_run_relative(run) >= EXACT || (!certify && !run_done(run))) {
        return SRNF_OK;
    }
    run->tolerance = certify ? fmin(tolerance, POLISH_TOLERANCE) : MARGIN * tolerance;
    status = inversion_levenberg(run, &options);
    run->tolerance = tolerance;
    run->stopped = run->stopped == SRNF_STOP_CANCELED ? run->stopped : stopped;
    return status;
}

static int method_neighbour(struct inversion_run *run)
{
    int status = coarse_levenberg(run, run->max_iterations, NEIGHBOUR_CAP);

    if (status == SRNF_OK && !run_done(run) && inversion_run_relative(run) < EXACT) {
        status = fine_levenberg(run, LAMBDA_FINE);
    }
    return status;
}

/* ---- The result ------------------------------------------------------------------------------ */

static void orient(struct inversion_run *run, struct srnf_inversion *result)
{
    struct gauss_newton *system = run->system;
    const struct gauss_newton_state *s = &system->state;
    size_t n = system->points;
    double volume = 0.0;

    srnf_sht_synthesis(system->sht, 3, run->f, system->field, system->workspace);
    for (size_t i = 0; i < n; i++) {
        double height = 0.0;

        for (size_t c = 0; c < 3; c++) {
            height += system->field[c * n + i] * s->unit[c * n + i];
        }
        volume += system->weight[i] * s->root[i] * s->root[i] * height / 3.0;
    }
    result->flipped = volume < 0.0;
    if (result->flipped) {
        linear_scale(system->count, -1.0, run->f);
        run_set(run, run->f);
    }
}

static int report(struct inversion_run *run, const struct srnf_invert_options *options,
                  struct srnf_inversion *result)
{
    struct gauss_newton *system = run->system;
    double *gradient = result->coefficients; /* filled with the surface at the end */
    int status = SRNF_OK;

    orient(run, result);
    gauss_newton_gradient(system, gradient);
    result->gradient_norm = 2.0 * sqrt(linear_dot(system->count, gradient, gradient));
    result->energy = run->energy;
    result->relative_energy = inversion_run_relative(run);
    result->iterations = run->iterations;
    result->converged = run_done(run);
    result->stopped = result->converged ? SRNF_STOP_TOLERANCE : run->stopped;
    result->n_history = run->n_history;
    result->transforms = system->transforms;
    result->surface_error_bound = -1.0;
    if (options->certify) {
        srnf_report_progress(run->context, 0.9, "certifying");
        status = inversion_smallest_singular(run, &result->smallest_singular_value);
        if (status == SRNF_OK && result->smallest_singular_value > 0.0) {
            result->surface_error_bound =
                (2.0 * sqrt(run->energy) + BOUND_ROUNDING * sqrt(system->q_norm2)) /
                result->smallest_singular_value;
        }
        if (status == SRNF_OK && result->converged && result->relative_energy < EXACT) {
            status = spectral_certify(run, &result->certificate);
        }
    }
    linear_copy(system->count, run->f, result->coefficients);
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

static bool all_finite(size_t n, const double *x)
{
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(x[i])) {
            return false;
        }
    }
    return true;
}

static int check(const struct gauss_newton *system, const struct srnf_invert_options *options,
                 struct srnf_error *error)
{
    if (!(options->tolerance >= 1e-30 && options->tolerance <= 1.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "tolerance %g is not in [1e-30, 1]",
                         options->tolerance);
    }
    if (options->max_iterations > MAX_ITERATIONS) {
        return srnf_fail(error, SRNF_EINVAL, -1, "more than %zu iterations", MAX_ITERATIONS);
    }
    if (options->initial == SRNF_INITIAL_SURFACE &&
        (!options->surface || !all_finite(system->count, options->surface))) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the initial surface is missing or not finite");
    }
    return SRNF_OK;
}

/* The start of the run, and the closed form's energy for the report. */
static int begin(struct inversion_run *run, const struct srnf_invert_options *options,
                 const double *sphere, struct srnf_inversion *result)
{
    struct gauss_newton *system = run->system;
    double *closed = srnf_alloc(system->count, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(system->sht));
    const double *start = sphere;

    if (!closed || !workspace) {
        srnf_free(closed);
        srnf_free(workspace);
        return SRNF_ENOMEM;
    }
    srnf_invert_closed_form(system->sht, system->q, closed, &result->closed_form_relative_energy,
                            workspace);
    closed[0] = closed[system->count / 3] = closed[2 * (system->count / 3)] = 0.0;
    if (options->method == SRNF_INVERT_CLOSED_FORM || options->initial == SRNF_INITIAL_STAR) {
        start = closed;
    } else if (options->initial == SRNF_INITIAL_SURFACE) {
        start = options->surface;
    } else if (options->initial == SRNF_INITIAL_AUTO) {
        run_set(run, sphere);
        start = result->closed_form_relative_energy < inversion_run_relative(run) ? closed : sphere;
    }
    run_set(run, start);
    for (size_t c = 0; c < 3; c++) {
        run->f[c * (system->count / 3)] = 0.0;
    }
    inversion_run_record(run);
    srnf_free(closed);
    srnf_free(workspace);
    return SRNF_OK;
}

static int solve(struct inversion_run *run, const struct srnf_invert_options *options,
                 const double *sphere, struct srnf_inversion *result)
{
    result->method = options->method;
    if (options->method == SRNF_INVERT_CLOSED_FORM) {
        run->stopped = SRNF_STOP_CLOSED_FORM;
        return SRNF_OK;
    }
    if (options->method == SRNF_INVERT_SPECTRAL) {
        return method_spectral(run, sphere);
    }
    if (run_done(run)) {
        run->stopped = SRNF_STOP_TOLERANCE;
        if (options->initial == SRNF_INITIAL_AUTO || options->initial == SRNF_INITIAL_STAR) {
            result->method = SRNF_INVERT_CLOSED_FORM;
        } else if (options->method == SRNF_INVERT_AUTO) {
            result->method = SRNF_INVERT_GAUSS_NEWTON; /* that of polish */
        }
        return SRNF_OK;
    }
    if (options->method == SRNF_INVERT_GRADIENT) {
        return inversion_descend(run);
    }
    result->method = SRNF_INVERT_GAUSS_NEWTON;
    if (options->method == SRNF_INVERT_GAUSS_NEWTON) {
        return method_gauss_newton(run);
    }
    return options->initial == SRNF_INITIAL_SURFACE ? method_neighbour(run)
                                                    : method_auto(run, sphere);
}

/* srnf_invert for a q whose norm is near 1. */
static int invert_scaled(const struct srnf_sht *sht, const double *q,
                         const struct srnf_invert_options *options,
                         const struct srnf_context *context, struct srnf_inversion *result,
                         struct srnf_error *error)
{
    struct gauss_newton *system = NULL;
    struct inversion_run run = {.context = context, .start_seconds = srnf_seconds(context)};
    double *sphere = NULL;
    int status;

    status = gauss_newton_create(&system, sht, q);
    if (status) {
        goto out;
    }
    status = check(system, options, error);
    if (status) {
        goto out;
    }
    run.system = system;
    run.tolerance = options->tolerance;
    run.max_iterations = options->max_iterations                   ? options->max_iterations
                         : options->method == SRNF_INVERT_GRADIENT ? DESCENT_STEPS_DEFAULT
                                                                   : LM_STEPS_DEFAULT;
    run.history_capacity = run.max_iterations + POLISH_STEPS + 8;
    run.history = result->history = srnf_alloc(run.history_capacity, sizeof *run.history);
    result->coefficients = srnf_alloc(system->count, sizeof(double));
    run.f = srnf_alloc(system->count, sizeof(double));
    sphere = srnf_alloc(system->count, sizeof(double));
    status = SRNF_ENOMEM;
    if (!run.history || !result->coefficients || !run.f || !sphere) {
        goto out;
    }
    inversion_sphere_start(system, sphere);
    status = begin(&run, options, sphere, result);
    if (status == SRNF_OK) {
        status = solve(&run, options, sphere, result);
    }
    if (status == SRNF_OK && options->method == SRNF_INVERT_AUTO) {
        status = polish(&run, options->certify);
    }
    if (status == SRNF_OK) {
        status = report(&run, options, result);
    }
    if (status == SRNF_OK && !result->converged) {
        status = SRNF_WNOT_CONVERGED;
    }
out:
    if (status < 0) {
        if (status != SRNF_EINVAL) {
            (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
        }
        srnf_inversion_clear(result);
    }
    sliding_destroy(run.sliding);
    srnf_free(run.f);
    srnf_free(sphere);
    gauss_newton_destroy(system);
    return status;
}

/* The power of two nearest to ||q||; 0 when q is zero, not finite, or beyond what can be squared
   twice. */
static double field_scale(const struct srnf_sht *sht, const double *q, struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t n = grid->n_theta * grid->n_phi;
    double largest = 0.0;
    double sum = 0.0;

    for (size_t i = 0; i < 3 * n; i++) {
        if (!isfinite(q[i])) {
            (void)srnf_fail(error, SRNF_EINVAL, (int64_t)i, "q has a value that is not finite");
            return 0.0;
        }
        largest = fmax(largest, fabs(q[i]));
    }
    if (!(largest >= FIELD_MIN && largest <= FIELD_MAX)) {
        (void)srnf_fail(error, SRNF_EINVAL, -1,
                        largest > 0.0 ? "the largest value of q is %g, not in %g to %g"
                                      : "q is zero",
                        largest, FIELD_MIN, FIELD_MAX);
        return 0.0;
    }
    for (size_t i = 0; i < 3 * n; i++) {
        double value = q[i] / largest;

        sum += grid->weight[i % n / grid->n_phi] * value * value;
    }
    return exp2(round(log2(largest) + 0.5 * log2(sum)));
}

static void rescale(struct srnf_inversion *result, size_t count, double scale)
{
    linear_scale(count, scale, result->coefficients);
    result->energy *= scale * scale;
    result->gradient_norm *= scale;
    for (size_t i = 0; i < result->n_history; i++) {
        result->history[i].energy *= scale * scale;
    }
    if (result->surface_error_bound > 0.0) {
        result->surface_error_bound *= scale;
    }
}

/* Q(c f) = c Q(f): the problem is solved at a size near 1, and a power of two costs no digits. */
int srnf_invert(const struct srnf_sht *sht, const double *q,
                const struct srnf_invert_options *options, const struct srnf_context *context,
                struct srnf_inversion *result, struct srnf_error *error)
{
    struct srnf_invert_options scaled = options ? *options : srnf_invert_options_defaults();
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    size_t values = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    double scale = field_scale(sht, q, error);
    double *memory;
    int status;

    *result = (struct srnf_inversion){0};
    if (!(scale > 0.0)) {
        return SRNF_EINVAL;
    }
    memory = srnf_alloc(values + count, sizeof(double));
    if (!memory) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    }
    linear_copy(values, q, memory);
    linear_scale(values, 1.0 / scale, memory);
    if (scaled.surface) {
        linear_copy(count, scaled.surface, memory + values);
        linear_scale(count, 1.0 / scale, memory + values);
        scaled.surface = memory + values;
    }
    status = invert_scaled(sht, memory, &scaled, context, result, error);
    if (status >= 0) {
        rescale(result, count, scale);
    }
    srnf_free(memory);
    return status;
}

void srnf_inversion_clear(struct srnf_inversion *result)
{
    srnf_free(result->coefficients);
    srnf_free(result->history);
    *result = (struct srnf_inversion){0};
}
