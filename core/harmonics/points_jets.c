/*
 * points_jets.c - first and covariant second derivatives of harmonic series at arbitrary points.
 *
 * In the frame e_theta, e_phi the covariant Hessian of Y is
 *   H_11 = Y_theta theta,  H_12 = d/dtheta (Y_phi / sin theta),  H_22 = -l (l + 1) Y - H_11.
 * dP/dtheta is a combination of P at the orders m - 1 and m + 1 (points.c), so d2P/dtheta2 is the
 * same combination of their dP/dtheta; m P / sin theta is a combination of P at l - 1 and m - 1,
 * m + 1, so its derivative is that of their dP/dtheta. Nothing is divided by sin theta: the poles
 * are points like others. Ten sums a field stay in registers.
 */
#include "points.h"

enum { TABLE_THETA_THETA, TABLE_THETA_PHI, TABLE_PHI_PHI, TABLES };
#define STRIDE (POINT_KINDS * SRNF_LANES)
#define STRIDE_2 (TABLES * SRNF_LANES)

int sphere_jets_create(struct sphere_jets *plan, size_t degree, const struct srnf_context *context)
{
    size_t orders = (degree + 1) * (degree + 2) / 2;
    int status;

    *plan = (struct sphere_jets){.tables = srnf_alloc(orders * STRIDE_2, sizeof(double))};
    status = sphere_points_create(&plan->points, degree, context);
    if (status || !plan->tables) {
        sphere_jets_clear(plan);
        return SRNF_ENOMEM;
    }
    return SRNF_OK;
}

void sphere_jets_clear(struct sphere_jets *plan)
{
    sphere_points_clear(&plan->points);
    srnf_free(plan->tables);
    plan->tables = NULL;
}

/* After sphere_lanes_tables: the second derivatives. */
SRNF_HOT static void tabulate_second(const struct sphere_jets *plan)
{
    static const double zeros[SRNF_LANES] = {0};
    const double *first = plan->points.tables + POINT_THETA * SRNF_LANES;
    size_t degree = plan->points.degree;

    for (size_t m = 0; m <= degree; m++) {
        size_t order = sphere_points_order(degree, m);
        const double *f = plan->points.factors + order * FACTORS;
        const double *value = plan->points.tables + order * STRIDE;
        double *table = plan->tables + order * STRIDE_2;
        const double *below =
            m > 0 ? first + (sphere_points_order(degree, m - 1) + 1) * STRIDE : zeros;
        const double *above =
            m < degree ? first + sphere_points_order(degree, m + 1) * STRIDE : zeros;

        for (size_t l = m; l <= degree; l++, f += FACTORS, value += STRIDE, table += STRIDE_2) {
            simd down;
            simd up;
            simd down_before;
            simd up_before;
            simd p;
            simd second;
            simd mixed;

            SIMD_LOAD(down, m > 0 ? below + (l - m) * STRIDE : zeros);
            SIMD_LOAD(up, l > m ? above + (l - m - 1) * STRIDE : zeros);
            SIMD_LOAD(down_before, m > 0 ? below + (l - m) * STRIDE - STRIDE : zeros);
            SIMD_LOAD(up_before, l > m + 1 ? above + (l - m - 2) * STRIDE : zeros);
            SIMD_LOAD(p, value);
            second = SIMD_SET(f[FACTOR_THETA_DOWN]) * down + SIMD_SET(f[FACTOR_THETA_UP]) * up;
            mixed =
                SIMD_SET(f[FACTOR_PHI_DOWN]) * down_before + SIMD_SET(f[FACTOR_PHI_UP]) * up_before;
            p = SIMD_SET(-(double)(l * (l + 1))) * p - second;
            SIMD_STORE(table + TABLE_THETA_THETA * SRNF_LANES, second);
            SIMD_STORE(table + TABLE_THETA_PHI * SRNF_LANES, mixed);
            SIMD_STORE(table + TABLE_PHI_PHI * SRNF_LANES, p);
        }
    }
}

