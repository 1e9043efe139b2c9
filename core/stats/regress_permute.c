/*
 * regress_permute.c - the permutations of one test of nested models; the formulae are in regress.c.
 *
 * For a permutation P every vector u of the basis but the constant becomes c = R P'u, R = 1 - U U'
 * for the smaller model U: the products of c with the data are those of u with permuted residuals.
 * All of a block of permutations are one dgemm. The constant is left out, since permuted residuals
 * have none; not so the roots of weights in its place.
 */
#include "regress.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define BLOCK ((size_t)16) /* permutations of one task */
#define SPAN 1e-12         /* of the square of a unit vector: what may lie outside of its span */

struct permuting {
    const struct regress_run *run;
    const struct regress_model *model;
    struct srnf_regression_test *out;
    size_t first;    /* vector that permuted residuals may have: 1 is the one after the constant */
    size_t rows;     /* of a permutation: vectors from there on, the tested ones first */
    double left;     /* squared norm that the smaller model leaves of the SRNFs */
    double *squares; /* [P][6] the same of displacements: xx xy xz yy yz zz */
    double *largest; /* [permutations + 1] */
    atomic_uint *count; /* [P] */
    atomic_uint global, tied;
};

struct block {
    size_t first, count;
    uint32_t *order;
    size_t *source;
    double *vectors; /* [count][rows][n] */
    double *scratch; /* [rows][n] */
    double *data;    /* [count][rows][3][P] */
};

double regress_quadratic(const struct regress_run *run, size_t count, const double *x,
                         double *scratch)
{
    size_t n = run->n;

    if (count == 0) {
        return 0.0;
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)n, (int)n, 1.0, x,
                (int)n, run->gram, (int)n, 0.0, scratch, (int)n);
    return cblas_ddot((int)(count * n), x, 1, scratch, 1);
}

/* Number of the basis vector of a row: first the tested, then the nuisance. */
static size_t vector_of(const struct permuting *p, size_t row)
{
    const struct regress_model *model = p->model;

    return row < model->tested ? model->reduced + row : p->first + row - model->tested;
}

static int open_block(struct block *block, const struct permuting *p, size_t first, size_t count)
{
    const struct regress_run *run = p->run;
    size_t n = run->n;
    size_t size = 3 * run->points;

    *block = (struct block){.first = first, .count = count};
    block->order = srnf_alloc(n, sizeof *block->order);
    block->source = srnf_alloc(n, 2 * sizeof *block->source);
    block->vectors = srnf_alloc(count * p->rows, n * sizeof(double));
    block->scratch = srnf_alloc(p->rows, n * sizeof(double));
    block->data = srnf_alloc(count * p->rows, size * sizeof(double));
    if (!block->order || !block->source || !block->vectors || !block->scratch || !block->data) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < count; k++) {
        compare_relabel(&run->exchange, run->seed, first + k, run->n, block->source, block->order);
        for (size_t r = 0; r < p->rows; r++) {
            const double *u = p->model->basis.vectors + vector_of(p, r) * n;
            double *c = block->vectors + (k * p->rows + r) * n;

            for (size_t i = 0; i < n; i++) {
                c[block->order[i]] = u[i];
            }
            regress_reduce(&p->model->basis, p->model->reduced, c);
        }
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)(count * p->rows), (int)size,
                (int)n, 1.0, block->vectors, (int)n, run->vectors, (int)size, 0.0, block->data,
                (int)size);
    return SRNF_OK;
}

static void close_block(struct block *block)
{
    srnf_free(block->order);
    srnf_free(block->source);
    srnf_free(block->vectors);
    srnf_free(block->scratch);
    srnf_free(block->data);
}

/* F of the SRNFs; explained gets what the tested vectors do. */
static double global_statistic(const struct permuting *p, const double *vectors, double *scratch,
                               double *explained)
{
    const struct regress_model *model = p->model;
    size_t n = p->run->n;
    double inside = regress_quadratic(p->run, model->tested, vectors, scratch);
    double beside =
        regress_quadratic(p->run, p->rows - model->tested, vectors + model->tested * n, scratch);
    double rest = p->left - inside - beside;
    double freedom = (double)regress_model_freedom(model) / (double)model->tested;

    *explained = fmax(inside, 0.0);
    return *explained > 0.0 ? freedom * *explained / fmax(rest, 0.0) : 0.0;
}

