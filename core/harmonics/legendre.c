/*
 * legendre.c - normalized associated Legendre functions and what the gradient needs of them.
 *
 *   P_mm = sqrt((2m + 1) / (2m)) sin(theta) P_m-1,m-1,   P_00 = 1 / sqrt(4 pi)
 *   P_lm = a_lm (cos(theta) P_l-1,m - P_l-2,m / a_l-1,m),   a_lm = sqrt((4 l^2 - 1) / (l^2 - m^2))
 *   dP_lm/dtheta    = (sqrt((l+m)(l-m+1)) P_l,m-1 - sqrt((l-m)(l+m+1)) P_l,m+1) / 2,  dP_l0 =
 *   -sqrt(l(l+1)) P_l1 m P_lm / sin    = sqrt((2l+1) / (2l-1)) (sqrt((l+m)(l+m-1)) P_l-1,m-1 +
 *   sqrt((l-m)(l-m-1)) P_l-1,m+1) / 2
 *
 * No Condon-Shortley sign. The recurrences in l at fixed m are stable, and neither derivative
 * divides by the sine. Source: NIST Digital Library of Mathematical Functions, 14.10, rewritten for
 * the normalized functions.
 */
#include "harmonics.h"

#include <math.h>

static size_t triangle(size_t l, size_t m)
{
    return l * (l + 1) / 2 + m;
}

void sphere_legendre_factors(size_t degree, double *factors)
{
    for (size_t l = 0; l <= degree; l++) {
        for (size_t m = 0; m <= l; m++) {
            double *f = factors + triangle(l, m) * LEGENDRE_FACTORS;
            double dl = (double)l;
            double dm = (double)m;

            /* From P_l-1,m, or on the diagonal from P_m-1,m-1; 1 / a_l-1,m is 0 for l = m + 1. */
            f[LEGENDRE_RECUR] = l > m   ? sqrt((4.0 * dl * dl - 1.0) / (dl * dl - dm * dm))
                                : m > 0 ? sqrt((2.0 * dm + 1.0) / (2.0 * dm))
                                        : 0.0;
            f[LEGENDRE_BEFORE] =
                l > m + 1 ? 1.0 / factors[triangle(l - 1, m) * LEGENDRE_FACTORS + LEGENDRE_RECUR]
                          : 0.0;
            f[LEGENDRE_THETA_DOWN] = sqrt((dl + dm) * (dl - dm + 1.0));
            f[LEGENDRE_THETA_UP] =
                m > 0 ? sqrt((dl - dm) * (dl + dm + 1.0)) : sqrt(dl * (dl + 1.0));
            f[LEGENDRE_PHI_SCALE] = l > 0 ? sqrt(0.5 * (2.0 * dl + 1.0) / (2.0 * dl - 1.0)) : 0.0;
            f[LEGENDRE_PHI_DOWN] = m > 0 ? sqrt((dl + dm) * (dl + dm - 1.0)) : 0.0;
            f[LEGENDRE_PHI_UP] = m + 1 < l ? sqrt((dl - dm) * (dl - dm - 1.0)) : 0.0;
        }
    }
}

void sphere_legendre(size_t degree, const double *factors, double cosine, double sine, double *p)
{
    double diagonal = sqrt(0.25 / SRNF_PI);

    for (size_t m = 0; m <= degree; m++) {
        double before = 0.0;

        if (m > 0) {
            diagonal *= factors[triangle(m, m) * LEGENDRE_FACTORS + LEGENDRE_RECUR] * sine;
        }
        p[triangle(m, m)] = diagonal;
        for (size_t l = m + 1; l <= degree; l++) {
            const double *f = factors + triangle(l, m) * LEGENDRE_FACTORS;
            double current = p[triangle(l - 1, m)];

            p[triangle(l, m)] =
                f[LEGENDRE_RECUR] * (cosine * current - before * f[LEGENDRE_BEFORE]);
            before = current;
        }
    }
}

void sphere_legendre_gradient(const double *factors, const double *p, size_t l, size_t m,
                              double *d_theta, double *m_over_sin)
{
    const double *f = factors + triangle(l, m) * LEGENDRE_FACTORS;
    double up = m < l ? p[triangle(l, m + 1)] : 0.0;
    double up_before = m + 1 < l ? p[triangle(l - 1, m + 1)] : 0.0;

    if (m == 0) {
        *d_theta = -f[LEGENDRE_THETA_UP] * up;
        *m_over_sin = 0.0;
        return;
    }
    *d_theta =
        sqrt(0.5) * (f[LEGENDRE_THETA_DOWN] * p[triangle(l, m - 1)] - f[LEGENDRE_THETA_UP] * up);
    *m_over_sin = f[LEGENDRE_PHI_SCALE] * (f[LEGENDRE_PHI_DOWN] * p[triangle(l - 1, m - 1)] +
                                           f[LEGENDRE_PHI_UP] * up_before);
}
