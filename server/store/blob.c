/*
 * blob.c - content by its SHA-256: small in a row, large in a file.
 *
 * Up to STORE_INLINE_MAX bytes are a column of the table blob. Larger content is a file
 * blobs/ab/abcdef..., and its row has NULL instead. The order of steps makes a crash at any
 * moment harmless:
 *
 *   caller   hash; write blobs/tmp/RANDOM; fsync it                         (stage)
 *   writer   rename it to its name; fsync the folder; insert the row        (keep, then COMMIT)
 *   writer   delete the row, COMMIT, remove the file unless it has a row    (release, remove)
 *            or a backup is copying (flock on the folder, backup.c)
 *
 * A file without a row is waste, never damage; a row without its file cannot come about. Renaming
 * and removing both happen on the writer thread, so that content which is dropped and stored
 * again at the same moment is never lost. Whatever is read is hashed again: content that is not
 * what its name says is STORE_CORRUPT.
 *
 * Cost: SHA-256 at some 300 MB/s each way.
 */
#include "store/internal.h"
#include "store/files.h"
#include "store/numbers.h"
#include "store/prepared.h"
#include "store/prepared_files.h"

#include "store/digest.h"
#include "store/store.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <dirent.h>

#define TEMPORARY "tmp"

void store_blob_path(char path[STORE_BLOB_PATH], const char *hash)
{
    snprintf(path, STORE_BLOB_PATH, "%.2s/%s", hash, hash);
}

/* Removes what a crash has left in blobs/tmp. Takes over the descriptor. */
static void clean_folder(int fd)
{
    DIR *folder = fdopendir(fd);

    if (!folder) {
        close(fd);
        return;
    }
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] != '.') {
            unlinkat(dirfd(folder), entry->d_name, 0);
        }
    }
    closedir(folder);
}