/* The trace of H E^(-1) at a node, H and E the squares and products that the tested vectors and the
   residuals make (H. Hotelling 1951, D. Lawley 1938). data: [rows][3][P] */
static double local_statistic(const struct permuting *p, const double *data, size_t node)
{
    size_t points = p->run->points;
    double e[6];
    double sum = 0.0;

    memcpy(e, p->squares + 6 * node, sizeof e);
    for (size_t r = 0; r < p->rows; r++) {
        const double *z = data + r * 3 * points + node;
        double x = z[0];
        double y = z[points];
        double w = z[2 * points];

        e[0] -= x * x;
        e[1] -= x * y;
        e[2] -= x * w;
        e[3] -= y * y;
        e[4] -= y * w;
        e[5] -= w * w;
    }
    for (size_t r = 0; r < p->model->tested; r++) {
        const double *z = data + r * 3 * points + node;
        const double b[3] = {z[0], z[points], z[2 * points]};

        sum += stats_quadratic_form(e, b);
    }
    return sum * (double)regress_model_freedom(p->model);
}

/* Whether a relabelling leaves both models as they are: it then gives the observed values whatever
   the data. vectors: permuted and reduced, [rows][n]. */
static bool is_same(const struct permuting *p, const double *vectors)
{
    const struct regress_model *model = p->model;
    size_t n = p->run->n;

    for (size_t r = 0; r < p->rows; r++) {
        const double *c = vectors + r * n;
        double inside = 0.0;

        for (size_t u = 0; r < model->tested && u < model->tested; u++) {
            double along =
                cblas_ddot((int)n, model->basis.vectors + (model->reduced + u) * n, 1, c, 1);

            inside += along * along;
        }
        /* Tested vectors stay within the tested, the others vanish. */
        if (r < model->tested ? inside < 1.0 - SPAN : cblas_ddot((int)n, c, 1, c, 1) > SPAN) {
            return false;
        }
    }
    return true;
}

static int permute_block(void *argument, size_t index, const struct srnf_context *context,
                         struct srnf_error *error)
{
    struct permuting *p = argument;
    size_t points = p->run->points;
    size_t first = 1 + index * BLOCK;
    size_t left = p->run->permutations + 1 - first;
    struct block block;
    int status = open_block(&block, p, first, left < BLOCK ? left : BLOCK);

    (void)context;
    (void)error;
    for (size_t k = 0; k < block.count && status == SRNF_OK; k++) {
        const double *vectors = block.vectors + k * p->rows * p->run->n;
        const double *data = block.data + k * p->rows * 3 * points;
        double largest = 0.0;
        double explained;

        for (size_t node = 0; node < points; node++) {
            double t = local_statistic(p, data, node);

            largest = fmax(largest, t);
            if (stats_as_large(t, p->out->statistic[node])) {
                atomic_fetch_add_explicit(&p->count[node], 1, memory_order_relaxed);
            }
        }
        p->largest[first + k] = largest;
        if (stats_as_large(global_statistic(p, vectors, block.scratch, &explained), p->out->f)) {
            atomic_fetch_add_explicit(&p->global, 1, memory_order_relaxed);
        }
        if (p->run->exchange.test.exact && is_same(p, vectors)) {
            atomic_fetch_add_explicit(&p->tied, 1, memory_order_relaxed);
        }
    }
    close_block(&block);
    return status;
}

