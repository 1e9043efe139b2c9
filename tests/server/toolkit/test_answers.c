/*
 * test_answers.c - doubts from the figures of a result: surfaces far from what was asked for, paths
 * that jump between solutions and what a metric does not register are told of, with their figures;
 * ordinary results are not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/answers.h"

/* The codes of the warnings of a document, each with a space behind it. */
static void told(const char *inputs, const char *document, const char *codes)
{
    json_t *given = json_loads(inputs, 0, NULL), *result = json_loads(document, 0, NULL), *warning;
    char text[200] = "";
    size_t i, used = 0;

    assert_non_null(given);
    assert_non_null(result);
    answers_warn(given, result);
    json_array_foreach(warnings_of(result), i, warning)
    {
        used += (size_t)snprintf(text + used, sizeof text - used, "%s ",
                                 json_string_value(json_object_get(warning, "code")));
        assert_true(used < sizeof text);
        assert_true(strlen(json_string_value(json_object_get(warning, "detail"))) > 40);
    }
    assert_string_equal(text, codes);
    json_decref(given);
    json_decref(result);
}

static void surfaces_far_from_their_fields_are_told(void **state)
{
    (void)state;
    told("{}", "{\"relativeEnergy\":0.296}", "not-reached ");
    told("{}", "{\"relativeEnergy\":0.07}", "");
    told("{}", "{\"relativeEnergy\":null}", "");
    told("{}", "{\"relativeEnergy\":[0.01,0.2]}", "not-reached ");
    told("{}", "{\"relativeEnergies\":[0.16,1e-20,0.16]}", "not-reached ");
    told("{}", "{\"relativeEnergies\":[0.01,null]}", "");
    told("{}", "{}", "");
    told("{\"method\":\"pullback\"}", "{\"relativeEnergies\":[0.4]}", "");
}

/* Only the curve of the surfaces that the geodesic has counts. */
static void a_geodesic_has_the_curve_of_its_method(void **state)
{
    const char *curves = "{\"relativeEnergies\":{\"geodesic\":[0,0.01],\"linear\":[0,0.3],"
                         "\"closedForm\":[0,0.5]}}";

    (void)state;
    told("{\"method\":\"srnf\"}", curves, "");
    told("{\"method\":\"linear\"}", curves, "not-reached ");
    told("{\"method\":\"closed-form\"}", curves, "not-reached ");
}

static void the_figures_name_the_worst(void **state)
{
    json_t *inputs = json_object();
    json_t *document = json_loads("{\"relativeEnergies\":[0.2,0.01,0.5]}", 0, NULL), *figures;

    (void)state;
    answers_warn(inputs, document);
    figures = json_object_get(json_array_get(warnings_of(document), 0), "figures");
    assert_true(json_number_value(json_object_get(figures, "relativeEnergy")) == 0.5);
    assert_int_equal(json_integer_value(json_object_get(figures, "index")), 2);
    assert_int_equal(json_integer_value(json_object_get(figures, "beyond")), 2);
    assert_int_equal(json_integer_value(json_object_get(figures, "of")), 3);
    json_decref(document);
    json_decref(inputs);
}

static void paths_that_jump_are_told(void **state)
{
    (void)state;
    told("{\"method\":\"srnf\"}", "{\"length\":24.0,\"lineLength\":9.0}", "path-jumps ");
    told("{\"method\":\"srnf\"}", "{\"length\":0.6,\"lineLength\":0.5}", "");
    told("{\"method\":\"srnf\"}", "{\"length\":0.0,\"lineLength\":0.0}", "");
    told("{\"method\":\"linear\"}", "{\"length\":24.0,\"lineLength\":9.0}", "");
    told("{\"method\":\"pullback\"}", "{\"length\":24.0,\"lineLength\":9.0}", "");
}

static void harmonic_tells_what_it_registers(void **state)
{
    (void)state;
    told("{\"metric\":\"harmonic\",\"register\":true}", "{}", "parameters-not-registered ");
    told("{\"metric\":\"harmonic\",\"register\":false}", "{}", "");
    told("{\"metric\":\"srnf\",\"register\":true}", "{}", "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_far_from_their_fields_are_told),
        cmocka_unit_test(a_geodesic_has_the_curve_of_its_method),
        cmocka_unit_test(the_figures_name_the_worst),
        cmocka_unit_test(paths_that_jump_are_told),
        cmocka_unit_test(harmonic_tells_what_it_registers),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
