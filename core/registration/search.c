/*
 * search.c - registration in one direction: global start, elastic tournament, rising
 * degrees.
 *
 * On different shapes the best rigid start often lies in the wrong basin of the elastic problem. So
 * the best 48 rotations of the screening are not refined but compete: on a coarse grid with a
 * moving surface cut to degree 15, five steps of fields of degree 2 for all, six of degree 4 for
 * the better third, and for the best four the full problem to degree 8; the one with the lowest
 * objective goes on. Refining a basin is a matter of the degrees 4, 8, 12, ... up to the one asked
 * for.
 */
#include "exact.h"

#include <math.h>
#include <string.h>

#define COARSE_ROWS ((size_t)24)
#define COARSE_DEGREE ((size_t)15)
#define TOURNAMENT_FIRST ((size_t)48)
#define TOURNAMENT_SECOND ((size_t)16)
#define TOURNAMENT_THIRD ((size_t)4)
#define RIGID_REFINED ((size_t)10)
#define AMBIGUITY_ANGLE (15.0 * SRNF_PI / 180.0)
#define STEPS_MAX ((size_t)40)       /* of a degree, where the options do not say */
#define NODES_PER_DEGREE ((size_t)4) /* rows of the full grid to a degree of the fields */
#define FINE_ROWS_MIN ((size_t)36)
#define FINE_ROWS_MAX ((size_t)96)
#define EXACT_ENERGY 1e-3 /* below it two surfaces may well be the same up to a warp */

/* Degrees of the fields in turn, and the gain below which each is left. */
static const struct {
    size_t degree;
    double decrease;
} ladder[] = {{4, 1e-2}, {8, 3e-3}, {12, 1e-3}, {16, 1e-3}, {24, 1e-3}, {32, 1e-3}};
#define RUNGS (sizeof ladder / sizeof ladder[0])

/* ---- Preparation ----------------------------------------------------------------------------- */

void registration_nodes(const struct srnf_grid *grid, double *points, double *weight)
{
    for (size_t i = 0; i < grid->n_theta * grid->n_phi; i++) {
        size_t row = i / grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

        points[3 * i] = grid->sin_theta[row] * cos(phi);
        points[3 * i + 1] = grid->sin_theta[row] * sin(phi);
        points[3 * i + 2] = grid->cos_theta[row];
        weight[i] = grid->weight[row];
    }
}

/* memory: 7 n doubles. field: [3][n], or NULL to be filled later. */
static void target_place(struct target *target, const struct srnf_grid *grid, const double *field,
                         double *memory)
{
    size_t n = grid->n_theta * grid->n_phi;
    double *q = memory + 4 * n;
    double norm2 = 0.0;

    registration_nodes(grid, memory, memory + 3 * n);
    for (size_t i = 0; i < n; i++) {
        for (size_t c = 0; c < 3; c++) {
            q[3 * i + c] = field[c * n + i];
            norm2 += memory[3 * n + i] * q[3 * i + c] * q[3 * i + c];
        }
    }
    *target =
        (struct target){.n = n, .points = memory, .weight = memory + 3 * n, .q = q, .norm2 = norm2};
}

/* q1 on the coarse grid, through its harmonics up to the coarse degree. */
static int coarse_field(const struct srnf_sht *sht, const double *q1, size_t degree,
                        struct srnf_sht *coarse, double *out)
{
    size_t full = srnf_coefficient_count(srnf_sht_degree(sht));
    size_t count = srnf_coefficient_count(degree);
    double *c = srnf_alloc(3 * full + 3 * count, sizeof(double));
    size_t bytes = srnf_sht_workspace_size(sht, 3) + srnf_sht_workspace_size(coarse, 3);
    void *workspace = srnf_alloc(1, bytes);

    if (c && workspace) {
        srnf_sht_analysis(sht, 3, q1, c, workspace);
        for (size_t k = 0; k < 3; k++) {
            memcpy(c + 3 * full + k * count, c + k * full, count * sizeof(double));
        }
        srnf_sht_synthesis(coarse, 3, c + 3 * full, out, workspace);
    }
    srnf_free(workspace);
    srnf_free(c);
    return c && workspace ? SRNF_OK : SRNF_ENOMEM;
}

