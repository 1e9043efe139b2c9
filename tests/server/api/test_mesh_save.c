/*
 * test_mesh_save.c - a mesh that a job made is a mesh like an upload: the same bytes have the same
 * id and report, and what made it is told to its owner alone.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <string.h>

#include "api/meshes.h"
#include "store/mesh.h"
#include "store/store.h"
#include "support/compare.h"
#include "support/scratch.h"

struct fixture {
    char directory[SCRATCH_MAX];
    struct store *store;
    struct srnf_mesh mesh;
};

static int setup(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);
    char message[200] = "";

    assert_non_null(fixture);
    assert_true(scratch_make(fixture->directory, "mesh-save"));
    assert_int_equal(store_open(&fixture->store, fixture->directory, message, sizeof message), 0);
    assert_int_equal(srnf_mesh_icosphere(4, &fixture->mesh), SRNF_OK);
    *state = fixture;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *fixture = *state;

    srnf_mesh_clear(&fixture->mesh);
    store_close(fixture->store);
    scratch_remove(fixture->directory);
    free(fixture);
    return 0;
}

static json_t *save(struct fixture *fixture, const char *owner, const char *job)
{
    const struct store_owner who = {.name = owner};
    struct mesh_description description = {
        .name = "ball", .mesh = &fixture->mesh, .source = json_pack("{s:s}", "job", job)};
    json_t *record = NULL;
    int failed;

    assert_int_equal(mesh_save(NULL, fixture->store, &who, &description, NULL, &record, &failed),
                     STORE_OK);
    assert_int_equal(failed, 0);
    assert_non_null(record);
    return record;
}

static const char *job_of(const json_t *record)
{
    return json_string_value(json_object_get(json_object_get(record, "source"), "job"));
}

static void it_is_what_an_upload_would_be(void **state)
{
    struct fixture *fixture = *state;
    json_t *record = save(fixture, "ada", "job-1"), *report;
    const char *id = json_string_value(json_object_get(record, "id"));
    unsigned char *content = NULL;
    char address[STORE_ID_MAX];
    struct srnf_mesh back;
    size_t size = 0;

    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
    mesh_id(address, "ply", content, size);
    assert_string_equal(address, id);
    assert_int_equal(json_integer_value(json_object_get(record, "bytes")), size);
    assert_int_equal(srnf_mesh_read(content, size, SRNF_MESH_UNKNOWN, NULL, &back, NULL, NULL), 0);
    assert_int_equal(back.n_faces, fixture->mesh.n_faces);
    assert_memory_equal(back.vertices, fixture->mesh.vertices,
                        3 * back.n_vertices * sizeof(double));
    report = json_object_get(record, "report");
    assert_true(json_is_true(json_object_get(report, "analysable")));
    assert_int_equal(json_integer_value(json_object_get(report, "genus")), 0);
    assert_true(json_number_value(json_object_get(report, "volume")) > 4.0);
    assert_string_equal(job_of(record), "job-1");
    srnf_mesh_clear(&back);
    free(content);
    json_decref(record);
}

static void its_source_is_its_owners(void **state)
{
    struct fixture *fixture = *state;
    json_t *first = save(fixture, "ada", "job-1"), *second = save(fixture, "ben", "job-2");
    json_t *again = save(fixture, "ada", "job-3"), *held;
    const char *id = json_string_value(json_object_get(first, "id"));
    struct store_mesh mesh;

    assert_string_equal(json_string_value(json_object_get(second, "id")), id);
    assert_string_equal(job_of(second), "job-2");
    assert_string_equal(job_of(again), "job-3");
    assert_int_equal(store_mesh_get_as(fixture->store, "ada", id, &mesh), STORE_OK);
    held = mesh_record(&mesh);
    assert_string_equal(job_of(held), "job-1");
    json_decref(held);
    store_mesh_clear(&mesh);
    assert_int_equal(store_mesh_get_as(fixture->store, "ben", id, &mesh), STORE_OK);
    held = mesh_record(&mesh);
    assert_string_equal(job_of(held), "job-2");
    json_decref(held);
    store_mesh_clear(&mesh);
    json_decref(first);
    json_decref(second);
    json_decref(again);
}

static void an_upload_of_another_has_no_source(void **state)
{
    struct fixture *fixture = *state;
    json_t *made = save(fixture, "ada", "job-1"), *held;
    const char *id = json_string_value(json_object_get(made, "id"));
    struct store_mesh mesh = {.owner = {.name = "ben"},
                              .name = strdup("his"),
                              .format = strdup("ply"),
                              .report = strdup("{}")};
    unsigned char *content = NULL;
    size_t size = 0;
    bool created;

    assert_int_equal(store_mesh_content(fixture->store, id, &content, &size), STORE_OK);
    (void)strncpy(mesh.id, id, sizeof mesh.id - 1);
    mesh.bytes = (int64_t)size;
    assert_int_equal(store_mesh_put(fixture->store, &mesh, content, &created), STORE_OK);
    assert_true(created);
    store_mesh_clear(&mesh);
    assert_int_equal(store_mesh_get_as(fixture->store, "ben", id, &mesh), STORE_OK);
    held = mesh_record(&mesh);
    assert_true(json_is_null(json_object_get(held, "source")));
    json_decref(held);
    store_mesh_clear(&mesh);
    free(content);
    json_decref(made);
}

static bool always(void *user)
{
    (void)user;
    return true;
}

static void what_cannot_be_kept_is_told(void **state)
{
    struct fixture *fixture = *state;
    const struct store_owner poor = {.name = "cai", .bytes_max = 100}, nobody = {.name = NULL};
    const struct srnf_context canceled = {.canceled = always};
    struct mesh_description description = {.mesh = &fixture->mesh, .source = json_object()};
    const double x = fixture->mesh.vertices[0];
    json_t *record;
    int failed;

    assert_int_equal(mesh_save(NULL, fixture->store, &poor, &description, NULL, &record, &failed),
                     STORE_QUOTA);
    assert_int_equal(failed, 0);
    assert_null(record);
    description.source = json_object();
    assert_int_not_equal(
        mesh_save(NULL, fixture->store, &nobody, &description, &canceled, &record, &failed),
        STORE_OK);
    assert_int_equal(failed, SRNF_ECANCELED);
    assert_null(record);
    description.source = json_object();
    fixture->mesh.vertices[0] = NAN;
    assert_int_not_equal(
        mesh_save(NULL, fixture->store, &nobody, &description, NULL, &record, &failed), STORE_OK);
    assert_int_equal(failed, SRNF_EINVAL);
    assert_null(record);
    fixture->mesh.vertices[0] = x;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(it_is_what_an_upload_would_be, setup, teardown),
        cmocka_unit_test_setup_teardown(its_source_is_its_owners, setup, teardown),
        cmocka_unit_test_setup_teardown(an_upload_of_another_has_no_source, setup, teardown),
        cmocka_unit_test_setup_teardown(what_cannot_be_kept_is_told, setup, teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
