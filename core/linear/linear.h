/*
 * linear.h - what the solvers share: vectors of coefficients, and problems given by their products.
 *
 * Vector fields are double[3][n] with n = n_theta n_phi, coefficients double[3][(L+1)^2].
 * "Translations" are the three l = 0 coefficients: they do not change q, and every solver keeps
 * them at 0.
 */
#ifndef SRNF_LINEAR_INTERNAL_H
#define SRNF_LINEAR_INTERNAL_H

#include "internal.h"

/* ---- Vectors of coefficients (vector.c); fixed order of summation ---------------------------- */

double linear_dot(size_t n, const double *a, const double *b);
double linear_dot_weighted(size_t n, const double *weight, const double *a, const double *b);
void linear_axpy(size_t n, double factor, const double *x, double *y);
void linear_scale(size_t n, double factor, double *x);
void linear_copy(size_t n, const double *from, double *to);
/* Diagonals over double[3][(L+1)^2]: a + b l (l + 1), and 0 for l = 0. */
void linear_diagonal(size_t degree, double a, double b, double *diagonal);

/* ---- All eigenvalues (eigenvalues.c) --------------------------------------------------------- */

/* Those of a symmetric matrix of size_of rows, increasing; with vectors the matrix becomes those,
   one a row. Only its upper triangle, as C sees it, is read. SRNF_ENOMEM, SRNF_ENUMERIC. */
int linear_eigenvalues(size_t size_of, bool vectors, double *matrix, double *values);
/* A = U diag(s) V' of 3 x 3, all column-major (singular.c). SRNF_ENUMERIC: A is not finite, or no
   convergence. */
SRNF_CHECKED int linear_singular(const double a[9], double s[3], double u[9], double vt[9]);

/* ---- The solvers ----------------------------------------------------------------------------- */

/* A x = b for A given by its products. */
struct linear_problem {
    size_t n;
    void (*product)(void *argument, const double *x, double *out);
    void (*precondition)(void *argument, const double *r, double *z);
    void *argument;
    double tolerance; /* on the residual, relative to that of x = 0 */
    size_t cap;       /* on the products */
    double enough; /* of b'x, which x takes off |.|^2 in a least-squares problem: no more is wanted.
                      0: as much as there is. Conjugate gradients alone */
    const struct srnf_context *context; /* asked for cancellation now and then; may be NULL */
};

/* What conjugate gradients came to. */
struct linear_figures {
    size_t products;
    double residual; /* sqrt(r' P r) relative to that of x = 0; 0 for b = 0 */
};

/* conjugate_gradients.c. r: b on entry, b - A x on return; x from 0; work double[3][n]. Returns
 * SRNF_OK whether the
   tolerance was reached or not, or SRNF_ECANCELED. */
int linear_conjugate_gradients(const struct linear_problem *problem, double *r, double *x,
                               double *work, struct linear_figures *figures);
/* gmres.c; precondition is not used. work: linear_gmres_doubles. Returns the products. */
size_t linear_gmres_doubles(size_t n, size_t cap);
size_t linear_gmres(const struct linear_problem *problem, const double *b, double *x, double *work);

/* lobpcg.c: smallest eigenvalue of A x = mu M x, A symmetric and positive semidefinite, M diagonal.
   */
struct linear_eigen {
    size_t n;
    void (*product)(void *argument, const double *x, double *out);
    void *argument;
    const double *mass;         /* diagonal; entries 0 are left out of the space */
    const double *precondition; /* diagonal of the approximate inverse */
    double target;              /* stop below this value of mu */
    double change;              /* or when ten steps lowered mu by less than this part */
    size_t cap;
    const struct srnf_context *context;
};
/* x: start and result, M-normalized. residual: ||A x - mu M x|| in the norm of the preconditioner.
   */
SRNF_CHECKED int linear_lobpcg(const struct linear_eigen *problem, double *x, double *mu,
                               double *residual);

#endif
