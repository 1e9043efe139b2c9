/*
 * retention.c - what goes with time: ended jobs after their days, and files that no row names.
 *
 * Both are done in small steps, each a write of its own like any other, so that requests come in
 * between. A job takes its results along, unless something else has the same content, and the
 * idempotency keys that name it; meshes, surfaces, cohorts and models never go this way.
 *
 * Files without a row are what a crash between rename and commit has left, and what could not be
 * removed while a backup was copying (blob.c). The folders are read on the caller's thread; each
 * file without a row is then looked at again, and removed, on the writer thread, on which alone
 * files come to their names.
 */
#include "store/internal.h"
#include "store/job.h"
#include "store/prepared.h"
#include "store/store.h"

#include <dirent.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#define HASH_LENGTH 64
#define BATCH 64

/* ---- Jobs ------------------------------------------------------------------------------------ */

/* Ids of some jobs that ended before; their number. */
static int find_expired(struct store *store, int64_t before_ms, char ids[BATCH][STORE_ID_MAX],
                        size_t *n)
{
    struct store_query query;
    int status = store_query_open(&query, store,
                                  "SELECT id FROM job WHERE status IN ('successful', 'failed', "
                                  "'dismissed') AND finished_ms < ? ORDER BY created_ms LIMIT ?",
                                  "ii", before_ms, (int64_t)BATCH);

    *n = 0;
    while (status == STORE_OK && (status = store_query_next(&query)) == STORE_OK) {
        store_column_id(query.row, 0, ids[(*n)++], STORE_ID_MAX);
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int store_expire_jobs(struct store *store, int64_t before_ms, size_t *removed)
{
    char ids[BATCH][STORE_ID_MAX];
    size_t n = BATCH;
    int status = STORE_OK;

    *removed = 0;
    while (status == STORE_OK && n == BATCH) {
        status = find_expired(store, before_ms, ids, &n);
        for (size_t i = 0; i < n && status == STORE_OK; i++) {
            int deleted = store_job_delete(store, ids[i]);

            /* A user may have been faster. */
            *removed += deleted == STORE_OK;
            status = deleted == STORE_NOT_FOUND ? STORE_OK : deleted;
        }
    }
    return status;
}

/* ---- Files ----------------------------------------------------------------------------------- */

struct orphan {
    char hash[65];
    bool removed;
};

/* Nothing is changed in the database: the file is removed here, on the writer thread, unless a row
   that was written before in this very transaction names it. */
static int run_remove(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct orphan *orphan = write->argument;

    orphan->removed = store_blob_remove(store, db, orphan->hash) || orphan->removed;
    return STORE_OK;
}

static int sweep_file(struct store *store, struct store_reader *reader, const char *name,
                      size_t *removed)
{
    struct orphan orphan = {.removed = false};
    int status = STORE_OK;

    if (strlen(name) == HASH_LENGTH && !store_blob_has_row(reader->db, name)) {
        memcpy(orphan.hash, name, sizeof orphan.hash);
        status = store_write_freeing(store, run_remove, &orphan);
        *removed += orphan.removed;
    }
    return status;
}

static int sweep_folder(struct store *store, struct store_reader *reader, int folder_fd,
                        size_t *removed)
{
    DIR *folder = folder_fd < 0 ? NULL : fdopendir(folder_fd);
    int status = STORE_OK;

    if (!folder) {
        if (folder_fd >= 0) {
            close(folder_fd);
        }
        return STORE_OK;
    }
    for (const struct dirent *entry; status == STORE_OK && (entry = readdir(folder)) != NULL;) {
        status = sweep_file(store, reader, entry->d_name, removed);
    }
    closedir(folder);
    return status;
}

int store_sweep_files(struct store *store, size_t *removed)
{
    static const char digits[] = "0123456789abcdef";
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    *removed = 0;
    for (size_t i = 0; status == STORE_OK && i < 256; i++) {
        const char name[3] = {digits[i / 16], digits[i % 16], '\0'};

        status = sweep_folder(store, reader,
                              openat(store->blobs_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC),
                              removed);
    }
    if (reader) {
        store_reader_return(store, reader);
    }
    return status == STORE_OK ? store_prepared_sweep(store, removed) : status;
}
