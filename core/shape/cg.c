/*
 * cg.c - preconditioned conjugate gradients for A x = b, A symmetric and positive semidefinite:
 * M. Hestenes, E. Stiefel, "Methods of conjugate gradients for solving linear systems", J. Res.
 * Nat. Bur. Standards 49 (1952).
 *
 * From x = 0 until the residual, in the norm of the preconditioner sqrt(r' P r), is `tolerance`
 * times what it was, or `cap` products are spent; a direction without curvature, which a singular A
 * can have, ends it with what there is. One product a step.
 */
#include "shape.h"

size_t shape_conjugate_gradients(const struct shape_linear *problem, double *r, double *x,
                                 double *work)
{
    size_t n = problem->n;
    double *z = work;
    double *p = work + n;
    double *product = work + 2 * n;
    double rz;
    double goal;
    size_t k = 0;

    for (size_t i = 0; i < n; i++) {
        x[i] = 0.0;
    }
    problem->precondition(problem->argument, r, z);
    shape_copy(n, z, p);
    rz = shape_dot(n, r, z);
    goal = problem->tolerance * problem->tolerance * rz;
    while (k < problem->cap && rz > goal) {
        double curvature;
        double alpha;
        double next;

        problem->product(problem->argument, p, product);
        k++;
        curvature = shape_dot(n, p, product);
        if (!(curvature > 0.0)) {
            break;
        }
        alpha = rz / curvature;
        shape_axpy(n, alpha, p, x);
        shape_axpy(n, -alpha, product, r);
        problem->precondition(problem->argument, r, z);
        next = shape_dot(n, r, z);
        for (size_t i = 0; i < n; i++) {
            p[i] = z[i] + next / rz * p[i];
        }
        rz = next;
    }
    return k;
}
