/*
 * sphere.h - grids, harmonic transforms, evaluation at points (core/harmonics).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_SPHERE_H
#define SRNF_PUBLIC_SPHERE_H

#include "srnf/base.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_grid_kind {
    SRNF_GRID_GAUSS_LEGENDRE = 0, /* exact quadrature for degree 2 n_theta - 1 */
    SRNF_GRID_EQUIANGULAR = 1,    /* poles, Clenshaw-Curtis weights, exact for degree n_theta - 1 */
};

/* A grid and its quadrature. Immutable. weight is the weight of one node of the row, so that
   n_phi * sum(weight) = 4 pi. */
struct srnf_grid {
    enum srnf_grid_kind kind;
    size_t n_theta, n_phi;
    const double *theta;     /* [n_theta] increasing, in radians */
    const double *cos_theta; /* [n_theta] */
    const double *sin_theta; /* [n_theta] */
    const double *weight;    /* [n_theta] */
};

/* Transform of one degree on one grid: Legendre tables and FFTW plans. Immutable after creation. */
struct srnf_sht;

static inline size_t srnf_coefficient_count(size_t degree)
{
    return (degree + 1) * (degree + 1);
}

/* Rows of the working grid of a degree: ceil(3 (L + 1) / 2). */
static inline size_t srnf_working_rows(size_t degree)
{
    return (3 * (degree + 1) + 1) / 2;
}

/*
 * Creates a transform.
 *   out      [out] the transform, to be freed with srnf_sht_destroy; NULL on error
 *   degree   [in]  0 .. 1000
 *   kind     [in]  the rows
 *   n_theta  [in]  0: the working grid (SRNF_GRID_GAUSS_LEGENDRE); otherwise at least degree + 1
 *                  (Gauss-Legendre) or 2 degree + 1 (equiangular), the least on which analysis is
 *                  exact
 *   n_phi    [in]  0: 2 n_theta; otherwise at least 2 degree + 1
 * Errors: SRNF_EINVAL, SRNF_ENOMEM.
 * Threads: FFTW's planner is shared by the whole process. Creation and destruction are safe from
 * several threads only after fftw_make_planner_thread_safe() has been called once; execution always
 * is.
 */
SRNF_CHECKED int srnf_sht_create(struct srnf_sht **out, size_t degree, enum srnf_grid_kind kind,
                                 size_t n_theta, size_t n_phi);
void srnf_sht_destroy(struct srnf_sht *sht);

const struct srnf_grid *srnf_sht_grid(const struct srnf_sht *sht);
size_t srnf_sht_degree(const struct srnf_sht *sht);

/* Bytes of workspace that one call with this batch needs; aligned as srnf_alloc aligns. */
size_t srnf_sht_workspace_size(const struct srnf_sht *sht, size_t batch);

/*
 * The transform and its relatives, on a batch of fields at once. None allocates; each is re-entrant
 * given its own workspace. coefficients: double[batch][(L+1)^2]; fields:
 * double[batch][n_theta][n_phi]. Inputs and outputs must not overlap.
 *
 *   synthesis          values = sum_lm c_lm Y_lm
 *   synthesis_adjoint  its transpose: c_lm = sum over nodes of Y_lm values (no weights)
 *   analysis           c_lm = sum over nodes of weight Y_lm values: inverts synthesis for degree L
 *   gradient           d_theta = d/dtheta, d_phi = (1 / sin theta) d/dphi (its limit at a pole)
 *   gradient_adjoint   transpose of gradient: c_lm = sum over nodes of Y_theta a + (Y_phi / sin) b
 * The cost is O(batch L^3) for the Legendre part and O(batch L^2 log L) for the Fourier part.
 */
void srnf_sht_synthesis(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                        double *values, void *workspace);
void srnf_sht_synthesis_adjoint(const struct srnf_sht *sht, size_t batch, const double *values,
                                double *coefficients, void *workspace);
void srnf_sht_analysis(const struct srnf_sht *sht, size_t batch, const double *values,
                       double *coefficients, void *workspace);
void srnf_sht_gradient(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                       double *d_theta, double *d_phi, void *workspace);
void srnf_sht_gradient_adjoint(const struct srnf_sht *sht, size_t batch, const double *d_theta,
                               const double *d_phi, double *coefficients, void *workspace);

/*
 * Harmonic series and their gradients at arbitrary points of the sphere.
 *   points        [in]  double[n][3], unit vectors
 *   coefficients  [in]  double[batch][(L+1)^2]
 *   values        [out] double[batch][n], or NULL
 *   gradients     [out] double[batch][n][3], the tangential gradient as a vector of R^3 (regular at
 *                       the poles), or NULL
 * Cost O(n L^2 batch). Errors: SRNF_EINVAL (degree above 1000), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_harmonics_at_points(size_t degree, size_t batch, const double *coefficients,
                                          size_t n, const double *points, double *values,
                                          double *gradients);

/*
 * A scalar on the grid at arbitrary points, linearly between the nodes: never beyond the values
 * about it.
 *   values [in]  double[n_theta][n_phi]
 *   points [in]  double[n][3], unit vectors
 *   out    [out] double[n]
 */
void srnf_grid_interpolate(const struct srnf_grid *grid, const double *values, size_t n,
                           const double *points, double *out);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
