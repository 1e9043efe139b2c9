/*
 * spectral.c - inversion as a linear eigenproblem, and the certificate of uniqueness.
 *
 * With u = q / |q|, the tangents of any surface g whose normal is everywhere +-u satisfy <g_theta,
 * u> = <g_phi, u> = 0. So
 *
 *   T(g) = integral <g_theta, u>^2 + <g_phi / sin theta, u>^2  >= 0
 *
 * is a quadratic form that vanishes exactly on the surfaces of the given degree with those normals;
 * the wanted f and the translations are among them. Against M(g) = integral |grad g|^2 = sum l (l +
 * 1) |g_lm|^2 its eigenvalues lie in [0, 1]. If the null space is one-dimensional (translations
 * apart), Q(g) = q forces g = c f, and |Q| forces c = +-1: f is then the only surface of its degree
 * with this SRNF, up to sign and translation. The derivation, and why convex surfaces cannot be
 * certified, is in core/README.md.
 *
 * Two ways are offered: LOBPCG without a matrix, two transforms a step, and, up to
 * SPECTRAL_DENSE_MAX unknowns, the matrix A = M^(-1/2) T M^(-1/2) itself with one Cholesky
 * factorization (n^3 / 3 multiply-adds, n = 3 (L+1)^2 - 3). The certificate is of the second kind:
 * A + f f' - threshold I has a Cholesky factor if and only if, up to rounding, the second
 * eigenvalue exceeds the threshold; an iteration alone could only bound it from above.
 *
 * At degree 31 assembling takes 6,000 transforms and a factorization 10^10 multiply-adds. Both ask
 * for cancellation on the way, the assembly at each column, the factorization at each panel.
 */
#include "inversion.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>

#define SPECTRAL_TARGET 1e-11 /* Levenberg-Marquardt takes over from there */
#define SPECTRAL_CAP 1600
#define SPECTRAL_CHANGE 1e-3
#define SPECTRAL_DENSE_MAX 3072 /* degree 31: 75 MB */
#define ASSEMBLY_CHUNKS ((size_t)16)
#define FACTOR_PANEL 256  /* columns between two looks at cancellation: below a fifth of a second */
#define DENSE_SHIFT 1e-13 /* keeps the factor of a singular A definite: a few hundred roundings */
#define DENSE_STEPS 12
#define ROUNDING 2.2e-16
/* Rounding of the matrix and of its factorization grows like sqrt(n) in practice: on spheres and
   ellipsoids, whose second eigenvalue is 0, the computed one stays below 1e-15. */
#define THRESHOLD_ROUNDING 10.0
#define THRESHOLD_NOISE 100.0

struct normal_form {
    struct gauss_newton *system;
    double *u; /* [3][points] */
};

static void unit_field(const struct gauss_newton *system, double *u)
{
    size_t n = system->points;

    for (size_t i = 0; i < n; i++) {
        const double *q = system->q + i;
        double length = sqrt(q[0] * q[0] + q[n] * q[n] + q[2 * n] * q[2 * n]);

        for (size_t c = 0; c < 3; c++) {
            u[c * n + i] = length > 0.0 ? q[c * n] / length : 0.0;
        }
    }
}

static void product(void *argument, const double *x, double *out)
{
    struct normal_form *form = argument;
    struct gauss_newton *s = form->system;

    srnf_sht_gradient(s->sht, 3, x, s->w_theta, s->w_phi, s->workspace);
    pointwise_normal_part(s->points, form->u, s->weight, s->w_theta, s->w_phi);
    srnf_sht_gradient_adjoint(s->sht, 3, s->w_theta, s->w_phi, out, s->workspace);
    s->transforms += 2.0;
}

