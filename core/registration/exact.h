/*
 * exact.h - the linearized action of fields on an SRNF over a regular grid,
 * matrix-free.
 *
 * Unknowns of degree D: double[2][(D+1)^2] as in registration.h, entries l = 0 included and idle,
 * then the three of the value rotation.
 */
#ifndef SRNF_REGISTRATION_EXACT_H
#define SRNF_REGISTRATION_EXACT_H

#include "registration.h"

struct tangent {
    struct srnf_sht *sht;               /* of the fields' degree */
    const struct srnf_context *context; /* asked for cancellation by tangent_solve; may be NULL */
    size_t n, count, unknowns;
    double norm2;
    double *memory;
    double *q, *q_theta, *q_phi;         /* [n][3] */
    double *weight, *points;             /* [n], [n][3] */
    double *along, *across, *divergence; /* [2][n], [2][n], [n]: scratch */
    double *image;                       /* [n][3]: D x */
    double *potentials, *moments;        /* [2][count], [3][count]: scratch */
    double *preconditioner, *damping;    /* [unknowns] diagonals */
    void *workspace;
};
/* On a Gauss-Legendre grid; q and its derivatives are to be filled in, then tangent_prepare. */
SRNF_CHECKED int tangent_create(struct tangent *t, size_t degree, size_t n_theta, size_t n_phi);
void tangent_clear(struct tangent *t);
/* Diagonals, relative to norm2. */
void tangent_prepare(struct tangent *t, double norm2);
/* image = D x. */
void tangent_apply(struct tangent *t, const double *x);
/* out = D' W image / norm2. */
void tangent_transpose(struct tangent *t, double *out);
/* (D' W D / norm2 + lambda damping) x = rhs to a relative tolerance, by conjugate gradients;
   returns
   <rhs, x>. scratch: 4 unknowns. */
double tangent_solve(struct tangent *t, const double *rhs, double lambda, double tolerance,
                     size_t cap, double *x, double *scratch);

/* Alternates right and left steps until nothing is left to gain. template_moving: the template's
   own
   surface, or NULL: the derivative of its q is then taken spectrally. sht: grid of the target. */
SRNF_CHECKED int registration_polish(const struct problem *problem, const struct srnf_sht *sht,
                                     const struct moving *template_moving,
                                     const struct srnf_context *context, struct warp *warp,
                                     size_t *iterations);

#endif
