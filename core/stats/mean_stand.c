/*
 * mean_stand.c - how one subject of a group mean stands to the mean, and the steps of its warp.
 *
 * By tables (mean_tools.c), or in exact mode without any. Where that fits, q and its derivatives at
 * the points are kept from the step that led there to the next.
 */
#include "mean.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define DAMPING 1e-3 /* of steps in exact mode, relative to the mean diagonal of H */

#define STEP_JACOBIAN_MIN 0.5
#define SHORTENINGS_MAX 8

/* ---- Against the mean ------------------------------------------------------------------------ */

/* What exact mode evaluates without tables. */
struct direct {
    double *gamma, *jacobian; /* [P][3], [P] */
    struct samples samples;
};

static void close_direct(struct direct *d)
{
    srnf_free(d->gamma);
    samples_clear(&d->samples);
}

static int open_direct(const struct mean_run *run, const struct mean_tools *tools,
                       const struct mean_points *points, struct direct *d)
{
    int status = samples_create(&d->samples, run->points);

    d->gamma = srnf_alloc(4 * run->points, sizeof(double));
    if (status || !d->gamma) {
        close_direct(d);
        return SRNF_ENOMEM;
    }
    d->jacobian = d->gamma + 3 * run->points;
    mean_points_out(run, points, d->gamma, d->jacobian);
    moving_evaluate(&tools->moving, d->gamma, &d->samples);
    return SRNF_OK;
}

/* q alone, at the points. */
static int sample_directly(const struct mean_run *run, const struct mean_tools *tools,
                           const struct mean_points *points, struct cloud *cloud)
{
    struct direct d;
    int status = open_direct(run, tools, points, &d);

    if (status) {
        return status;
    }
    for (size_t k = 0; k < run->padded; k++) {
        size_t at = k < run->points ? k : run->points - 1;

        for (size_t c = 0; c < 3; c++) {
            cloud->q[c][k] = d.samples.q[3 * at + c];
        }
    }
    close_direct(&d);
    return SRNF_OK;
}

/* q and its derivatives, in arrays of the subject where these are kept. */
static void sample_table(struct mean_tools *tools, struct cloud *cloud)
{
    double *kept = tools->samples;

    for (size_t c = 0; kept && c < 3; c++) {
        cloud->q[c] = kept + c * cloud->n;
        cloud->q_1[c] = kept + (3 + c) * cloud->n;
        cloud->q_2[c] = kept + (6 + c) * cloud->n;
    }
    if (!kept || !tools->sampled) {
        cloud_evaluate(&tools->table, cloud);
    }
    tools->sampled = kept != NULL;
}

/* How the subject stands at its points. cloud: J / K, and what is there, afterwards. */
static int stand(const struct mean_run *run, size_t i, struct mean_tools *tools,
                 const struct mean_points *points, struct cloud *cloud)
{
    int status = SRNF_OK;

    for (size_t c = 0; c < 3; c++) {
        cloud->point[c] = points->gamma[c];
    }
    mean_divide(run->padded, points->jacobian, run->area, cloud->jacobian);
    if (run->registration.exact) {
        status = sample_directly(run, tools, points, cloud);
    } else {
        sample_table(tools, cloud);
    }
    if (status == SRNF_OK) {
        mean_stand_at(run, cloud, &run->subjects[i].at);
    }
    return status;
}

/* ---- Gauss-Newton steps ---------------------------------------------------------------------- */

/* step <- (H + damping)^-1 step, in exact mode. */
static bool solve_directly(const struct level *level, size_t unknowns, double curvature,
                           double *damping, double *factor, double *step)
{
    lapack_int n = (lapack_int)unknowns;

    registration_damping(level, unknowns, damping);
    return registration_factor(level, unknowns, curvature, DAMPING, damping, factor) &&
           LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, factor, n, step, n) == 0;
}

