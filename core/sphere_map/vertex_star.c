/*
 * vertex_star.c - the energy of one vertex's star on the sphere and a guarded Newton step on it.
 *
 * For a vertex p with the spherical triangles (p, w_i, w_i+1):
 *
 *   E(p) = sum_i q_i (1 + (2 A_i / d_i)^2),  q_i = (cot_p |w_i - w_i+1|^2 + cot_i |p - w_i+1|^2
 *                                                   + cot_i+1 |p - w_i|^2) / 2,
 *   d_i = p . (w_i x w_i+1)
 *
 * the symmetric Dirichlet energy of the map from the triangle in space (robust metric, total area 4
 * pi) with the image's area replaced by half the determinant: this tends to 0 exactly where the
 * spherical triangle turns over, also for large triangles, whose chordal area does not. So E is a
 * barrier. With c_i = w_i x w_i+1, g = grad E, H = its Hessian in R^3, the Riemannian Hessian is T'
 * H T - (p . g) I in a tangent basis T; its eigenvalues are taken by absolute value, the smaller
 * one at least 1e-3 of the larger. The step is cut to 0.8 of the way to the first d_i = 0 (d is
 * linear in p) and to half a radian, then backtracked (Armijo).
 */
#include "sphere_map.h"

#include <string.h>

#define STEP_SHARE 0.8
#define STEP_MAX 0.5
#define ARMIJO 1e-4
#define BACKTRACK 0.4
#define TRIES 12
#define EIGENVALUE_RATIO 1e-3
/* A determinant below this part of its terms is no orientation to rely on. */
#define DETERMINANT_MIN 1e-15

/* One triangle of the star: w_i, w_i+1, c = w_i x w_i+1, constants of q, squared double area. */
enum { W0 = 0, W1 = 3, C = 6, COT0 = 9, COT1 = 10, CONSTANT = 11, AREA2 = 12, STAR_STRIDE = 13 };

static int star_room(struct spherical *s, size_t count)
{
    double *room;

    if (count * STAR_STRIDE <= s->star_capacity) {
        return SRNF_OK;
    }
    room = srnf_alloc(2 * count * STAR_STRIDE, sizeof *room);
    if (!room) {
        return SRNF_ENOMEM;
    }
    srnf_free(s->star);
    s->star = room;
    s->star_capacity = 2 * count * STAR_STRIDE;
    return SRNF_OK;
}

int spherical_star_load(struct spherical *s, uint32_t v)
{
    struct ring *ring = &s->rings[v];
    double scale = 4.0 * SRNF_PI / s->total_area;

    if (star_room(s, ring->count)) {
        return SRNF_ENOMEM;
    }
    (void)spherical_ring_read(ring);
    for (uint32_t i = 0; i < ring->count; i++) {
        double *t = s->star + i * STAR_STRIDE;
        uint32_t a = ring->at[i];
        uint32_t b = spherical_ring_get(ring, i + 1);
        struct triangle_metric metric;
        double edge[3];

        spherical_metric(s, s->positions + 3 * (size_t)v, s->positions + 3 * (size_t)a,
                         s->positions + 3 * (size_t)b, &metric);
        memcpy(t + W0, s->points + 3 * (size_t)a, 3 * sizeof *t);
        memcpy(t + W1, s->points + 3 * (size_t)b, 3 * sizeof *t);
        vector_cross(t + W0, t + W1, t + C);
        vector_subtract(t + W0, t + W1, edge);
        t[COT0] = metric.cot[1];
        t[COT1] = metric.cot[2];
        t[CONSTANT] = metric.cot[0] * vector_dot(edge, edge);
        t[AREA2] = 4.0 * metric.area * metric.area * scale * scale;
    }
    return SRNF_OK;
}

double spherical_star_energy(const struct spherical *s, uint32_t v, const double p[3])
{
    double sum = 0.0;

    for (uint32_t i = 0; i < s->rings[v].count; i++) {
        const double *t = s->star + i * STAR_STRIDE;
        double d = vector_dot(p, t + C);
        double a[3];
        double b[3];
        double q;

        if (!(d > DETERMINANT_MIN)) {
            return INFINITY;
        }
        vector_subtract(p, t + W0, a);
        vector_subtract(p, t + W1, b);
        q = 0.5 * (t[CONSTANT] + t[COT0] * vector_dot(b, b) + t[COT1] * vector_dot(a, a));
        sum += q * (1.0 + t[AREA2] / (d * d));
    }
    return sum;
}

