/*
 * points.c - harmonic series and their gradients at arbitrary points of the sphere.
 *
 * Four points go together, one to a lane; for each order m the functions P_lm run upwards in l, and
 * for every l the sums over l of P, dP/dtheta and m P / sin theta with all coefficients of that (l,
 * m) are carried in registers. The frame e_theta, e_phi turns the partial derivatives into a vector
 * of R^3; at a pole, where that frame depends on phi, the limits for phi = 0 are used, and the
 * vector is the same for every choice. Formulae of the derivatives: legendre.c. Cost: about 18
 * multiply-adds per point, coefficient pair and three fields.
 */
#include "sphere.h"
#include "simd.h"

#include <math.h>

/* Columns of the sums of one field. */
enum { COS, SIN, COS_THETA, SIN_THETA, COS_PHI, SIN_PHI, SUMS };

struct points_work {
    double *legendre; /* orders_total lanes: P_lm of four points */
    double *factors;  /* see below, per (l, m) */
};

struct points_call {
    size_t degree, batch, n;
    const double *coefficients, *points;
    double *values, *gradients;
};

/* Constants of the recurrences per (l, m): a_lm, 1 / a_l-1,m, and the two pairs of the derivatives.
   */
enum { RECUR, BEFORE, DT_DOWN, DT_UP, DP_DOWN, DP_UP, FACTORS };

static size_t triangle(size_t l, size_t m)
{
    return l * (l + 1) / 2 + m;
}

static void fill_factors(size_t degree, double *factors)
{
    for (size_t l = 0; l <= degree; l++) {
        for (size_t m = 0; m <= l; m++) {
            double *f = factors + triangle(l, m) * FACTORS;
            double dl = (double)l;
            double dm = (double)m;
            double scale = 0.5 * sqrt((2.0 * dl + 1.0) / (2.0 * dl - 1.0 + 2.0 * (l == 0)));

            f[RECUR] = l > m ? sqrt((4.0 * dl * dl - 1.0) / (dl * dl - dm * dm)) : 0.0;
            f[BEFORE] = l > m + 1 ? 1.0 / sqrt((4.0 * (dl - 1.0) * (dl - 1.0) - 1.0) /
                                               ((dl - 1.0) * (dl - 1.0) - dm * dm))
                                  : 0.0;
            f[DT_DOWN] = m > 0 ? 0.5 * sqrt((dl + dm) * (dl - dm + 1.0)) : 0.0;
            f[DT_UP] = m > 0 ? -0.5 * sqrt((dl - dm) * (dl + dm + 1.0)) : -sqrt(dl * (dl + 1.0));
            f[DP_DOWN] = m > 0 ? scale * sqrt((dl + dm) * (dl + dm - 1.0)) : 0.0;
            f[DP_UP] = m > 0 && l > m + 1 ? scale * sqrt((dl - dm) * (dl - dm - 1.0)) : 0.0;
        }
    }
}

/* Where four points are: lanes beyond the last repeat it. */
struct lanes {
    simd cos_theta, sin_theta, cos_phi, sin_phi;
};

/* P_lm at four colatitudes, p[triangle(l, m)][lane]. */
SIMD_INLINE void legendre_lanes(size_t degree, const struct lanes *at, const double *factors,
                                double *p)
{
    simd diagonal = SIMD_SET(sqrt(0.25 / SRNF_PI));

    for (size_t m = 0; m <= degree; m++) {
        simd before = {0};
        simd current;

        if (m > 0) {
            diagonal *= SIMD_SET(sqrt((2.0 * (double)m + 1.0) / (2.0 * (double)m))) * at->sin_theta;
        }
        current = diagonal;
        SIMD_STORE(p + triangle(m, m) * SRNF_LANES, current);
        for (size_t l = m + 1; l <= degree; l++) {
            const double *f = factors + triangle(l, m) * FACTORS;
            simd next =
                SIMD_SET(f[RECUR]) * (at->cos_theta * current - before * SIMD_SET(f[BEFORE]));

            before = current;
            current = next;
            SIMD_STORE(p + triangle(l, m) * SRNF_LANES, current);
        }
    }
}

SIMD_INLINE void sum_order(const struct points_call *call, const struct points_work *work,
                           size_t field, size_t m, simd *sums)
{
    const double *block = call->coefficients + field * srnf_coefficient_count(call->degree);
    const double *p = work->legendre;

    for (size_t l = m; l <= call->degree; l++) {
        const double *c = block + l * l + l;
        const double *f = work->factors + triangle(l, m) * FACTORS;
        simd a = SIMD_SET(c[m]);
        simd b = SIMD_SET(m > 0 ? *(c - m) : 0.0);
        simd here;
        simd up = {0};
        simd down = {0};
        simd up_before = {0};
        simd down_before = {0};
        simd d_theta;
        simd d_phi;

        SIMD_LOAD(here, p + triangle(l, m) * SRNF_LANES);
        if (m < l) {
            SIMD_LOAD(up, p + triangle(l, m + 1) * SRNF_LANES);
        }
        if (m > 0) {
            SIMD_LOAD(down, p + triangle(l, m - 1) * SRNF_LANES);
            SIMD_LOAD(down_before, p + triangle(l - 1, m - 1) * SRNF_LANES);
        }
        if (m + 1 < l) {
            SIMD_LOAD(up_before, p + triangle(l - 1, m + 1) * SRNF_LANES);
        }
        d_theta = SIMD_SET(f[DT_DOWN]) * down + SIMD_SET(f[DT_UP]) * up;
        d_phi = SIMD_SET(f[DP_DOWN]) * down_before + SIMD_SET(f[DP_UP]) * up_before;
        sums[COS] += here * a;
        sums[SIN] += here * b;
        sums[COS_THETA] += d_theta * a;
        sums[SIN_THETA] += d_theta * b;
        sums[COS_PHI] += d_phi * a;
        sums[SIN_PHI] += d_phi * b;
    }
}

