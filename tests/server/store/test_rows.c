/*
 * What goes into the store comes out of it: meshes, surfaces, jobs, results, small and large,
 * before and after the directory is closed and opened again; lists page without gaps or repeats;
 * keys are remembered.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fixture.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/page.h"
#include "store/store.h"
#include "store/surface.h"

static void check_mesh(struct store *store, const char *id, const unsigned char *bytes, size_t size)
{
    struct store_mesh mesh;
    unsigned char *content;
    size_t got;

    assert_int_equal(store_mesh_get(store, id, &mesh), STORE_OK);
    assert_string_equal(mesh.id, id);
    assert_string_equal(mesh.name, "a name");
    assert_string_equal(mesh.format, "ply");
    assert_string_equal(mesh.report, "{\"closed\":true}");
    assert_int_equal(mesh.bytes, size);
    assert_int_equal(mesh.vertices, 4);
    assert_true(mesh.created_ms > 0 && mesh.created_ms <= store_now_ms());
    store_mesh_clear(&mesh);
    assert_int_equal(store_mesh_content(store, id, &content, &got), STORE_OK);
    assert_int_equal(got, size);
    assert_memory_equal(content, bytes, size);
    free(content);
}

static void meshes_of_any_size_round_trip(void **state)
{
    static const size_t sizes[] = {0, 1, 1000, STORE_INLINE_MAX, STORE_INLINE_MAX + 1, 3000000};
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    bool created;

    for (unsigned i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        unsigned char *bytes = fixture_bytes(sizes[i], i);

        assert_int_equal(fixture_put_mesh(fixture->store, bytes, sizes[i], id, &created), STORE_OK);
        assert_true(created);
        check_mesh(fixture->store, id, bytes, sizes[i]);
        assert_int_equal(fixture_put_mesh(fixture->store, bytes, sizes[i], id, &created), STORE_OK);
        assert_false(created);
        fixture_reopen(fixture);
        check_mesh(fixture->store, id, bytes, sizes[i]);
        free(bytes);
    }
}

static void a_mesh_keeps_its_first_name_and_time(void **state)
{
    struct fixture *fixture = *state;
    struct store_mesh mesh = {.id = "mesh-1", .name = strdup("first"), .bytes = 3};
    int64_t first;
    bool created;

    assert_int_equal(store_mesh_put(fixture->store, &mesh, "abc", &created), STORE_OK);
    assert_true(created);
    first = mesh.created_ms;
    assert_true(first > 0);
    free(mesh.name);
    mesh.name = strdup("second");
    mesh.created_ms = 0;
    assert_int_equal(store_mesh_put(fixture->store, &mesh, "abc", &created), STORE_OK);
    assert_false(created);
    assert_string_equal(mesh.name, "first");
    assert_int_equal(mesh.created_ms, first);
    store_mesh_clear(&mesh);
}

/* A later version may find more in the same bytes: its report takes the place of the old one. */
static void a_mesh_sent_again_has_the_newer_report(void **state)
{
    struct fixture *fixture = *state;
    struct store_mesh mesh = {.id = "mesh-1", .report = strdup("{\"closed\":true}"), .bytes = 3};
    struct store_mesh held;
    bool created;

    assert_int_equal(store_mesh_put(fixture->store, &mesh, "abc", &created), STORE_OK);
    free(mesh.report);
    mesh.report = strdup("{\"closed\":false}");
    mesh.faces = 7;
    assert_int_equal(store_mesh_put(fixture->store, &mesh, "abc", &created), STORE_OK);
    assert_false(created);
    assert_int_equal(store_mesh_get(fixture->store, "mesh-1", &held), STORE_OK);
    assert_string_equal(held.report, "{\"closed\":false}");
    assert_int_equal(held.faces, 7);
    store_mesh_clear(&held);
    store_mesh_clear(&mesh);
}