/* What the smaller model leaves of displacements at each node, and of the SRNFs. */
static int fill_squares(struct permuting *p)
{
    const struct regress_run *run = p->run;
    size_t points = run->points;
    size_t n = run->n;
    size_t nuisance = p->model->reduced - 1;
    const double *basis = p->model->basis.vectors + n;
    double *z = srnf_alloc(nuisance + 1, 3 * points * sizeof(double));
    double *scratch = srnf_alloc(nuisance + 1, n * sizeof(double));
    int status = z && scratch ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && nuisance > 0) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)nuisance, (int)(3 * points),
                    (int)n, 1.0, basis, (int)n, run->vectors, (int)(3 * points), 0.0, z,
                    (int)(3 * points));
    }
    for (size_t i = 0; status == SRNF_OK && i < n + nuisance; i++) {
        const double *x = i < n ? run->vectors + i * 3 * points : z + (i - n) * 3 * points;
        double sign = i < n ? 1.0 : -1.0;

        for (size_t node = 0; node < points; node++) {
            double *s = p->squares + 6 * node;
            double a = x[node];
            double b = x[points + node];
            double c = x[2 * points + node];

            s[0] += sign * a * a;
            s[1] += sign * a * b;
            s[2] += sign * a * c;
            s[3] += sign * b * b;
            s[4] += sign * b * c;
            s[5] += sign * c * c;
        }
    }
    if (status == SRNF_OK) {
        p->left = run->total - regress_quadratic(run, nuisance, basis, scratch);
    }
    srnf_free(z);
    srnf_free(scratch);
    return status;
}

static int observe(struct permuting *p)
{
    struct srnf_regression_test *out = p->out;
    struct block block;
    double explained;
    int status = open_block(&block, p, 0, 1);

    for (size_t node = 0; node < p->run->points && status == SRNF_OK; node++) {
        out->statistic[node] = local_statistic(p, block.data, node);
        p->largest[0] = fmax(p->largest[0], out->statistic[node]);
    }
    if (status == SRNF_OK) {
        out->f = global_statistic(p, block.vectors, block.scratch, &explained);
        out->degrees = p->model->tested;
        out->freedom = regress_model_freedom(p->model);
        out->r2.value = p->run->total > 0.0 ? explained / p->run->total : 0.0;
        out->part.value = p->left > 0.0 ? fmin(explained / p->left, 1.0) : 0.0;
    }
    close_block(&block);
    return status;
}

static int open_test(struct permuting *p)
{
    struct srnf_regression_test *out = p->out;
    double **maps[] = {&out->statistic, &out->p, &out->significance, &out->fdr};
    size_t points = p->run->points;

    for (size_t i = 0; i < sizeof maps / sizeof maps[0]; i++) {
        *maps[i] = srnf_alloc(points, sizeof(double));
        if (!*maps[i]) {
            return SRNF_ENOMEM;
        }
    }
    p->squares = srnf_alloc(points, 6 * sizeof(double));
    p->largest = srnf_alloc(p->run->permutations + 1, sizeof(double));
    p->count = srnf_alloc(points, sizeof *p->count);
    return p->squares && p->largest && p->count ? SRNF_OK : SRNF_ENOMEM;
}

int regress_permute(struct regress_run *run, size_t test, struct stats_progress progress,
                    struct srnf_error *error)
{
    struct permuting p = {.run = run, .model = &run->models[test], .out = &run->out->test_of[test]};
    size_t blocks = (run->permutations + BLOCK - 1) / BLOCK;
    double all = 1.0 + (double)run->permutations;
    int status;

    p.first = run->lead ? 0 : 1;
    p.rows = p.model->basis.count - p.first;
    atomic_init(&p.global, 0);
    atomic_init(&p.tied, 0);
    status = open_test(&p);
    status = status ? status : fill_squares(&p);
    status = status ? status : observe(&p);
    status = status ? status : stats_run(run->context, blocks, permute_block, &p, progress, error);
    if (status == SRNF_OK) {
        const struct stats_map map = {run->points, run->embedding.root, p.out->statistic,
                                      p.out->p,    p.out->significance, p.out->fdr};

        p.out->p_value = (1.0 + (double)atomic_load(&p.global)) / all;
        p.out->least = (1.0 + (double)atomic_load(&p.tied)) / all;
        status =
            stats_map_conclude(&map, run->permutations, p.largest, p.count, &p.out->max_p_value);
    }
    srnf_free(p.squares);
    srnf_free(p.largest);
    srnf_free(p.count);
    return status;
}
