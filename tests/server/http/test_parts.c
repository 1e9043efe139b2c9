/*
 * test_parts.c - requests whose heads have many parameters, fields and cookies: within the limits
 * of head.h libmicrohttpd has the memory to answer, and beyond them the service does.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "http_fixture.h"

/* A request of so many parameters and fields, a cookie of so many parts, and a body. */
static int ask_parts(const struct http *http, size_t parameters, size_t fields, size_t field,
                     size_t cookies, size_t body)
{
    static char request[200000];
    size_t used = (size_t)snprintf(request, sizeof request, "POST /quick");
    int fd, status;

    for (size_t i = 0; i < parameters; i++) {
        used += (size_t)snprintf(request + used, sizeof request - used, "%c%zu=%zu",
                                 i == 0 ? '?' : '&', i, i);
    }
    used += (size_t)snprintf(request + used, sizeof request - used,
                             " HTTP/1.1\r\nHost: x\r\nContent-Length: %zu\r\n", body);
    for (size_t i = 0; i < fields; i++) {
        used += (size_t)snprintf(request + used, sizeof request - used, "X-%zu: ", i);
        memset(request + used, 'a', field);
        used += field;
        used += (size_t)snprintf(request + used, sizeof request - used, "\r\n");
    }
    for (size_t i = 0; i < cookies; i++) {
        used += (size_t)snprintf(request + used, sizeof request - used, "%sa%zu=b",
                                 i == 0 ? "Cookie: " : "; ", i);
    }
    used += (size_t)snprintf(request + used, sizeof request - used, "%s\r\n",
                             cookies > 0 ? "\r\n" : "");
    memset(request + used, 'b', body);
    request[used + body] = '\0';
    fd = dial(http);
    say(fd, request);
    status = hear(fd, text, false, NULL);
    if (status >= 400) {
        assert_true(closes(fd));
    }
    (void)close(fd);
    return status;
}

/* Whatever its parts are, a head is answered, and not by a page of the library. */
static void test_heads_of_many_parts_are_answered(void **state)
{
    struct http *http = serve((struct http_config){0});
    const size_t bodies[] = {0, 12000, 40000};

    (void)state;
    assert_int_equal(ask_parts(http, 128, 60, 10, 0, 0), 200);
    assert_int_equal(ask_parts(http, 129, 0, 0, 0, 0), 414);
    assert_int_equal(ask_parts(http, 500, 0, 0, 0, 0), 414);
    assert_int_equal(ask_parts(http, 0, 0, 0, 500, 0), 431);
    for (size_t parameters = 0; parameters <= 128; parameters += 16) {
        for (size_t field = 1; field <= 251; field += 50) {
            for (size_t i = 0; i < 3; i++) {
                size_t cookies = 10 * (parameters / 16) * i;
                int status = ask_parts(http, parameters, 61, field, cookies, bodies[i]);

                assert_true(status == 200 || status == 431);
                assert_null(strcasestr(text, "<html>"));
            }
        }
    }
    assert_int_equal(ask(http, "GET /quick HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    http_stop(http, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_heads_of_many_parts_are_answered),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