static int find_step_directly(const struct mean_run *run, size_t i, const struct mean_tools *tools,
                              const struct mean_points *points, double *step)
{
    const struct mean_stand *at = &run->subjects[i].at;
    struct problem problem = {.target = {run->points, run->nodes, run->weight, run->target,
                                         run->norm2, run->reference, run->area},
                              .moving = &tools->moving,
                              .free_rotation = mean_rotates(run)};
    size_t k = registration_unknowns(run->degree);
    double *factor = srnf_alloc(k * k + k, sizeof(double));
    struct warp warp = {.n = run->points};
    struct direct d;
    double curvature;
    int status = factor ? open_direct(run, tools, points, &d) : SRNF_ENOMEM;

    if (status) {
        srnf_free(factor);
        return status;
    }
    warp.points = d.gamma;
    warp.jacobian = d.jacobian;
    memcpy(warp.rotation, at->rotation, sizeof warp.rotation);
    status = registration_gradient(&problem, &tools->level, &warp, &d.samples, at->displacement,
                                   step, &curvature);
    if (status == SRNF_OK && !solve_directly(&tools->level, problem.free_rotation ? k : k - 3,
                                             curvature, factor + k * k, factor, step)) {
        status = SRNF_ENUMERIC;
    }
    close_direct(&d);
    srnf_free(factor);
    return status;
}

static int find_step(const struct mean_run *run, size_t i, struct mean_tools *tools,
                     struct mean_place *place, double *step)
{
    const struct srnf_register_options *o = &run->registration;
    const struct mean_stand *at = &run->subjects[i].at;
    const struct tabulated_problem problem = {&run->aim,
                                              &tools->table,
                                              {o->penalty_jacobian, o->penalty_displacement},
                                              mean_rotates(run)};
    struct cloud *cloud = &place->from;
    double *rhs = place->vectors;
    double torque[3], curvature;

    memcpy(cloud->rotation, at->rotation, sizeof cloud->rotation);
    memcpy(cloud->displacement, at->displacement, sizeof cloud->displacement);
    curvature = cloud_load(&problem, cloud, &place->fields.table, torque);
    tabulated_fields_transpose(&place->fields, torque, rhs);
    if (!mean_matrix_solve(run, &tools->matrix, curvature, rhs, step)) {
        return SRNF_ENUMERIC;
    }
    return mean_is_guided(run) ? mean_landmarks_correct(run, i, &tools->matrix, curvature, step)
                               : SRNF_OK;
}

/* potentials: [2][(D+1)^2], where the subject stands. */
static int find_potentials(const struct mean_run *run, size_t i, struct mean_tools *tools,
                           const struct mean_points *points, struct mean_place *place,
                           double *potentials)
{
    double *step = place->vectors + registration_unknowns(run->degree);
    int status = run->registration.exact ? find_step_directly(run, i, tools, points, step)
                                         : find_step(run, i, tools, place, step);

    if (status == SRNF_OK) {
        tabulated_fields_potentials(&place->fields, step, potentials);
    }
    return status;
}

/* ---- Steps towards it ------------------------------------------------------------------------ */

/* What is open while a subject is looked at. */
struct session {
    struct mean_tools now, *tools;
    struct mean_points points;
    struct mean_place *place;
};

static void close_session(const struct mean_run *run, struct session *s)
{
    mean_tools_close(run, &s->now);
    mean_points_drop(&s->points);
    if (s->place) {
        mean_place_leave(s->place);
    }
}

static int open_session(const struct mean_run *run, size_t i, bool matrix, struct session *s)
{
    int status;

    *s = (struct session){.place = NULL};
    status = mean_points_open(run, i, true, &s->points);
    if (status) {
        return status;
    }
    status = mean_tools_open(run, i, matrix, &s->now, &s->tools);
    s->place = status ? NULL : mean_place_take(run);
    if (!s->place) {
        close_session(run, s);
        return status ? status : SRNF_ENOMEM;
    }
    return SRNF_OK;
}

int mean_measure(const struct mean_run *run, size_t i, double *field, double *potentials)
{
    struct session s;
    int status = open_session(run, i, potentials != NULL, &s);

    if (status) {
        return status;
    }
    status = stand(run, i, s.tools, &s.points, &s.place->from);
    status = status ? status : mean_landmarks_measure(run, i, NULL);
    if (status == SRNF_OK && field) {
        mean_lay_field(run->subjects[i].at.rotation, s.points.jacobian, s.place->from.q,
                       run->points, field);
    }
    if (status == SRNF_OK && potentials) {
        status = find_potentials(run, i, s.tools, &s.points, s.place, potentials);
    }
    close_session(run, &s);
    return status;
}

