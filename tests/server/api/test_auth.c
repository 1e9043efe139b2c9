/*
 * Who may call, as api_begin decides it: without tokens, with them, and with a file of tokens that
 * changes, breaks or goes away under a running service. No store and no jobs are there.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../store/fixture.h"
#include "api/respond.h"
#include "api/routes.h"
#include "processes/processes.h"
#include "store/store.h"
#include "store/token.h"

#define RATE 5

struct door {
    struct fixture *fixture;
    struct api *api;
};

static int setup(void **state)
{
    struct door *door = calloc(1, sizeof *door);
    void *fixture;

    fixture_setup_closed(&fixture);
    door->fixture = fixture;
    *state = door;
    return 0;
}

static int teardown(void **state)
{
    struct door *door = *state;
    void *fixture = door->fixture;

    api_destroy(door->api);
    fixture_teardown(&fixture);
    free(door);
    return 0;
}

static void open_api(struct door *door)
{
    const struct api_config config = {
        .processes = &processes, .tokens = door->fixture->path, .max_body = 5000};

    assert_int_equal(api_create(&door->api, &config), 0);
}

static void add(struct door *door, const char *name, enum store_role role, int64_t expires_ms,
                int64_t requests, char secret[STORE_SECRET_MAX])
{
    struct store_token token = {.role = role, .expires_ms = expires_ms};

    snprintf(token.name, sizeof token.name, "%s", name);
    token.quotas[STORE_QUOTA_REQUESTS] = requests;
    token.quotas[STORE_QUOTA_BYTES] = 1000;
    secret[0] = '\0'; /* a new one */
    assert_int_equal(store_token_add(door->fixture->path, &token, secret), STORE_OK);
}

/* The status that the request is refused with, or 0; what the response says goes to out. */
struct answer {
    int status;
    char challenge[120], code[64], retry[16];
    struct api_caller caller;
};

static const char *header_of(const struct api_response *response, const char *name)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        if (strcmp(response->headers[i].name, name) == 0) {
            return response->headers[i].value;
        }
    }
    return "";
}

static struct answer ask(struct door *door, const char *method, const char *path,
                         const char *authorization, int64_t length)
{
    const struct api_header headers[] = {{"Authorization", authorization}};
    struct api_request request = {.method = method,
                                  .path = path,
                                  .query = "",
                                  .headers = headers,
                                  .n_headers = authorization ? 1 : 0,
                                  .id = "test"};
    struct api_response response = {0};
    struct answer answer = {0};
    size_t max_body;
    json_t *body;

    if (api_begin(door->api, &request, length, &max_body, &response) == API_REFUSED) {
        answer.status = response.status;
        body = json_loadb((const char *)response.body, response.body_size, 0, NULL);
        snprintf(answer.code, sizeof answer.code, "%s",
                 body ? json_string_value(json_object_get(body, "code")) : "");
        json_decref(body);
    }
    snprintf(answer.challenge, sizeof answer.challenge, "%s",
             header_of(&response, "WWW-Authenticate"));
    snprintf(answer.retry, sizeof answer.retry, "%s", header_of(&response, "Retry-After"));
    answer.caller = request.caller;
    api_response_clear(&response);
    return answer;
}

static struct answer ask_with(struct door *door, const char *method, const char *path,
                              const char *secret)
{
    char authorization[100];

    snprintf(authorization, sizeof authorization, "Bearer %s", secret);
    return ask(door, method, path, authorization, 0);
}

static void without_a_file_everyone_is_let_in(void **state)
{
    struct door *door = *state;
    struct answer answer;

    open_api(door);
    answer = ask(door, "GET", "/v1/meshes", NULL, 0);
    assert_int_equal(answer.status, 0);
    assert_false(answer.caller.restricted);
    assert_string_equal(answer.caller.name, "");
    assert_int_equal(ask(door, "POST", "/v1/meshes", "Bearer whatever", 10).status, 0);
}