static void what_is_not_there_is_not_found(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_mesh mesh;
    struct store_surface surface;
    struct store_job job;
    unsigned char *content;
    char *results, id[STORE_ID_MAX], digest[65];
    size_t size;

    assert_int_equal(store_mesh_get(store, "mesh-none", &mesh), STORE_NOT_FOUND);
    assert_int_equal(store_mesh_content(store, "mesh-none", &content, &size), STORE_NOT_FOUND);
    assert_null(content);
    assert_int_equal(store_surface_get(store, "surf-none", true, &surface), STORE_NOT_FOUND);
    assert_int_equal(store_job_get(store, "job-none", &job), STORE_NOT_FOUND);
    assert_int_equal(store_job_results(store, "job-none", &results, &size), STORE_NOT_FOUND);
    assert_int_equal(store_job_claim(store, &job), STORE_NOT_FOUND);
    assert_int_equal(store_job_request_cancel(store, "job-none", &job), STORE_NOT_FOUND);
    assert_int_equal(store_job_delete(store, "job-none"), STORE_NOT_FOUND);
    assert_int_equal(
        store_job_transition(store, "job-none", 0, STORE_JOB_DISMISSED, NULL, NULL, NULL),
        STORE_NOT_FOUND);
    assert_int_equal(store_idempotency_find(store, "none", id, digest), STORE_NOT_FOUND);
    assert_int_equal(store_ping(store), STORE_OK);
}

static void surfaces_round_trip_to_the_bit(void **state)
{
    static const int64_t degrees[] = {4, 31, 127}; /* the last one is above the inline limit */
    struct fixture *fixture = *state;

    for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++) {
        size_t count = 3 * (size_t)(degrees[i] + 1) * (size_t)(degrees[i] + 1);
        struct store_surface surface = {.lmax = degrees[i], .name = strdup("s")}, got;
        bool created;

        surface.record = strdup("{\"area\":1}");
        surface.coefficient_count = count;
        surface.coefficients = malloc(count * sizeof *surface.coefficients);
        for (size_t k = 0; k < count; k++) {
            surface.coefficients[k] = 1.0 / (double)(k + 3 + i) - 1e-300 * (double)k;
        }
        store_surface_id(surface.id, surface.lmax, surface.coefficients, 2.5);
        assert_int_equal(store_surface_put(fixture->store, &surface, &created), STORE_OK);
        assert_true(created);
        fixture_reopen(fixture);
        assert_int_equal(store_surface_get(fixture->store, surface.id, true, &got), STORE_OK);
        assert_int_equal(got.lmax, degrees[i]);
        assert_int_equal(got.coefficient_count, count);
        assert_memory_equal(got.coefficients, surface.coefficients, count * sizeof(double));
        assert_string_equal(got.record, "{\"area\":1}");
        assert_int_equal(got.created_ms, surface.created_ms);
        store_surface_clear(&got);
        assert_int_equal(store_surface_get(fixture->store, surface.id, false, &got), STORE_OK);
        assert_null(got.coefficients);
        store_surface_clear(&got);
        assert_int_equal(store_surface_put(fixture->store, &surface, &created), STORE_OK);
        assert_false(created);
        store_surface_clear(&surface);
    }
}

static void a_surface_id_is_its_place(const char *content)
{
    const double here[3] = {1.0, 0.0, -2.0}, same[3] = {1.0, -0.0, -2.0},
                 there[3] = {65.0, 0.0, -2.0};
    const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, turned[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1};
    const struct {
        const double *origin, *rotation;
        const char *mesh;
    } places[] = {{here, upright, "mesh-a"}, {same, upright, "mesh-a"}, {there, upright, "mesh-a"},
                  {here, turned, "mesh-a"},  {here, upright, "mesh-b"}, {here, upright, ""}};
    char ids[6][STORE_ID_MAX];

    for (size_t i = 0; i < 6; i++) {
        (void)snprintf(ids[i], STORE_ID_MAX, "%s", content);
        store_surface_id_place(ids[i], places[i].origin, places[i].rotation, places[i].mesh);
        assert_string_not_equal(ids[i], content);
        assert_int_equal(strlen(ids[i]), strlen("surf-") + 32);
        for (size_t k = 0; k < i; k++) {
            assert_int_equal(strcmp(ids[i], ids[k]) == 0, i == 1 && k == 0); /* -0 is 0 */
        }
    }
}

