/*
 * test_register_warps.c - surfaces warped and turned at random come back in exact mode.
 *
 * The template is the exact SRNF of the warped surface; printed beside is the floor that a warped
 * surface cut to degree L has: it cannot be matched better than its truncation. At the higher
 * degree
 * the cut surface itself is registered.
 */
/* srnfd-test: timeout 600 */
#include "registrations.h"

#define DEGREE 23
#define CUT_DEGREE 47

static const char *const surfaces[] = {
    "bumpy star",
    "3 arms",
    REGISTRATIONS_LOCAL "L_thalamus.ply",
    REGISTRATIONS_LOCAL "R_pallidum.ply",
    REGISTRATIONS_LOCAL "L_amygdala.ply",
    REGISTRATIONS_SHARED "small_bodies/apophis.ply",
    REGISTRATIONS_SHARED "small_bodies/bacchus.ply",
    REGISTRATIONS_SHARED "lv_endocardium_ed/lv_asymp_0083.ply",
};
#define SURFACES (FIGURES_SANITIZED ? 2 : sizeof surfaces / sizeof surfaces[0])

/* The recipe's medians are 6e-14, 7e-14 and 6e-12; a single one may lie a good order above. */
static const struct {
    double least, median, worst;
} strengths[] = {{0.7, 2e-13, 1e-12}, {0.5, 1e-12, 5e-11}, {0.3, 1e-10, 5e-9}};
#define STRENGTHS (sizeof strengths / sizeof strengths[0])

static int ascending(const void *a, const void *b)
{
    const double *x = a;
    const double *y = b;

    return (*x > *y) - (*x < *y);
}

/* ||q of the cut surface - q||^2 of a warped surface. */
static double truncation(const struct shapes_surface *s, const struct srnf_warp *warp,
                         const double rotation[9], const double *q)
{
    double *f = shapes_doubles(s->count);
    double *cut = shapes_doubles(3 * s->points);
    double norm2;

    registrations_resample(s, warp, rotation, f);
    srnf_field(s->sht, f, cut, s->workspace);
    for (size_t i = 0; i < 3 * s->points; i++) {
        cut[i] -= q[i];
    }
    norm2 = srnf_inner_product(s->grid, cut, cut);
    srnf_free(f);
    srnf_free(cut);
    return norm2;
}

static void comes_back_from_warps(void **state)
{
    struct test_random random = test_random_seed(21);
    (void)state;

    for (size_t k = 0; k < STRENGTHS; k++) {
        double found[sizeof surfaces / sizeof surfaces[0]];
        size_t n = 0;

        for (size_t i = 0; i < SURFACES; i++) {
            struct srnf_register_options options = srnf_register_options_defaults();
            struct shapes_surface s;
            struct srnf_registration r;
            struct srnf_warp warp;
            double rotation[9];
            double *q;

            if (!registrations_open(&s, DEGREE, surfaces[i])) {
                continue;
            }
            q = shapes_doubles(3 * s.points);
            registrations_warp(&random, strengths[k].least, &warp);
            shapes_random_rotation(&random, rotation);
            registrations_act(&s, &warp, rotation, q);
            options.exact = true;
            registrations_run(&s, q, s.f, &options, &r);
            found[n++] = r.distance * r.distance;
            printf("# %s, J %.1f: %.1e (cut to degree %zu: %.1e), J %.2f to %.2f\n", surfaces[i],
                   strengths[k].least, found[n - 1], s.degree, truncation(&s, &warp, rotation, q),
                   r.min_jacobian, r.max_jacobian);
            assert_true(r.min_jacobian > 0.0);
            srnf_registration_clear(&r);
            srnf_warp_clear(&warp);
            srnf_free(q);
            shapes_close(&s);
        }
        assert_true(n > 0);
        qsort(found, n, sizeof found[0], ascending);
        if (n > 2) { /* of two the median says nothing */
            figure_below("median", found[n / 2], strengths[k].median);
        }
        figure_below("worst", found[n - 1], strengths[k].worst);
    }
}

/* As a surface, not as an exact field: what is lost is no more than what the truncation costs. */
static void reaches_the_floor_of_truncation(void **state)
{
    const size_t degrees[] = {DEGREE, 31, CUT_DEGREE};
    const size_t n_degrees = FIGURES_SANITIZED ? 1 : sizeof degrees / sizeof degrees[0];
    (void)state;

    for (size_t k = 0; k < n_degrees; k++) {
        struct test_random random = test_random_seed(22);
        struct srnf_register_options options = srnf_register_options_defaults();
        struct shapes_surface s;
        struct shapes_surface smooth;
        struct srnf_registration r;
        struct srnf_warp warp;
        double rotation[9];
        double floor;
        double *q;

        /* The same surface of degree 15 in all: only the room for its warped image grows. */
        assert_true(registrations_open(&smooth, 15, surfaces[1]));
        shapes_open(&s, degrees[k]);
        for (size_t c = 0; c < 3; c++) {
            memcpy(s.f + c * s.each, smooth.f + c * smooth.each, smooth.each * sizeof(double));
        }
        shapes_update(&s);
        q = shapes_doubles(3 * s.points);
        registrations_warp(&random, 0.7, &warp);
        shapes_random_rotation(&random, rotation);
        registrations_act(&s, &warp, rotation, q);
        floor = truncation(&s, &warp, rotation, q);
        shapes_close(&smooth);
        shapes_open(&smooth, degrees[k]);
        registrations_resample(&s, &warp, rotation, smooth.f);
        options.exact = true;
        options.start = SRNF_START_RIGID;
        registrations_run(&smooth, NULL, s.f, &options, &r);
        printf("# degree %zu: %.1e, truncation %.1e\n", degrees[k], r.distance * r.distance, floor);
        assert_true(r.distance * r.distance <= 1.1 * floor + 1e-12);
        srnf_registration_clear(&r);
        srnf_warp_clear(&warp);
        srnf_free(q);
        shapes_close(&smooth);
        shapes_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(comes_back_from_warps),
        cmocka_unit_test(reaches_the_floor_of_truncation),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
