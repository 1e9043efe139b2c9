/*
 * test_sliding.c - the part of the preconditioner for points that slide: symmetric, never negative,
 * worth its cost, and refused memory. For threads see test_invert_threads.c.
 */
#include "inversions.h"
#include "inversion/inversion.h"
#include "support/refusing.h"

struct equations {
    struct shapes_surface s;
    struct gauss_newton *system;
    struct sliding *sliding;
    double *diagonal;
};

static void set_up(struct equations *e, size_t degree,
                   void (*formula)(const double *, double, double *), double parameter)
{
    shapes_open(&e->s, degree);
    shapes_fill(&e->s, formula, parameter);
    assert_int_equal(gauss_newton_create(&e->system, e->s.sht, e->s.q), SRNF_OK);
    (void)gauss_newton_try(e->system, e->s.f);
    gauss_newton_accept(e->system);
    e->diagonal = shapes_doubles(e->s.count);
    linear_diagonal(degree, 1.0, 0.25, e->diagonal);
    assert_int_equal(sliding_create(&e->sliding, e->system), SRNF_OK);
    sliding_prepare(e->sliding, e->system, e->s.f, e->diagonal, 1e-6);
}

static void tear_down(struct equations *e)
{
    sliding_destroy(e->sliding);
    srnf_free(e->diagonal);
    gauss_newton_destroy(e->system);
    shapes_close(&e->s);
}

static struct shapes_surface refused;

static void draw(struct test_random *random, size_t n, double *x)
{
    for (size_t i = 0; i < n; i++) {
        x[i] = test_random_uniform(random, -1.0, 1.0);
    }
}

static void is_symmetric_and_not_negative(void **state)
{
    struct test_random random = test_random_seed(3);
    (void)state;

    for (size_t degree = 1; degree <= 15; degree += 7) {
        struct equations e;
        double *x;
        double *y;
        size_t n;

        set_up(&e, degree, shapes_capsule, 3.5);
        n = e.s.count;
        x = shapes_doubles(4 * n);
        y = x + n;
        for (size_t k = 0; k < 4; k++) {
            double *image = x + 2 * n;
            double own[2];
            double left;
            double right;

            draw(&random, 2 * n, x);
            for (size_t c = 0; c < 6; c++) {
                x[c * n / 3] = 0.0;
            }
            memset(image, 0, 2 * n * sizeof *image);
            sliding_precondition(e.sliding, e.system, x, image);
            sliding_precondition(e.sliding, e.system, y, image + n);
            own[0] = linear_dot(n, x, image);
            own[1] = linear_dot(n, y, image + n);
            left = linear_dot(n, y, image);
            right = linear_dot(n, x, image + n);
            assert_true(own[0] > 0.0 && own[1] > 0.0);
            assert_true(fabs(left - right) <= 1e-12 * (own[0] + own[1]));
            for (size_t c = 0; c < 3; c++) {
                assert_true(image[c * n / 3] == 0.0);
            }
        }
        srnf_free(x);
        tear_down(&e);
    }
}

/* The harder the surface, the more products it spares: of the same right-hand side, to the same
   part of the residual in the norm of each. */
static void spares_products(void **state)
{
    static const struct {
        void (*formula)(const double *, double, double *);
        double parameter, part;
    } cases[] = {{shapes_bumpy, 0.0, 0.6}, {shapes_capsule, 3.5, 0.6}};
    struct test_random random = test_random_seed(4);
    (void)state;

    for (size_t k = 0; k < 2; k++) {
        struct normal_equations conjugate;
        struct equations e;
        double *b;
        size_t products[2];

        set_up(&e, 15, cases[k].formula, cases[k].parameter);
        assert_int_equal(normal_equations_create(&conjugate, e.system), SRNF_OK);
        b = shapes_doubles(2 * e.s.count);
        draw(&random, e.s.count, b + e.s.count);
        gauss_newton_product(e.system, b + e.s.count, b);
        for (size_t i = 0; i < 2; i++) {
            conjugate.sliding = i ? e.sliding : NULL;
            assert_int_equal(
                normal_equations_solve(&conjugate, e.system, b, 1e-6, 1e-4, 2000, b + e.s.count),
                SRNF_OK);
            assert_true(conjugate.residual <= 1e-4);
            products[i] = conjugate.iterations;
        }
        printf("# %zu products instead of %zu\n", products[1], products[0]);
        assert_true((double)products[1] <= cases[k].part * (double)products[0]);
        srnf_free(b);
        normal_equations_destroy(&conjugate);
        tear_down(&e);
    }
}

/* A round surface turns once, and no surface less. */
static void counts_turns(void **state)
{
    struct equations e;
    double *work;
    double turns;
    (void)state;

    set_up(&e, 15, shapes_ellipsoid, 1.0);
    work = shapes_doubles(e.s.count);
    turns = sliding_turning(e.system, work);
    assert_true(fabs(turns - 1.0) <= 1e-12);
    srnf_free(work);
    tear_down(&e);
    set_up(&e, 15, shapes_arms, 4.0);
    work = shapes_doubles(e.s.count);
    turns = sliding_turning(e.system, work);
    assert_true(turns > 2.0 && turns < 100.0);
    srnf_free(work);
    tear_down(&e);
}

static int invert_refused(void)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    int status;

    options.method = SRNF_INVERT_GAUSS_NEWTON;
    options.initial = SRNF_INITIAL_SPHERE;
    options.certify = false;
    status = srnf_invert(refused.sht, refused.q, &options, NULL, &result, NULL);
    if (status == SRNF_OK) {
        /* So it took the route of sliding.c, whose grids and vectors are among those refused. */
        assert_true(result.transforms != floor(result.transforms));
    } else {
        assert_null(result.coefficients);
    }
    srnf_inversion_clear(&result);
    return status;
}

static void survives_refusals(void **state)
{
    (void)state;
    shapes_open(&refused, 6);
    shapes_fill(&refused, shapes_bumpy, 0.0);
    (void)refusing_sweep("invert", invert_refused, SIZE_MAX, 1);
    shapes_close(&refused);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_symmetric_and_not_negative),
        cmocka_unit_test(spares_products),
        cmocka_unit_test(counts_turns),
        cmocka_unit_test(survives_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
