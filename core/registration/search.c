/*
 * search.c - registration in one direction: preparation, global start, rising degrees.
 *
 * The start is the basin that a tournament finds (tournament.c), the best rotation, refined, or the
 * identity. Refining a basin is a matter of fields of the degrees 4, 8, 12, ... up to the one asked
 * for: by tables (climb.c), or directly, in exact mode and where two surfaces turn out to be the
 * same up to a warp, so that what the tables leave is more than what there is to gain.
 */
#include "exact.h"
#include "landmarks.h"
#include "tournament.h"

#include "harmonics/harmonics.h"

#include <math.h>
#include <string.h>

#define RIGID_REFINED ((size_t)10)
#define AMBIGUITY_ANGLE (15.0 * SRNF_PI / 180.0)
#define STEPS_MAX ((size_t)40)       /* of a degree, where the options do not say */
#define NODES_PER_DEGREE ((size_t)4) /* rows of the full grid to a degree of the fields */
#define FINE_ROWS_MIN ((size_t)36)
#define FINE_ROWS_MAX ((size_t)96)
#define BASIN_DEGREE ((size_t)8) /* of the fields that the tournament ends with */
#define ROUGH_DEGREE ((size_t)2) /* of the first steps from a rotation that is not refined */
#define ROUGH_STEPS ((size_t)5)
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

double *registration_parallels(size_t rows, struct srnf_grid *grid)
{
    double *nodes = srnf_alloc(4 * rows, sizeof(double));

    if (nodes) {
        sphere_gauss_legendre(rows, nodes, nodes + rows, nodes + 2 * rows, nodes + 3 * rows);
        for (size_t i = 0; i < rows; i++) {
            nodes[3 * rows + i] *= SRNF_PI / (double)rows;
        }
        *grid = (struct srnf_grid){.kind = SRNF_GRID_GAUSS_LEGENDRE,
                                   .n_theta = rows,
                                   .n_phi = 2 * rows,
                                   .theta = nodes,
                                   .cos_theta = nodes + rows,
                                   .sin_theta = nodes + 2 * rows,
                                   .weight = nodes + 3 * rows};
    }
    return nodes;
}

void search_place(struct target *target, const struct srnf_grid *grid, const double *field,
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

void search_cut_series(size_t degree, const double *series, double *out)
{
    size_t count = srnf_coefficient_count(degree);
    size_t kept = count < SCREEN_COUNT ? count : SCREEN_COUNT;

    memset(out, 0, 3 * SCREEN_COUNT * sizeof *out);
    for (size_t c = 0; c < 3; c++) {
        memcpy(out + c * SCREEN_COUNT, series + c * count, kept * sizeof *out);
    }
}

/* The harmonics of q1 that its degree has. */
static int template_series(struct search *s, const double *q1)
{
    size_t count = srnf_coefficient_count(srnf_sht_degree(s->sht));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(s->sht, 3));

    s->template_series = srnf_alloc(3 * count, sizeof(double));
    if (workspace && s->template_series) {
        srnf_sht_analysis(s->sht, 3, q1, s->template_series, workspace);
    }
    srnf_free(workspace);
    return workspace && s->template_series ? SRNF_OK : SRNF_ENOMEM;
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

    if (status == SRNF_OK && !template_surface) {
        status = srnf_sht_create(&own, degree, grid->kind, grid->n_theta, grid->n_phi);
    }
    if (status == SRNF_OK) {
        workspace =
            srnf_alloc(1, srnf_surface_workspace_size(*fine) + srnf_sht_workspace_size(*fine, 3) +
                              (own ? srnf_sht_workspace_size(own, 3) : 0));
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
        search_place(&s->full.target, grid, q1, s->full_memory);
        s->nodes = (struct nodes_of){grid->kind, grid->n_theta, grid->n_phi};
        return SRNF_OK;
    }
    field = srnf_alloc(6 * rows * rows, sizeof(double));
    s->full_memory = srnf_alloc(14 * rows * rows, sizeof(double));
    status = field && s->full_memory ? fine_field(sht, s->options->representation, q1,
                                                  template_surface, rows, &fine, field)
                                     : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        search_place(&s->full.target, srnf_sht_grid(fine), field, s->full_memory);
        s->nodes = (struct nodes_of){SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows};
    }
    srnf_free(field);
    srnf_sht_destroy(fine);
    return status;
}

