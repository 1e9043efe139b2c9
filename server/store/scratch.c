/*
 * scratch.c - files of running jobs, for what memory has no room for.
 *
 *   DIR/scratch/JOB-ID
 *
 * A job writes and reads its own file at offsets of its own choice, from all its threads. The file
 * goes with the end of the job, after the transaction that ends it (job_state.c). Those of jobs
 * that a crash has left waiting are there for their next attempt; those of jobs that have ended are
 * swept at each start. The folder may be a link to another disk. Nothing is synced, and a backup
 * does without: what a power failure leaves unfinished has not the digests that its user knows, and
 * is computed again.
 *
 * A file that grows leaves LEAST free on the disk, or LEAST_PART of a small one, for what others
 * write: uploads and results go on where a large job fails. It is looked at each LOOK_BYTES.
 *
 * No locks: the first writers may open the file at the same moment, and one descriptor stays.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "store/internal.h"
#include "store/files.h"
#include "store/prepared.h"
#include "store/scratch.h"

#define FOLDER "scratch"
#define LEAST (UINT64_C(64) << 20)
#define LEAST_PART 16 /* of the file system */
#define LOOK_BYTES (UINT64_C(4) << 20)

struct store_scratch {
    struct store *store;
    int folder_fd;
    char name[STORE_ID_MAX];
    atomic_int fd;             /* -1: there is no file yet */
    _Atomic uint64_t unlooked; /* bytes written since the disk was looked at */
};

