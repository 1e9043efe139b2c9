/*
 * conjugate.c - the damped normal equations (J' W J + lambda D) x = b of Q_* at one surface, by
 * conjugate gradients preconditioned with D = diag(1 + l (l + 1) / 4).
 *
 * J' W J is close to a multiple of l (l + 1) on a round sphere, and D keeps that scaling for any
 * surface, since Q is homogeneous of degree one and J therefore free of scale. With b = J' W v and
 * lambda = 0 the solution is the vector whose Q_* is nearest to v. The l = 0 coefficients, a null
 * space, stay 0.
 *
 * A product costs one gradient transform and one adjoint. It never overwrites the state.
 */
#include "shape.h"

#include <math.h>
#include <string.h>

#define CANCEL_EVERY 16

int shape_conjugate_create(struct shape_conjugate *conjugate, const struct shape_system *system)
{
    size_t n = system->count;

    *conjugate = (struct shape_conjugate){.memory = srnf_alloc(5 * n, sizeof(double))};
    if (!conjugate->memory) {
        return SRNF_ENOMEM;
    }
    conjugate->diagonal = conjugate->memory;
    conjugate->r = conjugate->memory + n;
    conjugate->z = conjugate->memory + 2 * n;
    conjugate->p = conjugate->memory + 3 * n;
    conjugate->product = conjugate->memory + 4 * n;
    shape_diagonal(system->degree, 1.0, 0.25, conjugate->diagonal);
    return SRNF_OK;
}

void shape_conjugate_destroy(struct shape_conjugate *conjugate)
{
    srnf_free(conjugate->memory);
    conjugate->memory = NULL;
}

static void precondition(const struct shape_conjugate *c, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        c->z[i] = c->diagonal[i] > 0.0 ? c->r[i] / c->diagonal[i] : 0.0;
    }
}

int shape_conjugate_solve(struct shape_conjugate *c, struct shape_system *system, const double *b,
                          double lambda, double tolerance, size_t cap, double *x)
{
    size_t n = system->count;
    double start;
    double rz;

    memset(x, 0, n * sizeof *x);
    shape_copy(n, b, c->r);
    precondition(c, n);
    shape_copy(n, c->z, c->p);
    rz = start = shape_dot(n, c->r, c->z);
    for (c->iterations = 0; c->iterations < cap && rz > tolerance * tolerance * start;
         c->iterations++) {
        double curvature;
        double next;

        if (c->iterations % CANCEL_EVERY == 0 && srnf_is_canceled(c->context)) {
            return SRNF_ECANCELED;
        }
        shape_system_product(system, c->p, c->product);
        for (size_t i = 0; i < n; i++) {
            c->product[i] += lambda * c->diagonal[i] * c->p[i];
        }
        curvature = shape_dot(n, c->p, c->product);
        if (!(curvature > 0.0)) {
            break;
        }
        shape_axpy(n, rz / curvature, c->p, x);
        shape_axpy(n, -rz / curvature, c->product, c->r);
        precondition(c, n);
        next = shape_dot(n, c->r, c->z);
        for (size_t i = 0; i < n; i++) {
            c->p[i] = c->z[i] + next / rz * c->p[i];
        }
        rz = next;
    }
    c->residual = start > 0.0 ? sqrt(rz / start) : 0.0;
    return SRNF_OK;
}
