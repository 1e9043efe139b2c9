/*
 * test_head.c - the form of a request's head: what is well formed, what is refused and with which
 * code, and that the verdict does not depend on how the bytes come in.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/head.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT(text) text, sizeof(text) - 1

/* status 0: complete; -1: incomplete. */
static const struct {
    const char *bytes;
    size_t size;
    int status;
} heads[] = {
    {TEXT("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), 0},
    {TEXT("GET / HTTP/1.0\r\n\r\n"), 0},
    {TEXT("\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n"), 0},
    {TEXT("FLY!x /a?b%00 HTTP/1.1\r\na:b\r\nc: \t d e \t\r\nf:\r\n\r\nrest\n\0"), 0},
    {TEXT("GET /\xc3\xa4 HTTP/1.1\r\nName: \xff\r\n\r\n"), 0},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 0\r\n\r\n"), 0},
    {TEXT("POST / HTTP/1.1\r\nContent-Length:999999999999999999  \r\n\r\n"), 0},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: Chunked\r\n\r\n"), 0},
    {TEXT(""), -1},
    {TEXT("G"), -1},
    {TEXT("GET / HTTP/1.1\r\nHost: x\r\n"), -1},
    {TEXT("GET / HTTP/1.1\r\nHost: x\r\n\r"), -1},
    /* Smuggling. */
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 5\r\nContent-Length: 5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 5, 5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: +5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 0x5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 5 5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length:\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n"), 413},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: gzip, chunked\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: chunked, identity\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: xchunked\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: \vchunked\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\ntransfer-encoding: chunked\r\n\r\n"),
     400},
    {TEXT("POST / HTTP/1.1\r\nContent-Length : 5\r\n\r\n"), 400},
    {TEXT("POST / HTTP/1.1\r\n Content-Length: 5\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nA: b\r\n c\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nA: b\r\n\tc\r\n\r\n"), 400},
    /* Lines. */
    {TEXT("GET / HTTP/1.1\nHost: x\n\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nHost: x\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nHost: x\r\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\rHost: x\r\n\r\n"), 400},
    {TEXT("\r\n\r\nGET / HTTP/1.1\r\n\r\n"), 400},
    {TEXT("\nGET / HTTP/1.1\r\n\r\n"), 400},
    /* Characters. */
    {TEXT("GET /a\0b HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET /a HTTP/1.1\r\nA: \0\r\n\r\n"), 400},
    {TEXT("GET /a HTTP/1.1\r\nA\0: b\r\n\r\n"), 400},
    {TEXT("GET /a\tb HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET /a\x7f HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nA(b): c\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\n: c\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1\r\nnothing\r\n\r\n"), 400},
    {TEXT("\0\0\0\0\r\n\r\n"), 400},
    /* Request lines. */
    {TEXT("GET\r\n\r\n"), 400},
    {TEXT("GET /\r\n\r\n"), 400},
    {TEXT("GET  / HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET /  HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.1 \r\n\r\n"), 400},
    {TEXT(" GET / HTTP/1.1\r\n\r\n"), 400},
    {TEXT("G(T / HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET /a b HTTP/1.1\r\n\r\n"), 400},
    {TEXT("GET / http/1.1\r\n\r\n"), 400},
    {TEXT("GET / HTTP/1.2\r\n\r\n"), 505},
    {TEXT("GET / HTTP/9.9\r\n\r\n"), 505},
    {TEXT("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), 505},
    {TEXT("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"), 400},
};

static int judge(const char *bytes, size_t size)
{
    struct head_refusal refusal = {0};

    switch (head_check(bytes, size, &refusal)) {
    case HEAD_COMPLETE:
        return 0;
    case HEAD_INCOMPLETE:
        return -1;
    case HEAD_REFUSED:
        break;
    }
    assert_non_null(refusal.code);
    assert_non_null(refusal.detail);
    return refusal.status;
}

static void test_each_head_gets_its_verdict(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        int got = judge(heads[i].bytes, heads[i].size);

        if (got != heads[i].status) {
            print_message("%.60s: %d instead of %d\n", heads[i].bytes, got, heads[i].status);
        }
        assert_int_equal(got, heads[i].status);
    }
}

/* Byte by byte a head is incomplete until its verdict comes, which then stays; the copies have
   exactly their size, so that a sanitizer sees any look beyond. */
static void test_verdicts_do_not_depend_on_pieces(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        int last = -1;

        for (size_t size = 0; size <= heads[i].size; size++) {
            char *copy = malloc(size > 0 ? size : 1);
            int got;

            assert_non_null(copy);
            memcpy(copy, heads[i].bytes, size);
            got = judge(copy, size);
            free(copy);
            assert_true(last == -1 || got == last);
            last = got;
        }
        assert_int_equal(last, heads[i].status);
    }
}

