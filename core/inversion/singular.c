/*
 * singular.c - smallest singular value of Q_* at a surface, from the coefficients without
 * translations (L2 norm of the displacement) to L2 on the sphere: the local condition of inversion.
 *
 * The square of it is the smallest eigenvalue of J' W J, found by LOBPCG from a start that has a
 * part in every mode. The wanted vectors are of low degree, so the diagonal preconditioner serves
 * well. A Ritz value lies above the eigenvalue, by less than a few parts in a thousand at the
 * stopping rule used here: it is an estimate, not a proof.
 */
#include "inversion.h"

#include <math.h>

#define SINGULAR_CAP 400
#define SINGULAR_CHANGE 1e-3

static void product(void *argument, const double *x, double *out)
{
    gauss_newton_product(argument, x, out);
}

int inversion_smallest_singular(struct inversion_run *run, double *sigma)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;
    double *memory = srnf_alloc(3 * n, sizeof(double));
    double *mass = memory;
    double *precondition;
    double *x;
    struct linear_eigen problem;
    double mu = 0.0;
    double residual = 0.0;
    uint64_t state = 1;
    int status;

    if (!memory) {
        return SRNF_ENOMEM;
    }
    precondition = memory + n;
    x = memory + 2 * n;
    linear_diagonal(system->degree, 1.0, 0.0, mass);
    linear_diagonal(system->degree, 1.0, 0.25, precondition);
    for (size_t i = 0; i < n; i++) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        precondition[i] = precondition[i] > 0.0 ? 1.0 / precondition[i] : 0.0;
        x[i] = ((double)(state >> 11) * 0x1p-53 - 0.5) * precondition[i];
    }
    problem = (struct linear_eigen){.n = n,
                                    .product = product,
                                    .argument = system,
                                    .mass = mass,
                                    .precondition = precondition,
                                    .change = SINGULAR_CHANGE,
                                    .cap = SINGULAR_CAP,
                                    .context = run->context};
    status = linear_lobpcg(&problem, x, &mu, &residual);
    *sigma = sqrt(fmax(0.0, mu));
    srnf_free(memory);
    return status;
}