/* Sums over l of order m: [kind][0] with the cosine's coefficients, [kind][1] with the sine's. */
SIMD_INLINE void sum_order(const struct sphere_jets *plan, const double *coefficients, size_t m,
                           simd sums[JET_KINDS][2])
{
    size_t order = sphere_points_order(plan->points.degree, m);
    const double *first = plan->points.tables + order * STRIDE + POINT_THETA * SRNF_LANES;
    const double *second = plan->tables + order * STRIDE_2;

    for (size_t k = 0; k < JET_KINDS; k++) {
        sums[k][0] = sums[k][1] = SIMD_SET(0.0);
    }
    for (size_t l = m; l <= plan->points.degree; l++, first += STRIDE, second += STRIDE_2) {
        const double *c = coefficients + l * l + l;
        simd a = SIMD_SET(c[m]);
        simd b = SIMD_SET(*(c - m));
        simd t[JET_KINDS];

        SIMD_LOAD(t[JET_THETA], first);
        SIMD_LOAD(t[JET_PHI], first + (POINT_PHI - POINT_THETA) * SRNF_LANES);
        SIMD_LOAD(t[JET_THETA_THETA], second + TABLE_THETA_THETA * SRNF_LANES);
        SIMD_LOAD(t[JET_THETA_PHI], second + TABLE_THETA_PHI * SRNF_LANES);
        SIMD_LOAD(t[JET_PHI_PHI], second + TABLE_PHI_PHI * SRNF_LANES);
        for (size_t k = 0; k < JET_KINDS; k++) {
            sums[k][0] += t[k] * a;
            sums[k][1] += t[k] * b;
        }
    }
}

SIMD_INLINE void sum_field(const struct sphere_jets *plan, const struct sphere_lanes *at,
                           const double *coefficients, simd jet[JET_KINDS])
{
    simd cosine = SIMD_SET(1.0); /* cos m phi and sin m phi, by rotation */
    simd sine = SIMD_SET(0.0);

    for (size_t k = 0; k < JET_KINDS; k++) {
        jet[k] = SIMD_SET(0.0);
    }
    for (size_t m = 0; m <= plan->points.degree; m++) {
        simd sums[JET_KINDS][2];
        simd next = cosine * at->cos_phi - sine * at->sin_phi;

        sum_order(plan, coefficients, m, sums);
        jet[JET_THETA] += sums[JET_THETA][0] * cosine + sums[JET_THETA][1] * sine;
        jet[JET_PHI] += sums[JET_PHI][1] * cosine - sums[JET_PHI][0] * sine;
        jet[JET_THETA_THETA] += sums[JET_THETA_THETA][0] * cosine + sums[JET_THETA_THETA][1] * sine;
        jet[JET_THETA_PHI] += sums[JET_THETA_PHI][1] * cosine - sums[JET_THETA_PHI][0] * sine;
        jet[JET_PHI_PHI] += sums[JET_PHI_PHI][0] * cosine + sums[JET_PHI_PHI][1] * sine;
        sine = sine * at->cos_phi + cosine * at->sin_phi;
        cosine = next;
    }
}

static void store_frames(const struct sphere_lanes *at, size_t lanes, double *t1, double *t2)
{
    for (size_t k = 0; k < lanes; k++) {
        t1[3 * k] = at->cos_theta[k] * at->cos_phi[k];
        t1[3 * k + 1] = at->cos_theta[k] * at->sin_phi[k];
        t1[3 * k + 2] = -at->sin_theta[k];
        t2[3 * k] = -at->sin_phi[k];
        t2[3 * k + 1] = at->cos_phi[k];
        t2[3 * k + 2] = 0.0;
    }
}

SRNF_HOT void sphere_jets_evaluate(const struct sphere_jets *plan, size_t batch,
                                   const double *coefficients, size_t n, const double *points,
                                   double *jets, double *t1, double *t2)
{
    size_t count = srnf_coefficient_count(plan->points.degree);

    for (size_t first = 0; first < n && !sphere_points_stop(&plan->points, first);
         first += SRNF_LANES) {
        struct sphere_lanes at;
        size_t lanes = n - first < SRNF_LANES ? n - first : SRNF_LANES;

        sphere_lanes_place(&at, points, first, n);
        sphere_lanes_tables(&plan->points, &at);
        tabulate_second(plan);
        store_frames(&at, lanes, t1 + 3 * first, t2 + 3 * first);
        for (size_t field = 0; field < batch; field++) {
            simd jet[JET_KINDS];

            sum_field(plan, &at, coefficients + field * count, jet);
            for (size_t k = 0; k < JET_KINDS; k++) {
                memcpy(jets + (field * JET_KINDS + k) * n + first, &jet[k], lanes * sizeof(double));
            }
        }
    }
}
