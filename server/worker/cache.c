/*
 * cache.c - a folder of files that are named by the SHA-256 of what they hold. Several workers may
 * share it: files come by renaming, and whoever reads one verifies it. When a file takes the folder
 * beyond its bound, those not read for longest go, down to nine tenths of it. A full disk, or a
 * folder that cannot be written, costs requests and nothing else.
 *
 * Lock: mutex guards the total; held while the folder is cleared.
 */
#include "worker/cache.h"

#include "store/digest.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define DIGITS ((size_t)64)

struct cache {
    int fd; /* of the folder; -1: nothing is kept */
    size_t most, total;
    atomic_uint number; /* of temporary files */
    pthread_mutex_t mutex;
};

struct kept {
    char name[TASKS_DIGEST_SIZE];
    size_t size;
    struct timespec read;
};

static bool is_name(const char *name)
{
    return strlen(name) == DIGITS && strspn(name, "0123456789abcdef") == DIGITS;
}

/* The files (malloc) and how many; NULL where there are none. */
static struct kept *list(const struct cache *cache, size_t *count)
{
    int fd = openat(cache->fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = fd >= 0 ? fdopendir(fd) : NULL;
    struct kept *files = NULL;
    const struct dirent *entry;

    *count = 0;
    while (folder && (entry = readdir(folder)) != NULL) {
        struct kept *grown;
        struct stat info;

        if (!is_name(entry->d_name) || fstatat(fd, entry->d_name, &info, AT_SYMLINK_NOFOLLOW)) {
            continue;
        }
        grown = realloc(files, (*count + 1) * sizeof *files);
        if (!grown) {
            break;
        }
        files = grown;
        files[*count].size = (size_t)info.st_size;
        files[*count].read = info.st_mtim;
        memcpy(files[(*count)++].name, entry->d_name, TASKS_DIGEST_SIZE);
    }
    if (folder) {
        (void)closedir(folder);
    } else if (fd >= 0) {
        (void)close(fd);
    }
    return files;
}

static int by_age(const void *a, const void *b)
{
    const struct timespec *x = &((const struct kept *)a)->read;
    const struct timespec *y = &((const struct kept *)b)->read;

    if (x->tv_sec != y->tv_sec) {
        return x->tv_sec < y->tv_sec ? -1 : 1;
    }
    return (x->tv_nsec > y->tv_nsec) - (x->tv_nsec < y->tv_nsec);
}

/* Counts the files, and removes the oldest ones where they take more than `most`. The mutex is
   held. */
static void sweep(struct cache *cache, size_t most)
{
    size_t count, total = 0;
    struct kept *files = list(cache, &count);

    for (size_t i = 0; i < count; i++) {
        total += files[i].size;
    }
    if (count > 0) {
        qsort(files, count, sizeof *files, by_age);
    }
    for (size_t i = 0; i < count && total > most; i++) {
        if (unlinkat(cache->fd, files[i].name, 0) == 0) {
            total -= files[i].size;
        }
    }
    cache->total = total;
    free(files);
}

struct cache *cache_open(const char *directory, size_t bytes)
{
    struct cache *cache = calloc(1, sizeof *cache);

    if (!cache) {
        return NULL;
    }
    cache->fd = -1;
    cache->most = bytes;
    (void)pthread_mutex_init(&cache->mutex, NULL);
    if (directory && (mkdir(directory, 0700) == 0 || errno == EEXIST)) {
        cache->fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    }
    if (cache->fd >= 0) {
        (void)pthread_mutex_lock(&cache->mutex);
        sweep(cache, cache->most);
        (void)pthread_mutex_unlock(&cache->mutex);
    }
    return cache;
}

void cache_close(struct cache *cache)
{
    if (cache) {
        if (cache->fd >= 0) {
            (void)close(cache->fd);
        }
        (void)pthread_mutex_destroy(&cache->mutex);
        free(cache);
    }
}

bool cache_fits(const char *digest, const struct tasks_bytes *content)
{
    char own[TASKS_DIGEST_SIZE];

    store_sha256_hex(own, content->bytes, content->size);
    return strcmp(own, digest) == 0;
}

static bool read_all(int fd, struct tasks_bytes *content)
{
    size_t done = 0;

    while (done < content->size) {
        ssize_t n = read(fd, content->bytes + done, content->size - done);

        if (n == 0 || (n < 0 && errno != EINTR)) {
            return false;
        }
        done += n > 0 ? (size_t)n : 0;
    }
    return true;
}

bool cache_get(struct cache *cache, const char *digest, struct tasks_bytes *content)
{
    int fd = cache->fd >= 0 && is_name(digest)
                 ? openat(cache->fd, digest, O_RDONLY | O_NOFOLLOW | O_CLOEXEC)
                 : -1;
    struct stat info;
    bool good = false;

    *content = (struct tasks_bytes){.bytes = NULL};
    if (fd < 0) {
        return false;
    }
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_size > 0 &&
        (size_t)info.st_size <= cache->most) {
        content->size = (size_t)info.st_size;
        content->bytes = malloc(content->size);
        good = content->bytes && read_all(fd, content) && cache_fits(digest, content);
    }
    if (good) {
        (void)futimens(fd, NULL); /* it was read now */
    } else {
        (void)unlinkat(cache->fd, digest, 0);
        free(content->bytes);
        *content = (struct tasks_bytes){.bytes = NULL};
    }
    (void)close(fd);
    return good;
}

static bool write_all(int fd, const struct tasks_bytes *content)
{
    size_t done = 0;

    while (done < content->size) {
        ssize_t n = write(fd, content->bytes + done, content->size - done);

        if (n < 0 && errno != EINTR) {
            return false;
        }
        done += n > 0 ? (size_t)n : 0;
    }
    return true;
}

void cache_put(struct cache *cache, const char *digest, const struct tasks_bytes *content)
{
    char temporary[64];
    bool kept;
    int fd;

    if (cache->fd < 0 || !is_name(digest) || content->size == 0 || content->size > cache->most) {
        return;
    }
    (void)snprintf(temporary, sizeof temporary, ".new-%ld-%u", (long)getpid(),
                   atomic_fetch_add(&cache->number, 1));
    fd = openat(cache->fd, temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0) {
        return;
    }
    kept = write_all(fd, content);
    kept = close(fd) == 0 && kept && renameat(cache->fd, temporary, cache->fd, digest) == 0;
    if (!kept) {
        (void)unlinkat(cache->fd, temporary, 0);
        return;
    }
    (void)pthread_mutex_lock(&cache->mutex);
    cache->total += content->size;
    if (cache->total > cache->most) {
        sweep(cache, cache->most - cache->most / 10);
    }
    (void)pthread_mutex_unlock(&cache->mutex);
}
