/*
 * What large blocks take goes back to the system: checkpoints of a large group, which grow from one
 * to the next, left holes behind that nothing fitted. But a job's next block of that size has the
 * pages of the last one.
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
#include <sys/resource.h>
#include <unistd.h>

#include "jobs/memory.h"
#include "srnf.h"

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

static long faults(void)
{
    struct rusage usage;

    assert_int_equal(getrusage(RUSAGE_THREAD, &usage), 0);
    return usage.ru_minflt;
}

static bool is_zero(const unsigned char *block, size_t bytes)
{
    return block[0] == 0 && memcmp(block, block + 1, bytes - 1) == 0;
}

/* Of sizes that go up and down a little, as the workspaces of registrations do. */
static void a_jobs_next_block_has_its_pages(void **state)
{
    struct jobs_memory memory = {0};
    long before;

    (void)state;
    jobs_memory_begin(&memory, 64 * MIB);
    (void)jobs_memory_enter(&memory);
    before = faults();
    for (size_t i = 0; i < BLOCKS; i++) {
        size_t bytes = LARGE + 1000 * (i * 7 % 10);
        unsigned char *one = srnf_alloc(bytes, 1), *other = srnf_alloc(4 * bytes, 1);

        assert_non_null(one);
        assert_non_null(other);
        assert_true(is_zero(one, bytes) && is_zero(other, 4 * bytes));
        memset(one, 1, bytes);
        memset(other, 1, 4 * bytes);
        assert_in_range(atomic_load(&memory.used), 5 * bytes, 5 * bytes + 1000);
        srnf_free(one);
        srnf_free(other);
        assert_int_equal(atomic_load(&memory.used), 0);
    }
    printf("# %ld faults\n", faults() - before);
    assert_true(faults() - before < (long)(5 * LARGE / 4096 * BLOCKS / 10));
    (void)jobs_memory_enter(NULL);
}

/* What a thread has for the next block is bounded, and goes with the job. */
static void pages_go_back_with_the_job(void **state)
{
    struct jobs_memory memory = {0};
    size_t before = resident(), kept, after;
    void *blocks[BLOCKS];

    (void)state;
    jobs_memory_begin(&memory, 256 * MIB);
    (void)jobs_memory_enter(&memory);
    for (size_t i = 0; i < BLOCKS; i++) {
        blocks[i] = srnf_alloc(LARGE + 100000 * (i % 20), 1);
        assert_non_null(blocks[i]);
    }
    for (size_t i = 0; i < BLOCKS; i++) {
        srnf_free(blocks[i]);
    }
    kept = resident();
    (void)jobs_memory_enter(NULL);
    after = resident();
    printf("# %zu KiB, then %zu\n", (kept - before) / 1024, (after - before) / 1024);
    assert_true(kept < before + 18 * MIB);
    assert_true(after < before + MIB);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(freed_blocks_go_back),
        cmocka_unit_test(a_jobs_next_block_has_its_pages),
        cmocka_unit_test(pages_go_back_with_the_job),
    };

    jobs_memory_prepare();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
