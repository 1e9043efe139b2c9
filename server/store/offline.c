/*
 * offline.c - a data directory opened for reading by a process that is not its daemon: the paths,
 * the descriptors of the lock and of the folder of blobs, and a read-only connection.
 *
 * The connection writes nothing into the database and makes no checkpoint, not even when it is
 * closed as the last one (database.c says why only the daemon's writer may).
 */
#include "store/internal.h"
#include "store/files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char *join(const char *directory, const char *name)
{
    size_t size = strlen(directory) + strlen(name) + 2;
    char *path = malloc(size);

    if (path) {
        (void)snprintf(path, size, "%s/%s", directory, name);
    }
    return path;
}

static int open_files(struct store *store, const char *directory, char *message,
                      size_t message_size)
{
    char *lock = join(directory, "lock"), *blobs = join(directory, "blobs");

    if (lock && blobs) {
        store->lock_fd = open(lock, O_RDWR | O_CLOEXEC);
        store->blobs_fd = open(blobs, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    }
    free(lock);
    free(blobs);
    if (store->blobs_fd < 0 || store->lock_fd < 0 || access(store->database, R_OK) != 0) {
        (void)snprintf(message, message_size, "%s is not a data directory: %s", directory,
                       strerror(errno));
        return errno == ENOENT ? STORE_NOT_FOUND : store_map_errno(errno);
    }
    return STORE_OK;
}

int store_open_offline(struct store *store, sqlite3 **db, const char *directory, char *message,
                       size_t message_size)
{
    int status = STORE_NOMEM;

    *db = NULL;
    store->lock_fd = store->blobs_fd = store->prepared.fd = -1;
    store->directory = strdup(directory);
    store->database = join(directory, STORE_DATABASE_NAME);
    (void)snprintf(message, message_size, "not enough memory");
    if (store->directory && store->database) {
        status = open_files(store, directory, message, message_size);
    }
    if (status == STORE_OK) {
        message[0] = '\0';
        status = store_connect_reader(store->database, db);
        if (status == STORE_OK) {
            sqlite3_db_config(*db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
        } else {
            (void)snprintf(message, message_size, "%s: %s", store->database,
                           store_strerror(status));
        }
    }
    return status;
}

void store_close_offline(struct store *store, sqlite3 *db)
{
    sqlite3_close(db);
    if (store->blobs_fd >= 0) {
        close(store->blobs_fd);
    }
    if (store->lock_fd >= 0) {
        close(store->lock_fd);
    }
    free(store->database);
    free(store->directory);
}
