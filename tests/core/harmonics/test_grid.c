/*
 * test_grid.c - nodes and weights of the two grids: the area of the sphere, symmetry, the degree of
 * exactness, known nodes, and the shapes that are refused.
 */
#include "fixture.h"

static const size_t row_counts[] = {2, 3, 4, 5, 8, 9, 16, 24, 47, 48, 95, 96, 192, 383, 384, 1000};
#define ROW_COUNTS (sizeof row_counts / sizeof row_counts[0])

static const enum srnf_grid_kind kinds[] = {SRNF_GRID_GAUSS_LEGENDRE, SRNF_GRID_EQUIANGULAR};

/* A transform of degree 0 takes any number of rows. */
static struct srnf_sht *open_rows(enum srnf_grid_kind kind, size_t rows, size_t columns)
{
    struct srnf_sht *sht = NULL;

    assert_int_equal(srnf_sht_create(&sht, 0, kind, rows, columns), SRNF_OK);
    assert_int_equal(srnf_sht_grid(sht)->n_theta, rows);
    assert_int_equal(srnf_sht_grid(sht)->kind, kind);
    return sht;
}

/* sums[l] = sum over nodes of weight P_l(cos theta), l < count: 4 pi, and 0 for l > 0 if exact. */
static void legendre_sums(const struct srnf_grid *grid, size_t count, long double *sums)
{
    for (size_t l = 0; l < count; l++) {
        sums[l] = 0.0L;
    }
    for (size_t i = 0; i < grid->n_theta; i++) {
        long double weight = (long double)grid->n_phi * (long double)grid->weight[i];
        long double x = (long double)grid->cos_theta[i];
        long double before = 0.0L;
        long double current = 1.0L;

        for (size_t l = 0; l < count; l++) {
            long double n = (long double)l;
            long double next = ((2.0L * n + 1.0L) * x * current - n * before) / (n + 1.0L);

            sums[l] += weight * current;
            before = current;
            current = next;
        }
    }
}

static void weights_sum_to_the_area_of_the_sphere(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 0; i < ROW_COUNTS; i++) {
            struct srnf_sht *sht = open_rows(kinds[k], row_counts[i], 1 + i);

            long double area;

            legendre_sums(srnf_sht_grid(sht), 1, &area);
            assert_at_most(fabs((double)area / (4.0 * SRNF_PI) - 1.0), 1e-15);
            srnf_sht_destroy(sht);
        }
    }
}

static void rows_are_ordered_symmetric_and_consistent(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 0; i < ROW_COUNTS; i++) {
            struct srnf_sht *sht = open_rows(kinds[k], row_counts[i], 0);
            const struct srnf_grid *g = srnf_sht_grid(sht);

            assert_int_equal(g->n_phi, 2 * g->n_theta);
            for (size_t row = 0; row < g->n_theta; row++) {
                size_t mirror = g->n_theta - 1 - row;

                assert_true(g->weight[row] > 0.0);
                assert_true(row == 0 || g->theta[row] > g->theta[row - 1]);
                assert_true(row == 0 || g->cos_theta[row] < g->cos_theta[row - 1]);
                /* The parity of the transform needs these three to the last bit. */
                assert_true(g->cos_theta[mirror] == -g->cos_theta[row]);
                assert_true(g->sin_theta[mirror] == g->sin_theta[row]);
                assert_true(g->weight[mirror] == g->weight[row]);
                assert_at_most(fabs(g->theta[row] + g->theta[mirror] - SRNF_PI), 1e-15);
                assert_at_most(fabs(cos(g->theta[row]) - g->cos_theta[row]), 4e-16);
                assert_at_most(fabs(sin(g->theta[row]) - g->sin_theta[row]), 4e-16);
            }
            srnf_sht_destroy(sht);
        }
    }
}

/* All Legendre polynomials of degree 1 to the promised one integrate to 0, and the next of even
   degree does not, by 2e-9 (Clenshaw-Curtis, 1000 rows) or more: the degree is neither less nor
   more than documented. Odd degrees vanish by symmetry. */
static void quadrature_is_exact_to_its_degree_and_no_further(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 0; i < ROW_COUNTS; i++) {
            size_t n = row_counts[i];
            struct srnf_sht *sht = open_rows(kinds[k], n, 0);
            size_t exact = kinds[k] == SRNF_GRID_GAUSS_LEGENDRE ? 2 * n - 1 : n - 1;
            size_t beyond = exact % 2 == 1 ? exact + 1 : exact + 2;
            long double *sums = srnf_alloc(beyond + 1, sizeof *sums);

            assert_non_null(sums);
            legendre_sums(srnf_sht_grid(sht), beyond + 1, sums);
            for (size_t l = 1; l <= exact; l++) {
                assert_at_most(fabs((double)sums[l]), 4e-15 * sqrt((double)n));
            }
            assert_true(fabs((double)sums[beyond]) > 1e-10);
            srnf_free(sums);
            srnf_sht_destroy(sht);
        }
    }
}

