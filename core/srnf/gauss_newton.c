/*
 * gauss_newton.c - the energy E(f) = ||Q(f) - q||^2 of one target q and its Gauss-Newton model.
 *
 * J is the composition of the gradient transform and the pointwise Q_*; J' W J is never formed: a
 * product costs one gradient transform and one adjoint. Two states are kept, so that a refused step
 * costs nothing to undo.
 */
#include "field.h"
#include "gauss_newton.h"

static int allocate_state(struct gauss_newton_state *state, size_t points)
{
    state->memory = srnf_alloc(14 * points, sizeof(double));
    if (!state->memory) {
        return SRNF_ENOMEM;
    }
    state->f_theta = state->memory;
    state->f_phi = state->memory + 3 * points;
    state->unit = state->memory + 6 * points;
    state->residual = state->memory + 9 * points;
    state->root = state->memory + 12 * points;
    state->inverse = state->memory + 13 * points;
    return SRNF_OK;
}

int gauss_newton_create(struct gauss_newton **out, const struct srnf_sht *sht, const double *q)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = grid->n_theta * grid->n_phi;
    struct gauss_newton *system = srnf_alloc(1, sizeof *system);

    *out = NULL;
    if (!system) {
        return SRNF_ENOMEM;
    }
    system->sht = sht;
    system->q = q;
    system->degree = srnf_sht_degree(sht);
    system->points = points;
    system->count = 3 * srnf_coefficient_count(system->degree);
    system->weight = srnf_alloc(points, sizeof(double));
    system->w_theta = srnf_alloc(3 * points, sizeof(double));
    system->w_phi = srnf_alloc(3 * points, sizeof(double));
    system->field = srnf_alloc(3 * points, sizeof(double));
    system->workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    if (!system->weight || !system->w_theta || !system->w_phi || !system->field ||
        !system->workspace || allocate_state(&system->state, points) ||
        allocate_state(&system->trial, points)) {
        gauss_newton_destroy(system);
        return SRNF_ENOMEM;
    }
    pointwise_weights(grid, system->weight);
    system->q_norm2 = pointwise_norm2(points, system->weight, q);
    *out = system;
    return SRNF_OK;
}

void gauss_newton_destroy(struct gauss_newton *system)
{
    if (!system) {
        return;
    }
    srnf_free(system->weight);
    srnf_free(system->w_theta);
    srnf_free(system->w_phi);
    srnf_free(system->field);
    srnf_free(system->workspace);
    srnf_free(system->state.memory);
    srnf_free(system->trial.memory);
    srnf_free(system);
}

double gauss_newton_try(struct gauss_newton *system, const double *f)
{
    struct gauss_newton_state *s = &system->trial;

    srnf_sht_gradient(system->sht, 3, f, s->f_theta, s->f_phi, system->workspace);
    system->transforms += 1.0;
    pointwise_normals(system->points, s->f_theta, s->f_phi, s->unit, s->root, s->inverse);
    pointwise_residual(system->points, s->unit, s->root, system->q, s->residual);
    return pointwise_norm2(system->points, system->weight, s->residual);
}

void gauss_newton_accept(struct gauss_newton *system)
{
    struct gauss_newton_state state = system->state;

    system->state = system->trial;
    system->trial = state;
}

static void clear_translations(const struct gauss_newton *system, double *x)
{
    size_t count = system->count / 3;

    x[0] = 0.0;
    x[count] = 0.0;
    x[2 * count] = 0.0;
}

void gauss_newton_pull_back(struct gauss_newton *system, const double *y, double *out)
{
    const struct gauss_newton_state *s = &system->state;

    pointwise_differential_adjoint(system->points, s->f_theta, s->f_phi, s->unit, s->inverse,
                                   system->weight, y, system->w_theta, system->w_phi);
    srnf_sht_gradient_adjoint(system->sht, 3, system->w_theta, system->w_phi, out,
                              system->workspace);
    system->transforms += 1.0;
    clear_translations(system, out);
}

void gauss_newton_differential(struct gauss_newton *system, const struct gauss_newton_state *at,
                               const double *w, double *field)
{
    srnf_sht_gradient(system->sht, 3, w, system->w_theta, system->w_phi, system->workspace);
    system->transforms += 1.0;
    pointwise_differential(system->points, at->f_theta, at->f_phi, at->unit, at->inverse,
                           system->w_theta, system->w_phi, field);
}

void gauss_newton_gradient(struct gauss_newton *system, double *g)
{
    gauss_newton_pull_back(system, system->state.residual, g);
}

void gauss_newton_product(struct gauss_newton *system, const double *w, double *out)
{
    gauss_newton_differential(system, &system->state, w, system->field);
    gauss_newton_pull_back(system, system->field, out);
}
