/*
 * conjugate_gradients.c - preconditioned conjugate gradients for A x = b, A symmetric and positive
 * semidefinite: M. Hestenes, E. Stiefel, "Methods of conjugate gradients for solving linear
 * systems", J. Res. Nat. Bur. Standards 49 (1952).
 *
 * From x = 0 until the residual, in the norm of the preconditioner sqrt(r' P r), is `tolerance`
 * times what it was, b'x is `enough`, or `cap` products are spent; a direction without curvature,
 * which a singular A can have, ends it with what there is. One product a step.
 */
#include "linear.h"

#include <math.h>
#include <string.h>

int linear_conjugate_gradients(const struct linear_problem *problem, double *r, double *x,
                               double *work, struct linear_figures *figures)
{
    size_t n = problem->n;
    double *z = work;
    double *p = work + n;
    double *product = work + 2 * n;
    const double enough = problem->enough > 0.0 ? problem->enough : INFINITY;
    double gained = 0.0; /* b'x */
    double start;
    double rz;
    size_t k = 0;

    memset(x, 0, n * sizeof *x);
    problem->precondition(problem->argument, r, z);
    linear_copy(n, z, p);
    rz = start = linear_dot(n, r, z);
    while (k < problem->cap && gained < enough &&
           rz > problem->tolerance * problem->tolerance * start) {
        double curvature;
        double next;

        if (srnf_is_canceled(problem->context)) {
            return SRNF_ECANCELED;
        }
        problem->product(problem->argument, p, product);
        k++;
        curvature = linear_dot(n, p, product);
        if (!(curvature > 0.0)) {
            break;
        }
        gained += rz / curvature * rz;
        linear_axpy(n, rz / curvature, p, x);
        linear_axpy(n, -rz / curvature, product, r);
        problem->precondition(problem->argument, r, z);
        next = linear_dot(n, r, z);
        for (size_t i = 0; i < n; i++) {
            p[i] = z[i] + next / rz * p[i];
        }
        rz = next;
    }
    *figures =
        (struct linear_figures){.products = k, .residual = start > 0.0 ? sqrt(rz / start) : 0.0};
    return SRNF_OK;
}
