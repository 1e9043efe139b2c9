/*
 * secant.c - what the last steps of an optimization tell of the objective's curvature.
 *
 * The Gauss-Newton matrix of a level does not know gamma. The pairs of the last steps s and of the
 * changes y of the gradient that they made correct it (limited-memory BFGS, J. Nocedal, "Updating
 * quasi-Newton matrices with limited storage", Math. Comp. 35, 1980): from the right-hand side r,
 *
 *   a_k = <s_k, r> / <s_k, y_k>,  r <- r - a_k y_k        last pair first,
 *   c = M^-1 r,
 *   c <- c + (a_k - <y_k, c> / <s_k, y_k>) s_k            first pair first.
 *
 * Steps are taken in the domain of the moving surface, where all of them are fields on one sphere,
 * so that they are compared as they are.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define CURVATURE_MIN 1e-4 /* cosine between a step and what it changed */

int secant_create(struct secant *secant, size_t n)
{
    *secant = (struct secant){.n = n};
    secant->memory = srnf_alloc(2 * SECANT_PAIRS * n, sizeof(double));
    if (!secant->memory) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < SECANT_PAIRS; k++) {
        secant->pairs[k].step = secant->memory + 2 * k * n;
        secant->pairs[k].change = secant->pairs[k].step + n;
    }
    return SRNF_OK;
}

void secant_clear(struct secant *secant)
{
    srnf_free(secant->memory);
    *secant = (struct secant){0};
}

void secant_forget(struct secant *secant)
{
    secant->count = 0;
}

void secant_add(struct secant *secant, const double *step, const double *before,
                const double *after)
{
    struct secant_pair pair = secant->pairs[0];
    double steps, changes;

    if (secant->count == SECANT_PAIRS) { /* the oldest makes room */
        memmove(secant->pairs, secant->pairs + 1, (SECANT_PAIRS - 1) * sizeof pair);
        secant->pairs[--secant->count] = pair;
    }
    pair = secant->pairs[secant->count];
    memcpy(pair.step, step, secant->n * sizeof *step);
    for (size_t i = 0; i < secant->n; i++) {
        pair.change[i] = before[i] - after[i];
    }
    steps = linear_dot(secant->n, pair.step, pair.step);
    changes = linear_dot(secant->n, pair.change, pair.change);
    pair.product = linear_dot(secant->n, pair.step, pair.change);
    if (pair.product > CURVATURE_MIN * sqrt(steps * changes)) {
        secant->pairs[secant->count++] = pair;
    }
}

void secant_before(struct secant *secant, double *rhs)
{
    for (size_t k = secant->count; k-- > 0;) {
        struct secant_pair *pair = &secant->pairs[k];

        pair->share = linear_dot(secant->n, pair->step, rhs) / pair->product;
        linear_axpy(secant->n, -pair->share, pair->change, rhs);
    }
}

void secant_after(const struct secant *secant, double *step)
{
    for (size_t k = 0; k < secant->count; k++) {
        const struct secant_pair *pair = &secant->pairs[k];
        double share = linear_dot(secant->n, pair->change, step) / pair->product;

        linear_axpy(secant->n, pair->share - share, pair->step, step);
    }
}
