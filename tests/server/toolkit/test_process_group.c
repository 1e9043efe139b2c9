/*
 * test_process_group.c - canonical inputs of registration and of the names on groups and
 * models: one spelling for each meaning, cohorts resolved to what they name, and limits that are
 * named.
 * srnfd-test: once (what inputs mean does not depend on the build)
 */
#include "server/toolkit/process_fixture.h"
#include "store/surface.h"

#include <math.h>

#define TWO "{\"surfaces\":[\"@\",\"" GOOD_MESH "\"]"

static void test_register(void **state)
{
    same(*state, "register", "{\"template\":\"@\",\"moving\":\"" GOOD_MESH "\"}",
         "{\"moving\":\"" GOOD_MESH
         "\",\"template\":\"@\",\"penalty\":{\"jacobian\":0.003},\"degree\":12.0,"
         "\"start\":\"tournament\",\"symmetric\":false}");
    same(*state, "register", "{\"template\":\"@\",\"moving\":\"@\",\"penalty\":\"none\"}",
         "{\"template\":\"@\",\"moving\":\"@\",\"penalty\":{\"jacobian\":-0.0,"
         "\"displacement\":0}}");
    refused(*state, "register", "{\"template\":\"@\",\"moving\":\"@\",\"penalty\":\"some\"}",
            "/inputs/penalty");
    refused(*state, "register", "{\"template\":\"@\",\"moving\":\"@\",\"penalty\":{\"more\":1}}",
            "/inputs/penalty");
    refused(*state, "register",
            "{\"template\":\"@\",\"moving\":\"@\",\"penalty\":{\"jacobian\":-1}}",
            "/inputs/penalty/jacobian");
    answered(*state, "register", "{\"template\":\"@\",\"moving\":\"" OPEN_MESH "\"}", 422,
             "mesh-not-closed");
}

/* A cohort is what it names: other inputs than its surfaces, as its labels are told too. */
static void test_cohort(void **state)
{
    struct outcome outcome = canonicalize_text(*state, "distances", "{\"cohort\":\"group\"}");
    const json_t *surfaces = json_object_get(outcome.canonical, "surfaces");
    const json_t *cohort = json_object_get(outcome.canonical, "cohort");

    assert_int_equal(json_array_size(surfaces), 2);
    assert_string_equal(json_string_value(json_array_get(surfaces, 1)), GOOD_MESH);
    assert_string_equal(json_string_value(json_object_get(cohort, "name")), "group");
    assert_string_equal(json_string_value(json_array_get(json_object_get(cohort, "labels"), 0)),
                        "a");
    outcome_clear(&outcome);
    answered(*state, "distances", "{\"cohort\":\"another\"}", 404, "no-such-cohort");
    refused(*state, "distances", "{\"cohort\":\"a/b\"}", "/inputs/cohort");
    refused(*state, "distances", "{\"cohort\":7}", "/inputs/cohort");
    refused(*state, "distances", "{}", "/inputs/surfaces");
    refused(*state, "distances", TWO ",\"cohort\":\"group\"}", "/inputs/cohort");
}

static void test_surfaces(void **state)
{
    same(*state, "distances", TWO "}", TWO ",\"cohort\":null,\"register\":true}");
    refused(*state, "mean", "{\"surfaces\":[\"@\"]}", "/inputs/surfaces");
    refused(*state, "mean", "{\"surfaces\":\"@\"}", "/inputs/surfaces");
    refused(*state, "mean", "{\"surfaces\":[\"@\",7]}", "/inputs/surfaces/1");
    answered(*state, "mean", "{\"surfaces\":[\"@\",\"" ABSENT_SURFACE "\"]}", 404,
             "no-such-surface");
    answered(*state, "mean", "{\"surfaces\":[\"@\",\"" OPEN_MESH "\"]}", 422, "mesh-not-closed");
    refused(*state, "distances", TWO ",\"metric\":\"spharm\"}", "/inputs/metric");
}

