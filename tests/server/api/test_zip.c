/*
 * A zip that cannot be written fails, and is closed without another look at what was to go in.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <sys/mman.h>

#include "api/zip.h"

#define SIZE ((size_t)1 << 20)

static void a_full_disk_ends_it(void **state)
{
    struct zip_writer zip;
    FILE *out = fopen("/dev/full", "wb");
    unsigned char *bytes =
        mmap(NULL, SIZE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    uint64_t noise = 1;

    (void)state;
    assert_non_null(out);
    assert_true(bytes != MAP_FAILED);
    for (size_t i = 0; i < SIZE; i++) { /* which hardly gets smaller */
        noise = noise * UINT64_C(6364136223846793005) + 1442695040888963407;
        bytes[i] = (unsigned char)(noise >> 56);
    }
    assert_true(zip_open(&zip, out, true));
    zip_add(&zip, "noise", bytes, SIZE);
    assert_int_equal(munmap(bytes, SIZE), 0);
    assert_false(zip_close(&zip));
    (void)fclose(out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_full_disk_ends_it),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
