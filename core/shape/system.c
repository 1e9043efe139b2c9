/*
 * system.c - the energy E(f) = ||Q(f) - q||^2 of one target q and its Gauss-Newton model.
 *
 * J is the composition of the gradient transform and the pointwise Q_*; J' W J is never formed: a
 * product costs one gradient transform and one adjoint. Two states are kept, so that a refused step
 * costs nothing to undo.
 */
#include "shape.h"

static int allocate_state(struct shape_state *state, size_t points)
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

int shape_system_create(struct shape_system **out, const struct srnf_sht *sht, const double *q)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t points = grid->n_theta * grid->n_phi;
    struct shape_system *system = srnf_alloc(1, sizeof *system);

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
        shape_system_destroy(system);
        return SRNF_ENOMEM;
    }
    shape_weights(grid, system->weight);
    system->q_norm2 = shape_norm2(points, system->weight, q);
    *out = system;
    return SRNF_OK;
}

void shape_system_destroy(struct shape_system *system)
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

double shape_system_try(struct shape_system *system, const double *f)
{
    struct shape_state *s = &system->trial;

    srnf_sht_gradient(system->sht, 3, f, s->f_theta, s->f_phi, system->workspace);
    system->transforms += 1.0;
    shape_normals(system->points, s->f_theta, s->f_phi, s->unit, s->root, s->inverse);
    shape_residual(system->points, s->unit, s->root, system->q, s->residual);
    return shape_norm2(system->points, system->weight, s->residual);
}

void shape_system_accept(struct shape_system *system)
{
    struct shape_state state = system->state;

    system->state = system->trial;
    system->trial = state;
}

static void clear_translations(const struct shape_system *system, double *x)
{
    size_t count = system->count / 3;

    x[0] = 0.0;
    x[count] = 0.0;
    x[2 * count] = 0.0;
}

void shape_system_pull_back(struct shape_system *system, const double *y, double *out)
{
    const struct shape_state *s = &system->state;

    shape_differential_adjoint(system->points, s->f_theta, s->f_phi, s->unit, s->inverse,
                               system->weight, y, system->w_theta, system->w_phi);
    srnf_sht_gradient_adjoint(system->sht, 3, system->w_theta, system->w_phi, out,
                              system->workspace);
    system->transforms += 1.0;
    clear_translations(system, out);
}

void shape_system_differential(struct shape_system *system, const struct shape_state *at,
                               const double *w, double *field)
{
    srnf_sht_gradient(system->sht, 3, w, system->w_theta, system->w_phi, system->workspace);
    system->transforms += 1.0;
    shape_differential(system->points, at->f_theta, at->f_phi, at->unit, at->inverse,
                       system->w_theta, system->w_phi, field);
}

void shape_system_gradient(struct shape_system *system, double *g)
{
    shape_system_pull_back(system, system->state.residual, g);
}

void shape_system_product(struct shape_system *system, const double *w, double *out)
{
    shape_system_differential(system, &system->state, w, system->field);
    shape_system_pull_back(system, system->field, out);
}
