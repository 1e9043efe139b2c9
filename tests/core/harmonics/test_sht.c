/*
 * test_sht.c - the harmonic transform against its definition: the basis by explicit formulae, round
 * trips on every grid, the addition theorem, sectoral harmonics of the highest degree, and the
 * Laplacian by the gradient.
 *
 * Tolerances: near the poles the rounding errors of the Legendre recurrence grow with the square of
 * the degree, 2^-53 127^2 / 2 = 9e-13 at most; on the average they are much smaller. Any error of
 * formula is far above.
 *
 * srnfd-test: no-asan (api/test_standard.sh and core/stats/test_classify.c run its code)
 */
#include "fixture.h"
#include "harmonics.h"

#define TOLERANCE 1e-12
#define TOLERANCE_OF_SQUARES 3e-12 /* errors count twice in a square */

/* Every degree up to 20, then every seventh, and the last. */
static size_t next_degree(size_t degree)
{
    size_t next = degree < 20 ? degree + 1 : degree + 7;

    return degree < SRNF_DEGREE_MAX && next > SRNF_DEGREE_MAX ? SRNF_DEGREE_MAX : next;
}

static void analysis_inverts_synthesis(void **state)
{
    struct test_random random = test_random_seed(1);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t degree = SRNF_DEGREE_MIN; degree <= SRNF_DEGREE_MAX;
             degree = next_degree(degree)) {
            struct fixture f;
            double *c;
            double *values;
            double *back;

            fixture_open(&f, degree, &grid_shapes[s]);
            c = fixture_normals(&random, f.coefficients);
            values = fixture_doubles(f.points);
            back = fixture_doubles(f.coefficients);
            srnf_sht_synthesis(f.sht, 1, c, values, f.workspace);
            srnf_sht_analysis(f.sht, 1, values, back, f.workspace);
            assert_at_most(compare_relative(f.coefficients, back, c), TOLERANCE);
            srnf_free(c);
            srnf_free(values);
            srnf_free(back);
            fixture_close(&f);
        }
    }
}

/* Degrees below SRNF_DEGREE_MIN serve inside the library; so does L = 0 with one longitude. */
static void the_smallest_degrees_round_trip(void **state)
{
    struct test_random random = test_random_seed(2);

    (void)state;
    for (size_t s = 1; s < GRID_SHAPES; s++) {
        for (size_t degree = 1; degree < SRNF_DEGREE_MIN; degree++) {
            double c[16];
            double back[16];
            struct fixture f;
            double *values;

            fixture_open(&f, degree, &grid_shapes[s]);
            values = fixture_doubles(f.points);
            test_random_normals(&random, f.coefficients, c);
            srnf_sht_synthesis(f.sht, 1, c, values, f.workspace);
            srnf_sht_analysis(f.sht, 1, values, back, f.workspace);
            assert_at_most(compare_relative(f.coefficients, back, c), 1e-14);
            srnf_free(values);
            fixture_close(&f);
        }
    }
}

static void degree_zero_is_a_constant_on_one_longitude(void **state)
{
    const struct grid_shape shape = {"one longitude", SRNF_GRID_GAUSS_LEGENDRE, 0, 3, 0, 1};
    double c = 2.0;
    double values[3];
    double d_theta[3] = {NAN, NAN, NAN};
    double d_phi[3] = {NAN, NAN, NAN};
    struct fixture f;

    (void)state;
    fixture_open(&f, 0, &shape);
    srnf_sht_synthesis(f.sht, 1, &c, values, f.workspace);
    srnf_sht_gradient(f.sht, 1, &c, d_theta, d_phi, f.workspace);
    for (size_t i = 0; i < 3; i++) {
        assert_at_most(fabs(values[i] - 1.0 / sqrt(SRNF_PI)), 1e-15);
        assert_true(d_theta[i] == 0.0 && d_phi[i] == 0.0);
    }
    srnf_sht_analysis(f.sht, 1, values, &c, f.workspace);
    assert_at_most(fabs(c - 2.0), 1e-15);
    fixture_close(&f);
}

/* One explicit harmonic against the transform of a unit coefficient, at every node. */
static void check_harmonic(const struct fixture *f, const struct harmonic *h, double *arrays[3])
{
    size_t n_phi = f->grid->n_phi;

    for (size_t node = 0; node < f->points; node++) {
        double e[3];
        double e_theta[3];
        double e_phi[3];
        double gradient[3];
        double value;

        fixture_node(f->grid, node / n_phi, node % n_phi, e);
        fixture_frame(f->grid, node / n_phi, node % n_phi, e_theta, e_phi);
        value = harmonic_at(h, e, gradient);
        assert_at_most(fabs(arrays[0][node] - value), 1e-14);
        assert_at_most(fabs(arrays[1][node] - fixture_dot3(gradient, e_theta)), 1e-14);
        assert_at_most(fabs(arrays[2][node] - fixture_dot3(gradient, e_phi)), 1e-14);
    }
}

