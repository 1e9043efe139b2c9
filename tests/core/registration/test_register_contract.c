/*
 * test_register_contract.c - what registration promises its callers: wrong arguments, cancellation,
 * the same bits on every run and on every thread.
 */
#include "registrations.h"
#include "support/parallel.h"

#include <fftw3.h>

#define DEGREE 8

struct pair {
    struct shapes_surface a, b;
};

static int open_pair(void **state)
{
    struct pair *pair = malloc(sizeof *pair);

    assert_non_null(pair);
    shapes_open(&pair->a, DEGREE);
    shapes_open(&pair->b, DEGREE);
    shapes_fill(&pair->a, shapes_ellipsoid, 1.7);
    shapes_fill(&pair->b, shapes_bumpy, 0.0);
    *state = pair;
    return 0;
}

static int close_pair(void **state)
{
    struct pair *pair = *state;

    shapes_close(&pair->a);
    shapes_close(&pair->b);
    free(pair);
    return 0;
}

static void rejects(const struct pair *pair, const double *surface, const double *q,
                    const double *moving, const struct srnf_register_options *options)
{
    struct srnf_registration r;
    struct srnf_error error = {0};

    assert_int_equal(
        srnf_register(pair->a.sht, surface, q, moving, options, NULL, NULL, &r, &error),
        SRNF_EINVAL);
    assert_int_equal(error.status, SRNF_EINVAL);
    assert_true(error.message[0] != '\0');
    assert_null(r.coefficients);
    assert_null(r.q);
    assert_null(r.warp.links);
}

static void refuses_wrong_arguments(void **state)
{
    struct pair *pair = *state;
    const struct srnf_register_options good = srnf_register_options_defaults();
    struct srnf_register_options bad[7] = {good, good, good, good, good, good, good};
    double *broken = shapes_doubles(pair->b.count);

    bad[0].degree = 0;
    bad[1].degree = 33;
    bad[2].penalty_jacobian = -1.0;
    bad[3].penalty_jacobian = NAN;
    bad[4].penalty_displacement = INFINITY;
    bad[5].penalty_displacement = -1e-9;
    bad[6].degree = SIZE_MAX;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        rejects(pair, pair->a.f, NULL, pair->b.f, &bad[k]);
    }
    rejects(pair, NULL, NULL, pair->b.f, &good);
    bad[0] = good;
    bad[0].symmetric = true;
    rejects(pair, NULL, pair->a.q, pair->b.f, &bad[0]);
    rejects(pair, broken, NULL, pair->b.f, &good); /* all 0: no SRNF */
    memcpy(broken, pair->b.f, pair->b.count * sizeof(double));
    broken[5] = NAN;
    rejects(pair, pair->a.f, NULL, broken, &good);
    broken[5] = INFINITY;
    rejects(pair, broken, NULL, pair->b.f, &good);
    srnf_free(broken);
}

static void refuses_a_field_that_is_no_field(void **state)
{
    struct pair *pair = *state;
    const struct srnf_register_options options = srnf_register_options_defaults();
    double *flat = shapes_doubles(pair->b.count);
    double *q = shapes_doubles(3 * pair->a.points);

    rejects(pair, pair->a.f, NULL, flat, &options);
    memcpy(q, pair->a.q, 3 * pair->a.points * sizeof(double));
    q[7] = NAN;
    rejects(pair, NULL, q, pair->b.f, &options);
    srnf_free(q);
    srnf_free(flat);
}

static bool cancel_later(void *user)
{
    int *left = user;

    return (*left)-- <= 0;
}

static void can_be_canceled(void **state)
{
    struct pair *pair = *state;

    for (int k = 0; k < 600; k += FIGURES_SLOW ? 290 : 97) {
        int left = k;
        struct srnf_context context = {.user = &left, .canceled = cancel_later};
        struct srnf_registration r;
        struct srnf_error error = {0};
        int status = srnf_register(pair->a.sht, pair->a.f, NULL, pair->b.f, NULL, NULL, &context,
                                   &r, &error);

        if (k < 300) {
            assert_int_equal(status, SRNF_ECANCELED);
        }
        if (status == SRNF_ECANCELED) {
            assert_int_equal(error.status, SRNF_ECANCELED);
            assert_null(r.coefficients);
            assert_null(r.points);
        }
        srnf_registration_clear(&r);
    }
}

struct repeat {
    const struct pair *pair;
    struct srnf_registration results[4];
};

static void run_one(void *argument, size_t index)
{
    struct repeat *repeat = argument;
    const struct pair *pair = repeat->pair;

    assert_int_equal(srnf_register(pair->a.sht, pair->a.f, NULL, pair->b.f, NULL, NULL, NULL,
                                   &repeat->results[index], NULL),
                     SRNF_OK);
}

static void same_bits_on_every_thread(void **state)
{
    struct repeat repeat = {.pair = *state};
    struct srnf_registration *r = repeat.results;
    struct srnf_registration alone;
    const struct pair *pair = *state;

    registrations_run(&pair->a, NULL, pair->b.f, NULL, &alone);
    parallel_threads(NULL, 4, run_one, &repeat);
    for (size_t k = 0; k < 4; k++) {
        assert_memory_equal(r[k].coefficients, alone.coefficients, pair->b.count * sizeof(double));
        assert_memory_equal(r[k].q, alone.q, 3 * pair->a.points * sizeof(double));
        assert_memory_equal(r[k].points, alone.points, 3 * pair->a.points * sizeof(double));
        assert_true(r[k].distance == alone.distance && r[k].objective == alone.objective);
        assert_int_equal(r[k].iterations, alone.iterations);
        srnf_registration_clear(&r[k]);
    }
    srnf_registration_clear(&alone);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(refuses_wrong_arguments, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(refuses_a_field_that_is_no_field, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(can_be_canceled, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(same_bits_on_every_thread, open_pair, close_pair),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe(); /* registrations make plans of their own */
    return cmocka_run_group_tests(tests, NULL, NULL);
}
