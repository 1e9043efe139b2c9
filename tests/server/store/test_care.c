/*
 * What the store does about its own health: ended jobs go with time and nothing that is needed goes
 * with them, files without a row are swept unless a backup is being made, damaged content is mended
 * by the same content, verification tells one kind of damage from another, and backups hold up
 * removal.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>

#include "fixture.h"
#include "store/digest.h"
#include "store/maintenance.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/store.h"
#include "store/surface.h"

#define LARGE (STORE_INLINE_MAX + 1000)

/* The blob file of these bytes. */
static void blob_path(const struct fixture *fixture, const void *bytes, size_t size, char path[512])
{
    char hex[65];

    store_sha256_hex(hex, bytes, size);
    snprintf(path, 512, "%s/blobs/%.2s/%s", fixture->path, hex, hex);
}

static void write_file(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");

    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* Claims the oldest job and ends it with these results. */
static void succeed(struct store *store, const char *results)
{
    struct store_job job;

    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job.id, job.attempt, STORE_JOB_SUCCESSFUL, results, NULL, NULL),
        STORE_OK);
    store_job_clear(&job);
}

/* ---- Retention ------------------------------------------------------------------------------- */

static void ended_jobs_go_and_others_stay(void **state)
{
    struct fixture *fixture = *state;
    char *results = malloc(LARGE + 1), id[3][STORE_ID_MAX], path[512], *text;
    struct store_job job;
    size_t removed, size;

    memset(results, 'r', LARGE);
    results[LARGE] = '\0';
    for (int i = 0; i < 3; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id[i]), STORE_OK);
    }
    succeed(fixture->store, results);
    assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
    store_job_clear(&job);
    blob_path(fixture, results, LARGE, path);

    /* Nothing has ended before the epoch; the first has ended before tomorrow. */
    assert_int_equal(store_expire_jobs(fixture->store, 1, &removed), STORE_OK);
    assert_int_equal(removed, 0);
    assert_int_equal(store_job_results(fixture->store, id[0], &text, &size), STORE_OK);
    free(text);
    assert_int_equal(store_expire_jobs(fixture->store, store_now_ms() + 86400000, &removed),
                     STORE_OK);
    assert_int_equal(removed, 1);
    assert_int_equal(store_job_get(fixture->store, id[0], &job), STORE_NOT_FOUND);
    assert_int_equal(fixture_status(fixture->store, id[1]), STORE_JOB_RUNNING);
    assert_int_equal(fixture_status(fixture->store, id[2]), STORE_JOB_ACCEPTED);
    fixture_reopen(fixture);
    assert_int_equal(access(path, F_OK), -1);
    free(results);
}

static void many_jobs_go_at_once(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    size_t removed, count;

    for (int i = 0; i < 130; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
        succeed(fixture->store, "{}");
    }
    assert_int_equal(store_expire_jobs(fixture->store, store_now_ms() + 1000, &removed), STORE_OK);
    assert_int_equal(removed, 130);
    assert_int_equal(store_job_count(fixture->store, STORE_JOB_SUCCESSFUL, &count), STORE_OK);
    assert_int_equal(count, 0);
}

static void results_that_a_mesh_shares_stay(void **state)
{
    struct fixture *fixture = *state;
    char *bytes = malloc(LARGE + 1), id[STORE_ID_MAX], mesh[STORE_ID_MAX];
    unsigned char *content;
    size_t removed, size;
    bool created;

    memset(bytes, 's', LARGE);
    bytes[LARGE] = '\0';
    assert_int_equal(
        fixture_put_mesh(fixture->store, (unsigned char *)bytes, LARGE, mesh, &created), STORE_OK);
    assert_int_equal(fixture_insert_job(fixture->store, 1, id), STORE_OK);
    succeed(fixture->store, bytes);
    assert_int_equal(store_expire_jobs(fixture->store, store_now_ms() + 1000, &removed), STORE_OK);
    assert_int_equal(removed, 1);
    fixture_reopen(fixture);
    assert_int_equal(store_mesh_content(fixture->store, mesh, &content, &size), STORE_OK);
    free(content);
    free(bytes);
}

/* ---- Files without a row --------------------------------------------------------------------- */

