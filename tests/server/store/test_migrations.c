/*
 * A database of each older version becomes one of the newest, with everything in it: what is put
 * into it as that version had it is found through today's functions, belongs to the owner "", and
 * is counted.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <sqlite3.h>

#include "embedded.h"
#include "fixture.h"
#include "store/cohort.h"
#include "store/holdings.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"

#define H1 "1111111111111111111111111111111111111111111111111111111111111111"
#define H2 "2222222222222222222222222222222222222222222222222222222222222222"
#define H3 "3333333333333333333333333333333333333333333333333333333333333333"

/* Of version 1: contents need not be what their hashes say, only rows are read. */
static const char rows_1[] =
    "INSERT INTO blob VALUES ('" H1 "', 3, x'616263'), ('" H2 "', 600, zeroblob(600)), "
    "('" H3 "', 2, x'7b7d');"
    "INSERT INTO mesh VALUES ('mesh-1', 'a mesh', 'ply', '{}', 3, 1, 1, 5, '" H1 "');"
    "INSERT INTO surface VALUES ('surf-1', 'a surface', '{\"area\":1}', 4, 6, '" H2 "');"
    "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, progress, "
    "created_ms, updated_ms) VALUES "
    "('job-1', 'encode', 'accepted', '{}', '" H1 "', 'b', '', 0, 7, 7);"
    "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, progress, "
    "created_ms, updated_ms, results) VALUES "
    "('job-2', 'encode', 'successful', '{}', '" H2 "', 'b', '', 100, 8, 8, '" H3 "');";
static const char rows_2[] =
    "INSERT INTO cohort VALUES ('group', '[]', '" H1 "', 2, 9);"
    "INSERT INTO cohort_member VALUES ('group', 0, 'mesh-1', NULL), ('group', 1, NULL, 'surf-1');"
    "INSERT INTO model VALUES ('model-1', '{}', 'surf-1', 4, 1, 1, 1, 1, 10);"
    "INSERT INTO model_array VALUES ('model-1', 'modes', '" H2 "');";
static const char rows_3[] =
    "INSERT INTO surface_maps VALUES ('surf-1', 'fdr', 1, 1, 1, '" H3 "');";
/* With what rows count for since version 8: a mesh, a surface and two jobs with their inputs; a
   model, which needs its mean, and a cohort of two. */
#define BYTES_1 (3 + 600 + 2 + 2 * 1024 + 2 * (2048 + 2))
#define BYTES_2 (BYTES_1 + 600 + 1024 + 1024 + 2 * 512 + 2 + 256)
#define BYTES_3 (BYTES_2 + 2)

static void execute(sqlite3 *db, const char *sql)
{
    char *message = NULL;

    if (sqlite3_exec(db, sql, NULL, NULL, &message) != SQLITE_OK) {
        fail_msg("%s", message);
    }
}

