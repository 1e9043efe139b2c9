/*
 * test_requests.c - what the api layer makes of a request before any handler: routes, methods,
 * queries, media types, preferences, and the texts it decodes. No store and no jobs are there:
 * nothing of this may need them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "api/prefer.h"
#include "api/lists.h"
#include "api/respond.h"
#include "api/routes.h"
#include "compute/compute.h"
#include "processes/processes.h"

#include <stdio.h>
#include <string.h>

#define LIMIT ((size_t)1000)

static struct api *api;

static int set_up(void **state)
{
    const struct api_config config = {.processes = &processes, .max_body = LIMIT};

    (void)state;
    return api_create(&api, &config);
}

static int tear_down(void **state)
{
    (void)state;
    api_destroy(api);
    return 0;
}

/* The status that a request is refused with, or 0. */
static int begin(const char *method, const char *path, const char *query, const char *header,
                 const char *value, int64_t length, struct api_response *response)
{
    const struct api_header headers[] = {{header, value}};
    struct api_request request = {.method = method,
                                  .path = path,
                                  .query = query,
                                  .headers = headers,
                                  .n_headers = header ? 1 : 0,
                                  .id = "test"};
    size_t max_body;

    memset(response, 0, sizeof *response);
    return api_begin(api, &request, length, &max_body, response) == API_REFUSED ? response->status
                                                                                : 0;
}

static const char *header_of(const struct api_response *response, const char *name)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        if (strcmp(response->headers[i].name, name) == 0) {
            return response->headers[i].value;
        }
    }
    return "";
}

/* What is refused by its head alone: 0 where nothing is. */
static const struct {
    const char *method, *path, *query, *header, *value;
    int64_t length;
    int status;
} heads[] = {
    {"GET", "/v1/meshes", "", NULL, NULL, 0, 0},
    {"HEAD", "/v1/meshes", "", NULL, NULL, 0, 0},
    {"GET", "/v1/meshes/", "", NULL, NULL, 0, 404},
    {"GET", "/v1//meshes", "", NULL, NULL, 0, 404},
    {"GET", "/V1/meshes", "", NULL, NULL, 0, 404},
    {"GET", "", "", NULL, NULL, 0, 404},
    {"GET", "/v1/meshes/mesh-1/content/x", "", NULL, NULL, 0, 404},
    {"PUT", "/v1/meshes", "", NULL, NULL, 0, 405},
    {"get", "/v1/meshes", "", NULL, NULL, 0, 405},
    {"POST", "/v1/meshes/mesh-1", "", NULL, NULL, 0, 405},
    {"OPTIONS", "/v1/meshes", "", NULL, NULL, 0, 204},
    {"OPTIONS", "/v1/nothing", "", NULL, NULL, 0, 404},
    {"GET", "/v1/meshes", "limit=3", NULL, NULL, 0, 0},
    {"GET", "/v1/meshes", "limit=3&cursor=", NULL, NULL, 0, 0},
    {"GET", "/v1/meshes", "limt=3", NULL, NULL, 0, 400},
    {"GET", "/v1/meshes", "limit=3&limit=4", NULL, NULL, 0, 400},
    {"GET", "/v1/meshes", "=3", NULL, NULL, 0, 400},
    {"GET", "/v1/meshes", "li%6dit=3", NULL, NULL, 0, 400},
    {"GET", "/v1/meshes", "limit,cursor", NULL, NULL, 0, 400},
    {"GET", "/v1/meshes", "", "Accept", "text/html", 0, 406},
    {"GET", "/v1/meshes", "", "Accept", "text/html, */*;q=0.1", 0, 0},
    {"GET", "/v1/meshes/mesh-1/content", "", "Accept", "text/html", 0, 0},
    {"POST", "/v1/meshes", "", NULL, NULL, 1000, 0},
    {"POST", "/v1/meshes", "", NULL, NULL, 1001, 413},
    {"POST", "/v1/meshes", "", NULL, NULL, -1, 0},
    {"POST", "/v1/meshes", "", "Content-Type", "model/stl", 10, 0},
    {"POST", "/v1/meshes", "", "Content-Type", "APPLICATION/octet-stream; a=b", 10, 0},
    {"POST", "/v1/meshes", "", "Content-Type", "image/png", 10, 415},
    {"POST", "/v1/meshes", "", "Content-Type", "model/", 10, 415},
    {"POST", "/v1/meshes", "", "Content-Encoding", "gzip", 10, 415},
    {"POST", "/v1/meshes", "", "Content-Encoding", "identity", 10, 0},
    {"POST", "/v1/surfaces", "", "Content-Type", "application/x-npy", 10, 0},
    {"POST", "/v1/surfaces", "", "Content-Type", "text/csv", 10, 415},
    {"POST", "/v1/processes/encode/execution", "", "Content-Type",
     "application/json; charset=utf-8", 10, 0},
    {"POST", "/v1/processes/encode/execution", "", "Content-Type", "application/jsonl", 10, 415},
    {"POST", "/v1/processes/encode/execution", "async=1", NULL, NULL, 10, 400},
    {"GET", "/healthz", "", NULL, NULL, 1 << 20, 413},
};

