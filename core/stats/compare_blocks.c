/*
 * compare_blocks.c - the statistics of a comparison under permutations, a block of them at a time:
 * formulae in compare.c.
 */
#include "compare.h"
#include "maps.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define TIE STATS_TIE    /* of contrasts, as of statistics */
#define LEAST_LEFT 1e-15 /* of all squares: groups that tell all apart */
#define SPAN 1e-12       /* of the square of a unit vector: what may lie outside of its span */

/* ---- Statistics ------------------------------------------------------------------------------ */

double compare_hotelling(const struct compare_run *run, const double *rows, size_t node)
{
    const struct compare_design *design = &run->design;
    size_t size = 3 * run->points;
    double e[6];
    double b[3] = {0.0, 0.0, 0.0};

    memcpy(e, run->squares + 6 * node, sizeof e);
    for (size_t r = 0; r < design->nuisance; r++) {
        /* the first row is <g~, g~> b, the others are z */
        double scale = r == 0 ? 1.0 / design->squared : 1.0;
        double z[3];

        for (size_t c = 0; c < 3; c++) {
            z[c] = rows[r * size + c * run->points + node];
        }
        e[0] -= scale * z[0] * z[0];
        e[1] -= scale * z[0] * z[1];
        e[2] -= scale * z[0] * z[2];
        e[3] -= scale * z[1] * z[1];
        e[4] -= scale * z[1] * z[2];
        e[5] -= scale * z[2] * z[2];
        if (r == 0) {
            memcpy(b, z, sizeof b);
        }
    }
    return stats_quadratic_form(e, b) / design->squared * (double)compare_design_freedom(design);
}

/* Row of P'v for a permutation: entry order[i] gets v[i]. */
static void permute(size_t n, const uint32_t *order, const double *v, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[order[i]] = v[i];
    }
}

static double product(const struct compare_run *run, const double *c)
{
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        sum += c[i] * cblas_ddot((int)run->n, run->gram + i * run->n, 1, c, 1);
    }
    return fmax(sum, 0.0);
}

double compare_square(const struct compare_run *run, const double *c)
{
    return product(run, c) / (run->design.squared * run->design.squared);
}

double compare_global(const struct compare_run *run, const double *columns)
{
    double explained = product(run, columns) / run->design.squared;
    double left = run->total - explained;

    for (size_t u = 1; u < run->design.nuisance; u++) {
        left -= product(run, columns + u * run->n);
    }
    if (!(run->total > 0.0)) {
        return 0.0;
    }
    return explained / fmax(left, LEAST_LEFT * run->total) *
           (double)compare_design_freedom(&run->design);
}

/* Whether a contrast is the observed one, or its negative. */
static bool is_contrast(const struct compare_design *design, const double *c)
{
    double room = TIE * sqrt(design->squared);
    double apart = 0.0;
    double against = 0.0;

    for (size_t i = 0; i < design->n; i++) {
        apart = fmax(apart, fabs(c[i] - design->contrast[i]));
        against = fmax(against, fabs(c[i] + design->contrast[i]));
    }
    return apart <= room || against <= room;
}

/* Whether the columns P'u, [nuisance - 1][n], lie in the span of U. */
static bool is_nuisance(const struct compare_design *design, const double *columns)
{
    size_t n = design->n;

    for (size_t r = 1; r < design->nuisance; r++) {
        double inside = 0.0;

        for (size_t u = 0; u < design->nuisance; u++) {
            double along = cblas_ddot((int)n, design->basis + u * n, 1, columns + (r - 1) * n, 1);

            inside += along * along;
        }
        if (inside < 1.0 - SPAN) {
            return false;
        }
    }
    return true;
}

/* ---- Permutations ---------------------------------------------------------------------------- */

int compare_block_open(struct compare_block *block, const struct compare_run *run, size_t first,
                       size_t count)
{
    size_t each = run->design.nuisance;

    *block = (struct compare_block){.first = first, .count = count};
    block->order = srnf_alloc(run->n, sizeof *block->order);
    block->source = srnf_alloc(run->n, 2 * sizeof *block->source);
    block->contrasts = srnf_alloc(count * each, run->n * sizeof(double));
    block->rows = srnf_alloc(count * each, 3 * run->points * sizeof(double));
    if (!block->order || !block->source || !block->contrasts || !block->rows) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < count; k++) {
        double *c = block->contrasts + k * each * run->n;

        compare_relabel(&run->exchange, run->seed, first + k, run->n, block->source, block->order);
        permute(run->n, block->order, run->design.contrast, c);
        for (size_t u = 1; u < each; u++) {
            permute(run->n, block->order, run->design.basis + u * run->n, c + u * run->n);
        }
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)(count * each),
                (int)(3 * run->points), (int)run->n, 1.0, block->contrasts, (int)run->n,
                run->vectors, (int)(3 * run->points), 0.0, block->rows, (int)(3 * run->points));
    return SRNF_OK;
}

void compare_block_close(struct compare_block *block)
{
    srnf_free(block->order);
    srnf_free(block->source);
    srnf_free(block->contrasts);
    srnf_free(block->rows);
}

/* columns: the contrast, and the permuted columns of U but the constant. */
static void count_global(struct compare_run *run, const double *columns)
{
    if (stats_as_large(compare_global(run, columns), run->observed)) {
        atomic_fetch_add_explicit(&run->global, 1, memory_order_relaxed);
    }
    if (run->exchange.test.exact && is_contrast(&run->design, columns) &&
        is_nuisance(&run->design, columns + run->n)) {
        atomic_fetch_add_explicit(&run->tied, 1, memory_order_relaxed);
    }
}

int compare_block_run(void *argument, size_t index, const struct srnf_context *context,
                      struct srnf_error *error)
{
    struct compare_run *run = argument;
    size_t each = run->design.nuisance;
    size_t first = 1 + index * COMPARE_BLOCK;
    size_t left = run->permutations + 1 - first;
    struct compare_block block;
    int status =
        compare_block_open(&block, run, first, left < COMPARE_BLOCK ? left : COMPARE_BLOCK);

    (void)context;
    (void)error;
    for (size_t k = 0; k < block.count && status == SRNF_OK; k++) {
        const double *rows = block.rows + k * each * 3 * run->points;
        double largest = 0.0;

        for (size_t p = 0; p < run->points; p++) {
            double t2 = compare_hotelling(run, rows, p);

            largest = fmax(largest, t2);
            if (stats_as_large(t2, run->out->statistic[p])) {
                atomic_fetch_add_explicit(&run->count[p], 1, memory_order_relaxed);
            }
        }
        run->largest[first + k] = largest;
        count_global(run, block.contrasts + k * each * run->n);
    }
    compare_block_close(&block);
    return status;
}
