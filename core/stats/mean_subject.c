/*
 * mean_subject.c - one subject of a group mean: where its registration puts it.
 *
 * The state of a subject is its rotation O and the chain of its warp. All else follows from them:
 * the points gamma(s) of the working grid, their Jacobians J, q_i and its derivative at the
 * points, and
 *
 *   q(s) = O sqrt(J(s)) q_i(gamma_i(s)).
 *
 * Nothing is resampled, so nothing is lost from one iteration to the next. Points and Jacobians are
 * the same bits whether they were moved link by link as the chain grew or are replayed from it: a
 * run that is resumed from its chains goes on with the same bits.
 *
 * The first registration is a search from nothing. Later ones only move the warp on (mean_step.c).
 * Where the domain is not warped but only rotated, each is a search.
 *
 * q_i and its Gauss-Newton matrix come from a table of the normal (registration/tabulated.h), finer
 * than that of a search: 2e-7 of q at most. Links carry the points by tables as well, to some 1e-9
 * in all. In exact mode nothing is tabulated. What is handed over in the end is evaluated without
 * tables in either case (mean_surface.c).
 *
 * Where tools are not kept, they are made anew for each use: the same bits.
 */
#include "mean.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

/* Damping of the steps, relative to the mean diagonal of H: small, as it is never raised. */
#define DAMPING 1e-3

#define TABLE_ORDER ((size_t)8)
#define TABLE_FINENESS 2.0

#define STEP_JACOBIAN_MIN 0.5
#define SHORTENINGS_MAX 8

/* ---- Tools ----------------------------------------------------------------------------------- */

double mean_tools_bytes(const struct mean_run *run)
{
    double unknowns = (double)registration_unknowns(run->degree);
    double rows = 4.0 * (double)srnf_sht_degree(run->sht) + 16.0;

    return 8.0 * (unknowns * unknowns + 8.0 * rows * rows);
}

static void clear_tools(struct mean_tools *tools)
{
    moving_clear(&tools->moving);
    tabulated_moving_clear(&tools->table);
    level_clear(&tools->level);
}

static int create_tools(const struct mean_run *run, size_t i, bool matrix, struct mean_tools *tools)
{
    size_t degree = srnf_sht_degree(run->sht);
    struct problem problem = {.moving = &tools->moving, .target.norm2 = run->norm2};
    int status;

    *tools = (struct mean_tools){0};
    status = moving_create(&tools->moving, degree, run->surfaces[i], degree, run->context);
    if (status == SRNF_OK && !run->registration.exact) {
        status = tabulated_moving_create(&tools->table, SRNF_REPRESENTATION_SRNF, degree,
                                         run->surfaces[i], degree, TABLE_ORDER, TABLE_FINENESS);
        tools->moving.table = &tools->table;
        problem.penalty.displacement = run->registration.penalty_displacement;
    }
    if (status == SRNF_OK && matrix) {
        status = level_create(&tools->level, &problem, run->degree);
    }
    if (status) {
        clear_tools(tools);
    }
    return status;
}

int mean_prepare(const struct mean_run *run, size_t i)
{
    return run->keeps ? create_tools(run, i, mean_is_warped(run), &run->subjects[i].tools)
                      : SRNF_OK;
}

/* Those that are kept, or made for now. */
static int open_tools(const struct mean_run *run, size_t i, bool matrix, struct mean_tools *now,
                      const struct mean_tools **tools)
{
    *tools = run->keeps ? &run->subjects[i].tools : now;
    return run->keeps ? SRNF_OK : create_tools(run, i, matrix, now);
}

static void close_tools(const struct mean_run *run, struct mean_tools *now)
{
    if (!run->keeps) {
        clear_tools(now);
    }
}

void mean_subject_clear(struct mean_subject *subject)
{
    srnf_warp_clear(&subject->warp);
    srnf_free(subject->pieces);
    clear_tools(&subject->tools);
}

/* ---- The warp -------------------------------------------------------------------------------- */

static size_t count_tabulated(const struct mean_run *run, const struct srnf_warp *warp)
{
    size_t count = 0;

    while (!run->registration.exact && count < warp->n_links &&
           (warp->links[count].kind == SRNF_WARP_ROTATION ||
            warp->links[count].kind == SRNF_WARP_EXP)) {
        count++;
    }
    return count;
}

int mean_take_registered(const struct mean_run *run, size_t i, const double rotation[9],
                         struct srnf_warp *warp)
{
    struct mean_subject *subject = &run->subjects[i];

    subject->tabulated = count_tabulated(run, warp);
    memcpy(subject->at.rotation, rotation, sizeof subject->at.rotation);
    return mean_chain_set(run, i, warp);
}