int store_blobs_open(struct store *store, char *message, size_t message_size)
{
    int base = open(store->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int temporary = -1, status = STORE_OK;

    store->blobs_fd = base < 0 ? -1 : store_open_folder(base, "blobs");
    temporary = store->blobs_fd < 0 ? -1 : store_open_folder(store->blobs_fd, TEMPORARY);
    if (temporary < 0 || fsync(store->blobs_fd) != 0 || fsync(base) != 0) {
        status = store_map_errno(errno);
        snprintf(message, message_size, "%s/blobs: %s", store->directory, strerror(errno));
    }
    if (temporary >= 0) {
        clean_folder(temporary);
    }
    if (base >= 0) {
        close(base);
    }
    return status;
}

/* Writes the content to its temporary file, which is gone again where that fails. */
static int write_temporary(struct store *store, const struct store_content *content)
{
    int fd =
        openat(store->blobs_fd, content->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    int status;

    if (fd < 0) {
        return store_map_errno(errno);
    }
    status = store_write_all(fd, content->bytes, content->size);
    if (close(fd) != 0 && status == STORE_OK) {
        status = store_map_errno(errno);
    }
    if (status != STORE_OK) {
        store_blob_unstage(store, content);
    }
    return status;
}

int store_blob_stage(struct store *store, const void *bytes, size_t size,
                     struct store_content *content)
{
    unsigned char random[16];
    char name[2 * sizeof random + 1];
    int status;

    *content = (struct store_content){.bytes = bytes, .size = size};
    store_sha256_hex(content->hash, bytes, size);
    if (size <= STORE_INLINE_MAX) {
        return STORE_OK;
    }
    if (store_room(store) != STORE_OK) {
        return store_room(store);
    }
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(name, sizeof name, random, sizeof random);
    snprintf(content->temporary, sizeof content->temporary, TEMPORARY "/%s", name);
    status = write_temporary(store, content);
    if (status == STORE_FULL && store_prepared_give_way(store, (int64_t)size)) {
        status = write_temporary(store, content);
    }
    if (status != STORE_OK) {
        content->temporary[0] = '\0';
    }
    return status;
}

int store_scratch_file(const struct store *store, int *status)
{
    int fd = openat(store->blobs_fd, TEMPORARY, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);

    *status = fd < 0 ? store_map_errno(errno) : store_room(store);
    if (fd >= 0 && *status != STORE_OK) {
        close(fd);
        fd = -1;
    }
    return fd;
}

bool store_scratch_fits(struct store *store, int64_t bytes)
{
    return prepared_fits(store, bytes) ||
           (store_prepared_give_way(store, bytes) && prepared_fits(store, bytes));
}

void store_blob_unstage(struct store *store, const struct store_content *content)
{
    if (content->temporary[0]) {
        unlinkat(store->blobs_fd, content->temporary, 0);
    }
}

/* Gives the staged file its name, for good. */
static int publish(struct store *store, const struct store_content *content)
{
    char path[STORE_BLOB_PATH], folder_name[3];
    int folder, status = STORE_OK;

    store_blob_path(path, content->hash);
    snprintf(folder_name, sizeof folder_name, "%.2s", content->hash);
    folder = store_open_folder(store->blobs_fd, folder_name);
    if (folder < 0) {
        return store_map_errno(errno);
    }
    /* An earlier run of the same write, undone with its group, may have moved the file already. */
    if (renameat(store->blobs_fd, content->temporary, store->blobs_fd, path) != 0 &&
        (errno != ENOENT || faccessat(store->blobs_fd, path, F_OK, 0) != 0)) {
        status = store_map_errno(errno);
    }
    if (status == STORE_OK && (fsync(folder) != 0 || fsync(store->blobs_fd) != 0)) {
        status = store_map_errno(errno);
    }
    close(folder);
    return status;
}

int store_blob_keep(struct store *store, sqlite3 *db, const struct store_content *content)
{
    if (!content->temporary[0]) {
        return store_execute(db, NULL,
                             "INSERT INTO blob (hash, size, bytes) VALUES (?, ?, ?) "
                             "ON CONFLICT (hash) DO NOTHING",
                             "tib", content->hash, (int64_t)content->size, content->bytes,
                             content->size);
    }
    /* Also where the row is there: the new file then replaces one that may have been damaged. */
    int status = publish(store, content);

    if (status != STORE_OK) {
        return status;
    }
    return store_execute(db, NULL,
                         "INSERT INTO blob (hash, size, bytes) VALUES (?, ?, NULL) "
                         "ON CONFLICT (hash) DO NOTHING",
                         "ti", content->hash, (int64_t)content->size);
}

int store_blob_release(sqlite3 *db, const char *hash, bool *dropped)
{
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "DELETE FROM blob WHERE hash = ? "
                               "AND NOT EXISTS (SELECT 1 FROM mesh WHERE content = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM volume WHERE content = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM surface WHERE coefficients = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM surface_maps WHERE content = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM job WHERE results = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM model_array WHERE content = hash) "
                               "AND NOT EXISTS (SELECT 1 FROM checkpoint WHERE content = hash)",
                               "t", hash);

    *dropped = changed > 0;
    return status;
}

/* An error counts as a row: then nothing is removed. */
static bool has_row(sqlite3 *db, const char *sql, const char *hash)
{
    sqlite3_stmt *statement = NULL;
    int status = store_prepare(db, &statement, sql, "t", hash);

    if (status == STORE_OK) {
        status = store_step(db, statement);
    }
    sqlite3_finalize(statement);
    return status != STORE_NOT_FOUND;
}

bool store_blob_has_row(sqlite3 *db, const char *hash)
{
    return has_row(db, "SELECT 1 FROM blob WHERE hash = ?", hash);
}

bool store_blob_is_inline(sqlite3 *db, const char *hash)
{
    return has_row(db, "SELECT 1 FROM blob WHERE hash = ? AND bytes IS NOT NULL", hash);
}

bool store_blob_remove(struct store *store, sqlite3 *db, const char *hash)
{
    char path[STORE_BLOB_PATH];
    bool removed;

    /* A backup holds the lock while it copies: the file stays, without a row, for the next sweep.
       */
    if (store_blob_has_row(db, hash) || flock(store->blobs_fd, LOCK_EX | LOCK_NB) != 0) {
        return false;
    }
    store_blob_path(path, hash);
    removed = unlinkat(store->blobs_fd, path, 0) == 0;
    (void)flock(store->blobs_fd, LOCK_UN);
    return removed;
}

/* Reads a blob's file of exactly this size. */
static int read_file(struct store *store, const char *hash, unsigned char *bytes, size_t size)
{
    char path[STORE_BLOB_PATH];
    struct stat info;
    size_t done = 0;
    int fd;

    store_blob_path(path, hash);
    fd = openat(store->blobs_fd, path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        return errno == ENOENT ? STORE_CORRUPT : store_map_errno(errno);
    }
    if (fstat(fd, &info) != 0 || info.st_size < 0 || (size_t)info.st_size != size) {
        close(fd);
        return STORE_CORRUPT;
    }
    while (done < size) {
        ssize_t n = read(fd, bytes + done, size - done);

        if (n == 0 || (n < 0 && errno != EINTR)) {
            close(fd);
            return n == 0 ? STORE_CORRUPT : store_map_errno(errno);
        }
        done += n > 0 ? (size_t)n : 0;
    }
    close(fd);
    return STORE_OK;
}

static int read_row(struct store *store, sqlite3 *db, sqlite3_stmt *statement, const char *hash,
                    unsigned char **out, size_t *size)
{
    char found[65];
    unsigned char *bytes;
    int status = store_step(db, statement);

    if (status != STORE_OK) {
        return status;
    }
    *size = (size_t)sqlite3_column_int64(statement, 0);
    bytes = *size < SIZE_MAX ? malloc(*size + 1) : NULL;
    if (!bytes) {
        return STORE_NOMEM;
    }
    bytes[*size] = '\0';
    if (sqlite3_column_type(statement, 1) == SQLITE_NULL) {
        status = read_file(store, hash, bytes, *size);
    } else if ((size_t)sqlite3_column_bytes(statement, 1) != *size) {
        status = STORE_CORRUPT;
    } else if (*size > 0) {
        memcpy(bytes, sqlite3_column_blob(statement, 1), *size);
    }
    if (status == STORE_OK) {
        store_sha256_hex(found, bytes, *size);
        status = memcmp(found, hash, sizeof found) == 0 ? STORE_OK : STORE_CORRUPT;
    }
    if (status != STORE_OK) {
        free(bytes);
        return status;
    }
    *out = bytes;
    return STORE_OK;
}

int store_blob_read(struct store *store, sqlite3 *db, const char *hash, unsigned char **bytes,
                    size_t *size)
{
    int status = STORE_CORRUPT;

    *bytes = NULL;
    *size = 0;
    if (!hash[0]) {
        return STORE_NOMEM; /* the column that has the name was there and could not be read */
    }
    /* Between the row and the file the blob may have been dropped: the second look then finds no
       row. */
    for (int look = 0; look < 2 && status == STORE_CORRUPT; look++) {
        sqlite3_stmt *statement = NULL;

        status =
            store_prepare(db, &statement, "SELECT size, bytes FROM blob WHERE hash = ?", "t", hash);
        if (status == STORE_OK) {
            status = read_row(store, db, statement, hash, bytes, size);
        }
        sqlite3_finalize(statement);
    }
    return status;
}

int store_blob_find(struct store *store, const char *sql, const char *id, unsigned char **bytes,
                    size_t *size)
{
    char hash[65];
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    *bytes = NULL;
    *size = 0;
    if (status != STORE_OK) {
        return status;
    }
    status = store_text(reader->db, hash, sizeof hash, sql, id);
    if (status == STORE_OK) {
        status = store_blob_read(store, reader->db, hash, bytes, size);
    }
    store_reader_return(store, reader);
    return status;
}

int store_read_doubles(struct store *store, sqlite3 *db, const char *hash, size_t count,
                       double **values)
{
    unsigned char *bytes = NULL;
    size_t size = 0;
    int status = store_blob_read(store, db, hash, &bytes, &size);

    *values = NULL;
    if (status == STORE_OK && (size % 8 != 0 || size / 8 != count)) {
        status = STORE_CORRUPT;
    }
    if (status == STORE_OK) {
        *values = malloc(count ? size : 1);
        status = *values ? STORE_OK : STORE_NOMEM;
    }
    if (status == STORE_OK) {
        store_get_doubles(bytes, *values, count);
    }
    free(bytes);
    return status;
}
