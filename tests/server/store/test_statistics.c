/*
 * test_statistics.c - cohorts, models and checkpoints in the store: what is put comes back, what
 * is named stays, and what nobody names any more goes, on the disk too.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <sqlite3.h>

#include "server/store/fixture.h"
#include "store/cohort.h"
#include "store/holdings.h"
#include "store/job.h"
#include "store/model.h"
#include "store/page.h"
#include "store/surface.h"

#define LMAX 4
#define ROWS 8
#define COLUMNS 16
#define SUBJECTS 3
#define COMPONENTS 2
/* Of the model of test_model_is_what_it_is_made_of before ids covered more than arrays. */
#define OLD_ID "model-b77d6bac6b443679e8cb6b1742f47c23"

static void put_surface(struct store *store, double value, char id[STORE_ID_MAX])
{
    struct store_surface surface = {.lmax = LMAX, .coefficient_count = 3 * (LMAX + 1) * (LMAX + 1)};
    bool created;

    surface.coefficients = calloc(surface.coefficient_count, sizeof(double));
    assert_non_null(surface.coefficients);
    surface.coefficients[2] = value;
    surface.name = strdup("");
    surface.record = strdup("{}");
    store_surface_id(surface.id, surface.lmax, surface.coefficients, 1.0);
    memcpy(id, surface.id, STORE_ID_MAX);
    assert_int_equal(store_surface_put(store, &surface, &created), STORE_OK);
    store_surface_clear(&surface);
}

/* Runs SQL on a connection of its own, as another program would. */
static int run_sql(const struct fixture *fixture, const char *sql)
{
    char path[512];
    sqlite3 *db = NULL;
    int rc;

    (void)snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    (void)sqlite3_exec(db, "PRAGMA foreign_keys = ON", NULL, NULL, NULL);
    rc = sqlite3_exec(db, sql, NULL, NULL, NULL);
    sqlite3_close(db);
    return rc;
}

/* Files below blobs/. */
static size_t count_files(const struct fixture *fixture)
{
    char path[512];
    size_t count = 0;
    DIR *folder;

    for (int i = 0; i < 256; i++) {
        (void)snprintf(path, sizeof path, "%s/blobs/%02x", fixture->path, i);
        folder = opendir(path);
        for (const struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
            count += entry->d_name[0] != '.';
        }
        if (folder) {
            closedir(folder);
        }
    }
    return count;
}

/* ---- Cohorts --------------------------------------------------------------------------------- */

static struct store_cohort make_cohort(const char *name, const char *record,
                                       char ids[][STORE_ID_MAX], size_t n)
{
    struct store_cohort cohort = {.record = strdup(record), .n_members = n};

    memcpy(cohort.name, name, strlen(name) + 1);
    cohort.members = malloc(n * sizeof *cohort.members);
    assert_non_null(cohort.members);
    memcpy(cohort.members, ids, n * sizeof *cohort.members);
    return cohort;
}

static int put_cohort(struct store *store, const char *name, const char *record,
                      char ids[][STORE_ID_MAX], size_t n, bool *created, size_t *missing)
{
    struct store_cohort cohort = make_cohort(name, record, ids, n);
    int status = store_cohort_put(store, &cohort, created, missing);

    store_cohort_clear(&cohort);
    return status;
}

static void test_cohort(void **state)
{
    struct fixture *fixture = *state;
    char ids[4][STORE_ID_MAX];
    struct store_cohort cohort;
    bool created;
    size_t missing;

    put_surface(fixture->store, 1.0, ids[0]);
    assert_int_equal(
        fixture_put_mesh(fixture->store, (const unsigned char *)"mesh", 4, ids[1], &created), 0);
    put_surface(fixture->store, 2.0, ids[2]);
    memcpy(ids[3], ids[0], STORE_ID_MAX);

    assert_int_equal(put_cohort(fixture->store, "a", "[1]", ids, 4, &created, &missing), STORE_OK);
    assert_true(created);
    assert_int_equal(put_cohort(fixture->store, "a", "[1]", ids, 4, &created, &missing), STORE_OK);
    assert_false(created);
    assert_int_equal(put_cohort(fixture->store, "a", "[2]", ids, 4, &created, &missing),
                     STORE_CONFLICT);

    fixture_reopen(fixture);
    assert_int_equal(store_cohort_get(fixture->store, "a", &cohort), STORE_OK);
    assert_string_equal(cohort.record, "[1]");
    assert_int_equal(strlen(cohort.digest), 64);
    assert_int_equal(cohort.n_members, 4);
    assert_true(cohort.created_ms > 0);
    assert_memory_equal(cohort.members, ids, sizeof ids);
    store_cohort_clear(&cohort);

    assert_int_equal(store_cohort_delete_as(fixture->store, "", "a", NULL), STORE_OK);
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "a", NULL), STORE_NOT_FOUND);
    assert_int_equal(store_cohort_get(fixture->store, "a", &cohort), STORE_NOT_FOUND);
    assert_int_equal(put_cohort(fixture->store, "a", "[2]", ids, 1, &created, &missing), STORE_OK);
}

