/*
 * geodesic.c - geodesics of the pulled-back metric by path-straightening with fixed ends
 * (the paper, Algorithm 1), and the logarithm.
 *
 * Among the paths of m segments the geodesic has the least energy m sum ||Q_k+1 - Q_k||^2; its
 * speed is then constant. The interior surfaces are unknowns all at once (solve.c), from
 * the straight line between the ends. Where the ends lie far apart, fewer segments first and then
 * halves of them find lower minima: each new surface starts as the mean of its neighbours.
 *
 * Cost on surfaces of some distance 0.2 to 0.8 at unit area: 3 to 5 steps, 100 to 300 transforms an
 * interior surface; ten times that for pairs that are not registered.
 */
#include "pullback.h"

#include <math.h>

#define SEGMENTS 8
#define TOLERANCE 1e-6
#define MAX_ITERATIONS 100
#define LOG_GRADIENT 1e-9
#define PROGRESS_PATH 0.9 /* the rest is the comparison */

struct srnf_pullback_options srnf_pullback_options_defaults(void)
{
    return (struct srnf_pullback_options){.segments = SEGMENTS,
                                          .tolerance = TOLERANCE,
                                          .max_iterations = MAX_ITERATIONS,
                                          .compare = true};
}

static int check_options(const struct srnf_pullback_options *options, struct srnf_error *error)
{
    int status = pullback_check_segments(options->segments, error);

    if (status) {
        return status;
    }
    if (!(options->tolerance >= 0.0 && options->tolerance <= 1.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "tolerance %g is not in [0, 1]",
                         options->tolerance);
    }
    if (!(options->gradient >= 0.0 && options->gradient <= 1.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "gradient %g is not in [0, 1]", options->gradient);
    }
    return options->max_iterations > 0 ? SRNF_OK
                                       : srnf_fail(error, SRNF_EINVAL, -1, "max_iterations is 0");
}

/* ---- Straightening --------------------------------------------------------------------------- */

/* One path of `segments` segments, double[segments + 1][count], in place. */
static int straighten(const struct srnf_sht *sht, const struct srnf_pullback_options *options,
                      const struct srnf_context *context, size_t segments,
                      struct pullback_solve *solve, double *path, double *transforms)
{
    struct pullback_graph *graph = NULL;
    size_t *parents = NULL;
    bool *fixed = NULL;
    int status = pullback_chain(segments + 1, &parents, &fixed);

    if (status == SRNF_OK) {
        status = pullback_graph_create(&graph, sht, context, segments + 1, parents, fixed,
                                       (double)segments);
    }
    if (status == SRNF_OK) {
        solve->decrease = options->tolerance;
        solve->max_steps = options->max_iterations;
        solve->message = "straightening the path";
        status = pullback_minimize(graph, path, solve);
        *transforms += graph->transforms;
    }
    pullback_graph_destroy(graph);
    srnf_free(parents);
    srnf_free(fixed);
    return status;
}

/* From every stride-th surface of the path to every stride / 2-th: those between are means. */
static void halve(size_t segments, size_t stride, size_t count, double *path)
{
    for (size_t k = stride / 2; k < segments; k += stride) {
        pullback_mix(count, 0.5, path + (k - stride / 2) * count, path + (k + stride / 2) * count,
                     path + k * count);
    }
}

/* Brings every stride-th surface to the front, or back to its place. */
static void pack(size_t segments, size_t stride, size_t count, double *path)
{
    for (size_t k = 1; stride > 1 && k <= segments / stride; k++) {
        linear_copy(count, path + k * stride * count, path + k * count);
    }
}

static void unpack(size_t segments, size_t stride, size_t count, double *path)
{
    for (size_t k = segments / stride; stride > 1 && k > 0; k--) {
        linear_copy(count, path + k * count, path + k * stride * count);
    }
}

/* The straight line, solved at one number of segments after the other. */
static int solve_path(const struct srnf_sht *sht, const struct srnf_pullback_options *options,
                      const struct srnf_context *context, struct srnf_pullback_geodesic *result)
{
    size_t m = options->segments;
    size_t count = 3 * srnf_coefficient_count(result->degree);
    double *path = result->coefficients;
    struct pullback_solve solve = {0};
    size_t stride = 1;

    while (options->halving && m / stride % 2 == 0 && m / stride > 2) {
        stride *= 2;
    }
    for (;;) {
        int status;

        solve.gradient = stride == 1 ? options->gradient : 0.0;
        solve.progress_from = solve.progress_to;
        solve.progress_to = (options->compare ? PROGRESS_PATH : 1.0) / (double)stride;
        pack(m, stride, count, path);
        status = straighten(sht, options, context, m / stride, &solve, path, &result->transforms);
        unpack(m, stride, count, path);
        result->iterations += solve.steps;
        if (status || stride == 1) {
            result->gradient = solve.gradient_left;
            result->converged = solve.converged;
            return status;
        }
        halve(m, stride, count, path);
        stride /= 2;
    }
}

/* ---- The result ------------------------------------------------------------------------------ */

