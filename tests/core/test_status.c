/*
 * test_status.c - the sentences of the status codes, the filling of struct srnf_error, and the
 * allocator.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <string.h>

#include "internal.h"

/* Without a default the compiler refuses this function when a code is added that it does not name;
   so what follows holds for all codes there are. */
static bool is_a_status(enum srnf_status status)
{
    switch (status) {
    case SRNF_OK:
    case SRNF_ENOMEM:
    case SRNF_EINVAL:
    case SRNF_ELIMIT:
    case SRNF_ECANCELED:
    case SRNF_EFORMAT:
    case SRNF_EPARSE:
    case SRNF_ENOT_CLOSED:
    case SRNF_ENOT_MANIFOLD:
    case SRNF_ENOT_ORIENTED:
    case SRNF_ECOMPONENTS:
    case SRNF_EGENUS:
    case SRNF_EDEGENERATE:
    case SRNF_ENOT_STAR:
    case SRNF_ENUMERIC:
    case SRNF_EUNMATCHED:
    case SRNF_EIO:
    case SRNF_WNOT_CONVERGED:
        return true;
    }
    return false;
}

#define RANGE 200 /* codes are looked for in [-RANGE, RANGE] */

static void every_status_has_a_sentence_of_its_own(void **state)
{
    const char *unknown = srnf_strerror(RANGE + 1);
    int found = 0;

    (void)state;
    for (int a = -RANGE; a <= RANGE; a++) {
        const char *sentence = srnf_strerror(a);

        assert_non_null(sentence);
        assert_true(strlen(sentence) > 0);
        assert_int_equal(is_a_status((enum srnf_status)a), strcmp(sentence, unknown) != 0);
        if (!is_a_status((enum srnf_status)a)) {
            continue;
        }
        found++;
        for (int b = a + 1; b <= RANGE; b++) {
            assert_true(!is_a_status((enum srnf_status)b) || strcmp(sentence, srnf_strerror(b)));
        }
    }
    assert_true(found > 2);
    assert_non_null(srnf_strerror(INT32_MIN));
    assert_string_equal(srnf_strerror(INT32_MAX), unknown);
}

static void a_failure_is_described_in_full(void **state)
{
    struct srnf_error error = {0, 0, ""};

    (void)state;
    assert_int_equal(srnf_fail(&error, SRNF_EPARSE, 17, "face %d of %s", 17, "a mesh"),
                     SRNF_EPARSE);
    assert_int_equal(error.status, SRNF_EPARSE);
    assert_int_equal(error.element, 17);
    assert_string_equal(error.message, "face 17 of a mesh");
}

static void a_failure_needs_no_description(void **state)
{
    (void)state;
    assert_int_equal(srnf_fail(NULL, SRNF_ELIMIT, -1, "%s", "nobody reads this"), SRNF_ELIMIT);
}

static void a_long_message_is_cut(void **state)
{
    struct {
        struct srnf_error error;
        char guard[16];
    } box;
    char text[2 * sizeof box.error.message];

    (void)state;
    memset(&box, '#', sizeof box);
    memset(text, 'x', sizeof text);
    text[sizeof text - 1] = '\0';
    assert_int_equal(srnf_fail(&box.error, SRNF_EINVAL, -1, "%s", text), SRNF_EINVAL);
    assert_int_equal(strlen(box.error.message), sizeof box.error.message - 1);
    for (size_t i = 0; i < sizeof box.guard; i++) {
        assert_int_equal(box.guard[i], '#');
    }
}

static void memory_comes_zeroed_and_aligned(void **state)
{
    (void)state;
    for (size_t size = 0; size < 300; size += 7) {
        unsigned char *memory = srnf_alloc(size, 3);

        assert_non_null(memory);
        assert_int_equal((uintptr_t)memory % 64, 0);
        for (size_t i = 0; i < 3 * size; i++) {
            assert_int_equal(memory[i], 0);
        }
        memset(memory, 0xff, 3 * size); /* the next one finds it dirty */
        srnf_free(memory);
    }
    srnf_free(NULL);
}

/* All would wrap round to something small, or to nothing. volatile keeps the compiler from judging
   the sizes. */
static void sizes_that_overflow_are_refused(void **state)
{
    static const size_t half = SIZE_MAX / 2 + 1;
    const struct {
        size_t count, size;
    } cases[] = {
        {SIZE_MAX, SIZE_MAX},  {SIZE_MAX, 2},
        {2, SIZE_MAX},         {half, 2},
        {half + 1, 2},         {(size_t)1 << 32, (size_t)1 << 32},
        {SIZE_MAX / 3 + 1, 3}, {SIZE_MAX, 1},
        {1, SIZE_MAX},         {SIZE_MAX - 62, 1},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        volatile size_t count = cases[i].count;
        volatile size_t size = cases[i].size;

        assert_null(srnf_alloc(count, size));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_status_has_a_sentence_of_its_own),
        cmocka_unit_test(a_failure_is_described_in_full),
        cmocka_unit_test(a_failure_needs_no_description),
        cmocka_unit_test(a_long_message_is_cut),
        cmocka_unit_test(memory_comes_zeroed_and_aligned),
        cmocka_unit_test(sizes_that_overflow_are_refused),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
