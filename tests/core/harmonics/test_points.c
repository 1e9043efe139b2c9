/*
 * test_points.c - harmonic series and gradients at arbitrary points: against explicit formulae, the
 * grid transform, differences, and symmetry; regular at and around the poles.
 *
 * srnfd-test: no-asan (api/test_standard.sh runs its code)
 */
#include "fixture.h"
#include "harmonics.h"

#define TOLERANCE 1e-12

static void evaluate(size_t degree, size_t batch, const double *coefficients, size_t n,
                     const double *points, double *values, double *gradients)
{
    assert_int_equal(
        srnf_harmonics_at_points(degree, batch, coefficients, n, points, values, gradients),
        SRNF_OK);
}

static void the_basis_is_the_documented_one(void **state)
{
    struct test_random random = test_random_seed(31);
    double points[41][3];
    double values[41];
    double gradients[41][3];

    (void)state;
    for (size_t p = 0; p < 41; p++) {
        test_random_direction(&random, points[p]);
    }
    for (size_t i = 0; i < HARMONICS; i++) {
        double c[16] = {0.0};

        c[harmonics[i].l * harmonics[i].l + harmonics[i].l + harmonics[i].m] = 1.0;
        evaluate(3, 1, c, 41, points[0], values, gradients[0]);
        for (size_t p = 0; p < 41; p++) {
            double gradient[3];

            assert_at_most(fabs(values[p] - harmonic_at(&harmonics[i], points[p], gradient)),
                           1e-14);
            assert_at_most(compare_difference(3, gradients[p], gradient), 1e-14);
        }
    }
}

/* Values at every node of a grid against synthesis, and the gradient's components against the
   gradient. */
static void check_against_grid(size_t degree, const struct grid_shape *shape,
                               struct test_random *random)
{
    struct fixture f;
    double *c;
    double *grid; /* [3] values, d_theta, d_phi */
    double *nodes;
    double *at; /* values, then gradients */
    double largest;

    fixture_open(&f, degree, shape);
    c = fixture_normals(random, f.coefficients);
    grid = fixture_doubles(3 * f.points);
    nodes = fixture_doubles(3 * f.points);
    at = fixture_doubles(4 * f.points);
    srnf_sht_synthesis(f.sht, 1, c, grid, f.workspace);
    srnf_sht_gradient(f.sht, 1, c, grid + f.points, grid + 2 * f.points, f.workspace);
    for (size_t i = 0; i < f.points; i++) {
        fixture_node(f.grid, i / f.grid->n_phi, i % f.grid->n_phi, nodes + 3 * i);
    }
    evaluate(degree, 1, c, f.points, nodes, at, at + f.points);
    assert_at_most(compare_relative(f.points, at, grid), TOLERANCE);
    largest = compare_largest(2 * f.points, grid + f.points);
    for (size_t i = 0; i < f.points; i++) {
        const double *gradient = at + f.points + 3 * i;
        double e_theta[3];
        double e_phi[3];

        fixture_frame(f.grid, i / f.grid->n_phi, i % f.grid->n_phi, e_theta, e_phi);
        assert_at_most(fabs(fixture_dot3(gradient, e_theta) - grid[f.points + i]),
                       TOLERANCE * largest);
        assert_at_most(fabs(fixture_dot3(gradient, e_phi) - grid[2 * f.points + i]),
                       TOLERANCE * largest);
        assert_at_most(fabs(fixture_dot3(gradient, nodes + 3 * i)), TOLERANCE * largest);
    }
    srnf_free(c);
    srnf_free(grid);
    srnf_free(nodes);
    srnf_free(at);
    fixture_close(&f);
}

static void points_agree_with_the_grid(void **state)
{
    static const size_t degrees[] = {1, 4, 15, 31, 63};
    struct test_random random = test_random_seed(32);

    (void)state;
    for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++) {
        check_against_grid(degrees[i], &grid_shapes[0], &random);
        check_against_grid(degrees[i], &grid_shapes[4], &random); /* poles included */
    }
    check_against_grid(SRNF_DEGREE_MAX, &grid_shapes[1], &random);
}

static void gradients_are_tangent(void **state)
{
    struct test_random random = test_random_seed(33);
    double points[64][3];
    double gradients[64][3];
    double *c = fixture_normals(&random, srnf_coefficient_count(40));

    (void)state;
    for (size_t p = 0; p < 64; p++) {
        test_random_direction(&random, points[p]);
    }
    evaluate(40, 1, c, 64, points[0], NULL, gradients[0]);
    for (size_t p = 0; p < 64; p++) {
        double length = sqrt(fixture_dot3(gradients[p], gradients[p]));

        assert_at_most(fabs(fixture_dot3(gradients[p], points[p])), 1e-14 * length);
    }
    srnf_free(c);
}

/* Moves from p along the unit tangent t by the angle h, on the great circle. */
static void step(const double p[3], const double t[3], double h, double out[3])
{
    for (size_t i = 0; i < 3; i++) {
        out[i] = cos(h) * p[i] + sin(h) * t[i];
    }
}

