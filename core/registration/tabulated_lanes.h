/*
 * tabulated_lanes.h - exp(w) of a tabulated field at four points, with its derivative; the formulae
 * are those of step.c.
 *
 * To be included where the loops over points are, as spline_lanes.h.
 */
#ifndef SRNF_REGISTRATION_TABULATED_LANES_H
#define SRNF_REGISTRATION_TABULATED_LANES_H

#include "harmonics/spline_lanes.h"

#define LONG_STEP2 (SRNF_PI * SRNF_PI) /* squared: half a great circle */

/* Three components and their derivatives, four points. */
SIMD_INLINE void gather(const struct sphere_spline *s, size_t order,
                        const struct spline_place *place, simd value[3], simd along[3],
                        simd across[3])
{
    simd v[SRNF_LANES], v_1[SRNF_LANES], v_2[SRNF_LANES];

    for (size_t k = 0; k < SRNF_LANES; k++) {
        spline_gather(s, order, place, k, &v[k], &v_1[k], &v_2[k]);
    }
    spline_turn(v, value);
    spline_turn(v_1, along);
    spline_turn(v_2, across);
}

/* The frame is u = w / |w| = c e_theta + s e_phi and p x u; d is the derivative of exp(w) from it
   to that of the image, as in struct step of step.c. */
struct four_steps {
    simd a[3], b[2];    /* e_theta, and x and y of e_phi */
    simd along, across; /* w in that frame */
    simd square, cosine, sinc, c, s;
    simd d00, d01, d10, d11;
    simd jacobian;
    simd sin_theta;
};

SIMD_INLINE void step_four(const struct sphere_spline *field, size_t order, const simd p[3],
                           struct four_steps *f)
{
    struct spline_place place;
    simd w[3], w_1[3], w_2[3];
    simd a11, a12, a21, a22, length;

    spline_place(field, order, p, true, &place);
    gather(field, order, &place, w, w_1, w_2);
    spline_frame(&place, f->a, f->b);
    f->sin_theta = place.sin_theta;
    f->along = f->a[0] * w[0] + f->a[1] * w[1] + f->a[2] * w[2];
    f->across = f->b[0] * w[0] + f->b[1] * w[1];
    a11 = f->a[0] * w_1[0] + f->a[1] * w_1[1] + f->a[2] * w_1[2];
    a21 = f->b[0] * w_1[0] + f->b[1] * w_1[1];
    a12 = f->a[0] * w_2[0] + f->a[1] * w_2[1] + f->a[2] * w_2[2];
    a22 = f->b[0] * w_2[0] + f->b[1] * w_2[1];
    f->square = f->along * f->along + f->across * f->across;
    simd_cos_sinc(&f->square, &f->cosine, &f->sinc);
    length = SIMD_MAX(f->square, SIMD_SET(1e-280));
    simd_sqrt(&length, &length);
    f->c = f->along / length;
    f->s = f->across / length;
    f->d00 = SIMD_SET(1.0) + f->c * f->c * a11 + f->c * f->s * (a12 + a21) + f->s * f->s * a22;
    f->d01 = f->c * f->c * a12 + f->c * f->s * (a22 - a11) - f->s * f->s * a21;
    f->d10 = f->sinc * (f->c * f->c * a21 + f->c * f->s * (a22 - a11) - f->s * f->s * a12);
    f->d11 =
        f->cosine + f->sinc * (f->c * f->c * a22 - f->c * f->s * (a12 + a21) + f->s * f->s * a11);
    f->jacobian = f->d00 * f->d11 - f->d01 * f->d10;
}

SIMD_INLINE void scale_to_unit(simd p[3])
{
    simd norm = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];

    simd_sqrt(&norm, &norm);
    for (size_t k = 0; k < 3; k++) {
        p[k] /= norm;
    }
}

/* p <- exp(w) of p */
SIMD_INLINE void step_image(const struct four_steps *f, simd p[3])
{
    p[0] = f->cosine * p[0] + f->sinc * (f->along * f->a[0] + f->across * f->b[0]);
    p[1] = f->cosine * p[1] + f->sinc * (f->along * f->a[1] + f->across * f->b[1]);
    p[2] = f->cosine * p[2] + f->sinc * f->along * f->a[2];
    scale_to_unit(p);
}

#endif
