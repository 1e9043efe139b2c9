/*
 * gauss.c - rows of the grids: Gauss-Legendre and equiangular (Clenshaw-Curtis) nodes and weights.
 *
 * Gauss-Legendre nodes are the zeros of P_n, found by Newton's method from Tricomi's estimate, the
 * weights are 2 / ((1 - x^2) P_n'(x)^2); both in extended precision, so that they are right to the
 * last bit or two. Symmetric nodes are computed once, which makes north and south exact mirror
 * images, as the parity of the transform requires. Cost O(n^2).
 *
 * Equiangular rows theta_i = pi i / (n - 1) carry the Clenshaw-Curtis weights, exact for degree n -
 * 1: the closed sum of J. Waldvogel, "Fast construction of the Fejer and Clenshaw-Curtis quadrature
 * rules", BIT 2006, evaluated directly in O(n^2).
 */
#include "harmonics.h"

#include <math.h>

#define PI_L 3.14159265358979323846264338327950288L

/* P_n(x) and P_n'(x) by the three-term recurrence. */
static void legendre_polynomial(size_t n, long double x, long double *value,
                                long double *derivative)
{
    long double before = 1.0L;
    long double p = x;

    for (size_t k = 2; k <= n; k++) {
        long double next =
            ((long double)(2 * k - 1) * x * p - (long double)(k - 1) * before) / (long double)k;

        before = p;
        p = next;
    }
    *value = p;
    *derivative = (long double)n * (before - x * p) / (1.0L - x * x);
}

void sphere_gauss_legendre(size_t n, double *theta, double *cosine, double *sine, double *weight)
{
    for (size_t i = 0; i < (n + 1) / 2; i++) {
        long double t = PI_L * ((long double)(4 * i) + 3.0L) / ((long double)(4 * n) + 2.0L);
        long double x = cosl(t);
        long double p;
        long double dp;
        size_t mirror = n - 1 - i;

        if (i == mirror) {
            x = 0.0L;
        }
        /* Newton doubles the digits; six steps are more than any n needs, and a fixed count keeps
           the nodes independent of rounding in a stopping test. */
        for (int step = 0; step < 6 && i != mirror; step++) {
            legendre_polynomial(n, x, &p, &dp);
            x -= p / dp;
        }
        if (n == 1) {
            dp = 1.0L;
        } else {
            legendre_polynomial(n, x, &p, &dp);
        }
        cosine[i] = (double)x;
        sine[i] = (double)sqrtl((1.0L - x) * (1.0L + x));
        theta[i] = (double)acosl(x);
        weight[i] = (double)(2.0L / ((1.0L - x * x) * dp * dp));
        cosine[mirror] = -cosine[i];
        sine[mirror] = sine[i];
        theta[mirror] = (double)(PI_L - acosl(x));
        weight[mirror] = weight[i];
    }
}

/* cos(2 pi r / intervals) for all r below intervals, and what it counts for k = 1 and up. */
static void fill_terms(size_t intervals, long double *turn, long double *part)
{
    for (size_t r = 0; r < intervals; r++) {
        turn[r] = cosl(2.0L * PI_L * (long double)r / (long double)intervals);
    }
    for (size_t k = 1; k <= intervals / 2; k++) {
        part[k] = (2 * k == intervals ? 1.0L : 2.0L) / (long double)(4 * k * k - 1);
    }
}

void sphere_clenshaw_curtis(size_t n, long double *scratch, double *theta, double *cosine,
                            double *sine, double *weight)
{
    size_t intervals = n - 1;
    long double *turn = scratch, *part = scratch + n;

    fill_terms(intervals, turn, part);
    for (size_t i = 0; i < n; i++) {
        size_t north = i <= intervals - i ? i : intervals - i;
        size_t at = 0;
        long double t = PI_L * (long double)north / (long double)intervals;
        long double sum = 1.0L;
        long double c = 2 * north == intervals ? 0.0L : cosl(t);

        theta[i] = (double)(PI_L * (long double)i / (long double)intervals);
        cosine[i] = (double)(i == north ? c : -c);
        sine[i] = north == 0 ? 0.0 : (double)sinl(t);
        if (i > north) {
            weight[i] = weight[north];
            continue;
        }
        for (size_t k = 1; k <= intervals / 2; k++) {
            /* The argument of cos(2 k t) is reduced in integers: it stays accurate for any n. */
            at += north;
            at -= at >= intervals ? intervals : 0;
            sum -= part[k] * turn[at];
        }
        weight[i] = (double)((north == 0 ? 1.0L : 2.0L) * sum / (long double)intervals);
    }
}
