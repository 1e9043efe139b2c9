/*
 * fault_shim.c - fault_shim.so: loaded before the C library (LD_PRELOAD) into a daemon under test,
 * it stands between the daemon, SQLite included, and the calls that change files, and makes some
 * fail or end the process, as fault.h says. It also shifts the wall clock. So the product itself
 * has no code for tests.
 *
 * A process that kills itself leaves what it has written in the page cache: this shows what the
 * order of writes promises to a process that dies, not what fsync promises to a machine that does.
 */
#include "support/fault.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define PATH_MAX_BYTES 4096

static struct fault_control *control;
static char folder[PATH_MAX_BYTES];

__attribute__((constructor)) static void load(void)
{
    const char *file = getenv("SRNFD_FAULT_CONTROL"), *directory = getenv("SRNFD_FAULT_DIR");
    int fd = file && directory ? open(file, O_RDWR | O_CLOEXEC) : -1;
    void *page;

    if (fd < 0) {
        return;
    }
    page = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    snprintf(folder, sizeof folder, "%s/", directory);
    control = page == MAP_FAILED ? NULL : page;
}

/* The real function of this name, as a pointer of the type of the one that stands in for it. */
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

/* ---- Which file? ----------------------------------------------------------------------------- */

/* The kind of file behind a path; 0 where it is none of the data directory's. */
static int classify(const char *path)
{
    static const struct {
        const char *start;
        int file;
    } names[] = {
        {"srnfd.db-wal", FAULT_LOG},  {"srnfd.db-shm", FAULT_INDEX}, {"srnfd.db", FAULT_DATABASE},
        {"blobs/tmp/", FAULT_STAGED}, {"blobs/", FAULT_BLOB},        {"", FAULT_OTHER},
    };
    size_t length = strlen(folder);

    if (strncmp(path, folder, length) != 0) {
        return strncmp(path, folder, length - 1) == 0 && !path[length - 1] ? FAULT_OTHER : 0;
    }
    for (size_t i = 0;; i++) {
        if (strncmp(path + length, names[i].start, strlen(names[i].start)) == 0) {
            return names[i].file;
        }
    }
}

static int file_of_fd(int fd)
{
    char link[64], path[PATH_MAX_BYTES];
    ssize_t n;

    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    n = readlink(link, path, sizeof path - 1);
    path[n > 0 ? n : 0] = '\0';
    return classify(path);
}

