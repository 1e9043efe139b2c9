/*
 * trajectories.c - how surfaces change with time, within subjects: two stages of least squares.
 *
 * First stage (trajectories_lines.c). With the mean time m_i of subject i and S_i the sum of the
 * squares of its times about that,
 *
 *     b_i = sum over j of (t_ij - m_i) q_ij / S_i,     a_i = mean of q_ij + b_i (r - m_i),
 *
 * r the mean of the m_i. The displacements of the nodes have lines of the same weights.
 *
 * Second stage. b_i = X_i B + error, whose variance is T + V / S_i: slopes differ, and each is
 * known the less the nearer together its visits are. Both are numbers, of squared L2 norms over the
 * whole surface: V what is left about the lines over its degrees of freedom, T such that slopes
 * with their weights are as far from the model as degrees of freedom let expect (R. Paule, J.
 * Mandel 1982; trajectories_between.c). Slopes have the weights w_i = 1 / (T + V / S_i), 1 on
 * average. Where all subjects have as many visits at the same distances all are 1, and where each
 * has two, nothing tells V, and they are 1 as well. Rows and slopes times the roots of w_i have
 * errors of one variance, and all is as in regress.c and paired.c.
 *
 * A predicted surface at covariates x and a time t is that of sum over i of h_i(x) (a_i + b_i (t -
 * r)), h the weights of the second stage: a straight line in q through time, on which the slope is
 * that of the model.
 */
#include "trajectories.h"

#include <math.h>

#define PERMUTATIONS 10000
#define BOOTSTRAPS 1000
#define N_MAX ((size_t)10000)
/* Costs of the parts of a run, for its progress. */
#define COST_LINES 0.4
#define COST_MEAN 0.2
#define COST_MODEL 0.3
#define COST_PREDICT 0.1

struct srnf_trajectories_options srnf_trajectories_options_defaults(void)
{
    return (struct srnf_trajectories_options){.permutations = PERMUTATIONS,
                                              .bootstraps = BOOTSTRAPS};
}

void srnf_trajectories_clear(struct srnf_trajectories *trajectories)
{
    for (size_t k = 0; trajectories->slope_at && k < trajectories->points; k++) {
        srnf_free(trajectories->slope_at[k].normal);
        srnf_free(trajectories->slope_at[k].standard_error);
        srnf_free(trajectories->slope_at[k].confidence);
    }
    srnf_free(trajectories->slope_at);
    srnf_free(trajectories->subject);
    srnf_free(trajectories->exchanged);
    srnf_paired_clear(&trajectories->slope);
    srnf_regression_clear(&trajectories->model);
    *trajectories = (struct srnf_trajectories){0};
}

/* ---- What is given --------------------------------------------------------------------------- */

static int check_numbers(const struct trajectory_run *run, struct srnf_error *error)
{
    const struct srnf_visits *visits = run->visits;
    const struct srnf_regress_design *design = run->design;
    size_t size = 3 * run->points;

    for (size_t i = 0; i < visits->n; i++) {
        if (!isfinite(visits->times[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "the time of member %zu is not finite",
                             i);
        }
        if (!(visits->sizes[i] > 0.0 && isfinite(visits->sizes[i]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "the size of member %zu is not positive", i);
        }
    }
    for (size_t k = 0; k < visits->n * size; k++) {
        if (!isfinite(visits->q[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / size),
                             "the surface of member %zu is not finite", k / size);
        }
    }
    for (size_t k = 0; k < design->points; k++) {
        bool finite = isfinite(visits->at_times[k]);

        for (size_t c = 0; c < design->columns; c++) {
            finite = finite && isfinite(design->at[k * design->columns + c]);
        }
        if (!finite) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)k,
                             "point %zu of the predictions is not finite", k);
        }
    }
    return SRNF_OK;
}

static int check(const struct trajectory_run *run, struct srnf_error *error)
{
    const struct srnf_trajectories_options *options = run->options;
    int status;

    if (run->visits->n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces; at most %zu are taken",
                         run->visits->n, N_MAX);
    }
    status = stats_check_draws(options->permutations, options->bootstraps, error);
    return status ? status : check_numbers(run, error);
}

/* All times lie near enough to each other, and predictions to them. */
static int check_times(struct trajectory_run *run, struct srnf_error *error)
{
    const struct srnf_visits *visits = run->visits;
    const double *times = visits->times;
    size_t first = 0;
    size_t last = 0;
    double span;

    for (size_t i = 1; i < visits->n; i++) {
        first = times[i] < times[first] ? i : first;
        last = times[i] > times[last] ? i : last;
    }
    if (visits->n == 0) {
        return SRNF_OK; /* too few subjects */
    }
    span = times[last] - times[first];
    if (!(span <= SRNF_TIMES_APART_MAX)) {
        return srnf_fail(error, SRNF_EINVAL, (int64_t)last,
                         "member %zu is at the time %g and member %zu at %g, more than %g apart: "
                         "give times in a larger unit",
                         first, times[first], last, times[last], SRNF_TIMES_APART_MAX);
    }
    for (size_t k = 0; k < run->design->points; k++) {
        double at = visits->at_times[k];
        double beyond = fmax(times[first] - at, at - times[last]);

        if (!(beyond <= SRNF_TIMES_BEYOND_MAX * span)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)k,
                             "the time %g of point %zu of the predictions is more than %g times "
                             "the span of the visits, %g to %g, away from them",
                             at, k, SRNF_TIMES_BEYOND_MAX, times[first], times[last]);
        }
    }
    run->origin = times[first];
    return SRNF_OK;
}

