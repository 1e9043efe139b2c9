/*
 * points.c - harmonic series and their gradients at arbitrary points of the sphere.
 *
 * Four points go together, one to a lane. P_lm and what its derivatives need are tabulated for
 * them, m by m with l running upwards (formulae: legendre.c); then each pair of fields is summed
 * over l for every m, with twelve sums in registers, and over m with cos and sin of m phi. The
 * frame e_theta, e_phi turns the partial derivatives into a vector of R^3. At a pole, where that
 * frame depends on phi, phi = 0 is taken: the derivatives are the limits along that meridian, and
 * the vector is the same for every choice.
 *
 * Cost: 6 multiply-adds per point, (l, m) and field, and some 20 per point and (l, m) for the
 * tables.
 */
#include "points.h"

#include <math.h>

/* Sums of one field. */
enum { COS, SIN, COS_THETA, SIN_THETA, COS_PHI, SIN_PHI, SUMS };

static void fill_factors(size_t degree, double *factors)
{
    double *f = factors;

    for (size_t m = 0; m <= degree; m++) {
        double dm = (double)m;
        double root = m > 0 ? sqrt(2.0) : 1.0;
        /* Tables hold root P_lm; neighbours in m are tabulated with their own root. */
        double down = root / (m > 1 ? sqrt(2.0) : 1.0);
        double up = root / sqrt(2.0);

        for (size_t l = m; l <= degree; l++, f += FACTORS) {
            double dl = (double)l;
            double before = (dl - 1.0) * (dl - 1.0);
            double scale = l > 0 ? 0.5 * sqrt((2.0 * dl + 1.0) / (2.0 * dl - 1.0)) : 0.0;

            f[FACTOR_RECUR] = l > m ? sqrt((4.0 * dl * dl - 1.0) / (dl * dl - dm * dm)) : 0.0;
            f[FACTOR_BEFORE] = l > m + 1 ? sqrt((before - dm * dm) / (4.0 * before - 1.0)) : 0.0;
            f[FACTOR_THETA_DOWN] = m > 0 ? down * 0.5 * sqrt((dl + dm) * (dl - dm + 1.0)) : 0.0;
            f[FACTOR_THETA_UP] =
                m > 0 ? -up * 0.5 * sqrt((dl - dm) * (dl + dm + 1.0)) : -up * sqrt(dl * (dl + 1.0));
            f[FACTOR_PHI_DOWN] = m > 0 ? down * scale * sqrt((dl + dm) * (dl + dm - 1.0)) : 0.0;
            f[FACTOR_PHI_UP] =
                m > 0 && l > m + 1 ? up * scale * sqrt((dl - dm) * (dl - dm - 1.0)) : 0.0;
        }
    }
}

int sphere_points_create(struct sphere_points *plan, size_t degree,
                         const struct srnf_context *context)
{
    size_t orders = (degree + 1) * (degree + 2) / 2;

    plan->degree = degree;
    plan->context = context;
    plan->factors = srnf_alloc(orders * FACTORS, sizeof(double));
    plan->tables = srnf_alloc(orders * POINT_KINDS * SRNF_LANES, sizeof(double));
    if (!plan->factors || !plan->tables) {
        sphere_points_clear(plan);
        return SRNF_ENOMEM;
    }
    fill_factors(degree, plan->factors);
    return SRNF_OK;
}

void sphere_points_clear(struct sphere_points *plan)
{
    srnf_free(plan->factors);
    srnf_free(plan->tables);
    *plan = (struct sphere_points){0};
}

/* x and y are scaled before they are squared: next to a pole the squares would underflow, and cos
   phi and sin phi would no longer be those of a unit vector. */
