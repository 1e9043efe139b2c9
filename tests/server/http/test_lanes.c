/*
 * test_lanes.c - who may go first among what leaves libmicrohttpd's threads, against an api layer
 * made for the test: uploads have threads of their own, owners take turns and nobody has all of
 * them, small ones pass, one that needs the memory of all runs alone, and what nobody waits for any
 * more is told to stop.
 *
 * srnfd-test: waits
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/http/http_fixture.h"

#define CROWD 6

static int send_to(const struct http *http, const char *path)
{
    char request[200];
    int fd = dial(http);

    (void)snprintf(request, sizeof request,
                   "POST %s HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\nx", path);
    say(fd, request);
    return fd;
}

/* Waits until a count has this value; false where it does not come to it. */
static bool comes_to(atomic_int *count, int wanted)
{
    for (int i = 0; i < 1000 && atomic_load(count) != wanted; i++) {
        nap(5);
    }
    return atomic_load(count) == wanted;
}

/* The callers of the first uploads and slow requests, in the order in which they began. */
static const char *order_of(int count)
{
    assert_true(comes_to(&fake.noted, count));
    return fake.order;
}

static int leave_and_hear(int fd)
{
    int status;

    atomic_store(&fake.leave, true);
    status = hear(fd, text, false, NULL);
    (void)close(fd);
    return status;
}

static void uploads_keep_nobody_waiting(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 1, .upload_threads = 2});
    int uploads[CROWD];

    (void)state;
    for (size_t i = 0; i < CROWD; i++) {
        uploads[i] = send_to(http, "/upload-0");
    }
    assert_true(comes_to(&fake.uploads, 2));
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_int_equal(ask(http, "GET /probe HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    assert_int_equal(atomic_load(&fake.uploads), 2);
    for (size_t i = 0; i < CROWD; i++) {
        assert_int_equal(leave_and_hear(uploads[i]), 200);
    }
    assert_int_equal(atomic_load(&fake.most_uploads), 2);
    http_stop(http, 5);
}

/* One owner leaves a thread to others, and what it has queued does not go before theirs. Where two
   have the others, a small body of a third has a thread of its own. */
static void owners_take_turns(void **state)
{
    static const char *const sent[] = {"/upload-a", "/upload-a", "/upload-a",       "/upload-a",
                                       "/upload-b", "/upload-b", "/upload-c-small", "/upload-d"};
    enum { COUNT = sizeof sent / sizeof sent[0] };
    struct http *http = serve((struct http_config){.upload_threads = 2});
    int uploads[COUNT];

    (void)state;
    for (size_t i = 0; i < COUNT; i++) {
        uploads[i] = send_to(http, sent[i]);
        assert_true(comes_to(&fake.uploads, i < 4 ? 1 : i < 6 ? 2 : 3));
        nap(50); /* so that they are queued in this order */
    }
    assert_string_equal(order_of(3), "abc");
    for (size_t i = 0; i < COUNT; i++) {
        assert_int_equal(leave_and_hear(uploads[i]), 200);
    }
    assert_int_equal(strlen(order_of(COUNT)), COUNT);
    /* Before d, who came last, each of the others has at most one turn more. */
    assert_true(strchr(fake.order, 'd') <= fake.order + 6);
    http_stop(http, 5);
}

/* What waits for other servers leaves a thread to bodies, whoever sends it. */
static void fetching_leaves_a_thread(void **state)
{
    static const char *const sent[] = {"/upload-a-fetch", "/upload-b-fetch", "/upload-0-fetch",
                                       "/upload-c"};
    enum { COUNT = sizeof sent / sizeof sent[0] };
    struct http *http = serve((struct http_config){.upload_threads = 2});
    int uploads[COUNT];

    (void)state;
    for (size_t i = 0; i < COUNT; i++) {
        uploads[i] = send_to(http, sent[i]);
        assert_true(comes_to(&fake.uploads, i < 3 ? 1 : 2));
        nap(100);
        assert_int_equal(atomic_load(&fake.uploads), i < 3 ? 1 : 2);
    }
    assert_string_equal(order_of(2), "ac");
    for (size_t i = 0; i < COUNT; i++) {
        assert_int_equal(leave_and_hear(uploads[i]), 200);
    }
    http_stop(http, 5);
}

/* Where there is one thread, it fetches, too. */
static void one_thread_fetches(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 1});
    int upload = send_to(http, "/upload-a-fetch");

    (void)state;
    assert_true(comes_to(&fake.uploads, 1));
    assert_int_equal(leave_and_hear(upload), 200);
    http_stop(http, 5);
}