static int file_at(int at, const char *name)
{
    char link[64], path[PATH_MAX_BYTES];
    ssize_t n = 0;

    if (name[0] != '/') {
        snprintf(link, sizeof link, at == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", at);
        n = readlink(link, path, sizeof path - 2);
        n = n > 0 ? n : 0;
        path[n++] = '/';
    }
    snprintf(path + n, sizeof path - (size_t)n, "%s", name);
    return classify(path);
}

/* ---- Does it fail? --------------------------------------------------------------------------- */

static void die(void)
{
    kill(getpid(), SIGKILL);
    for (;;) {
        pause();
    }
}

/* What becomes of a call: 0 nothing, an errno, or one of enum fault_action. */
static int fate(int kind, int file)
{
    int64_t number, action;

    if (!control || !file || !(atomic_load(&control->kinds) & kind) ||
        !(atomic_load(&control->files) & file)) {
        return 0;
    }
    number = atomic_fetch_add(&control->calls, 1) + 1;
    if (number < atomic_load(&control->first) || number > atomic_load(&control->last)) {
        return 0;
    }
    action = atomic_load(&control->action);
    atomic_fetch_add(&control->hits, 1);
    if (action == FAULT_KILL_BEFORE || (action == FAULT_KILL_HALF && kind != FAULT_WRITE)) {
        die();
    }
    return (int)action;
}

/* Runs the call unless its fate is an error. The file is found out while errno is kept. */
#define GUARDED(type, kind, file, call) \
    do {                                \
        int kept = errno;               \
        int what = fate(kind, file);    \
        type answer;                    \
                                        \
        errno = kept;                   \
        if (what > 0) {                 \
            errno = what;               \
            return -1;                  \
        }                               \
        answer = (call);                \
        if (what == FAULT_KILL_AFTER) { \
            die();                      \
        }                               \
        return answer;                  \
    } while (0)

/* ---- The calls ------------------------------------------------------------------------------- */

static bool writes(int flags)
{
    return (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT);
}

#define OPEN(name, at, arguments, pass)                                                   \
    int name arguments                                                                    \
    {                                                                                     \
        va_list list;                                                                     \
        mode_t mode;                                                                      \
                                                                                          \
        va_start(list, flags);                                                            \
        mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(list, mode_t) : 0;                  \
        va_end(list);                                                                     \
        GUARDED(int, FAULT_OPEN, writes(flags) ? file_at(at, path) : 0, REAL(name) pass); \
    }
OPEN(open, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(open64, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(openat, at, (int at, const char *path, int flags, ...), (at, path, flags, mode))
OPEN(openat64, at, (int at, const char *path, int flags, ...), (at, path, flags, mode))

/* Half of a write, for a process that dies within it. */
#define HALF(what, size) ((what) == FAULT_KILL_HALF ? (size) / 2 : (size))

#define WRITE(name, arguments, pass)                                \
    ssize_t name arguments                                          \
    {                                                               \
        int kept = errno, what = fate(FAULT_WRITE, file_of_fd(fd)); \
        ssize_t answer;                                             \
                                                                    \
        errno = kept;                                               \
        if (what > 0) {                                             \
            errno = what;                                           \
            return -1;                                              \
        }                                                           \
        answer = REAL(name) pass;                                   \
        if (what < 0) {                                             \
            die();                                                  \
        }                                                           \
        return answer;                                              \
    }
WRITE(write, (int fd, const void *bytes, size_t size), (fd, bytes, HALF(what, size)))
WRITE(pwrite, (int fd, const void *bytes, size_t size, off_t at), (fd, bytes, HALF(what, size), at))
WRITE(pwrite64, (int fd, const void *bytes, size_t size, off64_t at),
      (fd, bytes, HALF(what, size), at))

#define SIMPLE(name, kind, file, arguments, pass)  \
    int name arguments                             \
    {                                              \
        GUARDED(int, kind, file, REAL(name) pass); \
    }
SIMPLE(fsync, FAULT_SYNC, file_of_fd(fd), (int fd), (fd))
SIMPLE(fdatasync, FAULT_SYNC, file_of_fd(fd), (int fd), (fd))
SIMPLE(ftruncate, FAULT_TRUNCATE, file_of_fd(fd), (int fd, off_t size), (fd, size))
SIMPLE(ftruncate64, FAULT_TRUNCATE, file_of_fd(fd), (int fd, off64_t size), (fd, size))
SIMPLE(rename, FAULT_RENAME, file_at(AT_FDCWD, to), (const char *from, const char *to), (from, to))
SIMPLE(renameat, FAULT_RENAME, file_at(t, to), (int f, const char *from, int t, const char *to),
       (f, from, t, to))
SIMPLE(mkdir, FAULT_MKDIR, file_at(AT_FDCWD, path), (const char *path, mode_t mode), (path, mode))
SIMPLE(mkdirat, FAULT_MKDIR, file_at(at, path), (int at, const char *path, mode_t mode),
       (at, path, mode))
SIMPLE(unlink, FAULT_UNLINK, file_at(AT_FDCWD, path), (const char *path), (path))
SIMPLE(unlinkat, FAULT_UNLINK, file_at(at, path), (int at, const char *path, int flags),
       (at, path, flags))
SIMPLE(link, FAULT_LINK, file_at(AT_FDCWD, to), (const char *from, const char *to), (from, to))
SIMPLE(linkat, FAULT_LINK, file_at(t, to), (int f, const char *from, int t, const char *to, int n),
       (f, from, t, to, n))

/* An error is returned here, not set. */
int posix_fallocate64(int fd, off64_t offset, off64_t size)
{
    int what = fate(FAULT_WRITE, file_of_fd(fd));

    return what > 0 ? what : REAL(posix_fallocate64)(fd, offset, size);
}

int posix_fallocate(int fd, off_t offset, off_t size)
{
    return posix_fallocate64(fd, offset, size);
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    int answer = REAL(clock_gettime)(clock, time);
    int64_t shift = control && clock == CLOCK_REALTIME ? atomic_load(&control->clock_ms) : 0;
    int64_t ns = time->tv_nsec + shift % 1000 * 1000000;

    if (answer == 0 && shift != 0) {
        time->tv_sec += shift / 1000 + (ns < 0 ? -1 : ns / 1000000000);
        time->tv_nsec = ns < 0 ? ns + 1000000000 : ns % 1000000000;
    }
    return answer;
}
