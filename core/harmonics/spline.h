/*
 * spline.h - fields on the sphere tabulated as splines.
 *
 * A smooth field becomes a function of period 2 pi in both angles, f(-theta, phi) = f(theta, phi +
 * pi), once its components are Cartesian. It is tabulated at theta_i = pi i / rows, i = 0 .. rows,
 * both poles among them, and phi_k = pi k / rows, as B-splines of an even number of nodes; four
 * components lie together in a node. The values are first turned into the coefficients of the
 * interpolating spline by a cyclic recursive filter (M. Unser, A. Aldroubi, M. Eden, "B-spline
 * signal processing", IEEE Trans. Signal Processing 41, 1993). For a field of degree K the relative
 * error is about (K / (2 rows))^order. One evaluation of a field costs order^2 multiply-adds,
 * whatever its degree.
 *
 * The transpose is here too: loads spread over the table (spline_lanes.h) are turned into what the
 * transposed harmonic transform wants.
 */
#ifndef SRNF_HARMONICS_SPLINE_H
#define SRNF_HARMONICS_SPLINE_H

#include "lanes.h"

#include "internal.h"

#define SPLINE_ORDER_MAX 12
#define SPLINE_WIDTH SRNF_LANES /* components of a node */

struct sphere_spline {
    size_t order;            /* nodes that a point depends on in each direction: 4, 6, 8 or 12 */
    size_t rows, columns;    /* intervals from pole to pole; columns = 2 rows */
    size_t halo, stride;     /* nodes around the table; nodes of one row with its halo */
    double per_radian;       /* rows / pi */
    double *memory, *origin; /* origin: node (0, 0) */
    double *lines;           /* scratch of the filter */
    double pieces[SPLINE_ORDER_MAX][SPLINE_ORDER_MAX]; /* [node][power of t] */
};

/* rows: a multiple of 4, at least order. */
SRNF_CHECKED int sphere_spline_create(struct sphere_spline *spline, size_t order, size_t rows);
void sphere_spline_clear(struct sphere_spline *spline);
static inline double *sphere_spline_node(const struct sphere_spline *s, size_t row, size_t column)
{
    return s->origin + (row * s->stride + column) * SPLINE_WIDTH;
}
/* All nodes zero, the halo too. */
void sphere_spline_zero(struct sphere_spline *spline);
/* From values at the nodes (0 .. rows, 0 .. columns - 1) to coefficients, halo included. */
void sphere_spline_filter(struct sphere_spline *spline);
/* The transpose of that. */
void sphere_spline_fold(struct sphere_spline *spline);

#endif