/* q1 on a finer grid of the same kind: from the surface itself, or by the harmonics of q1 that its
   grid resolves. */
static int fine_field(const struct srnf_sht *sht, enum srnf_representation representation,
                      const double *q1, const double *template_surface, size_t rows,
                      struct srnf_sht **fine, double *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t degree = template_surface ? srnf_sht_degree(sht) : grid->n_theta - 1;
    struct srnf_sht *own = NULL;
    double *c = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
    void *workspace = NULL;
    int status = srnf_sht_create(fine, degree, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows);

    if (status == SRNF_OK) {
        status = srnf_sht_create(&own, degree, grid->kind, grid->n_theta, grid->n_phi);
    }
    if (status == SRNF_OK) {
        workspace =
            srnf_alloc(1, srnf_surface_workspace_size(*fine) + srnf_sht_workspace_size(own, 3) +
                              srnf_sht_workspace_size(*fine, 3));
    }
    if (!c || !workspace) {
        status = status ? status : SRNF_ENOMEM;
    } else if (template_surface) {
        field_represent(*fine, representation, template_surface, out, workspace);
    } else {
        srnf_sht_analysis(own, 3, q1, c, workspace);
        srnf_sht_synthesis(*fine, 3, c, out, workspace);
    }
    srnf_free(workspace);
    srnf_free(c);
    srnf_sht_destroy(own);
    return status;
}

size_t registration_rows(size_t degree)
{
    size_t rows = NODES_PER_DEGREE * degree;

    return rows < FINE_ROWS_MIN ? FINE_ROWS_MIN : rows > FINE_ROWS_MAX ? FINE_ROWS_MAX : rows;
}

/* The grid of the full problem. On too coarse a one fields of the given degree fit the nodes and
   fold between them; in exact mode the template's own grid is the one on which q1 is exact. */
static int full_target(struct search *s, const struct srnf_sht *sht, const double *q1,
                       const double *template_surface)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t rows = registration_rows(s->options->degree);
    struct srnf_sht *fine = NULL;
    double *field = NULL;
    int status = SRNF_OK;

    if (s->options->exact || grid->n_theta >= rows) {
        s->full_memory = srnf_alloc(7 * grid->n_theta * grid->n_phi, sizeof(double));
        if (!s->full_memory) {
            return SRNF_ENOMEM;
        }
        target_place(&s->full.target, grid, q1, s->full_memory);
        return SRNF_OK;
    }
    field = srnf_alloc(6 * rows * rows, sizeof(double));
    s->full_memory = srnf_alloc(14 * rows * rows, sizeof(double));
    status = field && s->full_memory ? fine_field(sht, s->options->representation, q1,
                                                  template_surface, rows, &fine, field)
                                     : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        target_place(&s->full.target, srnf_sht_grid(fine), field, s->full_memory);
    }
    srnf_free(field);
    srnf_sht_destroy(fine);
    return status;
}

static int coarse_target(struct search *s, const struct srnf_sht *sht, const double *q1)
{
    size_t degree = srnf_sht_degree(sht) < COARSE_DEGREE ? srnf_sht_degree(sht) : COARSE_DEGREE;
    size_t m = 2 * COARSE_ROWS * COARSE_ROWS;
    struct srnf_sht *coarse = NULL;
    double *field = srnf_alloc(3 * m, sizeof(double));
    int status =
        srnf_sht_create(&coarse, degree, SRNF_GRID_GAUSS_LEGENDRE, COARSE_ROWS, 2 * COARSE_ROWS);

    s->memory = srnf_alloc(7 * m, sizeof(double));
    if (status || !field || !s->memory) {
        status = SRNF_ENOMEM;
        goto out;
    }
    status = coarse_field(sht, q1, degree, coarse, field);
    if (status == SRNF_OK) {
        target_place(&s->coarse.target, srnf_sht_grid(coarse), field, s->memory);
    }
out:
    srnf_free(field);
    srnf_sht_destroy(coarse);
    return status;
}

