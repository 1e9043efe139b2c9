/*
 * sample.c - random scores of a model: independent normal numbers times the standard deviations.
 *
 * The generator is counter-based: Philox 4x32 with ten rounds (J. Salmon, M. Moraes, R. Dror, D.
 * Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011), keyed by the seed. The counter is
 * made of the index of the sample (64 bits), the pair of components (32) and the attempt (32), so
 * sample i, component k is the same number however many samples or components are asked for, in
 * whatever order.
 *
 * The 128 bits of one counter are two numbers u, v in (-1, 1), odd multiples of 2^-53; Marsaglia's
 * polar method turns them into two normal numbers u g and v g, g = sqrt(-2 log(s) / s), s = u^2 +
 * v^2, where 0 < s < 1, and takes the next attempt where not (one in five).
 *
 * The same bits on every machine: integers, IEEE 754 additions, multiplications, divisions and
 * square roots, not contracted, and a logarithm made of them (that of the C library may differ in
 * the last bit from one version to the next).
 */
#include "stats.h"

#include <math.h>

#define ROUNDS 10
#define MULTIPLIER_A UINT32_C(0xD2511F53)
#define MULTIPLIER_B UINT32_C(0xCD9E8D57)
#define WEYL_A UINT32_C(0x9E3779B9)
#define WEYL_B UINT32_C(0xBB67AE85)

/* The chance that so many attempts all fail is below 1e-40; the pair is then (0, 0). */
#define ATTEMPTS 64

#define LOG_2 0.69314718055994530942
#define ROOT_HALF 0.70710678118654752440
#define LOG_TERMS 11 /* z^22 / 23 < 1e-18 for |z| <= .1716 */

void stats_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4])
{
    uint32_t x[4] = {counter[0], counter[1], counter[2], counter[3]};
    uint32_t a = key[0];
    uint32_t b = key[1];

    for (int round = 0; round < ROUNDS; round++) {
        uint64_t first = (uint64_t)MULTIPLIER_A * x[0];
        uint64_t second = (uint64_t)MULTIPLIER_B * x[2];

        x[0] = (uint32_t)(second >> 32) ^ x[1] ^ a;
        x[1] = (uint32_t)second;
        x[2] = (uint32_t)(first >> 32) ^ x[3] ^ b;
        x[3] = (uint32_t)first;
        a += WEYL_A;
        b += WEYL_B;
    }
    for (int i = 0; i < 4; i++) {
        out[i] = x[i];
    }
}

/* x = m 2^e with m in [sqrt(1/2), sqrt(2)); log m = 2 artanh z, z = (m - 1) / (m + 1). */
double stats_log(double x)
{
    int exponent;
    double m = frexp(x, &exponent);
    double z;
    double sum = 0.0;

    if (m < ROOT_HALF) {
        m *= 2.0;
        exponent--;
    }
    z = (m - 1.0) / (m + 1.0);
    for (int k = LOG_TERMS; k >= 0; k--) {
        sum = sum * (z * z) + 1.0 / (2.0 * k + 1.0);
    }
    return (double)exponent * LOG_2 + 2.0 * z * sum;
}

/* In (-1, 1): an odd multiple of 2^-53. */
static double symmetric_uniform(uint32_t high, uint32_t low)
{
    uint64_t bits = ((uint64_t)high << 32 | low) >> 11; /* 53 of them */

    return ((double)bits - 0x1p52 + 0.5) * 0x1p-52;
}

static void normal_pair(uint64_t seed, uint64_t sample, uint32_t pair, double out[2])
{
    uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};

    out[0] = out[1] = 0.0;
    for (uint32_t attempt = 0; attempt < ATTEMPTS; attempt++) {
        uint32_t counter[4] = {(uint32_t)sample, (uint32_t)(sample >> 32), pair, attempt};
        uint32_t bits[4];
        double u;
        double v;
        double s;

        stats_philox(counter, key, bits);
        u = symmetric_uniform(bits[0], bits[1]);
        v = symmetric_uniform(bits[2], bits[3]);
        s = u * u + v * v;
        if (s > 0.0 && s < 1.0) {
            double g = sqrt(-2.0 * stats_log(s) / s);

            out[0] = u * g;
            out[1] = v * g;
            return;
        }
    }
}

void srnf_pca_sample(const struct srnf_pca *pca, uint64_t seed, size_t count, size_t components,
                     double *scores)
{
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < components; k += 2) {
            double pair[2];

            normal_pair(seed, i, (uint32_t)(k / 2), pair);
            for (size_t j = k; j < k + 2 && j < components; j++) {
                double deviation = j < pca->components ? sqrt(pca->eigenvalues[j]) : 0.0;

                scores[i * components + j] = deviation * pair[j - k];
            }
        }
    }
}
