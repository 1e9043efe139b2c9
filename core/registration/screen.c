/*
 * screen.c - which rotations of the domain are worth a try.
 *
 * Super-Fibonacci rotations (M. Alexa, "Super-Fibonacci spirals: fast, low-discrepancy sampling of
 * SO(3)", CVPR 2022) turn the degree-6 part of q2; the overlap with q1, over rotations of the
 * values, is in closed form. The best are thinned to be 20 degrees apart.
 *
 * A rotation is R = Rz(a) Ry(b) Rz(c), and Ry(b) = Q' Rz(b) Q with a fixed Q that takes y to z. In
 * real harmonics a rotation about z mixes cos m phi and sin m phi; Q is a block of (2 l + 1)^2
 * numbers for each degree, computed once. The three components of q2 go together in a vector.
 */
#include "tabulated.h"

#include "harmonics/harmonics.h"

#include <math.h>
#include <string.h>

#define DEGREE ((size_t)REGISTRATION_SCREEN_DEGREE)
#define COUNT ((DEGREE + 1) * (DEGREE + 1))
#define ORDERS ((DEGREE + 1) * (DEGREE + 2) / 2)
#define BLOCKS ((size_t)455) /* sum of (2 l + 1)^2 */
#define ROTATIONS ((size_t)600)
#define THIN_DEGREES 20.0

struct screen {
    double quarter[BLOCKS]; /* of f -> f o Q: [l][to][from] */
    double first[3 * COUNT];
    double second[COUNT * SRNF_LANES]; /* [lm][component] */
};

static void super_fibonacci(size_t i, size_t n, double rotation[9])
{
    double s = (double)i + 0.5;
    double r = sqrt(s / (double)n);
    double big = sqrt(1.0 - s / (double)n);
    double alpha = 2.0 * SRNF_PI * s / sqrt(2.0);
    double beta = 2.0 * SRNF_PI * s / 1.533751168755204288118041;
    double q[4] = {r * sin(alpha), r * cos(alpha), big * sin(beta), big * cos(beta)};
    double w = q[3];

    for (size_t a = 0; a < 3; a++) {
        for (size_t b = 0; b < 3; b++) {
            size_t c = 3 - a - b;
            double sign = (a + 1) % 3 == b ? -1.0 : 1.0;

            rotation[3 * a + b] = a == b ? 1.0 - 2.0 * (q[(a + 1) % 3] * q[(a + 1) % 3] +
                                                        q[(a + 2) % 3] * q[(a + 2) % 3])
                                         : 2.0 * (q[a] * q[b] + sign * w * q[c]);
        }
    }
}

/* All harmonics up to DEGREE at a point, as they lie in a series. */
static void harmonics_at(const double *factors, const double point[3], double y[COUNT])
{
    double sine = sqrt(point[0] * point[0] + point[1] * point[1]);
    double cos_phi = sine > 0.0 ? point[0] / sine : 1.0;
    double sin_phi = sine > 0.0 ? point[1] / sine : 0.0;
    double p[ORDERS];
    double c = 1.0, s = 0.0;

    sphere_legendre(DEGREE, factors, point[2], sine, p);
    for (size_t m = 0; m <= DEGREE; m++) {
        double root = m > 0 ? sqrt(2.0) : 1.0;
        double next = c * cos_phi - s * sin_phi;

        for (size_t l = m; l <= DEGREE; l++) {
            double value = root * p[l * (l + 1) / 2 + m];

            y[l * l + l - m] = value * s;
            y[l * l + l + m] = value * c;
        }
        s = s * cos_phi + c * sin_phi;
        c = next;
    }
}

/* out += weight Y_a(e) Y_b(Q e) */
static void add_products(const double here[COUNT], const double there[COUNT], double weight,
                         double *out)
{
    for (size_t l = 0; l <= DEGREE; l++) {
        for (size_t a = l * l; a < (l + 1) * (l + 1); a++) {
            for (size_t b = l * l; b < (l + 1) * (l + 1); b++) {
                *out++ += weight * here[a] * there[b];
            }
        }
    }
}

/* The blocks of Q, by exact quadrature of Y_a(e) Y_b(Q e). */
static int fill_quarter(struct screen *s)
{
    struct srnf_grid grid;
    const size_t n = 2 * (DEGREE + 1) * (DEGREE + 1);
    double *nodes = registration_parallels(DEGREE + 1, &grid);
    double *points = srnf_alloc(4 * n, sizeof(double));
    double factors[ORDERS * LEGENDRE_FACTORS];
    int status = nodes && points ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        registration_nodes(&grid, points, points + 3 * n);
        sphere_legendre_factors(DEGREE, factors);
        for (size_t i = 0; i < n; i++) {
            const double *e = points + 3 * i;
            const double turned[3] = {e[0], -e[2], e[1]};
            double here[COUNT], there[COUNT];

            harmonics_at(factors, e, here);
            harmonics_at(factors, turned, there);
            add_products(here, there, points[3 * n + i], s->quarter);
        }
    }
    srnf_free(points);
    srnf_free(nodes);
    return status;
}

