/*
 * reserve.c - room kept for the writes that make room.
 *
 * On a disk that is full even a deletion needs a few pages of the log. So the data directory holds
 * a file that has no other use, of 1/32 of the file system, 8 MB at most. When a write that frees
 * (a deletion, a cancellation, a job that ends without results) finds no room, the file is
 * removed, the log is copied into the database, which lets it begin anew where it stands, and the
 * write is done again. From then on every write that does not free is refused with STORE_FULL, so
 * that what was let go serves deletions alone, until there is room for the file again: that is
 * tried every RETRY_MS, and nobody needs to restart the daemon. Before any of this, prepared meshes
 * give way, a cache (prepared.c): when a write finds no room, and, looked at every RETRY_MS, where
 * less is free than the reserve has or the service is to keep free.
 *
 * The room is for the pages by which that copy makes the database longer: no more than the log has,
 * which is copied whenever it has grown by what the reserve has (writer.c). After it, deletions
 * need none: they rewrite pages that are there, in the log and in the database. A copy for which
 * there is no room, since one write alone was larger, is not begun: it would use up what there is
 * and end nothing, and what there is lets deletions go on at the end of the log.
 *
 * Threads: the file belongs to the writer thread (before it starts, to whoever opens the store);
 * the status is read by all.
 */
#include "store/internal.h"
#include "store/files.h"
#include "store/prepared.h"

#include "store/store.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#define RESERVE_MAX (8 * 1024 * 1024)
#define RESERVE_PART 32           /* of the file system */
#define RESERVE_LEAST (64 * 1024) /* enough for a start */
#define RETRY_MS 500

static int64_t monotonic_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* The data directory, or -1. */
static int open_directory(const struct store *store)
{
    return open(store->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

static off_t size_of_reserve(int fd)
{
    struct statvfs info;
    uint64_t size = RESERVE_MAX;

    if (fstatvfs(fd, &info) == 0 && info.f_blocks < UINT64_MAX / info.f_frsize) {
        size = (uint64_t)info.f_blocks * info.f_frsize / RESERVE_PART;
    }
    return size == 0 ? 4096 : size < RESERVE_MAX ? (off_t)size : RESERVE_MAX;
}

/* least: the smallest size that will do. */
static int take(int directory, off_t least)
{
    int fd = openat(directory, STORE_RESERVE_NAME, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    int error = fd < 0 ? errno : posix_fallocate(fd, 0, size_of_reserve(fd));

    for (off_t size = RESERVE_MAX; error == ENOSPC && size >= least; size /= 2) {
        error = posix_fallocate(fd, 0, size);
    }
    if (fd >= 0) {
        close(fd);
    }
    if (error != 0) {
        (void)unlinkat(directory, STORE_RESERVE_NAME, 0);
        return store_map_errno(error);
    }
    return STORE_OK;
}

void store_reserve_take(struct store *store)
{
    int64_t now = monotonic_ms();
    int directory;

    if (now - store->reserve_tried_ms < RETRY_MS) {
        return;
    }
    store->reserve_tried_ms = now;
    (void)store_prepared_give_way(store, 0);
    if (atomic_load(&store->reserve) == STORE_OK) {
        return;
    }
    directory = open_directory(store);
    if (directory >= 0) {
        atomic_store(&store->reserve, take(directory, INT64_MAX));
        close(directory);
    }
}

void store_reserve_leave(const struct store *store)
{
    int directory = open_directory(store);

    if (directory >= 0) {
        (void)take(directory, RESERVE_LEAST);
        close(directory);
    }
}

bool store_reserve_release(struct store *store)
{
    int directory = open_directory(store);
    bool released = directory >= 0 && unlinkat(directory, STORE_RESERVE_NAME, 0) == 0;

    if (directory >= 0) {
        close(directory);
    }
    if (released) {
        atomic_store(&store->reserve, STORE_FULL);
        store->reserve_tried_ms = monotonic_ms();
    }
    return released;
}

int store_reserve_pages(const struct store *store)
{
    int directory = open_directory(store);
    off_t size = directory >= 0 ? size_of_reserve(directory) : RESERVE_MAX;

    if (directory >= 0) {
        close(directory);
    }
    return (int)(size / STORE_PAGE_SIZE);
}

bool store_reserve_copies(const struct store *store, sqlite3 *db)
{
    int64_t pages = 0, page_size = 0;
    struct statvfs info;
    struct stat file;

    if (store_scalar(db, &pages, "PRAGMA page_count") != STORE_OK ||
        store_scalar(db, &page_size, "PRAGMA page_size") != STORE_OK ||
        stat(store->database, &file) != 0 || statvfs(store->directory, &info) != 0 ||
        pages * page_size <= file.st_size) {
        return true;
    }
    return (uint64_t)(pages * page_size - file.st_size) / info.f_frsize < info.f_bavail;
}

int store_room(const struct store *store)
{
    return atomic_load(&store->reserve);
}
