/*
 * test_framing.c - how results are framed: what a body and a query ask for, its text that is kept
 * with a job, members found in the text of results, and the answers. And inputs by value and by
 * links (references.c), as far as no store is needed.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "api/framing.h"
#include "api/references.h"
#include "processes/processes.h"

#include <stdlib.h>
#include <string.h>

#define JOB "job-0"

static struct api *api;
static struct api_request request;
static struct api_response response;
static struct api_call call;

static int set_up(void **state)
{
    const struct api_config config = {.processes = &processes};

    (void)state;
    return api_create(&api, &config);
}

static int tear_down(void **state)
{
    (void)state;
    api_destroy(api);
    return 0;
}

static void begin(const char *query)
{
    static const struct api_header headers[] = {{"Host", "shapes.example:8080"}};

    request = (struct api_request){
        .method = "POST", .path = "/", .query = query, .headers = headers, .n_headers = 1};
    memset(&response, 0, sizeof response);
    call = (struct api_call){.api = api, .request = &request, .response = &response};
}

static const struct api_process *encode(void)
{
    const struct api_process *process = api_process_find(api, "encode");

    assert_non_null(process);
    return process;
}

/* The framing of a body; how many things are wrong with it. */
static size_t read_body(const char *text, struct framing *framing)
{
    struct problem_list problems = {.errors = NULL};
    json_t *body = json_loads(text, 0, NULL);

    assert_non_null(body);
    begin("");
    framing_read(&call, encode(), body, framing, &problems);
    json_decref(body);
    json_decref(problems.errors);
    return problems.count;
}

static void test_bodies_are_read(void **state)
{
    struct framing framing;

    (void)state;
    assert_int_equal(read_body("{}", &framing), 0);
    assert_true(framing_is_plain(&framing));
    assert_int_equal(read_body("{\"response\":\"raw\",\"outputs\":{\"fit\":{},\"surface\":"
                               "{\"transmissionMode\":\"reference\"}}}",
                               &framing),
                     0);
    assert_int_equal(framing.response, FRAMING_RAW);
    assert_int_equal(framing.n, 2);
    assert_string_equal(framing.outputs[1].name, "surface");
    assert_true(framing.outputs[1].reference && !framing.outputs[0].reference);
    assert_int_equal(read_body("{\"response\":\"cooked\"}", &framing), 1);
    assert_int_equal(read_body("{\"outputs\":[]}", &framing), 1);
    assert_int_equal(read_body("{\"outputs\":{\"nothing\":{},\"fit\":3}}", &framing), 2);
    assert_int_equal(
        read_body("{\"outputs\":{\"fit\":{\"transmissionMode\":\"pigeon\"}}}", &framing), 1);
    assert_int_equal(
        read_body("{\"outputs\":{\"fit\":{\"format\":{\"mediaType\":\"a/b\"}}}}", &framing), 1);
    assert_int_equal(read_body("{\"subscriber\":{}}", &framing), 1);
}

static void test_texts_come_back(void **state)
{
    char text[STORE_FRAMING_MAX];
    struct framing framing, again;

    (void)state;
    assert_int_equal(read_body("{\"response\":\"document\",\"outputs\":{\"fit\":{},\"surface\":"
                               "{\"transmissionMode\":\"reference\"}}}",
                               &framing),
                     0);
    framing_write(&framing, text);
    assert_string_equal(text, "document fit@surface");
    framing_parse(text, &again);
    assert_int_equal(again.response, FRAMING_DOCUMENT);
    assert_int_equal(again.n, 2);
    assert_string_equal(again.outputs[0].name, "fit");
    assert_true(again.outputs[1].reference);
    framing_parse("", &again);
    assert_true(framing_is_plain(&again));
    framing_parse("some-word-that-is-far-too-long a", &again);
    assert_true(framing_is_plain(&again));
}

static void test_queries_are_read(void **state)
{
    static const struct {
        const char *query;
        size_t n;
        bool good;
    } cases[] = {{"", 0, true},
                 {"response=raw&outputs=fit", 1, true},
                 {"outputs=fit,surface,fit", 2, true},
                 {"response=cooked", 0, false},
                 {"outputs=nothing", 0, false},
                 {"outputs=fit,,surface", 0, false}};

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct framing framing = {.n = 0};

        begin(cases[i].query);
        assert_int_equal(framing_query(&call, encode(), &framing), cases[i].good);
        if (cases[i].good) {
            assert_int_equal(framing.n, cases[i].n);
        } else {
            assert_int_equal(response.status, 422);
        }
        api_response_clear(&response);
    }
}

static void test_members_are_found(void **state)
{
    static const char results[] = "{\"a\":{\"b\":[1,\"}\\\"\",{}]},\"\\\"b\":2,\"b\":\"x,y\"}";
    struct framing_member member;
    size_t size = sizeof results - 1;

    (void)state;
    assert_true(framing_find(results, size, "a", &member));
    assert_int_equal(member.length, strlen("{\"b\":[1,\"}\\\"\",{}]}"));
    assert_true(framing_find(results, size, "b", &member));
    assert_memory_equal(member.value, "\"x,y\"", member.length);
    assert_false(framing_find(results, size, "c", &member));
    assert_false(framing_find("", 0, "a", &member));
    /* What was cut off, in a block of its own so that nothing beyond it is read. */
    for (size_t cut = 0; cut < size; cut++) {
        char *copy = malloc(cut > 0 ? cut : 1);

        assert_non_null(copy);
        memcpy(copy, results, cut);
        (void)framing_find(copy, cut, "zzz", &member);
        free(copy);
    }
}