int mean_penalize(const struct mean_run *run, size_t i)
{
    struct mean_place *place = mean_place_take(run);
    struct mean_points points;
    int status = place ? mean_points_open(run, i, true, &points) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        const double *const point[3] = {points.gamma[0], points.gamma[1], points.gamma[2]};

        mean_divide(run->padded, points.jacobian, run->area, place->from.jacobian);
        mean_penalty_at(run, point, place->from.jacobian, &run->subjects[i].at);
        mean_points_drop(&points);
    }
    if (place) {
        mean_place_leave(place);
    }
    return status;
}

/* ---- Steps ----------------------------------------------------------------------------------- */

/* to <- the points moved by a step, in exact mode. least: its least Jacobian. */
static int move_directly(const struct mean_run *run, const double *potentials,
                         const struct mean_points *from, const struct mean_points *to,
                         double *least)
{
    size_t n = run->points;
    double *gamma = srnf_alloc((4 + FIELDS_SCRATCH) * n, sizeof(double));
    double *jacobian = gamma ? gamma + 3 * n : NULL;
    struct fields fields = {0};
    int status = gamma ? fields_create(&fields, run->degree, run->context) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        mean_points_out(run, from, gamma, jacobian);
        *least =
            fields_apply(&fields, potentials, n, gamma, jacobian, gamma, jacobian, jacobian + n);
        mean_points_in(run, gamma, jacobian, to);
    }
    fields_clear(&fields);
    srnf_free(gamma);
    return status;
}

/* The same by tables, as chains are followed; or as exact mode does. */
static int move_points(const struct mean_run *run, struct mean_place *place,
                       const double *potentials, const struct mean_points *from, double *least)
{
    struct cloud cloud = mean_cloud_of(run, from);
    const struct mean_points to = {
        .gamma = {place->to.point[0], place->to.point[1], place->to.point[2]},
        .jacobian = place->to.jacobian};

    if (run->registration.exact) {
        return move_directly(run, potentials, from, &to, least);
    }
    tabulated_fields_fill(&place->fields, potentials);
    *least = cloud_move(&place->fields.table, &cloud, &place->to);
    return SRNF_OK;
}

/* The points of subject i moved by a part of its step. taken: what is left of that, which is
   nothing where even a short step would fold. */
static int move_by(const struct mean_run *run, size_t i, double length,
                   const struct srnf_context *context, struct mean_place *place,
                   const struct mean_points *points)
{
    size_t size = 2 * srnf_coefficient_count(run->degree);
    double *taken = run->taken + i * size;
    double least = 0.0;
    int status = SRNF_OK;

    linear_copy(size, run->potentials + i * size, taken);
    linear_scale(size, length, taken);
    for (size_t k = 0; !(least >= STEP_JACOBIAN_MIN) && status == SRNF_OK; k++) {
        if (srnf_is_canceled(context)) {
            return SRNF_OK;
        }
        status = move_points(run, place, taken, points, &least);
        if (!(least >= STEP_JACOBIAN_MIN) && k < SHORTENINGS_MAX) {
            linear_scale(size, 0.5, taken);
        } else if (!(least >= STEP_JACOBIAN_MIN)) {
            memset(taken, 0, size * sizeof(double));
        }
    }
    for (size_t c = 0; c < 3 && status == SRNF_OK; c++) {
        linear_copy(run->padded, place->to.point[c], points->gamma[c]);
    }
    if (status == SRNF_OK) {
        linear_copy(run->padded, place->to.jacobian, points->jacobian);
    }
    return status;
}

int mean_try(const struct mean_run *run, size_t i, double length,
             const struct srnf_context *context, double *field)
{
    struct session s;
    int status = open_session(run, i, false, &s);

    if (status) {
        return status;
    }
    status = move_by(run, i, length, context, s.place, &s.points);
    s.tools->sampled = false;
    status = status ? status : stand(run, i, s.tools, &s.points, &s.place->from);
    if (status == SRNF_OK) {
        mean_lay_field(run->subjects[i].at.rotation, s.points.jacobian, s.place->from.q,
                       run->points, field);
        status = mean_landmarks_measure(run, i,
                                        run->taken + 2 * i * srnf_coefficient_count(run->degree));
    }
    status = status ? status : mean_points_keep(run, i, &s.points);
    close_session(run, &s);
    return status;
}
