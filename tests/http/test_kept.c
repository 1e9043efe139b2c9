/*
 * test_kept.c - a connection that is kept gets the answers that new ones get: whatever was answered
 * on it before, each has its own fields and body, and an id of its own where none was sent.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/wire.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define ROUNDS 3

static struct daemon daemon_;
static struct wire_answer kept, fresh;

static int set_up(void **state)
{
    static const char *const options[] = {
        "--workers",  "1", "--allowed-hosts", "x", "--cors-origins", "https://pages.example",
        "--insecure", NULL};

    (void)state;
    return wire_start(&daemon_, options) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    return wire_stop(&daemon_);
}

/* Takes away the field's value, which differs by time. */
static void take_away(struct wire_answer *of, const char *name)
{
    char *at = strstr(of->text, name), *end = at ? strstr(at + 2, "\r\n") : NULL;

    if (end) {
        memmove(at + strlen(name), end, of->size - (size_t)(end - of->text) + 1);
        of->size -= (size_t)(end - at) - strlen(name);
    }
}

static void take_away_times(struct wire_answer *of)
{
    static const char trace[] = "\r\ntraceparent: 00-0af7651916cd43dd8448eb211c80319c-";
    char *at;

    take_away(of, "\r\nDate:");
    take_away(of, "\r\nServer-Timing:");
    at = strstr(of->text, "\r\ntraceparent:");
    if (at) {
        memset(at + sizeof trace - 1, '*', 16); /* the id of this request within the trace */
    }
}

/* Some of the answers differ in one field or byte alone. id: of the request, with a number behind
   it, so that the answers on two connections name the same. */
static const struct {
    const char *line, *id, *fields;
} requests[] = {
    {"GET /healthz", "one-", ""},
    {"GET /healthz", "two-", ""},
    {"HEAD /healthz", "two-", ""},
    {"GET /healthz", "longer-", ""},
    {"GET /healthz", "one-", "Origin: https://pages.example\r\n"},
    {"GET /healthz", "one-",
     "traceparent: 00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01\r\n"},
    {"GET /healthz", "one-",
     "traceparent: 00-1bf7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01\r\n"},
    {"GET /v1/nothing", "one-", ""},
    {"GET /v1/nowhere", "one-", ""},
    {"GET /v1/jobs/job-a", "one-", ""},
    {"GET /v1/jobs/job-b", "one-", ""},
    {"POST /healthz", "one-", "Content-Length: 0\r\n"},
    {"OPTIONS /healthz", "one-", ""},
    {"GET /v1/processes", "one-", ""},
    {"GET /v1/openapi.yaml", "one-", "Accept-Encoding: gzip\r\n"},
};
#define REQUESTS (sizeof requests / sizeof requests[0])

static void ask_both(int fd, size_t which, int number)
{
    bool head = strncmp(requests[which].line, "HEAD", 4) == 0;
    int other = wire_dial(&daemon_);
    char request[400];

    (void)snprintf(request, sizeof request,
                   "%s HTTP/1.1\r\nHost: x\r\nX-Request-Id: %s%06d\r\n%s\r\n", requests[which].line,
                   requests[which].id, number, requests[which].fields);
    assert_true(other >= 0 && wire_say(fd, request) && wire_say(other, request));
    wire_hear(fd, head, &kept);
    wire_hear(other, head, &fresh);
    (void)close(other);
    assert_true(kept.status > 0);
    assert_false(kept.closed);
    take_away_times(&kept);
    take_away_times(&fresh);
    if (kept.size != fresh.size || memcmp(kept.text, fresh.text, kept.size) != 0) {
        fail_msg("%s%s\nfresh:\n%s", request, kept.text, fresh.text);
    }
}

/* Each after itself, and each after each other one. */
static void test_answers_are_those_of_a_new_connection(void **state)
{
    int fd = wire_dial(&daemon_), number = 0;

    (void)state;
    assert_true(fd >= 0);
    for (size_t i = 0; i < REQUESTS; i++) {
        for (size_t k = 0; k < ROUNDS; k++) {
            ask_both(fd, i, number++);
        }
    }
    for (size_t i = 0; i < REQUESTS; i++) {
        for (size_t k = 0; k < REQUESTS; k++) {
            ask_both(fd, i, number++);
            ask_both(fd, k, number++);
        }
    }
    (void)close(fd);
}

static void test_each_answer_has_its_own_id(void **state)
{
    char ids[20][40];
    int fd = wire_dial(&daemon_);

    (void)state;
    for (size_t i = 0; i < 20; i++) {
        const char *at;

        assert_true(wire_say(fd, "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"));
        wire_hear(fd, false, &kept);
        assert_int_equal(kept.status, 200);
        at = strstr(kept.text, "\r\nX-Request-Id: req-");
        assert_non_null(at);
        (void)snprintf(ids[i], sizeof ids[i], "%.*s", (int)strcspn(at + 16, "\r"), at + 16);
        for (size_t k = 0; k < i; k++) {
            assert_string_not_equal(ids[i], ids[k]);
        }
    }
    (void)close(fd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_are_those_of_a_new_connection),
        cmocka_unit_test(test_each_answer_has_its_own_id),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
