/*
 * backup.c - a copy of a data directory as it is at one moment, while the daemon goes on.
 *
 *   1  flock(blobs/, shared)       from now on the daemon leaves the files of blobs that it drops
 *                                  (store_blob_remove wants the lock for itself); its next sweep
 *                                  removes them
 *   2  VACUUM INTO srnfd.db.new    a snapshot of the database, of one read transaction
 *   3  each blob with a file that the snapshot names: read, hashed, written and synced
 *   4  the file of tokens, where there is one: without it a restored service would ask for none
 *   5  fsync; rename srnfd.db.new to srnfd.db; fsync the folder
 *
 * A row of the snapshot has its file: files come before rows (blob.c) and, since step 1, stay after
 * them. The daemon's writer waits for nothing here; only its checkpoints cannot copy, while step 2
 * lasts, what came after the snapshot, so that the log grows meanwhile.
 *
 * Cost: the size of everything, read and written once.
 */
#include "store/internal.h"
#include "store/files.h"
#include "store/maintenance.h"
#include "store/token.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define NEW_DATABASE STORE_DATABASE_NAME ".new"

struct backup {
    struct store store;     /* the source */
    sqlite3 *db;            /* of the source; then of the snapshot */
    int destination, blobs; /* folders of the copy */
    bool link;
    const struct store_listener *listener;
    struct store_report *report;
};

/* Makes the destination, or takes it where it is empty. */
static int make_destination(struct backup *b, const char *path, char *message, size_t message_size)
{
    const struct dirent *entry;
    int status = STORE_OK;
    DIR *folder;

    if (mkdir(path, 0700) != 0 && errno != EEXIST) {
        (void)snprintf(message, message_size, "%s: %s", path, strerror(errno));
        return store_map_errno(errno);
    }
    folder = opendir(path);
    if (!folder) {
        (void)snprintf(message, message_size, "%s: %s", path, strerror(errno));
        return store_map_errno(errno);
    }
    while (status == STORE_OK && (entry = readdir(folder)) != NULL) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            (void)snprintf(message, message_size, "%s is not empty", path);
            status = STORE_CONFLICT;
        }
    }
    closedir(folder);
    if (status == STORE_OK) {
        b->destination = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        b->blobs = b->destination < 0 ? -1 : store_open_folder(b->destination, "blobs");
        if (b->blobs < 0) {
            (void)snprintf(message, message_size, "%s: %s", path, strerror(errno));
            status = store_map_errno(errno);
        }
    }
    return status;
}

/* Step 2; afterwards the snapshot is what is read. */
static int take_snapshot(struct backup *b, const char *path, char *message, size_t message_size)
{
    size_t size = strlen(path) + sizeof NEW_DATABASE + 1;
    char *file = malloc(size);
    int status = STORE_NOMEM;

    if (file) {
        (void)snprintf(file, size, "%s/%s", path, NEW_DATABASE);
        status = store_execute(b->db, NULL, "VACUUM INTO ?", "t", file);
        (void)snprintf(message, message_size, "%s: %s", file, sqlite3_errmsg(b->db));
    }
    if (status == STORE_OK) {
        sqlite3_close(b->db);
        status = store_connect_reader(file, &b->db);
    }
    free(file);
    return status;
}

