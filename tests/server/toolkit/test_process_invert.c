/*
 * test_process_invert.c - canonical inputs of invert: the two forms of srnf, the grid that q
 * comes on against the degree asked for, and what starts the search. Also the numbers between
 * JSON and the core.
 */
#include <math.h>

#include "server/toolkit/process_fixture.h"

#define ROWS 5
#define COLUMNS 9

/* {"srnf": {lmax 4, 5 x 9, q}} with q nested or flat; the number at `bad` is replaced by null. */
static json_t *inputs_with_q(bool nested, size_t bad)
{
    const size_t shape[3] = {ROWS, COLUMNS, 3}, flat[1] = {ROWS * COLUMNS * 3};
    double q[ROWS * COLUMNS * 3];

    for (size_t i = 0; i < flat[0]; i++) {
        q[i] = i == bad ? NAN : sin((double)i);
    }
    return json_pack("{s:{s:i, s:i, s:i, s:o}}", "srnf", "lmax", 4, "nTheta", ROWS, "nPhi", COLUMNS,
                     "q", nested ? json_nested(q, 3, shape) : json_nested(q, 1, flat));
}

static void test_q_nested_or_flat(void **state)
{
    json_t *nested = inputs_with_q(true, SIZE_MAX), *flat = inputs_with_q(false, SIZE_MAX);
    struct outcome a = canonical_outcome(*state, "invert", nested);
    struct outcome b = canonical_outcome(*state, "invert", flat);
    const json_t *q = json_object_get(json_object_get(a.canonical, "srnf"), "q");

    assert_non_null(a.canonical);
    assert_true(json_equal(a.canonical, b.canonical));
    assert_int_equal(json_array_size(q), ROWS * COLUMNS * 3);
    assert_true(json_real_value(json_array_get(q, 100)) == sin(100.0));
    assert_int_equal(json_integer_value(json_object_get(a.canonical, "lmax")), 4);
    outcome_clear(&a);
    outcome_clear(&b);
    json_decref(nested);
    json_decref(flat);
}

/* A number that is none is named by its place. */
static void test_q_wrong(void **state)
{
    for (int nested = 0; nested < 2; nested++) {
        json_t *inputs = inputs_with_q(nested, 77), *q;
        struct outcome outcome = canonical_outcome(*state, "invert", inputs);
        const json_t *error = json_array_get(outcome.errors, 0);

        assert_true(has_error(&outcome, "/inputs/srnf/q"));
        assert_non_null(strstr(json_string_value(json_object_get(error, "detail")), "77"));
        outcome_clear(&outcome);
        json_decref(inputs);

        inputs = inputs_with_q(nested, SIZE_MAX);
        q = json_object_get(json_object_get(inputs, "srnf"), "q");
        (void)json_array_remove(q, 0);
        outcome = canonical_outcome(*state, "invert", inputs);
        assert_true(has_error(&outcome, "/inputs/srnf/q"));
        outcome_clear(&outcome);
        json_decref(inputs);
    }
}

/* A degree that the grid does not resolve is refused, whichever of the two says it. */
static void test_grid_and_degree(void **state)
{
    json_t *inputs = inputs_with_q(false, SIZE_MAX);
    struct outcome outcome;

    (void)json_object_set_new(inputs, "lmax", json_integer(5));
    outcome = canonical_outcome(*state, "invert", inputs);
    assert_true(has_error(&outcome, "/inputs/lmax"));
    outcome_clear(&outcome);
    (void)json_object_del(inputs, "lmax");
    (void)json_object_set_new(json_object_get(inputs, "srnf"), "nPhi", json_integer(8));
    outcome = canonical_outcome(*state, "invert", inputs);
    assert_true(has_error(&outcome, "/inputs/srnf/nPhi"));
    outcome_clear(&outcome);
    json_decref(inputs);
    refused(*state, "invert", "{\"srnf\":{\"lmax\":4,\"nTheta\":1e9,\"nPhi\":9,\"q\":[]}}",
            "/inputs/srnf/nTheta");
}

static void test_srnf(void **state)
{
    struct outcome outcome = canonicalize_text(*state, "invert", "{\"srnf\":{\"surface\":\"@\"}}");

    assert_int_equal(json_integer_value(json_object_get(outcome.canonical, "lmax")),
                     SURFACE_DEGREE);
    outcome_clear(&outcome);
    outcome = canonicalize_text(*state, "invert", "{\"srnf\":{\"surface\":\"" GOOD_MESH "\"}}");
    assert_int_equal(json_integer_value(json_object_get(outcome.canonical, "lmax")),
                     PROCESS_DEGREE_DEFAULT);
    outcome_clear(&outcome);
    answered(*state, "invert", "{\"srnf\":{\"surface\":\"" ABSENT_SURFACE "\"}}", 404,
             "no-such-surface");
    answered(*state, "invert", "{\"srnf\":{\"surface\":\"" OPEN_MESH "\"}}", 422,
             "mesh-not-closed");
    refused(*state, "invert", "{\"srnf\":\"@\"}", "/inputs/srnf");
    refused(*state, "invert", "{\"srnf\":{\"surface\":\"@\",\"lmax\":4}}", "/inputs/srnf");
    refused(*state, "invert", "{\"srnf\":{\"lmax\":4,\"nTheta\":5,\"nPhi\":9,\"q\":[],\"x\":1}}",
            "/inputs/srnf");
    refused(*state, "invert", "{\"srnf\":{\"surface\":\"x\"}}", "/inputs/srnf/surface");
}

