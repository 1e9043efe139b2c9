/*
 * test_registration_report.c - when a registration is warned of, with what figures, and what its
 * figures are where something is not known.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <string.h>

#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"

static double nothing[3]; /* coefficients: there was a registration */

/* One that nothing is to be said against. */
static struct srnf_registration sound(void)
{
    return (struct srnf_registration){.coefficients = nothing,
                                      .distance = 0.2,
                                      .truncation_error = 0.05,
                                      .truncation_distance = 0.05,
                                      .min_jacobian = 0.4,
                                      .max_jacobian = 2.5,
                                      .rotations_searched = true,
                                      .ambiguity_objective = 1.2,
                                      .ambiguity_angle = 2.0,
                                      .rotational_curvature = 0.1,
                                      .converged = true,
                                      .stopped = SRNF_REGISTER_STATIONARY};
}

/* The codes expected, separated by blanks; the details name what was registered. */
static void warns(const struct srnf_registration *r, const char *expected)
{
    json_t *document = json_object(), *entry;
    char codes[256] = "";
    size_t i;

    registration_warn(document, r, "this onto that");
    json_array_foreach(json_object_get(document, "warnings"), i, entry)
    {
        (void)strncat(codes, i ? " " : "", sizeof codes - strlen(codes) - 1);
        (void)strncat(codes, json_string_value(json_object_get(entry, "code")),
                      sizeof codes - strlen(codes) - 1);
        assert_non_null(strstr(json_string_value(json_object_get(entry, "detail")),
                               "Registering this onto that: "));
        assert_true(json_object_size(json_object_get(entry, "figures")) >= 2);
    }
    assert_true(json_is_array(json_object_get(document, "warnings")));
    assert_string_equal(codes, expected);
    json_decref(document);
}

static void truncation_is_read_against_the_distance(void **state)
{
    struct srnf_registration r = sound();
    (void)state;

    warns(&r, "");
    r.truncation_error = r.truncation_distance = 0.11;
    warns(&r, "registration-truncated");
    r.distance = 0.23;
    warns(&r, "");
    r.truncation_error = r.truncation_distance = 0.019; /* little in itself */
    r.distance = 1e-3;
    warns(&r, "");
    r.truncation_error = 0.021; /* of a surface ten times as large, whose norm is 10 */
    r.truncation_distance = 0.21;
    r.distance = 0.4;
    warns(&r, "registration-truncated");
}

static void areas_may_change_by_less_than_ten(void **state)
{
    struct srnf_registration r = sound();
    (void)state;

    r.min_jacobian = 0.1;
    r.max_jacobian = 10.0;
    warns(&r, "");
    r.min_jacobian = 0.09;
    warns(&r, "registration-distorted");
    r.min_jacobian = 0.4;
    r.max_jacobian = 10.1;
    warns(&r, "registration-distorted");
}

static void another_basin_must_be_worse_by_five_percent(void **state)
{
    struct srnf_registration r = sound();
    (void)state;

    r.ambiguity_objective = 1.051;
    warns(&r, "");
    r.ambiguity_objective = 1.049;
    warns(&r, "registration-ambiguous");
    r.ambiguity_objective = 0.0; /* none was found */
    warns(&r, "");
    r.rotational_curvature = 0.019;
    warns(&r, "registration-ambiguous");
    r.rotations_searched = false;
    warns(&r, "");
}

static void steps_may_run_out(void **state)
{
    struct srnf_registration r = sound();
    (void)state;

    r.stopped = SRNF_REGISTER_MAX_ITERATIONS;
    r.converged = false;
    warns(&r, "registration-not-converged");
    r.coefficients = NULL; /* nothing was registered */
    warns(&r, "");
}

/* Of two registrations of one result, both; the same one twice is told once. */
static void warnings_come_together(void **state)
{
    struct srnf_registration r = sound();
    json_t *document = json_object();
    (void)state;

    r.max_jacobian = 20.0;
    registration_warn(document, &r, "a onto b");
    registration_warn(document, &r, "b onto c");
    registration_warn(document, &r, "b onto c");
    assert_int_equal(json_array_size(json_object_get(document, "warnings")), 2);
    json_decref(document);
}

static void figures_say_what_is_not_known(void **state)
{
    struct srnf_register_options both = registration_pair_defaults(false);
    struct srnf_register_options one = registration_defaults(true);
    struct srnf_registration r = sound();
    json_t *figures = registration_figures(&r, &both), *ambiguity;
    (void)state;

    assert_true(both.symmetric && !one.symmetric);
    assert_string_equal(json_string_value(json_object_get(figures, "stopped")), "stationary");
    assert_true(json_is_true(json_object_get(figures, "symmetric")));
    assert_true(json_is_real(json_object_get(figures, "inverseConsistency")));
    ambiguity = json_object_get(figures, "ambiguity");
    assert_true(json_real_value(json_object_get(ambiguity, "objective")) == 1.2);
    assert_true(json_real_value(json_object_get(ambiguity, "angle")) == 2.0);
    json_decref(figures);
    r.rotations_searched = false;
    r.stopped = SRNF_REGISTER_MAX_ITERATIONS;
    r.converged = false;
    figures = registration_figures(&r, &one);
    ambiguity = json_object_get(figures, "ambiguity");
    assert_true(json_is_null(json_object_get(ambiguity, "objective")));
    assert_true(json_is_null(json_object_get(ambiguity, "angle")));
    assert_true(json_is_null(json_object_get(ambiguity, "rotationalCurvature")));
    assert_true(json_is_null(json_object_get(figures, "inverseConsistency")));
    assert_true(json_is_false(json_object_get(figures, "symmetric")));
    assert_true(json_is_false(json_object_get(figures, "converged")));
    assert_string_equal(json_string_value(json_object_get(figures, "stopped")), "maxIterations");
    assert_non_null(strstr(json_string_value(json_object_get(figures, "note")), "One way"));
    json_decref(figures);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(truncation_is_read_against_the_distance),
        cmocka_unit_test(areas_may_change_by_less_than_ten),
        cmocka_unit_test(another_basin_must_be_worse_by_five_percent),
        cmocka_unit_test(steps_may_run_out),
        cmocka_unit_test(warnings_come_together),
        cmocka_unit_test(figures_say_what_is_not_known),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