static int compare(const struct srnf_sht *sht, const struct srnf_context *context,
                   struct srnf_pullback_geodesic *result, struct srnf_error *error)
{
    size_t m = result->steps - 1;
    size_t count = 3 * srnf_coefficient_count(result->degree);
    struct srnf_geodesic_options options = {.method = SRNF_GEODESIC_SRNF, .steps = result->steps};
    struct srnf_context quiet = srnf_quiet(context);
    struct srnf_geodesic line;
    int status;

    status = srnf_geodesic(sht, result->coefficients, result->coefficients + m * count, &options,
                           &quiet, &line, error);
    if (status < 0) {
        return status;
    }
    status = pullback_measure(sht, context, m, line.coefficients, NULL, &result->inverted);
    srnf_geodesic_clear(&line);
    return status;
}

static int allocate(struct srnf_pullback_geodesic *result, size_t degree, size_t segments)
{
    size_t count = 3 * srnf_coefficient_count(degree);

    result->degree = degree;
    result->steps = segments + 1;
    result->coefficients = srnf_alloc((segments + 1) * count, sizeof(double));
    result->times = srnf_alloc(2 * segments + 1, sizeof(double));
    result->speeds = result->times ? result->times + segments + 1 : NULL;
    return result->coefficients && result->times ? SRNF_OK : SRNF_ENOMEM;
}

/* Path and figures; the ends and the options have been checked. */
static int fill(const struct srnf_sht *sht, const double *from, const double *to,
                const struct srnf_pullback_options *options, const struct srnf_context *context,
                struct srnf_pullback_geodesic *result, struct srnf_error *error)
{
    size_t m = options->segments;
    int status = allocate(result, srnf_sht_degree(sht), m);
    size_t count = 3 * srnf_coefficient_count(result->degree);
    struct srnf_path_figures chord;
    double *ends;

    if (status) {
        return status;
    }
    ends = result->coefficients;
    linear_copy(count, from, ends);
    linear_copy(count, to, ends + count);
    status = pullback_measure(sht, context, 1, ends, NULL, &chord);
    for (size_t k = 0; k <= m; k++) {
        result->times[k] = (double)k / (double)m;
        pullback_mix(count, result->times[k], from, to, result->coefficients + k * count);
    }
    linear_copy(count, to, result->coefficients + m * count);
    result->distance = chord.length;
    status = status
                 ? status
                 : pullback_measure(sht, context, m, result->coefficients, NULL, &result->linear);
    status = status ? status : solve_path(sht, options, context, result);
    status = status ? status
                    : pullback_measure(sht, context, m, result->coefficients, result->speeds,
                                       &result->path);
    if (status == SRNF_OK && options->compare) {
        status = compare(sht, context, result, error);
    }
    return status;
}

int srnf_pullback_geodesic(const struct srnf_sht *sht, const double *from, const double *to,
                           const struct srnf_pullback_options *options,
                           const struct srnf_context *context,
                           struct srnf_pullback_geodesic *result, struct srnf_error *error)
{
    struct srnf_pullback_options defaults = srnf_pullback_options_defaults();
    int status;

    options = options ? options : &defaults;
    *result = (struct srnf_pullback_geodesic){0};
    status = check_options(options, error);
    status = status ? status : pullback_check_surface(sht, from, "the first end", error);
    status = status ? status : pullback_check_surface(sht, to, "the second end", error);
    status = status ? status : fill(sht, from, to, options, context, result, error);
    if (status < 0) {
        srnf_pullback_geodesic_clear(result);
        return pullback_fail(status, error);
    }
    srnf_report_progress(context, 1.0, "the path is done");
    return result->converged ? SRNF_OK : SRNF_WNOT_CONVERGED;
}

void srnf_pullback_geodesic_clear(struct srnf_pullback_geodesic *result)
{
    srnf_free(result->coefficients);
    srnf_free(result->times);
    *result = (struct srnf_pullback_geodesic){0};
}

int srnf_pullback_log(const struct srnf_sht *sht, const double *from, const double *to,
                      const struct srnf_pullback_options *options,
                      const struct srnf_context *context, double *velocity,
                      struct srnf_pullback_log_figures *figures, struct srnf_error *error)
{
    struct srnf_pullback_options tight = options ? *options : srnf_pullback_options_defaults();
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_pullback_geodesic path;
    int status;

    tight.compare = false;
    tight.gradient = tight.gradient > 0.0 ? tight.gradient : LOG_GRADIENT;
    status = srnf_pullback_geodesic(sht, from, to, &tight, context, &path, error);
    if (status < 0) {
        return status;
    }
    for (size_t i = 0; i < count; i++) {
        velocity[i] = (double)tight.segments * (path.coefficients[count + i] - from[i]);
    }
    if (figures) {
        *figures = (struct srnf_pullback_log_figures){.path = path.path,
                                                      .gradient = path.gradient,
                                                      .iterations = path.iterations,
                                                      .transforms = path.transforms};
    }
    srnf_pullback_geodesic_clear(&path);
    return status;
}
