/*
 * test_process_encode.c - canonical inputs of encode: one text for each meaning, another for
 * another meaning, and refusal of meshes before there is a job.
 */
#include "server/toolkit/process_fixture.h"
#include "store/mesh.h"

static void test_one_meaning_one_text(void **state)
{
    const char *least = "{\"mesh\":\"" GOOD_MESH "\"}";

    same(*state, "encode", least,
         "{\"smoothing\":0,\"scale\":\"unit-area\",\"center\":\"auto\",\"mesh\":\"" GOOD_MESH
         "\",\"lmax\":31.0,\"parameterization\":\"auto\",\"sphere\":null}");
    same(*state, "encode", least, "{\"mesh\":\"" GOOD_MESH "\",\"smoothing\":-0.0}");
    same(*state, "encode", "{\"mesh\":\"" GOOD_MESH "\",\"center\":[1,-0.0,2e0]}",
         "{\"mesh\":\"" GOOD_MESH "\",\"center\":[1.0,0,2]}");
}

/* Each option changes the text: no two meanings share a cache key. */
static void test_other_meaning_other_text(void **state)
{
    static const char *const options[] = {
        "",
        ",\"lmax\":30",
        ",\"parameterization\":\"star\"",
        ",\"parameterization\":\"area\"",
        ",\"parameterization\":\"given\",\"sphere\":\"" GOOD_MESH "\"",
        ",\"parameterization\":\"given\",\"sphere\":\"" STARLESS_MESH "\"",
        ",\"center\":[0,0,0]",
        ",\"center\":[0,0,1e-300]",
        ",\"scale\":\"none\"",
        ",\"smoothing\":1e-17",
    };
    char *texts[sizeof options / sizeof options[0]];

    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        char inputs[240];
        struct outcome outcome;

        (void)snprintf(inputs, sizeof inputs, "{\"mesh\":\"%s\"%s}", GOOD_MESH, options[i]);
        outcome = canonicalize_text(*state, "encode", inputs);
        assert_non_null(outcome.canonical);
        texts[i] =
            json_dumps(outcome.canonical, JSON_SORT_KEYS | JSON_COMPACT | JSON_REAL_PRECISION(17));
        for (size_t j = 0; j < i; j++) {
            assert_string_not_equal(texts[i], texts[j]);
        }
        outcome_clear(&outcome);
    }
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        free(texts[i]);
    }
}

static void test_meshes(void **state)
{
    answered(*state, "encode", "{\"mesh\":\"" ABSENT_MESH "\"}", 404, "no-such-mesh");
    answered(*state, "encode", "{\"mesh\":\"" OPEN_MESH "\"}", 422, "mesh-not-closed");
    refused(*state, "encode", "{\"mesh\":\"@\"}", "/inputs/mesh");
    refused(*state, "encode", "{\"mesh\":\"mesh-0\"}", "/inputs/mesh");
    refused(*state, "encode", "{\"mesh\":\"mesh-0000000000000000000000000000000G\"}",
            "/inputs/mesh");
    refused(*state, "encode", "{\"mesh\":7}", "/inputs/mesh");
}

static void test_centers(void **state)
{
    static const char *const wrong[] = {
        "\"middle\"",    "[0,0]", "[0,0,0,0]", "[0,0,\"x\"]",
        "[[0],[0],[0]]", "{}",    "true",      "[2e9,0,0]",
    };

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char inputs[200];

        (void)snprintf(inputs, sizeof inputs, "{\"mesh\":\"%s\",\"center\":%s}", GOOD_MESH,
                       wrong[i]);
        refused(*state, "encode", inputs, "/inputs/center");
    }
}

