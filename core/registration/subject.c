/*
 * subject.c - what belongs to a moving surface alone, whatever it is registered to: tables of all
 * rounds of the tournament, the Gauss-Newton matrix, and the coefficients that are screened.
 *
 * 1.5 MB at degree 15, of which the matrix takes half (registration_subject_bytes).
 */
#include "tournament.h"

#include <math.h>
#include <string.h>

#define FULL_ORDER ((size_t)6)
#define FULL_FINENESS (5.0 / 3.0)
#define ROUND_ORDER ((size_t)4)
#define ROUND_FINENESS 2.1 /* rows of a table to a degree of n */

/* The degree-6 coefficients of q. */
static int screen_series(struct subject *s, enum srnf_representation representation,
                         const struct srnf_sht *sht, const double *coefficients)
{
    size_t degree = srnf_sht_degree(sht);
    size_t count = srnf_coefficient_count(degree);
    size_t n = srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    double *memory = srnf_alloc(3 * n + 3 * count, sizeof(double));
    void *workspace =
        srnf_alloc(1, srnf_surface_workspace_size(sht) + srnf_sht_workspace_size(sht, 3));
    int status = memory && workspace ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        field_represent(sht, representation, coefficients, memory, workspace);
        srnf_sht_analysis(sht, 3, memory, memory + 3 * n, workspace);
        search_cut_series(degree, memory + 3 * n, s->screen);
    }
    srnf_free(memory);
    srnf_free(workspace);
    return status;
}

bool subject_is_read(const struct srnf_register_options *options)
{
    bool still = options->common_pose || options->start == SRNF_START_IDENTITY;

    return !still || (options->reparameterization && !options->exact);
}

int subject_create(struct subject *s, const struct srnf_sht *sht, const double *coefficients,
                   const struct srnf_register_options *options, struct tabulated_tools *tools,
                   const struct srnf_context *context)
{
    size_t degree = srnf_sht_degree(sht);
    bool still = options->common_pose || options->start == SRNF_START_IDENTITY;
    int status = SRNF_OK;

    *s = (struct subject){.top = options->degree < MATRIX_DEGREE ? options->degree : MATRIX_DEGREE};
    if (options->reparameterization || !still) {
        status = tabulated_moving_create(&s->full, options->representation, degree, coefficients,
                                         degree, FULL_ORDER, FULL_FINENESS, tools);
    }
    for (size_t k = still ? TOURNAMENT_STILL : 0; k < TOURNAMENT_ROUNDS && status == SRNF_OK; k++) {
        status = tabulated_moving_create(&s->rounds[k], options->representation, degree,
                                         coefficients, tournament_round(k, degree).surface,
                                         ROUND_ORDER, ROUND_FINENESS, tools);
    }
    if (status == SRNF_OK && !still) {
        status = screen_series(s, options->representation, sht, coefficients);
    }
    if (status == SRNF_OK && options->reparameterization) {
        size_t k = registration_unknowns(s->top);

        s->matrix = srnf_alloc(k * k, sizeof(double));
        status = s->matrix ? tabulated_matrix(&s->full, s->top, context, s->matrix) : SRNF_ENOMEM;
    }
    if (status) {
        subject_clear(s);
    }
    return status;
}

static double table_bytes(size_t degree, size_t order, double fineness)
{
    double rows = (double)tabulated_moving_rows(degree, fineness), halo = (double)order;

    return (rows + 1.0 + halo) * (2.0 * rows + halo) * SPLINE_WIDTH * sizeof(double);
}

double registration_subject_bytes(size_t degree)
{
    double unknowns = (double)registration_unknowns(MATRIX_DEGREE);
    double tables = table_bytes(degree, FULL_ORDER, FULL_FINENESS);

    for (size_t k = 0; k < TOURNAMENT_ROUNDS; k++) {
        size_t surface = tournament_round(k, degree).surface;

        tables += table_bytes(surface < degree ? surface : degree, ROUND_ORDER, ROUND_FINENESS);
    }
    return 2.0 * tables + unknowns * unknowns * sizeof(double); /* of square-root maps: two each */
}

int registration_subject(const struct srnf_sht *sht, const double *surface,
                         const struct srnf_register_options *options, struct tabulated_tools *tools,
                         const struct srnf_context *context, struct subject **out)
{
    int status;

    *out = NULL;
    if (!subject_is_read(options)) {
        return SRNF_OK;
    }
    *out = srnf_alloc(1, sizeof **out);
    if (!*out) {
        return SRNF_ENOMEM;
    }
    status = subject_create(*out, sht, surface, options, tools, context);
    if (status) {
        srnf_free(*out);
        *out = NULL;
    }
    return status;
}

void registration_subject_destroy(struct subject *s)
{
    if (s) {
        subject_clear(s);
        srnf_free(s);
    }
}

void subject_clear(struct subject *s)
{
    tabulated_moving_clear(&s->full);
    for (size_t k = 0; k < TOURNAMENT_ROUNDS; k++) {
        tabulated_moving_clear(&s->rounds[k]);
    }
    srnf_free(s->matrix);
    s->matrix = NULL;
}