/* The folder, made if asked for; -1 with errno. */
static int open_folder(const struct store *store, bool make)
{
    int base = open(store->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int fd = -1, error = errno;

    if (base >= 0) {
        fd = make ? store_open_folder(base, FOLDER)
                  : openat(base, FOLDER, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        error = errno;
        close(base);
    }
    errno = error;
    return fd;
}

/* ---- One ------------------------------------------------------------------------------------- */

int store_scratch_open(struct store *store, const char *job, bool keep,
                       struct store_scratch **scratch, uint64_t *used)
{
    struct store_scratch *s = calloc(1, sizeof *s);
    struct stat about;
    int status = STORE_NOMEM;

    *scratch = NULL;
    *used = 0;
    if (!s) {
        return status;
    }
    s->store = store;
    (void)snprintf(s->name, sizeof s->name, "%s", job);
    atomic_init(&s->fd, -1);
    atomic_init(&s->unlooked, LOOK_BYTES);
    s->folder_fd = open_folder(store, true);
    if (s->folder_fd < 0) {
        status = store_map_errno(errno);
        free(s);
        return status;
    }
    if (!keep) {
        (void)unlinkat(s->folder_fd, s->name, 0);
    } else if (fstatat(s->folder_fd, s->name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
               S_ISREG(about.st_mode)) {
        *used = (uint64_t)about.st_size;
    }
    *scratch = s;
    return STORE_OK;
}

void store_scratch_close(struct store_scratch *scratch)
{
    if (scratch) {
        if (atomic_load(&scratch->fd) >= 0) {
            close(atomic_load(&scratch->fd));
        }
        close(scratch->folder_fd);
        free(scratch);
    }
}

/* The descriptor, of a file that is made if it is not there; -1 with errno. */
static int descriptor(struct store_scratch *scratch)
{
    int fd = atomic_load(&scratch->fd), none = -1;

    if (fd >= 0) {
        return fd;
    }
    fd = openat(scratch->folder_fd, scratch->name, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd >= 0 && !atomic_compare_exchange_strong(&scratch->fd, &none, fd)) {
        close(fd);
        fd = none; /* that of another thread */
    }
    return fd;
}

/* missing: bytes that should be free and are not. */
static bool has_room(struct store_scratch *scratch, size_t size, int64_t *missing)
{
    uint64_t unlooked = atomic_fetch_add(&scratch->unlooked, size) + size, free_bytes, least;
    struct statvfs info;

    if (unlooked < LOOK_BYTES || fstatvfs(scratch->folder_fd, &info) != 0) {
        return true;
    }
    free_bytes = (uint64_t)info.f_bavail * info.f_frsize;
    least = (uint64_t)info.f_blocks * info.f_frsize / LEAST_PART;
    least = least < LEAST ? least : LEAST;
    if (free_bytes < least + size) {
        *missing = (int64_t)(least + size);
        return false; /* and so is the next, which looks again */
    }
    atomic_store(&scratch->unlooked, 0);
    return true;
}

static int write_all(struct store_scratch *scratch, uint64_t offset, const void *bytes, size_t size)
{
    const unsigned char *from = bytes;
    int fd = descriptor(scratch);

    if (fd < 0) {
        return store_map_errno(errno);
    }
    while (size > 0) {
        ssize_t n = pwrite(fd, from, size, (off_t)offset);

        if (n < 0 && errno != EINTR) {
            return store_map_errno(errno);
        }
        if (n > 0) {
            from += n;
            offset += (uint64_t)n;
            size -= (size_t)n;
        }
    }
    return STORE_OK;
}

int store_scratch_write(struct store_scratch *scratch, uint64_t offset, const void *bytes,
                        size_t size)
{
    int64_t missing = 0;
    int status;

    /* Prepared meshes give way, where they are on the same disk. */
    if (!has_room(scratch, size, &missing) &&
        !(store_prepared_give_way(scratch->store, missing) && has_room(scratch, 0, &missing))) {
        return STORE_FULL;
    }
    status = write_all(scratch, offset, bytes, size);
    if (status == STORE_FULL && store_prepared_give_way(scratch->store, (int64_t)size)) {
        status = write_all(scratch, offset, bytes, size);
    }
    return status;
}

int store_scratch_read(struct store_scratch *scratch, uint64_t offset, void *bytes, size_t size)
{
    unsigned char *to = bytes;
    int fd = descriptor(scratch);

    if (fd < 0) {
        return store_map_errno(errno);
    }
    while (size > 0) {
        ssize_t n = pread(fd, to, size, (off_t)offset);

        if (n == 0) {
            return STORE_CORRUPT;
        }
        if (n < 0 && errno != EINTR) {
            return store_map_errno(errno);
        }
        if (n > 0) {
            to += n;
            offset += (uint64_t)n;
            size -= (size_t)n;
        }
    }
    return STORE_OK;
}

/* ---- All of them ----------------------------------------------------------------------------- */

void store_scratch_remove(struct store *store, const char *job)
{
    int folder = open_folder(store, false);

    if (folder >= 0) {
        (void)unlinkat(folder, job, 0);
        close(folder);
    }
}

/* Whether the job is still to run, or runs; true where that is not known. */
static bool is_wanted(sqlite3 *db, const char *job)
{
    char found[STORE_ID_MAX];

    return store_text(db, found, sizeof found,
                      "SELECT id FROM job WHERE id = ? AND status IN ('accepted', 'running')",
                      job) != STORE_NOT_FOUND;
}

static void walk(const struct store *store,
                 void (*visit)(void *user, int folder_fd, const char *name), void *user)
{
    int fd = open_folder(store, false);
    DIR *folder = fd < 0 ? NULL : fdopendir(fd);

    if (!folder) {
        if (fd >= 0) {
            close(fd);
        }
        return;
    }
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] != '.') {
            visit(user, dirfd(folder), entry->d_name);
        }
    }
    closedir(folder);
}

/* Others than of jobs stay: the folder may be a link to a disk that has more. */
static void sweep_one(void *user, int folder_fd, const char *name)
{
    if (strncmp(name, "job-", 4) == 0 && (strlen(name) >= STORE_ID_MAX || !is_wanted(user, name))) {
        (void)unlinkat(folder_fd, name, 0);
    }
}

int store_scratch_sweep(struct store *store)
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    if (status == STORE_OK) {
        walk(store, sweep_one, reader->db);
        store_reader_return(store, reader);
    }
    return status;
}
