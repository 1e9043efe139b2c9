/*
 * test_request_ids.c - ids are of one form, and no two the same: of one service, of two that a
 * thread takes turns with, and of several threads.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "http/internal.h"

#include <stdlib.h>
#include <string.h>

#define THREADS ((size_t)4)
#define EACH ((size_t)1000)
#define ID_SIZE ((size_t)40)

static char ids[THREADS * EACH][ID_SIZE];

static struct http *service(void)
{
    struct http *http = calloc(1, sizeof *http);

    assert_non_null(http);
    request_ids_start(http);
    return http;
}

static int compare(const void *a, const void *b)
{
    return strcmp(a, b);
}

static void check_all(void)
{
    const size_t count = sizeof ids / sizeof ids[0];

    for (size_t i = 0; i < count; i++) {
        assert_memory_equal(ids[i], "req-", 4);
        assert_int_equal(strlen(ids[i]), 28);
        assert_int_equal(strspn(ids[i] + 4, "0123456789abcdef"), 24);
    }
    qsort(ids, count, sizeof ids[0], compare);
    for (size_t i = 1; i < count; i++) {
        assert_string_not_equal(ids[i - 1], ids[i]);
    }
}

static void test_services_on_one_thread(void **state)
{
    struct http *services[2] = {service(), service()};

    (void)state;
    for (size_t i = 0; i < THREADS * EACH; i++) {
        request_id_make(services[i / 100 % 2], ids[i]); /* not a multiple of a batch */
    }
    check_all();
    free(services[0]);
    free(services[1]);
}

static struct http *shared;

static void *make_some(void *first)
{
    char(*some)[ID_SIZE] = first;

    for (size_t i = 0; i < EACH; i++) {
        request_id_make(shared, some[i]);
    }
    return NULL;
}

static void test_threads_of_one_service(void **state)
{
    pthread_t threads[THREADS];

    (void)state;
    shared = service();
    for (size_t i = 0; i < THREADS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, make_some, ids + i * EACH), 0);
    }
    for (size_t i = 0; i < THREADS; i++) {
        (void)pthread_join(threads[i], NULL);
    }
    check_all();
    free(shared);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_services_on_one_thread),
        cmocka_unit_test(test_threads_of_one_service),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