/* Tables of the moving surface, where none are at hand and the search reads any. */
static int own_subject(struct search *s, const double *moving)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    int status;

    if (s->subject || (still && (o->exact || !o->reparameterization))) {
        return SRNF_OK;
    }
    s->own = srnf_alloc(1, sizeof *s->own);
    if (!s->own) {
        return SRNF_ENOMEM;
    }
    status = subject_create(s->own, s->sht, moving, o, s->context);
    s->subject = s->own;
    return status;
}

int search_create(struct search *s, const struct srnf_sht *sht, const double *q1,
                  const double *template_surface, const double *moving,
                  const struct srnf_register_options *options, const struct subject *subject,
                  const struct srnf_context *context)
{
    size_t degree = srnf_sht_degree(sht);
    int status;

    *s = (struct search){.options = options,
                         .context = context,
                         .sht = sht,
                         .subject = subject,
                         .rounds = options->degree > BASIN_DEGREE ? 1 : 0,
                         .has_template = options->exact && template_surface};
    status = full_target(s, sht, q1, template_surface);
    if (status == SRNF_OK) {
        status = template_series(s, q1);
    }
    if (status == SRNF_OK) {
        status = moving_create(&s->moving_full, degree, moving, degree, context);
    }
    if (status == SRNF_OK && s->has_template) {
        status = moving_create(&s->moving_template, degree, template_surface, degree, context);
    }
    if (status == SRNF_OK) {
        status = own_subject(s, moving);
    }
    if (status) {
        search_clear(s);
        return status;
    }
    s->moving_full.representation = options->representation;
    s->moving_template.representation = options->representation;
    s->full.moving = &s->moving_full;
    s->full.free_rotation = options->rotation && !options->common_pose;
    if (!options->exact) {
        s->full.penalty.jacobian = options->penalty_jacobian;
        s->full.penalty.displacement = options->penalty_displacement;
    }
    return SRNF_OK;
}

void search_clear(struct search *s)
{
    if (s->own) {
        subject_clear(s->own);
        srnf_free(s->own);
        s->own = NULL;
    }
    srnf_free(s->template_series);
    srnf_free(s->full_memory);
    moving_clear(&s->moving_full);
    moving_clear(&s->moving_template);
    s->template_series = s->full_memory = NULL;
}

void search_result_clear(struct search_result *result)
{
    warp_clear(&result->warp);
}

size_t search_screen(const struct search *s, size_t capacity, struct start_rotation *starts,
                     int *status)
{
    double first[3 * SCREEN_COUNT];

    search_cut_series(srnf_sht_degree(s->sht), s->template_series, first);
    return registration_screen(first, s->subject->screen, capacity, starts, status);
}

int search_coarsen(const struct search *s, size_t rows, size_t degree, double **memory,
                   struct target *target)
{
    size_t full = srnf_coefficient_count(srnf_sht_degree(s->sht));
    size_t count = srnf_coefficient_count(degree);
    size_t n = 2 * rows * rows;
    struct srnf_sht *sht = NULL;
    double *field = srnf_alloc(3 * n + 3 * count, sizeof(double));
    void *workspace = NULL;
    int status = srnf_sht_create(&sht, degree, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows);

    *memory = srnf_alloc(7 * n, sizeof(double));
    workspace = status ? NULL : srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    if (*memory && field && workspace) {
        for (size_t c = 0; c < 3; c++) {
            memcpy(field + 3 * n + c * count, s->template_series + c * full,
                   count * sizeof(double));
        }
        srnf_sht_synthesis(sht, 3, field + 3 * n, field, workspace);
        search_place(target, srnf_sht_grid(sht), field, *memory);
    } else {
        status = status ? status : SRNF_ENOMEM;
    }
    srnf_free(field);
    srnf_free(workspace);
    srnf_sht_destroy(sht);
    return status;
}