/* Largest error of the central difference of step h in random directions at random points and at
   the poles. */
static double difference_error(size_t degree, const double *c, double h)
{
    struct test_random random = test_random_seed(34);
    double largest = 0.0;

    for (size_t repetition = 0; repetition < 40; repetition++) {
        double points[3][3] = {{0.0, 0.0, repetition % 2 == 0 ? 1.0 : -1.0}};
        double t[3];
        double values[3];
        double gradients[3][3];
        double along;
        double length;

        if (repetition >= 8) {
            test_random_direction(&random, points[0]);
        }
        test_random_direction(&random, t);
        along = fixture_dot3(t, points[0]);
        for (size_t i = 0; i < 3; i++) {
            t[i] -= along * points[0][i];
        }
        length = sqrt(fixture_dot3(t, t));
        for (size_t i = 0; i < 3; i++) {
            t[i] /= length;
        }
        step(points[0], t, h, points[1]);
        step(points[0], t, -h, points[2]);
        evaluate(degree, 1, c, 3, points[0], values, gradients[0]);
        largest = compare_max(
            largest, fabs((values[1] - values[2]) / (2.0 * h) - fixture_dot3(gradients[0], t)));
    }
    return largest;
}

/* Halving the step quarters the error of central differences: the gradient is the limit, not a
   neighbour of it. */
static void differences_converge_to_the_gradient_in_second_order(void **state)
{
    static const size_t degrees[] = {4, 15, 31};
    struct test_random random = test_random_seed(35);

    (void)state;
    for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++) {
        double *c = fixture_normals(&random, srnf_coefficient_count(degrees[i]));
        double before = 0.0;
        double h = 0.1 / (double)degrees[i];

        for (size_t halving = 0; halving < 6; halving++, h *= 0.5) {
            double error = difference_error(degrees[i], c, h);

            if (halving > 0) {
                assert_at_most(fabs(log2(before / error) - 2.0), 0.02);
            }
            before = error;
        }
        srnf_free(c);
    }
}

/* Around each pole, at distances from 1e-320 to 1e-6 on all sides: values and gradients are those
   of the pole. */
static void series_are_regular_at_the_poles(void **state)
{
    const size_t degree = 15;
    struct test_random random = test_random_seed(36);
    double *c = fixture_normals(&random, srnf_coefficient_count(degree));

    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        double pole[3] = {0.0, 0.0, (double)side};
        double pole_value;
        double pole_gradient[3];
        double size;

        evaluate(degree, 1, c, 1, pole, &pole_value, pole_gradient);
        size = fabs(pole_value) + sqrt(fixture_dot3(pole_gradient, pole_gradient));
        for (int exponent = -320; exponent <= -6; exponent++) {
            for (int turn = 0; turn < 8; turn++) {
                double distance = pow(10.0, (double)exponent);
                double angle = 0.3 + 0.25 * SRNF_PI * (double)turn;
                double near[3] = {distance * cos(angle), distance * sin(angle), (double)side};
                double value;
                double gradient[3];
                double bound = size * (1e-13 + 1e3 * distance);

                evaluate(degree, 1, c, 1, near, &value, gradient);
                assert_at_most(fabs(value - pole_value), bound);
                assert_at_most(compare_difference(3, gradient, pole_gradient), bound);
            }
        }
    }
    srnf_free(c);
}

/* Results do not depend on company: any n, any place in the list, values or gradients alone, one
   field of many. */
static void points_and_fields_do_not_disturb_each_other(void **state)
{
    enum { DEGREE = 12, POINTS = 11, BATCH = 5, COUNT = (DEGREE + 1) * (DEGREE + 1) };
    struct test_random random = test_random_seed(37);
    double points[POINTS][3];
    double values[BATCH][POINTS];
    double gradients[BATCH][POINTS][3];
    double *c = fixture_normals(&random, (size_t)BATCH * COUNT);

    (void)state;
    for (size_t p = 0; p < POINTS; p++) {
        test_random_direction(&random, points[p]);
    }
    evaluate(DEGREE, BATCH, c, POINTS, points[0], values[0], gradients[0][0]);
    for (size_t field = 0; field < BATCH; field++) {
        for (size_t p = 0; p < POINTS; p++) {
            double value;
            double gradient[3];

            evaluate(DEGREE, 1, c + field * COUNT, 1, points[p], &value, NULL);
            evaluate(DEGREE, 1, c + field * COUNT, 1, points[p], NULL, gradient);
            assert_memory_equal(&value, &values[field][p], sizeof value);
            assert_memory_equal(gradient, gradients[field][p], sizeof gradient);
        }
    }
    evaluate(DEGREE, BATCH, c, 0, NULL, NULL, NULL);
    evaluate(DEGREE, 0, NULL, POINTS, points[0], NULL, NULL);
    srnf_free(c);
}

/* Rows of a rotation by the angle about the axis (Rodrigues). */
static void rotation(const double axis[3], double angle, double out[3][3])
{
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            size_t k = 3 - i - j;
            double cross = i == j ? 0.0 : ((j + 3 - i) % 3 == 1 ? -axis[k] : axis[k]);

            out[i][j] = cos(angle) * (i == j ? 1.0 : 0.0) + sin(angle) * cross +
                        (1.0 - cos(angle)) * axis[i] * axis[j];
        }
    }
}

