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

static double recurrence(size_t l, size_t m)
{
    double dl = (double)l;
    double dm = (double)m;

    return sqrt((4.0 * dl * dl - 1.0) / (dl * dl - dm * dm));
}

void sphere_legendre(size_t degree, double cosine, double sine, double *p)
{
    double diagonal = sqrt(0.25 / SRNF_PI);

    for (size_t m = 0; m <= degree; m++) {
        double before = 0.0;
        double inverse = 0.0; /* 1 / a_l-1,m, which is 0 for l = m + 1 */

        if (m > 0) {
            diagonal *= sqrt((2.0 * (double)m + 1.0) / (2.0 * (double)m)) * sine;
        }
        p[triangle(m, m)] = diagonal;
        for (size_t l = m + 1; l <= degree; l++) {
            double a = recurrence(l, m);
            double current = p[triangle(l - 1, m)];

            p[triangle(l, m)] = a * (cosine * current - before * inverse);
            before = current;
            inverse = 1.0 / a;
        }
    }
}

void sphere_legendre_gradient(const double *p, size_t l, size_t m, double *d_theta,
                              double *m_over_sin)
{
    double dl = (double)l;
    double dm = (double)m;
    double up = m < l ? p[triangle(l, m + 1)] : 0.0;
    double up_before = m + 1 < l ? p[triangle(l - 1, m + 1)] : 0.0;

    if (m == 0) {
        *d_theta = -sqrt(dl * (dl + 1.0)) * up;
        *m_over_sin = 0.0;
        return;
    }
    *d_theta = sqrt(0.5) * (sqrt((dl + dm) * (dl - dm + 1.0)) * p[triangle(l, m - 1)] -
                            sqrt((dl - dm) * (dl + dm + 1.0)) * up);
    *m_over_sin = sqrt(0.5 * (2.0 * dl + 1.0) / (2.0 * dl - 1.0)) *
                  (sqrt((dl + dm) * (dl + dm - 1.0)) * p[triangle(l - 1, m - 1)] +
                   sqrt((dl - dm) * (dl - dm - 1.0)) * up_before);
}
