/*
 * test_register_symmetric.c - registration as a distance: symmetric to the last bit, zero for equal
 * surfaces, how far from a metric, what pose, scale and parameterization of the input change;
 * and the range of the Jacobian under the default penalty.
 * srnfd-test: slow
 * srnfd-test: release-only
 * It measures; under the sanitizers test_register_rotations.c and test_register_stops.c run the
 * same code.
 */
/* srnfd-test: timeout 600 */
#include "registrations.h"

#define DEGREE (FIGURES_SLOW ? 7 : 11)
#define BODY_DEGREE (FIGURES_SLOW ? 11 : 15)
/* test_register_symmetric_nightly.c takes all of them. */
#ifndef ALL
#define ALL 0
#endif
#define TRIPLES (FIGURES_SLOW ? 1 : 20)

static const char *const surfaces[] = {
    REGISTRATIONS_LOCAL "L_thalamus.ply", REGISTRATIONS_LOCAL "R_thalamus.ply",
    REGISTRATIONS_LOCAL "L_pallidum.ply", REGISTRATIONS_LOCAL "R_pallidum.ply",
    REGISTRATIONS_LOCAL "L_amygdala.ply", "ventricle 0",
};
#define SURFACES (sizeof surfaces / sizeof surfaces[0])

#define BODIES ((size_t)6)

/* The defaults; where all is slow, with fields of a lower degree. */
static struct srnf_register_options both_ways(void)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.degree = FIGURES_SLOW ? 6 : options.degree;
    options.symmetric = true;
    return options;
}

static double symmetric(const struct shapes_surface *a, const double *f, double *gap)
{
    struct srnf_register_options options = both_ways();
    struct srnf_registration r;
    double distance;

    registrations_run(a, NULL, f, &options, &r);
    assert_true(r.min_jacobian > 0.0);
    distance = r.distance;
    *gap = r.inverse_consistency;
    srnf_registration_clear(&r);
    return distance;
}

static void equal_both_ways_and_zero_to_itself(void **state)
{
    struct srnf_register_options options = both_ways();
    struct shapes_surface a;
    struct shapes_surface b;
    struct srnf_registration ab;
    struct srnf_registration ba;
    double gap;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    assert_true(registrations_open(&b, DEGREE, surfaces[4]));
    registrations_run(&a, NULL, b.f, &options, &ab);
    registrations_run(&b, NULL, a.f, &options, &ba);
    printf("# objective %.15f %.15f, distance %.12f %.12f, gap of the two ways %.1e\n",
           ab.objective, ba.objective, ab.distance, ba.distance, ab.inverse_consistency);
    assert_true(ab.objective == ba.objective);
    assert_true(ab.inverse_consistency == ba.inverse_consistency);
    assert_true(ab.distance == ba.distance);
    figure_below("distance of a surface to itself", symmetric(&a, a.f, &gap), 1e-12);
    srnf_registration_clear(&ab);
    srnf_registration_clear(&ba);
    shapes_close(&a);
    shapes_close(&b);
}

/* Which of two surfaces is the larger chooses no way: the gap between them is that of the searches,
   whatever the sizes, and both ways tell the same. */
static void sizes_choose_no_way(void **state)
{
    struct srnf_register_options options = both_ways();
    struct shapes_surface a;
    struct shapes_surface b;
    struct srnf_registration ab;
    struct srnf_registration ba;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    assert_true(registrations_open(&b, DEGREE, surfaces[4]));
    for (size_t i = 0; i < b.count; i++) {
        b.f[i] *= 2.0;
    }
    shapes_update(&b);
    registrations_run(&a, NULL, b.f, &options, &ab);
    registrations_run(&b, NULL, a.f, &options, &ba);
    printf("# areas 1 and 4: objective %.6f %.6f, gap of the two ways %.1e\n", ab.objective,
           ba.objective, ab.inverse_consistency);
    assert_true(ab.objective == ba.objective);
    assert_true(ab.distance == ba.distance);
    assert_true(ab.inverse_consistency < 0.1);
    srnf_registration_clear(&ab);
    srnf_registration_clear(&ba);
    shapes_close(&a);
    shapes_close(&b);
}