static void test_requests_are_refused_by_their_heads(void **state)
{
    struct api_response response;

    (void)state;
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        int status = begin(heads[i].method, heads[i].path, heads[i].query, heads[i].header,
                           heads[i].value, heads[i].length, &response);

        if (status != heads[i].status) {
            print_message("case %zu: %s %s?%s answered %d\n", i, heads[i].method, heads[i].path,
                          heads[i].query, status);
        }
        assert_int_equal(status, heads[i].status);
        if (status >= 400) {
            assert_string_equal(header_of(&response, "Content-Type"), "application/problem+json");
        }
        if (status == 405 || status == 204) {
            assert_non_null(strstr(header_of(&response, "Allow"), "OPTIONS"));
        }
        api_response_clear(&response);
    }
}

static void test_every_route_is_found_by_its_own_pattern(void **state)
{
    (void)state;
    for (const struct api_route *route = api_routes; route->method; route++) {
        struct route_match match;
        char path[128] = "", allow[96];
        size_t n = 0;

        for (const char *p = route->pattern; *p && n < sizeof path - 8; p++) {
            if (*p == '{') {
                n += (size_t)snprintf(path + n, sizeof path - n, "a.b-c");
                p += strcspn(p, "}");
            } else {
                path[n++] = *p;
                path[n] = '\0';
            }
        }
        route_find(route->method, path, &match, allow, sizeof allow);
        assert_ptr_equal(match.route, route);
        if (strchr(route->pattern, '{')) {
            assert_string_equal(match.parameters[0], "a.b-c");
        }
        route_find("BREW", path, &match, allow, sizeof allow);
        assert_null(match.route);
        assert_non_null(strstr(allow, route->method));
        assert_non_null(strstr(allow, "OPTIONS"));
    }
}

static void test_slashes_at_the_end(void **state)
{
    struct route_match match;
    char allow[96];

    (void)state;
    route_find("GET", "/v1/", &match, allow, sizeof allow);
    assert_non_null(match.route);
    assert_string_equal(match.route->pattern, "/v1");
    route_find("GET", "/ui/", &match, allow, sizeof allow);
    assert_non_null(match.route);
    assert_string_equal(match.route->pattern, "/ui/");
    route_find("GET", "", &match, allow, sizeof allow);
    assert_null(match.route);
}

static int best(const char *accept, const char *const *types)
{
    const struct api_header headers[] = {{"accept", accept}};
    const struct api_request request = {.headers = headers, .n_headers = accept ? 1 : 0};

    return accept_best(&request, types);
}

static void test_accept_chooses_by_quality_and_closeness(void **state)
{
    static const char *const types[] = {"application/json", "application/x-npy", NULL};

    (void)state;
    assert_int_equal(best(NULL, types), 0);
    assert_int_equal(best("", types), 0);
    assert_int_equal(best("*/*", types), 0);
    assert_int_equal(best("application/*", types), 0);
    assert_int_equal(best("application/x-npy", types), 1);
    assert_int_equal(best("APPLICATION/X-NPY", types), 1);
    assert_int_equal(best("application/json;q=0.5, application/x-npy;q=0.51", types), 1);
    assert_int_equal(best("application/json;q=0.5, application/x-npy;q=0.499", types), 0);
    assert_int_equal(best("application/x-npy, */*;q=0.9", types), 1);
    assert_int_equal(best("application/json;q=0, */*", types), 1);
    assert_int_equal(best("*/*, application/json ; q=0", types), 1);
    assert_int_equal(best("application/json;q=0", types), -1);
    assert_int_equal(best("text/html, image/*", types), -1);
    assert_int_equal(best("application", types), -1);
    assert_int_equal(best(";;;,,,;q=1", types), -1);
}

static void test_escapes_are_decoded_or_refused(void **state)
{
    static const struct {
        const char *text, *decoded; /* NULL: refused */
    } cases[] = {
        {"a%20b", "a b"},   {"a+b", "a b"}, {"%2f%2F", "//"},
        {"", ""},           {"%", NULL},    {"%4", NULL},
        {"%4g", NULL},      {"%00", NULL},  {"0123456", "0123456"},
        {"01234567", NULL},
    };
    char buffer[8];

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        bool done = percent_decode(cases[i].text, strlen(cases[i].text), true, buffer, 8);

        assert_int_equal(done, cases[i].decoded != NULL);
        if (done) {
            assert_string_equal(buffer, cases[i].decoded);
        }
    }
    assert_false(percent_decode("", 0, true, buffer, 0));
}

