/*
 * prepared.c - meshes as they were prepared at their upload or at first need, for the jobs after.
 *
 *   DIR/prepared/ab/MESH-DIGEST                a mesh whose id ends in ab
 *   DIR/prepared/pairs/MESH-SPHERE-DIGEST      a mesh with a sphere for it
 *   DIR/prepared/tmp/RANDOM                    one that is being written
 *
 * They are a cache of what follows from the blobs: what is missing or damaged is made again, and a
 * backup does without. So nothing is synced, and no row of the database names a file. A file is its
 * own digest (BLAKE2b, of its name and all that follows) and the value; it gets its name when it is
 * complete, and what is read is verified. DIGEST is of all else that decides the value: another
 * owner or numeric build has files of its own, and those of builds that have gone are never read.
 *
 * Reading a file sets its time. Those that were not read for longest go when all together take more
 * than the limit, a tenth of it at once. Each counts for whole pages of 4 KiB. They also go where
 * the disk has no room for a write (blob.c, scratch.c, writer.c, api/exports.c), until there is,
 * and where less is free than is to be left (reserve.c); and none is written that would take of
 * that.
 *
 * A file is removed with its mesh, after the row (store_mesh_drop_derived). Whoever writes one
 * looks for the row once the file has its name: so one of the two removes it. After a crash in
 * between the sweep does.
 *
 * Threads: any. Lock: prepared.evicting (rank 43): one thread evicts at a time. Others leave it to
 * that one, but who needs room waits for it. The total is that of the last look at all files and
 * what came and went since.
 */
#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "store/prepared.h"
#include "store/digest.h"
#include "store/prepared_files.h"
#include "store/files.h"

#define DIGEST_BYTES ((size_t)32)
#define PAGE INT64_C(4096)

/* ---- Names ----------------------------------------------------------------------------------- */

bool prepared_is_id(const char *text)
{
    return strncmp(text, "mesh-", 5) == 0 &&
           strspn(text + 5, "0123456789abcdef") >= PREPARED_ID_LENGTH - 5;
}

static void folder_of(const char *mesh, char folder[3])
{
    (void)snprintf(folder, 3, "%.2s", mesh + PREPARED_ID_LENGTH - 2);
}

/* False where the key names no meshes. */
static bool path_of(const struct store_prepared_key *key, char path[PREPARED_PATH])
{
    bool pair = key->sphere[0] != '\0';
    char hex[65], folder[3];

    if (!prepared_is_id(key->mesh) || strlen(key->mesh) != PREPARED_ID_LENGTH ||
        (pair && (!prepared_is_id(key->sphere) || strlen(key->sphere) != PREPARED_ID_LENGTH))) {
        return false;
    }
    folder_of(key->mesh, folder);
    store_sha256_hex(hex, key->made, strlen(key->made));
    (void)snprintf(path, PREPARED_PATH, "%s/%s%s%s-%.32s", pair ? PREPARED_PAIRS : folder,
                   key->mesh, pair ? "-" : "", key->sphere, hex);
    return true;
}

static const char *name_in(const char *path)
{
    return strchr(path, '/') + 1;
}

/* ---- Values ---------------------------------------------------------------------------------- */

int64_t prepared_taken(int64_t size)
{
    return (size + PAGE - 1) / PAGE * PAGE;
}

static void digest_of(const char *name, const struct store_part *parts, size_t n_parts,
                      unsigned char digest[DIGEST_BYTES])
{
    crypto_generichash_state state;

    (void)crypto_generichash_init(&state, NULL, 0, DIGEST_BYTES);
    (void)crypto_generichash_update(&state, (const unsigned char *)name, strlen(name) + 1);
    for (size_t i = 0; i < n_parts; i++) {
        (void)crypto_generichash_update(&state, parts[i].bytes, parts[i].size);
    }
    (void)crypto_generichash_final(&state, digest, DIGEST_BYTES);
}

int prepared_read(int fd, const char *name, unsigned char **bytes, size_t *size)
{
    unsigned char digest[DIGEST_BYTES];
    struct store_part value;
    struct stat about;
    size_t done = 0;
    ssize_t n = 1;

    *bytes = NULL;
    if (fstat(fd, &about) != 0) {
        return STORE_IO;
    }
    if (!S_ISREG(about.st_mode) || about.st_size < (off_t)DIGEST_BYTES) {
        return STORE_CORRUPT;
    }
    *size = (size_t)about.st_size;
    *bytes = malloc(*size);
    if (!*bytes) {
        return STORE_NOMEM;
    }
    while (done < *size && n != 0) {
        n = read(fd, *bytes + done, *size - done);
        if (n < 0 && errno != EINTR) {
            break;
        }
        done += n > 0 ? (size_t)n : 0;
    }
    value = (struct store_part){*bytes + DIGEST_BYTES, *size - DIGEST_BYTES};
    digest_of(name, &value, 1, digest);
    if (done == *size && memcmp(digest, *bytes, DIGEST_BYTES) == 0) {
        return STORE_OK;
    }
    free(*bytes);
    *bytes = NULL;
    return STORE_CORRUPT;
}

/* ---- All of them ---------------------------------------------------------------------------- */

static void remove_unfinished(void *user, int folder_fd, const char *folder, const char *name)
{
    (void)user;
    (void)folder;
    (void)unlinkat(folder_fd, name, 0);
}