static void test_initial(void **state)
{
    same(*state, "invert", "{\"srnf\":{\"surface\":\"@\"}}",
         "{\"srnf\":{\"surface\":\"@\"},\"initial\":\"auto\",\"maxIterations\":null,\"lmax\":9}");
    same(*state, "invert", "{\"srnf\":{\"surface\":\"@\"},\"initial\":\"@\",\"tolerance\":1}",
         "{\"srnf\":{\"surface\":\"@\"},\"initial\":\"@\",\"tolerance\":1.0}");
    refused(*state, "invert", "{\"srnf\":{\"surface\":\"@\"},\"initial\":\"cube\"}",
            "/inputs/initial");
    refused(*state, "invert", "{\"srnf\":{\"surface\":\"@\"},\"initial\":3}", "/inputs/initial");
    answered(*state, "invert", "{\"srnf\":{\"surface\":\"@\"},\"initial\":\"" ABSENT_SURFACE "\"}",
             404, "no-such-surface");
}

/* Methods that do not search refuse a place to start from, and take auto. */
static void test_initial_of_direct_methods(void **state)
{
    static const char *const direct[] = {"closed-form", "spectral"};
    static const char *const starts[] = {"sphere", "star", "@", "auto"};

    for (size_t i = 0; i < 2; i++) {
        for (size_t k = 0; k < 4; k++) {
            struct outcome outcome;
            char text[200];

            (void)snprintf(text, sizeof text,
                           "{\"srnf\":{\"surface\":\"@\"},\"method\":\"%s\",\"initial\":\"%s\"}",
                           direct[i], starts[k]);
            outcome = canonicalize_text(*state, "invert", text);
            assert_int_equal(has_error(&outcome, "/inputs/initial"), k < 3);
            outcome_clear(&outcome);
        }
    }
}

/* The surface is refused with that code: the store (there is none) is not asked. */
static void is_unsound(struct surface_description description, const char *code)
{
    struct jobs_result result = {0};

    description.source = json_object();
    description.fit = json_object();
    assert_null(process_keep_surface(NULL, &description, "the mean", &result));
    assert_string_equal(result.problem_code, code);
    assert_int_equal(strncmp(result.problem_detail, "the mean: ", 10), 0);
    assert_null(strstr(result.problem_detail, "nan"));
}

/* What every process that makes surfaces asks before it stores one. */
static void test_unsound_surfaces(void **state)
{
    double coefficients[3 * 25] = {0};
    struct srnf_surface_measures measures = {.area = 0.0};
    struct surface_description description = {
        .degree = 4, .coefficients = coefficients, .scale = 1.0, .measures = &measures};

    (void)state;
    is_unsound(description, "not-converged");
    measures.area = 1e-320;
    is_unsound(description, "not-converged");
    measures.area = NAN;
    is_unsound(description, "numerical-failure");
    measures = (struct srnf_surface_measures){.area = 1.0, .volume = INFINITY};
    is_unsound(description, "numerical-failure");
    measures.volume = 1.0;
    description.scale = INFINITY;
    is_unsound(description, "numerical-failure");
    description.scale = 1.0;
    for (size_t i = 0; i < 3 * 25; i += 37) {
        coefficients[i] = i % 2 ? NAN : -INFINITY;
        is_unsound(description, "numerical-failure");
        coefficients[i] = 0.0;
    }
}

static void test_numbers(void **state)
{
    const double values[4] = {1.0, NAN, INFINITY, -INFINITY};
    double wire[6] = {0, 1, 2, 3, 4, 5}, blocks[6], back[6];
    json_t *array = json_vector(values, 4);

    (void)state;
    assert_true(json_is_real(json_array_get(array, 0)));
    for (size_t i = 1; i < 4; i++) {
        assert_true(json_is_null(json_array_get(array, i)));
    }
    json_decref(array);
    field_split(2, wire, blocks);
    assert_true(blocks[0] == 0 && blocks[1] == 3 && blocks[2] == 1 && blocks[5] == 5);
    field_interleave(2, blocks, back);
    assert_memory_equal(wire, back, sizeof wire);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_q_nested_or_flat), cmocka_unit_test(test_q_wrong),
        cmocka_unit_test(test_grid_and_degree),  cmocka_unit_test(test_srnf),
        cmocka_unit_test(test_initial),          cmocka_unit_test(test_initial_of_direct_methods),
        cmocka_unit_test(test_unsound_surfaces), cmocka_unit_test(test_numbers),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
