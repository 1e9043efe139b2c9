/*
 * test_spherical_orientation.c - the sign of det(a, b, c) that decides whether a spherical triangle
 * is turned over, against exact integers; and the verdict on whole maps that rests on it.
 *
 * Coordinates are integers of at most 53 bits times a power of two. A minor of two rows then has
 * 107 bits and fits 128; the three products of the expansion are added in two parts, high * 2^53 +
 * low with 0 <= low < 2^53, so that nothing is ever rounded.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>

#include "sphere_map/sphere_map.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/triangulations.h"

__extension__ typedef __int128 wide;

#define PART_BITS 53
#define CASES 200000

/* Sign of the determinant of three integer vectors of at most 53 bits. */
static int integer_sign(int64_t v[3][3])
{
    wide high = 0;
    wide low = 0;

    for (size_t k = 0; k < 3; k++) {
        size_t i = (k + 1) % 3;
        size_t j = (k + 2) % 3;
        wide minor = (wide)v[1][i] * v[2][j] - (wide)v[1][j] * v[2][i];
        wide upper = minor >> PART_BITS; /* arithmetic: rounds down */
        wide lower = minor - upper * ((wide)1 << PART_BITS);

        high += upper * v[0][k];
        low += lower * v[0][k];
    }
    high += low >> PART_BITS;
    low -= (low >> PART_BITS) * ((wide)1 << PART_BITS);
    return high != 0 ? (high > 0 ? 1 : -1) : low > 0;
}

/* All six orders of the rows, each row scaled by its own power of two: signs must follow the
   permutation. */