/* A rotated series is one of the same degree with the same power in every degree: the spaces of
   fixed l are invariant. Sampled at the rotated nodes, analysed on the grid. */
static void rotations_keep_the_power_of_every_degree(void **state)
{
    const size_t degree = 31;
    struct test_random random = test_random_seed(38);
    struct fixture f;
    double axis[3];
    double turn[3][3];
    double *c;
    double *rotated;
    double *nodes;
    double *values;

    (void)state;
    fixture_open(&f, degree, &grid_shapes[0]);
    c = fixture_normals(&random, f.coefficients);
    rotated = fixture_doubles(f.coefficients);
    nodes = fixture_doubles(3 * f.points);
    values = fixture_doubles(f.points);
    test_random_direction(&random, axis);
    rotation(axis, 2.0, turn);
    for (size_t i = 0; i < f.points; i++) {
        double e[3];

        fixture_node(f.grid, i / f.grid->n_phi, i % f.grid->n_phi, e);
        for (size_t k = 0; k < 3; k++) {
            nodes[3 * i + k] = fixture_dot3(turn[k], e);
        }
    }
    evaluate(degree, 1, c, f.points, nodes, values, NULL);
    srnf_sht_analysis(f.sht, 1, values, rotated, f.workspace);
    for (size_t l = 0; l <= degree; l++) {
        double power = fixture_dot(2 * l + 1, c + l * l, c + l * l);

        assert_at_most(fabs(fixture_dot(2 * l + 1, rotated + l * l, rotated + l * l) / power - 1.0),
                       1e-11);
    }
    assert_true(compare_relative(f.coefficients, rotated, c) > 0.1);
    srnf_free(c);
    srnf_free(rotated);
    srnf_free(nodes);
    srnf_free(values);
    fixture_close(&f);
}

/* Y_l0 = sqrt((2l + 1) / (4 pi)) P_l and Y_ll in closed form, at the highest degree accepted. */
static void the_highest_degree_is_accurate(void **state)
{
    const size_t degree = SRNF_TRANSFORM_DEGREE_MAX;
    double *c = srnf_alloc(srnf_coefficient_count(degree), sizeof(double));
    double norm = sqrt((2.0 * (double)degree + 1.0) / (4.0 * SRNF_PI));
    double sectoral = 0.5 / SRNF_PI;

    (void)state;
    assert_non_null(c);
    for (size_t k = 1; k <= degree; k++) {
        sectoral *= (2.0 * (double)k + 1.0) / (2.0 * (double)k);
    }
    sectoral = sqrt(sectoral);
    for (size_t i = 0; i <= 12; i++) {
        double theta = SRNF_PI * (double)i / 12.0 + (i == 6 ? 1e-3 : 0.0);
        double e[3] = {sin(theta), 0.0, cos(theta)};
        size_t last = srnf_coefficient_count(degree) - 1;
        double value;
        double expected;

        c[last] = 0.0;
        c[degree * degree + degree] = 1.0;
        evaluate(degree, 1, c, 1, e, &value, NULL);
        expected = norm * (double)fixture_legendre(degree, (long double)cos(theta));
        assert_at_most(fabs(value - expected), 1e-11 * norm);
        c[degree * degree + degree] = 0.0;
        c[last] = 1.0;
        evaluate(degree, 1, c, 1, e, &value, NULL);
        assert_at_most(fabs(value - sectoral * pow(sin(theta), (double)degree)),
                       TOLERANCE * sectoral);
    }
    srnf_free(c);
}

static void wrong_degrees_are_refused(void **state)
{
    double c = 1.0;
    double point[3] = {0.0, 0.0, 1.0};
    double value = 7.0;

    (void)state;
    assert_int_equal(
        srnf_harmonics_at_points(SRNF_TRANSFORM_DEGREE_MAX + 1, 1, &c, 1, point, &value, NULL),
        SRNF_EINVAL);
    assert_int_equal(srnf_harmonics_at_points(SIZE_MAX, 1, &c, 1, point, &value, NULL),
                     SRNF_EINVAL);
    assert_true(value == 7.0);
    evaluate(0, 1, &c, 1, point, &value, NULL);
    assert_at_most(fabs(value - 0.5 / sqrt(SRNF_PI)), 1e-16);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_basis_is_the_documented_one),
        cmocka_unit_test(points_agree_with_the_grid),
        cmocka_unit_test(gradients_are_tangent),
        cmocka_unit_test(differences_converge_to_the_gradient_in_second_order),
        cmocka_unit_test(series_are_regular_at_the_poles),
        cmocka_unit_test(points_and_fields_do_not_disturb_each_other),
        cmocka_unit_test(rotations_keep_the_power_of_every_degree),
        cmocka_unit_test(the_highest_degree_is_accurate),
        cmocka_unit_test(wrong_degrees_are_refused),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
