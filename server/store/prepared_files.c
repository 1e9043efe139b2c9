/*
 * prepared_files.c - all files of prepared meshes (prepared.c): which go, and which are waste.
 */
#include "store/prepared_files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "store/prepared.h"

bool prepared_has_meshes(sqlite3 *db, const char *name)
{
    bool has = true;

    for (; has && prepared_is_id(name);
         name += PREPARED_ID_LENGTH + (name[PREPARED_ID_LENGTH] == '-')) {
        char id[STORE_ID_MAX], found[STORE_ID_MAX];

        (void)snprintf(id, sizeof id, "%.*s", PREPARED_ID_LENGTH, name);
        has = store_text(db, found, sizeof found, "SELECT id FROM mesh WHERE id = ?", id) !=
              STORE_NOT_FOUND;
    }
    return has;
}

/* ---- All files ------------------------------------------------------------------------------- */

void prepared_walk_folder(int at, const char *folder, prepared_visit *visit, void *user)
{
    int fd = openat(at, folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    DIR *entries = fd < 0 ? NULL : fdopendir(fd);

    if (!entries) {
        if (fd >= 0) {
            close(fd);
        }
        return;
    }
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        if (entry->d_name[0] != '.') {
            visit(user, dirfd(entries), folder, entry->d_name);
        }
    }
    closedir(entries);
}

static void walk_all(int at, prepared_visit *visit, void *user)
{
    static const char digits[] = "0123456789abcdef";

    for (size_t i = 0; i < 256; i++) {
        const char folder[3] = {digits[i / 16], digits[i % 16], '\0'};

        prepared_walk_folder(at, folder, visit, user);
    }
    prepared_walk_folder(at, PREPARED_PAIRS, visit, user);
}

