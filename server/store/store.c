/*
 * store.c - opening and closing the data directory, and the clock of its rows.
 *
 *   DIR/lock            held by flock while a daemon uses the directory
 *   DIR/srnfd.db        the database, with its log srnfd.db-wal and index srnfd.db-shm beside it
 *   DIR/reserve         room for deletions on a full disk (reserve.c)
 *   DIR/blobs/          content-addressed files (blob.c)
 *   DIR/prepared/       prepared meshes, which follow from the blobs (prepared.c)
 *   DIR/scratch/        what running jobs have no room for in memory (scratch.c)
 *   DIR/tokens          who may call (token.c), with tokens.lock beside it
 *
 * Order of opening: lock, blobs, database and migrations, writer thread, readers; closing goes
 * back the same way. The writer's connection is closed last of all, since the last connection
 * checkpoints the log.
 */
#include "store/cohort_list.h"
#include "store/internal.h"
#include "store/files.h"

#include "store/store.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

int64_t store_now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static int lock_directory(struct store *store, char *message, size_t message_size)
{
    char path[4096];
    int n = snprintf(path, sizeof path, "%s/lock", store->directory);

    if (n < 0 || (size_t)n >= sizeof path) {
        snprintf(message, message_size, "the path of the data directory is too long");
        return STORE_IO;
    }
    if (store_make_directory(store->directory) != STORE_OK ||
        (store->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600)) < 0) {
        int error = errno;

        snprintf(message, message_size, "%s: %s", path, strerror(error));
        return store_map_errno(error);
    }
    if (flock(store->lock_fd, LOCK_EX | LOCK_NB) != 0) {
        snprintf(message, message_size, "%s is in use by another daemon", store->directory);
        return errno == EWOULDBLOCK ? STORE_BUSY : STORE_IO;
    }
    return STORE_OK;
}

static int name_files(struct store *store, const char *directory)
{
    size_t size = strlen(directory) + sizeof STORE_DATABASE_NAME + 1;

    store->directory = strdup(directory);
    store->database = malloc(size);
    store->recent = store_recent_create();
    if (!store->directory || !store->database || !store->recent) {
        return STORE_NOMEM;
    }
    snprintf(store->database, size, "%s/%s", directory, STORE_DATABASE_NAME);
    return STORE_OK;
}

static void release(struct store *store)
{
    if (store->writer.db) {
        sqlite3_close(store->writer.db);
    }
    if (store->blobs_fd >= 0) {
        close(store->blobs_fd);
    }
    if (store->lock_fd >= 0) {
        close(store->lock_fd);
    }
    store_recent_destroy(store->recent);
    pthread_mutex_destroy(&store->prepared.evicting);
    free(store->database);
    free(store->directory);
    free(store);
}

/* On a full disk with the room of the reserve: even reading needs the log's index. */
static int connect_writer(struct store *store, char *message, size_t message_size)
{
    sqlite3 **db = &store->writer.db;
    int status = store_connect_writer(store->database, db, message, message_size);

    if (status == STORE_FULL && store_reserve_release(store)) {
        status = store_connect_writer(store->database, db, message, message_size);
    }
    return status;
}

int store_open(struct store **out, const char *directory, char *message, size_t message_size)
{
    struct store *store = calloc(1, sizeof *store);
    int status = STORE_NOMEM;

    *out = NULL;
    snprintf(message, message_size, "not enough memory");
    if (!store) {
        return STORE_NOMEM;
    }
    store->lock_fd = store->blobs_fd = store->prepared.fd = -1;
    atomic_init(&store->reserve, STORE_FULL);
    pthread_mutex_init(&store->prepared.evicting, NULL);
    store->reserve_tried_ms = INT64_MIN / 2;
    if (sodium_init() < 0) {
        snprintf(message, message_size, "the system gives no random bytes");
        status = STORE_IO;
        goto out;
    }
    if ((status = name_files(store, directory)) != STORE_OK ||
        (status = lock_directory(store, message, message_size)) != STORE_OK ||
        (status = store_blobs_open(store, message, message_size)) != STORE_OK ||
        (status = connect_writer(store, message, message_size)) != STORE_OK) {
        goto out;
    }
    store_reserve_take(store);
    status = store_writer_start(store);
    if (status != STORE_OK) {
        snprintf(message, message_size, "the writer thread cannot be started");
        goto out;
    }
    store_readers_start(store);
    store_lists_recover(store);
    snprintf(message, message_size, "%s", "");
    *out = store;
out:
    if (status != STORE_OK) {
        release(store);
    }
    return status;
}

void store_close(struct store *store)
{
    if (!store) {
        return;
    }
    store_writer_stop(store);
    store_readers_stop(store);
    /* The log has gone with its last connection: its room serves the next start on a full disk. */
    sqlite3_close(store->writer.db);
    store->writer.db = NULL;
    store_reserve_leave(store);
    release(store);
}

int store_ping(struct store *store)
{
    struct store_reader *reader = NULL;
    int64_t one = 0;
    int status = store_reader_take(store, &reader);

    if (status == STORE_OK) {
        /* A constant alone would not touch the file. */
        status = store_scalar(reader->db, &one, "SELECT 1 FROM sqlite_schema LIMIT 1");
        store_reader_return(store, reader);
    }
    return status;
}
