/*
 * test_invert_contract.c - what inversion promises its caller beside the surface: the same bits for
 * any spreading of its loops, progress, cancellation, limits, and answers to wrong arguments.
 * srnfd-test: slow
 */
#include "inversions.h"
#include "support/parallel.h"

static void same_bits_on_any_threads(void **state)
{
    const struct srnf_context contexts[] = {{.parallel_for = parallel_backwards},
                                            {.parallel_for = parallel_threads}};
    struct srnf_inversion alone;
    struct shapes_surface s;
    (void)state;

    if (FIGURES_SLOW) {
        shapes_open(&s, 12);
        shapes_fill(&s, shapes_arms, 4.0);
    } else {
        shapes_open_case(&s, shapes_find("5 arms"));
    }
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &alone, NULL), SRNF_OK);
    for (size_t k = FIGURES_SLOW ? 1 : 0; k < 2; k++) {
        struct srnf_inversion result;

        assert_int_equal(srnf_invert(s.sht, s.q, NULL, &contexts[k], &result, NULL), SRNF_OK);
        assert_memory_equal(result.coefficients, alone.coefficients, s.count * sizeof(double));
        assert_true(result.energy == alone.energy);
        assert_true(result.transforms == alone.transforms);
        assert_true(result.smallest_singular_value == alone.smallest_singular_value);
        assert_true(result.certificate.second_eigenvalue == alone.certificate.second_eigenvalue);
        srnf_inversion_clear(&result);
    }
    srnf_inversion_clear(&alone);
    shapes_close(&s);
}

struct watcher {
    size_t calls, reports;
    size_t stop_after; /* SIZE_MAX: never */
    double last;
};

static bool watch_canceled(void *user)
{
    struct watcher *w = user;

    return w->calls++ >= w->stop_after;
}

static void watch_progress(void *user, double fraction, const char *message)
{
    struct watcher *w = user;

    assert_non_null(message);
    assert_true(fraction >= 0.0 && fraction <= 1.0);
    w->last = fraction;
    w->reports++;
}

/* Every method stops at the first call that says so, with nothing left behind. */
static void cancels(void **state)
{
    const enum srnf_inversion_method methods[] = {SRNF_INVERT_AUTO, SRNF_INVERT_GAUSS_NEWTON,
                                                  SRNF_INVERT_GRADIENT};
    struct watcher w = {.stop_after = SIZE_MAX};
    struct srnf_context context = {
        .user = &w, .progress = watch_progress, .canceled = watch_canceled};
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, 10);
    shapes_fill(&s, shapes_arms, 4.0);
    for (size_t m = 0; m < 3; m++) {
        struct srnf_invert_options options = srnf_invert_options_defaults();
        struct srnf_inversion result;
        size_t calls;

        options.method = methods[m];
        options.initial = SRNF_INITIAL_SPHERE;
        options.max_iterations = 50;
        w = (struct watcher){.stop_after = SIZE_MAX};
        assert_true(srnf_invert(s.sht, s.q, &options, &context, &result, NULL) >= 0);
        srnf_inversion_clear(&result);
        assert_true(w.reports > 0 && w.last >= 0.1);
        calls = w.calls;
        assert_true(calls > 2);
        for (size_t stop = 0; stop < calls; stop += 1 + calls / 20) {
            struct srnf_error error = {0};

            w = (struct watcher){.stop_after = stop};
            assert_int_equal(srnf_invert(s.sht, s.q, &options, &context, &result, &error),
                             SRNF_ECANCELED);
            assert_int_equal(error.status, SRNF_ECANCELED);
            assert_null(result.coefficients);
            assert_null(result.history);
        }
    }
    shapes_close(&s);
}

/* The certificate as seen by someone who may want it to stop. */
struct certifying {
    bool begun;
    size_t calls, stop_after;
    double last, total, longest; /* processor seconds between two questions */
};

static bool certifying_canceled(void *user)
{
    struct certifying *c = user;
    double now = timing_cpu();

    if (!c->begun) {
        return false;
    }
    c->total += now - c->last;
    c->longest = compare_max(c->longest, now - c->last);
    c->last = now;
    return c->calls++ >= c->stop_after;
}

static void certifying_progress(void *user, double fraction, const char *message)
{
    struct certifying *c = user;

    (void)fraction;
    if (strcmp(message, "certifying") == 0) {
        c->begun = true;
        c->last = timing_cpu();
    }
}

/* The certificate takes longer than all before it: it is asked for often, and stops wherever the
   answer is yes. At degree 22 it has 1,584 unknowns and so seven panels of columns a factor. */
