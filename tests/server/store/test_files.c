/*
 * The data directory under hard circumstances: databases that are not ours, damaged or too new, a
 * second daemon, blobs that vanish or change, an end without a goodbye, a disk that is full.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <sys/wait.h>

#include "fixture.h"
#include "store/digest.h"
#include "store/store.h"
#include "support/small_disk.h"
#include "store/job.h"
#include "store/mesh.h"

#define LARGE (STORE_INLINE_MAX + 1000)

static void path_of(const struct fixture *fixture, const char *name, char path[512])
{
    snprintf(path, 512, "%s/%s", fixture->path, name);
}

static void write_file(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");

    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* Runs statements on the database while no store has it open. */
static void run_sql(const struct fixture *fixture, const char *sql)
{
    char path[512];
    sqlite3 *db;

    path_of(fixture, "srnfd.db", path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
}

/* The version of the schema, while no store has it open. */
static int version_of(const struct fixture *fixture)
{
    char path[512];
    sqlite3_stmt *row;
    sqlite3 *db;
    int version;

    path_of(fixture, "srnfd.db", path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_prepare_v2(db, "PRAGMA user_version", -1, &row, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_step(row), SQLITE_ROW);
    version = sqlite3_column_int(row, 0);
    sqlite3_finalize(row);
    sqlite3_close(db);
    return version;
}

static void opening_fails(const struct fixture *fixture, int wanted, const char *word)
{
    struct store *store;
    char message[256] = "";

    assert_int_equal(store_open(&store, fixture->path, message, sizeof message), wanted);
    assert_null(store);
    if (!strstr(message, word)) {
        fail_msg("\"%s\" is not in: %s", word, message);
    }
}

static int count_files(const char *path)
{
    DIR *folder = opendir(path);
    int count = 0;

    for (const struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
        count += entry->d_name[0] != '.';
    }
    if (folder) {
        closedir(folder);
    }
    return count;
}

/* The blob file of these bytes. */
static void blob_path(const struct fixture *fixture, const unsigned char *bytes, size_t size,
                      char path[512])
{
    char hex[65];

    store_sha256_hex(hex, bytes, size);
    snprintf(path, 512, "%s/blobs/%.2s/%s", fixture->path, hex, hex);
}

static void a_directory_is_made_with_its_parents(void **state)
{
    struct fixture *fixture = *state;
    struct store *store;
    char path[512], message[256];

    path_of(fixture, "a/b/c/", path);
    assert_int_equal(store_open(&store, path, message, sizeof message), STORE_OK);
    store_close(store);
    path_of(fixture, "file", path);
    write_file(path, "x", 1);
    assert_true(store_open(&store, path, message, sizeof message) < 0);
    assert_true(strlen(message) > 0);
}

static void a_second_daemon_is_kept_out(void **state)
{
    struct fixture *fixture = *state;

    fixture->store = fixture_store(fixture->path);
    opening_fails(fixture, STORE_BUSY, "in use");
    store_close(fixture->store);
    fixture->store = fixture_store(fixture->path);
    assert_int_equal(store_ping(fixture->store), STORE_OK);
}

static void another_applications_database_is_refused(void **state)
{
    struct fixture *fixture = *state;

    run_sql(fixture, "CREATE TABLE theirs (a); INSERT INTO theirs VALUES (1)");
    opening_fails(fixture, STORE_CORRUPT, "another application");
    run_sql(fixture, "DROP TABLE theirs; PRAGMA application_id = 7");
    opening_fails(fixture, STORE_CORRUPT, "another application");
}

static void a_newer_database_is_refused(void **state)
{
    struct fixture *fixture = *state;
    char back[64];

    store_close(fixture_store(fixture->path));
    snprintf(back, sizeof back, "PRAGMA user_version = %d", version_of(fixture));
    run_sql(fixture, "PRAGMA user_version = 9999");
    opening_fails(fixture, STORE_NEWER, "9999");
    run_sql(fixture, back);
    fixture->store = fixture_store(fixture->path);
}

static void what_is_no_database_is_refused(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *noise = fixture_bytes(8192, 1);
    char path[512];

    path_of(fixture, "srnfd.db", path);
    write_file(path, noise, 8192);
    free(noise);
    opening_fails(fixture, STORE_CORRUPT, "not an intact");
}

static void a_damaged_database_is_refused(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *noise = fixture_bytes(4096, 2);
    char path[512], id[STORE_ID_MAX];
    FILE *file;

    fixture->store = fixture_store(fixture->path);
    for (int i = 0; i < 200; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
    }
    store_close(fixture->store);
    fixture->store = NULL;
    path_of(fixture, "srnfd.db", path);
    file = fopen(path, "r+b");
    assert_non_null(file);
    for (long page = 2; page < 12; page++) {
        fseek(file, page * 4096, SEEK_SET);
        assert_int_equal(fwrite(noise, 1, 4096, file), 4096);
    }
    fclose(file);
    free(noise);
    opening_fails(fixture, STORE_CORRUPT, "not an intact");
}

static void a_blob_that_is_gone_or_changed_is_corrupt(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(LARGE, 3), *content;
    char path[512], id[STORE_ID_MAX];
    bool created;
    size_t size;

    fixture->store = fixture_store(fixture->path);
    assert_int_equal(fixture_put_mesh(fixture->store, bytes, LARGE, id, &created), STORE_OK);
    blob_path(fixture, bytes, LARGE, path);
    assert_int_equal(access(path, R_OK), 0);

    bytes[1000] ^= 1;
    write_file(path, bytes, LARGE);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_CORRUPT);
    assert_null(content);
    write_file(path, bytes, LARGE - 1);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_CORRUPT);
    unlink(path);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_CORRUPT);

    /* The rest of the store goes on. */
    bytes[1000] ^= 1;
    assert_int_equal(fixture_put_mesh(fixture->store, bytes, 100, id, &created), STORE_OK);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
    free(content);
    free(bytes);
}