/* Of the surface of the fixture no route is known: it goes with any. */
static void test_mixed_routes(void **state)
{
    static const char *const names[] = {"distances", "mean", "pca", "evaluate-model"};

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const char *three = "{\"surfaces\":[\"@\",\"@\",\"" GOOD_MESH "\"]";
        char plain[200], spelt[240], wrong[240];

        (void)snprintf(plain, sizeof plain, "%s}", three);
        (void)snprintf(spelt, sizeof spelt, "%s,\"mixedRoutes\":false}", three);
        (void)snprintf(wrong, sizeof wrong, "%s,\"mixedRoutes\":null}", three);
        same(*state, names[i], plain, spelt);
        refused(*state, names[i], wrong, "/inputs/mixedRoutes");
    }
    refused(*state, "evaluate-model", "{\"model\":\"%\",\"mixedRoutes\":true}",
            "/inputs/mixedRoutes");
}

static void put_star(const struct fixture *fixture, char id[STORE_ID_MAX])
{
    struct store_surface surface = {.lmax = SURFACE_DEGREE, .created_ms = 1};
    bool created;

    surface.coefficient_count = 3 * srnf_coefficient_count(SURFACE_DEGREE);
    surface.coefficients = calloc(surface.coefficient_count, sizeof(double));
    assert_non_null(surface.coefficients);
    surface.coefficients[5] = 1.0;
    store_surface_id(surface.id, surface.lmax, surface.coefficients, 1.0);
    surface.name = strdup("");
    surface.record = strdup("{\"route\":\"star\",\"parameterization\":\"star\",\"scale\":12.5,"
                            "\"smoothing\":0,\"starShaped\":{\"center\":[0,0,0]},"
                            "\"source\":{\"process\":\"encode\",\"mesh\":\"" GOOD_MESH "\"}}");
    assert_int_equal(store_surface_put(fixture->store, &surface, &created), 0);
    memcpy(id, surface.id, STORE_ID_MAX);
    store_surface_clear(&surface);
}

static double seconds_of(struct fixture *fixture, const char *process, const char *first,
                         const char *more)
{
    struct outcome outcome;
    char text[300];
    double seconds;

    (void)snprintf(text, sizeof text,
                   "{\"surfaces\":[\"%s\",\"" GOOD_MESH "\"],\"mixedRoutes\":true%s}", first, more);
    outcome = canonicalize_text(fixture, process, text);
    assert_non_null(outcome.canonical);
    seconds = outcome.seconds;
    outcome_clear(&outcome);
    return seconds;
}

/* Encoding a member by another route again is work that a job is expected to do, where it does. */
static void test_bridges_take_time(void **state)
{
    static const char *const names[] = {"distances", "mean", "pca"};
    struct fixture *fixture = *state;
    char star[STORE_ID_MAX];

    put_star(fixture, star);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        double with = seconds_of(fixture, names[i], star, "");
        double without = seconds_of(fixture, names[i], "@", "");

        assert_true(with > without + 0.02 && with < without + 1.0);
        with = seconds_of(fixture, names[i], star, ",\"register\":false");
        without = seconds_of(fixture, names[i], "@", ",\"register\":false");
        assert_true(fabs(with - without) < 1e-12);
    }
}

/* lmax defaults to the largest degree of the members; a mesh has the default one. */
static void test_degree(void **state)
{
    same(*state, "mean", TWO "}", TWO ",\"lmax\":31}");
    same(*state, "mean", "{\"surfaces\":[\"@\",\"@\"]}", "{\"surfaces\":[\"@\",\"@\"],\"lmax\":9}");
    refused(*state, "pca", TWO ",\"method\":\"pullback\"}", "/inputs/method");
}

