/*
 * What is stored for one owner is that owner's: the same content of two owners has two names and
 * two times, lists and cohorts are each one's own, bytes are counted exactly and limited, and the
 * queue takes the owners in turn.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/cohort.h"
#include "store/digest.h"
#include "store/holdings.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/page.h"
#include "store/surface.h"

#define OWNERS 4

static int put_mesh(struct store *store, const char *owner, int64_t bytes_max, const char *name,
                    const unsigned char *bytes, size_t size, bool *created)
{
    struct store_mesh mesh = {.name = strdup(name),
                              .format = strdup("ply"),
                              .report = strdup("{}"),
                              .bytes = (int64_t)size,
                              .owner = {owner, bytes_max}};
    int status;

    store_content_id(mesh.id, "mesh-", bytes, size);
    status = store_mesh_put(store, &mesh, bytes, created);
    if (status == STORE_OK) {
        assert_string_equal(mesh.name, name);
        assert_true(mesh.created_ms > 0);
    }
    store_mesh_clear(&mesh);
    return status;
}

#define STORE_ROW_MOST 4096 /* that a row alone may count for */

static int64_t bytes_of(struct store *store, const char *owner)
{
    int64_t bytes = -1;

    assert_int_equal(store_owner_bytes(store, owner, &bytes, NULL), STORE_OK);
    return bytes;
}

/* ---- Content --------------------------------------------------------------------------------- */

static void content_has_a_name_for_each_owner(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(1000, 1);
    struct store_mesh mesh;
    char id[STORE_ID_MAX];
    bool created;

    store_content_id(id, "mesh-", bytes, 1000);
    assert_int_equal(put_mesh(store, "ada", 0, "hers", bytes, 1000, &created), STORE_OK);
    assert_true(created);
    assert_int_equal(store_owner_has(store, "ben", id), STORE_NOT_FOUND);
    assert_int_equal(put_mesh(store, "ben", 0, "his", bytes, 1000, &created), STORE_OK);
    assert_true(created);
    assert_int_equal(put_mesh(store, "ben", 0, "his", bytes, 1000, &created), STORE_OK);
    assert_false(created);
    assert_int_equal(store_owner_has(store, "ada", id), STORE_OK);
    assert_int_equal(store_owner_has(store, "ben", id), STORE_OK);
    assert_int_equal(store_owner_has(store, NULL, id), STORE_NOT_FOUND);
    assert_int_equal(store_mesh_get_as(store, "ben", id, &mesh), STORE_OK);
    assert_string_equal(mesh.name, "his");
    store_mesh_clear(&mesh);
    assert_int_equal(store_mesh_get_as(store, "ada", id, &mesh), STORE_OK);
    assert_string_equal(mesh.name, "hers");
    store_mesh_clear(&mesh);
    assert_in_range(bytes_of(store, "ada"), 1000, 1000 + STORE_ROW_MOST);
    assert_in_range(bytes_of(store, "ben"), 1000, 1000 + STORE_ROW_MOST);
    assert_int_equal(bytes_of(store, ""), 0);
    free(bytes);
}

static int put_surface(struct store *store, const char *owner, const char *record,
                       char id[STORE_ID_MAX])
{
    struct store_surface surface = {.lmax = 4,
                                    .name = strdup("s"),
                                    .record = strdup(record),
                                    .coefficient_count = 75,
                                    .owner = {owner, 0}};
    bool created;
    int status;

    surface.coefficients = calloc(75, sizeof(double));
    surface.coefficients[1] = 1;
    store_surface_id(surface.id, 4, surface.coefficients, 1);
    memcpy(id, surface.id, STORE_ID_MAX);
    status = store_surface_put(store, &surface, &created);
    assert_true(created);
    assert_string_equal(surface.record, record);
    store_surface_clear(&surface);
    return status;
}

