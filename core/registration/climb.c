/*
 * climb.c - fields of rising degree on the full grid, by tables, until nothing is left to gain.
 *
 * The points of the nodes are carried from step to step by splines of eight nodes, whose errors (a
 * few 1e-9 after all steps) the objective keeps; it is measured with the moving field as it is.
 */
#include "tournament.h"

#include <math.h>
#include <string.h>

#define STEPS_MAX ((size_t)120) /* of a degree; common poses may need 100 to come to rest */
#define FIELDS_ORDER ((size_t)8)

/* Degrees of the fields in turn, and the gain below which each is left. */
static const struct {
    size_t degree;
    double decrease;
} ladder[] = {{4, 1e-2}, {8, 3e-3}, {12, 3e-4}, {16, 1e-3}, {24, 1e-3}, {32, 1e-3}};
#define RUNGS (sizeof ladder / sizeof ladder[0])

struct climb {
    const struct search *search;
    struct tabulated_target target;
    struct tabulated_problem problem;
    struct cloud cloud, spare;
};

/* Rows of the table of fields of a degree. */
static size_t table_rows(size_t degree)
{
    size_t rows = (4 * degree + 11) / 4 * 4;

    return rows < 16 ? 16 : rows;
}

static void close_climb(struct climb *c)
{
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
    return status;
}

/* ---- Points in and out ----------------------------------------------------------------------- */

static void cloud_from(struct cloud *cloud, const struct tabulated_target *target, size_t n,
                       const double *points, const double *jacobian)
{
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

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

/* Follows a chain of one rotation and steps from the nodes. */
static int replay(struct climb *c, const struct srnf_warp *chain)
{
    struct tabulated_fields fields = {0};
    int status = SRNF_OK;

    cloud_rotate(&c->cloud, &c->target, chain->links[0].values);
    for (size_t k = 1; k < chain->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &chain->links[k];

        if (fields.degree != link->degree) {
            tabulated_fields_clear(&fields);
            status = tabulated_fields_create(&fields, link->degree, FIELDS_ORDER,
                                             table_rows(link->degree));
        }
        if (status == SRNF_OK) {
            tabulated_fields_fill(&fields, link->values);
            (void)cloud_move(&fields.table, &c->cloud, &c->cloud);
        }
    }
    tabulated_fields_clear(&fields);
    return status;
}

/* ---- Rungs ----------------------------------------------------------------------------------- */

static int open_level(const struct climb *c, size_t degree, struct tabulated_level *level)
{
    const struct search *s = c->search;
    size_t k = registration_unknowns(degree);
    double *matrix;
    int status;

    if (degree <= s->subject->top) {
        return tabulated_level_create(level, degree, s->subject->top, s->subject->matrix,
                                      s->full.target.norm2, s->full.penalty.displacement,
                                      s->full.free_rotation);
    }
    matrix = srnf_alloc(k * k, sizeof(double));
    status = matrix ? tabulated_matrix(&s->subject->full, degree, s->context, matrix) : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        status = tabulated_level_create(level, degree, degree, matrix, s->full.target.norm2,
                                        s->full.penalty.displacement, s->full.free_rotation);
    }
    srnf_free(matrix);
    return status;
}

static int climb_rung(struct climb *c, size_t degree, double decrease, struct search_result *result)
{
    const struct srnf_register_options *options = c->search->options;
    struct schedule schedule = {options->max_steps ? options->max_steps : STEPS_MAX, decrease};
    struct tabulated_fields fields = {0};
    struct tabulated_level level = {0};
    struct tabulated_optimizer o = {&c->problem, &fields, &level, &c->spare, c->search->context};
    int status = tabulated_fields_create(&fields, degree, FIELDS_ORDER, table_rows(degree));

    if (status == SRNF_OK) {
        status = open_level(c, degree, &level);
    }
    if (status == SRNF_OK) {
        status = tabulated_optimize(&o, &schedule, &c->cloud, &result->warp.chain,
                                    &result->warp.stopped, &result->iterations);
    }
    tabulated_level_clear(&level);
    tabulated_fields_clear(&fields);
    return status;
}

static int climb_rungs(struct climb *c, size_t from, struct search_result *result)
{
    size_t most = c->search->options->degree;
    int status = SRNF_OK;

    for (size_t k = 0; k < RUNGS && status == SRNF_OK; k++) {
        size_t degree = ladder[k].degree < most ? ladder[k].degree : most;

        if (degree > from) {
            status = climb_rung(c, degree, ladder[k].decrease, result);
        }
        if (k + 1 == RUNGS || ladder[k].degree >= most) {
            break;
        }
    }
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

int climb_run(const struct search *s, size_t from, bool replayed, struct search_result *result)
{
    size_t n = s->full.target.n;
    struct climb c = {.search = s};
    int status = open_climb(&c);

    if (status == SRNF_OK && !replayed) {
        status = replay(&c, &result->warp.chain);
    } else if (status == SRNF_OK) {
        cloud_from(&c.cloud, &c.target, n, result->warp.points, result->warp.jacobian);
    }
    if (status == SRNF_OK) {
        cloud_evaluate(c.problem.moving, &c.cloud);
        cloud_measure(&c.problem, &c.cloud);
        status = climb_rungs(&c, from, result);
    }
    if (status == SRNF_OK) {
        cloud_to(&c.cloud, n, result->warp.points, result->warp.jacobian);
    }
    close_climb(&c);
    return status ? status : search_measure(s, &result->warp);
}
