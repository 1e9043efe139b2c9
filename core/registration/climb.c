/*
 * climb.c - fields of rising degree on the full grid, by tables, until nothing is left to gain.
 *
 * Between the fields of a basin and those of the full degree the warp is fixed and steps are taken
 * in the template's domain (tabulated_pull.c): gamma <- gamma o delta. They are taken from coarser
 * tables, from which all right-hand sides come, and delta is fitted by one step, by one for each
 * half or quarter of a long chain (refit.c), or followed again.
 *
 * The points of the nodes are carried from step to step by splines of eight nodes, whose errors (a
 * few 1e-9 after all steps) the objective keeps; it is measured with the moving field as it is.
 */
#include "landmarks.h"
#include "tournament.h"

#include <math.h>
#include <string.h>

#define PULLED_DECREASE 3e-3
/* Of the objective: a round whose steps of the moving surface's domain gain less has no further one
   after it. */
#define ALTERNATE_GAIN 4e-3
#define STEPS_MAX ((size_t)120) /* of a degree; common poses may need 100 to come to rest */

struct climb {
    const struct search *search;
    struct tabulated_target target;
    struct tabulated_problem problem;
    struct cloud cloud, spare;
    const double *matrix; /* of what moves now */
    size_t top;           /* its degree */
    /* Of the last degree, coarse: what right-hand sides are spread over, which only shape steps. */
    struct tabulated_fields loads;
};

/* The steps that stand for delta, as few as will do. */
static const struct refit_terms refit = {20, 3e-3, &follow_table};

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

static void close_climb(struct climb *c)
{
    tools_return_fields(c->search->tools, &c->loads);
    tabulated_target_clear(&c->target);
    cloud_clear(&c->cloud);
    cloud_clear(&c->spare);
}

static int open_climb(struct climb *c)
{
    const struct search *s = c->search;
    int status = tabulated_target_create(&c->target, &s->full.target);

    if (status == SRNF_OK) {
        status = cloud_create(&c->cloud, c->target.n);
    }
    if (status == SRNF_OK) {
        status = cloud_create(&c->spare, c->target.n);
    }
    c->problem = (struct tabulated_problem){&c->target, &s->subject->full, s->full.penalty,
                                            s->full.free_rotation};
    c->matrix = s->subject->matrix;
    c->top = s->subject->top;
    return status;
}

/* ---- Points in and out ----------------------------------------------------------------------- */

static void cloud_from(struct cloud *cloud, const struct tabulated_target *target, size_t n,
                       const double *points, const double *jacobian)
{
    cloud_rotate(cloud, target, identity);
    for (size_t i = 0; i < cloud->n; i++) {
        size_t at = i < n ? i : n - 1;

        for (size_t k = 0; k < 3; k++) {
            cloud->point[k][i] = points[3 * at + k];
        }
        cloud->jacobian[i] = jacobian[at];
    }
}

static void cloud_to(const struct cloud *cloud, size_t n, double *points, double *jacobian)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++) {
            points[3 * i + k] = cloud->point[k][i];
        }
        jacobian[i] = cloud->jacobian[i];
    }
}

/* ---- Rungs ----------------------------------------------------------------------------------- */

static int open_level(const struct climb *c, size_t degree, struct tabulated_level *level)
{
    const struct search *s = c->search;
    size_t k = registration_unknowns(degree);
    double *matrix;
    int status;

    if (degree <= c->top) {
        return tabulated_level_create(level, degree, c->top, c->matrix, s->full.target.norm2,
                                      s->full.penalty.displacement, s->full.free_rotation);
    }
    matrix = srnf_alloc(k * k, sizeof(double));
    status = matrix ? tabulated_matrix(c->problem.moving, degree, s->context, matrix) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        status = tabulated_level_create(level, degree, degree, matrix, s->full.target.norm2,
                                        s->full.penalty.displacement, s->full.free_rotation);
    }
    srnf_free(matrix);
    return status;
}

static const struct field_table pulled_table = {4, 3.25}; /* of steps whose points are not kept */

/* Coarse fields of a degree, kept for the next rung. */
static int open_loads(struct climb *c, size_t degree)
{
    if (c->loads.degree == degree) {
        return SRNF_OK;
    }
    tools_return_fields(c->search->tools, &c->loads);
    return tools_fields(c->search->tools, degree, pulled_table.order,
                        field_table_rows(&pulled_table, degree), &c->loads);
}

/* finely: the points that steps make are kept. */
static int climb_rung(struct climb *c, bool finely, size_t degree, double decrease,
                      struct srnf_warp *chain, struct search_result *result)
{
    const struct srnf_register_options *options = c->search->options;
    struct schedule schedule = {options->max_steps ? options->max_steps : STEPS_MAX, decrease};
    struct tabulated_fields fine = {0};
    struct tabulated_level level = {0};
    struct tabulated_optimizer o = {&c->problem,
                                    finely ? &fine : &c->loads,
                                    &level,
                                    &c->spare,
                                    c->search->context,
                                    NULL,
                                    &c->loads,
                                    0.0};
    struct landmark_track track = {.landmarks = NULL};
    int status = open_loads(c, degree);

