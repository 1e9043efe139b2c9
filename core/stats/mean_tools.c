/*
 * mean_tools.c - what the subjects of a group mean are evaluated and moved with.
 *
 * Of a subject: q_i from a table of the normal (registration/tabulated.h), finer than that of a
 * search, to 2e-7 of q at most, and its Gauss-Newton matrix. Where tools are kept, so is a factor
 * of the matrix, and, if that fits as well, what was last evaluated. Damping is rounded to a ladder
 * as in registration/tabulated_level.c, so that one factor serves several iterations; which rung it
 * is does not depend on what was kept. Where tools are not kept they are made anew for each use:
 * the same bits.
 *
 * Of a thread: the table of a step's field, and room. Places are made as threads ask for them, one
 * for each body that runs, and hold nothing from one body to the next.
 */
#include "mean.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

/* Damping of the steps, relative to the mean diagonal of H: small, as it is never raised. */
#define DAMPING 1e-3
#define RUNG 1.25

#define TABLE_ORDER ((size_t)8)
#define TABLE_FINENESS 2.0

#define SAMPLES ((size_t)9) /* q, and its derivatives in two directions */

/* ---- The matrix ------------------------------------------------------------------------------ */

static double eigenvalue(size_t fields, size_t i)
{
    size_t l = (size_t)sqrt((double)(i % fields + 1) + 0.5);

    return i < 2 * fields ? (double)(l * (l + 1)) : 2.0;
}

static void matrix_clear(struct mean_matrix *m)
{
    srnf_free(m->square);
    *m = (struct mean_matrix){0};
}

static int matrix_create(const struct mean_run *run, const struct tabulated_moving *table,
                         struct mean_matrix *m)
{
    double displacement = run->registration.penalty_displacement;
    size_t k = registration_unknowns(run->degree);
    int status;

    *m = (struct mean_matrix){.unknowns = k,
                              .fields = srnf_coefficient_count(run->degree) - 1,
                              .square = srnf_alloc(k * k + k, sizeof(double))};
    if (!m->square) {
        return SRNF_ENOMEM;
    }
    m->diagonal = m->square + k * k;
    status = tabulated_matrix(table, run->degree, run->context, m->square);
    if (status) {
        matrix_clear(m);
        return status;
    }
    linear_scale(k * k, 1.0 / run->norm2, m->square);
    for (size_t i = 0; i < k; i++) {
        m->diagonal[i] = m->square[i * k + i];
        if (i < m->fields) { /* the displacement penalty is diagonal: registration/matrix.c */
            m->diagonal[i] += displacement * (1.0 + 0.25 * eigenvalue(m->fields, i));
        } else if (i < 2 * m->fields) {
            m->diagonal[i] += displacement;
        }
    }
    return SRNF_OK;
}

/* Unknowns that are free: those of the value rotation come last. */
static size_t free_unknowns(const struct mean_run *run, const struct mean_matrix *m)
{
    return mean_rotates(run) ? m->unknowns : m->unknowns - 3;
}

/* The factor for a rung of the damping of gradients. Fields without divergence, and the value
   rotation, know nothing of the Jacobian penalty. */
static void factorize(struct mean_matrix *m, size_t unknowns, double least, long rung)
{
    size_t k = m->unknowns;
    double damping = pow(RUNG, (double)rung);

    for (size_t j = 0; j < unknowns; j++) {
        for (size_t i = 0; i < j; i++) {
            m->square[j * k + i] = m->square[i * k + j];
        }
        m->square[j * k + j] =
            m->diagonal[j] + (j < m->fields ? damping : least) * eigenvalue(m->fields, j);
    }
    m->regular = LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'U', (lapack_int)unknowns, m->square,
                                     (lapack_int)k) == 0;
    m->rung = rung;
    m->factored = true;
}

bool mean_matrix_solve(const struct mean_run *run, struct mean_matrix *m, double curvature,
                       const double *rhs, double *step)
{
    size_t n = free_unknowns(run, m);
    double trace = 0.0, sum = 0.0, least;
    long rung;

    for (size_t i = 0; i < n; i++) {
        trace += m->diagonal[i];
        sum += eigenvalue(m->fields, i);
    }
    least = DAMPING * trace / sum;
    rung = lrint(log(least + curvature) / log(RUNG));
    if (!m->factored || m->rung != rung) {
        factorize(m, n, least, rung);
    }
    linear_copy(n, rhs, step);
    memset(step + n, 0, (m->unknowns - n) * sizeof *step);
    if (m->regular) {
        cblas_dtrsv(CblasColMajor, CblasUpper, CblasTrans, CblasNonUnit, (int)n, m->square,
                    (int)m->unknowns, step, 1);
        cblas_dtrsv(CblasColMajor, CblasUpper, CblasNoTrans, CblasNonUnit, (int)n, m->square,
                    (int)m->unknowns, step, 1);
    }
    return m->regular;
}

/* ---- Tools ----------------------------------------------------------------------------------- */

void mean_tools_decide(struct mean_run *run, size_t keep_bytes)
{
    double unknowns = (double)registration_unknowns(run->degree);
    double rows = 4.0 * (double)srnf_sht_degree(run->sht) + 16.0;
    double tools = 8.0 * (unknowns * unknowns + 8.0 * rows * rows);
    double samples = 8.0 * (double)SAMPLES * (double)run->padded;
    double each = (double)keep_bytes / (double)run->n;

    run->keeps = run->registered && tools <= each;
    run->remembers = run->keeps && !run->registration.exact && tools + samples <= each;
}

