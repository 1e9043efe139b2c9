/*
 * verify.c - is a data directory what it should be?
 *
 *   database   application_id and version, integrity_check, foreign_key_check
 *   rows       each blob read and hashed, one short read transaction each, so that the log of a
 *              daemon that runs can be checkpointed meanwhile, and a blob that it drops is seen to
 *              be gone rather than missing
 *   files      each file below blobs/ is named by a row; those of blobs/tmp/ by nobody
 *   prepared   each file below prepared/ is what it was, and of a mesh that is there. One that is
 *              not is no damage: it is made again
 *
 * A file comes into its place a moment before its row is committed (blob.c). So while a daemon
 * runs, files younger than YOUNG_SECONDS are passed over.
 *
 * Cost: reading everything once, at the speed of SHA-256 (some 300 MB/s) or of the disk.
 */
#include "store/internal.h"
#include "store/maintenance.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define YOUNG_SECONDS 60
#define HASH_LENGTH 64

/* One verification: a store without its threads. */
struct verification {
    struct store store;
    sqlite3 *db;
    bool repair;
    const struct store_listener *listener;
    struct store_report *report;
};

__attribute__((format(printf, 3, 4))) static void tell(const struct verification *v,
                                                       const char *kind, const char *format, ...)
{
    char detail[512];
    va_list arguments;

    if (!v->listener || !v->listener->found) {
        return;
    }
    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    v->listener->found(v->listener->user, kind, detail);
}

/* ---- Database -------------------------------------------------------------------------------- */

/* Every row of the answer but "ok" is an error. */
static int run_pragma(struct verification *v, const char *sql)
{
    sqlite3_stmt *rows = NULL;
    int status = store_prepare(v->db, &rows, sql, "");

    while (status == STORE_OK && (status = store_step(v->db, rows)) == STORE_OK) {
        const char *text = (const char *)sqlite3_column_text(rows, 0);

        if (!text || strcmp(text, "ok") != 0) {
            v->report->database_errors++;
            tell(v, "database", "%s: %.400s", sql, text ? text : "");
        }
    }
    if (status != STORE_NOT_FOUND) {
        v->report->database_errors++;
        tell(v, "database", "%s: %s", sql, sqlite3_errmsg(v->db));
    }
    sqlite3_finalize(rows);
    return status == STORE_NOT_FOUND || status == STORE_CORRUPT ? STORE_OK : status;
}

static int verify_database(struct verification *v, char *message, size_t message_size)
{
    int status = store_identify(v->db, &v->report->version, message, message_size);

    if (status == STORE_OK) {
        status = run_pragma(v, "PRAGMA integrity_check(20)");
    }
    if (status == STORE_OK) {
        status = run_pragma(v, "PRAGMA foreign_key_check");
    }
    return status;
}

/* ---- Rows ------------------------------------------------------------------------------------ */

/* What needs the blob, for people: its first user. */
static void find_user(sqlite3 *db, const char *hash, char user[STORE_ID_MAX + 40])
{
    static const char sql[] =
        "SELECT 'mesh ' || id FROM mesh WHERE content = ?1 UNION ALL "
        "SELECT 'volume ' || id FROM volume WHERE content = ?1 UNION ALL "
        "SELECT 'surface ' || id FROM surface WHERE coefficients = ?1 UNION ALL "
        "SELECT 'results of ' || id FROM job WHERE results = ?1 UNION ALL "
        "SELECT 'maps of ' || surface FROM surface_maps WHERE content = ?1 UNION ALL "
        "SELECT name || ' of ' || model FROM model_array WHERE content = ?1 UNION ALL "
        "SELECT 'checkpoint of ' || job FROM checkpoint WHERE content = ?1 LIMIT 1";

    (void)snprintf(user, STORE_ID_MAX + 40, "nothing");
    (void)store_text(db, user, STORE_ID_MAX + 40, sql, hash);
}