/* f <- f o Rz, in place; cosine and sine of the angle. */
SIMD_INLINE void turn(double cosine, double sine, simd f[COUNT])
{
    double c = 1.0, s = 0.0;

    for (size_t m = 1; m <= DEGREE; m++) {
        double next = c * cosine - s * sine;

        s = s * cosine + c * sine;
        c = next;
        for (size_t l = m; l <= DEGREE; l++) {
            simd even = f[l * l + l + m];
            simd odd = f[l * l + l - m];

            f[l * l + l + m] = SIMD_SET(c) * even + SIMD_SET(s) * odd;
            f[l * l + l - m] = SIMD_SET(c) * odd - SIMD_SET(s) * even;
        }
    }
}

/* out = f o Q, or f o Q' */
SIMD_INLINE void tip(const double *quarter, bool back, const simd f[COUNT], simd out[COUNT])
{
    for (size_t l = 0; l <= DEGREE; l++) {
        size_t width = 2 * l + 1;

        for (size_t a = 0; a < width; a++) {
            simd sum = SIMD_SET(0.0);

            for (size_t b = 0; b < width; b++) {
                sum += SIMD_SET(quarter[back ? b * width + a : a * width + b]) * f[l * l + b];
            }
            out[l * l + a] = sum;
        }
        quarter += width * width;
    }
}

/* Overlap of q1 with the turned q2, over rotations of the values. */
SRNF_HOT static void overlap(const struct screen *s, const double r[9], double b[9])
{
    double sine = sqrt(r[2] * r[2] + r[5] * r[5]);
    bool upright = !(sine > 1e-12); /* then a = 0 will do */
    double inverse = upright ? 0.0 : 1.0 / sine;
    simd f[COUNT], g[COUNT];

    for (size_t i = 0; i < COUNT; i++) {
        SIMD_LOAD(f[i], s->second + SRNF_LANES * i);
    }
    turn(upright ? 1.0 : r[2] * inverse, upright ? 0.0 : r[5] * inverse, f);
    tip(s->quarter, true, f, g);
    turn(r[8], sine, g);
    tip(s->quarter, false, g, f);
    turn(upright ? r[4] : -r[6] * inverse, upright ? r[3] : r[7] * inverse, f);
    for (size_t row = 0; row < 3; row++) {
        simd sum = SIMD_SET(0.0);

        for (size_t i = 0; i < COUNT; i++) {
            sum += SIMD_SET(s->first[row * COUNT + i]) * f[i];
        }
        for (size_t c = 0; c < 3; c++) {
            b[3 * row + c] = sum[c];
        }
    }
}

/* The best of those left, again and again; what is near to it is out. */
static size_t thin(struct start_rotation *all, size_t capacity, struct start_rotation *starts)
{
    double near = 1.0 + 2.0 * cos(THIN_DEGREES * SRNF_PI / 180.0); /* trace of the difference */
    size_t count = 0;

    while (count < capacity) {
        size_t best = ROTATIONS;

        for (size_t i = 0; i < ROTATIONS; i++) {
            if (isfinite(all[i].energy) &&
                (best == ROTATIONS || all[i].energy < all[best].energy)) {
                best = i;
            }
        }
        if (best == ROTATIONS) {
            break;
        }
        starts[count] = all[best];
        for (size_t i = 0; i < ROTATIONS; i++) {
            double trace = 0.0;

            for (size_t k = 0; k < 9; k++) {
                trace += all[i].rotation[k] * starts[count].rotation[k];
            }
            if (trace > near) {
                all[i].energy = INFINITY;
            }
        }
        count++;
    }
    return count;
}

size_t registration_screen(const double *first, const double *second, size_t capacity,
                           struct start_rotation *starts, int *status)
{
    struct screen *s = srnf_alloc(1, sizeof *s);
    struct start_rotation *all = srnf_alloc(ROTATIONS, sizeof *all);
    size_t count = 0;

    *status = s && all ? fill_quarter(s) : SRNF_ENOMEM;
    if (*status == SRNF_OK) {
        memcpy(s->first, first, sizeof s->first);
        for (size_t i = 0; i < 3 * COUNT; i++) {
            s->second[SRNF_LANES * (i % COUNT) + i / COUNT] = second[i];
        }
        for (size_t i = 0; i < ROTATIONS; i++) {
            double b[9];

            super_fibonacci(i, ROTATIONS, all[i].rotation);
            overlap(s, all[i].rotation, b);
            all[i].energy = -tabulated_closest_rotation(b, NULL);
        }
        count = thin(all, capacity, starts);
        *status = count > 0 ? SRNF_OK : SRNF_ENUMERIC;
    }
    srnf_free(s);
    srnf_free(all);
    return count;
}

void search_cut_series(size_t degree, const double *series, double *out)
{
    size_t count = srnf_coefficient_count(degree);
    size_t kept = count < COUNT ? count : COUNT;

    memset(out, 0, 3 * COUNT * sizeof *out);
    for (size_t c = 0; c < 3; c++) {
        memcpy(out + c * COUNT, series + c * count, kept * sizeof *out);
    }
}
