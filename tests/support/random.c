/*
 * random.c - xoshiro256++ seeded by splitmix64, both by D. Blackman and S. Vigna (2018), written
 * from their published definitions; normal numbers by the polar method of Box, Muller and
 * Marsaglia.
 *
 * Only the basic operations, sqrt and log are used, so that the numbers differ between machines by
 * no more than the rounding of log.
 */
#include "support/random.h"

#include <math.h>

static uint64_t rotate_left(uint64_t x, unsigned bits)
{
    return (x << bits) | (x >> (64 - bits));
}

struct test_random test_random_seed(uint64_t seed)
{
    struct test_random random;

    for (size_t i = 0; i < 4; i++) {
        uint64_t z = seed += UINT64_C(0x9e3779b97f4a7c15);

        z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
        random.state[i] = z ^ (z >> 31);
    }
    return random;
}

uint64_t test_random_bits(struct test_random *random)
{
    uint64_t *s = random->state;
    uint64_t result = rotate_left(s[0] + s[3], 23) + s[0];
    uint64_t t = s[1] << 17;

    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate_left(s[3], 45);
    return result;
}

size_t test_random_below(struct test_random *random, size_t bound)
{
    return (size_t)(test_random_bits(random) % bound);
}

double test_random_uniform(struct test_random *random, double low, double high)
{
    return low + (high - low) * ((double)(test_random_bits(random) >> 11) * 0x1p-53);
}

double test_random_normal(struct test_random *random)
{
    double x;
    double y;
    double s;

    /* Each round leaves the loop with probability pi / 4. */
    do {
        x = test_random_uniform(random, -1.0, 1.0);
        y = test_random_uniform(random, -1.0, 1.0);
        s = x * x + y * y;
    } while (s >= 1.0 || s <= 0.0);
    return x * sqrt(-2.0 * log(s) / s);
}

void test_random_normals(struct test_random *random, size_t n, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = test_random_normal(random);
    }
}

void test_random_direction(struct test_random *random, double out[3])
{
    double length;

    do {
        test_random_normals(random, 3, out);
        length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    } while (length < 1e-3);
    for (size_t i = 0; i < 3; i++) {
        out[i] /= length;
    }
}