int mean_register_failed(size_t i, int status, const struct srnf_error *why,
                         struct srnf_error *error)
{
    return srnf_fail(error, status, (int64_t)i, "registering surface %zu to the mean: %s", i,
                     status == SRNF_EUNMATCHED ? why->message : srnf_strerror(status));
}

int mean_register(const struct mean_run *run, size_t i, const struct srnf_context *context,
                  struct srnf_error *error)
{
    struct mean_subject *subject = &run->subjects[i];
    const bool guided = mean_is_guided(run);
    const struct srnf_landmarks landmarks =
        guided ? mean_landmarks_of(run, i) : (struct srnf_landmarks){.n = 0};
    struct srnf_warp warp = {0}, recalled = {0};
    struct srnf_error why = {0};
    double rotation[9];
    int status;

    if (run->iterations == 0 && mean_recall_registered(run, i, context, &recalled)) {
        subject->tabulated = count_tabulated(run, &recalled);
        if (run->spill) { /* it is there already */
            mean_chain_close(run, &recalled);
            return SRNF_OK;
        }
        return mean_chain_set(run, i, &recalled);
    }
    status = registration_to_field(run->work, run->mean_q, run->norm2, run->surfaces[i],
                                   &run->registration, guided ? &landmarks : NULL, context,
                                   rotation, &warp, &why);
    if (status) {
        return mean_register_failed(i, status, &why, error);
    }
    status = mean_take_registered(run, i, rotation, &warp);
    if (status == SRNF_OK && run->iterations == 0) {
        mean_keep_registered(run, i, context);
    }
    return status;
}

static int cloud_from(const struct mean_run *run, const double *gamma, const double *jacobian,
                      struct cloud *cloud)
{
    size_t n = run->points;
    int status = cloud_create(cloud, (n + SRNF_LANES - 1) / SRNF_LANES * SRNF_LANES);

    for (size_t k = 0; status == SRNF_OK && k < cloud->n; k++) {
        size_t at = k < n ? k : n - 1;

        for (size_t c = 0; c < 3; c++) {
            cloud->point[c][k] = gamma[3 * at + c];
        }
        cloud->jacobian[k] = jacobian[at];
    }
    return status;
}

static void cloud_to(const struct cloud *cloud, size_t n, double *gamma, double *jacobian)
{
    for (size_t k = 0; k < n; k++) {
        for (size_t c = 0; c < 3; c++) {
            gamma[3 * k + c] = cloud->point[c][k];
        }
        jacobian[k] = cloud->jacobian[k];
    }
}

/* Points and Jacobians along links that tables can follow. */
static int follow_tables(const struct mean_run *run, const struct srnf_warp *warp, double *gamma,
                         double *jacobian)
{
    struct cloud cloud = {0};
    int status = cloud_from(run, gamma, jacobian, &cloud);

    status = status ? status : cloud_follow(&cloud, warp, &follow_table, run->context);
    if (status == SRNF_OK) {
        cloud_to(&cloud, run->points, gamma, jacobian);
    }
    cloud_clear(&cloud);
    return status;
}

/* The nodes along a chain whose first links are tabulated. */
static int follow(const struct mean_run *run, const struct srnf_warp *chain, size_t tabulated,
                  double *gamma, double *jacobian)
{
    const struct srnf_warp first = {.n_links = tabulated, .links = chain->links};
    const struct srnf_warp rest = {.n_links = chain->n_links - tabulated,
                                   .links = chain->links + tabulated};
    int status = SRNF_OK;

    memcpy(gamma, run->nodes, 3 * run->points * sizeof(double));
    for (size_t k = 0; k < run->points; k++) {
        jacobian[k] = 1.0;
    }
    if (first.n_links > 0) {
        status = follow_tables(run, &first, gamma, jacobian);
    }
    if (status == SRNF_OK && rest.n_links > 0) {
        status = warp_follow(&rest, run->context, run->points, gamma, jacobian);
    }
    return status;
}

int mean_replay(const struct mean_run *run, size_t i)
{
    size_t tabulated = run->subjects[i].tabulated;
    struct mean_points points;
    struct srnf_warp chain;
    int status = mean_chain_open(run, i, &chain);

    if (status) {
        return status;
    }
    if (tabulated > chain.n_links) {
        status = SRNF_EIO;
    }
    status = status ? status : mean_points_open(run, i, false, &points);
    if (status == SRNF_OK) {
        status = follow(run, &chain, tabulated, points.gamma, points.jacobian);
        if (status == SRNF_OK) {
            status = mean_points_keep(run, i, &points);
        } else {
            mean_points_drop(&points);
        }
    }
    mean_chain_close(run, &chain);
    return status;
}

/* ---- Against the mean ------------------------------------------------------------------------ */

static struct problem problem_of(const struct mean_run *run, const struct moving *moving)
{
    const struct srnf_register_options *o = &run->registration;
    struct problem problem = {.target = {run->points, run->nodes, run->weight, run->target,
                                         run->norm2, run->reference, run->area},
                              .moving = moving,
                              .free_rotation = o->rotation && !o->common_pose};

