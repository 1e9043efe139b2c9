/*
 * mean.c - the Karcher mean of surfaces in the pulled-back metric.
 *
 * graph    the least sum of squared lengths is the energy of a star: a chain of m segments from
 *          each surface, fixed, to one centre, free. All geodesics and the centre are unknowns of
 *          one least-squares problem (solve.c).
 * log-exp  the paper's (Algorithm 1): the average of the logarithms of all surfaces at the current
 *          mean, one step of the exponential map along it, and again (mean_steps.c). The
 *          average velocity does not fall to 0, because the logarithm of a path of m segments is
 *          off by O(1 / m) while its length is not; what it stalls at is reported.
 *
 * Both start from the extrinsic mean: the average of the q, inverted from the average of the
 * surfaces. At the minimum the mean velocity, the projection of the mean of m (q_i - q) over the
 * first surfaces of the paths from the centre to the tangent space there, is 0.
 *
 * Cost of the graph: 3 to 10 steps, 100 to 1000 transforms a free surface.
 */
#include "mean.h"

#include <math.h>
#include <stdio.h>

#define SEGMENTS 8
#define GRAPH_TOLERANCE 1e-7
#define GRAPH_ITERATIONS 100
#define STEPS_TOLERANCE 1e-3
#define STEPS_ITERATIONS 20
#define SURFACES_MAX ((size_t)10000)

struct srnf_pullback_mean_options srnf_pullback_mean_defaults(enum srnf_pullback_mean_method method)
{
    bool graph = method == SRNF_PULLBACK_MEAN_GRAPH;

    return (struct srnf_pullback_mean_options){
        .method = method,
        .segments = SEGMENTS,
        .tolerance = graph ? GRAPH_TOLERANCE : STEPS_TOLERANCE,
        .max_iterations = graph ? GRAPH_ITERATIONS : STEPS_ITERATIONS,
    };
}

static int check(const struct pullback_group *group, struct srnf_error *error)
{
    const struct srnf_pullback_mean_options *options = group->options;
    int status = pullback_check_segments(options->segments, error);
    char name[40];

    if (status) {
        return status;
    }
    if (options->method != SRNF_PULLBACK_MEAN_GRAPH &&
        options->method != SRNF_PULLBACK_MEAN_LOG_EXP) {
        return srnf_fail(error, SRNF_EINVAL, -1, "method %d is none", (int)options->method);
    }
    if (!(options->tolerance >= 0.0 && options->tolerance <= 1.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "tolerance %g is not in [0, 1]",
                         options->tolerance);
    }
    if (options->max_iterations == 0 || group->n == 0 || group->n > SURFACES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         options->max_iterations == 0 ? "max_iterations is 0"
                         : group->n == 0              ? "there is no surface"
                                                      : "more than 10000 surfaces");
    }
    for (size_t i = 0; i < group->n && status == SRNF_OK; i++) {
        (void)snprintf(name, sizeof name, "surface %zu", i);
        status = pullback_check_surface(group->sht, group->surfaces[i], name, error);
    }
    return status;
}

/* ---- The extrinsic mean ---------------------------------------------------------------------- */

/* Averages of the fields and of the surfaces. */
static void average(const struct pullback_group *group, double *field, double *q, double *surface,
                    void *workspace)
{
    size_t size = 3 * group->points;
    double part = 1.0 / (double)group->n;

    for (size_t i = 0; i < group->n; i++) {
        srnf_field(group->sht, group->surfaces[i], field, workspace);
        linear_axpy(size, part, field, q);
        linear_axpy(group->count, part, group->surfaces[i], surface);
    }
}

