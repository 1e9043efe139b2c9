/*
 * test_build.c - what the binary says of itself is the same on any thread, whatever others ask
 * meanwhile: workers are refused for another build.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "build.h"

#include <pthread.h>
#include <string.h>

#define THREADS ((size_t)8)
#define TIMES 2000

struct said {
    char numeric[BUILD_ID_SIZE], arithmetic[BUILD_ARITHMETIC_SIZE];
    struct build_part parts[BUILD_PARTS];
};

static void ask(struct said *said)
{
    build_numeric_id(said->numeric);
    build_arithmetic_id(said->arithmetic);
    build_parts(said->parts);
}

static void *ask_often(void *argument)
{
    const struct said *first = argument;
    size_t others = 0;

    for (int i = 0; i < TIMES; i++) {
        struct said said;

        ask(&said);
        others += strcmp(said.numeric, first->numeric) != 0 ||
                  strcmp(said.arithmetic, first->arithmetic) != 0;
        for (size_t k = 0; k < BUILD_PARTS; k++) {
            others += strcmp(said.parts[k].version, first->parts[k].version) != 0;
        }
    }
    return others > 0 ? argument : NULL;
}

static void all_threads_hear_the_same(void **state)
{
    pthread_t threads[THREADS];
    struct said first;
    size_t wrong = 0;

    (void)state;
    ask(&first);
    for (size_t i = 0; i < THREADS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, ask_often, &first), 0);
    }
    for (size_t i = 0; i < THREADS; i++) {
        void *result;

        assert_int_equal(pthread_join(threads[i], &result), 0);
        wrong += result != NULL;
    }
    assert_int_equal(wrong, 0);
}

static void the_id_names_what_computes(void **state)
{
    struct said said;

    (void)state;
    ask(&said);
    assert_non_null(strstr(said.numeric, "openblas OpenBLAS "));
    assert_non_null(strstr(said.numeric, "fftw-"));
    assert_int_equal(strncmp(said.arithmetic, said.numeric, strlen(said.numeric)), 0);
    assert_true(strlen(said.arithmetic) > strlen(said.numeric));
    assert_string_equal(said.parts[0].name, "srnfd");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_threads_hear_the_same),
        cmocka_unit_test(the_id_names_what_computes),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
