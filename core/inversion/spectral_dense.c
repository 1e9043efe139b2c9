/*
 * spectral_dense.c - the eigenproblem of inversion by its matrix, and the certificate of
 * uniqueness.
 *
 * Up to SRNF_CERTIFIED_DEGREE_MAX the matrix A = M^(-1/2) T M^(-1/2) is there itself
 * (normal_matrix.c). A + f f' - threshold I has a Cholesky factor if and only if, up to rounding,
 * the second eigenvalue exceeds the threshold: that is the certificate. An iteration alone could
 * only bound the eigenvalue from above. Where a pivot is not positive, the factor of the unknowns
 * before it gives a vector whose quotient is below the threshold: a bound that settles the matter
 * the other way.
 *
 * Where normals go about the sphere hardly more than once, surfaces of degree LOOK are looked at
 * first: where the form is as good as 0 on one of them, it is on one of the whole degree. So
 * surfaces near convex ones are done with at a twentieth of the cost, at degree 31.
 *
 * At degree 31 a factorization is 10^10 multiply-adds (n^3 / 3, n = 3 (L+1)^2 - 3). It goes by
 * panels, asks for cancellation at each, and spreads over the threads of the context what a panel
 * takes off those behind it, in strips that do not depend on their number.
 */
#include "spectral.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>

#define PANEL ((size_t)256) /* columns between two looks at cancellation: a thirtieth of a second */
#define DENSE_SHIFT 1e-13   /* keeps the factor of a singular A definite: a few hundred roundings */
#define DENSE_STEPS 12
/* Surfaces of degree LOOK are looked at first from degree LOOK_FROM on: below it the look takes as
   long. Stars, ellipsoids and capsules turn 1 to 2.2 times; what is certified turns 3.7 to 9.6
   times (arms, thalami and pallida), and would be looked at in vain. */
#define LOOK ((size_t)15)
#define LOOK_FROM ((size_t)20)
#define LOOK_TURNING 3.0 /* of sliding_turning */
#define SETTLED \
    1e-4 /* of the length of the iterate, which is 1 / (eigenvalue + shift) at the end */
#define ROUNDING 2.2e-16
/* Rounding of the matrix and of its factorization grows like sqrt(n) in practice: on spheres and
   ellipsoids, whose second eigenvalue is 0, the computed one stays below 1e-15. */
#define THRESHOLD_ROUNDING 10.0
#define THRESHOLD_NOISE 100.0

struct dense {
    size_t n, width; /* width: columns of the panel that is being factored */
    size_t first;    /* of them */
    size_t *order;   /* [n] places of the unknowns among the coefficients */
    double *u, *mass;
    double *factor; /* [n][n] A, and its factor in place of it */
    double *panel;  /* [PANEL][PANEL] the block on the diagonal before it was factored */
    double *vector; /* [n] */
};

static void dense_clear(struct dense *d)
{
    srnf_free(d->order);
    srnf_free(d->u);
    srnf_free(d->mass);
    srnf_free(d->factor);
    srnf_free(d->panel);
    srnf_free(d->vector);
}

/* The matrix on surfaces of a degree, up to that of the system. */
static int dense_create(struct inversion_run *run, size_t degree, struct dense *d)
{
    struct gauss_newton *system = run->system;

    d->n = normal_matrix_size(degree);
    if (degree > SRNF_CERTIFIED_DEGREE_MAX) { /* 3069 unknowns are 75 MB */
        return SRNF_ELIMIT;
    }
    d->order = srnf_alloc(d->n, sizeof *d->order);
    d->u = srnf_alloc(3 * system->points, sizeof(double));
    d->mass = srnf_alloc(system->count, sizeof(double));
    d->factor = srnf_alloc(d->n * d->n, sizeof(double));
    d->panel = srnf_alloc(PANEL * PANEL, sizeof(double));
    d->vector = srnf_alloc(d->n, sizeof(double));
    if (!d->order || !d->u || !d->mass || !d->factor || !d->panel || !d->vector) {
        return SRNF_ENOMEM;
    }
    normal_form_field(system, d->u);
    normal_matrix_order(degree, system->count / 3, d->order);
    linear_diagonal(system->degree, 0.0, 1.0, d->mass);
    return normal_matrix_assemble(system->sht, degree, d->u, system->weight, run->context,
                                  d->factor);
}

/* ---- The factor ------------------------------------------------------------------------------ */

/* The rows of a strip behind the panel: what the panel is there, and what it takes off. */
static void divide_strip(void *argument, size_t strip)
{
    const struct dense *d = argument;
    size_t row = d->first + d->width + strip * PANEL;
    size_t rows = d->n - row < PANEL ? d->n - row : PANEL;

    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)rows,
                (int)d->width, 1.0, d->factor + d->first * d->n + d->first, (int)d->n,
                d->factor + d->first * d->n + row, (int)d->n);
}

