/*
 * mean_steps.c - the paper's way to the Karcher mean (Algorithm 1 of its section 4): v is
 * the average of the logarithms of all surfaces at the current mean, the next mean exp(v). Kept for
 * the comparison with the graph of mean.c.
 *
 * It ends when ||v|| is small against the root of the variance, after max_iterations, or when ||v||
 * has not fallen for three steps: it has then stalled.
 *
 * Cost of a step: n tight geodesics and one exponential.
 */
#include "mean.h"

#include <math.h>

#define STALLED_STEPS ((size_t)3)
#define STALLED_PART 0.95 /* what a step must bring ||v|| below, of the best so far */
#define LOG_GRADIENT 1e-6 /* well below the tolerances that make sense here */

struct steps {
    const struct pullback_group *group;
    double *memory, *velocity, *field;
    struct pullback_tangent tangent;
};

static int create(struct steps *s, const struct pullback_group *group)
{
    s->group = group;
    s->memory = srnf_alloc(group->count + 3 * group->points, sizeof(double));
    if (!s->memory) {
        return SRNF_ENOMEM;
    }
    s->velocity = s->memory;
    s->field = s->memory + group->count;
    return pullback_tangent_create(&s->tangent, group->sht, group->context);
}

static void destroy(struct steps *s)
{
    pullback_tangent_destroy(&s->tangent);
    srnf_free(s->memory);
}

/* Adds a part of the logarithm of one surface to the velocity; its distance. */
static int add_logarithm(struct steps *s, struct srnf_pullback_mean *mean, size_t i,
                         struct srnf_error *error)
{
    const struct pullback_group *group = s->group;
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    double part = (double)group->options->segments / (double)group->n;
    struct srnf_pullback_geodesic path;
    int status;

    options.segments = group->options->segments;
    options.gradient = LOG_GRADIENT;
    options.compare = false;
    status = srnf_pullback_geodesic(group->sht, mean->coefficients, group->surfaces[i], &options,
                                    &group->quiet, &path, error);
    if (status < 0) {
        return status;
    }
    linear_axpy(group->count, part, path.coefficients + group->count, s->velocity);
    linear_axpy(group->count, -part, mean->coefficients, s->velocity);
    mean->distances[i] = path.path.length;
    mean->transforms += path.transforms;
    srnf_pullback_geodesic_clear(&path);
    return SRNF_OK;
}

/* The average of the logarithms at the mean, its norm, and the distances. */
static int average_velocity(struct steps *s, struct srnf_pullback_mean *mean,
                            struct srnf_error *error)
{
    const struct pullback_group *group = s->group;

    for (size_t i = 0; i < group->count; i++) {
        s->velocity[i] = 0.0;
    }
    for (size_t i = 0; i < group->n; i++) {
        int status = add_logarithm(s, mean, i, error);

        if (status) {
            return status;
        }
    }
    pullback_tangent_at(&s->tangent, mean->coefficients);
    pullback_tangent_image(&s->tangent, s->velocity, s->field);
    mean->mean_velocity = pullback_tangent_norm(&s->tangent, s->field);
    return SRNF_OK;
}

static int take_step(struct steps *s, struct srnf_pullback_mean *mean, struct srnf_error *error)
{
    const struct pullback_group *group = s->group;
    size_t m = group->options->segments;
    struct srnf_pullback_shot shot;
    int status = srnf_pullback_exp(group->sht, mean->coefficients, s->velocity, m, &group->quiet,
                                   &shot, error);

    if (status < 0) {
        return status;
    }
    linear_copy(group->count, shot.coefficients + m * group->count, mean->coefficients);
    mean->transforms += shot.transforms;
    srnf_pullback_shot_clear(&shot);
    return SRNF_OK;
}

static int iterate(struct steps *s, struct srnf_pullback_mean *mean, struct srnf_error *error)
{
    const struct pullback_group *group = s->group;
    double best = HUGE_VAL;
    size_t since = 0;

    for (;;) {
        double spread;
        int status = average_velocity(s, mean, error);

        if (status) {
            return status;
        }
        mean->history[mean->iterations++] = mean->mean_velocity;
        spread = sqrt(linear_dot(group->n, mean->distances, mean->distances) / (double)group->n);
        mean->converged = mean->mean_velocity <= group->options->tolerance * spread;
        since = mean->mean_velocity < STALLED_PART * best ? 0 : since + 1;
        best = fmin(best, mean->mean_velocity);
        mean->stalled = !mean->converged && since >= STALLED_STEPS;
        if (mean->converged || mean->stalled ||
            mean->iterations >= group->options->max_iterations) {
            return SRNF_OK;
        }
        status = take_step(s, mean, error);
        if (status) {
            return status;
        }
        srnf_report_progress(group->context,
                             1.0 - (1.0 - PULLBACK_MEAN_STARTED) /
                                       (1.0 + 0.5 * (double)mean->iterations),
                             "averaging velocities");
    }
}

int pullback_mean_steps(const struct pullback_group *group, struct srnf_pullback_mean *mean,
                        struct srnf_error *error)
{
    struct steps s = {0};
    int status = create(&s, group);

    if (status == SRNF_OK) {
        linear_copy(group->count, mean->extrinsic, mean->coefficients);
        status = iterate(&s, mean, error);
    }
    if (status == SRNF_OK) {
        mean->transforms += s.tangent.system->transforms;
    }
    destroy(&s);
    return status;
}