static void a_surface_id_is_its_content(void **state)
{
    double c[3 * 25] = {0.5, -0.0, 3.0}, d[3 * 25] = {0.5, 0.0, 3.0};
    char a[STORE_ID_MAX], b[STORE_ID_MAX];

    (void)state;
    store_surface_id(a, 4, c, 1.0);
    store_surface_id(b, 4, d, 1.0);
    assert_string_equal(a, b); /* -0 is 0 */
    assert_int_equal(strlen(a), strlen("surf-") + 32);
    store_surface_id(b, 4, d, 2.0);
    assert_string_not_equal(a, b);
    d[74] = 1e-300;
    store_surface_id(b, 4, d, 1.0);
    assert_string_not_equal(a, b);
    store_shape_id(a, 4, c);
    store_shape_id(b, 4, d);
    assert_string_not_equal(a, b);
    d[74] = 0.0;
    store_shape_id(b, 4, d);
    assert_string_equal(a, b);
    assert_int_equal(strncmp(a, "shape-", 6), 0); /* and looks like no surface's */
    store_surface_id(b, 4, d, 1.0);
    a_surface_id_is_its_place(b);
    store_content_id(a, "mesh-", "abc", 3);
    assert_string_equal(a, "mesh-ba7816bf8f01cfea414140de5dae2223"); /* FIPS 180-4, "abc" */
}

static void results_of_any_size_round_trip(void **state)
{
    static const size_t sizes[] = {0, 2, STORE_INLINE_MAX + 7};
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX], *results;
    struct store_job job;
    size_t size;

    for (int i = 0; i < 3; i++) {
        char *text = malloc(sizes[i] + 1);

        memset(text, 'a' + i, sizes[i]);
        text[sizes[i]] = '\0';
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
        assert_int_equal(store_job_results(fixture->store, id, &results, &size), STORE_CONFLICT);
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        assert_string_equal(job.id, id);
        store_job_clear(&job);
        assert_int_equal(
            store_job_transition(fixture->store, id, 1, STORE_JOB_SUCCESSFUL, text, NULL, NULL),
            STORE_OK);
        fixture_reopen(fixture);
        assert_int_equal(store_job_results(fixture->store, id, &results, &size), STORE_OK);
        assert_int_equal(size, sizes[i]);
        assert_string_equal(results, text);
        free(results);
        free(text);
    }
}

/* ---- Lists ----------------------------------------------------------------------------------- */

struct seen {
    char ids[400][STORE_ID_MAX];
    size_t count;
    int64_t last_ms;
};

static bool note_job(void *user, const struct store_job *job)
{
    struct seen *seen = user;

    memcpy(seen->ids[seen->count++], job->id, STORE_ID_MAX);
    seen->last_ms = job->created_ms;
    return true;
}

static void pages_have_no_gaps_or_repeats(void **state)
{
    struct fixture *fixture = *state;
    struct seen *seen = calloc(1, sizeof *seen);
    struct store_page page = {.limit = 7};
    char id[STORE_ID_MAX], wanted[STORE_ID_MAX];
    size_t before;
    int inserted = 100;

    for (int i = 0; i < inserted; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
    }
    do {
        before = seen->count;
        assert_int_equal(store_job_list(fixture->store, &page, note_job, seen), STORE_OK);
        page.after_ms = seen->last_ms;
        page.after_id = seen->count ? seen->ids[seen->count - 1] : "";
        assert_int_equal(fixture_insert_job(fixture->store, inserted++, id), STORE_OK);
    } while (seen->count > before);
    assert_int_equal(seen->count, 100);
    for (int i = 0; i < 100; i++) {
        snprintf(wanted, sizeof wanted, "job-%08d", 99 - i);
        assert_string_equal(seen->ids[i], wanted);
    }
    free(seen);
}

static bool stop_at_third(void *user, const struct store_job *job)
{
    note_job(user, job);
    return ((struct seen *)user)->count < 3;
}

static void lists_filter_and_stop(void **state)
{
    struct fixture *fixture = *state;
    struct seen *seen = calloc(1, sizeof *seen);
    struct store_page page = {.limit = 50};
    struct store_job job;
    char id[STORE_ID_MAX];
    size_t count;

    for (int i = 0; i < 9; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, i, id), STORE_OK);
    }
    for (int i = 0; i < 4; i++) {
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        store_job_clear(&job);
    }
    page.status = "running";
    assert_int_equal(store_job_list(fixture->store, &page, note_job, seen), STORE_OK);
    assert_int_equal(seen->count, 4);
    assert_string_equal(seen->ids[0], "job-00000003"); /* the oldest were claimed */
    assert_int_equal(store_job_count(fixture->store, STORE_JOB_RUNNING, &count), STORE_OK);
    assert_int_equal(count, 4);
    seen->count = 0;
    page.process = "invert";
    assert_int_equal(store_job_list(fixture->store, &page, note_job, seen), STORE_OK);
    assert_int_equal(seen->count, 0);
    page.process = page.status = NULL;
    assert_int_equal(store_job_list(fixture->store, &page, stop_at_third, seen), STORE_OK);
    assert_int_equal(seen->count, 3);
    free(seen);
}