/* T(x) / M(x) as a sum of squares: accurate far below the rounding of x'Ax. */
static double quotient(struct normal_form *form, const double *x, const double *mass)
{
    struct gauss_newton *s = form->system;
    size_t n = s->points;
    double sum = 0.0;

    srnf_sht_gradient(s->sht, 3, x, s->w_theta, s->w_phi, s->workspace);
    s->transforms += 1.0;
    for (size_t i = 0; i < n; i++) {
        const double *u = form->u + i;
        const double *a = s->w_theta + i;
        const double *b = s->w_phi + i;
        double t = a[0] * u[0] + a[n] * u[n] + a[2 * n] * u[2 * n];
        double p = b[0] * u[0] + b[n] * u[n] + b[2 * n] * u[2 * n];

        sum += s->weight[i] * (t * t + p * p);
    }
    return sum / linear_dot_weighted(s->count, mass, x, x);
}

/* Scales x to the SRNF that fits q best: Q(c x) = c Q(x), so c = <|Q(x)|, |q|> / ||Q(x)||^2; the
   normals are +-u. */
static void fit_scale(struct gauss_newton *system, double *x)
{
    struct gauss_newton_state *t = &system->trial;
    size_t n = system->points;
    double cross = 0.0;
    double square = 0.0;

    (void)gauss_newton_try(system, x);
    for (size_t i = 0; i < n; i++) {
        const double *q = system->q + i;
        double magnitude = sqrt(q[0] * q[0] + q[n] * q[n] + q[2 * n] * q[2 * n]);

        cross += system->weight[i] * t->root[i] * magnitude;
        square += system->weight[i] * t->root[i] * t->root[i];
    }
    linear_scale(system->count, square > 0.0 ? cross / square : 0.0, x);
}

int spectral_start(struct inversion_run *run, const double *start, double *f, double *mu)
{
    struct gauss_newton *system = run->system;
    size_t n = system->count;
    struct normal_form form = {system, srnf_alloc(3 * system->points, sizeof(double))};
    double *mass = srnf_alloc(2 * n, sizeof(double));
    struct linear_eigen problem = {0};
    double residual;
    int status = SRNF_ENOMEM;

    if (!form.u || !mass) {
        goto out;
    }
    unit_field(system, form.u);
    linear_diagonal(system->degree, 0.0, 1.0, mass);
    for (size_t i = 0; i < n; i++) {
        mass[n + i] = mass[i] > 0.0 ? 1.0 / mass[i] : 0.0;
    }
    problem = (struct linear_eigen){.n = n,
                                    .product = product,
                                    .argument = &form,
                                    .mass = mass,
                                    .precondition = mass + n,
                                    .target = SPECTRAL_TARGET,
                                    .change = SPECTRAL_CHANGE,
                                    .cap = SPECTRAL_CAP,
                                    .context = run->context};
    linear_copy(n, start, f);
    status = linear_lobpcg(&problem, f, mu, &residual);
    if (status == SRNF_OK) {
        fit_scale(system, f);
    }
out:
    srnf_free(form.u);
    srnf_free(mass);
    return status;
}

/* ---- The dense way --------------------------------------------------------------------------- */

/* Unknowns without the translations, in the order x, y, z. */
static size_t reduced(const struct gauss_newton *system)
{
    return system->count - 3;
}

static size_t full_index(const struct gauss_newton *system, size_t i)
{
    size_t each = system->count / 3 - 1;

    return i / each * (each + 1) + 1 + i % each;
}

struct assembly {
    const struct srnf_context *context;
    const struct gauss_newton *system;
    const double *u, *mass;
    double *matrix; /* column-major, n x n */
    struct gauss_newton *workers[ASSEMBLY_CHUNKS];
};

static void assemble_chunk(void *argument, size_t chunk)
{
    struct assembly *a = argument;
    struct gauss_newton *s = a->workers[chunk];
    size_t n = reduced(s);
    size_t first = n * chunk / ASSEMBLY_CHUNKS;
    size_t last = n * (chunk + 1) / ASSEMBLY_CHUNKS;
    struct normal_form form = {s, s->field};
    double *x = s->state.memory;
    double *y = s->trial.memory;

    linear_copy(3 * s->points, a->u, s->field);
    for (size_t j = first; j < last && !srnf_is_canceled(a->context); j++) {
        double *column = a->matrix + j * n;
        size_t full = full_index(s, j);

        for (size_t i = 0; i < s->count; i++) {
            x[i] = 0.0;
        }
        x[full] = 1.0 / sqrt(a->mass[full]);
        product(&form, x, y);
        for (size_t i = j; i < n; i++) {
            size_t k = full_index(s, i);

            column[i] = y[k] / sqrt(a->mass[k]);
        }
    }
}