/* mean->extrinsic, with the translation of the average surface. */
static int find_extrinsic(const struct pullback_group *group, struct srnf_pullback_mean *mean,
                          struct srnf_error *error)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    size_t size = 3 * group->points;
    double *fields = srnf_alloc(2 * size, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(group->sht));
    struct srnf_inversion inversion;
    int status = SRNF_ENOMEM;

    if (fields && workspace) {
        average(group, fields, fields + size, mean->extrinsic, workspace);
        options.initial = SRNF_INITIAL_SURFACE;
        options.surface = mean->extrinsic;
        options.certify = false;
        status = srnf_invert(group->sht, fields + size, &options, &group->quiet, &inversion, error);
    }
    if (status >= 0) { /* an average that is no SRNF has no exact inverse: that is no failure */
        for (size_t i = 0; i < group->count; i++) {
            bool translation = i % (group->count / 3) == 0;

            mean->extrinsic[i] = translation ? mean->extrinsic[i] : inversion.coefficients[i];
        }
        mean->transforms += inversion.transforms;
        srnf_inversion_clear(&inversion);
        status = SRNF_OK;
    }
    srnf_free(fields);
    srnf_free(workspace);
    return status;
}

/* ---- The star -------------------------------------------------------------------------------- */

/* Node i m + j is surface j on the way from surface i to the centre, node n m. */
static int create_star(const struct pullback_group *group, struct pullback_graph **graph)
{
    size_t m = group->options->segments;
    size_t centre = group->n * m;
    size_t *parents = srnf_alloc(centre + 1, sizeof *parents);
    bool *fixed = srnf_alloc(centre + 1, sizeof *fixed);
    int status = SRNF_ENOMEM;

    *graph = NULL;
    if (parents && fixed) {
        for (size_t i = 0; i < centre; i++) {
            parents[i] = i % m + 1 < m ? i + 1 : centre;
            fixed[i] = i % m == 0;
        }
        parents[centre] = PULLBACK_ROOT;
        status = pullback_graph_create(graph, group->sht, group->context, centre + 1, parents,
                                       fixed, (double)m);
    }
    srnf_free(parents);
    srnf_free(fixed);
    return status;
}

/* Straight lines from all surfaces to the extrinsic mean. */
static void lay_star(const struct pullback_group *group, const double *centre, double *f)
{
    size_t m = group->options->segments;

    for (size_t i = 0; i < group->n; i++) {
        for (size_t j = 0; j < m; j++) {
            pullback_mix(group->count, (double)j / (double)m, group->surfaces[i], centre,
                         f + (i * m + j) * group->count);
        }
    }
    linear_copy(group->count, centre, f + group->n * m * group->count);
}

/* Lengths of the chains, from the energies of their edges. */
static void measure_chains(const struct pullback_group *group, const struct pullback_graph *graph,
                           struct srnf_pullback_mean *mean)
{
    size_t m = group->options->segments;

    for (size_t i = 0; i < group->n; i++) {
        mean->distances[i] = 0.0;
        for (size_t j = 0; j < m; j++) {
            mean->distances[i] += sqrt(graph->node[i * m + j].edge / (double)m);
        }
    }
}

/* The mean of m (q_i - q) over the neighbours of the centre, projected; scratch in the slot. */
static int measure_velocity(const struct pullback_group *group, const struct pullback_graph *graph,
                            struct srnf_pullback_mean *mean)
{
    size_t m = group->options->segments;
    size_t size = 3 * group->points;
    const double *centre = graph->node[group->n * m].q;
    double *memory = srnf_alloc(2 * size + group->count, sizeof(double));
    struct pullback_tangent t = {0};
    int status = memory ? pullback_tangent_create(&t, group->sht, group->context) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        for (size_t i = 0; i < group->n; i++) {
            double part = (double)m / (double)group->n;

            linear_axpy(size, part, graph->node[(i + 1) * m - 1].q, memory);
            linear_axpy(size, -part, centre, memory);
        }
        pullback_tangent_at(&t, mean->coefficients);
        pullback_tangent_project(&t, memory, memory + 2 * size, memory + size);
        mean->mean_velocity = pullback_tangent_norm(&t, memory + size);
        mean->transforms += t.system->transforms;
    }
    pullback_tangent_destroy(&t);
    srnf_free(memory);
    return status;
}

