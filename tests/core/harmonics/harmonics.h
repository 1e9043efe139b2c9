/*
 * harmonics.h - the basis of degree 0 to 3 as polynomials in x, y, z, and its gradient: the
 * definition that core/harmonics is held against.
 *
 * Y_lm = sqrt(a / (b pi)) sum_k c_k x^i y^j z^k, the real orthonormal harmonics without
 * Condon-Shortley sign. The tangential gradient is the gradient in space less its part along e.
 */
#ifndef TESTS_SPHERE_HARMONICS_H
#define TESTS_SPHERE_HARMONICS_H

#include <math.h>
#include <stddef.h>

struct harmonic_term {
    double factor;
    int x, y, z;
};

struct harmonic {
    int l, m;
    double numerator, denominator; /* of the square of the norm, without pi */
    size_t n_terms;
    struct harmonic_term terms[2];
};

static const struct harmonic harmonics[] = {
    {0, 0, 1, 4, 1, {{1, 0, 0, 0}}},
    {1, -1, 3, 4, 1, {{1, 0, 1, 0}}},
    {1, 0, 3, 4, 1, {{1, 0, 0, 1}}},
    {1, 1, 3, 4, 1, {{1, 1, 0, 0}}},
    {2, -2, 15, 4, 1, {{1, 1, 1, 0}}},
    {2, -1, 15, 4, 1, {{1, 0, 1, 1}}},
    {2, 0, 5, 16, 2, {{3, 0, 0, 2}, {-1, 0, 0, 0}}},
    {2, 1, 15, 4, 1, {{1, 1, 0, 1}}},
    {2, 2, 15, 16, 2, {{1, 2, 0, 0}, {-1, 0, 2, 0}}},
    {3, -3, 35, 32, 2, {{3, 2, 1, 0}, {-1, 0, 3, 0}}},
    {3, -2, 105, 4, 1, {{1, 1, 1, 1}}},
    {3, -1, 21, 32, 2, {{5, 0, 1, 2}, {-1, 0, 1, 0}}},
    {3, 0, 7, 16, 2, {{5, 0, 0, 3}, {-3, 0, 0, 1}}},
    {3, 1, 21, 32, 2, {{5, 1, 0, 2}, {-1, 1, 0, 0}}},
    {3, 2, 105, 16, 2, {{1, 2, 0, 1}, {-1, 0, 2, 1}}},
    {3, 3, 35, 32, 2, {{1, 3, 0, 0}, {-3, 1, 2, 0}}},
};
#define HARMONICS (sizeof harmonics / sizeof harmonics[0])

static inline double harmonic_power(double x, int n)
{
    double result = 1.0;

    for (int i = 0; i < n; i++) {
        result *= x;
    }
    return result;
}

/* Value and tangential gradient at a unit vector. */
static inline double harmonic_at(const struct harmonic *harmonic, const double e[3],
                                 double gradient[3])
{
    double norm = sqrt(harmonic->numerator / (harmonic->denominator * 3.14159265358979323846));
    double value = 0.0;
    double radial;
    double space[3] = {0.0, 0.0, 0.0};

    for (size_t t = 0; t < harmonic->n_terms; t++) {
        const struct harmonic_term *term = &harmonic->terms[t];
        double x = harmonic_power(e[0], term->x);
        double y = harmonic_power(e[1], term->y);
        double z = harmonic_power(e[2], term->z);

        value += term->factor * x * y * z;
        space[0] += term->factor * term->x * harmonic_power(e[0], term->x - 1) * y * z;
        space[1] += term->factor * term->y * harmonic_power(e[1], term->y - 1) * x * z;
        space[2] += term->factor * term->z * harmonic_power(e[2], term->z - 1) * x * y;
    }
    radial = space[0] * e[0] + space[1] * e[1] + space[2] * e[2];
    for (size_t i = 0; i < 3; i++) {
        gradient[i] = norm * (space[i] - radial * e[i]);
    }
    return norm * value;
}

#endif