/* ---- Rising degrees -------------------------------------------------------------------------- */

static size_t steps_max(const struct search *s)
{
    return s->options->max_steps ? s->options->max_steps : STEPS_MAX;
}

/* All rungs above `from` and up to the degree of the options, directly; a last one for a degree
   between two. */
static int climb_directly(const struct search *s, size_t from, struct warp *warp,
                          size_t *iterations)
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
            status = level_create(&level, &s->full, degree);
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

int search_measure(const struct search *s, struct warp *warp)
{
    const struct problem *problem = &s->full;
    struct samples samples = {.n = problem->target.n};
    double ignored[9];
    int status = SRNF_OK;

    samples.q = srnf_alloc(3 * samples.n, sizeof(double));
    if (!samples.q) {
        return SRNF_ENOMEM;
    }
    moving_values(problem->moving, samples.n, warp->points, NULL, samples.q);
    registration_measure(problem, warp, &samples, ignored);
    srnf_free(samples.q);
    status = srnf_is_canceled(moving_context(problem->moving)) ? SRNF_ECANCELED : SRNF_OK;
    if (status == SRNF_OK && s->landmarks) {
        double cost;

        status = landmarks_cost(&s->landmarks->pairs, &warp->chain, &cost);
        warp->objective += cost;
    }
    return status;
}

/* ---- Rigid start ----------------------------------------------------------------------------- */

/* Refined on the grid of the last round of the tournament, by its table. */
static int refine_starts(const struct search *s, size_t count, struct start_rotation *starts)
{
    const struct tabulated_moving *table = &s->subject->rounds[TOURNAMENT_ROUNDS - 1];
    struct moving moving = {.representation = s->options->representation, .table = table};
    struct problem problem = {.moving = &moving, .free_rotation = s->full.free_rotation};
    size_t rows = tournament_round(TOURNAMENT_ROUNDS - 1, table->degree).rows;
    double *memory = NULL;
    int status = search_coarsen(s, rows, table->degree, &memory, &problem.target);

    moving.plan.points.context = s->context;
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = registration_rigid(&problem, &starts[i], NULL);
    }
    srnf_free(memory);
    return status;
}

/* On the full grid: by the table, then by the surface itself, which has little left to do. */
static int refine_best(const struct search *s, struct start_rotation *best, double *curvature)
{
    struct moving moving = {.representation = s->options->representation,
                            .table = &s->subject->full};
    struct problem problem = s->full;
    int status = SRNF_OK;

    moving.plan.points.context = s->context;
    problem.moving = &moving;
    if (!s->options->exact && best->energy >= DIRECT_ENERGY) {
        status = registration_rigid(&problem, best, NULL);
    }
    return status ? status : registration_rigid(&s->full, best, curvature);
}

