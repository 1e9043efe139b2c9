/*
 * spline_lanes.h - four points on a spline of the sphere: weights, values with derivatives, loads.
 *
 * To be included where the loops over points are, so that the compiler sees the order of the spline
 * as a constant. Where a point is: theta and phi by arc tangents. Next to a pole, the
 * derivative along phi is a difference of nearly equal nodes divided by sin theta, so that within
 * SPLINE_POLE of one the field is taken at that distance, on the same meridian: value and
 * derivatives are then off by some 1e-8 of their size. On a pole itself the frame is that of phi =
 * 0.
 */
#ifndef SRNF_HARMONICS_SPLINE_LANES_H
#define SRNF_HARMONICS_SPLINE_LANES_H

#include "spline.h"

#define SPLINE_POLE 1e-8 /* radians */

struct spline_place {
    size_t at[SRNF_LANES]; /* first node, in doubles from the origin of the table's memory */
    simd theta[SPLINE_ORDER_MAX], theta_slope[SPLINE_ORDER_MAX];
    simd phi[SPLINE_ORDER_MAX], phi_slope[SPLINE_ORDER_MAX];
    simd cos_theta, sin_theta, cos_phi, sin_phi;
};

SIMD_INLINE void spline_weights(const struct sphere_spline *s, size_t order, const simd *at,
                                bool slopes, simd *weight, simd *slope)
{
    simd t = *at;

    for (size_t j = 0; j < order; j++) {
        simd value = SIMD_SET(s->pieces[j][order - 1]);
        simd derivative = SIMD_SET(0.0);

        for (size_t k = order - 1; k-- > 0;) {
            if (slopes) {
                derivative = derivative * t + value;
            }
            value = value * t + SIMD_SET(s->pieces[j][k]);
        }
        weight[j] = value;
        if (slopes) {
            slope[j] = derivative;
        }
    }
}

/* x, y, z: four unit vectors. slopes: derivatives will be wanted. */
SIMD_INLINE void spline_place(const struct sphere_spline *s, size_t order, const simd p[3],
                              bool slopes, struct spline_place *place)
{
    simd square = p[0] * p[0] + p[1] * p[1];
    simd sine;
    simd theta;
    simd phi;
    simd inverse;
    simd_bits apart; /* from the poles */
    simd_index row;
    simd_index column;
    simd_index last_row = (simd_index){1, 1, 1, 1} * (int32_t)(s->rows - 1);
    simd_index last_column = (simd_index){1, 1, 1, 1} * (int32_t)(s->columns - 1);

    simd_sqrt(&square, &sine);
    simd_atan2(&sine, &p[2], &theta);
    theta = SIMD_MAX(theta, SIMD_SET(SPLINE_POLE));
    theta = SIMD_MIN(theta, SIMD_SET(SRNF_PI - SPLINE_POLE));
    simd_atan2(&p[1], &p[0], &phi);
    phi += SIMD_SELECT(phi < SIMD_SET(0.0), SIMD_SET(2.0 * SRNF_PI), SIMD_SET(0.0));
    phi = SIMD_MAX(phi, SIMD_SET(0.0)); /* as above, of a point that is none */
    theta *= SIMD_SET(s->per_radian);
    phi *= SIMD_SET(s->per_radian);
    row = __builtin_convertvector(theta, simd_index); /* towards 0, and none is negative */
    column = __builtin_convertvector(phi, simd_index);
    row = (row & (row < last_row)) | (last_row & ~(row < last_row));
    column = (column & (column < last_column)) | (last_column & ~(column < last_column));
    for (size_t k = 0; k < SRNF_LANES; k++) {
        place->at[k] = ((size_t)row[k] * s->stride + (size_t)column[k]) * SPLINE_WIDTH;
    }
    theta -= __builtin_convertvector(row, simd);
    phi -= __builtin_convertvector(column, simd);
    spline_weights(s, order, &theta, slopes, place->theta, place->theta_slope);
    spline_weights(s, order, &phi, slopes, place->phi, place->phi_slope);
    apart = sine > SIMD_SET(0.0);
    inverse = SIMD_SET(1.0) / SIMD_SELECT(apart, sine, SIMD_SET(1.0));
    place->cos_theta = p[2];
    place->sin_theta = sine;
    place->cos_phi = SIMD_SELECT(apart, p[0] * inverse, SIMD_SET(1.0));
    place->sin_phi = SIMD_SELECT(apart, p[1] * inverse, SIMD_SET(0.0));
    if (slopes) { /* per radian, and along the unit vectors */
        simd scale = SIMD_SET(s->per_radian) / SIMD_MAX(sine, SIMD_SET(SPLINE_POLE));

        for (size_t j = 0; j < order; j++) {
            place->theta_slope[j] *= SIMD_SET(s->per_radian);
            place->phi_slope[j] *= scale;
        }
    }
}