int search_create(struct search *s, const struct srnf_sht *sht, const double *q1,
                  const double *template_surface, const double *moving,
                  const struct srnf_register_options *options, const struct srnf_context *context)
{
    size_t degree = srnf_sht_degree(sht);
    int status;

    *s = (struct search){.options = options,
                         .context = context,
                         .sht = sht,
                         .has_template = options->exact && template_surface};
    status = full_target(s, sht, q1, template_surface);
    if (status == SRNF_OK) {
        status = coarse_target(s, sht, q1);
    }
    if (status == SRNF_OK) {
        status = moving_create(&s->moving_full, degree, moving, degree, context);
    }
    if (status == SRNF_OK) {
        status = moving_create(&s->moving_coarse, degree, moving, COARSE_DEGREE, context);
    }
    if (status == SRNF_OK && s->has_template) {
        status = moving_create(&s->moving_template, degree, template_surface, degree, context);
    }
    if (status) {
        search_clear(s);
        return status;
    }
    s->moving_full.representation = options->representation;
    s->moving_coarse.representation = options->representation;
    s->moving_template.representation = options->representation;
    s->full.moving = &s->moving_full;
    s->coarse.moving = &s->moving_coarse;
    s->full.free_rotation = s->coarse.free_rotation = options->rotation && !options->common_pose;
    if (!options->exact) {
        s->full.penalty.jacobian = s->coarse.penalty.jacobian = options->penalty_jacobian;
        s->full.penalty.displacement = s->coarse.penalty.displacement =
            options->penalty_displacement;
    }
    return SRNF_OK;
}

void search_clear(struct search *s)
{
    srnf_free(s->memory);
    srnf_free(s->full_memory);
    moving_clear(&s->moving_full);
    moving_clear(&s->moving_coarse);
    moving_clear(&s->moving_template);
    s->memory = s->full_memory = NULL;
}

void search_result_clear(struct search_result *result)
{
    warp_clear(&result->warp);
}

/* ---- Rising degrees -------------------------------------------------------------------------- */

static size_t steps_max(const struct search *s)
{
    return s->options->max_steps ? s->options->max_steps : STEPS_MAX;
}

static int open_level(const struct search *s, const struct problem *problem, size_t degree,
                      struct level *level)
{
    return problem == &s->full && s->top && s->top->fields.degree >= degree
               ? level_restrict(level, s->top, degree)
               : level_create(level, problem, degree);
}

/* All rungs above `from` and up to the degree of the options; a last one for a degree between two.
   */
static int climb(const struct search *s, size_t from, struct warp *warp, size_t *iterations)
{
    struct samples samples = {0};
    int status = samples_create(&samples, s->full.target.n);
    size_t top = s->options->degree;

    for (size_t k = 0; k < RUNGS && status == SRNF_OK; k++) {
        bool last = k + 1 == RUNGS || ladder[k].degree >= top;
        size_t degree = ladder[k].degree < top ? ladder[k].degree : top;
        struct schedule schedule = {steps_max(s), ladder[k].decrease};
        struct level level;

        if (degree > from) {
            status = open_level(s, &s->full, degree, &level);
            if (status == SRNF_OK) {
                status = registration_optimize(&s->full, &level, &schedule, s->context, warp,
                                               &samples, iterations);
                level_clear(&level);
            }
        }
        if (last) {
            break;
        }
    }
    samples_clear(&samples);
    if (status == SRNF_OK && s->options->exact && warp->energy < EXACT_ENERGY) {
        status = registration_polish(&s->full, s->sht, s->has_template ? &s->moving_template : NULL,
                                     s->context, warp, iterations);
    }
    return status;
}

static double distance(const struct search *s, const struct warp *warp)
{
    return sqrt(warp->energy * s->full.target.norm2);
}

static int evaluate(const struct problem *problem, struct warp *warp)
{
    struct samples samples;
    double ignored[9];
    int status = samples_create(&samples, problem->target.n);

    if (status == SRNF_OK) {
        registration_objective(problem, warp, &samples, ignored);
        samples_clear(&samples);
        status = srnf_is_canceled(moving_context(problem->moving)) ? SRNF_ECANCELED : SRNF_OK;
    }
    return status;
}

/* ---- Tournament ------------------------------------------------------------------------------ */

struct entrants {
    struct warp *warps;
    size_t count;
};