/* Writes verified bytes to folder/name and syncs them. */
static int write_copy(int folder, const char *name, const void *bytes, size_t size)
{
    int fd = openat(folder, name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    int status = fd < 0 ? store_map_errno(errno) : store_write_all(fd, bytes, size);

    if (fd >= 0 && close(fd) != 0 && status == STORE_OK) {
        status = store_map_errno(errno);
    }
    return status;
}

static int copy_blob(struct backup *b, const char *hash)
{
    char path[STORE_BLOB_PATH], folder_name[3];
    unsigned char *bytes = NULL;
    size_t size;
    int folder, status = store_blob_read(&b->store, b->db, hash, &bytes, &size);

    if (status == STORE_CORRUPT) {
        b->report->damaged++;
        if (b->listener && b->listener->found) {
            b->listener->found(b->listener->user, "damaged", hash);
        }
        return STORE_OK;
    }
    if (status != STORE_OK) {
        return status;
    }
    store_blob_path(path, hash);
    (void)snprintf(folder_name, sizeof folder_name, "%.2s", hash);
    folder = store_open_folder(b->blobs, folder_name);
    if (folder < 0) {
        status = store_map_errno(errno);
    } else if (!b->link || linkat(b->store.blobs_fd, path, folder, hash, 0) != 0) {
        /* Another file system, or too many links: a copy does as well. */
        status = write_copy(folder, hash, bytes, size);
    }
    if (status == STORE_OK && fsync(folder) != 0) {
        status = store_map_errno(errno);
    }
    if (folder >= 0) {
        close(folder);
    }
    free(bytes);
    b->report->blobs++;
    b->report->bytes += size;
    return status;
}

static int copy_blobs(struct backup *b, char *message, size_t message_size)
{
    sqlite3_stmt *rows = NULL;
    char hash[65];
    int status = store_prepare(b->db, &rows, "SELECT hash FROM blob WHERE bytes IS NULL", "");

    while (status == STORE_OK && (status = store_step(b->db, rows)) == STORE_OK) {
        store_column_id(rows, 0, hash, sizeof hash);
        status = copy_blob(b, hash);
    }
    sqlite3_finalize(rows);
    if (status != STORE_NOT_FOUND) {
        (void)snprintf(message, message_size, "blob %s: %s", hash, store_strerror(status));
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* Step 4. The file is replaced as a whole (token.c): what is open here is one state of it. */
static int copy_tokens(struct backup *b, const char *directory, char *message, size_t message_size)
{
    int folder = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int fd = folder < 0 ? -1 : openat(folder, STORE_TOKENS_NAME, O_RDONLY | O_CLOEXEC);
    int copy = -1, status = fd >= 0 || errno == ENOENT ? STORE_OK : store_map_errno(errno);
    unsigned char bytes[4096];
    ssize_t n = 0;

    if (fd >= 0) {
        copy = openat(b->destination, STORE_TOKENS_NAME, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                      0600);
        status = copy < 0 ? store_map_errno(errno) : STORE_OK;
    }
    while (copy >= 0 && status == STORE_OK && (n = read(fd, bytes, sizeof bytes)) != 0) {
        status = n > 0            ? store_write_all(copy, bytes, (size_t)n)
                 : errno == EINTR ? STORE_OK
                                  : store_map_errno(errno);
    }
    if (copy >= 0 && close(copy) != 0 && status == STORE_OK) {
        status = store_map_errno(errno);
    }
    if (fd >= 0) {
        close(fd);
    }
    if (folder >= 0) {
        close(folder);
    }
    if (status != STORE_OK) {
        (void)snprintf(message, message_size, "the file of tokens: %s", strerror(errno));
    }
    return status;
}

/* Step 5. The lock is part of a data directory, too. */
static int complete(struct backup *b, char *message, size_t message_size)
{
    int fd = openat(b->destination, NEW_DATABASE, O_RDWR | O_CLOEXEC);
    bool synced = fd >= 0 && fsync(fd) == 0 && fsync(b->blobs) == 0;
    int status = synced ? write_copy(b->destination, "lock", "", 0) : store_map_errno(errno);

    if (status == STORE_OK &&
        (renameat(b->destination, NEW_DATABASE, b->destination, STORE_DATABASE_NAME) != 0 ||
         fsync(b->destination) != 0)) {
        status = store_map_errno(errno);
    }
    if (fd >= 0) {
        close(fd);
    }
    if (status != STORE_OK) {
        (void)snprintf(message, message_size, "the copy cannot be completed: %s", strerror(errno));
    }
    return status;
}

static int copy_all(struct backup *b, const char *directory, const char *destination, char *message,
                    size_t message_size)
{
    int status = make_destination(b, destination, message, message_size);

    if (status == STORE_OK && flock(b->store.blobs_fd, LOCK_SH) != 0) {
        (void)snprintf(message, message_size, "blobs cannot be locked: %s", strerror(errno));
        status = STORE_IO;
    }
    if (status == STORE_OK) {
        status = take_snapshot(b, destination, message, message_size);
    }
    if (status == STORE_OK) {
        status = store_scalar(b->db, &b->report->version, "PRAGMA user_version");
    }
    if (status == STORE_OK) {
        status = copy_blobs(b, message, message_size);
    }
    if (status == STORE_OK) {
        status = copy_tokens(b, directory, message, message_size);
    }
    if (status == STORE_OK) {
        status = complete(b, message, message_size);
    }
    return status == STORE_OK && b->report->damaged > 0 ? STORE_CORRUPT : status;
}

int store_backup(const char *directory, const char *destination, bool link,
                 const struct store_listener *listener, struct store_report *report, char *message,
                 size_t message_size)
{
    struct backup b = {
        .destination = -1, .blobs = -1, .link = link, .listener = listener, .report = report};
    int status;

    *report = (struct store_report){0};
    status = store_open_offline(&b.store, &b.db, directory, message, message_size);
    if (status == STORE_OK) {
        status = store_identify(b.db, &report->version, message, message_size);
    }
    if (status == STORE_OK) {
        status = copy_all(&b, directory, destination, message, message_size);
    }
    if (b.blobs >= 0) {
        close(b.blobs);
    }
    if (b.destination >= 0) {
        close(b.destination);
    }
    store_close_offline(&b.store, b.db);
    return status;
}