/* Options that need one another, and options that exclude one another. */
static void test_routes(void **state)
{
    static const struct {
        const char *options, *pointer;
    } wrong[] = {
        {"\"parameterization\":\"polar\"", "/inputs/parameterization"},
        {"\"parameterization\":\"given\"", "/inputs/sphere"},
        {"\"parameterization\":\"given\",\"sphere\":\"mesh-7\"", "/inputs/sphere"},
        {"\"sphere\":\"" GOOD_MESH "\"", "/inputs/sphere"},
        {"\"parameterization\":\"area\",\"sphere\":\"" GOOD_MESH "\"", "/inputs/sphere"},
        {"\"parameterization\":\"area\",\"center\":[0,0,0]", "/inputs/center"},
        {"\"parameterization\":\"given\",\"center\":[0,0,0]", "/inputs/center"},
    };

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char inputs[240];

        (void)snprintf(inputs, sizeof inputs, "{\"mesh\":\"%s\",%s}", GOOD_MESH, wrong[i].options);
        refused(*state, "encode", inputs, wrong[i].pointer);
    }
    answered(*state, "encode",
             "{\"mesh\":\"" GOOD_MESH "\",\"parameterization\":\"given\",\"sphere\":\"" ABSENT_MESH
             "\"}",
             404, "no-such-mesh");
    answered(*state, "encode",
             "{\"mesh\":\"" GOOD_MESH "\",\"parameterization\":\"given\",\"sphere\":\"" OPEN_MESH
             "\"}",
             422, "mesh-not-closed");
}

/* Its report was stored when only star-shaped meshes could be analysed. */
static void test_old_reports(void **state)
{
    struct outcome outcome =
        canonicalize_text(*state, "encode", "{\"mesh\":\"" STARLESS_MESH "\"}");

    assert_non_null(outcome.canonical);
    outcome_clear(&outcome);
}

/* A report says what encode does by default now, not what it did when the report was stored. */
static void test_routes_of_old_reports(void **state)
{
    static const struct {
        const char *report, *route;
    } cases[] = {
        {"{\"analysable\":true,\"route\":\"star\",\"problems\":[]}", "area"},
        {"{\"analysable\":true,\"route\":\"area\",\"problems\":[]}", "area"},
        {"{\"analysable\":false,\"route\":null,\"problems\":[{\"code\":\"not-star-shaped\"}]}",
         "area"},
        {"{\"analysable\":false,\"route\":null,\"problems\":[{\"code\":\"mesh-not-closed\"}]}",
         NULL},
    };
    (void)state;

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[120];
        struct store_mesh mesh = {.report = text};
        const char *route;
        json_t *report;

        (void)snprintf(text, sizeof text, "%s", cases[i].report);
        report = mesh_report_load(&mesh);
        assert_non_null(report);
        route = json_string_value(json_object_get(report, "route"));
        if (cases[i].route) {
            assert_non_null(route);
            assert_string_equal(route, cases[i].route);
        } else {
            assert_true(json_is_null(json_object_get(report, "route")));
        }
        json_decref(report);
    }
}

/* The first face is said once: in the sentence, or where that of an old report lacks it, behind. */
static void test_first_of_problem(void **state)
{
    static const struct {
        const char *sentence, *detail;
    } cases[] = {
        {"3 edges; the first belongs to face 2, between",
         "3 edges; the first belongs to face 2, between"},
        {"2 join; the first is vertex 2", "2 join; the first is vertex 2"},
        {"2 edges; of face 21, not of face 20",
         "2 edges; of face 21, not of face 20 (the first at 2)"},
        {"3 boundary edges", "3 boundary edges (the first at 2)"},
    };
    (void)state;

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[200], code[48], detail[320];
        struct store_mesh mesh = {.report = text};

        (void)snprintf(text, sizeof text,
                       "{\"analysable\":false,\"problems\":[{\"code\":\"mesh-not-closed\","
                       "\"first\":2,\"detail\":\"%s\"}]}",
                       cases[i].sentence);
        assert_true(mesh_first_problem(&mesh, code, detail));
        assert_string_equal(code, "mesh-not-closed");
        assert_string_equal(detail, cases[i].detail);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_meaning_one_text),
        cmocka_unit_test(test_other_meaning_other_text),
        cmocka_unit_test(test_meshes),
        cmocka_unit_test(test_centers),
        cmocka_unit_test(test_routes),
        cmocka_unit_test(test_routes_of_old_reports),
        cmocka_unit_test(test_old_reports),
        cmocka_unit_test(test_first_of_problem),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fixture_open, fixture_close);
}