    if (!o->exact) {
        problem.penalty = (struct penalty){o->penalty_jacobian, o->penalty_displacement};
    }
    return problem;
}

/* Points of the subject as a warp, which owns nothing. */
static struct warp warp_of(const struct mean_run *run, size_t i, double *points, double *jacobian)
{
    struct warp warp = {.n = run->points, .points = points, .jacobian = jacobian};

    memcpy(warp.rotation, run->subjects[i].at.rotation, sizeof warp.rotation);
    return warp;
}

/* How the subject stands at the points of a warp, and its samples there. */
static void stand(const struct mean_run *run, size_t i, const struct mean_tools *tools,
                  struct warp *warp, struct samples *samples)
{
    struct mean_stand *at = &run->subjects[i].at;
    struct problem problem = problem_of(run, &tools->moving);

    registration_objective(&problem, warp, samples, at->displacement);
    memcpy(at->rotation, warp->rotation, sizeof at->rotation);
    at->energy = warp->energy;
    at->penalty = warp->objective - warp->energy;
}

/* O sqrt(J) q */
static void fill_field(const struct warp *warp, const struct samples *samples, double *field)
{
    for (size_t k = 0; k < warp->n; k++) {
        const double *x = samples->q + 3 * k;
        double root = sqrt(warp->jacobian[k]);

        for (size_t c = 0; c < 3; c++) {
            const double *o = warp->rotation + 3 * c;

            field[c * warp->n + k] = root * (o[0] * x[0] + o[1] * x[1] + o[2] * x[2]);
        }
    }
}

/* step <- (H + damping + penalties)^-1 step, for the fields of one subject. */
static bool solve(const struct level *level, size_t unknowns, double curvature, double *damping,
                  double *factor, double *step)
{
    lapack_int n = (lapack_int)unknowns;

    registration_damping(level, unknowns, damping);
    return registration_factor(level, unknowns, curvature, DAMPING, damping, factor) &&
           LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, factor, n, step, n) == 0;
}

/* potentials: [2][(D+1)^2], where the subject stands. */
static int find_potentials(const struct mean_run *run, size_t i, const struct mean_tools *tools,
                           const struct warp *warp, const struct samples *samples,
                           double *potentials)
{
    struct problem problem = problem_of(run, &tools->moving);
    size_t k = registration_unknowns(run->degree);
    size_t unknowns = problem.free_rotation ? k : k - 3;
    double *factor = srnf_alloc(k * k + 2 * k, sizeof(double));
    double *damping = factor ? factor + k * k : NULL;
    double *step = factor ? damping + k : NULL;
    double curvature;
    int status = SRNF_ENOMEM;

    if (factor) {
        status = registration_gradient(&problem, &tools->level, warp, samples,
                                       run->subjects[i].at.displacement, step, &curvature);
    }
    if (status == SRNF_OK && !solve(&tools->level, unknowns, curvature, damping, factor, step)) {
        status = SRNF_ENUMERIC;
    }
    if (status == SRNF_OK && mean_is_guided(run)) {
        status = mean_landmarks_correct(run, i, factor, unknowns, step);
    }
    if (status == SRNF_OK) {
        registration_potentials(&tools->level.fields, step, potentials);
    }
    srnf_free(factor);
    return status;
}

int mean_measure(const struct mean_run *run, size_t i, double *field, double *potentials)
{
    const struct mean_tools *tools;
    struct mean_tools now = {0};
    struct mean_points points;
    struct samples samples = {0};
    struct warp warp = {.n = 0};
    int status = mean_points_open(run, i, true, &points);

    if (status) {
        return status;
    }
    status = open_tools(run, i, potentials != NULL, &now, &tools);
    status = status ? status : samples_create(&samples, run->points);
    if (status == SRNF_OK) {
        warp = warp_of(run, i, points.gamma, points.jacobian);
        stand(run, i, tools, &warp, &samples);
        status = mean_landmarks_measure(run, i, NULL, NULL);
    }
    if (status == SRNF_OK && field) {
        fill_field(&warp, &samples, field);
    }
    if (status == SRNF_OK && potentials) {
        status = find_potentials(run, i, tools, &warp, &samples, potentials);
    }
    samples_clear(&samples);
    close_tools(run, &now);
    mean_points_drop(&points);
    return status;
}

int mean_penalize(const struct mean_run *run, size_t i)
{
    struct mean_stand *at = &run->subjects[i].at;
    struct problem problem = problem_of(run, NULL);
    struct mean_points points;
    struct warp warp;
    int status = mean_points_open(run, i, true, &points);

    if (status == SRNF_OK) {
        warp = warp_of(run, i, points.gamma, points.jacobian);
        at->penalty = registration_penalty(&problem, &warp, at->displacement);
        mean_points_drop(&points);
    }
    return status;
}

