/*
 * folds_align.c - all subjects of a comparison registered to their mean, and single subjects
 * registered again to a target nearby.
 *
 * Minimises the mean of ||mu - O_i (q_i, gamma_i)||^2 as the Karcher mean does (mean.c), for either
 * representation, in few rounds and without centring: a warp that all have in common changes no
 * distance between them. The first round registers from nothing, to the medoid or, in a common
 * pose, to the plain mean; the later ones take a few Gauss-Newton steps.
 *
 * The Gauss-Newton matrix of a moving surface does not depend on the target but for the scale
 * 1 / ||mu||^2, nor on gamma (registration.h). It is assembled once a subject and serves every
 * round and every fold; targets differ by so little in norm that the scale is left alone.
 *
 * Memory: 80 P bytes a subject, and 8 unknowns^2 (0.9 MB at degree 12).
 */
#include "folds.h"

#include <math.h>
#include <string.h>

#define ROUND_STEPS 3
#define STEP_DECREASE 1e-4 /* two steps that gain less than this part end a refinement */

void alignment_clear(struct alignment *a)
{
    srnf_free(a->nodes);
    srnf_free(a->weight);
    srnf_free(a->mean_q);
    srnf_free(a->q);
    srnf_free(a->gamma);
    srnf_free(a->jacobian);
    srnf_free(a->rotation);
    srnf_free(a->matrices);
}

int alignment_create(struct alignment *a, const struct srnf_sht *sht, size_t n,
                     const double *const *surfaces, const struct srnf_compare_options *options,
                     enum srnf_representation representation, const struct srnf_context *context)
{
    size_t fields;
    size_t squares;

    *a = (struct alignment){.sht = sht,
                            .grid = srnf_sht_grid(sht),
                            .context = context,
                            .registration = options->registration,
                            .n = n,
                            .points = stats_points(srnf_sht_grid(sht)),
                            .degree = srnf_sht_degree(sht),
                            .unknowns = registration_unknowns(options->registration.degree),
                            .surfaces = surfaces};
    a->registration.representation = representation;
    a->registration.symmetric = false;
    if (__builtin_mul_overflow(n, 3 * a->points, &fields) ||
        __builtin_mul_overflow(n, a->unknowns * a->unknowns, &squares)) {
        return SRNF_ENOMEM;
    }
    a->nodes = srnf_alloc(3 * a->points, sizeof(double));
    a->weight = srnf_alloc(a->points, sizeof(double));
    a->mean_q = srnf_alloc(3 * a->points, sizeof(double));
    a->q = srnf_alloc(fields, sizeof(double));
    a->gamma = srnf_alloc(fields, sizeof(double));
    a->jacobian = srnf_alloc(fields / 3, sizeof(double));
    a->rotation = srnf_alloc(n, 9 * sizeof(double));
    a->matrices = srnf_alloc(squares, sizeof(double));
    if (!a->nodes || !a->weight || !a->mean_q || !a->q || !a->gamma || !a->jacobian ||
        !a->rotation || !a->matrices) {
        return SRNF_ENOMEM;
    }
    registration_nodes(a->grid, a->nodes, a->weight);
    return SRNF_OK;
}

struct target alignment_target(const struct alignment *a, const double *field, double *memory)
{
    struct target target = {a->points, a->nodes, a->weight, memory, 0.0};

    for (size_t i = 0; i < a->points; i++) {
        for (size_t c = 0; c < 3; c++) {
            memory[3 * i + c] = field[c * a->points + i];
        }
    }
    target.norm2 = srnf_inner_product(a->grid, field, field);
    return target;
}

/* ---- One subject ----------------------------------------------------------------------------- */

/* The problem of subject i; moving is filled, and cleared by the caller. */
static int open_problem(const struct alignment *a, size_t i, const struct target *target,
                        struct moving *moving, struct problem *problem)
{
    const struct srnf_register_options *o = &a->registration;
    int status = moving_create(moving, a->degree, a->surfaces[i], a->degree);

    moving->representation = o->representation;
    *problem = (struct problem){.target = *target,
                                .moving = moving,
                                .penalty = {o->penalty_jacobian, o->penalty_displacement},
                                .free_rotation = o->rotation && !o->common_pose};
    return status;
}

/* O sqrt(J) q at the points of a warp, from samples there. */
static void take_field(const struct warp *warp, const struct samples *samples, double *q)
{
    for (size_t i = 0; i < warp->n; i++) {
        double root = sqrt(warp->jacobian[i]);

        for (size_t k = 0; k < 3; k++) {
            q[k * warp->n + i] = root * vector_dot(warp->rotation + 3 * k, samples->q + 3 * i);
        }
    }
}

