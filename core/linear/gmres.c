/*
 * gmres.c - the generalized minimal residual method for A x = b without a symmetry: Y. Saad, M.
 * Schultz, "GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear
 * systems", SIAM J. Sci. Stat. Comput. 7 (1986).
 *
 * Arnoldi's process by modified Gram-Schmidt, Givens rotations, one cycle without a restart, from
 * x = 0. The norm that is made small is the plain one: a caller that wants another, or a
 * preconditioner, scales A. Memory: cap + 1 vectors, of the caller. Cost of step k: one product and
 * 4 k n operations.
 */
#include "linear.h"

#include <math.h>

struct gmres {
    size_t n, cap;
    double *basis; /* [cap + 1][n] */
    double *h;     /* [cap][cap + 1] columns of the Hessenberg matrix, turned to triangles */
    double *cosine, *sine; /* [cap] */
    double *rhs;           /* [cap + 1] */
};

size_t linear_gmres_doubles(size_t n, size_t cap)
{
    return (cap + 1) * n + cap * (cap + 1) + 2 * cap + cap + 1;
}

static struct gmres split(size_t n, size_t cap, double *work)
{
    struct gmres s = {.n = n, .cap = cap, .basis = work};

    s.h = s.basis + (cap + 1) * n;
    s.cosine = s.h + cap * (cap + 1);
    s.sine = s.cosine + cap;
    s.rhs = s.sine + cap;
    return s;
}

/* Orthogonalizes basis vector k + 1 against the ones before it, and rotates column k. False when
   the space is exhausted: the solution lies in it. */
static bool extend(struct gmres *s, size_t k)
{
    double *h = s->h + k * (s->cap + 1);
    double *v = s->basis + (k + 1) * s->n;
    double next;
    double length;

    for (size_t j = 0; j <= k; j++) {
        h[j] = linear_dot(s->n, s->basis + j * s->n, v);
        linear_axpy(s->n, -h[j], s->basis + j * s->n, v);
    }
    next = sqrt(linear_dot(s->n, v, v));
    for (size_t j = 0; j < k; j++) {
        double upper = h[j];

        h[j] = s->cosine[j] * upper + s->sine[j] * h[j + 1];
        h[j + 1] = s->cosine[j] * h[j + 1] - s->sine[j] * upper;
    }
    length = hypot(h[k], next);
    s->cosine[k] = length > 0.0 ? h[k] / length : 1.0;
    s->sine[k] = length > 0.0 ? next / length : 0.0;
    h[k] = length;
    s->rhs[k + 1] = -s->sine[k] * s->rhs[k];
    s->rhs[k] *= s->cosine[k];
    if (!(next > 0.0)) {
        return false;
    }
    linear_scale(s->n, 1.0 / next, v);
    return true;
}

/* x = the combination of k basis vectors that solves the triangular system. */
static void combine(struct gmres *s, size_t k, double *x)
{
    for (size_t i = 0; i < s->n; i++) {
        x[i] = 0.0;
    }
    for (size_t j = k; j-- > 0;) {
        double value = s->rhs[j];

        for (size_t i = j + 1; i < k; i++) {
            value -= s->h[i * (s->cap + 1) + j] * s->rhs[i];
        }
        value = s->h[j * (s->cap + 1) + j] > 0.0 ? value / s->h[j * (s->cap + 1) + j] : 0.0;
        s->rhs[j] = value;
        linear_axpy(s->n, value, s->basis + j * s->n, x);
    }
}

size_t linear_gmres(const struct linear_problem *problem, const double *b, double *x, double *work)
{
    struct gmres s = split(problem->n, problem->cap, work);
    double norm = sqrt(linear_dot(s.n, b, b));
    bool more = norm > 0.0;
    size_t k = 0;

    linear_copy(s.n, b, s.basis);
    linear_scale(s.n, more ? 1.0 / norm : 0.0, s.basis);
    s.rhs[0] = norm;
    while (more && k < s.cap && !srnf_is_canceled(problem->context) &&
           fabs(s.rhs[k]) > problem->tolerance * norm) {
        problem->product(problem->argument, s.basis + k * s.n, s.basis + (k + 1) * s.n);
        more = extend(&s, k);
        k++;
    }
    combine(&s, k, x);
    return k;
}
