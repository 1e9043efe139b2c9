/*
 * folds_align.c - all subjects of a comparison registered to a template, and then, in rounds, to
 * their mean or to that of all but one.
 *
 * The registrations to a template are srnf_register's searches, from nothing, or found elsewhere
 * (srnf_context.search). A round averages the fields
 * O sqrt(J) q_i(gamma_i) of the training subjects and registers every subject to the average by a
 * few Gauss-Newton steps from where it is: the iteration of the Karcher mean (mean.c), without
 * centring, since a warp that all have in common changes no distance between them.
 *
 * The Gauss-Newton matrix of a moving surface does not depend on the target but for the scale
 * 1 / ||q1||^2, nor on gamma (registration.h). It is assembled once a subject and serves every
 * round and fold: with the norm of the subject's own field, so that it knows of no other subject.
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
    srnf_free(a->q);
    srnf_free(a->gamma);
    srnf_free(a->jacobian);
    srnf_free(a->rotation);
    srnf_free(a->matrices);
}

int alignment_create(struct alignment *a, const struct srnf_sht *sht, size_t n,
                     const double *const *surfaces, const struct srnf_folds_options *options,
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
    a->q = srnf_alloc(fields, sizeof(double));
    a->gamma = srnf_alloc(fields, sizeof(double));
    a->jacobian = srnf_alloc(fields / 3, sizeof(double));
    a->rotation = srnf_alloc(n, 9 * sizeof(double));
    a->matrices = srnf_alloc(squares, sizeof(double));
    if (!a->nodes || !a->weight || !a->q || !a->gamma || !a->jacobian || !a->rotation ||
        !a->matrices) {
        return SRNF_ENOMEM;
    }
    registration_nodes(a->grid, a->nodes, a->weight);
    return SRNF_OK;
}

static struct target alignment_target(const struct alignment *a, const double *field,
                                      double *memory)
{
    struct target target = {.n = a->points, .points = a->nodes, .weight = a->weight, .q = memory};

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
    int status = moving_create(moving, a->degree, a->surfaces[i], a->degree, a->context);

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

static int refine(struct alignment *a, size_t i, const struct target *target,
                  const struct srnf_context *context)
{
    struct schedule schedule = {ROUND_STEPS, STEP_DECREASE};
    struct level level = {.matrix = a->matrices + i * a->unknowns * a->unknowns};
    double *points = a->gamma + 3 * i * a->points;
    double *jacobian = a->jacobian + i * a->points;
    struct moving moving = {0};
    struct problem problem;
    struct warp warp = {0};
    struct samples samples = {0};
    size_t iterations = 0;
    int status = open_problem(a, i, target, &moving, &problem);

    status = status ? status : fields_create(&level.fields, a->registration.degree, a->context);
    status = status ? status : warp_create(&warp, target);
    status = status ? status : samples_create(&samples, a->points);
    if (status) {
        goto out;
    }
    memcpy(warp.points, points, 3 * a->points * sizeof(double));
    memcpy(warp.jacobian, jacobian, a->points * sizeof(double));
    memcpy(warp.rotation, a->rotation + 9 * i, sizeof warp.rotation);
    status =
        registration_optimize(&problem, &level, &schedule, context, &warp, &samples, &iterations);
    if (status) {
        goto out;
    }
    take_field(&warp, &samples, a->q + 3 * i * a->points);
    memcpy(points, warp.points, 3 * a->points * sizeof(double));
    memcpy(jacobian, warp.jacobian, a->points * sizeof(double));
    memcpy(a->rotation + 9 * i, warp.rotation, sizeof warp.rotation);
out:
    fields_clear(&level.fields);
    warp_clear(&warp);
    samples_clear(&samples);
    moving_clear(&moving);
    return status;
}

/* ---- All subjects ---------------------------------------------------------------------------- */

struct round {
    struct alignment *a;
    struct target target;
    const double *field;    /* of the target, [3][P] */
    const uint64_t *series; /* of the fields that are kept, or NULL */
};

struct assembly {
    struct alignment *a;
    const double *fields;
};

static int assemble_body(void *argument, size_t i, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const struct assembly *assembly = argument;
    const struct alignment *a = assembly->a;
    const double *field = assembly->fields + 3 * i * a->points;
    size_t size = a->unknowns * a->unknowns;
    struct target target = {.norm2 = srnf_inner_product(a->grid, field, field)};
    struct moving moving = {0};
    struct problem problem;
    struct level level = {.matrix = NULL};
    int status = open_problem(a, i, &target, &moving, &problem);

    (void)context;
    (void)error;
    if (status == SRNF_OK) {
        status = target.norm2 > 0.0 ? level_create(&level, &problem, a->registration.degree)
                                    : SRNF_EDEGENERATE;
    }
    if (status == SRNF_OK) {
        memcpy(a->matrices + i * size, level.matrix, size * sizeof(double));
        level_clear(&level);
    }
    moving_clear(&moving);
    return status;
}