/* x and y are scaled before they are squared: next to a pole the squares would underflow, and cos
   phi and sin phi would no longer be those of a unit vector. */
static void place_lanes(const struct points_call *call, size_t first, struct lanes *lanes)
{
    for (size_t k = 0; k < SRNF_LANES; k++) {
        size_t i = first + k < call->n ? first + k : call->n - 1;
        const double *x = call->points + 3 * i;
        double scale = fmax(fabs(x[0]), fabs(x[1]));
        double across = scale > 0.0 ? x[0] / scale : 1.0;
        double along = scale > 0.0 ? x[1] / scale : 0.0;
        double hypotenuse = sqrt(across * across + along * along);
        double rho = scale * hypotenuse;
        double length = sqrt(rho * rho + x[2] * x[2]);

        lanes->cos_theta[k] = x[2] / length;
        lanes->sin_theta[k] = rho / length;
        lanes->cos_phi[k] = across / hypotenuse;
        lanes->sin_phi[k] = along / hypotenuse;
    }
}

static void store_lanes(const struct points_call *call, size_t first, size_t field,
                        const struct lanes *at, const simd *value, const simd *d_theta,
                        const simd *d_phi)
{
    for (size_t k = 0; k < SRNF_LANES && first + k < call->n; k++) {
        size_t i = field * call->n + first + k;

        if (call->values) {
            call->values[i] = (*value)[k];
        }
        if (call->gradients) {
            double *g = call->gradients + 3 * i;

            g[0] = at->cos_theta[k] * at->cos_phi[k] * (*d_theta)[k] - at->sin_phi[k] * (*d_phi)[k];
            g[1] = at->cos_theta[k] * at->sin_phi[k] * (*d_theta)[k] + at->cos_phi[k] * (*d_phi)[k];
            g[2] = -at->sin_theta[k] * (*d_theta)[k];
        }
    }
}

SRNF_HOT static void evaluate_lanes(const struct points_call *call, const struct points_work *work,
                                    size_t first)
{
    struct lanes at;

    place_lanes(call, first, &at);
    legendre_lanes(call->degree, &at, work->factors, work->legendre);
    for (size_t field = 0; field < call->batch; field++) {
        simd value = {0};
        simd d_theta = {0};
        simd d_phi = {0};
        simd cosine = SIMD_SET(1.0); /* cos m phi, sin m phi */
        simd sine = {0};

        for (size_t m = 0; m <= call->degree; m++) {
            simd sums[SUMS] = {{0}};
            simd c = SIMD_SET(m > 0 ? sqrt(2.0) : 1.0) * cosine;
            simd s = SIMD_SET(m > 0 ? sqrt(2.0) : 1.0) * sine;
            simd next = cosine * at.cos_phi - sine * at.sin_phi;

            sum_order(call, work, field, m, sums);
            value += sums[COS] * c + sums[SIN] * s;
            d_theta += sums[COS_THETA] * c + sums[SIN_THETA] * s;
            d_phi += sums[SIN_PHI] * c - sums[COS_PHI] * s;
            sine = sine * at.cos_phi + cosine * at.sin_phi;
            cosine = next;
        }
        store_lanes(call, first, field, &at, &value, &d_theta, &d_phi);
    }
}

int srnf_harmonics_at_points(size_t degree, size_t batch, const double *coefficients, size_t n,
                             const double *points, double *values, double *gradients)
{
    int status = SRNF_ENOMEM;
    struct points_call call = {degree, batch, n, coefficients, points, values, gradients};
    struct points_work work = {NULL, NULL};
    size_t orders;

    if (degree > SRNF_TRANSFORM_DEGREE_MAX) {
        return SRNF_EINVAL;
    }
    orders = (degree + 1) * (degree + 2) / 2;
    work.legendre = srnf_alloc(orders * SRNF_LANES, sizeof(double));
    work.factors = srnf_alloc(orders * FACTORS, sizeof(double));
    if (!work.legendre || !work.factors) {
        goto out;
    }
    fill_factors(degree, work.factors);
    for (size_t first = 0; first < n; first += SRNF_LANES) {
        evaluate_lanes(&call, &work, first);
    }
    status = SRNF_OK;
out:
    srnf_free(work.legendre);
    srnf_free(work.factors);
    return status;
}