static void large_results_go_with_their_last_job(void **state)
{
    struct fixture *fixture = *state;
    char *text = malloc(LARGE + 1), *results, path[512], id[2][STORE_ID_MAX];
    struct store_job job;
    size_t size;

    memset(text, 'r', LARGE);
    text[LARGE] = '\0';
    fixture->store = fixture_store(fixture->path);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id[i]), STORE_OK);
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        store_job_clear(&job);
        assert_int_equal(
            store_job_transition(fixture->store, id[i], 1, STORE_JOB_SUCCESSFUL, text, NULL, NULL),
            STORE_OK);
    }
    blob_path(fixture, (unsigned char *)text, LARGE, path);
    assert_int_equal(store_job_delete(fixture->store, id[0]), STORE_OK);
    assert_int_equal(access(path, R_OK), 0);
    assert_int_equal(store_job_results(fixture->store, id[1], &results, &size), STORE_OK);
    assert_string_equal(results, text);
    free(results);
    assert_int_equal(store_job_delete(fixture->store, id[1]), STORE_OK);
    store_close(fixture->store); /* the file goes after the commit: let the writer come to rest */
    fixture->store = NULL;
    assert_int_equal(access(path, R_OK), -1);
    free(text);
}

static void temporary_files_do_not_stay(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(LARGE, 4);
    char path[512], folder[512], id[STORE_ID_MAX];
    bool created;

    fixture->store = fixture_store(fixture->path);
    path_of(fixture, "blobs/tmp", folder);
    assert_int_equal(fixture_put_mesh(fixture->store, bytes, LARGE, id, &created), STORE_OK);
    assert_int_equal(count_files(folder), 0);
    path_of(fixture, "blobs/tmp/0123", path);
    write_file(path, "half", 4);
    fixture_reopen(fixture);
    assert_int_equal(count_files(folder), 0);
    free(bytes);
}

/* ---- In a process of their own --------------------------------------------------------------- */

/* Runs body in a child; its return value is the exit status, with no closing and no clean-up at
   all. */