static void subtract_strip(void *argument, size_t strip)
{
    const struct dense *d = argument;
    size_t column = d->first + d->width + strip * PANEL;
    size_t columns = d->n - column < PANEL ? d->n - column : PANEL;
    size_t below = d->n - column - columns;
    const double *panel = d->factor + d->first * d->n;
    double *block = d->factor + column * d->n + column;

    cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, (int)columns, (int)d->width, -1.0,
                panel + column, (int)d->n, 1.0, block, (int)d->n);
    if (below > 0) {
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, (int)below, (int)columns,
                    (int)d->width, -1.0, panel + column + columns, (int)d->n, panel + column,
                    (int)d->n, 1.0, block + columns, (int)d->n);
    }
}

/* The factor of the panel, whose columns before have been taken off, and what it takes off those
   behind. *pivot: columns of it before one that is not positive. */
static int factor_panel(const struct inversion_run *run, struct dense *d, size_t *pivot)
{
    double *block = d->factor + d->first * d->n + d->first;
    size_t behind = d->n - d->first - d->width, strips = (behind + PANEL - 1) / PANEL;
    lapack_int bad;
    int status;

    for (size_t i = 0; i < d->width; i++) {
        linear_copy(d->width, block + i * d->n, d->panel + i * PANEL);
    }
    bad = LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (int)d->width, block, (int)d->n);
    *pivot = bad > 0 ? (size_t)bad - 1 : d->width;
    if (bad != 0) {
        return srnf_is_canceled(run->context) ? SRNF_ECANCELED : SRNF_OK;
    }
    status = srnf_parallel_for(run->context, strips, divide_strip, d);
    return status ? status : srnf_parallel_for(run->context, strips, subtract_strip, d);
}

/* A + shift I becomes its Cholesky factor. *positive: unknowns before a pivot that is not positive,
   n where all are. SRNF_ECANCELED: there is neither. */
static int dense_factor(const struct inversion_run *run, struct dense *d, double shift,
                        size_t *positive)
{
    for (size_t i = 0; i < d->n; i++) {
        d->factor[i * d->n + i] += shift;
    }
    *positive = 0;
    for (d->first = 0; d->first < d->n; d->first += PANEL) {
        size_t pivot;
        int status;

        d->width = d->n - d->first < PANEL ? d->n - d->first : PANEL;
        status = factor_panel(run, d, &pivot);
        *positive = d->first + pivot;
        if (status != SRNF_OK || pivot < d->width) {
            return status;
        }
    }
    return SRNF_OK;
}

/* vector <- a few steps of inverse iteration with the factor. */
static bool dense_iterate(struct dense *d)
{
    lapack_int n = (lapack_int)d->n;
    double before = 0.0;

    for (int step = 0; step < DENSE_STEPS; step++) {
        double norm = sqrt(linear_dot(d->n, d->vector, d->vector));

        if (!(norm > 0.0) || !isfinite(norm)) {
            return false;
        }
        linear_scale(d->n, 1.0 / norm, d->vector);
        if (step > 1 && fabs(norm - before) <= SETTLED * norm) {
            break;
        }
        before = norm;
        if (LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, d->factor, n, d->vector, n) != 0) {
            return false;
        }
    }
    return true;
}

/*
 * Where the pivot of an unknown is not positive: with the factor L of the unknowns before it and
 * its row r of the matrix, x = (-L^-T L^-1 r, 1) has x'Bx = pivot <= 0. The part of L within the
 * last panel is made again, since LAPACK promises nothing of it there.
 */
static bool dense_bend(struct dense *d, size_t positive)
{
    size_t inside = positive - d->first;
    double *block = d->factor + d->first * d->n + d->first, *x = d->vector;

    for (size_t i = 0; i < d->width; i++) {
        linear_copy(d->width, d->panel + i * PANEL, block + i * d->n);
    }
    if (inside > 0 && LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (int)inside, block, (int)d->n)) {
        return false;
    }
    for (size_t i = 0; i < d->n; i++) { /* L^-1 r of the panels before; r of this one */
        x[i] = i < positive ? -d->factor[i * d->n + positive] : 0.0;
    }
    if (inside > 0) {
        cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)inside, block,
                    (int)d->n, x + d->first, 1);
    }
    if (positive > 0) {
        cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, (int)positive, d->factor,
                    (int)d->n, x, 1);
    }
    x[positive] = 1.0;
    return isfinite(linear_dot(d->n, x, x));
}

/* ---- Both ways between the unknowns and the coefficients ------------------------------------- */

static void to_unknowns(struct dense *d, const double *x)
{
    for (size_t i = 0; i < d->n; i++) {
        d->vector[i] = x[d->order[i]] * sqrt(d->mass[d->order[i]]);
    }
}

