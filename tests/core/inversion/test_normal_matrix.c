/*
 * test_normal_matrix.c - the matrix of the eigenproblem against its products by transforms, for
 * fields of normals that no band limit holds.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>

#include "inversion/spectral.h"
#include "support/compare.h"
#include "support/random.h"

struct fixture {
    struct srnf_sht *sht;
    struct gauss_newton *system;
    size_t n, *order;
    double *q, *u, *mass, *matrix;
};

static void set_up(struct fixture *f, size_t degree, size_t rows, size_t columns)
{
    struct test_random random = test_random_seed(7);
    size_t points;

    assert_int_equal(srnf_sht_create(&f->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, rows, columns),
                     SRNF_OK);
    points = srnf_sht_grid(f->sht)->n_theta * srnf_sht_grid(f->sht)->n_phi;
    f->n = normal_matrix_size(degree);
    f->q = srnf_alloc(3 * points, sizeof(double));
    f->u = srnf_alloc(3 * points, sizeof(double));
    f->mass = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
    f->order = srnf_alloc(f->n, sizeof *f->order);
    f->matrix = srnf_alloc(f->n * f->n, sizeof(double));
    assert_true(f->q && f->u && f->mass && f->order && f->matrix);
    for (size_t i = 0; i < 3 * points; i++) {
        f->q[i] = test_random_uniform(&random, -1.0, 1.0);
    }
    assert_int_equal(gauss_newton_create(&f->system, f->sht, f->q), SRNF_OK);
    normal_form_field(f->system, f->u);
    normal_matrix_order(degree, srnf_coefficient_count(degree), f->order);
    linear_diagonal(degree, 0.0, 1.0, f->mass);
}

static void tear_down(struct fixture *f)
{
    gauss_newton_destroy(f->system);
    srnf_free(f->q);
    srnf_free(f->u);
    srnf_free(f->mass);
    srnf_free(f->order);
    srnf_free(f->matrix);
    srnf_sht_destroy(f->sht);
}

static int assemble(struct fixture *f, const struct srnf_context *context)
{
    return normal_matrix_assemble(f->sht, srnf_sht_degree(f->sht), f->u, f->system->weight, context,
                                  f->matrix);
}

/* Largest difference of the lower triangle from the products, whose entries are up to 1. */
static double difference(struct fixture *f)
{
    struct normal_form form = {f->system, f->u};
    size_t count = f->system->count;
    double *x = srnf_alloc(2 * count, sizeof(double)), *y = x + count, worst = 0.0;

    assert_non_null(x);
    for (size_t j = 0; j < f->n; j++) {
        for (size_t i = 0; i < count; i++) {
            x[i] = 0.0;
        }
        x[f->order[j]] = 1.0 / sqrt(f->mass[f->order[j]]);
        normal_form_product(&form, x, y);
        for (size_t i = j; i < f->n; i++) {
            double entry = y[f->order[i]] / sqrt(f->mass[f->order[i]]);

            worst = compare_max(worst, fabs(f->matrix[j * f->n + i] - entry));
        }
    }
    srnf_free(x);
    return worst;
}

static void equals_its_products(void **state)
{
    /* Few columns too: sums over a parallel that wrap round. */
    static const size_t cases[][3] = {{4, 0, 0}, {4, 5, 9}, {9, 10, 19}, {9, 13, 40}, {15, 0, 0}};
    (void)state;

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fixture f;
        double worst;

        set_up(&f, cases[i][0], cases[i][1], cases[i][2]);
        assert_int_equal(assemble(&f, NULL), SRNF_OK);
        worst = difference(&f);
        printf("# L = %zu: %.1e\n", cases[i][0], worst);
        assert_true(worst < 1e-13);
        tear_down(&f);
    }
}

static bool says_stop(void *user)
{
    (void)user;
    return true;
}

static void can_be_cancelled(void **state)
{
    const struct srnf_context context = {.canceled = says_stop};
    struct fixture f;
    (void)state;

    set_up(&f, 9, 0, 0);
    assert_int_equal(assemble(&f, &context), SRNF_ECANCELED);
    tear_down(&f);
}

/* On surfaces of a lower degree it is a part of the matrix. */
static void lower_degrees_are_a_part(void **state)
{
    size_t low = normal_matrix_size(4), each = srnf_coefficient_count(9);
    size_t *order = srnf_alloc(low, sizeof *order), *place = srnf_alloc(3 * each, sizeof *place);
    double *part = srnf_alloc(low * low, sizeof *part), worst = 0.0;
    struct fixture f;
    (void)state;

    set_up(&f, 9, 0, 0);
    assert_true(order && place && part);
    normal_matrix_order(4, each, order);
    for (size_t i = 0; i < f.n; i++) {
        place[f.order[i]] = i;
    }
    assert_int_equal(assemble(&f, NULL), SRNF_OK);
    assert_int_equal(normal_matrix_assemble(f.sht, 4, f.u, f.system->weight, NULL, part), SRNF_OK);
    for (size_t j = 0; j < low; j++) {
        for (size_t i = j; i < low; i++) {
            size_t a = place[order[i]], b = place[order[j]];
            double entry = a > b ? f.matrix[b * f.n + a] : f.matrix[a * f.n + b];

            worst = compare_max(worst, fabs(part[j * low + i] - entry));
        }
    }
    assert_true(worst < 1e-15);
    srnf_free(order);
    srnf_free(place);
    srnf_free(part);
    tear_down(&f);
}

/* Each place but the translations, once. */
static void orders_all_unknowns(void **state)
{
    size_t order[3 * 99], seen[300] = {0};
    (void)state;

    assert_int_equal(normal_matrix_size(9), 3 * 99);
    normal_matrix_order(9, 100, order);
    for (size_t i = 0; i < 3 * 99; i++) {
        assert_true(order[i] < 300 && order[i] % 100 != 0);
        assert_int_equal(seen[order[i]]++, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equals_its_products),
        cmocka_unit_test(can_be_cancelled),
        cmocka_unit_test(lower_degrees_are_a_part),
        cmocka_unit_test(orders_all_unknowns),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