void store_prepared_limit(struct store *store, int64_t limit, int64_t least_free)
{
    struct store_prepared *prepared = &store->prepared;
    int base;

    atomic_store(&prepared->least_free, least_free);

    if (prepared->fd < 0) {
        base = open(store->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        prepared->fd = base < 0 ? -1 : store_open_folder(base, PREPARED_FOLDER);
        if (base >= 0) {
            close(base);
        }
    }
    atomic_store(&prepared->limit, prepared->fd < 0 ? 0 : limit);
    if (prepared->fd >= 0) {
        prepared_walk_folder(prepared->fd, PREPARED_TEMPORARY, remove_unfinished, NULL);
        prepared_evict(store);
    }
}

int64_t store_prepared_bytes(const struct store *store)
{
    int64_t total = atomic_load(&store->prepared.total);

    return total > 0 ? total : 0;
}

/* ---- One ------------------------------------------------------------------------------------- */

/* Opens a new file of this path for writing, in its folder; -1 with errno. */
static int open_new(int at, const char *path)
{
    char folder[8];
    int made;

    (void)snprintf(folder, sizeof folder, "%.*s", (int)strcspn(path, "/"), path);
    made = store_open_folder(at, folder);
    if (made >= 0) {
        close(made);
    }
    return openat(at, path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
}

static int write_file(int at, const char *path, const unsigned char digest[DIGEST_BYTES],
                      const struct store_part *parts, size_t n_parts)
{
    int fd = open_new(at, path);
    int status = fd < 0 ? store_map_errno(errno) : store_write_bytes(fd, digest, DIGEST_BYTES);

    for (size_t i = 0; i < n_parts && status == STORE_OK; i++) {
        status = store_write_bytes(fd, parts[i].bytes, parts[i].size);
    }
    if (fd >= 0 && close(fd) != 0 && status == STORE_OK) {
        status = store_map_errno(errno);
    }
    return status;
}

/* Moves the finished file to its name, and away again if its mesh has gone meanwhile. */
static int publish(struct store *store, const char *temporary, const char *path)
{
    struct store_reader *reader = NULL;
    char folder[8];
    int made, status;

    (void)snprintf(folder, sizeof folder, "%.*s", (int)strcspn(path, "/"), path);
    made = store_open_folder(store->prepared.fd, folder);
    if (made >= 0) {
        close(made);
    }
    if (renameat(store->prepared.fd, temporary, store->prepared.fd, path) != 0) {
        return store_map_errno(errno);
    }
    status = store_reader_take(store, &reader);
    if (status == STORE_OK) {
        status = prepared_has_meshes(reader->db, name_in(path)) ? STORE_OK : STORE_NOT_FOUND;
        store_reader_return(store, reader);
    }
    if (status != STORE_OK) {
        (void)unlinkat(store->prepared.fd, path, 0);
    }
    return status;
}

int store_prepared_put(struct store *store, const struct store_prepared_key *key,
                       const struct store_part *parts, size_t n_parts)
{
    struct store_prepared *prepared = &store->prepared;
    int64_t limit = atomic_load(&prepared->limit), taken = (int64_t)DIGEST_BYTES;
    unsigned char random[16], digest[DIGEST_BYTES];
    char path[PREPARED_PATH], temporary[64] = PREPARED_TEMPORARY "/";
    int status;

    for (size_t i = 0; i < n_parts; i++) {
        taken += (int64_t)parts[i].size;
    }
    taken = prepared_taken(taken);
    if (taken > limit || !path_of(key, path) || !prepared_fits(store, taken)) {
        return STORE_OK;
    }
    if (store_room(store) != STORE_OK) {
        return store_room(store);
    }
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(temporary + strlen(temporary), sizeof temporary - strlen(temporary), random,
                   sizeof random);
    digest_of(name_in(path), parts, n_parts, digest);
    status = write_file(prepared->fd, temporary, digest, parts, n_parts);
    if (status == STORE_OK) {
        status = publish(store, temporary, path);
    }
    if (status != STORE_OK) {
        (void)unlinkat(prepared->fd, temporary, 0);
        return status;
    }
    if (atomic_fetch_add(&prepared->total, taken) + taken > limit) {
        prepared_evict(store);
    }
    return STORE_OK;
}

int store_prepared_get(struct store *store, const struct store_prepared_key *key,
                       unsigned char **value, size_t *size)
{
    char path[PREPARED_PATH];
    unsigned char *bytes = NULL;
    int fd = -1, status = STORE_NOT_FOUND;

    *value = NULL;
    *size = 0;
    if (atomic_load(&store->prepared.limit) > 0 && path_of(key, path)) {
        fd = openat(store->prepared.fd, path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    }
    if (fd >= 0) {
        status = prepared_read(fd, name_in(path), &bytes, size);
        (void)futimens(fd, NULL);
        close(fd);
    }
    if (status == STORE_CORRUPT) {
        (void)unlinkat(store->prepared.fd, path, 0);
        status = STORE_NOT_FOUND;
    }
    if (status == STORE_OK) {
        *size -= DIGEST_BYTES;
        memmove(bytes, bytes + DIGEST_BYTES, *size);
        *value = bytes;
    }
    return status;
}

/* ---- Removing -------------------------------------------------------------------------------- */

struct dropping {
    struct store *store;
    const char *mesh;
};

static void drop_file(void *user, int folder_fd, const char *folder, const char *name)
{
    struct dropping *dropping = user;

    (void)folder;
    if (strstr(name, dropping->mesh)) {
        (void)prepared_remove(dropping->store, folder_fd, name);
    }
}

void store_prepared_drop(struct store *store, const char *mesh)
{
    struct dropping dropping = {.store = store, .mesh = mesh};
    char folder[3];

    if (store->prepared.fd >= 0 && prepared_is_id(mesh)) {
        folder_of(mesh, folder);
        prepared_walk_folder(store->prepared.fd, folder, drop_file, &dropping);
        prepared_walk_folder(store->prepared.fd, PREPARED_PAIRS, drop_file, &dropping);
    }
}
