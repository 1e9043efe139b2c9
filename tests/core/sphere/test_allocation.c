/*
 * test_allocation.c - what core/sphere does when memory runs out: each allocation in turn is
 * refused.
 *
 * This program brings its own srnf_alloc and srnf_free, which the linker prefers to those of the
 * library. They count what is alive and refuse the n-th request.
 */
#include "fixture.h"

#include <stdlib.h>

static size_t requests; /* since the last reset */
static size_t refused;  /* index of the request to refuse; SIZE_MAX: none */
static size_t alive;

void *srnf_alloc(size_t count, size_t size)
{
    void *pointer;

    if (requests++ == refused || (size > 0 && count > PTRDIFF_MAX / size - 64)) {
        return NULL;
    }
    pointer = aligned_alloc(64, (count * size + 64) / 64 * 64);
    if (pointer) {
        memset(pointer, 0, count * size);
        alive++;
    }
    return pointer;
}

void srnf_free(void *pointer)
{
    alive -= pointer != NULL;
    free(pointer);
}

static void reset(size_t refuse)
{
    requests = 0;
    refused = refuse;
}

/* Returns how many requests a creation makes when all are granted. */
static size_t sweep_create(size_t degree, enum srnf_grid_kind kind)
{
    struct srnf_sht *sht = NULL;

    for (size_t n = 0; n < 100; n++) {
        int status;

        reset(n);
        status = srnf_sht_create(&sht, degree, kind, 0, 0);
        reset(SIZE_MAX);
        if (status == SRNF_OK) {
            srnf_sht_destroy(sht);
            assert_int_equal(alive, 0);
            return n;
        }
        assert_int_equal(status, SRNF_ENOMEM);
        assert_null(sht);
        assert_int_equal(alive, 0);
    }
    fail_msg("a creation that never succeeds");
    return 0;
}

static void creation_survives_each_refusal(void **state)
{
    (void)state;
    assert_true(sweep_create(0, SRNF_GRID_GAUSS_LEGENDRE) > 0);
    assert_true(sweep_create(15, SRNF_GRID_GAUSS_LEGENDRE) > 0);
    assert_true(sweep_create(15, SRNF_GRID_EQUIANGULAR) > 0);
}

static void evaluation_at_points_survives_each_refusal(void **state)
{
    double c[25] = {1.0};
    double points[2][3] = {{1.0, 0.0, 0.0}, {0.0, 0.0, -1.0}};
    size_t granted = 0;
    int status = SRNF_ENOMEM;

    (void)state;
    for (; status == SRNF_ENOMEM && granted < 100; granted++) {
        double values[2] = {NAN, NAN};
        double gradients[2][3];

        reset(granted);
        status = srnf_harmonics_at_points(4, 1, c, 2, points[0], values, gradients[0]);
        reset(SIZE_MAX);
        assert_int_equal(alive, 0);
        assert_true(status == SRNF_OK || (isnan(values[0]) && isnan(values[1])));
    }
    assert_int_equal(status, SRNF_OK);
    assert_true(granted > 1);
}

static void refused_arguments_allocate_nothing(void **state)
{
    struct srnf_sht *sht;

    (void)state;
    reset(SIZE_MAX);
    assert_int_equal(srnf_sht_create(&sht, 4, SRNF_GRID_GAUSS_LEGENDRE, 4, 9), SRNF_EINVAL);
    assert_int_equal(srnf_sht_create(&sht, SIZE_MAX, SRNF_GRID_EQUIANGULAR, 0, 0), SRNF_EINVAL);
    assert_int_equal(srnf_harmonics_at_points(SIZE_MAX, 1, NULL, 0, NULL, NULL, NULL), SRNF_EINVAL);
    assert_int_equal(requests, 0);
}

static void transforms_allocate_nothing(void **state)
{
    struct test_random random = test_random_seed(41);
    struct fixture f;
    double *c;
    double *a;
    double *b;

    (void)state;
    reset(SIZE_MAX);
    fixture_open(&f, 15, &grid_shapes[0]);
    c = fixture_normals(&random, 3 * f.coefficients);
    a = fixture_doubles(3 * f.points);
    b = fixture_doubles(3 * f.points);
    reset(SIZE_MAX);
    srnf_sht_synthesis(f.sht, 3, c, a, f.workspace);
    srnf_sht_analysis(f.sht, 3, a, c, f.workspace);
    srnf_sht_synthesis_adjoint(f.sht, 3, a, c, f.workspace);
    srnf_sht_gradient(f.sht, 3, c, a, b, f.workspace);
    srnf_sht_gradient_adjoint(f.sht, 3, a, b, c, f.workspace);
    assert_int_equal(requests, 0);
    srnf_free(c);
    srnf_free(a);
    srnf_free(b);
    fixture_close(&f);
    assert_int_equal(alive, 0);
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
