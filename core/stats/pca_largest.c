/*
 * pca_largest.c - the largest principal components of a group too large for its n x n Gram matrix.
 *
 * With the rows x_i = sqrt(weight) (q_i - mean) of X, [n][m], m = 3 P, the covariance is C = X'X /
 * (n - 1), of which only products with a block of b vectors are formed, a block of members or of
 * nodes at a time. Randomized subspace iteration (N. Halko, P. Martinsson, J. Tropp, "Finding
 * structure with randomness", SIAM Review 53, 2011, algorithm 4.4, with Rayleigh and Ritz at its
 * end): V <- C Q, Q an orthonormal basis of V before, from a block of X' Omega, Omega random
 * signs of a counter-based generator. Q'CQ has the eigenvalues theta_k and vectors s_k; for u_k =
 * Q s_k of unit length, C has an eigenvalue within
 *
 *     bound_k = ||C u_k - theta_k u_k||
 *
 * of theta_k (the matrix is symmetric), and that holds whatever the random numbers were. It ends
 * where the bounds are below RESIDUAL theta_1, or after ROUNDS_MAX rounds, by how far the
 * components have settled; theta_k is never above the k-th eigenvalue.
 *
 * Sums run in the order of members, whatever the number of threads.
 *
 * Cost of a round: 4 n m b operations in products of matrices, and a QR of m x b. Memory: (n + 2 m)
 * b numbers, and for each thread BLOCK m.
 */
#include "stats.h"
#include "linear/linear.h"

#include <cblas.h>
#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

#define OVER_LEAST ((size_t)20) /* vectors beside those that are asked for */
#define ROUNDS_MAX 40
#define RESIDUAL 1e-12
#define BLOCK ((size_t)128)    /* members that are taken at a time */
#define NODES ((size_t)256)    /* numbers of a field that one body adds up */
#define SUBTRACTION_MARGIN 8.0 /* as in pca.c */

struct largest {
    const struct srnf_grid *grid;
    const struct srnf_context *context;
    size_t n, m, b, kept;
    const double *mean_q, *q;
    double *root;     /* [m] sqrt(weight) */
    double *products; /* [n][b] X Q */
    double *basis;    /* [b][m] Q */
    double *image;    /* [b][m] C Q */
    double *small;    /* [b][b] Q'CQ, then its eigenvectors, one a row */
    double *values;   /* [b] increasing */
    double *norms;    /* [n] |x_i|^2 */
    struct srnf_pca *pca;
};

static void clear(struct largest *l)
{
    srnf_free(l->root);
    srnf_free(l->products);
    srnf_free(l->basis);
    srnf_free(l->image);
    srnf_free(l->small);
    srnf_free(l->values);
    srnf_free(l->norms);
}

static int create(struct largest *l)
{
    size_t points = l->m / 3;

    l->root = srnf_alloc(l->m, sizeof(double));
    l->products = srnf_alloc(l->n, l->b * sizeof(double));
    l->basis = srnf_alloc(l->b, l->m * sizeof(double));
    l->image = srnf_alloc(l->b, l->m * sizeof(double));
    l->small = srnf_alloc(l->b, l->b * sizeof(double));
    l->values = srnf_alloc(l->b, sizeof(double));
    l->norms = srnf_alloc(l->n, sizeof(double));
    if (!l->root || !l->products || !l->basis || !l->image || !l->small || !l->values ||
        !l->norms) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < l->m; k++) {
        l->root[k] = sqrt(l->grid->weight[k % points / l->grid->n_phi]);
    }
    return SRNF_OK;
}

/* ---- Products with X ------------------------------------------------------------------------- */

/* `count` numbers of x_i, from the first on. */
static void take(const struct largest *l, size_t i, size_t first, size_t count, double *x)
{
    const double *q = l->q + i * l->m + first;

    for (size_t k = 0; k < count; k++) {
        x[k] = l->root[first + k] * (q[k] - l->mean_q[first + k]);
    }
}

/* products <- X Q, of one block of members. */
static int multiply_members(void *argument, size_t block, const struct srnf_context *context,
                            struct srnf_error *error)
{
    struct largest *l = argument;
    size_t first = block * BLOCK;
    size_t count = l->n - first < BLOCK ? l->n - first : BLOCK;
    double *x = srnf_alloc(count, l->m * sizeof(double));

    (void)context;
    (void)error;
    if (!x) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < count; i++) {
        take(l, first + i, 0, l->m, x + i * l->m);
        l->norms[first + i] = linear_dot(l->m, x + i * l->m, x + i * l->m);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, (int)l->b, (int)l->m, 1.0, x,
                (int)l->m, l->basis, (int)l->m, 0.0, l->products + first * l->b, (int)l->b);
    srnf_free(x);
    return SRNF_OK;
}

/* image <- X' products / (n - 1), of some numbers of each field. */
static int multiply_nodes(void *argument, size_t block, const struct srnf_context *context,
                          struct srnf_error *error)
{
    struct largest *l = argument;
    size_t first = block * NODES;
    size_t count = l->m - first < NODES ? l->m - first : NODES;
    double *x = srnf_alloc(BLOCK, count * sizeof(double));

