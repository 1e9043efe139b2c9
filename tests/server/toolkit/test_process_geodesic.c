/*
 * test_process_geodesic.c - canonical inputs of geodesic: ends may be surfaces or meshes, and what
 * a method cannot take is refused.
 */
#include "server/toolkit/process_fixture.h"

static void test_ends(void **state)
{
    same(*state, "geodesic", "{\"from\":\"@\",\"to\":\"" GOOD_MESH "\"}",
         "{\"to\":\"" GOOD_MESH
         "\",\"method\":\"srnf\",\"register\":true,\"symmetric\":true,\"steps\":7,\"from\":\"@\"}");
    answered(*state, "geodesic", "{\"from\":\"@\",\"to\":\"" ABSENT_SURFACE "\"}", 404,
             "no-such-surface");
    answered(*state, "geodesic", "{\"from\":\"" ABSENT_MESH "\",\"to\":\"@\"}", 404,
             "no-such-mesh");
    answered(*state, "geodesic", "{\"from\":\"" OPEN_MESH "\",\"to\":\"@\"}", 422,
             "mesh-not-closed");
    refused(*state, "geodesic", "{\"from\":\"@\",\"to\":\"model-1\"}", "/inputs/to");
    refused(*state, "geodesic", "{\"from\":{\"surface\":\"@\"},\"to\":\"@\"}", "/inputs/from");
}

static void test_options(void **state)
{
    refused(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"register\":\"no\"}",
            "/inputs/register");
    same(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"steps\":3,\"method\":\"pullback\"}",
         "{\"method\":\"pullback\",\"register\":true,\"symmetric\":true,\"steps\":3,\"to\":\"@\","
         "\"from\":\"@\"}");
    refused(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"steps\":2,\"method\":\"pullback\"}",
            "/inputs/steps");
    same(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"steps\":2}",
         "{\"method\":\"srnf\",\"register\":true,\"symmetric\":true,\"steps\":2,\"to\":\"@\","
         "\"from\":\"@\"}");
}

/* How nothing is registered has one spelling. */
static void test_symmetric(void **state)
{
    same(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"register\":false,\"symmetric\":false}",
         "{\"from\":\"@\",\"to\":\"@\",\"register\":false,\"symmetric\":true}");
    refused(*state, "geodesic", "{\"from\":\"@\",\"to\":\"@\",\"symmetric\":1}",
            "/inputs/symmetric");
}

/* Every wrong member is named in one answer. */
static void test_all_at_once(void **state)
{
    struct outcome outcome =
        canonicalize_text(*state, "geodesic",
                          "{\"from\":\"@\",\"to\":\"@\",\"steps\":1,\"method\":\"x\",\"more\":0}");

    assert_true(has_error(&outcome, "/inputs/steps"));
    assert_true(has_error(&outcome, "/inputs/method"));
    assert_true(has_error(&outcome, "/inputs/more"));
    outcome_clear(&outcome);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ends),
        cmocka_unit_test(test_options),
        cmocka_unit_test(test_symmetric),
        cmocka_unit_test(test_all_at_once),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