static void from_unknowns(const struct gauss_newton *system, const struct dense *d, double *x)
{
    for (size_t i = 0; i < system->count; i++) {
        x[i] = 0.0;
    }
    for (size_t i = 0; i < d->n; i++) {
        x[d->order[i]] = d->vector[i] / sqrt(d->mass[d->order[i]]);
    }
}

int spectral_dense(struct inversion_run *run, const double *start, double *f)
{
    struct dense d = {0};
    size_t positive = 0;
    int status = dense_create(run, run->system->degree, &d);

    if (status == SRNF_OK) {
        to_unknowns(&d, start);
        status = dense_factor(run, &d, DENSE_SHIFT, &positive);
    }
    if (status == SRNF_OK) {
        if (positive == d.n && dense_iterate(&d)) {
            from_unknowns(run->system, &d, f);
            spectral_fit_scale(run->system, f);
        } else {
            status = SRNF_ENUMERIC;
        }
    }
    dense_clear(&d);
    return status;
}

/* ---- The certificate ------------------------------------------------------------------------- */

/* A vector that is no eigenvector of anything in particular: the same on every machine. */
static void scatter_vector(size_t n, double *x)
{
    uint64_t state = 0x9e3779b97f4a7c15U;

    for (size_t i = 0; i < n; i++) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        x[i] = (double)(state >> 11) * 0x1p-53 - 0.5;
    }
}

/* x <- x without its part along f, in M: f was lifted out of the way. */
static void take_off(size_t n, const double *mass, const double *f, double *x)
{
    double part = linear_dot_weighted(n, mass, f, x) / linear_dot_weighted(n, mass, f, f);

    linear_axpy(n, -part, f, x);
}

static int certify_dense(struct inversion_run *run, struct dense *d,
                         struct srnf_certificate *certificate)
{
    struct gauss_newton *system = run->system;
    struct normal_form form = {system, d->u};
    double *x = srnf_alloc(system->count, sizeof(double));
    size_t positive = 0;
    bool found = false;
    int status;

    if (!x) {
        return SRNF_ENOMEM;
    }
    certificate->residual = normal_form_quotient(&form, run->f, d->mass);
    certificate->threshold =
        fmax(THRESHOLD_ROUNDING * sqrt((double)d->n) * ROUNDING,
             THRESHOLD_NOISE * (certificate->residual + inversion_run_relative(run)));
    to_unknowns(d, run->f);
    linear_scale(d->n, 1.0 / sqrt(linear_dot_weighted(system->count, d->mass, run->f, run->f)),
                 d->vector);
    cblas_dsyr(CblasColMajor, CblasLower, (int)d->n, 1.0, d->vector, 1, d->factor, (int)d->n);
    status = dense_factor(run, d, -certificate->threshold, &positive);
    if (status == SRNF_OK) {
        certificate->unique = positive == d->n;
        scatter_vector(d->n, d->vector);
        found = certificate->unique ? dense_iterate(d) : dense_bend(d, positive);
        certificate->computed = certificate->unique || found;
    }
    if (found) {
        from_unknowns(system, d, x);
        take_off(system->count, d->mass, run->f, x);
        certificate->second_eigenvalue = normal_form_quotient(&form, x, d->mass);
    }
    if (!certificate->computed) {
        *certificate = (struct srnf_certificate){0};
    }
    srnf_free(x);
    return status;
}

static int certify_at(struct inversion_run *run, size_t degree,
                      struct srnf_certificate *certificate)
{
    struct dense d = {0};
    int status = dense_create(run, degree, &d);

    *certificate = (struct srnf_certificate){0};
    if (status == SRNF_OK) {
        status = certify_dense(run, &d, certificate);
    }
    dense_clear(&d);
    return status;
}

/* Whether a surface is so near a convex one that low degrees will tell. */
static int wants_look(struct inversion_run *run, bool *wanted)
{
    double *work;

    *wanted = false;
    if (run->system->degree < LOOK_FROM) {
        return SRNF_OK;
    }
    work = srnf_alloc(run->system->count, sizeof(double));
    if (!work) {
        return SRNF_ENOMEM;
    }
    *wanted = sliding_turning(run->system, work) < LOOK_TURNING;
    srnf_free(work);
    return SRNF_OK;
}

int spectral_certify(struct inversion_run *run, struct srnf_certificate *certificate)
{
    size_t degree = run->system->degree;
    bool look;
    int status;

    *certificate = (struct srnf_certificate){0};
    if (degree > SRNF_CERTIFIED_DEGREE_MAX) {
        return SRNF_OK;
    }
    status = wants_look(run, &look);
    if (status == SRNF_OK && look) {
        status = certify_at(run, LOOK, certificate);
    }
    return status != SRNF_OK || (certificate->computed && !certificate->unique)
               ? status
               : certify_at(run, degree, certificate);
}
