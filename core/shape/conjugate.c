/*
 * conjugate.c - the damped normal equations (J' W J + lambda D) x = b of Q_* at one surface, by
 * conjugate gradients (cg.c) preconditioned with D = diag(1 + l (l + 1) / 4).
 *
 * J' W J is close to a multiple of l (l + 1) on a round sphere, and D keeps that scaling for any
 * surface, since Q is homogeneous of degree one and J therefore free of scale. With b = J' W v and
 * lambda = 0 the solution is the vector whose Q_* is nearest to v. The l = 0 coefficients, a null
 * space, stay 0.
 *
 * A product costs one gradient transform and one adjoint. It never overwrites the state.
 */
#include "shape.h"

int shape_conjugate_create(struct shape_conjugate *conjugate, const struct shape_system *system)
{
    size_t n = system->count;

    *conjugate = (struct shape_conjugate){.memory = srnf_alloc(5 * n, sizeof(double))};
    if (!conjugate->memory) {
        return SRNF_ENOMEM;
    }
    conjugate->diagonal = conjugate->memory;
    conjugate->r = conjugate->memory + n;
    conjugate->work = conjugate->memory + 2 * n;
    shape_diagonal(system->degree, 1.0, 0.25, conjugate->diagonal);
    return SRNF_OK;
}

void shape_conjugate_destroy(struct shape_conjugate *conjugate)
{
    srnf_free(conjugate->memory);
    conjugate->memory = NULL;
}

struct normal_equations {
    struct shape_system *system;
    const double *diagonal;
    double lambda;
};

static void precondition(void *argument, const double *r, double *z)
{
    const struct normal_equations *e = argument;

    for (size_t i = 0; i < e->system->count; i++) {
        z[i] = e->diagonal[i] > 0.0 ? r[i] / e->diagonal[i] : 0.0;
    }
}

static void multiply(void *argument, const double *x, double *out)
{
    const struct normal_equations *e = argument;

    shape_system_product(e->system, x, out);
    for (size_t i = 0; i < e->system->count; i++) {
        out[i] += e->lambda * e->diagonal[i] * x[i];
    }
}

int shape_conjugate_solve(struct shape_conjugate *c, struct shape_system *system, const double *b,
                          double lambda, double tolerance, size_t cap, double *x)
{
    struct normal_equations equations = {system, c->diagonal, lambda};
    struct shape_linear problem = {.n = system->count,
                                   .product = multiply,
                                   .precondition = precondition,
                                   .argument = &equations,
                                   .tolerance = tolerance,
                                   .cap = cap,
                                   .context = c->context};
    struct shape_linear_figures figures;
    int status;

    shape_copy(system->count, b, c->r);
    status = shape_conjugate_gradients(&problem, c->r, x, c->work, &figures);
    if (status == SRNF_OK) {
        c->iterations = figures.products;
        c->residual = figures.residual;
    }
    return status;
}
