/*
 * lobpcg.c - smallest eigenpair of A x = mu M x by single-vector LOBPCG: A. Knyazev, "Toward the
 * optimal preconditioned eigensolver", SIAM J. Sci. Comput. 23 (2001).
 *
 * Each step minimizes the Rayleigh quotient over span {x, w, p}: the iterate, the preconditioned
 * residual and the last direction, kept M-orthonormal by Gram-Schmidt done twice, so that the small
 * problem is an ordinary symmetric one of order 3. Images under A are carried along by the same
 * linear combinations and renewed now and then, since their rounding would otherwise limit mu. One
 * product with A a step.
 */
#include "linear.h"

#include <lapacke.h>
#include <math.h>

#define RENEW 50 /* steps between exact products for x */
#define CHANGE_STEPS 10
#define DEPENDENT 1e-10 /* what Gram-Schmidt must leave of a unit vector */

struct lobpcg {
    const struct linear_eigen *problem;
    double *memory;
    double *ax, *w, *aw, *p, *ap, *r;
    bool has_p;
};

static double mass_dot(const struct lobpcg *s, const double *a, const double *b)
{
    return linear_dot_weighted(s->problem->n, s->problem->mass, a, b);
}

/* Scales a (and its image, if any) to unit mass norm; false when nothing is left of it. */
static bool normalize(const struct lobpcg *s, double *a, double *image, double least)
{
    double norm = sqrt(mass_dot(s, a, a));

    if (!(norm > least)) {
        return false;
    }
    linear_scale(s->problem->n, 1.0 / norm, a);
    if (image) {
        linear_scale(s->problem->n, 1.0 / norm, image);
    }
    return true;
}

static void remove_component(const struct lobpcg *s, double *a, double *image, const double *b,
                             const double *b_image)
{
    double overlap = mass_dot(s, a, b);

    linear_axpy(s->problem->n, -overlap, b, a);
    if (image) {
        linear_axpy(s->problem->n, -overlap, b_image, image);
    }
}

/* w <- preconditioned residual, M-orthonormal to x and p; false when it has vanished. */
static bool new_direction(struct lobpcg *s, const double *x, double mu, double *residual)
{
    const struct linear_eigen *problem = s->problem;
    double norm2 = 0.0;

    for (size_t i = 0; i < problem->n; i++) {
        s->r[i] = problem->mass[i] > 0.0 ? s->ax[i] - mu * problem->mass[i] * x[i] : 0.0;
        s->w[i] = problem->precondition[i] * s->r[i];
        norm2 += s->r[i] * s->w[i];
    }
    *residual = sqrt(fmax(0.0, norm2));
    if (!normalize(s, s->w, NULL, 0.0)) {
        return false;
    }
    for (int twice = 0; twice < 2; twice++) {
        remove_component(s, s->w, NULL, x, NULL);
        if (s->has_p) {
            remove_component(s, s->w, NULL, s->p, NULL);
        }
        if (!normalize(s, s->w, NULL, DEPENDENT)) {
            return false;
        }
    }
    return true;
}

/* Smallest eigenvector c of the projected problem in the basis x, w, p. */
static int rayleigh_ritz(struct lobpcg *s, const double *x, double c[3], double *mu)
{
    lapack_int size = s->has_p ? 3 : 2;
    size_t n = s->problem->n;
    double a[9] = {0};
    double values[3];
    double work[64];

    a[0] = linear_dot(n, x, s->ax);
    a[1] = linear_dot(n, s->w, s->ax);
    a[size + 1] = linear_dot(n, s->w, s->aw);
    if (s->has_p) {
        a[2] = linear_dot(n, s->p, s->ax);
        a[5] = linear_dot(n, s->p, s->aw);
        a[8] = linear_dot(n, s->p, s->ap);
    }
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', size, a, size, values, work, 64) != 0) {
        return SRNF_ENUMERIC;
    }
    c[0] = a[0];
    c[1] = a[1];
    c[2] = s->has_p ? a[2] : 0.0;
    *mu = values[0];
    return SRNF_OK;
}

/* x <- c0 x + c1 w + c2 p, p <- c1 w + c2 p, images alike. */
static void combine(struct lobpcg *s, double *x, const double c[3])
{
    size_t n = s->problem->n;

    for (size_t i = 0; i < n; i++) {
        double p = s->has_p ? c[1] * s->w[i] + c[2] * s->p[i] : c[1] * s->w[i];
        double ap = s->has_p ? c[1] * s->aw[i] + c[2] * s->ap[i] : c[1] * s->aw[i];

        s->p[i] = p;
        s->ap[i] = ap;
        x[i] = c[0] * x[i] + p;
        s->ax[i] = c[0] * s->ax[i] + ap;
    }
    (void)normalize(s, x, s->ax, 0.0);
    remove_component(s, s->p, s->ap, x, s->ax);
    s->has_p = normalize(s, s->p, s->ap, 0.0);
    if (s->has_p) {
        remove_component(s, s->p, s->ap, x, s->ax);
    }
}

static int iterate(struct lobpcg *s, double *x, double *mu, double *residual)
{
    const struct linear_eigen *problem = s->problem;
    double before = INFINITY;
    double c[3];

    problem->product(problem->argument, x, s->ax);
    *mu = linear_dot(problem->n, x, s->ax);
    for (size_t step = 0; step < problem->cap; step++) {
        if (srnf_is_canceled(problem->context)) {
            return SRNF_ECANCELED;
        }
        if (step % CHANGE_STEPS == 0) {
            if (before - *mu < problem->change * fabs(*mu)) {
                break;
            }
            before = *mu;
        }
        if (!new_direction(s, x, *mu, residual) || *mu < problem->target) {
            break;
        }
        problem->product(problem->argument, s->w, s->aw);
        if (rayleigh_ritz(s, x, c, mu)) {
            return SRNF_ENUMERIC;
        }
        combine(s, x, c);
        if (step % RENEW == RENEW - 1) {
            problem->product(problem->argument, x, s->ax);
            *mu = linear_dot(problem->n, x, s->ax);
        }
    }
    (void)new_direction(s, x, *mu, residual);
    return SRNF_OK;
}

int linear_lobpcg(const struct linear_eigen *problem, double *x, double *mu, double *residual)
{
    struct lobpcg s = {problem, NULL, NULL, NULL, NULL, NULL, NULL, NULL, false};
    int status;

    s.memory = srnf_alloc(6 * problem->n, sizeof(double));
    if (!s.memory) {
        return SRNF_ENOMEM;
    }
    s.ax = s.memory;
    s.w = s.memory + problem->n;
    s.aw = s.memory + 2 * problem->n;
    s.p = s.memory + 3 * problem->n;
    s.ap = s.memory + 4 * problem->n;
    s.r = s.memory + 5 * problem->n;
    for (size_t i = 0; i < problem->n; i++) {
        x[i] = problem->mass[i] > 0.0 ? x[i] : 0.0;
    }
    status = normalize(&s, x, NULL, 0.0) ? iterate(&s, x, mu, residual) : SRNF_ENUMERIC;
    srnf_free(s.memory);
    return status;
}
