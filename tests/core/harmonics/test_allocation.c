/*
 * test_allocation.c - what core/harmonics does when memory runs out: each allocation in turn is
 * refused.
 */
#include "fixture.h"
#include "support/refusing.h"

/* What is created. */
static size_t degree;
static enum srnf_grid_kind kind;

static int run_create(void)
{
    struct srnf_sht *sht = NULL;
    int status = srnf_sht_create(&sht, degree, kind, 0, 0);

    if (status == SRNF_OK) {
        srnf_sht_destroy(sht);
    } else {
        assert_int_equal(status, SRNF_ENOMEM);
        assert_null(sht);
    }
    return status;
}

static int run_at_points(void)
{
    const double c[25] = {1.0};
    const double points[2][3] = {{1.0, 0.0, 0.0}, {0.0, 0.0, -1.0}};
    double values[2] = {NAN, NAN};
    double gradients[2][3];
    int status = srnf_harmonics_at_points(4, 1, c, 2, points[0], values, gradients[0]);

    assert_true(status <= SRNF_OK);
    assert_true(status == SRNF_OK || (isnan(values[0]) && isnan(values[1])));
    return status;
}

static void creation_survives_each_refusal(void **state)
{
    static const struct {
        const char *name;
        size_t degree;
        enum srnf_grid_kind kind;
    } subjects[] = {
        {"degree 0", 0, SRNF_GRID_GAUSS_LEGENDRE},
        {"Gauss-Legendre", 15, SRNF_GRID_GAUSS_LEGENDRE},
        {"equiangular", 15, SRNF_GRID_EQUIANGULAR},
    };

    (void)state;
    for (size_t i = 0; i < sizeof subjects / sizeof subjects[0]; i++) {
        degree = subjects[i].degree;
        kind = subjects[i].kind;
        assert_true(refusing_sweep(subjects[i].name, run_create, 0, 1) < 100);
    }
    assert_int_equal(refusing.alive, 0);
}

static void evaluation_at_points_survives_each_refusal(void **state)
{
    (void)state;
    assert_true(refusing_sweep("at points", run_at_points, 0, 1) < 100);
    assert_int_equal(refusing.alive, 0);
}

static void refused_arguments_allocate_nothing(void **state)
{
    struct srnf_sht *sht;

    (void)state;
    refusing_none();
    assert_int_equal(srnf_sht_create(&sht, 4, SRNF_GRID_GAUSS_LEGENDRE, 4, 9), SRNF_EINVAL);
    assert_int_equal(srnf_sht_create(&sht, SIZE_MAX, SRNF_GRID_EQUIANGULAR, 0, 0), SRNF_EINVAL);
    assert_int_equal(srnf_harmonics_at_points(SIZE_MAX, 1, NULL, 0, NULL, NULL, NULL), SRNF_EINVAL);
    assert_int_equal(refusing.requests, 0);
}

static void transforms_allocate_nothing(void **state)
{
    struct test_random random = test_random_seed(41);
    struct fixture f;
    double *c;
    double *a;
    double *b;

    (void)state;
    refusing_none();
    fixture_open(&f, 15, &grid_shapes[0]);
    c = fixture_normals(&random, 3 * f.coefficients);
    a = fixture_doubles(3 * f.points);
    b = fixture_doubles(3 * f.points);
    refusing_none();
    srnf_sht_synthesis(f.sht, 3, c, a, f.workspace);
    srnf_sht_analysis(f.sht, 3, a, c, f.workspace);
    srnf_sht_synthesis_adjoint(f.sht, 3, a, c, f.workspace);
    srnf_sht_gradient(f.sht, 3, c, a, b, f.workspace);
    srnf_sht_gradient_adjoint(f.sht, 3, a, b, c, f.workspace);
    assert_int_equal(refusing.requests, 0);
    srnf_free(c);
    srnf_free(a);
    srnf_free(b);
    fixture_close(&f);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(creation_survives_each_refusal),
        cmocka_unit_test(evaluation_at_points_survives_each_refusal),
        cmocka_unit_test(refused_arguments_allocate_nothing),
        cmocka_unit_test(transforms_allocate_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