static int verify_blob(struct verification *v, const char *hash)
{
    char user[STORE_ID_MAX + 40], path[STORE_BLOB_PATH];
    unsigned char *bytes;
    size_t size;
    int status = store_blob_read(&v->store, v->db, hash, &bytes, &size);

    if (status == STORE_CORRUPT || status == STORE_IO) {
        bool gone;

        store_blob_path(path, hash);
        gone = faccessat(v->store.blobs_fd, path, F_OK, 0) != 0 && errno == ENOENT &&
               !store_blob_is_inline(v->db, hash);
        find_user(v->db, hash, user);
        v->report->missing += gone;
        v->report->damaged += !gone;
        tell(v, gone ? "missing" : "damaged", "blob %s, %s", hash, user);
        return STORE_OK;
    }
    free(bytes);
    if (status == STORE_OK) {
        v->report->blobs++;
        v->report->bytes += size;
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static int verify_rows(struct verification *v)
{
    static const char next[] = "SELECT hash FROM blob WHERE hash > ? ORDER BY hash LIMIT 1";
    char hash[65] = "";
    int status = STORE_OK;

    while (status == STORE_OK &&
           (status = store_text(v->db, hash, sizeof hash, next, hash)) == STORE_OK) {
        status = verify_blob(v, hash);
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* ---- Files ----------------------------------------------------------------------------------- */

static bool is_young(int fd, const char *name)
{
    struct timespec now;
    struct stat info;

    clock_gettime(CLOCK_REALTIME, &now);
    return fstatat(fd, name, &info, AT_SYMLINK_NOFOLLOW) == 0 &&
           now.tv_sec - info.st_ctim.tv_sec < YOUNG_SECONDS;
}

/* A file below blobs/: named by a row, or waste. */
static void verify_file(struct verification *v, int fd, const char *folder, const char *name)
{
    bool named = strlen(name) == HASH_LENGTH && store_blob_has_row(v->db, name);

    if (named || (v->report->in_use && is_young(fd, name))) {
        return;
    }
    v->report->orphans++;
    tell(v, "orphan", "blobs/%s/%s", folder, name);
    if (v->repair && unlinkat(fd, name, 0) == 0) {
        v->report->removed++;
    }
}

/* Calls verify_file for each file of one folder. */
static void verify_folder(struct verification *v, const char *name)
{
    int fd = openat(v->store.blobs_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = fd < 0 ? NULL : fdopendir(fd);

    if (!folder) {
        return;
    }
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] != '.') {
            verify_file(v, dirfd(folder), name, entry->d_name);
        }
    }
    closedir(folder);
}

static void verify_files(struct verification *v)
{
    int fd = openat(v->store.blobs_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *blobs = fd < 0 ? NULL : fdopendir(fd);

    for (const struct dirent *entry; blobs && (entry = readdir(blobs)) != NULL;) {
        if (entry->d_name[0] != '.') {
            verify_folder(v, entry->d_name);
        }
    }
    if (blobs) {
        closedir(blobs);
    }
}

/* A file of a prepared mesh that is damaged or that nothing needs: it is made again. */
static void found_prepared(void *user, const char *path, int folder_fd, const char *name)
{
    struct verification *v = user;

    if (v->report->in_use && is_young(folder_fd, name)) {
        return;
    }
    v->report->orphans++;
    tell(v, "orphan", "%s", path);
    if (v->repair && unlinkat(folder_fd, name, 0) == 0) {
        v->report->removed++;
    }
}

/* ---- All of it ------------------------------------------------------------------------------- */

static int verify_all(struct verification *v, char *message, size_t message_size)
{
    int status = verify_database(v, message, message_size);

    /* In a damaged database a row that is not found may be there all the same. */
    if (status != STORE_OK || v->report->database_errors > 0) {
        return status != STORE_OK ? status : STORE_CORRUPT;
    }
    status = verify_rows(v);
    if (status == STORE_OK) {
        verify_files(v);
        store_prepared_verify(v->store.directory, v->db, found_prepared, v);
        return v->report->missing + v->report->damaged > 0 ? STORE_CORRUPT : STORE_OK;
    }
    (void)snprintf(message, message_size, "the blobs cannot be read: %s", sqlite3_errmsg(v->db));
    return status;
}

int store_verify(const char *directory, bool repair, const struct store_listener *listener,
                 struct store_report *report, char *message, size_t message_size)
{
    struct verification v = {.repair = repair, .listener = listener, .report = report};
    int status;

    *report = (struct store_report){0};
    message[0] = '\0';
    status = store_open_offline(&v.store, &v.db, directory, message, message_size);
    if (status == STORE_OK) {
        report->in_use = flock(v.store.lock_fd, LOCK_EX | LOCK_NB) != 0;
        if (!report->in_use && !repair) {
            (void)flock(v.store.lock_fd, LOCK_UN);
        }
        if (report->in_use && repair) {
            (void)snprintf(message, message_size,
                           "%s is in use by a daemon: stop it before a repair", directory);
            status = STORE_BUSY;
        }
    }
    if (status == STORE_OK) {
        status = verify_all(&v, message, message_size);
    }
    store_close_offline(&v.store, v.db);
    return status;
}
