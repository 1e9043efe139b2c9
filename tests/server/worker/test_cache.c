/*
 * test_cache.c - what a worker keeps on its disk: it is read again, by other processes and after a
 * restart too; what is damaged counts as missing and is removed; the folder stays within its bound,
 * and those read longest ago go first; without a folder nothing is kept, and nothing fails.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "store/digest.h"
#include "support/scratch.h"
#include "worker/cache.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define SIZE ((size_t)1000)
#define FILES ((size_t)10) /* that the bound allows */

struct block {
    unsigned char bytes[SIZE];
    char digest[TASKS_DIGEST_SIZE];
    struct tasks_bytes content;
};

static void make_block(struct block *block, unsigned char number)
{
    memset(block->bytes, number, SIZE);
    block->content = (struct tasks_bytes){.bytes = block->bytes, .size = SIZE};
    store_sha256_hex(block->digest, block->bytes, SIZE);
}

static int setup(void **state)
{
    char *folder = malloc(SCRATCH_MAX);

    assert_true(scratch_make(folder, "cache"));
    *state = folder;
    return 0;
}

static int teardown(void **state)
{
    scratch_remove(*state);
    free(*state);
    return 0;
}

static bool has(struct cache *cache, const struct block *block)
{
    struct tasks_bytes found;
    bool there = cache_get(cache, block->digest, &found);

    if (there) {
        assert_int_equal(found.size, SIZE);
        assert_memory_equal(found.bytes, block->bytes, SIZE);
        free(found.bytes);
    } else {
        assert_null(found.bytes);
    }
    return there;
}

static size_t bytes_in(const char *folder, size_t *files)
{
    DIR *directory = opendir(folder);
    const struct dirent *entry;
    size_t total = 0;

    *files = 0;
    assert_non_null(directory);
    while ((entry = readdir(directory)) != NULL) {
        struct stat info;

        assert_int_equal(fstatat(dirfd(directory), entry->d_name, &info, AT_SYMLINK_NOFOLLOW), 0);
        if (S_ISREG(info.st_mode)) {
            total += (size_t)info.st_size;
            ++*files;
        }
    }
    closedir(directory);
    return total;
}

static void what_is_kept_is_read_again(void **state)
{
    struct cache *cache = cache_open(*state, FILES * SIZE), *other;
    struct block block, absent;

    make_block(&block, 1);
    make_block(&absent, 2);
    cache_put(cache, block.digest, &block.content);
    assert_true(has(cache, &block));
    assert_false(has(cache, &absent));
    other = cache_open(*state, FILES * SIZE);
    assert_true(has(other, &block));
    cache_close(other);
    cache_close(cache);
    cache = cache_open(*state, FILES * SIZE);
    assert_true(has(cache, &block));
    cache_close(cache);
}

/* Opens the file of a block for a change. */
static int open_file(const char *folder, const struct block *block, int flags)
{
    char path[SCRATCH_MAX + TASKS_DIGEST_SIZE + 2];
    int fd;

    (void)snprintf(path, sizeof path, "%s/%s", folder, block->digest);
    fd = open(path, flags);
    assert_true(fd >= 0);
    return fd;
}

static void what_is_damaged_is_missing(void **state)
{
    struct cache *cache = cache_open(*state, FILES * SIZE);
    struct block flipped, cut;
    size_t files;
    int fd;

    make_block(&flipped, 1);
    make_block(&cut, 2);
    cache_put(cache, flipped.digest, &flipped.content);
    cache_put(cache, cut.digest, &cut.content);
    fd = open_file(*state, &flipped, O_WRONLY);
    assert_int_equal(pwrite(fd, "x", 1, SIZE / 2), 1);
    close(fd);
    fd = open_file(*state, &cut, O_WRONLY);
    assert_int_equal(ftruncate(fd, SIZE - 1), 0);
    close(fd);
    assert_false(has(cache, &flipped));
    assert_false(has(cache, &cut));
    assert_int_equal(bytes_in(*state, &files), 0);
    cache_put(cache, flipped.digest, &flipped.content);
    assert_true(has(cache, &flipped));
    cache_close(cache);
}

/* Makes the file look as if it had been read so many seconds ago. */
static void age(const char *folder, const struct block *block, time_t seconds)
{
    const struct timespec times[2] = {{.tv_sec = time(NULL) - seconds},
                                      {.tv_sec = time(NULL) - seconds}};
    int fd = open_file(folder, block, O_RDONLY);

    assert_int_equal(futimens(fd, times), 0);
    close(fd);
}

static void it_stays_within_its_bound(void **state)
{
    struct cache *cache = cache_open(*state, FILES * SIZE);
    struct block blocks[FILES + 1];
    size_t files;

    for (size_t i = 0; i < FILES; i++) {
        make_block(&blocks[i], (unsigned char)i);
        cache_put(cache, blocks[i].digest, &blocks[i].content);
        age(*state, &blocks[i], (time_t)(1000 - i));
    }
    assert_int_equal(bytes_in(*state, &files), FILES * SIZE);
    assert_true(has(cache, &blocks[0])); /* the oldest has been read now */
    make_block(&blocks[FILES], 200);
    cache_put(cache, blocks[FILES].digest, &blocks[FILES].content);
    assert_true(bytes_in(*state, &files) <= FILES * SIZE - FILES * SIZE / 10);
    assert_true(has(cache, &blocks[0]));
    assert_false(has(cache, &blocks[1]));
    assert_true(has(cache, &blocks[FILES]));
    cache_close(cache);
    cache = cache_open(*state, 3 * SIZE); /* less than there is */
    assert_true(bytes_in(*state, &files) <= 3 * SIZE);
    assert_int_equal(files, 3);
    cache_close(cache);
}

static void what_cannot_be_kept_is_not(void **state)
{
    struct cache *cache = cache_open(*state, SIZE - 1);
    char path[SCRATCH_MAX + 20];
    struct block block;
    size_t files;

    make_block(&block, 1);
    cache_put(cache, block.digest, &block.content); /* larger than all */
    cache_put(cache, "../outside", &block.content);
    assert_false(has(cache, &block));
    assert_int_equal(bytes_in(*state, &files), 0);
    cache_close(cache);
    cache = cache_open(NULL, FILES * SIZE);
    cache_put(cache, block.digest, &block.content);
    assert_false(has(cache, &block));
    cache_close(cache);
    (void)snprintf(path, sizeof path, "%s/no/such/folder", (const char *)*state);
    cache = cache_open(path, FILES * SIZE);
    cache_put(cache, block.digest, &block.content);
    assert_false(has(cache, &block));
    cache_close(cache);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_kept_is_read_again, setup, teardown),
        cmocka_unit_test_setup_teardown(what_is_damaged_is_missing, setup, teardown),
        cmocka_unit_test_setup_teardown(it_stays_within_its_bound, setup, teardown),
        cmocka_unit_test_setup_teardown(what_cannot_be_kept_is_not, setup, teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