/* The record of a surface names the job that made it: nobody reads another's. */
static void surfaces_have_a_record_for_each_owner(void **state)
{
    static const char *const owners[] = {"ada", "ben", ""};
    struct fixture *fixture = *state;
    struct store_surface surface;
    char id[STORE_ID_MAX], record[32];

    for (size_t i = 0; i < 3; i++) {
        snprintf(record, sizeof record, "{\"of\":\"%s\"}", owners[i]);
        assert_int_equal(put_surface(fixture->store, owners[i], record, id), STORE_OK);
    }
    for (size_t i = 0; i < 3; i++) {
        snprintf(record, sizeof record, "{\"of\":\"%s\"}", owners[i]);
        assert_int_equal(store_surface_get_as(fixture->store, owners[i], id, true, &surface),
                         STORE_OK);
        assert_string_equal(surface.record, record);
        assert_int_equal(surface.coefficient_count, 75);
        store_surface_clear(&surface);
        assert_in_range(bytes_of(fixture->store, owners[i]), 600, 600 + STORE_ROW_MOST);
    }
}

struct names {
    char text[256];
};

static bool note_mesh(void *user, const struct store_mesh *mesh)
{
    struct names *names = user;
    size_t used = strlen(names->text);

    snprintf(names->text + used, sizeof names->text - used, "%s ", mesh->name);
    return true;
}

static void lists_show_what_is_the_owners(void **state)
{
    struct fixture *fixture = *state;
    struct names hers = {""}, all = {""};
    struct store_page page = {.limit = 10, .owner = "ada"};
    char name[16];
    bool created;

    for (unsigned i = 0; i < 6; i++) {
        unsigned char *bytes = fixture_bytes(10, i);

        snprintf(name, sizeof name, "m%u", i);
        assert_int_equal(
            put_mesh(fixture->store, i % 2 ? "ada" : "ben", 0, name, bytes, 10, &created),
            STORE_OK);
        usleep(2000); /* so that the times differ */
        free(bytes);
    }
    assert_int_equal(store_mesh_list(fixture->store, &page, note_mesh, &hers), STORE_OK);
    assert_string_equal(hers.text, "m5 m3 m1 ");
    page.owner = NULL;
    assert_int_equal(store_mesh_list(fixture->store, &page, note_mesh, &all), STORE_OK);
    assert_string_equal(all.text, "m5 m4 m3 m2 m1 m0 ");
}

/* ---- Bytes ----------------------------------------------------------------------------------- */

static void bytes_are_limited_in_the_transaction(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *small = fixture_bytes(600, 1), *large = fixture_bytes(300000, 2);
    struct store_mesh mesh;
    char id[STORE_ID_MAX];
    int64_t held;
    bool created;

    assert_int_equal(put_mesh(fixture->store, "ada", 2000, "a", small, 600, &created), STORE_OK);
    held = bytes_of(fixture->store, "ada");
    assert_in_range(held, 600 + 1, 600 + STORE_ROW_MOST);
    store_content_id(id, "mesh-", large, 300000);
    assert_int_equal(put_mesh(fixture->store, "ada", 2000, "b", large, 300000, &created),
                     STORE_QUOTA);
    assert_false(created);
    assert_int_equal(bytes_of(fixture->store, "ada"), held);
    assert_int_equal(store_mesh_get(fixture->store, id, &mesh), STORE_NOT_FOUND);
    assert_int_equal(store_owner_has(fixture->store, "ada", id), STORE_NOT_FOUND);
    /* What is there already costs nothing more, and another owner is not concerned. */
    assert_int_equal(put_mesh(fixture->store, "ada", 600, "a", small, 600, &created), STORE_OK);
    assert_int_equal(put_mesh(fixture->store, "ben", 302000, "b", large, 300000, &created),
                     STORE_OK);
    free(small);
    free(large);
}