    (void)error;
    if (!x) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < l->n && !srnf_is_canceled(context); i += BLOCK) {
        size_t members = l->n - i < BLOCK ? l->n - i : BLOCK;

        for (size_t j = 0; j < members; j++) {
            take(l, i + j, first, count, x + j * count);
        }
        cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)l->b, (int)count, (int)members,
                    1.0 / (double)(l->n - 1), l->products + i * l->b, (int)l->b, x, (int)count,
                    i > 0 ? 1.0 : 0.0, l->image + first, (int)l->m);
    }
    srnf_free(x);
    return SRNF_OK;
}

static int multiply_back(struct largest *l)
{
    return stats_run(l->context, (l->m + NODES - 1) / NODES, multiply_nodes, l,
                     (struct stats_progress){0}, NULL);
}

/* image <- C basis */
static int multiply(struct largest *l)
{
    int status = stats_run(l->context, (l->n + BLOCK - 1) / BLOCK, multiply_members, l,
                           (struct stats_progress){0}, NULL);

    return status ? status : multiply_back(l);
}

/* ---- Subspaces ------------------------------------------------------------------------------- */

/* Random signs in place of X Q. */
static void draw(struct largest *l)
{
    const uint32_t key[2] = {0, 0};

    for (size_t i = 0; i < l->n; i++) {
        for (size_t k = 0; k < l->b; k++) {
            const uint32_t counter[4] = {(uint32_t)i, (uint32_t)k, 0, UINT32_C(0x70636131)};
            uint32_t bits[4];

            stats_philox(counter, key, bits);
            l->products[i * l->b + k] = bits[0] >> 31 ? 1.0 : -1.0;
        }
    }
}

/* basis <- an orthonormal basis of image. */
static int orthonormalize(struct largest *l)
{
    double *tau = srnf_alloc(l->b, sizeof(double));
    lapack_int m = (lapack_int)l->m;
    lapack_int b = (lapack_int)l->b;
    double size = 0.0;
    double *work = NULL;
    int status = SRNF_ENOMEM;

    if (tau && LAPACKE_dgeqrf_work(LAPACK_COL_MAJOR, m, b, l->image, m, tau, &size, -1) == 0) {
        lapack_int work_size = (lapack_int)fmax(size, 64.0 * (double)b);

        work = srnf_alloc((size_t)work_size, sizeof(double));
        memcpy(l->basis, l->image, l->b * l->m * sizeof(double));
        if (work) {
            status =
                LAPACKE_dgeqrf_work(LAPACK_COL_MAJOR, m, b, l->basis, m, tau, work, work_size) ||
                        LAPACKE_dorgqr_work(LAPACK_COL_MAJOR, m, b, b, l->basis, m, tau, work,
                                            work_size)
                    ? SRNF_ENUMERIC
                    : SRNF_OK;
        }
    }
    srnf_free(tau);
    srnf_free(work);
    return status;
}

/* Eigenvalues and eigenvectors of Q'CQ, by Rayleigh and Ritz. */
static int project(struct largest *l)
{
    lapack_int b = (lapack_int)l->b;
    double size = 0.0;
    double *work;
    int status;

    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)l->b, (int)l->b, (int)l->m, 1.0,
                l->basis, (int)l->m, l->image, (int)l->m, 0.0, l->small, (int)l->b);
    for (size_t i = 0; i < l->b; i++) {
        for (size_t j = 0; j < i; j++) {
            double value = 0.5 * (l->small[i * l->b + j] + l->small[j * l->b + i]);

            if (!isfinite(value)) {
                return SRNF_EINVAL;
            }
            l->small[i * l->b + j] = l->small[j * l->b + i] = value;
        }
    }
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', b, l->small, b, l->values, &size, -1)) {
        return SRNF_ENUMERIC;
    }
    work = srnf_alloc((size_t)size, sizeof(double));
    if (!work) {
        return SRNF_ENOMEM;
    }
    status = LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', b, l->small, b, l->values, work,
                                (lapack_int)size)
                 ? SRNF_ENUMERIC
                 : SRNF_OK;
    srnf_free(work);
    return status;
}

/* out <- the k-th largest of the vectors that the rows of `from` are combined to. */
static void combine(const struct largest *l, const double *from, size_t k, double *out)
{
    cblas_dgemv(CblasRowMajor, CblasTrans, (int)l->b, (int)l->m, 1.0, from, (int)l->m,
                l->small + (l->b - 1 - k) * l->b, 1, 0.0, out, 1);
}

/* bounds: [kept]. scratch: [2][m]. Returns the largest of those relative to theta_1. */
static double find_bounds(const struct largest *l, double *scratch, double *bounds)
{
    double worst = 0.0;

    for (size_t k = 0; k < l->kept && !srnf_is_canceled(l->context); k++) {
        double theta = l->values[l->b - 1 - k];

        combine(l, l->image, k, scratch);
        combine(l, l->basis, k, scratch + l->m);
        for (size_t i = 0; i < l->m; i++) {
            scratch[i] -= theta * scratch[l->m + i];
        }
        bounds[k] = sqrt(linear_dot(l->m, scratch, scratch));
        worst = bounds[k] > worst ? bounds[k] : worst;
    }
    return worst / l->values[l->b - 1];
}