/* The mean alone knows the pulled-back metric, of so many surfaces and in so much memory. */
static void test_pullback(void **state)
{
    const struct fixture *fixture = *state;
    json_t *inputs = json_pack("{s:[], s:i, s:s}", "surfaces", "lmax", 9, "method", "pullback");
    struct outcome outcome;

    same(*state, "mean", TWO ",\"method\":\"pullback\"}",
         TWO ",\"lmax\":31,\"method\":\"pullback\"}");
    for (int i = 0; i < PROCESS_PULLBACK_GROUP_MAX; i++) {
        (void)json_array_append_new(json_object_get(inputs, "surfaces"),
                                    json_string(fixture->surface));
    }
    outcome = canonical_outcome(*state, "mean", inputs);
    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
    (void)json_object_set_new(inputs, "lmax", json_integer(127));
    outcome = canonical_outcome(*state, "mean", inputs);
    assert_true(has_error(&outcome, "/inputs"));
    outcome_clear(&outcome);
    (void)json_object_set_new(inputs, "lmax", json_integer(9));
    (void)json_array_append_new(json_object_get(inputs, "surfaces"), json_string(fixture->surface));
    outcome = canonical_outcome(*state, "mean", inputs);
    assert_true(has_error(&outcome, "/inputs/method"));
    outcome_clear(&outcome);
    json_decref(inputs);
}

/* So many surfaces of so high a degree are refused with both limits, before anything runs. */
static void test_memory(void **state)
{
    struct outcome outcome;
    json_t *inputs = json_pack("{s:[], s:i}", "surfaces", "lmax", 127);
    const struct fixture *fixture = *state;
    const char *detail;

    for (int i = 0; i < PROCESS_LARGE_GROUP_MAX; i++) {
        (void)json_array_append_new(json_object_get(inputs, "surfaces"),
                                    json_string(fixture->surface));
    }
    outcome = canonical_outcome(*state, "pca", inputs);
    assert_true(has_error(&outcome, "/inputs"));
    detail = json_string_value(json_object_get(json_array_get(outcome.errors, 0), "detail"));
    assert_non_null(strstr(detail, "10000 surfaces of degree 127"));
    assert_non_null(strstr(detail, "a job may have 2048 MiB"));
    outcome_clear(&outcome);
    (void)json_object_set_new(inputs, "lmax", json_integer(6));
    (void)json_object_set_new(inputs, "register", json_false());
    outcome = canonical_outcome(*state, "mean", inputs);
    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
    json_decref(inputs);
}

/* A matrix of distances is made of fewer than a mean is, and a mean of no more than this. */
static void test_sizes(void **state)
{
    struct outcome outcome;
    json_t *inputs = json_pack("{s:[]}", "surfaces");
    const struct fixture *fixture = *state;

    for (int i = 0; i <= PROCESS_MATRIX_MAX; i++) {
        (void)json_array_append_new(json_object_get(inputs, "surfaces"),
                                    json_string(fixture->surface));
    }
    outcome = canonical_outcome(*state, "distances", inputs);
    assert_true(has_error(&outcome, "/inputs/surfaces"));
    outcome_clear(&outcome);
    for (int i = PROCESS_MATRIX_MAX; i < PROCESS_LARGE_GROUP_MAX; i++) {
        (void)json_array_append_new(json_object_get(inputs, "surfaces"),
                                    json_string(fixture->surface));
    }
    outcome = canonical_outcome(*state, "mean", inputs);
    assert_true(has_error(&outcome, "/inputs/surfaces"));
    outcome_clear(&outcome);
    json_decref(inputs);
}

static void test_model(void **state)
{
    same(*state, "modes", "{\"model\":\"%\"}",
         "{\"model\":\"%\",\"mode\":1,\"coefficients\":[-2,-1,-0.0,1,2.0]}");
    same(*state, "sample", "{\"model\":\"%\"}",
         "{\"model\":\"%\",\"components\":3,\"seed\":0,\"count\":1}");
    refused(*state, "modes", "{\"model\":\"%\",\"mode\":4}", "/inputs/mode");
    refused(*state, "modes", "{\"model\":\"%\",\"mode\":0}", "/inputs/mode");
    refused(*state, "modes", "{\"model\":\"%\",\"coefficients\":[]}", "/inputs/coefficients");
    refused(*state, "modes", "{\"model\":\"%\",\"coefficients\":[0,11]}", "/inputs/coefficients");
    refused(*state, "modes", "{\"model\":\"%\",\"coefficients\":[0,\"1\"]}",
            "/inputs/coefficients");
    refused(*state, "sample", "{\"model\":\"%\",\"components\":4}", "/inputs/components");
    refused(*state, "sample", "{\"model\":\"@\"}", "/inputs/model");
    answered(*state, "project",
             "{\"model\":\"model-00000000000000000000000000000000\",\"surface\":\"@\"}", 404,
             "no-such-model");
}