static void stray_files_are_swept_unless_a_backup_runs(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(LARGE, 1), *content;
    char stray[512], blobs[512], id[STORE_ID_MAX], hash[65];
    size_t removed, size;
    bool created;
    int fd;

    assert_int_equal(fixture_put_mesh(fixture->store, bytes, LARGE, id, &created), STORE_OK);
    store_sha256_hex(hash, bytes, LARGE);
    hash[63] = hash[63] == '0' ? '1' : '0';
    snprintf(stray, sizeof stray, "%s/blobs/%.2s/%s", fixture->path, hash, hash);
    snprintf(blobs, sizeof blobs, "%s/blobs", fixture->path);
    write_file(stray, "stray", 5);

    fd = open(blobs, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    assert_true(fd >= 0);
    assert_int_equal(flock(fd, LOCK_SH), 0);
    assert_int_equal(store_sweep_files(fixture->store, &removed), STORE_OK);
    assert_int_equal(removed, 0);
    assert_int_equal(access(stray, F_OK), 0);
    close(fd);
    assert_int_equal(store_sweep_files(fixture->store, &removed), STORE_OK);
    assert_int_equal(removed, 1);
    assert_int_equal(access(stray, F_OK), -1);
    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
    free(content);
    free(bytes);
}

/* ---- Damage ---------------------------------------------------------------------------------- */

static void the_same_content_mends(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(LARGE, 2), *content;
    static const size_t sizes[] = {700, LARGE};
    char path[512], id[STORE_ID_MAX];
    bool created;
    size_t size;

    for (int i = 0; i < 2; i++) {
        assert_int_equal(fixture_put_mesh(fixture->store, bytes, sizes[i], id, &created), STORE_OK);
    }
    fixture_damage_inline(fixture);
    blob_path(fixture, bytes, LARGE, path);
    assert_int_equal(unlink(path), 0);
    for (int i = 0; i < 2; i++) {
        store_content_id(id, "mesh-", bytes, sizes[i]);
        assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_CORRUPT);
        assert_int_equal(fixture_put_mesh(fixture->store, bytes, sizes[i], id, &created), STORE_OK);
        assert_false(created);
        assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
        assert_int_equal(size, sizes[i]);
        assert_memory_equal(content, bytes, size);
        free(content);
    }
    free(bytes);
}

static void the_same_surface_mends(void **state)
{
    struct fixture *fixture = *state;
    double coefficients[3 * 25];
    struct store_surface surface = {.lmax = 4, .coefficient_count = 75}, got;
    bool created;

    for (int i = 0; i < 75; i++) {
        coefficients[i] = 0.25 * i;
    }
    surface.coefficients = coefficients;
    store_surface_id(surface.id, 4, coefficients, 1.0);
    assert_int_equal(store_surface_put(fixture->store, &surface, &created), STORE_OK);
    fixture_damage_inline(fixture);
    assert_int_equal(store_surface_get(fixture->store, surface.id, true, &got), STORE_CORRUPT);
    assert_int_equal(store_surface_put(fixture->store, &surface, &created), STORE_OK);
    assert_false(created);
    assert_int_equal(store_surface_get(fixture->store, surface.id, true, &got), STORE_OK);
    assert_memory_equal(got.coefficients, coefficients, sizeof coefficients);
    store_surface_clear(&got);
    surface.coefficients = NULL;
    store_surface_clear(&surface);
}

static void damage_of_rows_is_told(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(900, 3);
    struct store_report report;
    char id[STORE_ID_MAX], message[256], copy[512];
    bool created;

    snprintf(copy, sizeof copy, "%s/copy", fixture->path);
    assert_int_equal(fixture_put_mesh(fixture->store, bytes, 900, id, &created), STORE_OK);
    assert_int_equal(store_verify(fixture->path, false, NULL, &report, message, sizeof message),
                     STORE_OK);
    assert_true(report.in_use);
    assert_int_equal(report.blobs, 1);
    assert_int_equal(report.bytes, 900);
    assert_int_equal(
        store_backup(fixture->path, copy, false, NULL, &report, message, sizeof message), STORE_OK);
    fixture_damage_inline(fixture);
    assert_int_equal(store_verify(fixture->path, false, NULL, &report, message, sizeof message),
                     STORE_CORRUPT);
    assert_int_equal(report.damaged, 1);
    assert_int_equal(report.missing, 0);
    assert_int_equal(store_verify(copy, true, NULL, &report, message, sizeof message), STORE_OK);
    assert_false(report.in_use);
    assert_int_equal(report.blobs, 1);
    assert_int_equal(store_verify(fixture->path, true, NULL, &report, message, sizeof message),
                     STORE_BUSY);
    free(bytes);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(ended_jobs_go_and_others_stay),   TEST(many_jobs_go_at_once),
        TEST(results_that_a_mesh_shares_stay), TEST(stray_files_are_swept_unless_a_backup_runs),
        TEST(the_same_content_mends),          TEST(the_same_surface_mends),
        TEST(damage_of_rows_is_told),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