static void sort_entrants(struct entrants *e)
{
    for (size_t i = 1; i < e->count; i++) {
        struct warp w = e->warps[i];
        size_t j = i;

        while (j > 0 && e->warps[j - 1].objective > w.objective) {
            e->warps[j] = e->warps[j - 1];
            j--;
        }
        e->warps[j] = w;
    }
}

static void keep_best(struct entrants *e, size_t count)
{
    sort_entrants(e);
    while (e->count > count) {
        warp_clear(&e->warps[--e->count]);
    }
}

/* Steps of fields of a degree, or of the highest that was asked for, with every entrant. */
static int play_round(const struct search *s, const struct problem *problem, size_t degree,
                      size_t steps, struct entrants *e, size_t *iterations)
{
    struct schedule schedule = {steps, 1e-3};
    struct samples samples = {0};
    struct level level;
    size_t top = s->options->degree;
    int status = open_level(s, problem, degree < top ? degree : top, &level);

    if (status) {
        return status;
    }
    status = samples_create(&samples, problem->target.n);
    for (size_t i = 0; i < e->count && status == SRNF_OK; i++) {
        status = registration_optimize(problem, &level, &schedule, s->context, &e->warps[i],
                                       &samples, iterations);
    }
    samples_clear(&samples);
    level_clear(&level);
    return status;
}

/* Mean angle between two maps, rms over the sphere. */
static double map_angle(const struct target *t, const struct warp *a, const struct warp *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        const double *p = a->points + 3 * i;
        const double *q = b->points + 3 * i;
        double c = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        double angle = acos(fmax(-1.0, fmin(1.0, c)));

        sum += t->weight[i] * angle * angle;
    }
    return sqrt(sum / (4.0 * SRNF_PI));
}

/* The best of another basin beside the winner, among sorted entrants. */
static void find_ambiguity(const struct search *s, const struct entrants *e,
                           struct search_result *result)
{
    for (size_t i = 1; i < e->count; i++) {
        double angle = map_angle(&s->full.target, &e->warps[0], &e->warps[i]);

        if (angle > AMBIGUITY_ANGLE && e->warps[0].objective > 0.0) {
            result->ambiguity_objective = e->warps[i].objective / e->warps[0].objective;
            result->ambiguity_angle = angle;
            return;
        }
    }
}

static int enter(const struct search *s, const struct start_rotation *starts, size_t count,
                 struct entrants *e)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = warp_create(&e->warps[i], &s->coarse.target);
        if (status == SRNF_OK) {
            e->count++;
            status = warp_rotate(&e->warps[i], &s->coarse.target, starts[i].rotation);
        }
    }
    return status;
}

/* Carries the entrants over to the full grid. */
static int move_to_full(const struct search *s, struct entrants *e)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < e->count && status == SRNF_OK; i++) {
        struct warp full;

        status = warp_create(&full, &s->full.target);
        if (status == SRNF_OK) {
            status = warp_replay(&full, &s->full.target, &e->warps[i].chain, s->context);
            warp_clear(&e->warps[i]);
            e->warps[i] = full;
        }
    }
    return status;
}

static int tournament(const struct search *s, struct search_result *result)
{
    struct start_rotation starts[TOURNAMENT_FIRST];
    struct entrants e = {srnf_alloc(TOURNAMENT_FIRST, sizeof *e.warps), 0};
    int status = SRNF_ENOMEM;
    size_t count;

    if (!e.warps) {
        return SRNF_ENOMEM;
    }
    count = registration_screen(&s->coarse.target, &s->moving_coarse, TOURNAMENT_FIRST, starts,
                                &status);
    if (status == SRNF_OK) {
        status = registration_rigid(&s->coarse, &starts[0], &result->rotational_curvature);
        result->rotations_searched = true;
    }
    if (status == SRNF_OK) {
        status = enter(s, starts, count, &e);
    }
    if (status == SRNF_OK) {
        status = play_round(s, &s->coarse, 2, 5, &e, &result->iterations);
    }
    if (status == SRNF_OK) {
        keep_best(&e, TOURNAMENT_SECOND);
        srnf_report_progress(s->context, 0.3, "tournament");
        status = play_round(s, &s->coarse, 4, 6, &e, &result->iterations);
    }
    if (status == SRNF_OK) {
        keep_best(&e, TOURNAMENT_THIRD);
        srnf_report_progress(s->context, 0.4, "tournament");
        status = move_to_full(s, &e);
    }
    if (status == SRNF_OK) {
        status = play_round(s, &s->full, 4, steps_max(s), &e, &result->iterations);
    }
    if (status == SRNF_OK && s->options->degree >= 8) {
        srnf_report_progress(s->context, 0.5, "tournament");
        status = play_round(s, &s->full, 8, steps_max(s), &e, &result->iterations);
    }
    if (status == SRNF_OK && e.count > 0) {
        sort_entrants(&e);
        find_ambiguity(s, &e, result);
        result->warp = e.warps[0];
        e.warps[0] = (struct warp){0};
    }
    for (size_t i = 0; i < e.count; i++) {
        warp_clear(&e.warps[i]);
    }
    srnf_free(e.warps);
    return status;
}