/* A model of a large group is used like any other, and not evaluated. */
static void test_large_model(void **state)
{
    struct outcome outcome;
    char id[STORE_ID_MAX];
    json_t *inputs;

    put_model(*state, "{}", PROCESS_GROUP_MAX, id);
    inputs = json_pack("{s:s}", "model", id);
    outcome = canonical_outcome(*state, "modes", inputs);
    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
    outcome = canonical_outcome(*state, "evaluate-model", inputs);
    assert_true(has_error(&outcome, "/inputs/model"));
    outcome_clear(&outcome);
    json_decref(inputs);
}

#define STUDY "{\"cohort\":\"patients\""

static void test_classify(void **state)
{
    same(*state, "classify", STUDY "}",
         STUDY ",\"method\":\"srnf-gauss\",\"components\":\"auto\",\"scale\":\"shape\",\"seed\":0,"
               "\"sizeWeight\":1,\"refit\":\"fold\",\"lmax\":9,\"validation\":\"loo\"}");
    same(*state, "classify", STUDY ",\"components\":2.0}", STUDY ",\"components\":2}");
    refused(*state, "classify", "{}", "/inputs/cohort");
    refused(*state, "classify", STUDY ",\"surfaces\":[\"@\",\"@\"]}", "/inputs/surfaces");
    refused(*state, "classify", STUDY ",\"method\":\"nn\"}", "/inputs/method");
    refused(*state, "classify", STUDY ",\"method\":[]}", "/inputs/method");
    refused(*state, "classify", STUDY ",\"method\":[7]}", "/inputs/method");
    refused(*state, "classify", STUDY ",\"method\":[\"srm-nn\",\"srm-nn\"]}", "/inputs/method");
    refused(*state, "classify", STUDY ",\"components\":0}", "/inputs/components");
    refused(*state, "classify", STUDY ",\"components\":1.5}", "/inputs/components");
    refused(*state, "classify", STUDY ",\"components\":\"all\"}", "/inputs/components");
    answered(*state, "classify", "{\"cohort\":\"another\"}", 404, "no-such-cohort");
    /* "group" has a member without a label. */
    refused(*state, "classify", "{\"cohort\":\"group\"}", "/inputs/cohort");
}

/* Six members of two classes leave three degrees of freedom to a fold, and one to a class. */
static void test_classify_freedom(void **state)
{
    same(*state, "classify", STUDY ",\"components\":3,\"scale\":\"shape\"}",
         STUDY ",\"components\":3}");
    refused(*state, "classify", STUDY ",\"components\":4}", "/inputs/components");
    refused(*state, "classify", STUDY ",\"components\":3,\"scale\":\"shape-and-size\"}",
            "/inputs/components");
    same(*state, "classify", STUDY ",\"components\":1,\"covariance\":\"class\"}",
         STUDY ",\"covariance\":\"class\",\"components\":1}");
    refused(*state, "classify", STUDY ",\"components\":2,\"covariance\":\"class\"}",
            "/inputs/components");
    refused(*state, "classify", STUDY ",\"covariance\":\"class\",\"scale\":\"shape-and-size\"}",
            "/inputs/covariance");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_register),
        cmocka_unit_test(test_cohort),
        cmocka_unit_test(test_surfaces),
        cmocka_unit_test(test_mixed_routes),
        cmocka_unit_test(test_bridges_take_time),
        cmocka_unit_test(test_degree),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_large_model),
        cmocka_unit_test(test_pullback),
        cmocka_unit_test(test_model),
        cmocka_unit_test(test_classify),
        cmocka_unit_test(test_classify_freedom),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
