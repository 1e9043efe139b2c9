/*
 * points_adjoint.c - the transpose of evaluation at points: from values and gradients at scattered
 * points to the coefficients of the functional they define.
 *
 * Each coefficient has a sum in four lanes, one for every fourth point, which are added across at
 * the end. Cost: 6 multiply-adds per point, (l, m) and field, beside the tables.
 */
#include "points.h"

/* What the four points bring along for one field: value and partial derivatives of the test
   function. */
struct load {
    simd value, d_theta, d_phi;
};

static void gather(const struct sphere_lanes *at, const double *values, const double *gradients,
                   size_t lanes, struct load *load)
{
    load->value = load->d_theta = load->d_phi = SIMD_SET(0.0);
    for (size_t k = 0; k < lanes; k++) {
        if (values) {
            load->value[k] = values[k];
        }
        if (gradients) {
            const double *g = gradients + 3 * k;

            load->d_theta[k] = at->cos_theta[k] * (at->cos_phi[k] * g[0] + at->sin_phi[k] * g[1]) -
                               at->sin_theta[k] * g[2];
            load->d_phi[k] = at->cos_phi[k] * g[1] - at->sin_phi[k] * g[0];
        }
    }
}

/* Adds the four points' share to the sums[(L+1)^2][lanes]. */
SRNF_HOT static void spread(const struct sphere_points *plan, const struct sphere_lanes *at,
                            const struct load *load, double *sums)
{
    simd cosine = SIMD_SET(1.0);
    simd sine = SIMD_SET(0.0);
    const double *table = plan->tables;

    for (size_t m = 0; m <= plan->degree; m++) {
        simd next = cosine * at->cos_phi - sine * at->sin_phi;
        simd value_cos = load->value * cosine;
        simd value_sin = load->value * sine;
        simd theta_cos = load->d_theta * cosine;
        simd theta_sin = load->d_theta * sine;
        simd phi_cos = load->d_phi * cosine;
        simd phi_sin = load->d_phi * sine;

        for (size_t l = m; l <= plan->degree; l++, table += POINT_KINDS * SRNF_LANES) {
            double *a = sums + (l * l + l + m) * SRNF_LANES;
            double *b = sums + (l * l + l - m) * SRNF_LANES;
            simd p;
            simd t;
            simd f;
            simd sum;

            SIMD_LOAD(p, table);
            SIMD_LOAD(t, table + POINT_THETA * SRNF_LANES);
            SIMD_LOAD(f, table + POINT_PHI * SRNF_LANES);
            SIMD_LOAD(sum, a);
            sum += p * value_cos + t * theta_cos - f * phi_sin;
            SIMD_STORE(a, sum);
            if (m > 0) {
                SIMD_LOAD(sum, b);
                sum += p * value_sin + t * theta_sin + f * phi_cos;
                SIMD_STORE(b, sum);
            }
        }
        sine = sine * at->cos_phi + cosine * at->sin_phi;
        cosine = next;
    }
}

void sphere_points_adjoint(const struct sphere_points *plan, size_t batch, size_t n,
                           const double *points, const double *values, const double *gradients,
                           double *coefficients, double *scratch)
{
    size_t count = srnf_coefficient_count(plan->degree);

    memset(scratch, 0, batch * count * SRNF_LANES * sizeof *scratch);
    for (size_t first = 0; first < n && !sphere_points_stop(plan, first); first += SRNF_LANES) {
        size_t lanes = n - first < SRNF_LANES ? n - first : SRNF_LANES;
        struct sphere_lanes at;

        sphere_lanes_place(&at, points, first, n);
        sphere_lanes_tables(plan, &at);
        for (size_t field = 0; field < batch; field++) {
            size_t at_field = field * n + first;
            struct load load;

            gather(&at, values ? values + at_field : NULL,
                   gradients ? gradients + 3 * at_field : NULL, lanes, &load);
            spread(plan, &at, &load, scratch + field * count * SRNF_LANES);
        }
    }
    for (size_t i = 0; i < batch * count; i++) {
        const double *s = scratch + i * SRNF_LANES;

        coefficients[i] = (s[0] + s[1]) + (s[2] + s[3]);
    }
}
