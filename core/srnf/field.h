/*
 * field.h - SRNFs at grid points, and their differential.
 *
 * Vector fields are double[3][n] with n = n_theta n_phi, coefficients double[3][(L+1)^2].
 * "Translations" are the three l = 0 coefficients: they do not change q, and every solver keeps
 * them at 0.
 */
#ifndef SRNF_SRNF_FIELD_H
#define SRNF_SRNF_FIELD_H

#include "internal.h"

/* ---- pointwise.c: everything that happens at a grid point ------------------------------------ */

/* n = f_theta x f_phi. unit: n / |n|, root: |n|^(1/2), inverse: |n|^(-1/2); all 0 where n = 0. */
void pointwise_normals(size_t n, const double *f_theta, const double *f_phi, double *unit,
                       double *root, double *inverse);
/* residual = root unit - q */
void pointwise_residual(size_t n, const double *unit, const double *root, const double *q,
                        double *residual);
/* Q_* at a point: out = (n_w - <unit, n_w> unit / 2) inverse, n_w = f_theta x w_phi + w_theta x
   f_phi. */
void pointwise_differential(size_t n, const double *f_theta, const double *f_phi,
                            const double *unit, const double *inverse, const double *w_theta,
                            const double *w_phi, double *out);
/* Its transpose, with a weight: z = weight (y - <unit, y> unit / 2) inverse; a = f_phi x z, b = z x
   f_theta. */
void pointwise_differential_adjoint(size_t n, const double *f_theta, const double *f_phi,
                                    const double *unit, const double *inverse, const double *weight,
                                    const double *y, double *a, double *b);
/* In place (w_theta, w_phi) <- weight u (<w_theta, u>, <w_phi, u>): the quadratic form T of
   spectral.c. */
void pointwise_normal_part(size_t n, const double *u, const double *weight, double *w_theta,
                           double *w_phi);
/* sum of weight |a|^2 over a vector field; fixed order of summation. */
double pointwise_norm2(size_t n, const double *weight, const double *a);
/* Quadrature weights, one for each point. */
void pointwise_weights(const struct srnf_grid *grid, double *weight);

/* field.c: the field of a surface in one of its representations; workspace as for srnf_field. */
void field_represent(const struct srnf_sht *sht, enum srnf_representation representation,
                     const double *coefficients, double *q, void *workspace);

#endif