/* e_theta = (a[0], a[1], a[2]), e_phi = (b[0], b[1], 0) at the points. */
SIMD_INLINE void spline_frame(const struct spline_place *place, simd a[3], simd b[2])
{
    a[0] = place->cos_theta * place->cos_phi;
    a[1] = place->cos_theta * place->sin_phi;
    a[2] = -place->sin_theta;
    b[0] = -place->sin_phi;
    b[1] = place->cos_phi;
}

/* First node that lane k depends on. */
SIMD_INLINE double *spline_first(const struct sphere_spline *s, size_t order,
                                 const struct spline_place *place, size_t k)
{
    return s->origin + place->at[k] - (order / 2 - 1) * (s->stride + 1) * SPLINE_WIDTH;
}

/* Some rows of the nodes at lane k, side by side so that a weight serves all of them. */
SIMD_INLINE void spline_gather_rows(const double *node, size_t stride, size_t order, size_t rows,
                                    const struct spline_place *place, size_t first, size_t k,
                                    simd *value, simd *along, simd *across)
{
    simd sum[SRNF_LANES];
    simd slope[SRNF_LANES];

    for (size_t i = 0; i < rows; i++) {
        sum[i] = slope[i] = SIMD_SET(0.0);
    }
    for (size_t j = 0; j < order; j++) {
        simd weight = SIMD_SET(place->phi[j][k]);
        simd derivative = SIMD_SET(place->phi_slope[j][k]);

        for (size_t i = 0; i < rows; i++) {
            simd v;

            SIMD_LOAD(v, node + i * stride + j * SPLINE_WIDTH);
            sum[i] += weight * v;
            slope[i] += derivative * v;
        }
    }
    for (size_t i = 0; i < rows; i++) {
        simd weight = SIMD_SET(place->theta[first + i][k]);

        *value += weight * sum[i];
        *along += SIMD_SET(place->theta_slope[first + i][k]) * sum[i];
        *across += weight * slope[i];
    }
}

/* The four components at the point of lane k, and along e_theta and e_phi. */
SIMD_INLINE void spline_gather(const struct sphere_spline *s, size_t order,
                               const struct spline_place *place, size_t k, simd *value, simd *along,
                               simd *across)
{
    const double *node = spline_first(s, order, place, k);
    size_t stride = s->stride * SPLINE_WIDTH;
    size_t rows = order % SRNF_LANES == 0 ? SRNF_LANES : 3;

    *value = *along = *across = SIMD_SET(0.0);
    for (size_t i = 0; i < order; i += rows) {
        spline_gather_rows(node + i * stride, stride, order, rows, place, i, k, value, along,
                           across);
    }
}

/* The transpose of the values. */
SIMD_INLINE void spline_spread(const struct sphere_spline *s, size_t order,
                               const struct spline_place *place, size_t k, const simd *load)
{
    double *node = spline_first(s, order, place, k);

    for (size_t i = 0; i < order; i++, node += s->stride * SPLINE_WIDTH) {
        simd part = *load * SIMD_SET(place->theta[i][k]);

        for (size_t j = 0; j < order; j++) {
            simd v;

            SIMD_LOAD(v, node + j * SPLINE_WIDTH);
            v += part * SIMD_SET(place->phi[j][k]);
            SIMD_STORE(node + j * SPLINE_WIDTH, v);
        }
    }
}

/* Components 0, 1, 2 of four points, one a vector, as three vectors of a component each. */
SIMD_INLINE void spline_turn(const simd in[SRNF_LANES], simd out[3])
{
    simd low = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6); /* components 0 and 2 */
    simd low_next = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6);
    simd high = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7);
    simd high_next = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);

    out[0] = __builtin_shufflevector(low, low_next, 0, 1, 4, 5);
    out[1] = __builtin_shufflevector(high, high_next, 0, 1, 4, 5);
    out[2] = __builtin_shufflevector(low, low_next, 2, 3, 6, 7);
}

#endif