static void test_queries_are_walked(void **state)
{
    const char *cursor = "&&a=1&b&=x&c==&";
    static const char *const pairs[] = {"a|1", "b|", "|x", "c|="};
    struct query_pair pair;
    char text[16];
    size_t n = 0;

    (void)state;
    while (query_next(&cursor, &pair)) {
        (void)snprintf(text, sizeof text, "%.*s|%.*s", (int)pair.name_length, pair.name,
                       (int)pair.value_length, pair.value);
        assert_true(n < 4);
        assert_string_equal(text, pairs[n++]);
    }
    assert_int_equal(n, 4);
}

static void check_prefer(const char *first, const char *second, bool async, double wait)
{
    const struct api_header headers[] = {{"Prefer", first}, {"prefer", second}};
    const struct api_request request = {.headers = headers, .n_headers = second ? 2 : 1};
    struct prefer prefer;

    prefer_read(&request, &prefer);
    assert_int_equal(prefer.respond_async, async);
    assert_int_equal(prefer.has_wait, wait >= 0);
    if (wait >= 0) {
        assert_true(prefer.wait == wait);
    }
}

static void test_preferences_are_read(void **state)
{
    (void)state;
    check_prefer("respond-async", NULL, true, -1);
    check_prefer("Respond-Async, WAIT=5", NULL, true, 5);
    check_prefer("respond-async", "wait=7", true, 7);
    check_prefer("wait=3, wait=9", NULL, false, 3);
    check_prefer("wait = \"4\"; x=y", NULL, false, 4);
    check_prefer("wait=0", NULL, false, 0);
    check_prefer("wait=-1", NULL, false, -1);
    check_prefer("wait", NULL, false, -1);
    check_prefer("wait=99999999999999999999", NULL, false, -1);
    check_prefer("waiting=3, respond-asynchronously", NULL, false, -1);
    check_prefer(",,;, ", NULL, false, -1);
}

static void test_every_error_of_the_core_has_a_known_code(void **state)
{
    (void)state;
    for (int status = -40; status <= 10; status++) {
        const char *code = compute_problem_code(status);

        assert_true(problem_known(code));
        if (status >= SRNF_ENOT_STAR && status <= SRNF_ENOT_CLOSED) {
            assert_int_equal(problem_status(code), 422);
        }
    }
    assert_false(problem_known("no-such-code"));
    assert_false(problem_known(NULL));
    assert_int_equal(problem_status("no-such-code"), 500);
}

static const struct api_route *route_of_meshes(void)
{
    const struct api_route *route = api_routes;

    while (strcmp(route->method, "GET") != 0 || strcmp(route->pattern, "/v1/meshes") != 0) {
        route++;
        assert_non_null(route->method);
    }
    return route;
}

/* Lists: what a first page says is next must be what the second page starts after, and nothing
   else. */
static void test_cursors_come_back_or_are_refused(void **state)
{
    union {
        const struct api_route *known;
        void *pointer;
    } route = {.known = route_of_meshes()}; /* as api_begin does */
    struct api_request request = {
        .method = "GET", .path = "/v1/meshes", .query = "limit=2", .route = route.pointer};
    struct api_response response = {0};
    struct api_call call = {.api = api, .request = &request, .response = &response};
    struct list list;
    char query[500];
    json_t *document;
    const char *next;

    (void)state;
    assert_true(list_open(&call, "meshes", &list));
    assert_int_equal(list.page.limit, 3);
    assert_true(list_add(&list, json_string("a"), 30, "mesh-c"));
    assert_true(list_add(&list, json_string("b"), 20, "mesh-b"));
    assert_false(list_add(&list, json_string("c"), 10, "mesh-a"));
    list_respond(&call, &list, "/v1/meshes", 0);
    document = json_loadb((char *)response.body, response.body_size, 0, NULL);
    next = json_string_value(json_object_get(document, "next"));
    assert_non_null(next);
    assert_non_null(strstr(header_of(&response, "Link"), next));
    (void)snprintf(query, sizeof query, "cursor=%s", next);
    request.query = query;
    api_response_clear(&response);
    assert_true(list_open(&call, "meshes", &list));
    assert_int_equal(list.page.after_ms, 20);
    assert_string_equal(list.page.after_id, "mesh-b");
    json_decref(list.items);
    assert_false(list_open(&call, "jobs", &list));
    assert_int_equal(response.status, 422);
    for (size_t i = strlen("cursor="); query[i]; i++) {
        char old = query[i];

        query[i] = old == '0' ? '1' : '0';
        api_response_clear(&response);
        assert_false(list_open(&call, "meshes", &list));
        query[i] = old;
    }
    json_decref(document);
    api_response_clear(&response);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_requests_are_refused_by_their_heads),
        cmocka_unit_test(test_every_route_is_found_by_its_own_pattern),
        cmocka_unit_test(test_slashes_at_the_end),
        cmocka_unit_test(test_accept_chooses_by_quality_and_closeness),
        cmocka_unit_test(test_escapes_are_decoded_or_refused),
        cmocka_unit_test(test_queries_are_walked),
        cmocka_unit_test(test_preferences_are_read),
        cmocka_unit_test(test_every_error_of_the_core_has_a_known_code),
        cmocka_unit_test(test_cursors_come_back_or_are_refused),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