/* Several who had much of the threads do not hold up another for the sum of what each takes. */
static void who_had_least_goes_first(void **state)
{
    static const char *const before[] = {"/upload-a", "/upload-b", "/upload-c"};
    static const char *const sent[] = {"/upload-a", "/upload-b", "/upload-c", "/upload-d"};
    struct http *http = serve((struct http_config){.upload_threads = 1});
    int uploads[4];

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        uploads[0] = send_to(http, before[i]);
        assert_true(comes_to(&fake.uploads, 1));
        nap(300);
        assert_int_equal(leave_and_hear(uploads[0]), 200);
        atomic_store(&fake.leave, false);
    }
    for (size_t i = 0; i < 4; i++) {
        uploads[i] = send_to(http, sent[i]);
        assert_true(comes_to(&fake.uploads, 1));
        assert_true(comes_to(&fake.heads, 4 + (int)i));
        nap(100); /* so that they are queued in this order, also on a busy machine */
    }
    for (size_t i = 0; i < 4; i++) {
        assert_int_equal(leave_and_hear(uploads[i]), 200);
    }
    assert_int_equal(strncmp(order_of(7), "abcad", 5), 0);
    assert_int_equal(strlen(fake.order), 7);
    http_stop(http, 5);
}

/* Half the request threads are an owner's, and one is kept for probes. */
static void requests_leave_room_for_probes(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 4});
    int slow[CROWD];

    (void)state;
    for (size_t i = 0; i < CROWD; i++) {
        slow[i] = send_to(http, "/slow-a");
    }
    assert_true(comes_to(&fake.uploads, 2));
    nap(100);
    assert_int_equal(atomic_load(&fake.uploads), 2);
    assert_int_equal(ask(http, "GET /x HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    for (size_t i = 0; i < CROWD; i++) {
        assert_int_equal(leave_and_hear(slow[i]), 200);
    }
    atomic_store(&fake.leave, false);
    for (size_t i = 0; i < CROWD; i++) {
        slow[i] = send_to(http, "/slow-0");
    }
    assert_true(comes_to(&fake.uploads, 3));
    nap(100);
    assert_int_equal(atomic_load(&fake.uploads), 3);
    assert_int_equal(ask(http, "GET /probe HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
    for (size_t i = 0; i < CROWD; i++) {
        assert_int_equal(leave_and_hear(slow[i]), 200);
    }
    http_stop(http, 5);
}

/* Two owners leave a thread to a third one. */
static void requests_leave_room_for_others(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 6});
    int slow[2 * CROWD + 1];

    (void)state;
    for (size_t i = 0; i < CROWD; i++) {
        slow[i] = send_to(http, "/slow-a");
    }
    assert_true(comes_to(&fake.uploads, 3));
    for (size_t i = CROWD; i < 2 * CROWD; i++) {
        slow[i] = send_to(http, "/slow-b");
    }
    nap(100);
    assert_string_equal(order_of(4), "aaab");
    slow[2 * CROWD] = send_to(http, "/slow-c");
    assert_true(comes_to(&fake.uploads, 5));
    assert_string_equal(order_of(5), "aaabc");
    for (size_t i = 0; i <= 2 * CROWD; i++) {
        assert_int_equal(leave_and_hear(slow[i]), 200);
    }
    http_stop(http, 5);
}

