/*
 * tabulated_level.c - Cholesky factors of the Gauss-Newton matrix on a ladder of dampings.
 *
 * Damping and the curvature of the Jacobian penalty both add a multiple s of l (l + 1) to the
 * diagonal. The matrix does not depend on gamma, so that one factor serves every step of every
 * entrant whose s rounds to the same rung. The trust that a step deserves is known to a factor of
 * three at best; rounding s to a rung costs nothing, and neither does staying where s was before
 * until it is a few rungs away.
 */
#include "tabulated.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RUNG 1.25
#define STAY 4L                         /* rungs */
#define FACTORS_BYTES ((size_t)3 << 20) /* that factors of one degree may take, one at least */

/* The displacement penalty is diagonal: matrix.c. */
static void add_displacement(struct tabulated_level *level, double displacement)
{
    size_t k = registration_unknowns(level->degree);

    for (size_t i = 0; i < level->fields; i++) {
        level->matrix[i * k + i] += displacement * (1.0 + 0.25 * level->eigen[i]);
        level->matrix[(level->fields + i) * k + level->fields + i] += displacement;
    }
}

int tabulated_level_create(struct tabulated_level *level, size_t degree, size_t from_degree,
                           const double *matrix, double norm2, double displacement,
                           bool free_rotation)
{
    size_t k = registration_unknowns(degree);
    size_t slots = FACTORS_BYTES / (k * k * sizeof(double));
    double trace = 0.0, mean = 0.0;

    slots = slots < 1 ? 1 : slots > LEVEL_SLOTS_MAX ? LEVEL_SLOTS_MAX : slots;
    *level = (struct tabulated_level){.degree = degree,
                                      .unknowns = free_rotation ? k : k - 3,
                                      .fields = srnf_coefficient_count(degree) - 1,
                                      .slots = slots};
    level->memory = srnf_alloc((1 + slots) * k * k + k, sizeof(double));
    if (!level->memory) {
        return SRNF_ENOMEM;
    }
    level->matrix = level->memory;
    level->eigen = level->matrix + k * k;
    level->factors = level->eigen + k;
    registration_restrict(from_degree, matrix, degree, level->matrix);
    linear_scale(k * k, 1.0 / norm2, level->matrix);
    for (size_t l = 1; l <= degree; l++) {
        for (size_t i = l * l - 1; i + 1 < (l + 1) * (l + 1); i++) {
            level->eigen[i] = level->eigen[level->fields + i] = (double)(l * (l + 1));
        }
    }
    level->eigen[k - 3] = level->eigen[k - 2] = level->eigen[k - 1] = 2.0;
    add_displacement(level, displacement);
    for (size_t i = 0; i < level->unknowns; i++) {
        trace += level->matrix[i * k + i];
        mean += level->eigen[i];
    }
    level->scale = trace / mean;
    return SRNF_OK;
}

void tabulated_level_clear(struct tabulated_level *level)
{
    srnf_free(level->memory);
    *level = (struct tabulated_level){0};
}

static bool factorize(const struct tabulated_level *level, double s, double *factor)
{
    size_t k = registration_unknowns(level->degree);
    size_t n = level->unknowns;

    for (size_t j = 0; j < n; j++) {
        memcpy(factor + j * n + j, level->matrix + j * k + j, (n - j) * sizeof(double));
        factor[j * n + j] += s * level->eigen[j];
    }
    return LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (lapack_int)n, factor, (lapack_int)n) == 0;
}

/* The slot of a rung, factorized. */
static size_t find_slot(struct tabulated_level *level, long key)
{
    size_t oldest = 0;

    for (size_t i = 0; i < level->slots; i++) {
        if (level->used[i] > 0 && level->key[i] == key) {
            return i;
        }
        oldest = level->used[i] < level->used[oldest] ? i : oldest;
    }
    level->key[oldest] = key;
    level->regular[oldest] = factorize(level, pow(RUNG, (double)key),
                                       level->factors + oldest * level->unknowns * level->unknowns);
    return oldest;
}

bool tabulated_level_solve(struct tabulated_level *level, double lambda, double curvature,
                           const double *rhs, double *step, double *expected)
{
    size_t n = level->unknowns;
    long key = lrint(log(lambda * level->scale + curvature) / log(RUNG));
    bool stays = level->clock > 0 && labs(key - level->last) <= STAY;
    size_t slot = find_slot(level, stays ? level->last : key);
    double damping = pow(RUNG, (double)level->key[slot]) - curvature;
    const double *factor = level->factors + slot * n * n;

    level->last = level->key[slot];
    level->used[slot] = ++level->clock;
    if (!level->regular[slot]) {
        return false;
    }
    memcpy(step, rhs, n * sizeof *step);
    memset(step + n, 0, (registration_unknowns(level->degree) - n) * sizeof *step);
    cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, factor, (int)n, step,
                1);
    cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, (int)n, factor, (int)n, step,
                1);
    /* As in optimize.c: <rhs, c> + damping <c, D c>. */
    *expected = linear_dot(n, rhs, step);
    for (size_t i = 0; i < n; i++) {
        *expected += damping * level->eigen[i] * step[i] * step[i];
    }
    return true;
}