/* Lower triangle of A = M^(-1/2) T M^(-1/2) without the translations. */
static int assemble(struct inversion_run *run, const double *u, const double *mass, double *matrix)
{
    struct assembly a = {run->context, run->system, u, mass, matrix, {NULL}};
    int status = SRNF_OK;

    for (size_t k = 0; k < ASSEMBLY_CHUNKS && status == SRNF_OK; k++) {
        status = gauss_newton_create(&a.workers[k], run->system->sht, run->system->q);
    }
    if (status == SRNF_OK) {
        status = srnf_parallel_for(run->context, ASSEMBLY_CHUNKS, assemble_chunk, &a);
    }
    for (size_t k = 0; k < ASSEMBLY_CHUNKS; k++) {
        if (a.workers[k]) {
            run->system->transforms += a.workers[k]->transforms;
        }
        gauss_newton_destroy(a.workers[k]);
    }
    return status;
}

struct dense {
    size_t n;
    double *u, *mass, *matrix, *factor, *vector;
};

static void dense_clear(struct dense *d)
{
    srnf_free(d->u);
    srnf_free(d->mass);
    srnf_free(d->matrix);
    srnf_free(d->factor);
    srnf_free(d->vector);
}

static int dense_create(struct inversion_run *run, struct dense *d)
{
    struct gauss_newton *system = run->system;

    d->n = reduced(system);
    if (d->n > SPECTRAL_DENSE_MAX) {
        return SRNF_ELIMIT;
    }
    d->u = srnf_alloc(3 * system->points, sizeof(double));
    d->mass = srnf_alloc(system->count, sizeof(double));
    d->matrix = srnf_alloc(d->n * d->n, sizeof(double));
    d->factor = srnf_alloc(d->n * d->n, sizeof(double));
    d->vector = srnf_alloc(d->n, sizeof(double));
    if (!d->u || !d->mass || !d->matrix || !d->factor || !d->vector) {
        return SRNF_ENOMEM;
    }
    unit_field(system, d->u);
    linear_diagonal(system->degree, 0.0, 1.0, d->mass);
    return assemble(run, d->u, d->mass, d->matrix);
}

/* The factor of columns [first, first + width), which the columns before have been taken off, and
   what it takes off those behind. False when the block on the diagonal is not positive definite. */
static bool factor_panel(double *factor, size_t n, size_t first, size_t width)
{
    double *block = factor + first * n + first, *below = block + width;
    int stride = (int)n, k = (int)width, rest = (int)(n - first - width);

    if (LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', k, block, stride) != 0) {
        return false;
    }
    if (rest > 0) {
        cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rest, k, 1.0,
                    block, stride, below, stride);
        cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, rest, k, -1.0, below, stride, 1.0,
                    below + width * n, stride);
    }
    return true;
}

/* factor <- Cholesky factor of A + shift I; *definite is false when that is not positive definite.
   SRNF_ECANCELED: there is neither. */
static int dense_factor(const struct inversion_run *run, struct dense *d, double shift,
                        bool *definite)
{
    *definite = true;
    linear_copy(d->n * d->n, d->matrix, d->factor);
    for (size_t i = 0; i < d->n; i++) {
        d->factor[i * d->n + i] += shift;
    }
    for (size_t first = 0; *definite && first < d->n; first += FACTOR_PANEL) {
        size_t rest = d->n - first;

        if (srnf_is_canceled(run->context)) {
            return SRNF_ECANCELED;
        }
        *definite = factor_panel(d->factor, d->n, first, rest < FACTOR_PANEL ? rest : FACTOR_PANEL);
    }
    return SRNF_OK;
}

