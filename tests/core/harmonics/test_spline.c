/*
 * test_spline.c - fields tabulated as splines on the sphere: convergence, the transpose, the filter
 * at the nodes; and the functions of four numbers at once against libm.
 */
#include <stdio.h>

#include "fixture.h"
#include "harmonics/spline_lanes.h"

#include "support/random.h"

#define DEGREE ((size_t)9)

/* |a - b| in units of the last place of b. */
static double places(double a, double b)
{
    return fabs(a - b) / (fabs(b) + 1e-300) / 0x1p-52;
}

static void lanes_are_those_of_libm(void **state)
{
    struct test_random random = test_random_seed(301);
    double angle = 0.0, logarithm = 0.0, root = 0.0, turn = 0.0;

    (void)state;
    for (size_t k = 0; k < 20000; k++) {
        double size = pow(10.0, test_random_uniform(&random, -12.0, 12.0));
        double x = test_random_normal(&random) * (k % 3 ? 1.0 : size);
        double y = test_random_normal(&random);
        double u = test_random_uniform(&random, 0.0, 9.8);
        simd a = SIMD_SET(y), b = SIMD_SET(x), c = SIMD_SET(size), d = SIMD_SET(u);
        simd out, other;

        simd_atan2(&a, &b, &out);
        angle = compare_max(angle, places(out[k % 4], atan2(y, x)));
        simd_log(&c, &out);
        logarithm = compare_max(logarithm, places(out[k % 4], log(size)));
        simd_sqrt(&c, &out);
        root = compare_max(root, places(out[k % 4], sqrt(size)));
        simd_cos_sinc(&d, &out, &other);
        turn = compare_max(turn, fabs(out[0] - cos(sqrt(u))));
        turn = compare_max(turn, fabs(other[0] - sin(sqrt(u)) / sqrt(u)));
    }
    assert_at_most(angle, 4.0);
    assert_at_most(logarithm, 4.0);
    assert_at_most(root, 0.0);
    assert_at_most(turn, 1e-14);
    {
        simd zero = SIMD_SET(0.0), south = SIMD_SET(-1.0), out;

        simd_atan2(&zero, &south, &out);
        assert_at_most(fabs(out[0] - SRNF_PI), 0.0);
        simd_atan2(&zero, &zero, &out);
        assert_at_most(fabs(out[0]), 0.0);
    }
}

/* Four fields of a degree at the nodes of a table. */
static void fill(struct sphere_spline *s, const double *coefficients)
{
    size_t n = (s->rows + 1) * s->columns;
    struct srnf_sht *sht;
    double *values = fixture_doubles(4 * n);
    void *workspace;

    assert_int_equal(srnf_sht_create(&sht, DEGREE, SRNF_GRID_EQUIANGULAR, s->rows + 1, s->columns),
                     SRNF_OK);
    workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 4));
    srnf_sht_synthesis(sht, 4, coefficients, values, workspace);
    for (size_t i = 0; i < 4 * n; i++) {
        sphere_spline_node(s, i % n / s->columns, i % n % s->columns)[i / n] = values[i];
    }
    srnf_free(workspace);
    srnf_free(values);
    srnf_sht_destroy(sht);
}

struct gathered {
    double value[4], along[4], across[4]; /* components of one point */
};

static struct gathered gather_at(const struct sphere_spline *s, const double point[3])
{
    struct spline_place place;
    simd p[3] = {SIMD_SET(point[0]), SIMD_SET(point[1]), SIMD_SET(point[2])};
    simd value, along, across;
    struct gathered out;

    spline_place(s, s->order, p, true, &place);
    spline_gather(s, s->order, &place, 2, &value, &along, &across);
    for (size_t c = 0; c < 4; c++) {
        out.value[c] = value[c];
        out.along[c] = along[c];
        out.across[c] = across[c];
    }
    return out;
}

/* Largest error of values and of derivatives over random points. */
static double error_of(size_t order, size_t rows)
{
    struct test_random random = test_random_seed(302);
    size_t count = srnf_coefficient_count(DEGREE);
    double *c = fixture_normals(&random, 4 * count);
    struct sphere_spline s;
    double worst = 0.0;

    assert_int_equal(sphere_spline_create(&s, order, rows), SRNF_OK);
    fill(&s, c);
    sphere_spline_filter(&s);
    for (size_t k = 0; k < 400; k++) {
        double p[3], values[4], gradients[4][3];
        struct gathered at;
        double rho, theta[3], phi[3];

        test_random_direction(&random, p);
        rho = sqrt(p[0] * p[0] + p[1] * p[1]);
        theta[0] = p[2] * p[0] / rho;
        theta[1] = p[2] * p[1] / rho;
        theta[2] = -rho;
        phi[0] = -p[1] / rho;
        phi[1] = p[0] / rho;
        phi[2] = 0.0;
        assert_int_equal(srnf_harmonics_at_points(DEGREE, 4, c, 1, p, values, gradients[0]),
                         SRNF_OK);
        at = gather_at(&s, p);
        for (size_t i = 0; i < 4; i++) {
            double along = 0.0, across = 0.0;

            for (size_t j = 0; j < 3; j++) {
                along += gradients[i][j] * theta[j];
                across += gradients[i][j] * phi[j];
            }
            worst = compare_max(worst, fabs(at.value[i] - values[i]));
            worst = compare_max(worst, fabs(at.along[i] - along) / (double)DEGREE);
            worst = compare_max(worst, fabs(at.across[i] - across) / (double)DEGREE);
        }
    }
    sphere_spline_clear(&s);
    srnf_free(c);
    return worst;
}

