/*
 * What is erased is gone: of hundreds of meshes, some of them in the database and some in files,
 * those that stay are whole, and of those that went no byte and no name is left in the data
 * directory. What needs something keeps it, or goes with it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>

#include "fixture.h"
#include "store/erase.h"
#include "store/holdings.h"
#include "store/maintenance.h"

#define MESHES 300
#define MARK 24 /* bytes that tell one mesh from all others */

static void mark_of(char mark[MARK + 1], int i)
{
    char hex[65];

    store_sha256_hex(hex, &i, sizeof i);
    memcpy(mark, hex, MARK);
    mark[MARK] = '\0';
}

/* From 24 bytes to some 6 KB, and every 50th beyond what a row holds. */
static size_t size_of(int i)
{
    return i % 50 == 49 ? STORE_INLINE_MAX + 24 : MARK * (size_t)(1 + i % 251);
}

static void put_mesh(struct store *store, const char *owner, int i, char id[STORE_ID_MAX])
{
    size_t size = size_of(i);
    unsigned char *bytes = malloc(size);
    char mark[MARK + 1], name[MARK + 8];
    struct store_mesh mesh = {.bytes = (int64_t)size, .owner = {owner, 0}};
    bool created;

    mark_of(mark, i);
    for (size_t at = 0; at + MARK <= size; at += MARK) {
        memcpy(bytes + at, mark, MARK);
    }
    memset(bytes + size - size % MARK, 'x', size % MARK);
    snprintf(name, sizeof name, "name-%s", mark);
    mesh.name = strdup(name);
    mesh.format = strdup("ply");
    mesh.report = strdup("{}");
    store_content_id(mesh.id, "mesh-", bytes, size);
    assert_int_equal(store_mesh_put(store, &mesh, bytes, &created), STORE_OK);
    memcpy(id, mesh.id, STORE_ID_MAX);
    store_mesh_clear(&mesh);
    free(bytes);
}

static int erase(struct store *store, const char *owner, const char *id, bool cascade)
{
    struct store_erasure erasure = {.owner = owner, .id = id, .cascade = cascade};

    return store_erase(store, &erasure);
}

/* ---- Searching ------------------------------------------------------------------------------- */

/* Notes which marks the file has: all that are 24 hexadecimal digits in a row. */
static void search_file(const char *path, bool found[MESHES])
{
    FILE *file = fopen(path, "rb");
    struct stat info;
    char *bytes, mark[MARK + 1];

    assert_non_null(file);
    assert_int_equal(fstat(fileno(file), &info), 0);
    bytes = malloc((size_t)info.st_size + 1);
    assert_int_equal(fread(bytes, 1, (size_t)info.st_size, file), info.st_size);
    for (int i = 0; i < MESHES; i++) {
        mark_of(mark, i);
        found[i] = found[i] || memmem(bytes, (size_t)info.st_size, mark, MARK) != NULL;
    }
    free(bytes);
    fclose(file);
}

static void search_folder(const char *path, bool found[MESHES])
{
    DIR *folder = opendir(path);

    assert_non_null(folder);
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        char below[SCRATCH_MAX + 400];

        snprintf(below, sizeof below, "%s/%s", path, entry->d_name);
        if (entry->d_type == DT_DIR && entry->d_name[0] != '.') {
            search_folder(below, found);
        } else if (entry->d_type == DT_REG && strcmp(entry->d_name, "reserve") != 0) {
            search_file(below, found);
        }
    }
    closedir(folder);
}

static void nothing_of_it_is_left(void **state)
{
    struct fixture *fixture = *state;
    static char ids[MESHES][STORE_ID_MAX];
    bool found[MESHES] = {false};
    struct store_report report;
    char message[256];

    for (int i = 0; i < MESHES; i++) {
        put_mesh(fixture->store, "", i, ids[i]);
    }
    search_folder(fixture->path, found);
    for (int i = 0; i < MESHES; i++) {
        assert_true(found[i]);
    }
    /* Two of three, in an order that leaves holes in many pages. */
    for (int i = 0; i < MESHES; i++) {
        int which = i * 7 % MESHES;

        if (which % 3 != 0) {
            assert_int_equal(erase(fixture->store, "", ids[which], false), STORE_OK);
        }
    }
    memset(found, 0, sizeof found);
    search_folder(fixture->path, found);
    for (int i = 0; i < MESHES; i++) {
        if (found[i] != (i % 3 == 0)) {
            fail_msg("mesh %d of %zu bytes is%s there", i, size_of(i), found[i] ? "" : " not");
        }
    }
    assert_int_equal(store_verify(fixture->path, false, NULL, &report, message, sizeof message),
                     STORE_OK);
    assert_int_equal(report.blobs, MESHES / 3);
    assert_int_equal(report.orphans, 0);
}