static void every_route_but_the_public_ones_asks_for_a_token(void **state)
{
    static const char *const open_routes[] = {"/",
                                              "/ui",
                                              "/ui/",
                                              "/ui/{file}",
                                              "/ui/example/{file}",
                                              "/healthz",
                                              "/readyz",
                                              "/v1/version",
                                              "/v1",
                                              "/v1/conformance",
                                              "/v1/openapi.yaml",
                                              "/v1/openapi.json",
                                              "/v1/docs"};
    struct door *door = *state;
    char secret[STORE_SECRET_MAX];
    size_t n_open = 0;

    add(door, "ada", STORE_ROLE_USER, 0, 0, secret);
    open_api(door);
    for (const struct api_route *route = api_routes; route->method; route++) {
        char path[128] = "";
        struct answer answer;
        size_t n = 0;

        for (const char *p = route->pattern; *p; p++) {
            path[n++] = *p == '{' ? 'x' : *p;
            p += *p == '{' ? strcspn(p, "}") : 0;
        }
        answer = ask(door, route->method, path, NULL, 0);
        if (answer.status == 401) {
            assert_string_equal(answer.code, "token-required");
            assert_string_equal(answer.challenge, "Bearer realm=\"srnfd\"");
            continue;
        }
        assert_int_equal(answer.status, 0);
        assert_true(n_open < sizeof open_routes / sizeof open_routes[0]);
        assert_string_equal(route->pattern, open_routes[n_open++]);
    }
    assert_int_equal(n_open, sizeof open_routes / sizeof open_routes[0]);
    /* Where nothing is, nothing is to be guarded; and a preflight has no token. */
    assert_int_equal(ask(door, "GET", "/nothing", NULL, 0).status, 404);
    assert_int_equal(ask(door, "OPTIONS", "/v1/meshes", NULL, 0).status, 204);
}

static void only_the_token_itself_opens(void **state)
{
    struct door *door = *state;
    char secret[STORE_SECRET_MAX], value[700];
    struct answer answer;

    add(door, "ada", STORE_ROLE_USER, 0, 0, secret);
    open_api(door);
    answer = ask_with(door, "POST", "/v1/cohorts/x", "nonsense");
    assert_int_equal(answer.status, 405); /* the method comes first: it is no secret */
    answer = ask_with(door, "DELETE", "/v1/cohorts/x", "nonsense");
    assert_int_equal(answer.status, 401);
    assert_string_equal(answer.code, "token-invalid");
    assert_string_equal(answer.challenge, "Bearer realm=\"srnfd\", error=\"invalid_token\"");
    answer = ask_with(door, "DELETE", "/v1/cohorts/x", secret);
    assert_int_equal(answer.status, 0);
    assert_true(answer.caller.restricted);
    assert_string_equal(answer.caller.name, "ada");
    snprintf(value, sizeof value, "bearer   %s", secret);
    assert_int_equal(ask(door, "GET", "/v1/jobs", value, 0).status, 0);
    static const char *const wrong[] = {"%s",         "Basic %s",   "Bearer",
                                        "Bearer %s ", "Bearer %sx", "Bearer x%s"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *at = strstr(wrong[i], "%s");

        snprintf(value, sizeof value, "%.*s%s%s", at ? (int)(at - wrong[i]) : 99, wrong[i],
                 at ? secret : "", at ? at + 2 : "");
        assert_int_equal(ask(door, "GET", "/v1/jobs", value, 0).status, 401);
    }
    memset(value, 'a', sizeof value - 1);
    value[sizeof value - 1] = '\0';
    memcpy(value, "Bearer ", 7);
    assert_int_equal(ask(door, "GET", "/v1/jobs", value, 0).status, 401);
}

static void roles_do_what_they_may(void **state)
{
    static const struct {
        const char *method, *path;
        int viewer;
    } requests[] = {{"GET", "/v1/jobs", 0},          {"HEAD", "/v1/jobs", 0},
                    {"DELETE", "/v1/jobs/x", 403},   {"POST", "/v1/jobs/x/cancel", 403},
                    {"POST", "/v1/meshes", 403},     {"DELETE", "/v1/cohorts/x", 403},
                    {"GET", "/v1/models/x/modes", 0}};
    struct door *door = *state;
    char viewer[STORE_SECRET_MAX], user[STORE_SECRET_MAX], admin[STORE_SECRET_MAX];
    struct answer answer;

    add(door, "ada", STORE_ROLE_VIEWER, 0, 0, viewer);
    add(door, "ada", STORE_ROLE_USER, 0, 0, user);
    add(door, "root", STORE_ROLE_ADMIN, 0, 0, admin);
    open_api(door);
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        answer = ask_with(door, requests[i].method, requests[i].path, viewer);
        assert_int_equal(answer.status, requests[i].viewer);
        if (answer.status == 403) {
            assert_string_equal(answer.code, "forbidden");
            assert_non_null(strstr(answer.challenge, "insufficient_scope"));
        }
        answer = ask_with(door, requests[i].method, requests[i].path, user);
        assert_int_equal(answer.status, 0);
        assert_true(answer.caller.restricted);
        answer = ask_with(door, requests[i].method, requests[i].path, admin);
        assert_int_equal(answer.status, 0);
        assert_false(answer.caller.restricted);
        assert_string_equal(answer.caller.name, "root");
    }
}

