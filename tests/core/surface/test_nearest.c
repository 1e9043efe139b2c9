/*
 * test_nearest.c - the nearest point of a surface: points of it are found again to rounding, points
 * off it at their feet, nothing on a fine grid is nearer; what is no number is refused.
 */
#include "core/figures.h"
#include "mesh/mesh_geometry.h"
#include "support/refusing.h"

#define DEGREE 12
#define COUNT ((size_t)40)

static void spread(size_t n, double *points)
{
    for (size_t i = 0; i < n; i++) {
        double z = 1.0 - (2.0 * (double)i + 1.0) / (double)n;
        double phi = 2.399963229728653 * (double)i;

        points[3 * i] = sqrt(1.0 - z * z) * cos(phi);
        points[3 * i + 1] = sqrt(1.0 - z * z) * sin(phi);
        points[3 * i + 2] = z;
    }
}

/* f at points, [n][3]. */
static void images(const struct shapes_surface *s, size_t n, const double *points, double *out)
{
    double *values = shapes_doubles(3 * n);

    assert_int_equal(srnf_harmonics_at_points(s->degree, 3, s->f, n, points, values, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < 3 * n; i++) {
        out[i] = values[i % 3 * n + i / 3];
    }
    srnf_free(values);
}

static const char *const names[] = {"ellipsoid", "bumpy"};

static void finds_points_of_the_surface(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        double points[3 * COUNT], positions[3 * COUNT], found[3 * COUNT], distances[COUNT];
        struct shapes_surface s;

        shapes_open(&s, DEGREE);
        shapes_fill(&s, k ? shapes_bumpy : shapes_ellipsoid, k ? 0.0 : 2.0);
        spread(COUNT, points);
        images(&s, COUNT, points, positions);
        assert_int_equal(
            srnf_surface_nearest(DEGREE, s.f, COUNT, positions, NULL, found, distances), SRNF_OK);
        for (size_t i = 0; i < COUNT; i++) {
            assert_true(distances[i] < 1e-12);
            for (size_t c = 0; c < 3; c++) {
                assert_true(fabs(found[3 * i + c] - points[3 * i + c]) < 1e-10);
            }
        }
        printf("# %s\n", names[k]);
        shapes_close(&s);
    }
}

/* Anywhere: nothing on a fine grid is nearer, and the offset stands on the surface. */
static void finds_the_nearest(void **state)
{
    enum { FINE = 20000 };
    double *fine = shapes_doubles(6 * (size_t)FINE);
    double positions[3 * COUNT], found[3 * COUNT], feet[3 * COUNT], distances[COUNT];
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_bumpy, 0.0);
    spread(FINE, fine);
    images(&s, FINE, fine, fine + 3 * (size_t)FINE);
    spread(COUNT, positions);
    for (size_t i = 0; i < 3 * COUNT; i++) {
        positions[i] *= i % 2 ? 0.6 : 1.7;
    }
    assert_int_equal(srnf_surface_nearest(DEGREE, s.f, COUNT, positions, NULL, found, distances),
                     SRNF_OK);
    images(&s, COUNT, found, feet);
    for (size_t i = 0; i < COUNT; i++) {
        double least = INFINITY;
        double square = 0.0;

        for (size_t c = 0; c < 3; c++) {
            square +=
                (feet[3 * i + c] - positions[3 * i + c]) * (feet[3 * i + c] - positions[3 * i + c]);
        }
        assert_true(fabs(sqrt(square) - distances[i]) < 1e-12);
        for (size_t k = 0; k < FINE; k++) {
            const double *f = fine + 3 * (size_t)FINE + 3 * k;
            double d2 = 0.0;

            for (size_t c = 0; c < 3; c++) {
                d2 += (f[c] - positions[3 * i + c]) * (f[c] - positions[3 * i + c]);
            }
            least = least < d2 ? least : d2;
        }
        assert_true(distances[i] <= sqrt(least) + 1e-12);
    }
    srnf_free(fine);
    shapes_close(&s);
}

static void refuses_what_is_no_number(void **state)
{
    double positions[3] = {0.1, 0.2, NAN}, found[3], distances[1];
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_ellipsoid, 2.0);
    assert_int_equal(srnf_surface_nearest(DEGREE, s.f, 1, positions, NULL, found, distances),
                     SRNF_EINVAL);
    positions[2] = 0.3;
    assert_int_equal(srnf_surface_nearest(0, s.f, 1, positions, NULL, found, distances),
                     SRNF_EINVAL);
    s.f[5] = INFINITY;
    assert_int_equal(srnf_surface_nearest(DEGREE, s.f, 1, positions, NULL, found, distances),
                     SRNF_EINVAL);
    shapes_close(&s);
}

static struct shapes_surface refused;

static int run_refused(void)
{
    double positions[3] = {0.1, 0.2, 0.4}, found[3], distances[1];

    return srnf_surface_nearest(DEGREE, refused.f, 1, positions, NULL, found, distances);
}

static void survives_refusals(void **state)
{
    (void)state;
    shapes_open(&refused, DEGREE);
    shapes_fill(&refused, shapes_ellipsoid, 2.0);
    refusing_sweep("nearest", run_refused, 10, refusing_count("nearest", run_refused) / 10 + 1);
    shapes_close(&refused);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_points_of_the_surface),
        cmocka_unit_test(finds_the_nearest),
        cmocka_unit_test(refuses_what_is_no_number),
        cmocka_unit_test(survives_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
