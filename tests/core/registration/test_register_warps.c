/*
 * test_register_warps.c - surfaces warped and turned at random come back in exact mode.
 *
 * The template is the exact SRNF of the warped surface; printed beside is the floor that a warped
 * surface cut to degree L has: it cannot be matched better than its truncation. At the higher
 * degree the cut surface itself is registered.
 * srnfd-test: slow
 */
/* srnfd-test: timeout 600 */
#include "core/surface/truncations.h"

#define DEGREE (FIGURES_SLOW ? 15 : 23)
#define CUT_DEGREE 47

static const char *const surfaces[] = {
    "bumpy star",
    "3 arms",
    REGISTRATIONS_LOCAL "L_thalamus.ply",
    REGISTRATIONS_LOCAL "R_pallidum.ply",
    REGISTRATIONS_LOCAL "L_amygdala.ply",
    "asteroid 1",
    "asteroid 2",
    "ventricle 0",
};
#define SURFACES (FIGURES_SLOW ? 1 : sizeof surfaces / sizeof surfaces[0])

/* The recipe's medians are 6e-14, 7e-14 and 6e-12; a single one may lie a good order above. */
static const struct {
    double least, median, worst;
} strengths[] = {{0.7, 2e-13, 1e-12}, {0.5, 1e-12, 5e-11}, {0.3, 1e-10, 5e-9}};
/* test_register_warps_nightly.c takes the strongest too, which cost as much as the others. */
#ifndef STRENGTHS
#define STRENGTHS (sizeof strengths / sizeof strengths[0] - 1)
#endif

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

            assert_true(registrations_open(&s, DEGREE, surfaces[i]));
            q = shapes_doubles(3 * s.points);
            registrations_warp(&random, strengths[k].least, &warp);
            shapes_random_rotation(&random, rotation);
            registrations_act(&s, &warp, rotation, q);
            options.exact = true;
            registrations_run(&s, q, s.f, &options, &r);
            found[n++] = r.distance * r.distance;
            printf("# %s, J %.1f: %.1e (cut to degree %zu: %.1e), J %.2f to %.2f\n", surfaces[i],
                   strengths[k].least, found[n - 1], s.degree,
                   truncations_floor(&s, &warp, rotation, q), r.min_jacobian, r.max_jacobian);
            assert_true(r.min_jacobian > 0.0);
            srnf_registration_clear(&r);
            srnf_warp_clear(&warp);
            srnf_free(q);
            shapes_close(&s);
        }
        assert_true(n > 0);
        qsort(found, n, sizeof found[0], compare_order);
        if (n > 2) { /* of two the median says nothing */
            figure_below("median", found[n / 2], strengths[k].median);
        }
        figure_below("worst", found[n - 1], strengths[k].worst);
    }
}

/* Steps from the rotation alone end elsewhere, at 4e-3: the tournament's warp has to serve. */
static void comes_back_where_its_rotation_leads_elsewhere(void **state)
{
    struct test_random random = test_random_seed(14);
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface s;
    struct srnf_registration r;
    struct srnf_warp warp;
    double rotation[9];
    double *q;
    (void)state;

    if (FIGURES_SLOW) {
        skip(); /* test_register_memory.c goes the same way */
    }
    assert_true(registrations_open(&s, 23, REGISTRATIONS_LOCAL "R_pallidum.ply"));
    q = shapes_doubles(3 * s.points);
    registrations_warp(&random, 0.3, &warp);
    shapes_random_rotation(&random, rotation);
    registrations_act(&s, &warp, rotation, q);
    options.exact = true;
    registrations_run(&s, q, s.f, &options, &r);
    figure_below("distance", r.distance * r.distance, 5e-9);
    assert_true(r.min_jacobian > 0.0);
    srnf_registration_clear(&r);
    srnf_warp_clear(&warp);
    srnf_free(q);
    shapes_close(&s);
}

/* As a surface, not as an exact field: what is lost is no more than what the truncation costs. The
   real ventricle at higher degrees and under stronger warps is in bench_truncation. */
static void reaches_the_floor_of_truncation(void **state)
{
    static const struct {
        const char *what;
        size_t base, degree;
    } cases[] = {{"3 arms", 15, DEGREE},
                 {"ventricle 0", 23, DEGREE},
                 {"3 arms", 15, 31},
                 {"ventricle 0", 23, 31},
                 {"3 arms", 15, CUT_DEGREE}};
    const size_t n_cases = FIGURES_SLOW ? 1 : sizeof cases / sizeof cases[0];
    (void)state;

    for (size_t k = 0; k < n_cases; k++) {
        struct shapes_surface s;
        double floor;
        double left;

        assert_true(truncations_open(&s, cases[k].what, cases[k].base, cases[k].degree));
        left = truncations_run(&s, 0.7, 22, &floor);
        printf("# %s, degree %zu: %.1e, truncation %.1e\n", cases[k].what, cases[k].degree, left,
               floor);
        assert_true(left <= 1.1 * floor + 1e-12);
        shapes_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(comes_back_from_warps),
        cmocka_unit_test(comes_back_where_its_rotation_leads_elsewhere),
        cmocka_unit_test(reaches_the_floor_of_truncation),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
