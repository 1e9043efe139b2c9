/*
 * spectral.h - the quadratic forms T and M of the eigenproblem of inversion (spectral.c), and T's
 * matrix (normal_matrix.c).
 */
#ifndef SRNF_INVERSION_SPECTRAL_H
#define SRNF_INVERSION_SPECTRAL_H

#include "inversion.h"

struct normal_form {
    struct gauss_newton *system;
    double *u; /* [3][points] unit normals, q / |q| */
};
/* u from the target of the system; 0 where q is. */
void normal_form_field(const struct gauss_newton *system, double *u);
/* out = T x; 0 in the translations. */
void normal_form_product(void *form, const double *x, double *out);
/* T(x) / M(x) as a sum of squares: accurate far below the rounding of x'Ax. mass: the diagonal of
   M. */
double normal_form_quotient(struct normal_form *form, const double *x, const double *mass);
/* Scales x, whose normals are +-u, to the SRNF that fits q best. */
void spectral_fit_scale(struct gauss_newton *system, double *x);

/* ---- normal_matrix.c ------------------------------------------------------------------------- */

/* Unknowns of a degree without the translations, 3 ((L + 1)^2 - 1). */
size_t normal_matrix_size(size_t degree);
/* order[i] = place in double[3][each], each >= (degree + 1)^2, of the unknown i of the matrix: by
   coordinate, then by order m, cosines before sines, then by l. */
void normal_matrix_order(size_t degree, size_t each, size_t *order);
/*
 * Lower triangle of A = M^(-1/2) T M^(-1/2) on surfaces of a degree, translations left out.
 *   degree  [in]  up to that of the transform
 *   u       [in]  double[3][points] as of normal_form_field
 *   weight  [in]  double[points] of the quadrature
 *   matrix  [out] double[n][n] by columns, n = normal_matrix_size; above the diagonal it means
 *                 nothing
 * The same for any number of threads. Returns SRNF_OK, SRNF_ENOMEM or SRNF_ECANCELED.
 */
SRNF_CHECKED int normal_matrix_assemble(const struct srnf_sht *sht, size_t degree, const double *u,
                                        const double *weight, const struct srnf_context *context,
                                        double *matrix);

#endif