bool prepared_remove(struct store *store, int folder_fd, const char *name)
{
    struct stat about;
    bool removed = fstatat(folder_fd, name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
                   unlinkat(folder_fd, name, 0) == 0;

    if (removed) {
        atomic_fetch_sub(&store->prepared.total, prepared_taken((int64_t)about.st_size));
    }
    return removed;
}

struct file {
    char path[PREPARED_PATH];
    int64_t taken, used_ns;
};

struct files {
    struct file *list;
    size_t count, capacity;
    int64_t total;
};

static void list_file(void *user, int folder_fd, const char *folder, const char *name)
{
    struct files *files = user;
    struct stat about;
    struct file *file;

    if (fstatat(folder_fd, name, &about, AT_SYMLINK_NOFOLLOW) != 0) {
        return;
    }
    if (files->count == files->capacity) {
        size_t capacity = files->capacity ? 2 * files->capacity : 256;
        struct file *list = realloc(files->list, capacity * sizeof *list);

        if (!list) {
            return;
        }
        files->list = list;
        files->capacity = capacity;
    }
    file = &files->list[files->count++];
    *file = (struct file){.taken = prepared_taken((int64_t)about.st_size),
                          .used_ns =
                              (int64_t)about.st_mtim.tv_sec * 1000000000 + about.st_mtim.tv_nsec};
    (void)snprintf(file->path, sizeof file->path, "%s/%.250s", folder, name);
    files->total += file->taken;
}

static int compare_used(const void *a, const void *b)
{
    const struct file *x = a, *y = b;

    return x->used_ns != y->used_ns ? (x->used_ns > y->used_ns) - (x->used_ns < y->used_ns)
                                    : strcmp(x->path, y->path);
}

/* Removes the oldest: of what is more than limit and a tenth beyond, and excess bytes in any case.
   Returns whether one went. The mutex is held. */
static bool remove_oldest(struct store_prepared *prepared, int64_t limit, int64_t excess)
{
    struct files files = {.list = NULL};
    int64_t most;
    bool removed = false;

    walk_all(prepared->fd, list_file, &files);
    most = files.total > limit ? limit - limit / 10 : files.total;
    most = files.total - excess < most ? files.total - excess : most;
    if (files.total > most && files.count > 0) {
        qsort(files.list, files.count, sizeof *files.list, compare_used);
    }
    for (size_t i = 0; i < files.count && files.total > most; i++) {
        if (unlinkat(prepared->fd, files.list[i].path, 0) == 0) {
            files.total -= files.list[i].taken;
            removed = true;
        }
    }
    atomic_store(&prepared->total, files.total);
    free(files.list);
    return removed;
}

void prepared_evict(struct store *store)
{
    struct store_prepared *prepared = &store->prepared;

    if (pthread_mutex_trylock(&prepared->evicting) == 0) {
        (void)remove_oldest(prepared, atomic_load(&prepared->limit), 0);
        pthread_mutex_unlock(&prepared->evicting);
    }
}

/* Bytes that are free on the disk beyond what is to be left; below 0: too few. */
static int64_t spare(struct store *store)
{
    int64_t least = atomic_load(&store->prepared.least_free);
    int64_t pages = STORE_PAGE_SIZE * (int64_t)store_reserve_pages(store);
    struct statvfs info;

    if (statvfs(store->directory, &info) != 0 || info.f_bavail > INT64_MAX / info.f_frsize) {
        return INT64_MAX;
    }
    return (int64_t)(info.f_bavail * info.f_frsize) - (least > pages ? least : pages);
}

bool store_prepared_give_way(struct store *store, int64_t bytes)
{
    struct store_prepared *prepared = &store->prepared;
    int64_t excess;
    bool removed = false;

    /* Until there is a limit the folder is not open, and another thread may be opening it. */
    if (atomic_load(&prepared->limit) <= 0 || atomic_load(&prepared->total) <= 0 ||
        spare(store) >= bytes) {
        return false;
    }
    pthread_mutex_lock(&prepared->evicting);
    excess = bytes - spare(store); /* another may have seen to it */
    if (excess > 0) {
        removed = remove_oldest(prepared, INT64_MAX, excess);
    }
    pthread_mutex_unlock(&prepared->evicting);
    return removed || excess <= 0;
}

bool prepared_fits(struct store *store, int64_t taken)
{
    return spare(store) >= taken;
}

/* ---- Those that nobody needs ----------------------------------------------------------------- */

struct sweeping {
    struct store *store;
    sqlite3 *db;
    size_t removed;
};

static void sweep_file(void *user, int folder_fd, const char *folder, const char *name)
{
    struct sweeping *sweeping = user;

    (void)folder;
    if (!prepared_is_id(name) || !prepared_has_meshes(sweeping->db, name)) {
        sweeping->removed += prepared_remove(sweeping->store, folder_fd, name);
    }
}

int store_prepared_sweep(struct store *store, size_t *removed)
{
    struct sweeping sweeping = {.store = store};
    struct store_reader *reader = NULL;
    int status = store->prepared.fd < 0 ? STORE_OK : store_reader_take(store, &reader);

    if (reader) {
        sweeping.db = reader->db;
        walk_all(store->prepared.fd, sweep_file, &sweeping);
        store_reader_return(store, reader);
    }
    *removed += sweeping.removed;
    return status;
}

/* ---- From outside the daemon ----------------------------------------------------------------- */

struct verifying {
    sqlite3 *db;
    void (*found)(void *user, const char *path, int folder_fd, const char *name);
    void *user;
};

static void verify_file(void *user, int folder_fd, const char *folder, const char *name)
{
    const struct verifying *verifying = user;
    int fd = openat(folder_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    unsigned char *bytes = NULL;
    char path[PREPARED_PATH];
    size_t size;
    int status = fd < 0 ? STORE_NOT_FOUND : prepared_read(fd, name, &bytes, &size);

    free(bytes);
    if (fd >= 0) {
        close(fd);
    }
    if (status == STORE_CORRUPT || !prepared_is_id(name) ||
        !prepared_has_meshes(verifying->db, name)) {
        (void)snprintf(path, sizeof path, PREPARED_FOLDER "/%s/%.250s", folder, name);
        verifying->found(verifying->user, path, folder_fd, name);
    }
}

void store_prepared_verify(const char *directory, sqlite3 *db,
                           void (*found)(void *user, const char *path, int folder_fd,
                                         const char *name),
                           void *user)
{
    struct verifying verifying = {.db = db, .found = found, .user = user};
    int base = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int fd = base < 0 ? -1 : openat(base, PREPARED_FOLDER, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    if (fd >= 0) {
        walk_all(fd, verify_file, &verifying);
        close(fd);
    }
    if (base >= 0) {
        close(base);
    }
}