static void assert_signs(int64_t v[3][3], const int exponent[3])
{
    static const size_t orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                        {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    int expected = integer_sign(v);
    double p[3][3];

    for (size_t r = 0; r < 3; r++) {
        for (size_t k = 0; k < 3; k++) {
            p[r][k] = ldexp((double)v[r][k], exponent[r]);
        }
    }
    for (size_t i = 0; i < 6; i++) {
        int sign = spherical_orientation(p[orders[i][0]], p[orders[i][1]], p[orders[i][2]]);

        assert_int_equal(sign, i < 3 ? expected : -expected);
    }
}

static int64_t random_integer(struct test_random *random, int bits)
{
    int64_t magnitude = (int64_t)(test_random_bits(random) >> (64 - bits));

    return test_random_bits(random) & 1 ? magnitude : -magnitude;
}

static void random_vector(struct test_random *random, int bits, int64_t v[3])
{
    for (size_t k = 0; k < 3; k++) {
        v[k] = random_integer(random, bits);
    }
}

static void random_exponents(struct test_random *random, int range, int exponent[3])
{
    for (size_t r = 0; r < 3; r++) {
        exponent[r] = (int)test_random_below(random, (size_t)(2 * range + 1)) - range;
    }
}

static void test_oracle(void **state)
{
    int64_t unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int64_t mirrored[3][3] = {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
    int64_t flat[3][3] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
    (void)state;

    assert_int_equal(integer_sign(unit), 1);
    assert_int_equal(integer_sign(mirrored), -1);
    assert_int_equal(integer_sign(flat), 0);
}

static void test_general_position(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t i = 0; i < CASES; i++) {
        int64_t v[3][3];
        int exponent[3];
        int bits = 2 + (int)test_random_below(&random, 52);

        for (size_t r = 0; r < 3; r++) {
            random_vector(&random, bits, v[r]);
        }
        random_exponents(&random, 200, exponent);
        assert_signs(v, exponent);
    }
}

/* c = i a + j b + d with a small d or none: on the plane of a and b through the origin, or a
   rounding away from it. The determinant is that of a, b, d. */
static void test_near_planes(void **state)
{
    struct test_random random = test_random_seed(2);
    size_t zeros = 0;
    size_t long_ones = 0;
    (void)state;

    for (size_t i = 0; i < CASES; i++) {
        int bits = 3 + (int)test_random_below(&random, 26);
        int64_t v[3][3];
        int64_t along = random_integer(&random, 52 - bits);
        int64_t across = random_integer(&random, 52 - bits);
        int exponent[3];
        double size = 0.0;

        random_vector(&random, bits, v[0]);
        random_vector(&random, bits, v[1]);
        for (size_t k = 0; k < 3; k++) {
            int64_t away = (int64_t)test_random_below(&random, 3) - 1;

            v[2][k] = along * v[0][k] + across * v[1][k] + (i % 3 == 0 ? 0 : away);
            size += fabs((double)v[2][k]);
        }
        random_exponents(&random, 200, exponent);
        assert_signs(v, exponent);
        zeros += integer_sign(v) == 0;
        long_ones += size > 0x1p50;
    }
    printf("# %d cases near planes: %zu on them, %zu with sums of 50 bits or more\n", CASES, zeros,
           long_ones);
    assert_true(zeros > CASES / 4 && zeros < CASES / 2 && long_ones > CASES / 20);
}

/* Three points of a small grid on one plane through the origin: exactly 0, whichever plane. */
static void test_grid_planes(void **state)
{
    size_t zeros = 0;
    size_t all = 0;
    (void)state;

    for (int64_t code = 0; code < 27 * 27 * 27; code++) {
        int64_t v[3][3];
        int64_t rest = code;

        for (size_t r = 0; r < 3; r++) {
            for (size_t k = 0; k < 3; k++) {
                v[r][k] = rest % 3 - 1;
                rest /= 3;
            }
        }
        assert_signs(v, (const int[3]){0, -20, 30});
        zeros += integer_sign(v) == 0;
        all++;
    }
    printf("# %zu triples of the grid {-1, 0, 1}^3: %zu on a plane through the origin\n", all,
           zeros);
}

/* Doubles as they occur: unit vectors on a great circle, rounded. 53-bit coordinates in units of
   2^-54. */
static void test_great_circles(void **state)
{
    struct test_random random = test_random_seed(3);
    size_t signs[3] = {0};
    (void)state;

    for (size_t i = 0; i < CASES / 10; i++) {
        double p[3][3];
        int64_t v[3][3];
        double t = test_random_uniform(&random, 0.0, 1.0);

        test_random_direction(&random, p[0]);
        test_random_direction(&random, p[1]);
        for (size_t k = 0; k < 3; k++) {
            p[2][k] = p[0][k] + t * (p[1][k] - p[0][k]);
        }
        for (size_t r = 0; r < 3; r++) {
            for (size_t k = 0; k < 3; k++) {
                v[r][k] = (int64_t)llrint(ldexp(p[r][k], PART_BITS - 1));
            }
        }
        assert_signs(v, (const int[3]){1 - PART_BITS, 1 - PART_BITS, 1 - PART_BITS});
        signs[integer_sign(v) + 1]++;
    }
    printf("# great circles: %zu negative, %zu zero, %zu positive\n", signs[0], signs[1], signs[2]);
    assert_true(signs[0] > 0 && signs[2] > 0);
}

/* Repeated and opposite points, and zero vectors. */
static void test_degenerate(void **state)
{
    struct test_random random = test_random_seed(4);
    (void)state;

    for (size_t i = 0; i < CASES / 10; i++) {
        int64_t v[3][3];
        int64_t factor = (int64_t)test_random_below(&random, 5) - 2;
        int exponent[3];

        random_vector(&random, 50, v[0]);
        random_vector(&random, 50, v[1]);
        for (size_t k = 0; k < 3; k++) {
            v[2][k] = factor * v[i % 2][k];
        }
        assert_int_equal(integer_sign(v), 0);
        random_exponents(&random, 200, exponent);
        assert_signs(v, exponent);
    }
}

/* ---- Whole maps ------------------------------------------------------------------------------ */

/* One vertex on the opposite side of the sphere, on an edge, or where it was. */
static void test_verdict_on_flips(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(6);
    size_t flipped = 9;
    (void)state;

    assert_true(spherical_verify(&mesh, mesh.vertices, &flipped));
    assert_int_equal(flipped, 0);
    for (size_t v = 0; v < mesh.n_vertices; v += 17) {
        double *p = mesh.vertices + 3 * v;
        double kept[3] = {p[0], p[1], p[2]};

        for (size_t k = 0; k < 3; k++) {
            p[k] = -kept[k];
        }
        assert_false(spherical_verify(&mesh, mesh.vertices, &flipped));
        assert_true(flipped > 0);
        for (size_t k = 0; k < 3; k++) {
            p[k] = kept[k];
        }
    }
    for (size_t k = 0; k < 3; k++) { /* two corners at one point: two faces without area */
        mesh.vertices[3 * mesh.faces[0] + k] = mesh.vertices[3 * mesh.faces[1] + k];
    }
    assert_false(spherical_verify(&mesh, mesh.vertices, &flipped));
    assert_true(flipped >= 2);
    srnf_mesh_clear(&mesh);
    mesh = meshes_inside_out_sphere(6);
    assert_false(spherical_verify(&mesh, mesh.vertices, &flipped));
    assert_int_equal(flipped, mesh.n_faces);
    srnf_mesh_clear(&mesh);
}

/* A rim that runs around the equator several times: no face is turned over, and yet the map is no
   bijection. */
static void test_verdict_on_coverings(void **state)
{
    (void)state;
    for (size_t times = 1; times <= 4; times++) {
        struct srnf_mesh mesh = triangulations_bipyramid(12);
        size_t flipped = 9;

        for (size_t i = 0; i < 12; i++) {
            double phi = 2.0 * SRNF_PI * (double)(times * i) / 12.0;

            mesh.vertices[3 * (2 + i)] = cos(phi);
            mesh.vertices[3 * (2 + i) + 1] = sin(phi);
        }
        assert_int_equal(spherical_verify(&mesh, mesh.vertices, &flipped), times == 1);
        assert_int_equal(flipped, 0);
        srnf_mesh_clear(&mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_oracle),           cmocka_unit_test(test_general_position),
        cmocka_unit_test(test_near_planes),      cmocka_unit_test(test_grid_planes),
        cmocka_unit_test(test_great_circles),    cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_verdict_on_flips), cmocka_unit_test(test_verdict_on_coverings),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