/* A job of this owner; the number makes its id, time and digest. */
static int insert_job(struct store *store, const char *owner, int number,
                      const struct store_job_limits *limits, char id[STORE_ID_MAX])
{
    char process[] = "encode", inputs[64], empty[] = "";
    struct store_job job = {.process = process,
                            .inputs = inputs,
                            .message = empty,
                            .numeric_build = empty,
                            .created_ms = 1000 + number};

    snprintf(inputs, sizeof inputs, "{\"number\":%d}", number);
    snprintf(job.id, sizeof job.id, "job-%08d", number);
    snprintf(job.owner, sizeof job.owner, "%s", owner);
    store_sha256_hex(job.digest, inputs, strlen(inputs));
    memcpy(id, job.id, STORE_ID_MAX);
    return store_job_insert(store, &job, limits, NULL, NULL);
}

/* Runs the owner's next job to such results. */
static int finish_job(struct store *store, const char *results, char id[STORE_ID_MAX])
{
    struct store_job job;
    int status = store_job_claim(store, &job);

    assert_int_equal(status, STORE_OK);
    memcpy(id, job.id, STORE_ID_MAX);
    store_job_clear(&job);
    return store_job_transition(store, id, 1, STORE_JOB_SUCCESSFUL, results, NULL, NULL);
}

static void jobs_count_until_they_are_deleted(void **state)
{
    const struct store_job_limits limits = {.bytes = 6000}, more = {.bytes = 100000};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char id[STORE_ID_MAX], other[STORE_ID_MAX], *large = calloc(1, 20001);
    int64_t held, most;

    assert_int_equal(insert_job(store, "ada", 1, &limits, id), STORE_OK);
    held = bytes_of(store, "ada");
    assert_in_range(held, 12, 12 + STORE_ROW_MOST);
    assert_int_equal(finish_job(store, "{\"a\":1}", other), STORE_OK);
    assert_string_equal(other, id);
    assert_int_equal(bytes_of(store, "ada"), held + 7);
    assert_int_equal(insert_job(store, "ada", 2, &limits, other), STORE_OK);
    assert_int_equal(insert_job(store, "ada", 3, &limits, other), STORE_QUOTA);
    assert_int_equal(bytes_of(store, "ada"), 2 * held + 7);
    assert_int_equal(store_owner_bytes(store, "ada", &held, &most), STORE_OK);
    assert_int_equal(most, 6000);
    assert_int_equal(store_owner_has(store, "ada", id), STORE_OK);
    assert_int_equal(store_owner_has(store, "ben", id), STORE_NOT_FOUND);

    /* Results that do not fit change nothing, and leave no file; a failure needs no room. */
    memset(large, 'x', 20000);
    assert_int_equal(finish_job(store, large, other), STORE_QUOTA);
    assert_int_equal(bytes_of(store, "ada"), held);
    assert_int_equal(store_job_transition(store, other, 1, STORE_JOB_FAILED, NULL,
                                          "storage-quota-exceeded", "no room"),
                     STORE_OK);
    assert_int_equal(store_job_delete(store, other), STORE_OK);
    assert_int_equal(store_job_delete(store, id), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), 0);
    assert_int_equal(insert_job(store, "ada", 2, &more, other), STORE_OK);
    assert_int_equal(finish_job(store, large, other), STORE_OK);
    free(large);
}

/* Rows that say what results go with are counted in what they may take. */
static void what_results_name_counts(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(600, 5);
    char id[STORE_ID_MAX], mesh[STORE_ID_MAX], results[STORE_ID_MAX + 20];
    struct store_job_limits limits = {.bytes = 100000};
    int64_t held, job;
    bool created;

    assert_int_equal(put_mesh(store, "ada", 100000, "a", bytes, 600, &created), STORE_OK);
    store_content_id(mesh, "mesh-", bytes, 600);
    snprintf(results, sizeof results, "{\"mesh\":\"%s\"}", mesh);
    held = bytes_of(store, "ada");
    assert_int_equal(insert_job(store, "ada", 1, &limits, id), STORE_OK);
    job = bytes_of(store, "ada") - held;
    assert_int_equal(finish_job(store, "{}", id), STORE_OK);
    limits.bytes = bytes_of(store, "ada") + job + (int64_t)strlen(results) + 100;
    assert_int_equal(insert_job(store, "ada", 2, &limits, id), STORE_OK);
    assert_int_equal(finish_job(store, results, id), STORE_QUOTA);
    assert_in_range(bytes_of(store, "ada"), 1, limits.bytes);
    assert_int_equal(store_job_transition(store, id, 1, STORE_JOB_FAILED, NULL,
                                          "storage-quota-exceeded", "no room"),
                     STORE_OK);
    assert_int_equal(store_job_delete(store, id), STORE_OK);
    limits.bytes += 300;
    assert_int_equal(insert_job(store, "ada", 3, &limits, id), STORE_OK);
    assert_int_equal(finish_job(store, results, id), STORE_OK);
    assert_in_range(bytes_of(store, "ada"), limits.bytes - 300, limits.bytes);
    free(bytes);
}

