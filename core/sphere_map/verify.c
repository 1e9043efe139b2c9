/*
 * verify.c - is a map to the sphere a bijection? Exact signs of determinants, and the
 * degree.
 *
 * If every spherical triangle is positively oriented the map is a covering of the sphere; if the
 * solid angles sum to 4 pi it covers once. The determinant's sign comes from floating point where a
 * bound on its rounding decides, and from an exact expansion otherwise (J. R. Shewchuk, "Adaptive
 * precision floating-point arithmetic and fast robust geometric predicates", 1997): six products of
 * three doubles are 24 exact terms, added without loss. This file must be compiled without fused or
 * reordered arithmetic, beyond the fma it asks for.
 */
#include "sphere_map.h"

#define FILTER 8e-16 /* times the permanent: bounds the rounding of the plain determinant */
#define TERMS 24
#define ANGLE_TOLERANCE 1e-6

/* a + b = sum + error, exactly. */
static void two_sum(double a, double b, double *sum, double *error)
{
    double s = a + b;
    double t = s - a;

    *error = (a - (s - t)) + (b - t);
    *sum = s;
}

/* Adds x to an expansion of non-overlapping terms of increasing size. */
static size_t grow(double *expansion, size_t count, double x)
{
    size_t kept = 0;

    for (size_t i = 0; i < count; i++) {
        double error;

        two_sum(x, expansion[i], &x, &error);
        if (error != 0.0) {
            expansion[kept++] = error;
        }
    }
    if (x != 0.0) {
        expansion[kept++] = x;
    }
    return kept;
}

/* Adds +- a b c exactly: four terms. */
static size_t add_product(double *expansion, size_t count, double a, double b, double c)
{
    double high = a * b;
    double low = fma(a, b, -high);
    double first = high * c;
    double second = low * c;

    count = grow(expansion, count, fma(low, c, -second));
    count = grow(expansion, count, second);
    count = grow(expansion, count, fma(high, c, -first));
    return grow(expansion, count, first);
}

static int exact_sign(const double a[3], const double b[3], const double c[3])
{
    double expansion[TERMS];
    size_t count = 0;

    for (size_t k = 0; k < 3; k++) {
        count = add_product(expansion, count, a[k], b[(k + 1) % 3], c[(k + 2) % 3]);
        count = add_product(expansion, count, -a[k], b[(k + 2) % 3], c[(k + 1) % 3]);
    }
    if (count == 0) {
        return 0;
    }
    return expansion[count - 1] > 0.0 ? 1 : -1;
}

int spherical_orientation(const double a[3], const double b[3], const double c[3])
{
    double determinant = 0.0;
    double permanent = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double p = b[(k + 1) % 3] * c[(k + 2) % 3];
        double m = b[(k + 2) % 3] * c[(k + 1) % 3];

        determinant += a[k] * (p - m);
        permanent += fabs(a[k]) * (fabs(p) + fabs(m));
    }
    if (fabs(determinant) > FILTER * permanent) {
        return determinant > 0.0 ? 1 : -1;
    }
    return exact_sign(a, b, c);
}

/* Solid angle of a positively oriented triangle: A. van Oosterom, J. Strackee 1983. */
static double solid_angle(const double *a, const double *b, const double *c)
{
    double cross[3];

    vector_cross(b, c, cross);
    return 2.0 * atan2(vector_dot(a, cross),
                       1.0 + vector_dot(a, b) + vector_dot(b, c) + vector_dot(c, a));
}

bool spherical_verify(const struct srnf_mesh *mesh, const double *points, size_t *flipped)
{
    double total = 0.0;

    *flipped = 0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *face = mesh->faces + 3 * f;
        const double *a = points + 3 * (size_t)face[0];
        const double *b = points + 3 * (size_t)face[1];
        const double *c = points + 3 * (size_t)face[2];

        *flipped += spherical_orientation(a, b, c) <= 0;
        total += solid_angle(a, b, c);
    }
    return *flipped == 0 && fabs(total - 4.0 * SRNF_PI) < ANGLE_TOLERANCE;
}
