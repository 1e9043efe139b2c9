/*
 * test_process_transport.c - canonical inputs of shoot, transport and transfer: each form of a
 * velocity, one spelling for each meaning, and limits that are named.
 */
#include "server/toolkit/process_fixture.h"

#define SHOOT "{\"surface\":\"@\",\"velocity\":"

/* coefficients {lmax, x, y, z} of a degree, with so many numbers in z. */
static json_t *motion(size_t lmax, size_t in_z)
{
    json_t *object = json_pack("{s:I, s:[], s:[], s:[]}", "lmax", (json_int_t)lmax, "x", "y", "z");

    for (size_t i = 0; i < srnf_coefficient_count(lmax); i++) {
        (void)json_array_append_new(json_object_get(object, "x"), json_real(0.5));
        (void)json_array_append_new(json_object_get(object, "y"), json_integer(0));
    }
    for (size_t i = 0; i < in_z; i++) {
        (void)json_array_append_new(json_object_get(object, "z"), json_real(-0.0));
    }
    return json_pack("{s:o}", "coefficients", object);
}

/* srnf {lmax, nTheta, nPhi, q}, flat. */
static json_t *field(size_t lmax, size_t rows)
{
    json_t *q = json_array();

    for (size_t i = 0; i < 3 * rows * 2 * rows; i++) {
        (void)json_array_append_new(q, json_real(1.0));
    }
    return json_pack("{s:{s:I, s:I, s:I, s:o}}", "srnf", "lmax", (json_int_t)lmax, "nTheta",
                     (json_int_t)rows, "nPhi", (json_int_t)(2 * rows), "q", q);
}

/* transport from and to the surface of the fixture; vector is taken over. */
static struct outcome transport(struct fixture *fixture, json_t *vector, bool registered)
{
    json_t *inputs = json_pack("{s:s, s:s, s:o, s:b}", "from", fixture->surface, "to",
                               fixture->surface, "vector", vector, "register", registered);
    struct outcome outcome = canonical_outcome(fixture, "transport", inputs);

    json_decref(inputs);
    return outcome;
}

static void test_one_form(void **state)
{
    same(*state, "shoot", SHOOT "{\"toward\":\"" GOOD_MESH "\"}}",
         SHOOT "{\"toward\":\"" GOOD_MESH
               "\"},\"register\":true,\"times\":[0,0.25,0.5,0.75,1],\"method\":\"srnf\"}");
    same(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"register\":false}",
         SHOOT "{\"toward\":\"@\"},\"register\":false,\"commonPose\":true}");
    refused(*state, "shoot", SHOOT "{}}", "/inputs/velocity");
    refused(*state, "shoot", SHOOT "\"@\"}", "/inputs/velocity");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\",\"coefficients\":{}}}", "/inputs/velocity");
    refused(*state, "shoot", SHOOT "{\"toward\":7}}", "/inputs/velocity/toward");
    refused(*state, "shoot", SHOOT "{\"coefficients\":[1]}}", "/inputs/velocity/coefficients");
    refused(*state, "shoot", SHOOT "{\"srnf\":{}}}", "/inputs/velocity/srnf/nTheta");
    answered(*state, "shoot", SHOOT "{\"toward\":\"" ABSENT_SURFACE "\"}}", 404, "no-such-surface");
    answered(*state, "shoot", SHOOT "{\"toward\":\"" OPEN_MESH "\"}}", 422, "mesh-not-closed");
    answered(*state, "shoot",
             "{\"surface\":\"" ABSENT_SURFACE "\",\"velocity\":{\"toward\":\"@\"}}", 404,
             "no-such-surface");
}

static void test_times(void **state)
{
    same(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"times\":[1,-0.0,-10]}",
         SHOOT "{\"toward\":\"@\"},\"times\":[1.0,0,-10.0]}");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"times\":[]}", "/inputs/times");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"times\":1}", "/inputs/times");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"times\":[0,10.5]}", "/inputs/times");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"times\":[\"1\"]}", "/inputs/times");
    refused(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"method\":\"flow\"}", "/inputs/method");
    same(*state, "shoot", SHOOT "{\"toward\":\"@\"},\"method\":\"pullback\"}",
         SHOOT "{\"toward\":\"@\"},\"register\":true,\"method\":\"pullback\"}");
}

static void test_motion(void **state)
{
    struct fixture *fixture = *state;
    const size_t count = srnf_coefficient_count(SURFACE_DEGREE);
    struct outcome outcome = transport(fixture, motion(SURFACE_DEGREE, count), true);

    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
    outcome = transport(fixture, motion(SURFACE_DEGREE - 1, count), true);
    assert_true(has_error(&outcome, "/inputs/vector/coefficients/z"));
    outcome_clear(&outcome);
    outcome = transport(fixture, motion(SURFACE_DEGREE + 1, count), true);
    assert_true(has_error(&outcome, "/inputs/vector/coefficients"));
    outcome_clear(&outcome);
}

/* A field belongs to the grid of the surfaces and to surfaces as they are parameterized. */
static void test_field(void **state)
{
    struct fixture *fixture = *state;
    const size_t rows = srnf_working_rows(SURFACE_DEGREE);
    struct outcome outcome = transport(fixture, field(SURFACE_DEGREE, rows), false);

    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
    outcome = transport(fixture, field(SURFACE_DEGREE, rows), true);
    assert_true(has_error(&outcome, "/inputs/register"));
    outcome_clear(&outcome);
    outcome = transport(fixture, field(SURFACE_DEGREE, rows + 1), false);
    assert_true(has_error(&outcome, "/inputs/vector/srnf"));
    outcome_clear(&outcome);
    outcome = transport(fixture, field(SURFACE_DEGREE - 1, rows), false);
    assert_true(has_error(&outcome, "/inputs/vector/srnf"));
    outcome_clear(&outcome);
}

static void test_transfer(void **state)
{
    same(*state, "transfer", "{\"source\":\"@\",\"deformed\":\"" GOOD_MESH "\",\"target\":\"@\"}",
         "{\"target\":\"@\",\"deformed\":\"" GOOD_MESH
         "\",\"source\":\"@\",\"size\":\"ratio\",\"commonPose\":false}");
    refused(*state, "transfer",
            "{\"source\":\"@\",\"deformed\":\"@\",\"target\":\"@\",\"size\":\"mm\"}",
            "/inputs/size");
    answered(*state, "transfer",
             "{\"source\":\"@\",\"deformed\":\"@\",\"target\":\"" OPEN_MESH "\"}", 422,
             "mesh-not-closed");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_form), cmocka_unit_test(test_times),
        cmocka_unit_test(test_motion),   cmocka_unit_test(test_field),
        cmocka_unit_test(test_transfer),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