/* Each subject needs two times. */
static int check_subjects(const struct trajectory_run *run, struct srnf_error *error)
{
    const struct subjects *s = &run->subjects;

    if (s->count < SRNF_PAIRS_MIN) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu subjects; %zu are needed", s->count,
                         SRNF_PAIRS_MIN);
    }
    for (size_t k = 0; k < s->count; k++) {
        size_t member = s->members[s->start[k]];
        double first = run->visits->times[member];
        double last = first;

        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            first = fmin(first, run->visits->times[s->members[m]]);
            last = fmax(last, run->visits->times[s->members[m]]);
        }
        if (!(last > first)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)member,
                             "the subject of member %zu has one time only; a slope needs two",
                             member);
        }
        if (!(last - first >= SRNF_TIMES_APART_MIN)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)member,
                             "the subject of member %zu is seen from %g to %g, less than %g: give "
                             "times in a smaller unit",
                             member, first, last, SRNF_TIMES_APART_MIN);
        }
    }
    return SRNF_OK;
}

/* ---- The run --------------------------------------------------------------------------------- */

static int open_run(struct trajectory_run *run)
{
    size_t n = run->n;
    size_t columns = run->design->columns;
    double **const fields[] = {&run->slope_q, &run->slope_v, &run->level_q, &run->level_v};
    size_t size;

    if (__builtin_mul_overflow(n, 3 * run->points, &size)) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < sizeof fields / sizeof fields[0]; k++) {
        *fields[k] = srnf_alloc(size, sizeof(double));
        if (!*fields[k]) {
            return SRNF_ENOMEM;
        }
    }
    run->spread = srnf_alloc(4, n * sizeof(double));
    run->values = srnf_alloc(2 * columns + 1, n * sizeof(double));
    run->nested = srnf_alloc(run->design->tests + 1, sizeof *run->nested);
    run->nested_values = srnf_alloc(run->design->tests + 1, sizeof *run->nested_values);
    run->out->subject = srnf_alloc(n, sizeof *run->out->subject);
    run->out->slope_at = srnf_alloc(run->design->points + 1, sizeof *run->out->slope_at);
    if (!run->spread || !run->values || !run->nested || !run->nested_values || !run->out->subject ||
        !run->out->slope_at) {
        return SRNF_ENOMEM;
    }
    run->left = run->spread + n;
    run->weights = run->left + n;
    run->roots = run->weights + n;
    run->scaled = run->values + n * columns;
    return SRNF_OK;
}

static void close_run(struct trajectory_run *run)
{
    for (size_t t = 0; run->nested_values && t < run->design->tests; t++) {
        srnf_free(run->nested_values[t]);
    }
    srnf_free(run->slope_q);
    srnf_free(run->slope_v);
    srnf_free(run->level_q);
    srnf_free(run->level_v);
    srnf_free(run->spread);
    srnf_free(run->values);
    srnf_free(run->nested);
    srnf_free(run->nested_values);
    subjects_clear(&run->subjects);
}

static int compute(struct trajectory_run *run, struct srnf_error *error)
{
    struct stats_part part = {.whole = run->context,
                              .to = 1.0,
                              .all = COST_LINES + COST_MEAN + COST_MODEL + COST_PREDICT};
    struct srnf_context context;
    int status = open_run(run);

    if (status == SRNF_OK) {
        context = stats_part_enter(&part, COST_LINES);
        status = trajectory_lines(run, &context, error);
    }
    status = status ? status : trajectory_weigh(run, error);
    if (status == SRNF_OK) {
        context = stats_part_enter(&part, COST_MEAN);
        status = trajectory_mean(run, &context, error);
    }
    if (status == SRNF_OK) {
        context = stats_part_enter(&part, COST_MODEL);
        status = trajectory_model(run, &context, error);
    }
    if (status == SRNF_OK) {
        context = stats_part_enter(&part, COST_PREDICT);
        status = trajectory_predict(run, &context, error);
    }
    return status ? status : trajectory_doubts(run, error);
}

int srnf_fit_trajectories(const struct srnf_sht *sht, const struct srnf_visits *visits,
                          const struct srnf_regress_design *design,
                          const struct srnf_trajectories_options *options,
                          const struct srnf_context *context,
                          struct srnf_trajectories *trajectories, struct srnf_error *error)
{
    struct srnf_trajectories_options defaults = srnf_trajectories_options_defaults();
    struct srnf_trajectories found = {.n = visits->n, .points = design->points};
    struct srnf_error first = {0};
    struct trajectory_run run = {.sht = sht,
                                 .visits = visits,
                                 .design = design,
                                 .options = options ? options : &defaults,
                                 .context = context,
                                 .points = stats_points(srnf_sht_grid(sht)),
                                 .out = &found};
    int status = check(&run, &first);

    status = status ? status : check_times(&run, &first);
    status = status ? status : subjects_open(&run.subjects, visits->n, visits->subjects, &first);
    status = status ? status : check_subjects(&run, &first);
    run.n = run.subjects.count;
    found.subjects = run.n;
    status = status ? status : compute(&run, &first);
    close_run(&run);
    if (status) {
        srnf_trajectories_clear(&found);
        return stats_fail(error, status, &first);
    }
    found.reference += run.origin;
    *trajectories = found;
    return SRNF_OK;
}