/* integral of cos^k theta = 4 pi / (k + 1) for even k: monomials, which have no cancellation to
   hide in. */
static void monomials_integrate_exactly(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        for (size_t n = 2; n <= 96; n += n < 12 ? 1 : 7) {
            struct srnf_sht *sht = open_rows(kinds[k], n, 0);
            const struct srnf_grid *grid = srnf_sht_grid(sht);
            size_t exact = kinds[k] == SRNF_GRID_GAUSS_LEGENDRE ? 2 * n - 1 : n - 1;

            for (size_t power = 0; power <= exact; power++) {
                double expected = power % 2 == 0 ? 4.0 * SRNF_PI / (double)(power + 1) : 0.0;
                long double sum = 0.0L;

                for (size_t row = 0; row < n; row++) {
                    sum += (long double)grid->weight[row] *
                           powl((long double)grid->cos_theta[row], (long double)power);
                }
                assert_at_most(fabs((double)sum * (double)grid->n_phi - expected), 2e-14);
            }
            srnf_sht_destroy(sht);
        }
    }
}

/* cos theta and weight (which sum to 2) of the northern rows. */
struct known_row {
    enum srnf_grid_kind kind;
    size_t n, row;
    double cosine, weight;
};

/* Gauss-Legendre in closed form, Clenshaw-Curtis for 3 rows (Simpson), 4 and 5. */
static void rows_of_small_grids_are_the_known_ones(void **state)
{
    double r56 = sqrt(1.2);
    double r70 = 2.0 * sqrt(10.0 / 7.0);
    const struct known_row known[] = {
        {SRNF_GRID_GAUSS_LEGENDRE, 2, 0, sqrt(1.0 / 3.0), 1.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 3, 0, sqrt(0.6), 5.0 / 9.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 3, 1, 0.0, 8.0 / 9.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 4, 0, sqrt((3.0 + 2.0 * r56) / 7.0), (18.0 - sqrt(30.0)) / 36.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 4, 1, sqrt((3.0 - 2.0 * r56) / 7.0), (18.0 + sqrt(30.0)) / 36.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 5, 0, sqrt(5.0 + r70) / 3.0,
         (322.0 - 13.0 * sqrt(70.0)) / 900.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 5, 1, sqrt(5.0 - r70) / 3.0,
         (322.0 + 13.0 * sqrt(70.0)) / 900.0},
        {SRNF_GRID_GAUSS_LEGENDRE, 5, 2, 0.0, 128.0 / 225.0},
        {SRNF_GRID_EQUIANGULAR, 2, 0, 1.0, 1.0},
        {SRNF_GRID_EQUIANGULAR, 3, 0, 1.0, 1.0 / 3.0},
        {SRNF_GRID_EQUIANGULAR, 3, 1, 0.0, 4.0 / 3.0},
        {SRNF_GRID_EQUIANGULAR, 4, 0, 1.0, 1.0 / 9.0},
        {SRNF_GRID_EQUIANGULAR, 4, 1, 0.5, 8.0 / 9.0},
        {SRNF_GRID_EQUIANGULAR, 5, 0, 1.0, 1.0 / 15.0},
        {SRNF_GRID_EQUIANGULAR, 5, 1, sqrt(0.5), 8.0 / 15.0},
        {SRNF_GRID_EQUIANGULAR, 5, 2, 0.0, 12.0 / 15.0},
    };

    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        struct srnf_sht *sht = open_rows(known[i].kind, known[i].n, 7);
        const struct srnf_grid *grid = srnf_sht_grid(sht);
        double weight = grid->weight[known[i].row] * 7.0 / (2.0 * SRNF_PI);

        assert_at_most(fabs(grid->cos_theta[known[i].row] - known[i].cosine), 3e-16);
        assert_at_most(fabs(weight - known[i].weight), 5e-16);
        srnf_sht_destroy(sht);
    }
}