/* What an owner has queued does not go before that of those who come later. */
static void requests_take_turns(void **state)
{
    static const char *const sent[] = {"/slow-a", "/slow-a", "/slow-a", "/slow-a",
                                       "/slow-b", "/slow-b", "/slow-b", "/slow-c"};
    enum { COUNT = sizeof sent / sizeof sent[0] };
    struct http *http = serve((struct http_config){.request_threads = 2});
    int slow[COUNT];

    (void)state;
    for (size_t i = 0; i < COUNT; i++) {
        slow[i] = send_to(http, sent[i]);
        assert_true(comes_to(&fake.uploads, 1));
        nap(50); /* so that they are queued in this order */
    }
    for (size_t i = 0; i < COUNT; i++) {
        assert_int_equal(leave_and_hear(slow[i]), 200);
    }
    assert_string_equal(order_of(8), "aabcabab");
    http_stop(http, 5);
}

/* Those that nobody waits for any more are not handled. */
static void requests_in_the_queue_end_with_their_clients(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 2});
    int runs = send_to(http, "/slow-0"), left[CROWD], half;

    (void)state;
    assert_true(comes_to(&fake.uploads, 1));
    for (size_t i = 0; i < CROWD; i++) {
        left[i] = send_to(http, "/slow-0");
    }
    half = send_to(http, "/slow-0");
    nap(100);
    for (size_t i = 0; i < CROWD; i++) {
        (void)close(left[i]);
    }
    (void)shutdown(half, SHUT_WR);
    nap(2000);
    assert_int_equal(leave_and_hear(runs), 200);
    assert_int_equal(hear(half, text, false, NULL), 408);
    (void)close(half);
    http_stop(http, 5);
    assert_int_equal(atomic_load(&fake.handled), 1);
}

/* Small ones have a thread, whatever the others do, and give it up where they turn out large. */
static void small_uploads_have_a_way(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 2});
    int uploads[6];

    (void)state;
    uploads[0] = send_to(http, "/upload-a");
    assert_true(comes_to(&fake.uploads, 1));
    uploads[1] = send_to(http, "/upload-b");
    assert_true(comes_to(&fake.uploads, 2));
    uploads[2] = send_to(http, "/upload-c-small-again");
    uploads[3] = send_to(http, "/upload-d");
    assert_true(comes_to(&fake.begun, 3));
    nap(100);
    assert_int_equal(atomic_load(&fake.uploads), 2);
    uploads[4] = send_to(http, "/upload-e-small");
    assert_true(comes_to(&fake.uploads, 3));
    assert_string_equal(order_of(4), "abce");
    uploads[5] = send_to(http, "/upload-f-small"); /* waits for the one before, or the others */
    nap(100);
    assert_int_equal(atomic_load(&fake.uploads), 3);
    for (size_t i = 0; i < 6; i++) {
        assert_int_equal(leave_and_hear(uploads[i]), 200);
    }
    http_stop(http, 5);
}

static void small_uploads_pass_what_runs_alone(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 2});
    int alone = send_to(http, "/upload-0-again"), small;

    (void)state;
    assert_true(comes_to(&fake.alone, 1));
    small = send_to(http, "/upload-1-small");
    assert_true(comes_to(&fake.uploads, 2));
    assert_int_equal(leave_and_hear(small), 200);
    assert_int_equal(leave_and_hear(alone), 200);
    http_stop(http, 5);
}

static void what_finds_no_room_runs_alone(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 3});
    int first = send_to(http, "/upload-0"), again[2], last;

    (void)state;
    assert_true(comes_to(&fake.uploads, 1));
    again[0] = send_to(http, "/upload-0-again");
    again[1] = send_to(http, "/upload-0-again");
    nap(100);
    last = send_to(http, "/upload-0");
    nap(100);
    assert_int_equal(atomic_load(&fake.alone), 0);
    assert_int_equal(atomic_load(&fake.uploads), 1);
    assert_int_equal(leave_and_hear(first), 200);
    assert_int_equal(leave_and_hear(again[0]), 200);
    assert_int_equal(leave_and_hear(again[1]), 200);
    assert_int_equal(leave_and_hear(last), 200);
    assert_int_equal(atomic_load(&fake.alone), 2);
    assert_int_equal(atomic_load(&fake.crowded), 0);
    http_stop(http, 5);
}