void mean_tools_clear(struct mean_tools *tools)
{
    moving_clear(&tools->moving);
    tabulated_moving_clear(&tools->table);
    level_clear(&tools->level);
    matrix_clear(&tools->matrix);
    srnf_free(tools->samples);
    tools->samples = NULL;
}

static int create_exact(const struct mean_run *run, size_t i, bool matrix, struct mean_tools *tools)
{
    size_t degree = srnf_sht_degree(run->sht);
    struct problem problem = {.moving = &tools->moving, .target.norm2 = run->norm2};
    int status = moving_create(&tools->moving, degree, run->surfaces[i], degree, run->context);

    return status || !matrix ? status : level_create(&tools->level, &problem, run->degree);
}

static int create_tools(const struct mean_run *run, size_t i, bool matrix, struct mean_tools *tools)
{
    size_t degree = srnf_sht_degree(run->sht);
    int status;

    *tools = (struct mean_tools){0};
    if (run->registration.exact) {
        status = create_exact(run, i, matrix, tools);
    } else {
        struct tabulated_tools *kept;

        status = tools_take(run->pool, &kept);
        if (status == SRNF_OK) {
            status = tabulated_moving_create(&tools->table, SRNF_REPRESENTATION_SRNF, degree,
                                             run->surfaces[i], degree, TABLE_ORDER, TABLE_FINENESS,
                                             kept);
        }
        tools_give_back(run->pool, kept);
        if (status == SRNF_OK && matrix) {
            status = matrix_create(run, &tools->table, &tools->matrix);
        }
    }
    if (status) {
        mean_tools_clear(tools);
    }
    return status;
}

int mean_prepare(const struct mean_run *run, size_t i)
{
    struct mean_tools *tools = &run->subjects[i].tools;
    int status = run->keeps ? create_tools(run, i, mean_is_warped(run), tools) : SRNF_OK;

    if (status == SRNF_OK && run->remembers) {
        tools->samples = srnf_alloc(SAMPLES * run->padded, sizeof(double));
        status = tools->samples ? SRNF_OK : SRNF_ENOMEM;
    }
    return status;
}

int mean_tools_open(const struct mean_run *run, size_t i, bool matrix, struct mean_tools *now,
                    struct mean_tools **tools)
{
    *tools = run->keeps ? &run->subjects[i].tools : now;
    return run->keeps ? SRNF_OK : create_tools(run, i, matrix, now);
}

void mean_tools_close(const struct mean_run *run, struct mean_tools *now)
{
    if (!run->keeps) {
        mean_tools_clear(now);
    }
}

/* ---- Places ---------------------------------------------------------------------------------- */

int mean_places_create(struct mean_run *run)
{
    run->places = srnf_alloc(MEAN_PLACES, sizeof *run->places);
    for (size_t k = 0; run->places && k < MEAN_PLACES; k++) {
        atomic_flag_clear(&run->places[k].taken);
    }
    run->pool = srnf_alloc(1, sizeof *run->pool);
    if (run->pool) {
        tools_pool_open(run->pool);
    }
    return run->places && run->pool ? SRNF_OK : SRNF_ENOMEM;
}

static void clear_place(struct mean_place *place)
{
    tabulated_fields_clear(&place->fields);
    srnf_free(place->memory);
    place->memory = NULL;
}

void mean_places_clear(struct mean_run *run)
{
    for (size_t k = 0; run->places && k < MEAN_PLACES; k++) {
        clear_place(&run->places[k]);
    }
    if (run->pool) {
        tools_pool_clear(run->pool);
    }
    srnf_free(run->places);
    srnf_free(run->pool);
    run->places = NULL;
    run->pool = NULL;
}

/* What is in it, unless it is there. */
static int fill_place(const struct mean_run *run, struct mean_place *place)
{
    size_t cloud = CLOUD_ARRAYS * run->padded;
    int status = SRNF_OK;

    if (place->memory) {
        return SRNF_OK;
    }
    place->memory = srnf_alloc(2 * cloud + 3 * registration_unknowns(run->degree), sizeof(double));
    if (place->memory && mean_is_warped(run)) {
        status = tabulated_fields_create(&place->fields, run->degree, follow_table.order,
                                         field_table_rows(&follow_table, run->degree));
    }
    if (!place->memory || status) {
        clear_place(place);
        return SRNF_ENOMEM;
    }
    place->vectors = place->memory + 2 * cloud;
    return SRNF_OK;
}

struct mean_place *mean_place_take(const struct mean_run *run)
{
    struct mean_place *place = NULL;

    for (size_t k = 0; k < MEAN_PLACES && !place; k++) {
        if (!atomic_flag_test_and_set_explicit(&run->places[k].taken, memory_order_acquire)) {
            place = &run->places[k];
        }
    }
    if (!place) {
        place = srnf_alloc(1, sizeof *place);
        if (!place) {
            return NULL;
        }
        place->temporary = true;
    }
    if (fill_place(run, place)) {
        mean_place_leave(place);
        return NULL;
    }
    place->from = place->to = (struct cloud){.n = run->padded};
    cloud_place(&place->from, run->padded, place->memory);
    cloud_place(&place->to, run->padded, place->memory + CLOUD_ARRAYS * run->padded);
    return place;
}

void mean_place_leave(struct mean_place *place)
{
    if (place->temporary) {
        clear_place(place);
        srnf_free(place);
    } else {
        atomic_flag_clear_explicit(&place->taken, memory_order_release);
    }
}