static void equiangular_rows_are_equidistant_and_hold_the_poles(void **state)
{
    (void)state;
    for (size_t i = 0; i < ROW_COUNTS; i++) {
        size_t n = row_counts[i];
        struct srnf_sht *sht = open_rows(SRNF_GRID_EQUIANGULAR, n, 0);
        const struct srnf_grid *grid = srnf_sht_grid(sht);

        assert_true(grid->cos_theta[0] == 1.0 && grid->cos_theta[n - 1] == -1.0);
        assert_true(grid->sin_theta[0] == 0.0 && grid->sin_theta[n - 1] == 0.0);
        for (size_t row = 0; row < n; row++) {
            double expected = SRNF_PI * (double)row / (double)(n - 1);

            assert_at_most(fabs(grid->theta[row] - expected), 1e-15);
        }
        srnf_sht_destroy(sht);
    }
}

static void the_working_grid_has_the_documented_shape(void **state)
{
    (void)state;
    for (size_t degree = 1; degree <= SRNF_DEGREE_MAX; degree += 3) {
        struct srnf_sht *sht = NULL;
        size_t rows = (size_t)ceil(1.5 * (double)(degree + 1));

        assert_int_equal(srnf_working_rows(degree), rows);
        assert_int_equal(srnf_sht_create(&sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), SRNF_OK);
        assert_int_equal(srnf_sht_degree(sht), degree);
        assert_int_equal(srnf_sht_grid(sht)->n_theta, rows);
        assert_int_equal(srnf_sht_grid(sht)->n_phi, 2 * rows);
        srnf_sht_destroy(sht);
    }
}

/* Each stands beside the nearest shape that is accepted. */
static void shapes_outside_the_documented_range_are_refused(void **state)
{
    const struct {
        size_t degree;
        int kind;
        size_t rows, columns;
        int status;
    } cases[] = {
        {4, SRNF_GRID_GAUSS_LEGENDRE, 5, 9, SRNF_OK},
        {4, SRNF_GRID_GAUSS_LEGENDRE, 4, 9, SRNF_EINVAL},
        {4, SRNF_GRID_GAUSS_LEGENDRE, 5, 8, SRNF_EINVAL},
        {4, SRNF_GRID_EQUIANGULAR, 9, 9, SRNF_OK},
        {4, SRNF_GRID_EQUIANGULAR, 8, 9, SRNF_EINVAL},
        {4, SRNF_GRID_EQUIANGULAR, 9, 8, SRNF_EINVAL},
        {0, SRNF_GRID_GAUSS_LEGENDRE, 2, 1, SRNF_OK},
        {0, SRNF_GRID_GAUSS_LEGENDRE, 1, 1, SRNF_EINVAL},
        {0, SRNF_GRID_GAUSS_LEGENDRE, SRNF_GRID_ROWS_MAX, 1, SRNF_OK},
        {0, SRNF_GRID_GAUSS_LEGENDRE, SRNF_GRID_ROWS_MAX + 1, 1, SRNF_EINVAL},
        {0, SRNF_GRID_GAUSS_LEGENDRE, SIZE_MAX, 0, SRNF_EINVAL},
        {0, SRNF_GRID_GAUSS_LEGENDRE, 2, SIZE_MAX, SRNF_EINVAL},
        {SRNF_TRANSFORM_DEGREE_MAX + 1, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, SRNF_EINVAL},
        {SRNF_TRANSFORM_DEGREE_MAX + 1, SRNF_GRID_EQUIANGULAR, 0, 0, SRNF_EINVAL},
        {SIZE_MAX, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, SRNF_EINVAL},
        {SIZE_MAX, SRNF_GRID_GAUSS_LEGENDRE, 4, 4, SRNF_EINVAL},
        {4, 2, 9, 9, SRNF_EINVAL},
        {4, 2, 0, 0, SRNF_EINVAL},
        {4, 255, 9, 9, SRNF_EINVAL},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct srnf_sht *sht = (struct srnf_sht *)(void *)&sht; /* must be overwritten */
        int status = srnf_sht_create(&sht, cases[i].degree, (enum srnf_grid_kind)cases[i].kind,
                                     cases[i].rows, cases[i].columns);

        assert_int_equal(status, cases[i].status);
        assert_true((sht != NULL) == (status == SRNF_OK));
        srnf_sht_destroy(sht);
    }
    srnf_sht_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_sum_to_the_area_of_the_sphere),
        cmocka_unit_test(rows_are_ordered_symmetric_and_consistent),
        cmocka_unit_test(quadrature_is_exact_to_its_degree_and_no_further),
        cmocka_unit_test(monomials_integrate_exactly),
        cmocka_unit_test(rows_of_small_grids_are_the_known_ones),
        cmocka_unit_test(equiangular_rows_are_equidistant_and_hold_the_poles),
        cmocka_unit_test(the_working_grid_has_the_documented_shape),
        cmocka_unit_test(shapes_outside_the_documented_range_are_refused),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