/* What a job keeps on its way, and the keys that name it, go with it. */
static void checkpoints_and_keys_count(void **state)
{
    const struct store_job_limits limits = {.bytes = 8000};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(9000, 3);
    char id[STORE_ID_MAX], other[STORE_ID_MAX];
    struct store_job job;
    int64_t held;

    assert_int_equal(insert_job(store, "ada", 1, &limits, id), STORE_OK);
    held = bytes_of(store, "ada");
    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    store_job_clear(&job);
    assert_int_equal(store_checkpoint_put(store, id, 1, bytes, 1000), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), held + 1000);
    assert_int_equal(store_checkpoint_put(store, id, 1, bytes, 3000), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), held + 3000);
    assert_int_equal(store_checkpoint_put(store, id, 1, bytes, 9000), STORE_QUOTA);
    assert_int_equal(bytes_of(store, "ada"), held + 3000);
    assert_int_equal(store_job_transition(store, id, 1, STORE_JOB_SUCCESSFUL, "{}", NULL, NULL),
                     STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), held + 2);
    for (int i = 0; i < 100; i++) {
        int status;

        snprintf(other, sizeof other, "key-%d", i);
        status = store_idempotency_put(store, other, id, "");
        assert_true(status == STORE_OK || (status == STORE_QUOTA && i > 2));
    }
    assert_in_range(bytes_of(store, "ada"), 6000, 8000);
    assert_int_equal(store_job_delete(store, id), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), 0);
    assert_int_equal(store_idempotency_put(store, "late", id, ""), STORE_CONFLICT);
    free(bytes);
}

/* What jobs add is held against what the owner's last request said. */
static void jobs_add_within_the_kept_limit(void **state)
{
    const struct store_job_limits limits = {.bytes = 5000};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(9000, 4);
    char id[STORE_ID_MAX];
    bool created;

    assert_int_equal(put_mesh(store, "ada", STORE_BYTES_KEPT, "a", bytes, 9000, &created),
                     STORE_OK);
    assert_int_equal(insert_job(store, "ben", 1, &limits, id), STORE_OK);
    assert_int_equal(put_mesh(store, "ben", STORE_BYTES_KEPT, "b", bytes, 9000, &created),
                     STORE_QUOTA);
    assert_int_equal(put_mesh(store, "ben", STORE_BYTES_KEPT, "b", bytes, 500, &created), STORE_OK);
    free(bytes);
}

/* ---- Cohorts --------------------------------------------------------------------------------- */

static int put_cohort(struct store *store, const char *owner, bool all, const char *record,
                      const char *member, size_t *missing)
{
    struct store_cohort cohort = {.name = "group",
                                  .n_members = 1,
                                  .view = {.owner = owner, .all = all},
                                  .bytes_max = STORE_BYTES_KEPT};
    bool created;
    int status;

    cohort.record = strdup(record);
    cohort.members = calloc(1, sizeof *cohort.members);
    snprintf(cohort.members[0], STORE_ID_MAX, "%s", member);
    status = store_cohort_put(store, &cohort, &created, missing);
    store_cohort_clear(&cohort);
    return status;
}