/* ---- Needs ----------------------------------------------------------------------------------- */

static void put_job(struct store *store, const char *id, const char *owner, const char *inputs)
{
    struct store_job job = {.process = strdup("p"), .inputs = strdup(inputs), .created_ms = 1};

    snprintf(job.id, sizeof job.id, "%s", id);
    snprintf(job.owner, sizeof job.owner, "%s", owner);
    store_sha256_hex(job.digest, id, strlen(id));
    assert_int_equal(store_job_insert(store, &job, NULL, NULL, NULL), STORE_OK);
    store_job_clear(&job);
}

static int64_t bytes_of(struct store *store, const char *owner)
{
    int64_t bytes;

    assert_int_equal(store_owner_bytes(store, owner, &bytes, NULL), STORE_OK);
    return bytes;
}

#define JOB "job-01a20544-fd41-7000-9180-ec0e617a9d0f"

static void a_job_needs_its_inputs(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    struct store_erasure erasure = {.owner = "ada"};
    char id[STORE_ID_MAX], inputs[200];
    struct store_job job;
    int64_t before;

    put_mesh(store, "ada", 1, id);
    before = bytes_of(store, "ada");
    erasure.id = id;
    snprintf(inputs, sizeof inputs, "{\"label\":\"mesh-\",\"mesh\":\"%s\"}", id);
    put_job(store, JOB, "ada", inputs);
    assert_int_equal(store_erase(store, &erasure), STORE_CONFLICT);
    assert_int_equal(erasure.needing, 1);
    assert_int_equal(erasure.n_unended, 1);
    assert_string_equal(erasure.needed_by[0].kind, "job");
    assert_string_equal(erasure.needed_by[0].id, JOB);
    /* One that has not ended is not taken along either. */
    erasure.cascade = true;
    assert_int_equal(store_erase(store, &erasure), STORE_CONFLICT);
    assert_int_equal(store_job_request_cancel(store, JOB, &job), STORE_OK);
    store_job_clear(&job);
    erasure.cascade = false;
    assert_int_equal(store_erase(store, &erasure), STORE_CONFLICT);
    assert_int_equal(erasure.n_unended, 0);
    assert_int_equal(store_job_delete(store, JOB), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), before);
    assert_int_equal(store_erase(store, &erasure), STORE_OK);
    assert_int_equal(bytes_of(store, "ada"), 0);
    assert_int_equal(store_erase(store, &erasure), STORE_NOT_FOUND);
}

/* Results only name what goes: the job goes with it, and others that read it do not. */
static void results_go_with_what_they_name(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char id[STORE_ID_MAX], results[200];
    struct store_job job;

    put_mesh(store, "", 1, id);
    put_job(store, JOB, "", "{}");
    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    snprintf(results, sizeof results, "{\"mesh\":{\"id\":\"%s\"}}", id);
    assert_int_equal(store_job_transition(store, JOB, 1, STORE_JOB_SUCCESSFUL, results, NULL, NULL),
                     STORE_OK);
    store_job_clear(&job);
    assert_int_equal(erase(store, "", id, false), STORE_OK);
    assert_int_equal(store_job_get(store, JOB, &job), STORE_NOT_FOUND);
    assert_int_equal(bytes_of(store, ""), 0);
}

static void content_goes_with_its_last_owner(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char id[STORE_ID_MAX], owners[2][STORE_OWNER_MAX];
    struct store_mesh mesh;
    size_t count;

    put_mesh(store, "ada", 1, id);
    put_mesh(store, "ben", 1, id);
    assert_int_equal(erase(store, "eve", id, true), STORE_NOT_FOUND);
    assert_int_equal(erase(store, "ada", id, false), STORE_OK);
    assert_int_equal(store_owner_names(store, id, owners, 2, &count), STORE_OK);
    assert_int_equal(count, 1);
    assert_string_equal(owners[0], "ben");
    assert_int_equal(store_mesh_get(store, id, &mesh), STORE_OK);
    store_mesh_clear(&mesh);
    /* The other way round: what the second called it is nobody's either. */
    put_mesh(store, "ada", 1, id);
    assert_int_equal(erase(store, "ada", id, false), STORE_OK);
    assert_int_equal(erase(store, "ben", id, false), STORE_OK);
    assert_int_equal(store_mesh_get(store, id, &mesh), STORE_NOT_FOUND);
    assert_int_equal(store_owner_names(store, id, owners, 2, &count), STORE_OK);
    assert_int_equal(count, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(nothing_of_it_is_left, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(a_job_needs_its_inputs, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(results_go_with_what_they_name, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(content_goes_with_its_last_owner, fixture_setup,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("store: erasing", tests, NULL, NULL);
}