/* vector <- a few steps of inverse iteration with the factor. */
static bool dense_iterate(struct dense *d)
{
    lapack_int n = (lapack_int)d->n;

    for (int step = 0; step < DENSE_STEPS; step++) {
        double norm = sqrt(linear_dot(d->n, d->vector, d->vector));

        if (!(norm > 0.0) || !isfinite(norm)) {
            return false;
        }
        linear_scale(d->n, 1.0 / norm, d->vector);
        if (LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, d->factor, n, d->vector, n) != 0) {
            return false;
        }
    }
    return true;
}

static void to_reduced(const struct gauss_newton *system, const struct dense *d, const double *x)
{
    for (size_t i = 0; i < d->n; i++) {
        size_t k = full_index(system, i);

        d->vector[i] = x[k] * sqrt(d->mass[k]);
    }
}

static void from_reduced(const struct gauss_newton *system, const struct dense *d, double *x)
{
    for (size_t i = 0; i < system->count; i++) {
        x[i] = 0.0;
    }
    for (size_t i = 0; i < d->n; i++) {
        size_t k = full_index(system, i);

        x[k] = d->vector[i] / sqrt(d->mass[k]);
    }
}

int spectral_dense(struct inversion_run *run, const double *start, double *f)
{
    struct dense d = {0};
    bool definite = false;
    int status = dense_create(run, &d);

    if (status == SRNF_OK) {
        to_reduced(run->system, &d, start);
        status = dense_factor(run, &d, DENSE_SHIFT, &definite);
    }
    if (status == SRNF_OK) {
        if (definite && dense_iterate(&d)) {
            from_reduced(run->system, &d, f);
            fit_scale(run->system, f);
        } else {
            status = SRNF_ENUMERIC;
        }
    }
    dense_clear(&d);
    return status;
}

/* A vector that is no eigenvector of anything in particular: the same on every machine. */
static void scatter_vector(size_t n, double *x)
{
    uint64_t state = 0x9e3779b97f4a7c15U;

    for (size_t i = 0; i < n; i++) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        x[i] = (double)(state >> 11) * 0x1p-53 - 0.5;
    }
}

static int certify_dense(struct inversion_run *run, struct dense *d,
                         struct srnf_certificate *certificate)
{
    struct gauss_newton *system = run->system;
    struct normal_form form = {system, d->u};
    double *x = srnf_alloc(system->count, sizeof(double));
    double norm;
    int status;

    if (!x) {
        return SRNF_ENOMEM;
    }
    certificate->residual = quotient(&form, run->f, d->mass);
    certificate->threshold =
        fmax(THRESHOLD_ROUNDING * sqrt((double)d->n) * ROUNDING,
             THRESHOLD_NOISE * (certificate->residual + inversion_run_relative(run)));
    to_reduced(system, d, run->f);
    norm = sqrt(linear_dot(d->n, d->vector, d->vector));
    linear_scale(d->n, 1.0 / norm, d->vector);
    cblas_dsyr(CblasColMajor, CblasLower, (int)d->n, 1.0, d->vector, 1, d->matrix, (int)d->n);
    status = dense_factor(run, d, -certificate->threshold, &certificate->unique);
    certificate->computed = certificate->unique;
    if (status == SRNF_OK && !certificate->unique) {
        status = dense_factor(run, d, DENSE_SHIFT, &certificate->computed);
    }
    if (status != SRNF_OK) {
        *certificate = (struct srnf_certificate){0};
        goto out;
    }
    scatter_vector(d->n, d->vector);
    if (certificate->computed && dense_iterate(d)) {
        from_reduced(system, d, x);
        certificate->second_eigenvalue = quotient(&form, x, d->mass);
    }
out:
    srnf_free(x);
    return status;
}

int spectral_certify(struct inversion_run *run, struct srnf_certificate *certificate)
{
    struct dense d = {0};
    int status = dense_create(run, &d);

    *certificate = (struct srnf_certificate){0};
    if (status == SRNF_OK) {
        status = certify_dense(run, &d, certificate);
    }
    dense_clear(&d);
    return status == SRNF_ELIMIT ? SRNF_OK : status;
}