int alignment_assemble(struct alignment *a, const double *fields, struct srnf_error *error)
{
    struct assembly assembly = {a, fields};

    return stats_run(a->context, a->n, assemble_body, &assembly, (struct stats_progress){0}, error);
}

/* What follows from a registration of member i. */
static int lay(const struct round *round, size_t i, const double rotation[9],
               const struct srnf_warp *warp, const struct srnf_context *context)
{
    struct alignment *a = round->a;
    double *q = a->q + 3 * i * a->points;
    int status = registration_lay(a->sht, a->registration.representation, a->surfaces[i], rotation,
                                  warp, context, a->gamma + 3 * i * a->points,
                                  a->jacobian + i * a->points, q, NULL);

    memcpy(a->rotation + 9 * i, rotation, 9 * sizeof(double));
    if (status == SRNF_OK && round->series) {
        stats_keep(context, *round->series, i, 3 * a->points, q);
    }
    return status;
}

static int register_body(void *argument, size_t i, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const struct round *round = argument;
    struct alignment *a = round->a;
    struct srnf_warp warp = {0};
    double rotation[9];
    int status;

    if (round->series &&
        stats_recall(context, *round->series, i, 3 * a->points, a->q + 3 * i * a->points)) {
        return SRNF_OK;
    }
    status = srnf_register_to_field(a->sht, round->field, 0.0, a->surfaces[i], &a->registration,
                                    context, rotation, &warp, error);
    status = status ? status : lay(round, i, rotation, &warp, context);
    srnf_warp_clear(&warp);
    return status;
}

static int take_one(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    const struct round *round = argument;
    int status = lay(round, i, rotation, warp, round->a->context);

    srnf_warp_clear(warp);
    return status;
}

int alignment_register(struct alignment *a, const double *field, const uint64_t *series,
                       struct stats_progress progress, struct srnf_error *error)
{
    struct round round = {.a = a, .field = field, .series = series};
    const struct srnf_field_search search = {.sht = a->sht,
                                             .field = field,
                                             .options = &a->registration,
                                             .n = a->n,
                                             .surfaces = a->surfaces,
                                             .from = progress.from,
                                             .to = progress.to,
                                             .take = take_one,
                                             .argument = &round};
    int status = a->context && a->context->search
                     ? a->context->search(a->context->user, &search, error)
                     : SRNF_SEARCH_HERE;

    return status == SRNF_SEARCH_HERE
               ? stats_run(a->context, a->n, register_body, &round, progress, error)
               : status;
}

static int refine_body(void *argument, size_t i, const struct srnf_context *context,
                       struct srnf_error *error)
{
    const struct round *round = argument;

    (void)error;
    return refine(round->a, i, &round->target, context);
}

int alignment_round(struct alignment *a, const struct subjects *subjects, size_t left_out,
                    const struct srnf_context *context, struct srnf_error *error)
{
    size_t size = 3 * a->points;
    double *mean = srnf_alloc(2 * size, sizeof(double));
    struct round round = {.a = a};
    size_t out = left_out < subjects->count ? subjects->size[left_out] : 0;
    double training = (double)(a->n - out);
    int status = SRNF_ENOMEM;

    if (!mean) {
        return status;
    }
    for (size_t j = 0; j < a->n; j++) {
        for (size_t m = 0; m < size && subjects->of[j] != left_out; m++) {
            mean[m] += a->q[j * size + m] / training;
        }
    }
    round.target = alignment_target(a, mean, mean + size);
    status = stats_run(context, a->n, refine_body, &round, (struct stats_progress){0}, error);
    srnf_free(mean);
    return status;
}

int alignment_copy(const struct alignment *from, struct alignment *to)
{
    size_t all = from->n * from->points;

    *to = *from;
    to->q = srnf_alloc(3 * all, sizeof(double));
    to->gamma = srnf_alloc(3 * all, sizeof(double));
    to->jacobian = srnf_alloc(all, sizeof(double));
    to->rotation = srnf_alloc(9 * from->n, sizeof(double));
    if (!to->q || !to->gamma || !to->jacobian || !to->rotation) {
        return SRNF_ENOMEM;
    }
    memcpy(to->q, from->q, 3 * all * sizeof(double));
    memcpy(to->gamma, from->gamma, 3 * all * sizeof(double));
    memcpy(to->jacobian, from->jacobian, all * sizeof(double));
    memcpy(to->rotation, from->rotation, 9 * from->n * sizeof(double));
    return SRNF_OK;
}

void alignment_clear_copy(struct alignment *copy)
{
    srnf_free(copy->q);
    srnf_free(copy->gamma);
    srnf_free(copy->jacobian);
    srnf_free(copy->rotation);
}