/* A head of so many fields of so many bytes each, and a target of so many. */
static int judge_sized(size_t target, size_t fields, size_t field, size_t cut)
{
    size_t size = 64 + target + fields * (field + 2), used;
    char *text = malloc(size);
    int got;

    assert_non_null(text);
    used = (size_t)snprintf(text, size, "GET ");
    memset(text + used, '/', target);
    used += target;
    used += (size_t)snprintf(text + used, size - used, " HTTP/1.1\r\n");
    for (size_t i = 0; i < fields; i++) {
        memset(text + used, 'a', field);
        text[used + 1] = ':';
        memcpy(text + used + field, "\r\n", 2);
        used += field + 2;
    }
    memcpy(text + used, "\r\n", 2);
    used += 2;
    got = judge(text, used - cut);
    free(text);
    return got;
}

static void test_limits_are_kept_to_the_byte(void **state)
{
    (void)state;
    assert_int_equal(judge_sized(HEAD_TARGET_MAX, 1, 10, 0), 0);
    assert_int_equal(judge_sized(HEAD_TARGET_MAX + 1, 1, 10, 0), 414);
    assert_int_equal(judge_sized(1, HEAD_FIELDS_MAX, 10, 0), 0);
    assert_int_equal(judge_sized(1, HEAD_FIELDS_MAX + 1, 10, 0), 431);
    assert_int_equal(judge_sized(1, 1, HEAD_FIELD_BYTES_MAX - 2, 0), 0);
    assert_int_equal(judge_sized(1, 1, HEAD_FIELD_BYTES_MAX - 1, 0), 431);
    /* Refused before their end has come: nothing grows beyond HEAD_BYTES_MAX for want of one. */
    assert_int_equal(judge_sized(HEAD_BYTES_MAX, 0, 0, 14), 414);
    assert_int_equal(judge_sized(1, 1, HEAD_BYTES_MAX, 4), 431);
    assert_int_equal(judge_sized(HEAD_TARGET_MAX, 1, HEAD_FIELD_BYTES_MAX + 1, 4), 431);
}

/* A query of so many parameters, so many fields, and a cookie of so many parts of 8 bytes. */
static int judge_parts(size_t parameters, size_t fields, size_t cookies)
{
    size_t size = 256 + 2 * parameters + 16 * fields + 8 * cookies, used;
    char *text = malloc(size);
    int got;

    assert_non_null(text);
    used = (size_t)snprintf(text, size, "GET /a&b&c");
    for (size_t i = 0; i < parameters; i++) {
        used += (size_t)snprintf(text + used, size - used, "%c1", i == 0 ? '?' : '&');
    }
    used += (size_t)snprintf(text + used, size - used, " HTTP/1.1\r\n");
    for (size_t i = 0; i < fields; i++) {
        used += (size_t)snprintf(text + used, size - used, "a: b\r\n");
    }
    if (cookies > 0) {
        used += (size_t)snprintf(text + used, size - used, "cookie: ");
        memset(text + used, 'a', 8 * cookies);
        for (size_t i = 1; i < cookies; i++) {
            text[used + 8 * i] = ';';
        }
        used += 8 * cookies;
        used += (size_t)snprintf(text + used, size - used, "\r\n");
    }
    used += (size_t)snprintf(text + used, size - used, "\r\n");
    got = judge(text, used);
    free(text);
    return got;
}

static void test_parts_fit_into_the_librarys_memory(void **state)
{
    (void)state;
    assert_int_equal(judge_parts(HEAD_PARAMETERS_MAX, 1, 0), 0);
    assert_int_equal(judge_parts(HEAD_PARAMETERS_MAX + 1, 1, 0), 414);
    assert_int_equal(judge_parts(HEAD_PARAMETERS_MAX, HEAD_FIELDS_MAX, 0), 0);
    assert_int_equal(judge_parts(HEAD_PARAMETERS_MAX, 1, 40), 0);
    assert_int_equal(judge_parts(HEAD_PARAMETERS_MAX, 1, 250), 431);
    assert_int_equal(judge_parts(0, 1, 200), 0);
    assert_int_equal(judge_parts(0, 1, 230), 431);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_head_gets_its_verdict),
        cmocka_unit_test(test_verdicts_do_not_depend_on_pieces),
        cmocka_unit_test(test_limits_are_kept_to_the_byte),
        cmocka_unit_test(test_parts_fit_into_the_librarys_memory),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