static int solve_star(const struct pullback_group *group, struct srnf_pullback_mean *mean)
{
    size_t nodes = group->n * group->options->segments + 1;
    struct pullback_solve solve = {.decrease = group->options->tolerance,
                                   .max_steps = group->options->max_iterations,
                                   .progress_from = PULLBACK_MEAN_STARTED,
                                   .progress_to = 1.0,
                                   .message = "straightening the paths to the mean"};
    struct pullback_graph *graph = NULL;
    double *f = NULL;
    size_t values;
    int status;

    if (__builtin_mul_overflow(nodes, group->count, &values)) {
        return SRNF_ENOMEM;
    }
    status = create_star(group, &graph);
    f = status ? NULL : srnf_alloc(values, sizeof(double));
    status = status || f ? status : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        lay_star(group, mean->extrinsic, f);
        status = pullback_minimize(graph, f, &solve);
    }
    if (status == SRNF_OK) {
        /* Edges belong to the last trial, which may have been refused. */
        (void)pullback_graph_start(graph, f);
        linear_copy(group->count, f + (nodes - 1) * group->count, mean->coefficients);
        measure_chains(group, graph, mean);
        status = measure_velocity(group, graph, mean);
        mean->iterations = solve.steps;
        mean->converged = solve.converged;
        mean->transforms += graph->transforms;
    }
    pullback_graph_destroy(graph);
    srnf_free(f);
    return status;
}

/* ---- The result ------------------------------------------------------------------------------ */

/* Variance, and the way from the extrinsic mean. */
static int finish(const struct pullback_group *group, struct srnf_pullback_mean *mean)
{
    struct srnf_path_figures moved;
    double *pair = srnf_alloc(2 * group->count, sizeof(double));
    int status;

    if (!pair) {
        return SRNF_ENOMEM;
    }
    linear_copy(group->count, mean->extrinsic, pair);
    linear_copy(group->count, mean->coefficients, pair + group->count);
    status = pullback_measure(group->sht, group->context, 1, pair, NULL, &moved);
    mean->moved = moved.length;
    mean->variance = linear_dot(group->n, mean->distances, mean->distances) / (double)group->n;
    srnf_free(pair);
    return status;
}

static int allocate(const struct pullback_group *group, struct srnf_pullback_mean *mean)
{
    bool steps = group->options->method == SRNF_PULLBACK_MEAN_LOG_EXP;

    mean->n = group->n;
    mean->coefficients = srnf_alloc(2 * group->count, sizeof(double));
    mean->distances = srnf_alloc(group->n, sizeof(double));
    mean->history = steps ? srnf_alloc(group->options->max_iterations, sizeof(double)) : NULL;
    if (!mean->coefficients || !mean->distances || (steps && !mean->history)) {
        return SRNF_ENOMEM;
    }
    mean->extrinsic = mean->coefficients + group->count;
    return SRNF_OK;
}

int srnf_pullback_mean(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                       const struct srnf_pullback_mean_options *options,
                       const struct srnf_context *context, struct srnf_pullback_mean *mean,
                       struct srnf_error *error)
{
    struct srnf_pullback_mean_options defaults =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    struct pullback_group group = {
        .sht = sht,
        .n = n,
        .points = srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi,
        .count = 3 * srnf_coefficient_count(srnf_sht_degree(sht)),
        .surfaces = surfaces,
        .options = options ? options : &defaults,
        .context = context,
        .quiet = srnf_quiet(context),
    };
    int status;

    *mean = (struct srnf_pullback_mean){0};
    status = check(&group, error);
    status = status ? status : allocate(&group, mean);
    status = status ? status : find_extrinsic(&group, mean, error);
    if (status == SRNF_OK) {
        srnf_report_progress(context, PULLBACK_MEAN_STARTED, "the extrinsic mean is found");
        status = group.options->method == SRNF_PULLBACK_MEAN_GRAPH
                     ? solve_star(&group, mean)
                     : pullback_mean_steps(&group, mean, error);
    }
    status = status ? status : finish(&group, mean);
    if (status) {
        srnf_pullback_mean_clear(mean);
        return pullback_fail(status, error);
    }
    return mean->converged ? SRNF_OK : SRNF_WNOT_CONVERGED;
}

void srnf_pullback_mean_clear(struct srnf_pullback_mean *mean)
{
    srnf_free(mean->coefficients);
    srnf_free(mean->distances);
    srnf_free(mean->history);
    *mean = (struct srnf_pullback_mean){0};
}