/* A member that is not there leaves nothing behind, and is told by its number. */
static void test_missing_member(void **state)
{
    struct fixture *fixture = *state;
    char ids[3][STORE_ID_MAX] = {"", "mesh-00000000000000000000000000000000",
                                 "surf-00000000000000000000000000000000"};
    struct store_cohort cohort;
    bool created;
    size_t missing;

    put_surface(fixture->store, 1.0, ids[0]);
    assert_int_equal(put_cohort(fixture->store, "a", "[]", ids, 3, &created, &missing),
                     STORE_NOT_FOUND);
    assert_int_equal(missing, 1);
    assert_false(created);
    assert_int_equal(store_cohort_get(fixture->store, "a", &cohort), STORE_NOT_FOUND);
    memcpy(ids[1], ids[0], STORE_ID_MAX);
    assert_int_equal(put_cohort(fixture->store, "a", "[]", ids, 3, &created, &missing),
                     STORE_NOT_FOUND);
    assert_int_equal(missing, 2);
}

static void test_members_stay(void **state)
{
    struct fixture *fixture = *state;
    char ids[1][STORE_ID_MAX];
    bool created;
    size_t missing;

    put_surface(fixture->store, 1.0, ids[0]);
    assert_int_equal(put_cohort(fixture->store, "a", "[]", ids, 1, &created, &missing), STORE_OK);
    assert_int_equal(run_sql(fixture, "DELETE FROM surface"), SQLITE_CONSTRAINT);
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "a", NULL), STORE_OK);
    assert_int_equal(run_sql(fixture, "DELETE FROM surface"), SQLITE_OK);
}

static bool note_name(void *user, const struct store_cohort *cohort)
{
    char *names = user;
    size_t used = strlen(names);

    assert_null(cohort->members);
    (void)snprintf(names + used, 64 - used, "%s ", cohort->name);
    return true;
}

static void test_cohort_list(void **state)
{
    struct fixture *fixture = *state;
    struct store_page page = {.limit = 2};
    struct store_cohort last;
    char ids[1][STORE_ID_MAX], names[64] = "";
    bool created;
    size_t missing;

    put_surface(fixture->store, 1.0, ids[0]);
    for (const char *name = "abc"; *name; name++) {
        const char text[2] = {*name, '\0'};
        assert_int_equal(put_cohort(fixture->store, text, "[]", ids, 1, &created, &missing), 0);
        usleep(2000);
    }
    assert_int_equal(store_cohort_list(fixture->store, &page, note_name, names), STORE_OK);
    assert_string_equal(names, "c b ");
    assert_int_equal(store_cohort_get(fixture->store, "b", &last), STORE_OK);
    page.after_id = "b";
    page.after_ms = last.created_ms;
    store_cohort_clear(&last);
    assert_int_equal(store_cohort_list(fixture->store, &page, note_name, names), STORE_OK);
    assert_string_equal(names, "c b a ");
}

/* ---- Models ---------------------------------------------------------------------------------- */

#define ALL_ARRAYS ((1u << STORE_MODEL_ARRAYS) - 1)

static struct store_model make_model(const char *mean, double value)
{
    struct store_model model = {.record = strdup("{\"made\":1}"),
                                .lmax = LMAX,
                                .n_theta = ROWS,
                                .n_phi = COLUMNS,
                                .subjects = SUBJECTS,
                                .components = COMPONENTS};