static void cancels_the_certificate(void **state)
{
    struct certifying c = {.stop_after = SIZE_MAX};
    struct srnf_context context = {
        .user = &c, .progress = certifying_progress, .canceled = certifying_canceled};
    struct srnf_inversion result;
    struct shapes_surface s;
    size_t calls;
    (void)state;

    shapes_open_case(&s, shapes_find("5 arms"));
    assert_true(s.degree == 22);
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, &context, &result, NULL), SRNF_OK);
    assert_true(result.certificate.computed);
    srnf_inversion_clear(&result);
    printf("# %zu questions in %.2f s of certifying, at most %.0f %% of it between two\n", c.calls,
           c.total, 100.0 * c.longest / c.total);
    calls = c.calls;
    assert_true(calls >= 3 * (s.degree + 1)); /* the orders of the matrix alone */
    assert_true(c.longest < 0.4 * c.total);
    for (size_t i = FIGURES_SLOW ? 2 : 0; i < 5; i += FIGURES_SLOW ? 5 : 1) {
        c = (struct certifying){.stop_after = i < 3 ? i * calls / 3 : calls - i + 2};
        assert_int_equal(srnf_invert(s.sht, s.q, NULL, &context, &result, NULL), SRNF_ECANCELED);
        assert_null(result.coefficients);
        assert_true(c.calls <= c.stop_after + 16);
    }
    shapes_close(&s);
}

static void stops_at_its_limit(void **state)
{
    const enum srnf_inversion_method methods[] = {SRNF_INVERT_GAUSS_NEWTON, SRNF_INVERT_GRADIENT};
    struct shapes_surface s;
    (void)state;

    shapes_open_case(&s, shapes_find("bent capsule"));
    for (size_t m = 0; m < 2; m++) {
        struct srnf_invert_options options = srnf_invert_options_defaults();
        struct srnf_inversion result;

        options.method = methods[m];
        options.initial = SRNF_INITIAL_SPHERE;
        options.max_iterations = 3;
        assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL),
                         SRNF_WNOT_CONVERGED);
        assert_true(result.iterations == 3 && !result.converged);
        assert_true(result.stopped == SRNF_STOP_MAX_ITERATIONS);
        assert_true(compare_finite(s.count, result.coefficients));
        assert_false(result.certificate.computed);
        srnf_inversion_clear(&result);
    }
    shapes_close(&s);
}

/* The closed form of a surface that is not radial is no minimum, and no search ran out. */
static void says_that_nothing_was_searched(void **state)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct shapes_surface s;
    (void)state;

    options.method = SRNF_INVERT_CLOSED_FORM;
    shapes_open_case(&s, shapes_find("bent capsule"));
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_WNOT_CONVERGED);
    assert_true(result.stopped == SRNF_STOP_CLOSED_FORM && !result.converged);
    assert_true(result.closed_form_relative_energy > SRNF_CLOSED_FORM_APPLIES);
    srnf_inversion_clear(&result);
    shapes_close(&s);
    shapes_open_case(&s, shapes_find("bumpy star"));
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_OK);
    assert_true(result.stopped == SRNF_STOP_TOLERANCE && result.converged);
    assert_true(result.closed_form_relative_energy <= SRNF_CLOSED_FORM_APPLIES);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

/* A start that is the solution needs no search, and is polished by Levenberg-Marquardt. */
static void names_what_polished_a_solution(void **state)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct shapes_surface s;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = s.f;
    options.certify = false;
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_OK);
    assert_true(result.converged && result.method == SRNF_INVERT_GAUSS_NEWTON);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

/* A minimum near the tolerance is polished with few steps: that they ran out is not why the search
   ended. */
static void polishing_is_no_limit(void **state)
{
    struct test_random random = test_random_seed(5);
    struct srnf_inversion result;
    struct shapes_surface s;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    shapes_add_noise(&s, 1e-5, &random);
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &result, NULL), SRNF_WNOT_CONVERGED);
    printf("# %s at relative energy %.1e\n", srnf_stop_name(result.stopped),
           result.relative_energy);
    assert_true(result.stopped == SRNF_STOP_STATIONARY);
    srnf_inversion_clear(&result);
    shapes_close(&s);
}

static void refuses_wrong_arguments(void **state)
{
    const double tolerances[] = {0.0, -1.0, 1e-31, 2.0, NAN};
    const double values[] = {NAN, INFINITY, 1e200};
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct srnf_error error = {0};
    struct shapes_surface s;
    double kept;
    (void)state;

    shapes_open(&s, 8);
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &result, &error), SRNF_EINVAL); /* q = 0 */
    assert_non_null(strstr(error.message, "zero"));
    shapes_fill(&s, shapes_bumpy, 0.0);
    kept = s.q[11];
    for (size_t k = 0; k < 3; k++) {
        s.q[11] = values[k];
        assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &result, &error), SRNF_EINVAL);
        assert_null(result.coefficients);
    }
    s.q[11] = kept;
    for (size_t k = 0; k < 5; k++) {
        options.tolerance = tolerances[k];
        assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, &error), SRNF_EINVAL);
        assert_non_null(strstr(error.message, "tolerance"));
    }
    options = srnf_invert_options_defaults();
    options.max_iterations = SIZE_MAX;
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_EINVAL);
    options = srnf_invert_options_defaults();
    options.initial = SRNF_INITIAL_SURFACE; /* without one */
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_EINVAL);
    options.surface = s.f;
    s.f[5] = NAN;
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_EINVAL);
    shapes_close(&s);
}

