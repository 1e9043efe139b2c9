/*
 * test_full_cache.c - prepared meshes give way on a disk that is full: to content, to rows and to
 * scratch, those that were not read for longest first; and they leave free what the service keeps.
 * On a file system of 48 MB that only a process of its own sees. Skipped without the right to mount
 * one.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <time.h>

#include "server/store/fixture.h"
#include "store/prepared.h"
#include "store/scratch.h"
#include "support/small_disk.h"

#define CANNOT_MOUNT 77
#define MIB ((int64_t)1 << 20)
#define FILES 60
#define SIZE ((size_t)500000) /* of each */

static struct store *store;
static char mesh[STORE_ID_MAX];

static int put(int number)
{
    char made[24];
    const struct store_prepared_key key = {mesh, "", made};
    unsigned char *value = fixture_bytes(SIZE, (unsigned)number);
    const struct store_part part = {value, SIZE};
    int status;

    (void)snprintf(made, sizeof made, "%d", number);
    status = store_prepared_put(store, &key, &part, 1);
    free(value);
    return status;
}

static bool is_kept(int number)
{
    char made[24];
    const struct store_prepared_key key = {mesh, "", made};
    unsigned char *value;
    size_t size;
    int status;

    (void)snprintf(made, sizeof made, "%d", number);
    status = store_prepared_get(store, &key, &value, &size);
    free(value);
    return status == STORE_OK;
}

static int64_t free_bytes(const char *path)
{
    struct statvfs info;

    return statvfs(path, &info) == 0 ? (int64_t)(info.f_bavail * info.f_frsize) : -1;
}

/* Fills the disk but for so many bytes. */
static void fill(const char *path, int64_t left)
{
    char ballast[512];
    int fd;

    (void)snprintf(ballast, sizeof ballast, "%s/ballast", path);
    fd = open(ballast, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    (void)posix_fallocate(fd, 0, lseek(fd, 0, SEEK_END) + free_bytes(path) - left);
    close(fd);
}

static int begin(const char *path, int64_t least_free)
{
    const struct timespec step = {.tv_nsec = 5000000}; /* the clock of files is coarse */
    char message[256];
    bool created;

    if (!small_disk_mount(path, "size=48m")) {
        return CANNOT_MOUNT;
    }
    if (store_open(&store, path, message, sizeof message) != STORE_OK ||
        fixture_put_mesh(store, (const unsigned char *)"mesh", 4, mesh, &created) != STORE_OK) {
        return 1;
    }
    store_prepared_limit(store, 40 * MIB, least_free);
    for (int i = 0; i < FILES; i++) {
        if (put(i) != STORE_OK) {
            return 2;
        }
        nanosleep(&step, NULL);
    }
    return is_kept(0) && is_kept(FILES - 1) ? 0 : 3;
}

/* Content in a file of its own. */
static int content_is_stored(const char *path)
{
    unsigned char *bytes = fixture_bytes(3 * MIB, 5);
    char id[STORE_ID_MAX];
    bool created;
    int status = begin(path, 0);

    if (status != 0) {
        return status;
    }
    fill(path, 0);
    if (fixture_put_mesh(store, bytes, 3 * MIB, id, &created) != STORE_OK) {
        return 4;
    }
    /* Number 0 was read last; those after it not at all. */
    return !is_kept(1) && is_kept(FILES - 1) && is_kept(0) ? 0 : 5;
}

/* Content in rows: 12 MB of it, which the log takes in and the database. */
static int rows_are_stored(const char *path)
{
    unsigned char *bytes = fixture_bytes(60000, 5);
    char id[STORE_ID_MAX];
    bool created;
    int status = begin(path, 0);

    if (status != 0) {
        return status;
    }
    fill(path, 0);
    for (unsigned i = 0; i < 200; i++) {
        memcpy(bytes, &i, sizeof i);
        if (fixture_put_mesh(store, bytes, 60000, id, &created) != STORE_OK) {
            return 4;
        }
    }
    return !is_kept(1) && is_kept(FILES - 1) ? 0 : 5;
}

static int scratch_is_written(const char *path)
{
    unsigned char *bytes = fixture_bytes(MIB, 5);
    struct store_scratch *scratch;
    uint64_t used;
    int status = begin(path, 0);

    if (status != 0) {
        return status;
    }
    fill(path, 0);
    if (store_scratch_open(store, "job-1", false, &scratch, &used) != STORE_OK) {
        return 4;
    }
    for (uint64_t i = 0; i < 10; i++) {
        if (store_scratch_write(scratch, i * MIB, bytes, MIB) != STORE_OK) {
            return 5;
        }
    }
    store_scratch_close(scratch);
    return !is_kept(1) && is_kept(FILES - 1) ? 0 : 6;
}

/* Others fill the disk, and nothing fails: the next write finds so much free as is kept. */
static int so_much_is_left(const char *path)
{
    const struct timespec second = {.tv_sec = 1};
    char id[STORE_ID_MAX];
    bool created;
    int status = begin(path, 10 * MIB);

    if (status != 0) {
        return status;
    }
    fill(path, 4 * MIB);
    nanosleep(&second, NULL);
    if (fixture_put_mesh(store, (const unsigned char *)"other", 5, id, &created) != STORE_OK ||
        fixture_put_mesh(store, (const unsigned char *)"third", 5, id, &created) != STORE_OK) {
        return 4;
    }
    if (free_bytes(path) < 9 * MIB || is_kept(1) || !is_kept(FILES - 1)) {
        return 5;
    }
    /* And none is kept that would take of it. */
    for (int i = 0; i < 10; i++) {
        if (put(FILES + i) != STORE_OK) {
            return 6;
        }
    }
    return free_bytes(path) >= 9 * MIB && !is_kept(FILES + 9) && is_kept(FILES - 1) ? 0 : 7;
}

/* With nothing left that could go, the answer is what it was. */
static int in_the_end_it_is_full(const char *path)
{
    unsigned char *bytes = fixture_bytes(3 * MIB, 5);
    char id[STORE_ID_MAX];
    bool created;
    int status = begin(path, 0);

    for (unsigned i = 0; status == 0 && i < 20; i++) {
        memcpy(bytes, &i, sizeof i);
        status = fixture_put_mesh(store, bytes, 3 * MIB, id, &created);
    }
    return status == STORE_FULL && store_prepared_bytes(store) < 2 * MIB ? 0 : 4;
}

static void run(void **state, int (*body)(const char *path))
{
    const struct fixture *fixture = *state;
    int status;
    pid_t child = fork();

    assert_true(child >= 0);
    if (child == 0) {
        _exit(body(fixture->path));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == CANNOT_MOUNT) {
        print_message("# no right to mount a small file system\n");
        skip();
    }
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void it_gives_way_to_content(void **state)
{
    run(state, content_is_stored);
}

static void it_gives_way_to_rows(void **state)
{
    run(state, rows_are_stored);
}

static void it_gives_way_to_scratch(void **state)
{
    run(state, scratch_is_written);
}

static void it_leaves_free_what_is_kept(void **state)
{
    run(state, so_much_is_left);
}

static void a_disk_without_it_is_full(void **state)
{
    run(state, in_the_end_it_is_full);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup_closed, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(it_gives_way_to_content),   TEST(it_gives_way_to_rows),
        TEST(it_gives_way_to_scratch),   TEST(it_leaves_free_what_is_kept),
        TEST(a_disk_without_it_is_full),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
