/*
 * lanes.h - square root, arc tangent and logarithm of four numbers at once.
 *
 * For loops over points that go four to a vector (simd.h): calls of libm, one number at a time,
 * would take half of their time. Errors are a few units in the last place, which the tests compare
 * with libm; the same operations run on every instruction set.
 */
#ifndef SRNF_HARMONICS_LANES_H
#define SRNF_HARMONICS_LANES_H

#include "simd.h"

#include <stdint.h>

typedef int64_t simd_bits __attribute__((vector_size(32)));
typedef int32_t simd_index __attribute__((vector_size(16)));

/* Lanes of a where the mask is set (a comparison of vectors), of b elsewhere. */
#define SIMD_SELECT(mask, a, b) ((simd)(((mask) & (simd_bits)(a)) | (~(mask) & (simd_bits)(b))))
#define SIMD_MAX(a, b) SIMD_SELECT((a) > (b), a, b)
#define SIMD_MIN(a, b) SIMD_SELECT((a) < (b), a, b)
#define SIMD_ABS(a) ((simd)((simd_bits)(a)&INT64_MAX))
#define SIMD_SUM(a) (((a)[0] + (a)[1]) + ((a)[2] + (a)[3]))

SIMD_INLINE void simd_sqrt(const simd *x, simd *root)
{
    double lanes[SRNF_LANES];

    for (size_t k = 0; k < SRNF_LANES; k++) {
        lanes[k] = __builtin_sqrt((*x)[k]);
    }
    SIMD_LOAD(*root, lanes);
}

/* The angle of (x, y) in [-pi, pi]; of (0, 0): 0. */
SIMD_INLINE void simd_atan2(const simd *y, const simd *x, simd *angle)
{
    /* (atan t / t - 1) / t^2 in t^2 up to tan^2(pi / 8), interpolated at Chebyshev's nodes. */
    static const double series[] = {
        0.016284375050043394444, -0.034569315063326089813, 0.045515447340221616522,
        -0.05230443640686947707, 0.058789275544738067649,  -0.066664247602005201418,
        0.076922963680422971183, -0.090909087532591129423, 0.11111111105150587894,
        -0.14285714285659777756, 0.19999999999999804328,   -0.33333333333333333217};
    simd a = SIMD_ABS(*x);
    simd b = SIMD_ABS(*y);
    simd large = SIMD_MAX(a, b);
    simd small = SIMD_MIN(a, b);
    /* Beyond tan(pi / 8): atan t = pi / 4 + atan((t - 1) / (t + 1)). */
    simd_bits steep = small > SIMD_SET(0.41421356237309503) * large;
    simd up = SIMD_SELECT(steep, small - large, small);
    simd down = SIMD_SELECT(steep, small + large, large);
    simd t = up / SIMD_SELECT(down > SIMD_SET(0.0), down, SIMD_SET(1.0));
    simd square = t * t;
    simd p = SIMD_SET(series[0]);

    for (size_t k = 1; k < sizeof series / sizeof series[0]; k++) {
        p = p * square + SIMD_SET(series[k]);
    }
    p = t + t * square * p;
    p += SIMD_SELECT(steep, SIMD_SET(0.78539816339744831), SIMD_SET(0.0));
    p = SIMD_SELECT(b > a, SIMD_SET(1.5707963267948966) - p, p);
    p = SIMD_SELECT(*x < SIMD_SET(0.0), SIMD_SET(3.1415926535897931) - p, p);
    *angle = SIMD_SELECT(*y < SIMD_SET(0.0), -p, p);
}

/* The natural logarithm of positive normal numbers; of others something that is finite or not. */
SIMD_INLINE void simd_log(const simd *x, simd *logarithm)
{
    const int64_t root_half = 0x3FE6A09E667F3BCD; /* the bits of sqrt(1 / 2) */
    const int64_t one = 0x3FF0000000000000;
    const int64_t shift = 0x4330000000000000; /* the bits of 2^52 */
    simd_bits bits = (simd_bits)*x;
    /* x = 2^e m, m in [sqrt(1 / 2), sqrt 2); e + 1023 is in the low bits of `exponent`. */
    simd_bits exponent =
        (simd_bits)((uint64_t __attribute__((vector_size(32))))(bits + (one - root_half)) >> 52);
    simd e = (simd)(exponent | shift) - SIMD_SET(0x1p52 + 1023.0);
    simd m = (simd)(bits - ((exponent << 52) - one));
    simd s = (m - SIMD_SET(1.0)) / (m + SIMD_SET(1.0));
    simd square = s * s;
    simd p = SIMD_SET(1.0 / 21.0);

    for (int k = 19; k > 1; k -= 2) {
        p = p * square + SIMD_SET(1.0 / (double)k);
    }
    *logarithm = (e * SIMD_SET(1.9082149292705877e-10) + SIMD_SET(2.0) * s * square * p) +
                 (SIMD_SET(2.0) * s + e * SIMD_SET(0.693147180369123816490));
}

/* cos t and sin t / t from u = t^2, to rounding for t up to pi. */
SIMD_INLINE void simd_cos_sinc(const simd *u, simd *cosine, simd *sinc)
{
    simd c = SIMD_SET(1.0);
    simd s = SIMD_SET(1.0);

    for (int k = 13; k > 0; k--) {
        c = SIMD_SET(1.0) - *u * SIMD_SET(1.0 / (double)((2 * k - 1) * (2 * k))) * c;
        s = SIMD_SET(1.0) - *u * SIMD_SET(1.0 / (double)((2 * k) * (2 * k + 1))) * s;
    }
    *cosine = c;
    *sinc = s;
}

#endif