/* Starts and targets with points where n = 0 are survived, whatever comes of them. */
static void survives_degenerate_targets(void **state)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct shapes_surface s;
    double *point;
    (void)state;

    shapes_open(&s, 8);
    shapes_fill(&s, shapes_bumpy, 0.0);
    point = shapes_doubles(s.count);
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = point;
    assert_true(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL) >= 0);
    assert_true(compare_finite(s.count, result.coefficients));
    srnf_inversion_clear(&result);
    for (size_t i = 0; i < s.points; i++) { /* q without a second and third component */
        s.q[s.points + i] = s.q[2 * s.points + i] = 0.0;
    }
    assert_true(srnf_invert(s.sht, s.q, NULL, NULL, &result, NULL) >= 0);
    assert_true(compare_finite(s.count, result.coefficients));
    srnf_inversion_clear(&result);
    for (size_t i = 0; i < s.points / 2; i++) { /* q that vanishes on half of the sphere */
        s.q[i] = 0.0;
    }
    assert_true(srnf_invert(s.sht, s.q, NULL, NULL, &result, NULL) >= 0);
    assert_true(compare_finite(s.count, result.coefficients));
    srnf_inversion_clear(&result);
    srnf_free(point);
    shapes_close(&s);
}

/* Q(c f) = c Q(f), from sizes whose fourth powers leave the range of a double on either side. A
   power of two must give the same digits. */
static void does_not_care_for_the_size(void **state)
{
    const double exponents[] = {-330.0, -200.0, 200.0, 330.0};
    struct srnf_inversion plain;
    struct shapes_surface s;
    (void)state;

    shapes_open(&s, 10);
    shapes_fill(&s, shapes_bumpy, 0.0);
    assert_int_equal(srnf_invert(s.sht, s.q, NULL, NULL, &plain, NULL), SRNF_OK);
    for (size_t k = 0; k < 4; k++) {
        double scale = exp2(exponents[k]);
        double *q = shapes_doubles(3 * s.points);
        struct srnf_inversion result;

        for (size_t i = 0; i < 3 * s.points; i++) {
            q[i] = scale * s.q[i];
        }
        assert_int_equal(srnf_invert(s.sht, q, NULL, NULL, &result, NULL), SRNF_OK);
        for (size_t i = 0; i < s.count; i++) {
            assert_true(result.coefficients[i] == scale * plain.coefficients[i]);
        }
        assert_true(result.relative_energy == plain.relative_energy);
        assert_true(result.surface_error_bound == scale * plain.surface_error_bound);
        srnf_inversion_clear(&result);
        srnf_free(q);
    }
    srnf_inversion_clear(&plain);
    shapes_close(&s);
}

/* The closed form is a formula: a start that is given changes nothing. */
static void closed_form_has_no_start(void **state)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct shapes_surface s;
    double *other;
    (void)state;

    shapes_open(&s, 10);
    shapes_fill(&s, shapes_bumpy, 0.0);
    other = shapes_doubles(s.count);
    other[1] = other[s.each + 2] = other[2 * s.each + 3] = 1.0;
    options.method = SRNF_INVERT_CLOSED_FORM;
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = other;
    assert_int_equal(srnf_invert(s.sht, s.q, &options, NULL, &result, NULL), SRNF_OK);
    assert_true(result.relative_energy < 1e-20);
    srnf_inversion_clear(&result);
    srnf_free(other);
    shapes_close(&s);
}

static void names_of_stops(void **state)
{
    (void)state;
    assert_string_equal(srnf_stop_name(SRNF_STOP_TOLERANCE), "tolerance");
    assert_string_equal(srnf_stop_name(SRNF_STOP_MAX_ITERATIONS), "maxIterations");
    assert_string_equal(srnf_stop_name(SRNF_STOP_CLOSED_FORM), "closedForm");
    assert_string_equal(srnf_stop_name((enum srnf_stop)99), "unknown");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bits_on_any_threads),
        cmocka_unit_test(cancels),
        cmocka_unit_test(cancels_the_certificate),
        cmocka_unit_test(stops_at_its_limit),
        cmocka_unit_test(says_that_nothing_was_searched),
        cmocka_unit_test(names_what_polished_a_solution),
        cmocka_unit_test(polishing_is_no_limit),
        cmocka_unit_test(refuses_wrong_arguments),
        cmocka_unit_test(survives_degenerate_targets),
        cmocka_unit_test(does_not_care_for_the_size),
        cmocka_unit_test(closed_form_has_no_start),
        cmocka_unit_test(names_of_stops),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