    if (status == SRNF_OK && finely) {
        status = tools_fields(c->search->tools, degree, follow_table.order,
                              field_table_rows(&follow_table, degree), &fine);
    }

    if (status == SRNF_OK && c->search->landmarks) {
        status = landmark_track_create(&track, &c->search->landmarks->pairs, chain, degree,
                                       c->search->context);
        o.track = &track;
    }

    if (status == SRNF_OK) {
        status = open_level(c, degree, &level);
    }
    if (status == SRNF_OK) {
        status = tabulated_optimize(&o, &schedule, &c->cloud, chain, &result->warp.stopped,
                                    &result->iterations);
    }
    landmark_track_clear(&track);
    tabulated_level_clear(&level);
    tools_return_fields(c->search->tools, &fine);
    return status;
}

/* Whether fields of a degree can do more than to meet the landmarks. */
static bool has_room(const struct climb *c, size_t degree)
{
    return !c->search->landmarks ||
           4 * c->search->landmarks->pairs.n <= (degree + 1) * (degree + 1) - 1;
}

/* All rungs above `from`, up to a degree. */
static int climb_rungs(struct climb *c, size_t from, size_t most, struct search_result *result)
{
    int status = SRNF_OK;

    for (size_t k = 0; k < LADDER_RUNGS && status == SRNF_OK; k++) {
        size_t degree = registration_ladder[k].degree < most ? registration_ladder[k].degree : most;

        if (degree > from && (degree == most || has_room(c, degree))) {
            status = climb_rung(c, true, degree, registration_ladder[k].decrease,
                                &result->warp.chain, result);
        }
        if (k + 1 == LADDER_RUNGS || registration_ladder[k].degree >= most) {
            break;
        }
    }
    return status;
}

/* ---- Steps in the template's domain ---------------------------------------------------------- */

static void measure(struct climb *c, const struct tabulated_moving *moving)
{
    c->problem.moving = moving;
    cloud_evaluate(moving, &c->cloud);
    cloud_measure(&c->problem, &c->cloud);
}

/* Whether tables can follow a chain. */
static bool is_forward(const struct srnf_warp *chain)
{
    bool forward = true;

    for (size_t k = 0; k < chain->n_links; k++) {
        forward = forward && (chain->links[k].kind == SRNF_WARP_ROTATION ||
                              chain->links[k].kind == SRNF_WARP_EXP);
    }
    return forward;
}

/* From the points of delta, which the cloud holds, to those of gamma o delta. */
static int push(struct climb *c, const struct srnf_warp *chain)
{
    int status =
        cloud_follow(&c->cloud, chain, &follow_table, c->search->tools, c->search->context);

    measure(c, &c->search->subject->full);
    return status;
}

/* chain <- delta, then the chain; both begin with the identity, or delta alone, which is left out
   then. */
static int join(struct srnf_warp *chain, const struct srnf_warp *delta)
{
    size_t kept = warp_is_still(chain);
    struct srnf_warp joined = {0};
    int status = kept ? warp_append(&joined, SRNF_WARP_ROTATION, 0, identity) : SRNF_OK;

    for (size_t k = 1; k < delta->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &delta->links[k];

        status = warp_append(&joined, link->kind, link->degree, link->values);
    }
    for (size_t k = kept; k < chain->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &chain->links[k];

        status = warp_append(&joined, link->kind, link->degree, link->values);
    }
    if (status) {
        srnf_warp_clear(&joined);
        return status;
    }
    srnf_warp_clear(chain);
    *chain = joined;
    return SRNF_OK;
}

/* The cloud at the points of delta as its chain has them: of few steps, if that is as good. */
static int settle(struct climb *c, struct srnf_warp *delta)
{
    const struct search *s = c->search;
    size_t steps = delta->n_links;
    int status = SRNF_OK;

    if (search_refits(s)) {
        status = warp_refit(&c->problem, &s->nodes, &refit, s->tools, &c->cloud, &c->spare, delta);
    }
    if (status == SRNF_OK && delta->n_links == steps) {
        cloud_rotate(&c->cloud, &c->target, identity);
        status = cloud_follow(&c->cloud, delta, &follow_table, s->tools, s->context);
    }
    return status;
}

/* delta from the identity by steps of the pulled surface, and the cloud to gamma o delta. *before:
   the objective of gamma. */
static int find_delta(struct climb *c, const struct tabulated_moving *pulled, const double *matrix,
                      struct srnf_warp *delta, double *before, struct search_result *result)
{
    int status = warp_append(delta, SRNF_WARP_ROTATION, 0, identity);

