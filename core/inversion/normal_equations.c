/*
 * normal_equations.c - the damped normal equations (J' W J + lambda D) x = b of Q_* at one
 * surface, by conjugate gradients (linear/conjugate_gradients.c) preconditioned with D = diag(1 +
 * l (l + 1) / 4), or with D and what sliding.c adds to its inverse.
 *
 * J' W J is close to a multiple of l (l + 1) on a round sphere, and D keeps that scaling for any
 * surface, since Q is homogeneous of degree one and J therefore free of scale. With b = J' W v and
 * lambda = 0 the solution is the vector whose Q_* is nearest to v. The l = 0 coefficients, a null
 * space, stay 0.
 *
 * A product costs one gradient transform and one adjoint. It never overwrites the state.
 */
#include "inversion.h"

int normal_equations_create(struct normal_equations *conjugate, const struct gauss_newton *system)
{
    size_t n = system->count;

    *conjugate = (struct normal_equations){.memory = srnf_alloc(5 * n, sizeof(double))};
    if (!conjugate->memory) {
        return SRNF_ENOMEM;
    }
    conjugate->diagonal = conjugate->memory;
    conjugate->r = conjugate->memory + n;
    conjugate->work = conjugate->memory + 2 * n;
    linear_diagonal(system->degree, 1.0, 0.25, conjugate->diagonal);
    return SRNF_OK;
}

void normal_equations_destroy(struct normal_equations *conjugate)
{
    srnf_free(conjugate->memory);
    conjugate->memory = NULL;
}

struct product_argument {
    struct gauss_newton *system;
    struct sliding *sliding;
    const double *diagonal;
    double lambda;
};

static void precondition(void *argument, const double *r, double *z)
{
    const struct product_argument *e = argument;

    for (size_t i = 0; i < e->system->count; i++) {
        z[i] = e->diagonal[i] > 0.0 ? r[i] / e->diagonal[i] : 0.0;
    }
    if (e->sliding) {
        sliding_precondition(e->sliding, e->system, r, z);
    }
}

static void multiply(void *argument, const double *x, double *out)
{
    const struct product_argument *e = argument;

    gauss_newton_product(e->system, x, out);
    for (size_t i = 0; i < e->system->count; i++) {
        out[i] += e->lambda * e->diagonal[i] * x[i];
    }
}

int normal_equations_solve(struct normal_equations *c, struct gauss_newton *system, const double *b,
                           double lambda, double tolerance, size_t cap, double *x)
{
    struct product_argument equations = {system, c->sliding, c->diagonal, lambda};
    struct linear_problem problem = {.n = system->count,
                                     .product = multiply,
                                     .precondition = precondition,
                                     .argument = &equations,
                                     .tolerance = tolerance,
                                     .cap = cap,
                                     .enough = c->enough,
                                     .context = c->context};
    struct linear_figures figures;
    int status;

    linear_copy(system->count, b, c->r);
    status = linear_conjugate_gradients(&problem, c->r, x, c->work, &figures);
    if (status == SRNF_OK) {
        c->iterations = figures.products;
        c->residual = figures.residual;
    }
    return status;
}