/* Makes the database as that version had it, 1 to 3. */
static void make_database(const struct fixture *fixture, int version)
{
    char path[512], pragma[80];
    sqlite3 *db = NULL;

    snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    for (int number = 1; number <= version; number++) {
        const struct embedded_file *file = embedded_files;

        while (file->path &&
               strtol(file->path + strcspn(file->path, "0123456789"), NULL, 10) != number) {
            file++;
        }
        assert_non_null(file->path);
        execute(db, (const char *)file->bytes);
    }
    execute(db, rows_1);
    if (version > 1) {
        execute(db, rows_2);
    }
    if (version > 2) {
        execute(db, rows_3);
    }
    snprintf(pragma, sizeof pragma, "PRAGMA application_id = %d; PRAGMA user_version = %d",
             0x53524e46, version);
    execute(db, pragma);
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

static int count(const char *path, const char *sql)
{
    sqlite3_stmt *statement = NULL;
    sqlite3 *db = NULL;
    int rows = 0;

    assert_int_equal(sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_prepare_v2(db, sql, -1, &statement, NULL), SQLITE_OK);
    while (sqlite3_step(statement) == SQLITE_ROW) {
        rows++;
    }
    sqlite3_finalize(statement);
    sqlite3_close(db);
    return rows;
}

static void check_version_1(struct store *store, int64_t bytes)
{
    struct store_surface surface;
    struct store_mesh mesh;
    struct store_job job;
    int64_t held;

    assert_int_equal(store_owner_has(store, "", "mesh-1"), STORE_OK);
    assert_int_equal(store_owner_has(store, "", "surf-1"), STORE_OK);
    assert_int_equal(store_owner_has(store, "", "job-1"), STORE_OK);
    assert_int_equal(store_owner_has(store, "ada", "mesh-1"), STORE_NOT_FOUND);
    assert_int_equal(store_mesh_get_as(store, "", "mesh-1", &mesh), STORE_OK);
    assert_string_equal(mesh.name, "a mesh");
    assert_int_equal(mesh.created_ms, 5);
    store_mesh_clear(&mesh);
    assert_int_equal(store_surface_get(store, "surf-1", false, &surface), STORE_OK);
    assert_string_equal(surface.record, "{\"area\":1}");
    store_surface_clear(&surface);
    assert_int_equal(store_owner_bytes(store, "", &held, NULL), STORE_OK);
    assert_int_equal(held, bytes);
    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    assert_string_equal(job.id, "job-1");
    assert_string_equal(job.owner, "");
    assert_string_equal(job.trace, "");
    store_job_clear(&job);
}

static void version_1_is_brought_up(void **state)
{
    struct fixture *fixture = *state;

    make_database(fixture, 1);
    fixture->store = fixture_store(fixture->path);
    check_version_1(fixture->store, BYTES_1);
}

static void check_version_2(struct fixture *fixture)
{
    struct store_cohort cohort;
    struct store_model model;
    char path[512];

    assert_int_equal(store_cohort_get(fixture->store, "group", &cohort), STORE_OK);
    assert_int_equal(cohort.n_members, 2);
    assert_string_equal(cohort.members[0], "mesh-1");
    assert_string_equal(cohort.members[1], "surf-1");
    store_cohort_clear(&cohort);
    assert_int_equal(store_owner_has(fixture->store, "", "model-1"), STORE_OK);
    assert_int_equal(
        store_model_get(fixture->store, "model-1", 1u << STORE_MODEL_CALIBRATION, &model),
        STORE_OK);
    assert_null(model.arrays[STORE_MODEL_CALIBRATION]);
    store_model_clear(&model);
    snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(count(path, "SELECT 1 FROM model_array WHERE model = 'model-1' AND name = "
                                 "'modes' AND content = '" H2 "'"),
                     1);
    assert_int_equal(count(path, "PRAGMA foreign_key_check"), 0);
    assert_int_equal(count(path, "SELECT 1 FROM pragma_integrity_check WHERE integrity_check <> "
                                 "'ok'"),
                     0);
    /* And opened once more it stays as it is. */
    fixture_reopen(fixture);
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "group", NULL), STORE_OK);
    assert_int_equal(count(path, "SELECT 1 FROM cohort_member"), 0);
}

static void version_2_is_brought_up(void **state)
{
    struct fixture *fixture = *state;

    make_database(fixture, 2);
    fixture->store = fixture_store(fixture->path);
    check_version_1(fixture->store, BYTES_2);
    check_version_2(fixture);
}

static void version_3_is_brought_up(void **state)
{
    struct fixture *fixture = *state;

    make_database(fixture, 3);
    fixture->store = fixture_store(fixture->path);
    check_version_1(fixture->store, BYTES_3);
    check_version_2(fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(version_1_is_brought_up, fixture_setup_closed,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(version_2_is_brought_up, fixture_setup_closed,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(version_3_is_brought_up, fixture_setup_closed,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