static void metrics_are_for_admins_and_their_own_role(void **state)
{
    struct door *door = *state;
    char user[STORE_SECRET_MAX], admin[STORE_SECRET_MAX], metrics[STORE_SECRET_MAX];

    add(door, "ada", STORE_ROLE_USER, 0, 0, user);
    add(door, "root", STORE_ROLE_ADMIN, 0, 0, admin);
    add(door, "monitor", STORE_ROLE_METRICS, 0, 0, metrics);
    open_api(door);
    assert_int_equal(ask_with(door, "GET", "/metrics", user).status, 403);
    assert_int_equal(ask_with(door, "GET", "/metrics", admin).status, 0);
    assert_int_equal(ask_with(door, "GET", "/metrics", metrics).status, 0);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", metrics).status, 403);
    assert_int_equal(ask_with(door, "POST", "/v1/meshes", metrics).status, 403);
}

static void the_file_is_followed_while_the_service_runs(void **state)
{
    struct door *door = *state;
    char a[STORE_SECRET_MAX], b[STORE_SECRET_MAX], path[300];
    size_t removed;
    FILE *file;

    open_api(door);
    assert_int_equal(ask(door, "GET", "/v1/jobs", NULL, 0).status, 0);
    add(door, "ada", STORE_ROLE_USER, 0, 0, a);
    assert_int_equal(ask(door, "GET", "/v1/jobs", NULL, 0).status, 401);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", a).status, 0);
    add(door, "ben", STORE_ROLE_USER, store_now_ms() + 1500, 0, b);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", b).status, 0);
    usleep(1550000);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", b).status, 401);
    assert_int_equal(store_token_revoke(door->fixture->path, "ada", &removed), STORE_OK);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", a).status, 401);
    assert_int_equal(store_token_revoke(door->fixture->path, "ben", &removed), STORE_OK);
    assert_int_equal(ask(door, "GET", "/v1/jobs", NULL, 0).status, 401); /* none is left */
    add(door, "ada", STORE_ROLE_USER, 0, 0, a);

    /* Damaged, it lets nobody in; nor does it when it is taken away. */
    snprintf(path, sizeof path, "%s/tokens", door->fixture->path);
    file = fopen(path, "a");
    assert_non_null(file);
    (void)fputs("x\n", file);
    fclose(file);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", a).status, 503);
    assert_int_equal(ask(door, "GET", "/healthz", NULL, 0).status, 0);
    assert_int_equal(unlink(path), 0);
    assert_int_not_equal(ask_with(door, "GET", "/v1/jobs", a).status, 0);
    assert_int_equal(ask(door, "GET", "/v1/jobs", NULL, 0).status, 401);
    add(door, "ada", STORE_ROLE_USER, 0, 0, a);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", a).status, 0);
}

static void requests_come_out_of_a_bucket(void **state)
{
    struct door *door = *state;
    char slow[STORE_SECRET_MAX], other[STORE_SECRET_MAX];
    struct answer answer = {0};
    int granted = 0;

    add(door, "ada", STORE_ROLE_USER, 0, RATE, slow);
    add(door, "ada", STORE_ROLE_USER, 0, 0, other);
    open_api(door);
    for (; granted < 100; granted++) {
        answer = ask_with(door, "GET", "/v1/jobs", slow);
        if (answer.status != 0) {
            break;
        }
    }
    /* Two seconds' worth at once, and what came in while they were asked. */
    assert_in_range(granted, 2 * RATE, 3 * RATE);
    assert_int_equal(answer.status, 429);
    assert_string_equal(answer.code, "quota-exceeded");
    assert_string_equal(answer.retry, "1");
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", other).status, 0);
    usleep(1100000 / RATE);
    assert_int_equal(ask_with(door, "GET", "/v1/jobs", slow).status, 0);
}

static void a_body_beyond_the_quota_is_not_read(void **state)
{
    struct door *door = *state;
    char secret[STORE_SECRET_MAX], value[100];

    add(door, "ada", STORE_ROLE_USER, 0, 0, secret);
    open_api(door);
    snprintf(value, sizeof value, "Bearer %s", secret);
    assert_int_equal(ask(door, "POST", "/v1/meshes", value, 1000).status, 0);
    assert_int_equal(ask(door, "POST", "/v1/meshes", value, 1001).status, 413);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
        TEST(without_a_file_everyone_is_let_in),
        TEST(every_route_but_the_public_ones_asks_for_a_token),
        TEST(only_the_token_itself_opens),
        TEST(roles_do_what_they_may),
        TEST(metrics_are_for_admins_and_their_own_role),
        TEST(the_file_is_followed_while_the_service_runs),
        TEST(requests_come_out_of_a_bucket),
        TEST(a_body_beyond_the_quota_is_not_read),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