/* ---- Rigid start ----------------------------------------------------------------------------- */

static int rigid(const struct search *s, struct search_result *result)
{
    struct start_rotation starts[RIGID_REFINED];
    size_t best = 0;
    int status;
    size_t count =
        registration_screen(&s->coarse.target, &s->moving_coarse, RIGID_REFINED, starts, &status);

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = registration_rigid(&s->coarse, &starts[i], NULL);
        best = starts[i].energy < starts[best].energy ? i : best;
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double angle;
        double trace = 0.0;

        for (size_t k = 0; k < 9; k++) {
            trace += starts[i].rotation[k] * starts[best].rotation[k];
        }
        angle = acos(fmax(-1.0, fmin(1.0, 0.5 * (trace - 1.0))));
        if (angle > AMBIGUITY_ANGLE && starts[best].energy > 0.0 &&
            (result->ambiguity_objective == 0.0 ||
             starts[i].energy / starts[best].energy < result->ambiguity_objective)) {
            result->ambiguity_objective = starts[i].energy / starts[best].energy;
            result->ambiguity_angle = angle;
        }
    }
    if (status == SRNF_OK) {
        status = registration_rigid(&s->full, &starts[best], &result->rotational_curvature);
        result->rotations_searched = true;
    }
    if (status == SRNF_OK) {
        status = warp_create(&result->warp, &s->full.target);
    }
    if (status == SRNF_OK) {
        status = warp_rotate(&result->warp, &s->full.target, starts[best].rotation);
        result->warp.stopped = starts[best].stopped;
    }
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

int search_run(const struct search *s, struct search_result *result)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    size_t from = 0;
    int status;

    *result = (struct search_result){0};
    if (still) {
        status = warp_create(&result->warp, &s->full.target);
    } else if (o->start == SRNF_START_RIGID || !o->reparameterization) {
        status = rigid(s, result);
    } else {
        status = tournament(s, result);
        from = o->degree >= 8 ? 8 : 4;
    }
    if (status == SRNF_OK) {
        status = evaluate(&s->full, &result->warp);
    }
    if (status == SRNF_OK && o->reparameterization) {
        srnf_report_progress(s->context, 0.6, "warping");
        status = climb(s, from, &result->warp, &result->iterations);
    }
    if (status) {
        search_result_clear(result);
    }
    result->distance = distance(s, &result->warp);
    return status;
}

int search_evaluate(const struct search *s, const struct srnf_warp *chain,
                    struct search_result *result)
{
    int status = warp_create(&result->warp, &s->full.target);

    if (status == SRNF_OK) {
        status = warp_replay(&result->warp, &s->full.target, chain, s->context);
    }
    if (status == SRNF_OK) {
        status = evaluate(&s->full, &result->warp);
    }
    result->distance = distance(s, &result->warp);
    return status;
}

int search_continue(const struct search *s, const struct srnf_warp *chain,
                    struct search_result *result)
{
    size_t from = s->options->degree > 8 ? 8 : 0;
    int status = search_evaluate(s, chain, result);

    if (status == SRNF_OK && s->options->reparameterization) {
        status = climb(s, from, &result->warp, &result->iterations);
    }
    if (status) {
        search_result_clear(result);
    }
    result->distance = distance(s, &result->warp);
    return status;
}