/* Derivatives lose one order. */
static void errors_fall_by_the_order(void **state)
{
    (void)state;
    for (size_t order = 4; order <= 8; order += 2) {
        double coarse = error_of(order, 24);
        double fine = error_of(order, 48);

        printf("# order %zu: %.1e, %.1e\n", order, coarse, fine);
        assert_at_most(fine, coarse / pow(2.0, (double)order - 1.3));
        assert_at_most(fine, order == 4 ? 1e-2 : order == 6 ? 1e-3 : 1e-4);
    }
}

/* At its nodes the spline has the values that it was made from. */
static void nodes_keep_their_values(void **state)
{
    struct test_random random = test_random_seed(303);
    double *c = fixture_normals(&random, 4 * srnf_coefficient_count(DEGREE));
    (void)state;

    for (size_t order = 4; order <= 8; order += 2) {
        struct sphere_spline s, values;
        double worst = 0.0;

        assert_int_equal(sphere_spline_create(&s, order, 20), SRNF_OK);
        assert_int_equal(sphere_spline_create(&values, order, 20), SRNF_OK);
        fill(&s, c);
        fill(&values, c);
        sphere_spline_filter(&s);
        for (size_t i = 0; i < 21 * 40; i++) {
            double theta = SRNF_PI * (double)(i / 40) / 20.0;
            double phi = SRNF_PI * (double)(i % 40) / 20.0;
            double p[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            struct gathered at = gather_at(&s, p);

            for (size_t k = 0; k < 4; k++) {
                worst = compare_max(
                    worst, fabs(at.value[k] - sphere_spline_node(&values, i / 40, i % 40)[k]));
            }
        }
        assert_at_most(worst, 3e-7); /* poles are taken at 1e-8 radians */
        sphere_spline_clear(&s);
        sphere_spline_clear(&values);
    }
    srnf_free(c);
}

/* <load, spline of x at a point> = <folded load, x> for any x, single-valued at the poles or
   not. */
static void fold_is_the_transpose(void **state)
{
    (void)state;
    for (size_t order = 4; order <= 8; order += 2) {
        struct test_random random = test_random_seed(304);
        struct sphere_spline x, y;
        double here = 0.0, there = 0.0;
        size_t n;

        assert_int_equal(sphere_spline_create(&x, order, 12), SRNF_OK);
        assert_int_equal(sphere_spline_create(&y, order, 12), SRNF_OK);
        n = 13 * 24;
        for (size_t i = 0; i < n; i++) {
            test_random_normals(&random, 4, sphere_spline_node(&x, i / 24, i % 24));
        }
        {
            double *copy = fixture_doubles(4 * n);

            for (size_t i = 0; i < n; i++) {
                memcpy(copy + 4 * i, sphere_spline_node(&x, i / 24, i % 24), 4 * sizeof(double));
            }
            sphere_spline_filter(&x);
            sphere_spline_zero(&y);
            for (size_t k = 0; k < 60; k++) {
                double p[3], load[4];
                struct spline_place place;
                struct gathered at;
                simd lanes[3], four;

                test_random_direction(&random, p);
                test_random_normals(&random, 4, load);
                at = gather_at(&x, p);
                for (size_t c = 0; c < 3; c++) {
                    lanes[c] = SIMD_SET(p[c]);
                }
                SIMD_LOAD(four, load);
                spline_place(&y, order, lanes, false, &place);
                spline_spread(&y, order, &place, 1, &four);
                for (size_t c = 0; c < 4; c++) {
                    here += load[c] * at.value[c];
                }
            }
            sphere_spline_fold(&y);
            for (size_t i = 0; i < 4 * n; i++) {
                there += copy[i] * sphere_spline_node(&y, i / 4 / 24, i / 4 % 24)[i % 4];
            }
            srnf_free(copy);
        }
        assert_at_most(fabs(here - there) / fabs(here), 1e-10);
        sphere_spline_clear(&x);
        sphere_spline_clear(&y);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lanes_are_those_of_libm),
        cmocka_unit_test(errors_fall_by_the_order),
        cmocka_unit_test(nodes_keep_their_values),
        cmocka_unit_test(fold_is_the_transpose),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