/* Includes the poles of the equiangular grids, where d_phi is the limit along the meridian of each
   longitude. */
static void the_basis_is_the_documented_one(void **state)
{
    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        struct fixture f;
        double *c;
        double *arrays[3];

        fixture_open(&f, 5, &grid_shapes[s]);
        c = srnf_alloc(f.coefficients, sizeof(double));
        assert_non_null(c);
        for (size_t i = 0; i < 3; i++) {
            arrays[i] = fixture_doubles(f.points);
        }
        for (size_t i = 0; i < HARMONICS; i++) {
            int l = harmonics[i].l;
            size_t index = (size_t)(l * l + l + harmonics[i].m);

            c[index] = 1.0;
            srnf_sht_synthesis(f.sht, 1, c, arrays[0], f.workspace);
            srnf_sht_gradient(f.sht, 1, c, arrays[1], arrays[2], f.workspace);
            check_harmonic(&f, &harmonics[i], arrays);
            c[index] = 0.0;
        }
        for (size_t i = 0; i < 3; i++) {
            srnf_free(arrays[i]);
        }
        srnf_free(c);
        fixture_close(&f);
    }
}

/* sum_m of products a_lm b_lm, for every l. */
static double degree_product(size_t l, const double *a, const double *b)
{
    return fixture_dot(2 * l + 1, a + l * l, b + l * l);
}

/*
 * The adjoint of an impulse at a node is the vector of all Y_lm there; so
 *
 *   sum_m Y_lm(p) Y_lm(q) = (2l + 1) / (4 pi) P_l(<p, q>),
 *   sum_m (dY_lm/dtheta)^2 = sum_m (dY_lm/dphi / sin)^2 = l (l + 1) (2l + 1) / (8 pi),
 *
 * and sum_m of the mixed product is 0: the basis of every degree is orthonormal and complete, at
 * each node by itself, poles included.
 */
static void check_addition_theorem(const struct fixture *f, struct test_random *random)
{
    size_t p = test_random_below(random, f->points);
    size_t q = test_random_below(random, f->points);
    size_t n_phi = f->grid->n_phi;
    double *fields = srnf_alloc(2 * f->points, sizeof(double));
    double *zero = fields + f->points;
    double *at[4]; /* Y at p and q, both derivatives at p */
    double e_p[3];
    double e_q[3];

    assert_non_null(fields);
    for (size_t i = 0; i < 4; i++) {
        at[i] = fixture_doubles(f->coefficients);
    }
    p = test_random_below(random, 4) == 0 ? p % n_phi
                                          : p; /* often the first row, which may be a pole */
    fixture_node(f->grid, p / n_phi, p % n_phi, e_p);
    fixture_node(f->grid, q / n_phi, q % n_phi, e_q);
    fields[q] = 1.0;
    srnf_sht_synthesis_adjoint(f->sht, 1, fields, at[1], f->workspace);
    fields[q] = 0.0;
    fields[p] = 1.0;
    srnf_sht_synthesis_adjoint(f->sht, 1, fields, at[0], f->workspace);
    srnf_sht_gradient_adjoint(f->sht, 1, fields, zero, at[2], f->workspace);
    srnf_sht_gradient_adjoint(f->sht, 1, zero, fields, at[3], f->workspace);
    for (size_t l = 0; l <= f->degree; l++) {
        double n = (double)l;
        double unit = (2.0 * n + 1.0) / (4.0 * SRNF_PI);
        double slope = 0.5 * n * (n + 1.0) * unit;
        double expected = unit * (double)fixture_legendre(l, (long double)fixture_dot3(e_p, e_q));

        assert_at_most(fabs(degree_product(l, at[0], at[1]) - expected),
                       TOLERANCE_OF_SQUARES * unit);
        assert_at_most(fabs(degree_product(l, at[0], at[0]) - unit), TOLERANCE_OF_SQUARES * unit);
        assert_at_most(fabs(degree_product(l, at[2], at[2]) - slope),
                       TOLERANCE_OF_SQUARES * (slope + unit));
        assert_at_most(fabs(degree_product(l, at[3], at[3]) - slope),
                       TOLERANCE_OF_SQUARES * (slope + unit));
        assert_at_most(fabs(degree_product(l, at[2], at[3])),
                       TOLERANCE_OF_SQUARES * (slope + unit));
    }
    for (size_t i = 0; i < 4; i++) {
        srnf_free(at[i]);
    }
    srnf_free(fields);
}