static int in_child(int (*body)(const char *path), const char *path)
{
    int status;
    pid_t child = fork();

    assert_true(child >= 0);
    if (child == 0) {
        _exit(body(path));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

/* Acknowledged, then gone: the store is never closed. */
static int put_and_vanish(const char *path)
{
    unsigned char *small = fixture_bytes(100, 5), *large = fixture_bytes(LARGE, 6);
    char message[256], id[STORE_ID_MAX];
    struct store *store;
    bool created;

    if (store_open(&store, path, message, sizeof message) != STORE_OK) {
        return 1;
    }
    for (int i = 0; i < 20; i++) {
        if (fixture_insert_job(store, i, id) != STORE_OK) {
            return 2;
        }
    }
    if (fixture_put_mesh(store, small, 100, id, &created) != STORE_OK) {
        return 3;
    }
    return fixture_put_mesh(store, large, LARGE, id, &created) == STORE_OK ? 0 : 4;
}

static void what_was_acknowledged_survives_an_abrupt_end(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *large = fixture_bytes(LARGE, 6), *content;
    char id[STORE_ID_MAX];
    struct store_job job;
    size_t size, count;

    assert_int_equal(in_child(put_and_vanish, fixture->path), 0);
    fixture->store = fixture_store(fixture->path);
    assert_int_equal(store_job_count(fixture->store, STORE_JOB_ACCEPTED, &count), STORE_OK);
    assert_int_equal(count, 20);
    assert_int_equal(store_job_get(fixture->store, "job-00000019", &job), STORE_OK);
    assert_string_equal(job.inputs, "{\"number\":19}");
    store_job_clear(&job);
    store_content_id(id, "mesh-", large, LARGE);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
    assert_memory_equal(content, large, LARGE);
    free(content);
    free(large);
}

#define CANNOT_MOUNT 77

/* Stores meshes of this size until one is refused, and returns with what. */
static int put_until_refused(struct store *store, unsigned char *bytes, size_t size)
{
    char id[STORE_ID_MAX];
    bool created;
    int status = STORE_OK;

    for (unsigned i = 0; i < 5000 && status == STORE_OK; i++) {
        memcpy(bytes, &i, sizeof i);
        status = fixture_put_mesh(store, bytes, size, id, &created);
    }
    return status;
}

/* The answer of a full disk is STORE_FULL, for files and for rows alike; what was acknowledged
   stays, reading goes on, and once there is room again so does writing. Returns the number of
   what failed. */
static int fill_the_disk(const char *path)
{
    unsigned char *bytes = fixture_bytes(400000, 7), *content;
    char message[256], id[STORE_ID_MAX], ballast[512];
    struct store *store;
    size_t size;
    bool created;

    snprintf(ballast, sizeof ballast, "%s/ballast", path);
    if (!small_disk_mount(path, "size=3m")) {
        return CANNOT_MOUNT;
    }
    write_file(ballast, bytes, 400000);
    if (store_open(&store, path, message, sizeof message) != STORE_OK ||
        fixture_put_mesh(store, bytes, 500, id, &created) != STORE_OK) {
        return 1;
    }
    if (put_until_refused(store, bytes, 400000) != STORE_FULL ||
        put_until_refused(store, bytes, 50000) != STORE_FULL ||
        put_until_refused(store, bytes, 1000) != STORE_FULL) {
        return 2;
    }
    if (store_ping(store) != STORE_OK ||
        store_mesh_content(store, id, &content, &size) != STORE_OK || size != 500) {
        return 3;
    }
    unlink(ballast);
    bytes[20] ^= 0xff;
    if (fixture_put_mesh(store, bytes, 1000, id, &created) != STORE_OK || !created) {
        return 4;
    }
    if (store_mesh_content(store, id, &content, &size) != STORE_OK || size != 1000 ||
        memcmp(content, bytes, size) != 0) {
        return 5;
    }
    store_close(store);
    return store_open(&store, path, message, sizeof message) == STORE_OK ? 0 : 6;
}

static void a_full_disk_is_an_answer(void **state)
{
    struct fixture *fixture = *state;
    int status = in_child(fill_the_disk, fixture->path);

    if (status == CANNOT_MOUNT) {
        print_message("# no right to mount a small file system\n");
        skip();
    }
    assert_int_equal(status, 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup_closed, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(what_was_acknowledged_survives_an_abrupt_end),
        TEST(a_full_disk_is_an_answer),
        TEST(a_directory_is_made_with_its_parents),
        TEST(a_second_daemon_is_kept_out),
        TEST(another_applications_database_is_refused),
        TEST(a_newer_database_is_refused),
        TEST(what_is_no_database_is_refused),
        TEST(a_damaged_database_is_refused),
        TEST(a_blob_that_is_gone_or_changed_is_corrupt),
        TEST(large_results_go_with_their_last_job),
        TEST(temporary_files_do_not_stay),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