void sphere_lanes_place(struct sphere_lanes *lanes, const double *points, size_t first, size_t n)
{
    for (size_t k = 0; k < SRNF_LANES; k++) {
        const double *x = points + 3 * (first + k < n ? first + k : n - 1);
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

/* Values first, all orders: the derivatives of order m need the orders beside it. */
SIMD_INLINE void tabulate_values(const struct sphere_points *plan, const struct sphere_lanes *at)
{
    size_t degree = plan->degree;
    simd diagonal = SIMD_SET(sqrt(0.25 / SRNF_PI));

    for (size_t m = 0; m <= degree; m++) {
        size_t order = sphere_points_order(degree, m);
        const double *f = plan->factors + order * FACTORS;
        double *table = plan->tables + order * POINT_KINDS * SRNF_LANES;
        simd before = SIMD_SET(0.0);
        simd current;

        if (m > 0) {
            /* The root of two enters once, at m = 1. */
            double factor = (2.0 * (double)m + 1.0) / (2.0 * (double)m) * (m == 1 ? 2.0 : 1.0);

            diagonal *= SIMD_SET(sqrt(factor)) * at->sin_theta;
        }
        current = diagonal;
        SIMD_STORE(table, current);
        for (size_t l = m + 1; l <= degree; l++) {
            simd next;

            f += FACTORS;
            table += POINT_KINDS * SRNF_LANES;
            next = SIMD_SET(f[FACTOR_RECUR]) *
                   (at->cos_theta * current - before * SIMD_SET(f[FACTOR_BEFORE]));
            before = current;
            current = next;
            SIMD_STORE(table, current);
        }
    }
}

SRNF_HOT void sphere_lanes_tables(const struct sphere_points *plan, const struct sphere_lanes *at)
{
    static const double zeros[SRNF_LANES] = {0};
    size_t degree = plan->degree;
    size_t stride = POINT_KINDS * SRNF_LANES;

    tabulate_values(plan, at);
    for (size_t m = 0; m <= degree; m++) {
        double *table = plan->tables + sphere_points_order(degree, m) * stride;
        /* Entry l of the orders beside m; order m + 1 starts at l = m + 1. */
        const double *below =
            m > 0 ? plan->tables + (sphere_points_order(degree, m - 1) + 1) * stride : zeros;
        const double *above =
            m < degree ? plan->tables + sphere_points_order(degree, m + 1) * stride : zeros;
        const double *f = plan->factors + sphere_points_order(degree, m) * FACTORS;

        for (size_t l = m; l <= degree; l++, f += FACTORS, table += stride) {
            simd down;
            simd up;
            simd down_before;
            simd up_before;
            simd d_theta;
            simd d_phi;

            SIMD_LOAD(down, m > 0 ? below + (l - m) * stride : zeros);
            SIMD_LOAD(up, l > m ? above + (l - m - 1) * stride : zeros);
            SIMD_LOAD(down_before, m > 0 ? below + (l - m) * stride - stride : zeros);
            SIMD_LOAD(up_before, l > m + 1 ? above + (l - m - 2) * stride : zeros);
            d_theta = SIMD_SET(f[FACTOR_THETA_DOWN]) * down + SIMD_SET(f[FACTOR_THETA_UP]) * up;
            d_phi =
                SIMD_SET(f[FACTOR_PHI_DOWN]) * down_before + SIMD_SET(f[FACTOR_PHI_UP]) * up_before;
            SIMD_STORE(table + POINT_THETA * SRNF_LANES, d_theta);
            SIMD_STORE(table + POINT_PHI * SRNF_LANES, d_phi);
        }
    }
}

/* Sums over l of order m for `fields` (1 or 2) fields. */
SIMD_INLINE void sum_order(const struct sphere_points *plan, const double *coefficients,
                           size_t fields, size_t m, simd sums[2][SUMS])
{
    size_t count = srnf_coefficient_count(plan->degree);
    const double *table =
        plan->tables + sphere_points_order(plan->degree, m) * POINT_KINDS * SRNF_LANES;

    for (size_t f = 0; f < fields; f++) {
        for (size_t k = 0; k < SUMS; k++) {
            sums[f][k] = SIMD_SET(0.0);
        }
    }
    for (size_t l = m; l <= plan->degree; l++, table += POINT_KINDS * SRNF_LANES) {
        simd value;
        simd d_theta;
        simd d_phi;

        SIMD_LOAD(value, table);
        SIMD_LOAD(d_theta, table + POINT_THETA * SRNF_LANES);
        SIMD_LOAD(d_phi, table + POINT_PHI * SRNF_LANES);
        for (size_t f = 0; f < fields; f++) {
            const double *c = coefficients + f * count + l * l + l;
            simd a = SIMD_SET(c[m]);
            simd b = SIMD_SET(*(c - m));

            sums[f][COS] += value * a;
            sums[f][SIN] += value * b;
            sums[f][COS_THETA] += d_theta * a;
            sums[f][SIN_THETA] += d_theta * b;
            sums[f][COS_PHI] += d_phi * a;
            sums[f][SIN_PHI] += d_phi * b;
        }
    }
}

/* Value and partial derivatives of one field at four points. */
struct jet {
    simd value, d_theta, d_phi;
};

SIMD_INLINE void sum_fields(const struct sphere_points *plan, const struct sphere_lanes *at,
                            const double *coefficients, size_t fields, struct jet *jets)
{
    simd cosine = SIMD_SET(1.0); /* cos m phi and sin m phi, by rotation */
    simd sine = SIMD_SET(0.0);

    for (size_t f = 0; f < fields; f++) {
        jets[f].value = jets[f].d_theta = jets[f].d_phi = SIMD_SET(0.0);
    }
    for (size_t m = 0; m <= plan->degree; m++) {
        simd sums[2][SUMS];
        simd next = cosine * at->cos_phi - sine * at->sin_phi;

        sum_order(plan, coefficients, fields, m, sums);
        for (size_t f = 0; f < fields; f++) {
            jets[f].value += sums[f][COS] * cosine + sums[f][SIN] * sine;
            jets[f].d_theta += sums[f][COS_THETA] * cosine + sums[f][SIN_THETA] * sine;
            jets[f].d_phi += sums[f][SIN_PHI] * cosine - sums[f][COS_PHI] * sine;
        }
        sine = sine * at->cos_phi + cosine * at->sin_phi;
        cosine = next;
    }
}

static void store_jet(const struct sphere_lanes *at, const struct jet *jet, size_t count,
                      double *values, double *gradients)
{
    for (size_t k = 0; k < count; k++) {
        if (values) {
            values[k] = jet->value[k];
        }
        if (gradients) {
            double t = jet->d_theta[k];
            double p = jet->d_phi[k];

            gradients[3 * k] = at->cos_theta[k] * at->cos_phi[k] * t - at->sin_phi[k] * p;
            gradients[3 * k + 1] = at->cos_theta[k] * at->sin_phi[k] * t + at->cos_phi[k] * p;
            gradients[3 * k + 2] = -at->sin_theta[k] * t;
        }
    }
}

SRNF_HOT void sphere_points_evaluate(const struct sphere_points *plan, size_t batch,
                                     const double *coefficients, size_t n, const double *points,
                                     double *values, double *gradients)
{
    size_t count = srnf_coefficient_count(plan->degree);

    for (size_t first = 0; first < n && !sphere_points_stop(plan, first); first += SRNF_LANES) {
        struct sphere_lanes at;
        size_t lanes = n - first < SRNF_LANES ? n - first : SRNF_LANES;

        sphere_lanes_place(&at, points, first, n);
        sphere_lanes_tables(plan, &at);
        for (size_t field = 0; field < batch; field += 2) {
            struct jet jets[2];
            size_t fields = batch - field < 2 ? 1 : 2;

            if (fields == 2) {
                sum_fields(plan, &at, coefficients + field * count, 2, jets);
            } else {
                sum_fields(plan, &at, coefficients + field * count, 1, jets);
            }
            for (size_t f = 0; f < fields; f++) {
                size_t at_field = (field + f) * n + first;

                store_jet(&at, &jets[f], lanes, values ? values + at_field : NULL,
                          gradients ? gradients + 3 * at_field : NULL);
            }
        }
    }
}

int sphere_harmonics_at_points(const struct srnf_context *context, size_t degree, size_t batch,
                               const double *coefficients, size_t n, const double *points,
                               double *values, double *gradients)
{
    struct sphere_points plan;
    int status;

    if (degree > SRNF_TRANSFORM_DEGREE_MAX) {
        return SRNF_EINVAL;
    }
    status = sphere_points_create(&plan, degree, context);
    if (status == SRNF_OK) {
        sphere_points_evaluate(&plan, batch, coefficients, n, points, values, gradients);
        sphere_points_clear(&plan);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    return status;
}

int srnf_harmonics_at_points(size_t degree, size_t batch, const double *coefficients, size_t n,
                             const double *points, double *values, double *gradients)
{
    return sphere_harmonics_at_points(NULL, degree, batch, coefficients, n, points, values,
                                      gradients);
}
