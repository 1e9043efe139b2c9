/*
 * What large blocks take goes back to the system: checkpoints of a large group, which grow from one
 * to the next, left holes behind that nothing fitted.
 *
 * srnfd-test: no-asan (its allocator is another one; api/test_standard.sh runs its code)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "jobs/memory.h"

#define BLOCKS ((size_t)100)
#define LARGE ((size_t)600000) /* bytes */
#define SMALL ((size_t)20000)
#define MIB ((size_t)1 << 20)

static size_t resident(void)
{
    unsigned long all = 0, pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");

    assert_non_null(file);
    assert_int_equal(fscanf(file, "%lu %lu", &all, &pages), 2);
    (void)fclose(file);
    return pages * (size_t)sysconf(_SC_PAGESIZE);
}

/* Blocks as checkpoints are, each larger than the one before, and a small one after each that
   stays. */
static void freed_blocks_go_back(void **state)
{
    unsigned char *large[BLOCKS], *small[BLOCKS];
    size_t before, held, after;

    (void)state;
    free(calloc(4, MIB)); /* by itself, the C library would take no pages for smaller ones now */
    before = resident();
    for (size_t i = 0; i < BLOCKS; i++) {
        large[i] = malloc(LARGE + 128 * i);
        small[i] = malloc(SMALL);
        assert_non_null(large[i]);
        assert_non_null(small[i]);
        memset(large[i], 1, LARGE + 128 * i);
        memset(small[i], 1, SMALL);
    }
    held = resident();
    for (size_t i = 0; i < BLOCKS; i++) {
        free(large[i]);
    }
    after = resident();
    printf("# %zu KiB, then %zu\n", (held - before) / 1024, (after - before) / 1024);
    assert_true(held - before > BLOCKS * LARGE / 2);
    assert_true(after < before + BLOCKS * LARGE / 10);
    for (size_t i = 0; i < BLOCKS; i++) {
        free(small[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(freed_blocks_go_back),
    };

    jobs_memory_prepare();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