/* The answer to results that are framed so. */
static const char *answer(const char *text, const char *results)
{
    struct framing framing;
    static char body[1000];

    begin("");
    framing_parse(text, &framing);
    framing_respond(&call, JOB, &framing, strdup(results), strlen(results));
    assert_true(response.body_size < sizeof body);
    memcpy(body, response.body_size > 0 ? (const char *)response.body : "", response.body_size);
    body[response.body_size] = '\0';
    return body;
}

static void test_answers_are_framed(void **state)
{
    static const char results[] = "{\"a\":{\"b\":1},\"c\":[2],\"d\":null}";

    (void)state;
    assert_string_equal(answer("", results), results);
    api_response_clear(&response);
    assert_string_equal(answer("plain c", results), "{\"c\":[2]}\n");
    api_response_clear(&response);
    assert_string_equal(answer("document", results), "{\"a\":{\"value\":{\"b\":1}},\"c\":[2]}\n");
    api_response_clear(&response);
    assert_string_equal(
        answer("document@a c", results),
        "{\"a\":{\"href\":\"/v1/jobs/job-0/results/a\",\"type\":\"application/json\"},"
        "\"c\":[2]}\n");
    api_response_clear(&response);
    assert_string_equal(answer("raw c", results), "[2]\n");
    api_response_clear(&response);
    assert_non_null(strstr(answer("raw a c", results), "Content-ID: <c>\r\n"));
    assert_non_null(strstr((const char *)response.body, "--job-0--\r\n"));
    api_response_clear(&response);
    assert_string_equal(answer("raw@a", results), "");
    assert_int_equal(response.status, 204);
    api_response_clear(&response);
}

/* ---- Inputs by value and by links ------------------------------------------------------------ */

/* The inputs as they are meant (NULL: not), and how many things are wrong. */
static char *resolve(const char *text, size_t *wrong)
{
    struct problem_list problems = {.errors = NULL};
    json_t *inputs = json_loads(text, 0, NULL);
    char *meant = NULL;

    assert_non_null(inputs);
    begin("");
    if (references_resolve(&call, NULL, inputs, &problems)) {
        meant = json_dumps(inputs, JSON_COMPACT | JSON_SORT_KEYS);
    }
    *wrong = problems.count;
    json_decref(inputs);
    json_decref(problems.errors);
    return meant;
}

static void test_references_are_resolved(void **state)
{
    static const struct {
        const char *given, *meant;
    } cases[] = {
        {"{\"a\":{\"value\":3},\"b\":4}", "{\"a\":3,\"b\":4}"},
        {"{\"a\":{\"value\":3,\"mediaType\":\"x\"}}", "{\"a\":3}"},
        {"{\"a\":{\"value\":3,\"other\":1}}", "{\"a\":{\"other\":1,\"value\":3}}"},
        {"{\"a\":{\"href\":\"/v1/meshes/mesh-1\"}}", "{\"a\":\"mesh-1\"}"},
        {"{\"a\":{\"href\":\"/v1/meshes/mesh-1/content\",\"type\":\"x\"}}", "{\"a\":\"mesh-1\"}"},
        {"{\"a\":{\"href\":\"http://Shapes.example:8080/v1/cohorts/c%20d\"}}", "{\"a\":\"c d\"}"},
        {"{\"a\":[{\"href\":\"/v1/surfaces/surf-1\"},{\"value\":2},3]}",
         "{\"a\":[\"surf-1\",2,3]}"},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        size_t wrong;
        char *meant = resolve(cases[i].given, &wrong);

        assert_int_equal(wrong, 0);
        assert_string_equal(meant, cases[i].meant);
        free(meant);
    }
}

static void test_references_to_elsewhere_are_refused(void **state)
{
    static const char *const given[] = {
        "{\"a\":{\"href\":\"http://other.example/v1/meshes/mesh-1\"}}",
        "{\"a\":{\"href\":\"//shapes.example:8080/v1/meshes/mesh-1\"}}",
        "{\"a\":{\"href\":\"http://shapes.example:80801/v1/meshes/mesh-1\"}}",
        "{\"a\":{\"href\":\"x?http://shapes.example:8080/v1/meshes/mesh-1\"}}",
        "{\"a\":{\"href\":\"/v1/meshes\"}}",
        "{\"a\":{\"href\":\"/v1/meshes/%00\"}}",
        "{\"a\":{\"href\":3}}",
        "{\"a\":[{\"href\":\"/v1/nothing/1\"}]}",
    };

    (void)state;
    for (size_t i = 0; i < sizeof given / sizeof given[0]; i++) {
        size_t wrong;

        free(resolve(given[i], &wrong));
        assert_int_equal(wrong, 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_bodies_are_read, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_texts_come_back, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_queries_are_read, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_members_are_found, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_answers_are_framed, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_references_are_resolved, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_references_to_elsewhere_are_refused, set_up,
                                        tear_down),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
