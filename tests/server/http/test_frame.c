/*
 * test_frame.c - what follows what on a connection: good streams end where they should, in whatever
 * pieces they come; bad ones are refused at their first wrong byte at the latest.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "http/frame.h"

#include <stdio.h>
#include <string.h>

#define HOST "Host: x\r\n"
#define CHUNKED "POST /x HTTP/1.1\r\n" HOST "Transfer-Encoding: chunked\r\n\r\n"
#define GET "GET /x HTTP/1.1\r\n" HOST "\r\n"
#define TEXT(text) text, sizeof(text) - 1

/* Takes the bytes in pieces of at most so many. */
static enum head_verdict take(struct frame *frame, const char *bytes, size_t size, size_t piece)
{
    enum head_verdict verdict = HEAD_COMPLETE;
    struct head_refusal refusal;
    char copy[400];

    assert_true(size <= sizeof copy);
    memcpy(copy, bytes, size);
    memset(frame, 0, sizeof *frame);
    for (size_t at = 0; at < size && verdict == HEAD_COMPLETE; at += piece) {
        size_t n = size - at < piece ? size - at : piece;

        verdict = frame_take(frame, copy + at, n, &refusal);
        assert_true(verdict != HEAD_REFUSED || refusal.status >= 400);
    }
    return verdict;
}

static void test_good_streams_end_where_they_should(void **state)
{
    static const struct {
        const char *bytes;
        size_t size, heads;
    } streams[] = {
        {TEXT(GET), 1},
        {TEXT(GET GET GET), 3},
        {TEXT("\r\n" GET "\r\n" GET), 2},
        {TEXT("POST /x HTTP/1.1\r\n" HOST "Content-Length: 5\r\n\r\nhello" GET), 2},
        {TEXT("POST /x HTTP/1.1\r\n" HOST "Content-Length:  0\r\n\r\n" GET), 2},
        {TEXT(CHUNKED "5\r\nhello\r\n0\r\n\r\n" GET), 2},
        {TEXT(CHUNKED "5\r\nhel\r\n\r\n00a\r\n0123456789\r\n000\r\n\r\n" GET), 2},
        {TEXT(CHUNKED "5;a=\"b\tc\"\r\nhello\r\n0;z\r\nX: y\r\nZ: w\r\n\r\n" GET), 2},
        {TEXT(CHUNKED "0\r\n\r\n" CHUNKED "1\r\na\r\n0\r\n\r\n"), 2},
    };
    struct frame frame;

    (void)state;
    for (size_t i = 0; i < sizeof streams / sizeof streams[0]; i++) {
        for (size_t piece = 1; piece <= streams[i].size; piece++) {
            assert_int_equal(take(&frame, streams[i].bytes, streams[i].size, piece), HEAD_COMPLETE);
            assert_int_equal(frame.state, FRAME_HEAD);
            assert_int_equal(frame.heads, streams[i].heads);
            assert_null(frame.head);
            frame_clear(&frame);
        }
    }
}

static void test_bad_streams_are_refused(void **state)
{
    static const struct {
        const char *bytes;
        size_t size;
    } streams[] = {
        {TEXT(GET "GET /x HTTP/1.1\nHost: x\n\n")},
        {TEXT(GET "POST /x HTTP/1.1\r\n" HOST "Content-Length: 2\0\r\n\r\n")},
        {TEXT(GET "POST /x HTTP/1.1\r\n" HOST "Content-Length: 2 2\r\n\r\n")},
        {TEXT("POST /x HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n")},
        {TEXT("POST /x HTTP/1.1\r\n" HOST "Content-Length: 5\r\n\r\nhello(" GET)},
        {TEXT(CHUNKED "5\nhello\r\n0\r\n\r\n")},
        {TEXT(CHUNKED "5\r\nhello\n0\r\n\r\n")},
        {TEXT(CHUNKED "5\r\nhello0\r\n\r\n")},
        {TEXT(CHUNKED "5\r\nhello\r\n0\r\n\n")},
        {TEXT(CHUNKED "5\r\nhello\r\n0\n\n")},
        {TEXT(CHUNKED "5\r\nhello\r\n0\r\nX: y\n\r\n")},
        {TEXT(CHUNKED "5\r\nhello\r\n0\r\nX: \0y\r\n\r\n")},
        {TEXT(CHUNKED "5;a\nb\r\nhello\r\n0\r\n\r\n")},
        {TEXT(CHUNKED "5;a\0b\r\nhello\r\n0\r\n\r\n")},
        {TEXT(CHUNKED "\r\nhello")},
        {TEXT(CHUNKED ";a\r\nhello")},
        {TEXT(CHUNKED "0x5\r\nhello")},
        {TEXT(CHUNKED " 5\r\nhello")},
        {TEXT(CHUNKED "5 \r\nhello")},
        {TEXT(CHUNKED "-1\r\n")},
        {TEXT(CHUNKED "fffffffffffffffff\r\n")},
        {TEXT(CHUNKED "5\rhello")},
    };
    struct frame frame;

    (void)state;
    for (size_t i = 0; i < sizeof streams / sizeof streams[0]; i++) {
        for (size_t piece = 1; piece <= streams[i].size; piece++) {
            if (take(&frame, streams[i].bytes, streams[i].size, piece) != HEAD_REFUSED) {
                print_message("stream %zu in pieces of %zu\n", i, piece);
                fail();
            }
            frame_clear(&frame);
        }
    }
}

/* libmicrohttpd gets them before the value; what it has got already cannot be changed. */
static void test_blanks_behind_a_length_are_moved(void **state)
{
    static const char request[] = "POST /x HTTP/1.1\r\nContent-Length: 2 \t\r\n" HOST "\r\nab" GET;
    char bytes[sizeof request];
    struct head_refusal refusal;
    struct frame frame = {0};

    (void)state;
    memcpy(bytes, request, sizeof bytes);
    assert_int_equal(frame_take(&frame, bytes, sizeof bytes - 1, &refusal), HEAD_COMPLETE);
    assert_string_equal(bytes, "POST /x HTTP/1.1\r\nContent-Length:   2\r\n" HOST "\r\nab" GET);
    assert_int_equal(frame.heads, 2);
    assert_int_equal(take(&frame, request, sizeof request - 1, 40), HEAD_REFUSED);
    frame_clear(&frame);
}

/* Lines of chunks, trailers and heads without an end. */
static void test_lengths_are_bounded(void **state)
{
    static const struct {
        const char *start;
        size_t most;
    } floods[] = {{CHUNKED "5;", FRAME_CHUNK_LINE_MAX},
                  {CHUNKED "0\r\nX: ", FRAME_TRAILERS_MAX},
                  {"GET /x HTTP/1.1\r\nX: ", HEAD_BYTES_MAX}};
    char flood[] = "aaaaaaaa";
    struct head_refusal refusal;
    struct frame frame;

    (void)state;
    for (size_t i = 0; i < sizeof floods / sizeof floods[0]; i++) {
        size_t n = 0;

        assert_int_equal(take(&frame, floods[i].start, strlen(floods[i].start), 100),
                         HEAD_COMPLETE);
        while (frame_take(&frame, flood, 8, &refusal) == HEAD_COMPLETE) {
            n += 8;
            assert_true(n <= floods[i].most);
        }
        assert_true(refusal.status >= 400 && refusal.status < 500);
        frame_clear(&frame);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good_streams_end_where_they_should),
        cmocka_unit_test(test_bad_streams_are_refused),
        cmocka_unit_test(test_blanks_behind_a_length_are_moved),
        cmocka_unit_test(test_lengths_are_bounded),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