    memcpy(model.mean, mean, strlen(mean) + 1);
    for (size_t a = 0; a < STORE_MODEL_ARRAYS; a++) {
        size_t count = store_model_count(&model, (enum store_model_array)a);
        model.arrays[a] = calloc(count, sizeof(double));
        assert_non_null(model.arrays[a]);
        for (size_t i = 0; i < count; i++) {
            model.arrays[a][i] = value * (double)(i % 17) + (double)a;
        }
    }
    return model;
}

static void test_model(void **state)
{
    struct fixture *fixture = *state;
    struct store_model model, again, other, got;
    char mean[STORE_ID_MAX];
    bool created;

    put_surface(fixture->store, 1.0, mean);
    model = make_model(mean, 0.25);
    assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_OK);
    assert_true(created);
    assert_int_equal(strncmp(model.id, "model-", 6), 0);
    assert_int_equal(strlen(model.id), 38);

    /* The same content under another record is the model that is there; -0 is 0. */
    again = make_model(mean, 0.25);
    again.arrays[STORE_MODEL_MEAN_Q][0] = -0.0;
    free(again.record);
    again.record = strdup("{\"made\":2}");
    assert_int_equal(store_model_put(fixture->store, &again, &created), STORE_OK);
    assert_false(created);
    assert_string_equal(again.id, model.id);
    assert_string_equal(again.record, "{\"made\":1}");
    other = make_model(mean, 0.5);
    assert_int_equal(store_model_put(fixture->store, &other, &created), STORE_OK);
    assert_true(created);
    assert_string_not_equal(other.id, model.id);

    fixture_reopen(fixture);
    assert_int_equal(store_model_get(fixture->store, model.id, ALL_ARRAYS, &got), STORE_OK);
    assert_string_equal(got.mean, mean);
    assert_int_equal(got.components, COMPONENTS);
    for (size_t a = 0; a < STORE_MODEL_ARRAYS; a++) {
        size_t count = store_model_count(&model, (enum store_model_array)a);
        assert_memory_equal(got.arrays[a], model.arrays[a], count * sizeof(double));
    }
    store_model_clear(&got);
    assert_int_equal(store_model_get(fixture->store, model.id, 1u << STORE_MODEL_EIGENVALUES, &got),
                     STORE_OK);
    assert_non_null(got.arrays[STORE_MODEL_EIGENVALUES]);
    assert_null(got.arrays[STORE_MODEL_MODES]);
    store_model_clear(&got);
    assert_int_equal(run_sql(fixture, "DELETE FROM surface"), SQLITE_CONSTRAINT);
    store_model_clear(&model);
    store_model_clear(&again);
    store_model_clear(&other);
}

/* A model of older versions, which had no calibration, is another one than with it. */
static void test_model_without_calibration(void **state)
{
    struct fixture *fixture = *state;
    struct store_model model, old, got;
    char mean[STORE_ID_MAX];
    int64_t before, after;
    bool created;

    put_surface(fixture->store, 1.0, mean);
    old = make_model(mean, 0.25);
    free(old.arrays[STORE_MODEL_CALIBRATION]);
    old.arrays[STORE_MODEL_CALIBRATION] = NULL;
    assert_int_equal(store_model_put(fixture->store, &old, &created), STORE_OK);
    assert_true(created);
    assert_int_equal(store_model_put(fixture->store, &old, &created), STORE_OK);
    assert_false(created);
    assert_int_equal(store_owner_bytes(fixture->store, "", &before, NULL), STORE_OK);
    model = make_model(mean, 0.25);
    assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_OK);
    assert_true(created);
    assert_string_not_equal(model.id, old.id);
    assert_int_equal(store_owner_bytes(fixture->store, "", &after, NULL), STORE_OK);
    assert_true(after - before >= (int64_t)store_model_count(&model, STORE_MODEL_CALIBRATION) * 8);

    assert_int_equal(store_model_get(fixture->store, old.id, ALL_ARRAYS, &got), STORE_OK);
    assert_null(got.arrays[STORE_MODEL_CALIBRATION]);
    assert_non_null(got.arrays[STORE_MODEL_SCORES]);
    store_model_clear(&got);
    assert_int_equal(store_model_get(fixture->store, model.id, ALL_ARRAYS, &got), STORE_OK);
    assert_memory_equal(got.arrays[STORE_MODEL_CALIBRATION], model.arrays[STORE_MODEL_CALIBRATION],
                        store_model_count(&model, STORE_MODEL_CALIBRATION) * sizeof(double));
    store_model_clear(&got);
    store_model_clear(&model);
    store_model_clear(&old);
}