static void cohort_names_are_each_owners(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(10, 1);
    struct store_cohort cohort;
    char id[STORE_ID_MAX], owners[1][STORE_OWNER_MAX];
    size_t missing, count;
    bool created;

    store_content_id(id, "mesh-", bytes, 10);
    assert_int_equal(put_mesh(store, "ada", 0, "a", bytes, 10, &created), STORE_OK);
    assert_int_equal(put_cohort(store, "ada", false, "[1]", id, &missing), STORE_OK);
    assert_int_equal(put_cohort(store, "ben", false, "[2]", id, &missing), STORE_NOT_FOUND);
    assert_int_equal(put_mesh(store, "ben", 0, "b", bytes, 10, &created), STORE_OK);
    assert_int_equal(put_cohort(store, "ben", false, "[2]", id, &missing), STORE_OK);
    assert_int_equal(put_cohort(store, "ben", false, "[3]", id, &missing), STORE_CONFLICT);
    assert_int_equal(store_cohort_get_as(store, "ben", "group", &cohort), STORE_OK);
    assert_string_equal(cohort.record, "[2]");
    assert_string_equal(cohort.members[0], id);
    assert_string_equal(cohort.owner, "ben");
    store_cohort_clear(&cohort);
    assert_int_equal(store_cohort_get_as(store, "root", "group", &cohort), STORE_NOT_FOUND);
    assert_int_equal(store_cohort_delete_as(store, "root", "group", NULL), STORE_NOT_FOUND);
    assert_int_equal(store_cohort_owners(store, "group", owners, 1, &count), STORE_OK);
    assert_int_equal(count, 2);
    assert_string_equal(owners[0], "ada");
    assert_int_equal(store_cohort_owners(store, "none", owners, 1, &count), STORE_OK);
    assert_int_equal(count, 0);
    assert_int_equal(put_cohort(store, "root", true, "[4]", id, &missing), STORE_OK);
    assert_int_equal(store_cohort_get_as(store, "root", "group", &cohort), STORE_OK);
    assert_string_equal(cohort.record, "[4]");
    store_cohort_clear(&cohort);
    assert_int_equal(store_cohort_delete_as(store, "eve", "group", NULL), STORE_NOT_FOUND);
    assert_int_equal(store_cohort_delete_as(store, "ben", "group", NULL), STORE_OK);
    assert_int_equal(store_cohort_get_as(store, "ben", "group", &cohort), STORE_NOT_FOUND);
    assert_int_equal(store_cohort_get_as(store, "ada", "group", &cohort), STORE_OK);
    store_cohort_clear(&cohort);
    free(bytes);
}

static void cohorts_count(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    unsigned char *bytes = fixture_bytes(10, 1);
    char id[STORE_ID_MAX], *text = calloc(1, 5001);
    size_t missing;
    bool created;
    int64_t held;

    store_content_id(id, "mesh-", bytes, 10);
    assert_int_equal(put_mesh(store, "ada", 6000, "a", bytes, 10, &created), STORE_OK);
    held = bytes_of(store, "ada");
    assert_int_equal(put_cohort(store, "ada", false, "[1]", id, &missing), STORE_OK);
    assert_in_range(bytes_of(store, "ada"), held + 3, held + 3 + STORE_ROW_MOST);
    assert_int_equal(store_cohort_delete_as(store, "ada", "group", NULL), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), held);
    memset(text, 'x', 5000);
    assert_int_equal(put_cohort(store, "ada", false, text, id, &missing), STORE_QUOTA);
    assert_int_equal(bytes_of(store, "ada"), held);
    free(text);
    free(bytes);
}

/* ---- Turns ----------------------------------------------------------------------------------- */

/* Claims the next job, which must be this owner's. */
static void claim_of(struct store *store, const char *owner)
{
    struct store_job job;

    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    assert_string_equal(job.owner, owner);
    store_job_clear(&job);
}

/* However long the queue of one is, the others do not wait for its end: no owner with jobs waiting
   is ever more than one turn behind another. */
