/*
 * points.h - harmonics at arbitrary points: the plan that evaluation and its adjoint share.
 *
 * A plan holds the constants of the recurrences of one degree and scratch for four points, so it
 * belongs to one thread at a time. Making one costs O(L^2); code that evaluates again and again
 * keeps it.
 */
#ifndef SRNF_HARMONICS_POINTS_H
#define SRNF_HARMONICS_POINTS_H

#include "internal.h"
#include "simd.h"

/* What is tabulated per (m, l) and lane: P, dP/dtheta and m P / sin theta, sqrt 2 included for m >
   0. */
enum { POINT_VALUE, POINT_THETA, POINT_PHI, POINT_KINDS };

struct sphere_points {
    size_t degree;
    const struct srnf_context *context; /* asked for cancellation, outlives the plan; may be NULL */
    double *factors;                    /* constants per (m, l) */
    double *tables; /* [(m, l)][POINT_KINDS][SRNF_LANES], order m's l = m .. L contiguous */
};

SRNF_CHECKED int sphere_points_create(struct sphere_points *plan, size_t degree,
                                      const struct srnf_context *context);
void sphere_points_clear(struct sphere_points *plan);

/* As srnf_harmonics_at_points. This and the others below break off, their outputs unfinished, when
   the context is canceled: who calls them asks it afterwards. */
void sphere_points_evaluate(const struct sphere_points *plan, size_t batch,
                            const double *coefficients, size_t n, const double *points,
                            double *values, double *gradients);

/* srnf_harmonics_at_points that can be canceled. */
SRNF_CHECKED int sphere_harmonics_at_points(const struct srnf_context *context, size_t degree,
                                            size_t batch, const double *coefficients, size_t n,
                                            const double *points, double *values,
                                            double *gradients);

/*
 * The transpose: coefficients[b][lm] = sum_i values[b][i] Y_lm(p_i) + <gradients[b][i], grad
 * Y_lm(p_i)>.
 *   values     [in]  double[batch][n], or NULL for 0
 *   gradients  [in]  double[batch][n][3], or NULL for 0; parts along the normal do not matter
 *   scratch    [in]  double[4 batch (L+1)^2]
 * Sums run over the points in their order, lane by lane: the same on every run.
 */
void sphere_points_adjoint(const struct sphere_points *plan, size_t batch, size_t n,
                           const double *points, const double *values, const double *gradients,
                           double *coefficients, double *scratch);

/* ---- First and second derivatives (points_jets.c) -------------------------------------------- */

/* What a jet holds of one field at one point: partial derivatives in the frame e_theta, e_phi, and
   the covariant second derivatives in it. At a pole the frame is that of phi = 0. */
enum { JET_THETA, JET_PHI, JET_THETA_THETA, JET_THETA_PHI, JET_PHI_PHI, JET_KINDS };

struct sphere_jets {
    struct sphere_points points;
    double *tables; /* [(m, l)][3][SRNF_LANES]: theta theta, theta phi, phi phi */
};

SRNF_CHECKED int sphere_jets_create(struct sphere_jets *plan, size_t degree,
                                    const struct srnf_context *context);
void sphere_jets_clear(struct sphere_jets *plan);

/*
 *   coefficients  [in]  double[batch][(L+1)^2]
 *   points        [in]  double[n][3], unit vectors
 *   jets          [out] double[batch][JET_KINDS][n]
 *   t1, t2        [out] double[n][3], e_theta and e_phi at the points: t1 x t2 = p
 * Cost: 10 multiply-adds per point, (l, m) and field, and some 30 per point and (l, m) for tables.
 */
void sphere_jets_evaluate(const struct sphere_jets *plan, size_t batch, const double *coefficients,
                          size_t n, const double *points, double *jets, double *t1, double *t2);

/* ---- For points.c, points_jets.c and points_adjoint.c ---------------------------------------- */

/* Constants per (m, l): a_lm, 1 / a_l-1,m, and the pairs of the derivatives. */
enum {
    FACTOR_RECUR,
    FACTOR_BEFORE,
    FACTOR_THETA_DOWN,
    FACTOR_THETA_UP,
    FACTOR_PHI_DOWN,
    FACTOR_PHI_UP,
    FACTORS
};

/* Points between two looks at cancellation: a few milliseconds at degree 127. A multiple of the
   lanes. */
#define POINTS_ASKED ((size_t)64)

static inline bool sphere_points_stop(const struct sphere_points *plan, size_t first)
{
    return first % POINTS_ASKED == 0 && srnf_is_canceled(plan->context);
}

/* Where four points are. Lanes beyond the last point repeat it. */
struct sphere_lanes {
    simd cos_theta, sin_theta, cos_phi, sin_phi;
};
void sphere_lanes_place(struct sphere_lanes *lanes, const double *points, size_t first, size_t n);
/* Fills plan->tables for these points. */
void sphere_lanes_tables(const struct sphere_points *plan, const struct sphere_lanes *lanes);
static inline size_t sphere_points_order(size_t degree, size_t m)
{
    return m * (degree + 1) - (m > 0 ? m * (m - 1) / 2 : 0);
}

#endif