    cloud_rotate(&c->cloud, &c->target, identity);
    measure(c, pulled);
    *before = c->cloud.objective;
    c->matrix = matrix;
    status = status ? status : climb_rung(c, false, c->top, PULLED_DECREASE, delta, result);
    c->matrix = c->search->subject->matrix;
    status = status ? status : settle(c, delta);
    return status ? status : push(c, &result->warp.chain);
}

/* gamma <- gamma o delta, delta by steps of the surface that is pulled back along gamma. The cloud
   holds the points of the new gamma afterwards, in any case. *before: the objective of gamma, or
   INFINITY where it is not known: then it becomes what the table says. */
static int climb_pulled(struct climb *c, double *before, struct search_result *result)
{
    const struct search *s = c->search;
    size_t k = registration_unknowns(c->top);
    struct srnf_warp *chain = &result->warp.chain;
    struct srnf_warp delta = {0};
    struct tabulated_moving pulled = {0};
    double *matrix = srnf_alloc(k * k, sizeof(double));
    double tabulated = 0.0;
    int status = matrix ? SRNF_OK : SRNF_ENOMEM;

    status = status
                 ? status
                 : tabulated_moving_pull(&pulled, &s->subject->full, chain, s->tools, s->context);
    status = status ? status : tabulated_matrix(&pulled, c->top, s->context, matrix);
    status = status ? status : find_delta(c, &pulled, matrix, &delta, &tabulated, result);
    *before = isinf(*before) ? tabulated : *before;
    if (status == SRNF_OK && !(c->cloud.objective < *before)) {
        /* gamma is too steep for the table: it stays. */
        cloud_rotate(&c->cloud, &c->target, identity);
        status = push(c, chain);
    } else if (status == SRNF_OK) {
        status = join(chain, &delta);
    }
    srnf_warp_clear(&delta);
    tabulated_moving_clear(&pulled);
    srnf_free(matrix);
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

/* What the cloud tells, or, where that counts, what the surface itself does. */
static int tell(const struct climb *c, struct search_result *result)
{
    const struct search *s = c->search;

    cloud_to(&c->cloud, s->full.target.n, result->warp.points, result->warp.jacobian);
    memcpy(result->warp.rotation, c->cloud.rotation, sizeof result->warp.rotation);
    result->warp.energy = c->cloud.energy;
    result->warp.objective = c->cloud.objective;
    return s->basin || (s->chain && !s->landmarks && c->cloud.energy >= DIRECT_ENERGY)
               ? SRNF_OK
               : search_measure(s, &result->warp);
}

int climb_still_energy(const struct search *s, double *energy)
{
    struct climb c = {.search = s};
    int status = open_climb(&c);

    if (status == SRNF_OK) {
        cloud_rotate(&c.cloud, &c.target, identity);
        measure(&c, &s->subject->full);
        *energy = c.cloud.energy;
    }
    close_climb(&c);
    return status;
}

int climb_run(const struct search *s, size_t from, bool replayed, struct search_result *result)
{
    size_t degree = s->options->degree;
    size_t basin = degree < BASIN_DEGREE ? degree : BASIN_DEGREE;
    /* Landmarks follow steps of the moving surface's domain alone. */
    size_t rounds = s->landmarks ? 0 : s->rounds;
    struct climb c = {.search = s};
    bool goes_on = true;
    int status = open_climb(&c);

    if (status == SRNF_OK && replayed) {
        cloud_from(&c.cloud, &c.target, s->full.target.n, result->warp.points,
                   result->warp.jacobian);
        measure(&c, &s->subject->full);
    } else if (status == SRNF_OK && rounds == 0) {
        cloud_rotate(&c.cloud, &c.target, identity);
        status = push(&c, &result->warp.chain);
    }
    if (status == SRNF_OK && (replayed || rounds == 0)) {
        status = climb_rungs(&c, from, rounds == 0 && !s->basin ? degree : basin, result);
    }
    for (size_t k = 0; k < rounds && goes_on && status == SRNF_OK; k++) {
        double before = replayed || k > 0 ? c.cloud.objective : INFINITY;
        double pulled;

        if (is_forward(&result->warp.chain)) {
            status = climb_pulled(&c, &before, result);
        }
        pulled = c.cloud.objective;
        if (status == SRNF_OK) {
            status = climb_rungs(&c, basin < degree ? basin : degree - 1, degree, result);
        }
        goes_on = c.cloud.objective < (1.0 - s->round_gain) * before &&
                  c.cloud.objective < (1.0 - ALTERNATE_GAIN) * pulled;
    }
    result->carried = !replayed;
    status = status ? status : tell(&c, result);
    close_climb(&c);
    return status;
}
