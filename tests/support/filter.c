/*
 * filter.c - runs only the tests of a program whose names match the pattern SRNFD_TEST_FILTER, as
 * '*thread*', where that is set. Linked into every test program; nothing calls it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>

/* Programs that share this folder need not have the test library. */
#pragma weak cmocka_set_test_filter

__attribute__((constructor)) static void set_filter(void)
{
    const char *pattern = getenv("SRNFD_TEST_FILTER");

    if (pattern && pattern[0] && cmocka_set_test_filter) {
        cmocka_set_test_filter(pattern);
    }
}