/* The same arrays, made of something else, are another model; of the same they are the first one,
   whatever else the record tells. One of older versions, without such a text, stays what it is. */
static void test_model_is_what_it_is_made_of(void **state)
{
    struct fixture *fixture = *state;
    const char *const identities[] = {NULL, "[\"a\",\"a\",\"b\"]", "[\"a\",\"b\",\"b\"]"};
    char mean[STORE_ID_MAX], ids[3][STORE_ID_MAX];
    struct store_model model, got;
    bool created;

    put_surface(fixture->store, 1.0, mean);
    model = make_model(mean, 0.25);
    for (size_t round = 0; round < 2; round++) {
        for (size_t k = 0; k < 3; k++) {
            model.identity = identities[k];
            free(model.record);
            model.record = strdup(round == 0 ? (k == 1 ? "{\"made\":1}" : "{\"made\":2}") : "{}");
            assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_OK);
            assert_true(created == (round == 0));
            assert_true(round == 0 || strcmp(ids[k], model.id) == 0);
            memcpy(ids[k], model.id, STORE_ID_MAX);
            assert_string_equal(model.record, k == 1 ? "{\"made\":1}" : "{\"made\":2}");
        }
    }
    /* Of the arrays alone, as it has always been: old ids are those of old models. */
    assert_string_equal(ids[0], OLD_ID);
    assert_string_not_equal(ids[0], ids[1]);
    assert_string_not_equal(ids[1], ids[2]);
    assert_string_not_equal(ids[0], ids[2]);
    fixture_reopen(fixture);
    for (size_t k = 0; k < 3; k++) {
        assert_int_equal(store_model_get(fixture->store, ids[k], ALL_ARRAYS, &got), STORE_OK);
        store_model_clear(&got);
    }
    store_model_clear(&model);
}

static void test_the_same_model_mends(void **state)
{
    struct fixture *fixture = *state;
    struct store_model model, got;
    char mean[STORE_ID_MAX];
    bool created;

    put_surface(fixture->store, 1.0, mean);
    model = make_model(mean, 0.25);
    assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_OK);
    fixture_damage_inline(fixture);
    for (size_t a = 0; a < STORE_MODEL_ARRAYS; a++) {
        assert_int_equal(store_model_get(fixture->store, model.id, 1u << a, &got), STORE_CORRUPT);
    }
    assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_OK);
    assert_false(created);
    assert_int_equal(store_model_get(fixture->store, model.id, ALL_ARRAYS, &got), STORE_OK);
    store_model_clear(&got);
    store_model_clear(&model);
}

static void test_model_without_mean(void **state)
{
    struct fixture *fixture = *state;
    struct store_model model = make_model("surf-00000000000000000000000000000000", 1.0), got;
    bool created;

    assert_int_equal(store_model_put(fixture->store, &model, &created), STORE_NOT_FOUND);
    assert_int_equal(store_model_get(fixture->store, model.id, 0, &got), STORE_NOT_FOUND);
    store_model_clear(&model);
}

/* ---- Checkpoints ----------------------------------------------------------------------------- */

static void expect_checkpoint(struct store *store, const char *job, const unsigned char *bytes,
                              size_t size)
{
    unsigned char *got = NULL;
    size_t got_size = 0;

    assert_int_equal(store_checkpoint_get(store, job, &got, &got_size), STORE_OK);
    assert_int_equal(got_size, size);
    assert_memory_equal(got, bytes, size);
    free(got);
}

static void expect_none(struct store *store, const char *job)
{
    unsigned char *got = NULL;
    size_t size = 0;

    assert_int_equal(store_checkpoint_get(store, job, &got, &size), STORE_NOT_FOUND);
    assert_null(got);
}

static void claim(struct store *store, char id[STORE_ID_MAX])
{
    struct store_job job;

    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    memcpy(id, job.id, STORE_ID_MAX);
    store_job_clear(&job);
}

/* Only the attempt that runs may write; each checkpoint takes the place of the one before, whose
   file goes; the last one goes with the job's end. */