/* Local minima can break it: the worst is printed, and must stay small. */
static void triangle_inequality(void **state)
{
    struct test_random random = test_random_seed(31);
    struct shapes_surface s[SURFACES];
    double d[SURFACES][SURFACES] = {{0.0}};
    double worst = -INFINITY;
    size_t n = 0;
    size_t most = FIGURES_SLOW ? 3 : ALL ? SURFACES : 4;
    (void)state;

    for (size_t k = 0; k < most; k++) {
        assert_true(registrations_open(&s[n++], DEGREE, surfaces[k]));
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            double gap;

            d[i][j] = d[j][i] = symmetric(&s[i], s[j].f, &gap);
        }
    }
    for (size_t k = 0; k < TRIPLES; k++) {
        size_t i = test_random_below(&random, n);
        size_t j = (i + 1 + test_random_below(&random, n - 1)) % n;
        size_t m = i;

        while (m == i || m == j) {
            m = test_random_below(&random, n);
        }
        worst = compare_max(worst, d[i][j] / (d[i][m] + d[m][j]));
    }
    printf("# %d triples of %zu surfaces: the longest side is at most %.4f of the way round\n",
           TRIPLES, n, worst);
    assert_true(worst <= 1.05);
    for (size_t k = 0; k < n; k++) {
        shapes_close(&s[k]);
    }
}

static double relative(double a, double b)
{
    return fabs(a - b) / b;
}

static void input_pose_scale_and_parameters_do_not_matter(void **state)
{
    struct test_random random = test_random_seed(32);
    struct shapes_surface a;
    struct shapes_surface b;
    struct shapes_surface fine;
    struct srnf_warp warp;
    double rotation[9];
    double before;
    double gap;
    double *f;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, surfaces[0]));
    assert_true(registrations_open(&b, DEGREE, surfaces[4]));
    f = shapes_doubles(b.count);
    before = symmetric(&a, b.f, &gap);
    registrations_warp(&random, 1.0, &warp);
    shapes_random_rotation(&random, rotation);
    registrations_resample(&b, &warp, rotation, f);
    figure_below("pose of the values and of the domain", relative(symmetric(&a, f, &gap), before),
                 0.03);
    srnf_warp_clear(&warp);
    /* Surfaces are compared as they are scaled; q scales like the root of the area. */
    shapes_open(&fine, DEGREE);
    for (size_t i = 0; i < a.count; i++) {
        fine.f[i] = 3.0 * a.f[i];
        f[i] = 3.0 * b.f[i];
    }
    shapes_update(&fine);
    figure_below("scale of both", relative(symmetric(&fine, f, &gap), 3.0 * before), 1e-6);
    registrations_warp(&random, 0.7, &warp);
    registrations_resample(&b, &warp, rotation, f);
    figure_below("another parameterization, cut to its degree",
                 relative(symmetric(&a, f, &gap), before), 0.1);
    srnf_warp_clear(&warp);
    srnf_free(f);
    shapes_close(&fine);
    shapes_close(&a);
    shapes_close(&b);
}

/* All pairs of cratered bodies, the roughest shapes there are: no warp pinches or folds. */
static void default_penalty_bounds_the_jacobian(void **state)
{
    struct shapes_surface s[BODIES];
    double least = INFINITY;
    double largest = 0.0;
    size_t n = 0;
    size_t most = FIGURES_SLOW ? 2 : ALL ? BODIES : 3;
    (void)state;

    for (size_t k = 0; k < most; k++) {
        char name[32];

        (void)snprintf(name, sizeof name, "asteroid %zu", k);
        assert_true(registrations_open(&s[n++], BODY_DEGREE, name));
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n; j++) {
            struct srnf_registration r;

            registrations_run(&s[i], NULL, s[j].f, NULL, &r);
            least = compare_min(least, r.min_jacobian);
            largest = compare_max(largest, r.max_jacobian);
            assert_true(r.min_jacobian >= 0.1 && r.max_jacobian <= 10.0);
            assert_true(r.distance <= r.distance_before);
            srnf_registration_clear(&r);
        }
    }
    for (size_t k = 0; k < n; k++) {
        shapes_close(&s[k]);
    }
    printf("# all pairs of %zu bodies: J from %.3f to %.2f\n", n, least, largest);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_both_ways_and_zero_to_itself),
        cmocka_unit_test(sizes_choose_no_way),
        cmocka_unit_test(triangle_inequality),
        cmocka_unit_test(input_pose_scale_and_parameters_do_not_matter),
        cmocka_unit_test(default_penalty_bounds_the_jacobian),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