int alignment_refine(const struct alignment *a, size_t i, const struct target *target, size_t steps,
                     const struct srnf_context *context, double *q, double *points,
                     double *jacobian, double *rotation)
{
    struct schedule schedule = {steps, STEP_DECREASE};
    struct level level = {.matrix = a->matrices + i * a->unknowns * a->unknowns};
    struct moving moving = {0};
    struct problem problem;
    struct warp warp = {0};
    struct samples samples = {0};
    size_t iterations = 0;
    int status = open_problem(a, i, target, &moving, &problem);

    status = status ? status : fields_create(&level.fields, a->registration.degree);
    status = status ? status : warp_create(&warp, target);
    status = status ? status : samples_create(&samples, a->points);
    if (status) {
        goto out;
    }
    memcpy(warp.points, a->gamma + 3 * i * a->points, 3 * a->points * sizeof(double));
    memcpy(warp.jacobian, a->jacobian + i * a->points, a->points * sizeof(double));
    memcpy(warp.rotation, a->rotation + 9 * i, sizeof warp.rotation);
    status =
        registration_optimise(&problem, &level, &schedule, context, &warp, &samples, &iterations);
    if (status) {
        goto out;
    }
    take_field(&warp, &samples, q);
    if (points) {
        memcpy(points, warp.points, 3 * a->points * sizeof(double));
        memcpy(jacobian, warp.jacobian, a->points * sizeof(double));
        memcpy(rotation, warp.rotation, sizeof warp.rotation);
    }
out:
    fields_clear(&level.fields);
    warp_clear(&warp);
    samples_clear(&samples);
    moving_clear(&moving);
    return status;
}

/* ---- Rounds ---------------------------------------------------------------------------------- */

struct round {
    struct alignment *a;
    struct target target; /* of the mean */
};

static int assemble(const struct round *round, size_t i)
{
    const struct alignment *a = round->a;
    size_t size = a->unknowns * a->unknowns;
    struct moving moving = {0};
    struct problem problem;
    struct level level = {.matrix = NULL};
    int status = open_problem(a, i, &round->target, &moving, &problem);

    status = status ? status : level_create(&level, &problem, a->registration.degree);
    if (status == SRNF_OK) {
        memcpy(a->matrices + i * size, level.matrix, size * sizeof(double));
        level_clear(&level);
    }
    moving_clear(&moving);
    return status;
}

static int register_body(void *argument, size_t i, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const struct round *round = argument;
    struct alignment *a = round->a;
    struct srnf_registration found = {0};
    int status = srnf_register(a->sht, NULL, a->mean_q, a->surfaces[i], &a->registration, NULL,
                               context, &found, error);

    if (status < 0) {
        return status;
    }
    memcpy(a->q + 3 * i * a->points, found.q, 3 * a->points * sizeof(double));
    memcpy(a->gamma + 3 * i * a->points, found.points, 3 * a->points * sizeof(double));
    memcpy(a->jacobian + i * a->points, found.jacobian, a->points * sizeof(double));
    memcpy(a->rotation + 9 * i, found.rotation, sizeof found.rotation);
    srnf_registration_clear(&found);
    return assemble(round, i);
}

static int refine_body(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    const struct round *round = argument;
    struct alignment *a = round->a;

    (void)error;
    return alignment_refine(a, i, &round->target, ROUND_STEPS, context, a->q + 3 * i * a->points,
                            a->gamma + 3 * i * a->points, a->jacobian + i * a->points,
                            a->rotation + 9 * i);
}

struct medoid {
    const struct alignment *a;
    double *sums; /* [n] of the distances from all */
};

static int sum_body(void *argument, size_t i, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct medoid *medoid = argument;
    const struct alignment *a = medoid->a;

    (void)context;
    (void)error;
    for (size_t j = 0; j < a->n; j++) {
        medoid->sums[i] +=
            sqrt(stats_distance2(a->grid, a->q + 3 * i * a->points, a->q + 3 * j * a->points));
    }
    return SRNF_OK;
}

/* The first target, from the fields as they are parameterised. */
static int start(struct alignment *a, struct srnf_error *error)
{
    struct medoid medoid = {a, srnf_alloc(a->n, sizeof(double))};
    size_t best = 0;
    int status = medoid.sums ? stats_represent(a->sht, a->registration.representation, a->n,
                                               a->surfaces, a->context, a->q, error)
                             : SRNF_ENOMEM;

    if (status == SRNF_OK && a->registration.common_pose) {
        stats_average(a->grid, a->n, a->q, a->mean_q);
    } else if (status == SRNF_OK) {
        status = stats_run(a->context, a->n, sum_body, &medoid, (struct stats_progress){0}, error);
        for (size_t i = 1; i < a->n; i++) {
            best = medoid.sums[i] < medoid.sums[best] ? i : best;
        }
        memcpy(a->mean_q, a->q + 3 * best * a->points, 3 * a->points * sizeof(double));
    }
    srnf_free(medoid.sums);
    return status;
}

int alignment_run(struct alignment *a, size_t rounds, struct stats_progress progress,
                  struct srnf_error *error)
{
    struct round round = {.a = a};
    double *memory = srnf_alloc(3 * a->points, sizeof(double));
    int status = memory ? start(a, error) : SRNF_ENOMEM;

    for (size_t k = 0; k < rounds && status == SRNF_OK; k++) {
        struct stats_progress part = progress;

        /* The first round takes most of the time. */
        part.from = k == 0 ? progress.from : progress.to - (progress.to - progress.from) * 0.1;
        part.to = k == 0 ? progress.to - (progress.to - progress.from) * 0.1 : progress.to;
        round.target = alignment_target(a, a->mean_q, memory);
        status =
            stats_run(a->context, a->n, k == 0 ? register_body : refine_body, &round, part, error);
        if (status == SRNF_OK) {
            stats_average(a->grid, a->n, a->q, a->mean_q);
        }
    }
    srnf_free(memory);
    return status;
}