/* Energy, gradient and Hessian (xx, xy, xz, yy, yz, zz) in R^3. */
static double derivatives(const struct spherical *s, uint32_t v, const double p[3], double g[3],
                          double h[6])
{
    double sum = 0.0;

    memset(g, 0, 3 * sizeof *g);
    memset(h, 0, 6 * sizeof *h);
    for (uint32_t i = 0; i < s->rings[v].count; i++) {
        const double *t = s->star + i * STAR_STRIDE;
        const double *c = t + C;
        double d = vector_dot(p, c);
        double cots = t[COT0] + t[COT1];
        double inverse2 = t[AREA2] / (d * d);
        double a[3];
        double b[3];
        double dq[3];
        double q;
        double first;
        double cross;
        double second;

        vector_subtract(p, t + W0, a);
        vector_subtract(p, t + W1, b);
        q = 0.5 * (t[CONSTANT] + t[COT0] * vector_dot(b, b) + t[COT1] * vector_dot(a, a));
        sum += q * (1.0 + inverse2);
        first = -2.0 * q * inverse2 / d;
        cross = -2.0 * inverse2 / d;
        second = 6.0 * q * inverse2 / (d * d);
        for (size_t k = 0; k < 3; k++) {
            dq[k] = t[COT0] * b[k] + t[COT1] * a[k];
            g[k] += dq[k] * (1.0 + inverse2) + first * c[k];
        }
        for (size_t k = 0, m = 0; k < 3; k++) {
            for (size_t j = k; j < 3; j++, m++) {
                h[m] += (k == j) * cots * (1.0 + inverse2) + cross * (dq[k] * c[j] + dq[j] * c[k]) +
                        second * c[k] * c[j];
            }
        }
    }
    return sum;
}

static void tangent_basis(const double p[3], double u[3], double w[3])
{
    /* The axis that p leans away from most gives a stable first tangent. */
    double axis[3] = {0.0, 0.0, 0.0};
    size_t k = fabs(p[0]) < fabs(p[1]) ? 0 : 1;
    double length;

    k = fabs(p[2]) < fabs(p[k]) ? 2 : k;
    axis[k] = 1.0;
    vector_cross(p, axis, u);
    length = vector_norm(u);
    for (size_t j = 0; j < 3; j++) {
        u[j] /= length;
    }
    vector_cross(p, u, w);
}

static double quadratic(const double h[6], const double a[3], const double b[3])
{
    return a[0] * (h[0] * b[0] + h[1] * b[1] + h[2] * b[2]) +
           a[1] * (h[1] * b[0] + h[3] * b[1] + h[4] * b[2]) +
           a[2] * (h[2] * b[0] + h[4] * b[1] + h[5] * b[2]);
}

/* Newton direction in the tangent plane at p with the safeguarded Hessian; returns its slope < 0,
   or 0. */
static double newton_direction(const double p[3], const double g[3], const double h[6],
                               double step[3])
{
    double u[3];
    double w[3];
    double normal = vector_dot(p, g);
    double gu;
    double gw;
    double a;
    double b;
    double c;
    double mean;
    double radius;
    double angle;
    double low;
    double high;
    double x;
    double y;

    tangent_basis(p, u, w);
    gu = vector_dot(u, g);
    gw = vector_dot(w, g);
    a = quadratic(h, u, u) - normal;
    b = quadratic(h, u, w);
    c = quadratic(h, w, w) - normal;
    mean = 0.5 * (a + c);
    radius = hypot(0.5 * (a - c), b);
    angle = 0.5 * atan2(2.0 * b, a - c);
    high = fabs(mean + radius);
    low = fabs(mean - radius);
    if (!(larger(high, low) > 0.0) || !isfinite(high) || !isfinite(low)) {
        return 0.0;
    }
    low = larger(low, EIGENVALUE_RATIO * high);
    high = larger(high, EIGENVALUE_RATIO * low);
    /* Components along the eigenvectors (cos, sin) and (-sin, cos). */
    x = -(cos(angle) * gu + sin(angle) * gw) / high;
    y = -(-sin(angle) * gu + cos(angle) * gw) / low;
    for (size_t k = 0; k < 3; k++) {
        step[k] =
            (cos(angle) * x - sin(angle) * y) * u[k] + (sin(angle) * x + cos(angle) * y) * w[k];
    }
    return vector_dot(step, g);
}

/* Largest part of the step that keeps every determinant positive. */
static double feasible_part(const struct spherical *s, uint32_t v, const double p[3],
                            const double step[3])
{
    double part = INFINITY;

    for (uint32_t i = 0; i < s->rings[v].count; i++) {
        const double *c = s->star + i * STAR_STRIDE + C;
        double slope = vector_dot(step, c);

        if (slope < 0.0) {
            part = smaller(part, -vector_dot(p, c) / slope);
        }
    }
    return part;
}

double spherical_star_step(struct spherical *s, uint32_t v)
{
    double *p = s->points + 3 * (size_t)v;
    double g[3];
    double h[6];
    double step[3] = {0.0, 0.0, 0.0};
    double energy = derivatives(s, v, p, g, h);
    double slope = newton_direction(p, g, h, step);
    double length = vector_norm(step);
    double t;

    if (!(slope < 0.0) || !isfinite(energy) || !isfinite(length)) {
        return 0.0;
    }
    t = smaller(1.0, STEP_SHARE * feasible_part(s, v, p, step));
    t = smaller(t, STEP_MAX / length);
    for (int k = 0; k < TRIES; k++) {
        double candidate[3];
        double norm;
        double after;

        for (size_t j = 0; j < 3; j++) {
            candidate[j] = p[j] + t * step[j];
        }
        norm = vector_norm(candidate);
        for (size_t j = 0; j < 3; j++) {
            candidate[j] /= norm;
        }
        after = spherical_star_energy(s, v, candidate);
        if (after <= energy + ARMIJO * t * slope) {
            memcpy(p, candidate, sizeof candidate);
            return (energy - after) / energy;
        }
        t *= BACKTRACK;
    }
    return 0.0;
}