static bool count_mesh(void *user, const struct store_mesh *mesh)
{
    assert_non_null(mesh->report);
    ++*(size_t *)user;
    return true;
}

static bool count_surface(void *user, const struct store_surface *surface)
{
    assert_null(surface->coefficients);
    ++*(size_t *)user;
    return true;
}

static void meshes_and_surfaces_are_listed(void **state)
{
    struct fixture *fixture = *state;
    struct store_page page = {.limit = 10};
    double zero[75] = {0};
    char id[STORE_ID_MAX];
    size_t meshes = 0, surfaces = 0;
    bool created;

    for (unsigned i = 0; i < 12; i++) {
        struct store_surface surface = {.lmax = 4, .coefficients = zero, .coefficient_count = 75};
        unsigned char *bytes = fixture_bytes(10, i);

        assert_int_equal(fixture_put_mesh(fixture->store, bytes, 10, id, &created), STORE_OK);
        free(bytes);
        snprintf(surface.id, sizeof surface.id, "surf-%u", i);
        assert_int_equal(store_surface_put(fixture->store, &surface, &created), STORE_OK);
        surface.coefficients = NULL;
        store_surface_clear(&surface);
    }
    assert_int_equal(store_mesh_list(fixture->store, &page, count_mesh, &meshes), STORE_OK);
    assert_int_equal(store_surface_list(fixture->store, &page, count_surface, &surfaces), STORE_OK);
    assert_int_equal(meshes, 10);
    assert_int_equal(surfaces, 10);
}

/* ---- Keys ------------------------------------------------------------------------------------ */

static void keys_name_jobs_once(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char process[] = "encode", inputs[] = "{}", id[STORE_ID_MAX], digest[65];
    struct store_job job = {.id = "job-1", .process = process, .inputs = inputs}, found;

    store_sha256_hex(job.digest, "1", 1);
    assert_int_equal(store_job_insert(store, &job, NULL, "key", "body"), STORE_OK);
    assert_int_equal(store_idempotency_find(store, "key", id, digest), STORE_OK);
    assert_string_equal(id, "job-1");
    assert_string_equal(digest, "body");

    /* A taken key refuses the job as a whole, and so does a digest in flight. */
    memcpy(job.id, "job-2", sizeof "job-2");
    store_sha256_hex(job.digest, "2", 1);
    assert_int_equal(store_job_insert(store, &job, NULL, "key", "other"), STORE_CONFLICT);
    assert_int_equal(store_job_get(store, "job-2", &found), STORE_NOT_FOUND);
    store_sha256_hex(job.digest, "1", 1);
    assert_int_equal(store_job_insert(store, &job, NULL, NULL, NULL), STORE_CONFLICT);

    assert_int_equal(store_idempotency_put(store, "second", "job-1", "body"), STORE_OK);
    assert_int_equal(store_idempotency_put(store, "second", "job-1", "body"), STORE_CONFLICT);
    assert_int_equal(store_idempotency_put(store, "third", "job-none", "body"), STORE_CONFLICT);

    /* The key goes with its job, and the digest is free again. */
    assert_int_equal(store_job_transition(store, "job-1", 0, STORE_JOB_DISMISSED, NULL, NULL, NULL),
                     STORE_OK);
    assert_int_equal(store_job_delete(store, "job-1"), STORE_OK);
    assert_int_equal(store_idempotency_find(store, "key", id, digest), STORE_NOT_FOUND);
    assert_int_equal(store_job_insert(store, &job, NULL, "key", "other"), STORE_OK);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(meshes_of_any_size_round_trip),
        TEST(a_mesh_keeps_its_first_name_and_time),
        TEST(a_mesh_sent_again_has_the_newer_report),
        TEST(what_is_not_there_is_not_found),
        TEST(surfaces_round_trip_to_the_bit),
        cmocka_unit_test(a_surface_id_is_its_content),
        TEST(results_of_any_size_round_trip),
        TEST(pages_have_no_gaps_or_repeats),
        TEST(lists_filter_and_stop),
        TEST(meshes_and_surfaces_are_listed),
        TEST(keys_name_jobs_once),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
