/*
 * test_register_memory.c - registration when memory runs out: requests are refused one after
 * another.
 *
 * This program brings its own srnf_alloc and srnf_free, which the linker prefers to those of the
 * library. They count what is alive and refuse the n-th request.
 */
/* srnfd-test: timeout 600 */
#include "registrations.h"

#define DEGREE 4
#define TRIED              \
    (FIGURES_SANITIZED ? 8 \
                       : 60) /* requests refused of each kind of registration, spread over all */

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
};

static int run(size_t subject, const struct shapes_surface *a, const double *moving)
{
    struct srnf_registration r;
    struct srnf_error error = {0};
    int status = srnf_register(a->sht, a->f, NULL, moving, &subjects[subject].options, NULL, NULL,
                               &r, &error);

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

static void survives_refusals(void **state)
{
    struct shapes_surface a;
    struct shapes_surface b;
    struct srnf_warp warp;
    struct test_random random = test_random_seed(61);
    const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double *warped;
    (void)state;

    reset(SIZE_MAX);
    shapes_open(&a, DEGREE);
    shapes_open(&b, DEGREE);
    shapes_fill(&a, shapes_ellipsoid, 1.7);
    shapes_fill(&b, shapes_bumpy, 0.0);
    warped = shapes_doubles(a.count);
    registrations_warp(&random, 0.999, &warp);
    memcpy(warp.links[0].values, still, sizeof still);
    registrations_resample(&a, &warp, still, warped);
    for (size_t k = 0; k < sizeof subjects / sizeof subjects[0]; k++) {
        const double *moving = subjects[k].equal ? warped : b.f;
        size_t before = alive;
        size_t total;
        size_t stride;

        reset(SIZE_MAX);
        assert_int_equal(run(k, &a, moving), SRNF_OK);
        total = requests;
        stride = total / TRIED + 1;
        printf("# %s: %zu allocations, every %zu. refused\n", subjects[k].name, total, stride);
        for (size_t n = 0; n < total; n += n < TRIED / 2 ? 1 : stride) {
            int status;

            reset(n);
            status = run(k, &a, moving);
            if (status != SRNF_ENOMEM) {
                fail_msg("%s, request %zu refused: status %d", subjects[k].name, n, status);
            }
            assert_int_equal(alive, before);
        }
    }
    reset(SIZE_MAX);
    srnf_warp_clear(&warp);
    srnf_free(warped);
    shapes_close(&a);
    shapes_close(&b);
    assert_int_equal(alive, 0);
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
