/*
 * test_register_memory.c - registration when memory runs out: requests are refused one after
 * another.
 * srnfd-test: slow
 */
/* srnfd-test: timeout 600 */
#include "registrations.h"
#include "support/refusing.h"

#define DEGREE 4
#define TRIED \
    (FIGURES_SLOW ? 8 : 60) /* requests refused of each kind of registration, spread over all */

static const struct {
    const char *name;
    struct srnf_register_options options;
    bool equal; /* a surface with a turned copy of itself, so that exact mode comes into play */
} subjects[] = {
    {"rigid", {.rotation = true, .degree = 2, .start = SRNF_START_RIGID}, false},
    {"warp",
     {.rotation = true, .reparameterization = true, .degree = 2, .start = SRNF_START_IDENTITY},
     false},
    {"tournament", {.rotation = true, .reparameterization = true, .degree = 4}, false},
    {"symmetric",
     {.rotation = true,
      .reparameterization = true,
      .degree = 2,
      .start = SRNF_START_IDENTITY,
      .symmetric = true},
     false},
    {"exact",
     {.rotation = true,
      .reparameterization = true,
      .degree = 2,
      .start = SRNF_START_IDENTITY,
      .exact = true},
     true},
    {"exact, of two that differ",
     {.rotation = true, .reparameterization = true, .degree = 2, .exact = true},
     false},
};

/* What a run registers, to what, and how. */
static struct shapes_surface a;
static const double *moving;
static const struct srnf_register_options *options;

static int run(void)
{
    struct srnf_registration r;
    struct srnf_error error = {0};
    int status = srnf_register(a.sht, a.f, NULL, moving, options, NULL, NULL, &r, &error);

    assert_true(status <= SRNF_OK);
    if (status < 0) {
        assert_null(r.coefficients);
        assert_null(r.q);
        assert_null(r.points);
        assert_null(r.warp.links);
        assert_int_equal(error.status, status);
    }
    srnf_registration_clear(&r);
    return status;
}

static int run_search(void)
{
    struct srnf_warp warp;
    struct srnf_error error = {0};
    double rotation[9];
    int status =
        srnf_register_to_field(a.sht, a.q, 0.0, moving, options, NULL, rotation, &warp, &error);

    assert_true(status <= SRNF_OK);
    if (status < 0) {
        assert_null(warp.links);
        assert_int_equal(error.status, status);
    }
    srnf_warp_clear(&warp);
    return status;
}

static int run_guided_search(void)
{
    static const double points[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-0.6, -0.8, 0}};
    const struct srnf_landmarks landmarks = {4, points[0], points[0], 0.5};
    struct srnf_warp warp;
    struct srnf_error error = {0};
    double rotation[9];
    int status = srnf_register_to_field_landmarks(a.sht, a.q, 0.0, moving, options, &landmarks,
                                                  NULL, rotation, &warp, &error);

    assert_true(status <= SRNF_OK);
    if (status < 0) {
        assert_null(warp.links);
        assert_int_equal(error.status, status);
    }
    srnf_warp_clear(&warp);
    return status;
}

static void survives_refusals(void **state)
{
    struct shapes_surface b;
    struct srnf_warp warp;
    struct test_random random = test_random_seed(61);
    const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double *warped;
    (void)state;

    shapes_open(&a, DEGREE);
    shapes_open(&b, DEGREE);
    shapes_fill(&a, shapes_ellipsoid, 1.7);
    shapes_fill(&b, shapes_bumpy, 0.0);
    warped = shapes_doubles(a.count);
    registrations_warp(&random, 0.999, &warp);
    memcpy(warp.links[0].values, still, sizeof still);
    registrations_resample(&a, &warp, still, warped);
    for (size_t k = 0; k < sizeof subjects / sizeof subjects[0]; k++) {
        size_t stride;

        moving = subjects[k].equal ? warped : b.f;
        options = &subjects[k].options;
        stride = refusing_count(subjects[k].name, run) / TRIED + 1;
        refusing_sweep(subjects[k].name, run, TRIED / 2, stride);
    }
    moving = b.f;
    options = &subjects[1].options;
    refusing_sweep("to a field", run_search, TRIED / 2,
                   refusing_count("to a field", run_search) / TRIED + 1);
    refusing_sweep("guided to a field", run_guided_search, TRIED / 2,
                   refusing_count("guided to a field", run_guided_search) / TRIED + 1);
    srnf_warp_clear(&warp);
    srnf_free(warped);
    shapes_close(&a);
    shapes_close(&b);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(survives_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
