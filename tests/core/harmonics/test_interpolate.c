/*
 * test_interpolate.c - interpolation on the grid: the nodes' own values at the nodes, never beyond
 * the values about a point, second order in the width of the grid, seamless in longitude, and the
 * poles.
 */
#include "fixture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "support/random.h"

static struct srnf_sht *open_grid(enum srnf_grid_kind kind, size_t rows)
{
    struct srnf_sht *sht = NULL;

    assert_int_equal(srnf_sht_create(&sht, 0, kind, rows, 2 * rows), SRNF_OK);
    return sht;
}

static void node(const struct srnf_grid *grid, size_t i, size_t j, double e[3])
{
    double phi = 2.0 * acos(-1.0) * (double)j / (double)grid->n_phi;

    e[0] = grid->sin_theta[i] * cos(phi);
    e[1] = grid->sin_theta[i] * sin(phi);
    e[2] = grid->cos_theta[i];
}

static double smooth(const double e[3])
{
    return exp(e[0]) * cos(2.0 * e[1]) + e[2] * e[2] * e[2];
}

static double *sample(const struct srnf_grid *grid, double (*f)(const double e[3]))
{
    double *values = malloc(grid->n_theta * grid->n_phi * sizeof *values);

    assert_non_null(values);
    for (size_t i = 0; i < grid->n_theta; i++) {
        for (size_t j = 0; j < grid->n_phi; j++) {
            double e[3];

            node(grid, i, j, e);
            values[i * grid->n_phi + j] = f(e);
        }
    }
    return values;
}

static void nodes_keep_their_values(void **state)
{
    struct srnf_sht *sht = open_grid(SRNF_GRID_GAUSS_LEGENDRE, 9);
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct test_random random = test_random_seed(1);
    double values[9 * 18];

    (void)state;
    test_random_normals(&random, 9 * 18, values);
    for (size_t i = 0; i < 9; i++) {
        for (size_t j = 0; j < 18; j++) {
            double e[3];
            double found;

            node(grid, i, j, e);
            srnf_grid_interpolate(grid, values, 1, e, &found);
            assert_true(fabs(found - values[i * 18 + j]) < 1e-13);
        }
    }
    srnf_sht_destroy(sht);
}

/* Largest error at random points. */
static double worst_error(enum srnf_grid_kind kind, size_t rows)
{
    struct srnf_sht *sht = open_grid(kind, rows);
    double *values = sample(srnf_sht_grid(sht), smooth);
    struct test_random random = test_random_seed(2);
    double worst = 0.0;

    for (size_t k = 0; k < 20000; k++) {
        double e[3];
        double found;

        test_random_direction(&random, e);
        srnf_grid_interpolate(srnf_sht_grid(sht), values, 1, e, &found);
        worst = compare_max(worst, fabs(found - smooth(e)));
    }
    free(values);
    srnf_sht_destroy(sht);
    return worst;
}

static void error_falls_with_the_square_of_the_width(void **state)
{
    static const enum srnf_grid_kind kinds[] = {SRNF_GRID_GAUSS_LEGENDRE, SRNF_GRID_EQUIANGULAR};

    (void)state;
    for (size_t k = 0; k < 2; k++) {
        double coarse = worst_error(kinds[k], 24);
        double fine = worst_error(kinds[k], 96);
        double order = log2(coarse / fine) / 2.0;

        printf("# errors %.2e and %.2e: order %.2f\n", coarse, fine, order);
        assert_true(order > 1.8 && order < 2.2);
    }
}

/* Random values, as those of a map of significance: everything stays between its neighbours. */
static void values_are_never_exceeded(void **state)
{
    struct srnf_sht *sht = open_grid(SRNF_GRID_GAUSS_LEGENDRE, 12);
    struct test_random random = test_random_seed(3);
    double values[12 * 24];

    (void)state;
    for (size_t k = 0; k < 12 * 24; k++) {
        values[k] = test_random_uniform(&random, 0.25, 1.0);
    }
    for (size_t k = 0; k < 5000; k++) {
        double e[3];
        double found;

        test_random_direction(&random, e);
        srnf_grid_interpolate(srnf_sht_grid(sht), values, 1, e, &found);
        assert_true(found >= 0.25 && found <= 1.0);
    }
    srnf_sht_destroy(sht);
}

static void poles_are_the_mean_of_their_row(void **state)
{
    struct srnf_sht *sht = open_grid(SRNF_GRID_GAUSS_LEGENDRE, 8);
    double values[8 * 16];
    const double poles[6] = {0.0, 0.0, 1.0, 0.0, 0.0, -1.0};
    double found[2];

    (void)state;
    for (size_t k = 0; k < 8 * 16; k++) {
        values[k] = (double)k;
    }
    srnf_grid_interpolate(srnf_sht_grid(sht), values, 2, poles, found);
    assert_true(fabs(found[0] - 7.5) < 1e-13);
    assert_true(fabs(found[1] - (7 * 16 + 7.5)) < 1e-12);
    srnf_sht_destroy(sht);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_keep_their_values),
        cmocka_unit_test(error_falls_with_the_square_of_the_width),
        cmocka_unit_test(values_are_never_exceeded),
        cmocka_unit_test(poles_are_the_mean_of_their_row),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