static int rigid(const struct search *s, struct search_result *result)
{
    struct start_rotation starts[RIGID_REFINED];
    size_t best = 0;
    int status;
    size_t count = search_screen(s, RIGID_REFINED, starts, &status);

    if (status == SRNF_OK) {
        status = refine_starts(s, count, starts);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
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
        status = refine_best(s, &starts[best], &result->rotational_curvature);
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

/* The rotation that a search began with; steps in the template's domain come before it. NULL: the
   chain has none. */
static const double *first_rotation(const struct srnf_warp *chain)
{
    for (size_t k = 0; k < chain->n_links; k++) {
        if (chain->links[k].kind == SRNF_WARP_ROTATION) {
            return chain->links[k].values;
        }
    }
    return NULL;
}

/* All degrees directly, from a rotation: refined, as two surfaces that are nearly the same lie
   best, or, in exact mode, first warped roughly. */
static int climb_from_rotation(const struct search *s, const double rotation[9], struct warp *warp,
                               size_t *iterations)
{
    const size_t degree = s->options->degree < ROUGH_DEGREE ? s->options->degree : ROUGH_DEGREE;
    const struct schedule rough = {ROUGH_STEPS, 1e-3};
    struct samples samples = {0};
    struct level level;
    struct start_rotation start = {.energy = 0.0};
    int status = warp_create(warp, &s->full.target);

    memcpy(start.rotation, rotation, sizeof start.rotation);
    if (status == SRNF_OK && !s->options->exact) {
        status = registration_rigid(&s->full, &start, NULL);
    }
    status = status ? status : warp_rotate(warp, &s->full.target, start.rotation);
    if (!s->options->exact) {
        status = status ? status : search_measure(s, warp);
        return status ? status : climb_directly(s, 0, warp, iterations);
    }
    status = status ? status : samples_create(&samples, s->full.target.n);
    status = status ? status : level_create(&level, &s->full, degree);
    if (status == SRNF_OK) {
        status =
            registration_optimize(&s->full, &level, &rough, s->context, warp, &samples, iterations);
        level_clear(&level);
    }
    samples_clear(&samples);
    return status ? status : climb_directly(s, 0, warp, iterations);
}

/* Guided by landmarks, by tables whatever is left: from the chain of result, whose landmarks are
   met first where they are to be. */
static int climb_guided(const struct search *s, struct search_result *result)
{
    bool exact = isinf(s->landmarks->pairs.weight);
    int status = exact ? landmarks_match(s, &result->warp.chain) : SRNF_OK;

    status = status ? status
                    : warp_replay(&result->warp, &s->full.target, &result->warp.chain, s->context);
    status = status ? status : climb_run(s, 0, true, result);
    return status || !exact ? status : landmarks_met(s, &result->warp.chain);
}

/* Directly from the rotation of what was found, if that is better. */
static int climb_again(const struct search *s, struct search_result *result)
{
    bool exact = s->options->exact;
    const double *rotation = first_rotation(&result->warp.chain);
    struct warp direct = {0};
    int status;

    if (!rotation) {
        return SRNF_OK;
    }
    status = climb_from_rotation(s, rotation, &direct, &result->iterations);
    if (status == SRNF_OK && (exact || direct.objective < result->warp.objective)) {
        struct warp replaced = result->warp;

        result->warp = direct;
        direct = replaced;
    }
    warp_clear(&direct);
    return status;
}

/* Up from the start that result holds: measured on the full grid where `placed`, else a chain
   alone, which has a rotation. Directly in exact mode; and where little is left, if that is
   better. */
static int climb(const struct search *s, size_t from, bool placed, struct search_result *result)
{
    bool exact = s->options->exact;
    int status = SRNF_OK;

    if (s->landmarks) {
        return climb_guided(s, result);
    }
    if (placed && (exact || result->warp.energy < DIRECT_ENERGY)) {
        return climb_directly(s, from, &result->warp, &result->iterations);
    }
    if (!exact) {
        status = climb_run(s, from, placed, result);
        if (status || result->warp.energy >= DIRECT_ENERGY) {
            return status;
        }
    }
    return climb_again(s, result);
}

static int from_basin(const struct search *s, bool still, struct search_result *result)
{
    size_t degree = s->options->degree;
    int status = still ? tournament_still(s, result) : tournament_run(s, result);

    if (status == SRNF_OK) {
        struct srnf_warp chain = result->warp.chain;

        result->warp.chain = (struct srnf_warp){0};
        status = warp_create(&result->warp, &s->full.target);
        srnf_warp_clear(&result->warp.chain);
        result->warp.chain = chain;
    }
    srnf_report_progress(s->context, 0.6, "warping");
    return status ? status
                  : climb(s, degree > BASIN_DEGREE ? BASIN_DEGREE : degree - 1, false, result);
}

/* Whether coarse grids are good for the first steps from the identity: not where little is left,
   nor where landmarks or a low degree are asked for. */
static int starts_coarsely(const struct search *s, bool *coarsely)
{
    double energy = 0.0;
    int status = SRNF_OK;

    *coarsely = s->options->reparameterization && !s->landmarks && search_refits(s);
    if (*coarsely) {
        status = climb_still_energy(s, &energy);
        *coarsely = energy >= DIRECT_ENERGY;
    }
    return status;
}

/* From the identity, or from the best rotation. */
static int from_rigid(const struct search *s, bool still, struct search_result *result)
{
    int status = still ? warp_create(&result->warp, &s->full.target) : rigid(s, result);

    status = status ? status : search_measure(s, &result->warp);
    if (status == SRNF_OK && s->options->reparameterization) {
        srnf_report_progress(s->context, 0.6, "warping");
        status = climb(s, 0, true, result);
    }
    return status;
}

/* From what the options say. */
static int run_once(const struct search *s, struct search_result *result)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    bool basin = !still && o->start != SRNF_START_RIGID && o->reparameterization;
    int status = still ? starts_coarsely(s, &basin) : SRNF_OK;

    *result = (struct search_result){0};
    if (status == SRNF_OK) {
        status = basin ? from_basin(s, still, result) : from_rigid(s, still, result);
    }
    if (status) {
        search_result_clear(result);
    }
    return status;
}

/* From a rotation, if that ends lower than what there is; *none: whether there is nothing yet. */
static int run_from_rotation(const struct search *s, const double rotation[9], bool *none,
                             struct search_result *result)
{
    struct search_result other = {.iterations = 0};
    int status = warp_create(&other.warp, &s->full.target);

    status = status ? status : warp_rotate(&other.warp, &s->full.target, rotation);
    status = status ? status : climb(s, 0, true, &other);
    result->iterations += other.iterations;
    if (status == SRNF_OK && (*none || other.warp.objective < result->warp.objective)) {
        other.iterations = result->iterations;
        search_result_clear(result);
        *result = other;
        *none = false;
        return SRNF_OK;
    }
    search_result_clear(&other);
    return status == SRNF_EUNMATCHED ? SRNF_OK : status;
}

/* From there, and from where the landmarks point. What cannot meet them is out. */
static int run_guided(const struct search *s, struct search_result *result)
{
    double rotations[LANDMARK_STARTS][9];
    size_t count = 0;
    int status = run_once(s, result);
    bool none = status == SRNF_EUNMATCHED;

    status = none ? SRNF_OK : status;
    status = status ? status : landmarks_start(s, rotations, &count);
    for (size_t k = 0; k < count && status == SRNF_OK; k++) {
        status = run_from_rotation(s, rotations[k], &none, result);
    }
    status = status == SRNF_OK && none ? SRNF_EUNMATCHED : status;
    if (status) {
        search_result_clear(result);
    }
    return status;
}

int search_run(const struct search *s, struct search_result *result)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    int status = s->landmarks && !still ? run_guided(s, result) : run_once(s, result);

    result->distance = distance(s, &result->warp);
    return status;
}

int search_refine(struct search *s, size_t rounds, struct search_result *result)
{
    int status = SRNF_OK;

    if (s->options->reparameterization && !s->options->exact && !s->landmarks &&
        result->warp.energy >= DIRECT_ENERGY) {
        s->rounds = rounds;
        status = climb_run(s, s->options->degree, true, result);
        if (status == SRNF_OK && result->warp.energy < DIRECT_ENERGY) {
            status = climb_again(s, result);
        }
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
        status = search_measure(s, &result->warp);
    }
    result->distance = distance(s, &result->warp);
    return status;
}

int search_continue(const struct search *s, const struct srnf_warp *chain,
                    struct search_result *result)
{
    size_t from = s->options->degree > BASIN_DEGREE ? BASIN_DEGREE : 0;
    int status = search_evaluate(s, chain, result);

    if (status == SRNF_OK && s->options->reparameterization) {
        status = climb(s, from, true, result);
    }
    if (status) {
        search_result_clear(result);
    }
    result->distance = distance(s, &result->warp);
    return status;
}