static int iterate(struct largest *l, double *bounds)
{
    double *scratch = srnf_alloc(2 * l->m, sizeof(double));
    double worst = INFINITY;
    int status = SRNF_OK;

    if (!scratch) {
        return SRNF_ENOMEM;
    }
    draw(l);
    status = multiply_back(l);
    for (int round = 0; round < ROUNDS_MAX && status == SRNF_OK && worst > RESIDUAL; round++) {
        status = orthonormalize(l);
        status = status ? status : multiply(l);
        status = status ? status : project(l);
        if (status == SRNF_OK && !(l->values[l->b - 1] > 0.0)) {
            break; /* nothing differs */
        }
        worst = status ? worst : find_bounds(l, scratch, bounds);
        if (srnf_is_canceled(l->context)) {
            status = SRNF_ECANCELED;
        }
    }
    srnf_free(scratch);
    return status;
}

/* ---- The components -------------------------------------------------------------------------- */

/* As in pca.c, with the largest eigenvalue for all. */
static size_t count_components(const struct largest *l)
{
    double norm = sqrt(srnf_inner_product(l->grid, l->mean_q, l->mean_q));
    double noise = SUBTRACTION_MARGIN * DBL_EPSILON * norm;
    double floor = (double)l->n * fmax(DBL_EPSILON * l->values[l->b - 1], noise * noise);
    size_t count = 0;

    while (count < l->kept && l->values[l->b - 1 - count] > floor) {
        count++;
    }
    return count;
}

static int score_one(void *argument, size_t i, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct largest *l = argument;

    (void)context;
    (void)error;
    srnf_pca_project(l->grid, l->pca, l->mean_q, l->q + i * l->m,
                     l->pca->scores + i * l->pca->components, NULL);
    return SRNF_OK;
}

/* The score that is largest in magnitude, the first of equals, is positive. */
static void fix_sign(const struct largest *l, size_t k)
{
    struct srnf_pca *pca = l->pca;
    double largest = 0.0;

    for (size_t i = 0; i < l->n; i++) {
        double s = pca->scores[i * pca->components + k];

        largest = fabs(s) > fabs(largest) ? s : largest;
    }
    if (largest < 0.0) {
        linear_scale(l->m, -1.0, pca->modes + k * l->m);
        for (size_t i = 0; i < l->n; i++) {
            pca->scores[i * pca->components + k] *= -1.0;
        }
    }
}

static int fill(struct largest *l)
{
    struct srnf_pca *pca = l->pca;
    size_t count = count_components(l);
    int status;

    pca->n = l->n;
    pca->components = count;
    pca->eigenvalues = srnf_alloc(count, sizeof(double));
    pca->explained = srnf_alloc(count, sizeof(double));
    pca->modes = srnf_alloc(count, l->m * sizeof(double));
    pca->scores = srnf_alloc(l->n, count * sizeof(double));
    if (!pca->eigenvalues || !pca->explained || !pca->modes || !pca->scores) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < count; k++) {
        double *mode = pca->modes + k * l->m;

        pca->eigenvalues[k] = l->values[l->b - 1 - k];
        combine(l, l->basis, k, mode);
        for (size_t i = 0; i < l->m; i++) {
            mode[i] /= l->root[i];
        }
    }
    stats_take_shares(pca);
    status = stats_run(l->context, l->n, score_one, l, (struct stats_progress){0}, NULL);
    for (size_t k = 0; k < count && status == SRNF_OK; k++) {
        fix_sign(l, k);
    }
    return status;
}

int srnf_pca_fit_largest(const struct srnf_grid *grid, size_t n, const double *mean_q,
                         const double *registered_q, size_t components,
                         const struct srnf_context *context, struct srnf_pca *pca, double *bounds)
{
    struct largest l = {.grid = grid,
                        .context = context,
                        .n = n,
                        .m = 3 * stats_points(grid),
                        .mean_q = mean_q,
                        .q = registered_q,
                        .pca = pca};
    size_t over = components / 2 > OVER_LEAST ? components / 2 : OVER_LEAST;
    size_t most = n < l.m ? n : l.m;
    int status;

    *pca = (struct srnf_pca){0};
    memset(bounds, 0, components * sizeof *bounds);
    if (n < 2 || n > INT32_MAX || components == 0 || components > most) {
        return SRNF_EINVAL;
    }
    l.kept = components;
    l.b = components + over < most ? components + over : most;
    status = create(&l);
    status = status ? status : iterate(&l, bounds);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        pca->total_variance += l.norms[i] / (double)(n - 1);
    }
    status = status ? status : fill(&l);
    clear(&l);
    if (status) {
        srnf_pca_clear(pca);
    }
    return status;
}
