/*
 * test_invert.c - numerical inversion from the unit sphere, with the truth known: stars,
 * ellipsoids, capsules bent until no point sees the whole of them, and bodies with arms; each in
 * a random position.
 *
 * A low energy alone proves nothing; what is asserted is the surface error, the L2 norm of the
 * coefficients at unit area without the translation.
 * srnfd-test: slow
 * srnfd-test: no-asan (api/test_processes.sh and core/srnf/test_shape_memory.c run its code)
 */
#include "inversions.h"

#define ERROR_LIMIT 1e-5 /* at a tolerance of 1e-12 on the relative energy */
#define TIGHT_ERROR_LIMIT 1e-6
#define STRIDE (FIGURES_SLOW ? 5 : 1)

static void check_inversion(const char *name, const struct shapes_surface *s, double tolerance,
                            double limit)
{
    struct srnf_inversion result;
    double error;

    assert_int_equal(inversion_run(s, tolerance, false, NULL, &result), SRNF_OK);
    error = inversion_error(name, s, &result);
    assert_true(result.converged && result.stopped == SRNF_STOP_TOLERANCE);
    assert_true(result.relative_energy <= tolerance);
    assert_true(error <= limit);
    assert_true(fabs(result.energy - srnf_energy(s->sht, result.coefficients, s->q, NULL,
                                                 s->workspace)) <= 1e-3 * result.energy + 1e-28);
    for (size_t c = 0; c < 3; c++) {
        assert_true(result.coefficients[c * s->each] == 0.0);
    }
    for (size_t k = 1; k < result.n_history; k++) { /* E never rises, nor does the clock go back */
        assert_true(result.history[k].energy <= result.history[k - 1].energy);
        assert_true(result.history[k].seconds >= result.history[k - 1].seconds);
        assert_true(result.history[k].transforms >= result.history[k - 1].transforms);
    }
    assert_false(result.certificate.computed);
    assert_true(result.surface_error_bound < 0.0 && result.smallest_singular_value == 0.0);
    srnf_inversion_clear(&result);
}

/* Every case is turned and moved at random, and inverted at both tolerances. */
static void reaches_the_truth_from_the_sphere(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t k = 0; k < shapes_case_count; k += STRIDE) {
        struct shapes_surface s;

        shapes_open_case(&s, &shapes_cases[k]);
        shapes_move(&s, &random);
        check_inversion(shapes_cases[k].name, &s, 1e-12, ERROR_LIMIT);
        check_inversion(shapes_cases[k].name, &s, 1e-16, TIGHT_ERROR_LIMIT);
        shapes_close(&s);
    }
}

static void reaches_random_stars(void **state)
{
    struct test_random random = test_random_seed(2);
    (void)state;

    for (size_t k = 0; k < (FIGURES_SLOW ? 2 : 6); k++) {
        struct shapes_surface s;

        shapes_open(&s, k % 2 == 0 ? 15 : 31);
        shapes_fill_random_star(&s, 10 + k, NULL);
        shapes_move(&s, &random);
        check_inversion("random star", &s, 1e-12, ERROR_LIMIT);
        check_inversion("random star", &s, 1e-16, TIGHT_ERROR_LIMIT);
        shapes_close(&s);
    }
}

/* What the cases claim about themselves: no point sees the whole of a bent capsule or of a body
   with bent arms. */
static void cases_are_star_shaped_or_not(void **state)
{
    (void)state;
    for (size_t k = 0; k < shapes_case_count; k++) {
        struct shapes_surface s;
        struct srnf_star star;

        shapes_open_case(&s, &shapes_cases[k]);
        star = shapes_star(s.degree, s.f);
        printf("# %-14s L=%-3zu margin of the best centre %+.3f, sees %.1f %% from behind\n",
               shapes_cases[k].name, s.degree, star.margin, 100.0 * star.violating_area_fraction);
        assert_true(star.value == shapes_cases[k].star);
        assert_true(shapes_cases[k].star ? star.margin > 1e-2 : star.margin < -1e-3);
        shapes_close(&s);
    }
}

/* The answer does not depend on where the surface stands: the start turns with q. */
static void turns_with_its_target(void **state)
{
    const char *const names[] = {"bumpy star", "bent capsule", "5 arms"};
    struct test_random random = test_random_seed(3);
    (void)state;

    for (size_t k = 0; k < (FIGURES_SLOW ? 1 : 3); k++) {
        struct shapes_surface s;
        struct srnf_inversion still;
        struct srnf_inversion turned;
        double rotation[9];
        double difference;

        shapes_open_case(&s, shapes_find(names[k]));
        assert_int_equal(inversion_run(&s, 1e-12, false, NULL, &still), SRNF_OK);
        shapes_random_rotation(&random, rotation);
        shapes_rotate(rotation, s.points, s.q);
        assert_int_equal(inversion_run(&s, 1e-12, false, NULL, &turned), SRNF_OK);
        shapes_rotate(rotation, s.each, still.coefficients);
        difference = shapes_distance(s.degree, still.coefficients, turned.coefficients);
        printf("# %s: turned before or after, %.1e apart\n", names[k], difference);
        assert_true(difference <= 2.0 * ERROR_LIMIT);
        srnf_inversion_clear(&turned);
        srnf_inversion_clear(&still);
        shapes_close(&s);
    }
}