static void claims_go_round(void **state)
{
    static const char *const owners[OWNERS] = {"ada", "ben", "cleo", "dan"};
    static const int queued[OWNERS] = {40, 3, 20, 10};
    const struct store_job_limits none = {0};
    struct fixture *fixture = *state;
    int served[OWNERS] = {0}, number = 0;
    char id[STORE_ID_MAX];

    for (int i = 0; i < OWNERS; i++) {
        for (int k = 0; k < queued[i]; k++) {
            assert_int_equal(insert_job(fixture->store, owners[i], number++, &none, id), STORE_OK);
        }
    }
    for (int n = 0; n < number; n++) {
        struct store_job job;
        int who = 0;

        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        while (strcmp(owners[who], job.owner) != 0) {
            who++;
        }
        store_job_clear(&job);
        served[who]++;
        for (int i = 0; i < OWNERS; i++) {
            assert_true(served[i] == queued[i] || served[i] + 1 >= served[who]);
        }
    }
    for (int i = 0; i < OWNERS; i++) {
        assert_int_equal(served[i], queued[i]);
    }
}

/* One who comes when others have been served for long is next, but gets no more than its turn from
   then on. */
static void a_newcomer_joins_the_round(void **state)
{
    const struct store_job_limits none = {0};
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];

    for (int i = 0; i < 20; i++) {
        assert_int_equal(insert_job(fixture->store, "ada", i, &none, id), STORE_OK);
    }
    for (int i = 0; i < 10; i++) {
        claim_of(fixture->store, "ada");
    }
    for (int i = 20; i < 30; i++) {
        assert_int_equal(insert_job(fixture->store, "zoe", i, &none, id), STORE_OK);
    }
    claim_of(fixture->store, "zoe");
    for (int i = 0; i < 9; i++) {
        claim_of(fixture->store, "ada");
        claim_of(fixture->store, "zoe");
    }
    claim_of(fixture->store, "ada");
}

static void jobs_of_an_owner_are_limited(void **state)
{
    const struct store_job_limits limits = {.queued = 2, .running = 1};
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char first[STORE_ID_MAX], id[STORE_ID_MAX];
    struct store_job job;

    assert_int_equal(insert_job(store, "ada", 1, &limits, first), STORE_OK);
    assert_int_equal(insert_job(store, "ada", 2, &limits, id), STORE_OK);
    assert_int_equal(insert_job(store, "ada", 3, &limits, id), STORE_QUEUED);
    assert_int_equal(store_job_get(store, id, &job), STORE_NOT_FOUND);
    assert_int_equal(insert_job(store, "ben", 4, &limits, id), STORE_OK);
    claim_of(store, "ada");
    assert_int_equal(insert_job(store, "ada", 3, &limits, id), STORE_OK);
    claim_of(store, "ben");
    assert_int_equal(store_job_claim(store, &job), STORE_CONFLICT);
    assert_int_equal(store_job_transition(store, first, 1, STORE_JOB_SUCCESSFUL, "{}", NULL, NULL),
                     STORE_OK);
    claim_of(store, "ada");
    assert_int_equal(store_job_claim(store, &job), STORE_CONFLICT);
    /* A limit that is raised holds from the next job on. */
    assert_int_equal(insert_job(store, "ada", 5, &(struct store_job_limits){0}, id), STORE_OK);
    claim_of(store, "ada");
    claim_of(store, "ada");
    assert_int_equal(store_job_claim(store, &job), STORE_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)
        TEST(content_has_a_name_for_each_owner),
        TEST(surfaces_have_a_record_for_each_owner),
        TEST(lists_show_what_is_the_owners),
        TEST(bytes_are_limited_in_the_transaction),
        TEST(jobs_count_until_they_are_deleted),
        TEST(what_results_name_counts),
        TEST(checkpoints_and_keys_count),
        TEST(jobs_add_within_the_kept_limit),
        TEST(cohorts_count),
        TEST(cohort_names_are_each_owners),
        TEST(claims_go_round),
        TEST(a_newcomer_joins_the_round),
        TEST(jobs_of_an_owner_are_limited),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