/* Those that are read and those that wait: the client's end ends both. */
static void uploads_end_with_their_clients(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 1});
    int reads = send_to(http, "/upload-0"), waits, half;
    double start;
    int status;

    (void)state;
    assert_true(comes_to(&fake.uploads, 1));
    waits = send_to(http, "/upload-0");
    half = send_to(http, "/upload-0");
    nap(100);
    (void)close(waits);
    (void)shutdown(half, SHUT_WR);
    start = now();
    status = hear(half, text, false, NULL);
    assert_true(status == 408 || status == 0); /* the library may see the end before the answer */
    assert_true(now() - start < 10);
    assert_int_equal(atomic_load(&fake.handled), 1);
    assert_true(closes(half));
    (void)close(half);
    (void)close(reads);
    assert_true(comes_to(&fake.uploads, 0));
    assert_false(atomic_load(&fake.leave));
    http_stop(http, 5);
}

static void stopping_ends_uploads_within_the_grace(void **state)
{
    struct http *http = serve((struct http_config){.upload_threads = 1});
    int reads = send_to(http, "/upload-0"), waits;
    double start;

    (void)state;
    assert_true(comes_to(&fake.uploads, 1));
    waits = send_to(http, "/upload-0");
    nap(100);
    start = now();
    http_stop(http, 2);
    assert_true(now() - start < 2);
    assert_int_equal(hear(reads, text, false, NULL), 503);
    assert_int_equal(hear(waits, text, false, NULL), 503);
    assert_int_equal(atomic_load(&fake.handled), 1);
    (void)close(reads);
    (void)close(waits);
}

static void *let_leave(void *argument)
{
    (void)argument;
    nap(1900);
    atomic_store(&fake.leave, true);
    return NULL;
}

/* What is queued is not handled when most of the grace is over; what runs is waited for. */
static void stopping_ends_requests_within_the_grace(void **state)
{
    struct http *http = serve((struct http_config){.request_threads = 2});
    int fds[CROWD];
    pthread_t thread;

    (void)state;
    fds[0] = send_to(http, "/slow-0");
    assert_true(comes_to(&fake.uploads, 1));
    for (size_t i = 1; i < CROWD; i++) {
        fds[i] = send_to(http, "/slow-0");
    }
    nap(100);
    assert_int_equal(pthread_create(&thread, NULL, let_leave, NULL), 0);
    http_stop(http, 2);
    (void)pthread_join(thread, NULL);
    for (size_t i = 0; i < CROWD; i++) {
        assert_int_equal(hear(fds[i], text, false, NULL), i == 0 ? 200 : 503);
        (void)close(fds[i]);
    }
    assert_int_equal(atomic_load(&fake.handled), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uploads_keep_nobody_waiting),
        cmocka_unit_test(owners_take_turns),
        cmocka_unit_test(fetching_leaves_a_thread),
        cmocka_unit_test(one_thread_fetches),
        cmocka_unit_test(who_had_least_goes_first),
        cmocka_unit_test(requests_leave_room_for_probes),
        cmocka_unit_test(requests_leave_room_for_others),
        cmocka_unit_test(requests_take_turns),
        cmocka_unit_test(requests_in_the_queue_end_with_their_clients),
        cmocka_unit_test(small_uploads_have_a_way),
        cmocka_unit_test(small_uploads_pass_what_runs_alone),
        cmocka_unit_test(what_finds_no_room_runs_alone),
        cmocka_unit_test(uploads_end_with_their_clients),
        cmocka_unit_test(stopping_ends_uploads_within_the_grace),
        cmocka_unit_test(stopping_ends_requests_within_the_grace),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    if (sodium_init() < 0) {
        return 1;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