/* ---- The methods ----------------------------------------------------------------------------- */

static void methods_do_what_they_are_named_for(void **state)
{
    static const struct {
        enum srnf_inversion_method method;
        const char *name;
        double tolerance, limit;
        double transforms; /* at most; 0: any number */
    } methods[] = {
        {SRNF_INVERT_GAUSS_NEWTON, "bumpy star", 1e-12, 1e-5, 125.0},
        {SRNF_INVERT_GAUSS_NEWTON, "12 arms", 1e-12, 1e-5, 1000.0},
        {SRNF_INVERT_SPECTRAL, "10 arms", 1e-12, 1e-5, 0.0},
        {SRNF_INVERT_SPECTRAL, "12 arms", 1e-20, 1e-9, 0.0},
        {SRNF_INVERT_GRADIENT, "bumpy star", 1e-4, 1e-1, 0.0},
        {SRNF_INVERT_CLOSED_FORM, "bumpy star", 1e-20, 1e-12, 0.0},
    };
    (void)state;

    for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++) {
        struct srnf_invert_options options = srnf_invert_options_defaults();
        struct shapes_surface s;
        struct srnf_inversion result;

        shapes_open_case(&s, shapes_find(methods[k].name));
        options.method = methods[k].method;
        options.initial = SRNF_INITIAL_SPHERE;
        options.tolerance = methods[k].tolerance;
        options.certify = false;
        assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_OK);
        assert_true(inversion_error(methods[k].name, &s, &result) <= methods[k].limit);
        assert_true(result.method == methods[k].method);
        if (methods[k].transforms > 0.0) {
            figure_below("transforms", result.transforms, methods[k].transforms);
        }
        srnf_inversion_clear(&result);
        shapes_close(&s);
    }
}

/* Left to itself the library takes the closed form where that is good, and says so. */
static void takes_the_closed_form_where_it_is_good(void **state)
{
    struct srnf_inversion result;
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, 31);
    shapes_fill_random_star(&s, 3, NULL);
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &result, NULL), SRNF_OK);
    assert_true(result.method == SRNF_INVERT_CLOSED_FORM);
    assert_true(inversion_error("random star", &s, &result) <= 1e-12);
    assert_true(result.closed_form_relative_energy <= 1e-24);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

/* Q(-f) = Q(f): from the mirror twin of the truth the twin is found, and turned. */
static void returns_the_twin_of_positive_volume(void **state)
{
    struct srnf_inversion result;
    struct srnf_surface_measures measures;
    struct shapes_surface s;
    double *twin;
    (void)state;

    shapes_open_case(&s, shapes_find("5 arms"));
    twin = shapes_doubles(s.count);
    for (size_t i = 0; i < s.count; i++) {
        twin[i] = -1.01 * s.f[i];
    }
    assert_int_equal(inversion_run(&s, 1e-12, false, twin, &result), SRNF_OK);
    assert_true(result.flipped);
    assert_true(inversion_error("5 arms", &s, &result) <= ERROR_LIMIT);
    srnf_surface_measure(s.sht, result.coefficients, &measures, s.workspace);
    assert_true(measures.volume > 0.0);
    srnf_inversion_clear(&result);
    srnf_free(twin);
    shapes_close(&s);
}

/* A q that no surface has: the result is a stationary point and says that it is no solution. */
static void says_when_there_is_no_inverse(void **state)
{
    struct test_random random = test_random_seed(4);
    struct srnf_inversion result;
    struct shapes_surface s;
    double *gradient;
    double energy;
    double slope;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    gradient = shapes_doubles(s.count);
    shapes_add_noise(&s, 0.1, &random);
    energy = srnf_energy(s.sht, s.f, s.q, gradient, s.workspace);
    slope = figure_norm(s.count, gradient);
    assert_int_equal(inversion_run(&s, 1e-12, true, NULL, &result), SRNF_WNOT_CONVERGED);
    (void)inversion_error("0.1 of noise", &s, &result);
    assert_false(result.converged);
    assert_true(result.stopped == SRNF_STOP_STATIONARY);
    assert_true(result.relative_energy > 1e-3 && result.energy < energy);
    assert_false(result.certificate.computed);
    figure_below("gradient at the minimum, relative to that at the surface without noise",
                 result.gradient_norm / slope, 3e-2);
    srnf_free(gradient);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cases_are_star_shaped_or_not),
        cmocka_unit_test(reaches_the_truth_from_the_sphere),
        cmocka_unit_test(reaches_random_stars),
        cmocka_unit_test(turns_with_its_target),
        cmocka_unit_test(methods_do_what_they_are_named_for),
        cmocka_unit_test(takes_the_closed_form_where_it_is_good),
        cmocka_unit_test(returns_the_twin_of_positive_volume),
        cmocka_unit_test(says_when_there_is_no_inverse),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