static void the_addition_theorem_holds_at_every_degree(void **state)
{
    static const size_t degrees[] = {4, 15, 31, 64, SRNF_DEGREE_MAX};
    struct test_random random = test_random_seed(3);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++) {
            struct fixture f;

            fixture_open(&f, degrees[i], &grid_shapes[s]);
            for (size_t repetition = 0; repetition < 8; repetition++) {
                check_addition_theorem(&f, &random);
            }
            fixture_close(&f);
        }
    }
}

/* Y_L,L = N sin^L cos(L phi), N = sqrt((2L + 1)!! / (2 pi (2L)!!)), and its derivatives. */
static void sectoral_harmonics_have_their_closed_form(void **state)
{
    (void)state;
    for (size_t degree = 1; degree <= SRNF_DEGREE_MAX; degree += 21) {
        struct fixture f;
        double norm = 0.5 / SRNF_PI;
        double n = (double)degree;
        double *arrays[3];
        double *c;

        fixture_open(&f, degree, &grid_shapes[0]);
        c = srnf_alloc(f.coefficients, sizeof(double));
        assert_non_null(c);
        for (size_t k = 1; k <= degree; k++) {
            norm *= (2.0 * (double)k + 1.0) / (2.0 * (double)k);
        }
        norm = sqrt(norm);
        for (size_t i = 0; i < 3; i++) {
            arrays[i] = fixture_doubles(f.points);
        }
        c[f.coefficients - 1] = 1.0;
        srnf_sht_synthesis(f.sht, 1, c, arrays[0], f.workspace);
        srnf_sht_gradient(f.sht, 1, c, arrays[1], arrays[2], f.workspace);
        for (size_t node = 0; node < f.points; node++) {
            size_t row = node / f.grid->n_phi;
            size_t turn = degree * (node % f.grid->n_phi) % f.grid->n_phi;
            double angle = 2.0 * SRNF_PI * (double)turn / (double)f.grid->n_phi;
            double power = norm * pow(f.grid->sin_theta[row], n - 1.0);

            assert_at_most(fabs(arrays[0][node] - power * f.grid->sin_theta[row] * cos(angle)),
                           TOLERANCE * norm);
            assert_at_most(fabs(arrays[1][node] - n * power * f.grid->cos_theta[row] * cos(angle)),
                           TOLERANCE * n * norm);
            assert_at_most(fabs(arrays[2][node] + n * power * sin(angle)), TOLERANCE * n * norm);
        }
        for (size_t i = 0; i < 3; i++) {
            srnf_free(arrays[i]);
        }
        srnf_free(c);
        fixture_close(&f);
    }
}

static void apply_weights(const struct fixture *f, double *field)
{
    for (size_t node = 0; node < f->points; node++) {
        field[node] *= f->grid->weight[node / f->grid->n_phi];
    }
}

/*
 * integral <grad Y_lm, grad Y_l'm'> = l (l + 1) if both are equal, 0 otherwise: adjoint, weights
 * and gradient one after the other multiply each coefficient by l (l + 1). The product has degree
 * 2L, which all grids integrate.
 */
static void the_gradient_squared_is_the_laplacian(void **state)
{
    struct test_random random = test_random_seed(4);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t degree = SRNF_DEGREE_MIN; degree <= SRNF_DEGREE_MAX; degree += 41) {
            struct fixture f;
            double *c;
            double *fields;
            double *back;

            fixture_open(&f, degree, &grid_shapes[s]);
            c = fixture_normals(&random, f.coefficients);
            fields = fixture_doubles(2 * f.points);
            back = fixture_doubles(f.coefficients);
            srnf_sht_gradient(f.sht, 1, c, fields, fields + f.points, f.workspace);
            apply_weights(&f, fields);
            apply_weights(&f, fields + f.points);
            srnf_sht_gradient_adjoint(f.sht, 1, fields, fields + f.points, back, f.workspace);
            for (size_t l = 0; l <= degree; l++) {
                for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
                    c[i] *= (double)(l * (l + 1));
                }
            }
            assert_at_most(compare_relative(f.coefficients, back, c), TOLERANCE);
            srnf_free(c);
            srnf_free(fields);
            srnf_free(back);
            fixture_close(&f);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(analysis_inverts_synthesis),
        cmocka_unit_test(the_smallest_degrees_round_trip),
        cmocka_unit_test(degree_zero_is_a_constant_on_one_longitude),
        cmocka_unit_test(the_basis_is_the_documented_one),
        cmocka_unit_test(the_addition_theorem_holds_at_every_degree),
        cmocka_unit_test(sectoral_harmonics_have_their_closed_form),
        cmocka_unit_test(the_gradient_squared_is_the_laplacian),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