/* ---- Steps ----------------------------------------------------------------------------------- */

/* What moves the points of a subject: tables, as chains are followed, or in exact mode the fields
   themselves. */
struct mover {
    bool exact;
    size_t n;
    struct mean_points at; /* where it begins */
    struct fields fields;
    double *scratch;
    struct tabulated_fields tables;
    struct cloud from, to;
};

static void close_mover(struct mover *m)
{
    mean_points_drop(&m->at);
    fields_clear(&m->fields);
    srnf_free(m->scratch);
    tabulated_fields_clear(&m->tables);
    cloud_clear(&m->from);
    cloud_clear(&m->to);
}

static int open_mover(const struct mean_run *run, size_t i, struct mover *m)
{
    int status;

    *m = (struct mover){.exact = run->registration.exact, .n = run->points};
    status = mean_points_open(run, i, true, &m->at);
    if (status) {
        return status;
    }
    if (m->exact) {
        m->scratch = srnf_alloc(FIELDS_SCRATCH * m->n, sizeof(double));
        status = m->scratch ? fields_create(&m->fields, run->degree, run->context) : SRNF_ENOMEM;
    } else {
        status = tabulated_fields_create(&m->tables, run->degree, follow_table.order,
                                         field_table_rows(&follow_table, run->degree));
        status = status ? status : cloud_from(run, m->at.gamma, m->at.jacobian, &m->from);
        status = status ? status : cloud_create(&m->to, m->from.n);
    }
    if (status) {
        close_mover(m);
    }
    return status;
}

/* The points moved by a step; its least Jacobian. In place is allowed. */
static double move_points(struct mover *m, const double *potentials, double *gamma,
                          double *jacobian)
{
    double least;

    if (m->exact) {
        return fields_apply(&m->fields, potentials, m->n, m->at.gamma, m->at.jacobian, gamma,
                            jacobian, m->scratch);
    }
    tabulated_fields_fill(&m->tables, potentials);
    least = cloud_move(&m->tables.table, &m->from, &m->to);
    cloud_to(&m->to, m->n, gamma, jacobian);
    return least;
}

/* to <- the points of subject i, moved by a part of its step. taken: what is left of that, which is
   nothing where even a short step would fold. */
static int move_by(const struct mean_run *run, size_t i, double length,
                   const struct srnf_context *context, struct warp *to)
{
    size_t size = 2 * srnf_coefficient_count(run->degree);
    double *taken = run->taken + i * size;
    struct mover mover;
    double least = 0.0;
    int status = open_mover(run, i, &mover);

    if (status) {
        return status;
    }
    linear_copy(size, run->potentials + i * size, taken);
    linear_scale(size, length, taken);
    for (size_t k = 0; !(least >= STEP_JACOBIAN_MIN) && !srnf_is_canceled(context); k++) {
        least = move_points(&mover, taken, to->points, to->jacobian);
        if (!(least >= STEP_JACOBIAN_MIN) && k < SHORTENINGS_MAX) {
            linear_scale(size, 0.5, taken);
        } else if (!(least >= STEP_JACOBIAN_MIN)) {
            memset(taken, 0, size * sizeof(double));
        }
    }
    close_mover(&mover);
    return SRNF_OK;
}

int mean_try(const struct mean_run *run, size_t i, double length,
             const struct srnf_context *context, double *field)
{
    size_t n = run->points;
    double *points = srnf_alloc(4 * n, sizeof(double));
    const struct mean_tools *tools;
    struct mean_tools now = {0};
    struct samples samples = {0};
    struct warp warp = warp_of(run, i, points, points ? points + 3 * n : NULL);
    int status = points ? open_tools(run, i, false, &now, &tools) : SRNF_ENOMEM;

    status = status ? status : samples_create(&samples, n);
    if (status == SRNF_OK) {
        status = move_by(run, i, length, context, &warp);
    }
    if (status == SRNF_OK) {
        stand(run, i, tools, &warp, &samples);
        fill_field(&warp, &samples, field);
        status = mean_landmarks_measure(run, i, &tools->level.fields,
                                        run->taken + 2 * i * tools->level.fields.count);
    }
    samples_clear(&samples);
    close_tools(run, &now);
    srnf_free(points);
    return status;
}

int mean_move(const struct mean_run *run, size_t i)
{
    size_t size = 2 * srnf_coefficient_count(run->degree);
    struct mover mover;
    int status = open_mover(run, i, &mover);

    if (status == SRNF_OK) {
        (void)move_points(&mover, run->taken + i * size, mover.at.gamma, mover.at.jacobian);
        status = mean_points_keep(run, i, &mover.at);
        close_mover(&mover);
    }
    return status;
}