static void test_checkpoint(void **state)
{
    static const enum store_job_status ends[] = {STORE_JOB_SUCCESSFUL, STORE_JOB_FAILED,
                                                 STORE_JOB_DISMISSED};
    struct fixture *fixture = *state;
    const size_t size = STORE_INLINE_MAX + 1000;
    unsigned char *first = fixture_bytes(size, 1), *second = fixture_bytes(size, 2);
    char id[STORE_ID_MAX], claimed[STORE_ID_MAX];

    for (int i = 0; i < 3; i++) {
        struct store *store = fixture->store;
        bool failed = ends[i] == STORE_JOB_FAILED, good = ends[i] == STORE_JOB_SUCCESSFUL;

        assert_int_equal(fixture_insert_job(store, i, id), STORE_OK);
        assert_int_equal(store_checkpoint_put(store, id, 0, first, size), STORE_CONFLICT);
        claim(store, claimed);
        assert_int_equal(store_checkpoint_put(store, id, 2, first, size), STORE_CONFLICT);
        expect_none(store, id);
        assert_int_equal(count_files(fixture), 0);
        assert_int_equal(store_checkpoint_put(store, id, 1, first, size), STORE_OK);
        assert_int_equal(store_checkpoint_put(store, id, 1, first, size), STORE_OK);
        expect_checkpoint(store, id, first, size);
        assert_int_equal(store_checkpoint_put(store, id, 1, second, size), STORE_OK);
        expect_checkpoint(store, id, second, size);
        assert_int_equal(count_files(fixture), 1);
        assert_int_equal(store_job_transition(store, id, 1, ends[i], good ? "{}" : NULL,
                                              failed ? "internal-error" : NULL, failed ? "" : NULL),
                         STORE_OK);
        expect_none(store, id);
        assert_int_equal(count_files(fixture), 0);
    }
    free(first);
    free(second);
}

/* A job that is cut short or put back keeps its checkpoint; one that is given up loses it. */
static void test_checkpoint_recovery(void **state)
{
    struct fixture *fixture = *state;
    const size_t size = STORE_INLINE_MAX + 1;
    unsigned char *bytes = fixture_bytes(size, 3);
    char a[STORE_ID_MAX], b[STORE_ID_MAX], claimed[STORE_ID_MAX];
    size_t requeued, failed;
    struct store_job job;

    assert_int_equal(fixture_insert_job(fixture->store, 1, a), STORE_OK);
    assert_int_equal(fixture_insert_job(fixture->store, 2, b), STORE_OK);
    claim(fixture->store, claimed);
    claim(fixture->store, claimed);
    assert_int_equal(store_checkpoint_put(fixture->store, a, 1, bytes, size), STORE_OK);
    assert_int_equal(store_checkpoint_put(fixture->store, b, 1, bytes, size), STORE_OK);
    assert_int_equal(
        store_job_transition(fixture->store, b, 1, STORE_JOB_ACCEPTED, NULL, NULL, NULL), STORE_OK);
    fixture_reopen(fixture);
    assert_int_equal(store_job_recover(fixture->store, 2, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(requeued, 1);
    expect_checkpoint(fixture->store, a, bytes, size);
    expect_checkpoint(fixture->store, b, bytes, size);
    claim(fixture->store, claimed);
    assert_int_equal(store_job_request_cancel(fixture->store, b, &job), STORE_OK);
    store_job_clear(&job);
    expect_none(fixture->store, b);
    assert_int_equal(count_files(fixture), 1);
    assert_int_equal(store_job_recover(fixture->store, 2, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(requeued, 1);
    expect_checkpoint(fixture->store, a, bytes, size);
    assert_int_equal(store_job_claim_alone(fixture->store, &job), STORE_OK);
    store_job_clear(&job);
    assert_int_equal(store_job_recover(fixture->store, 2, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(failed, 1);
    expect_none(fixture->store, a);
    assert_int_equal(count_files(fixture), 0);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_cohort, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_missing_member, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_members_stay, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_cohort_list, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_model, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_model_without_calibration, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(test_model_is_what_it_is_made_of, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(test_the_same_model_mends, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_model_without_mean, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_checkpoint, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(test_checkpoint_recovery, fixture_setup, fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
