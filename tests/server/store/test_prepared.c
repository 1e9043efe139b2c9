/*
 * test_prepared.c - the cache of prepared meshes: what is put comes back, damage is as if nothing
 * were there, what was not read for longest gives way, and all that is derived of a mesh goes with
 * it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <fcntl.h>

#include "server/store/fixture.h"
#include "store/encoding.h"
#include "store/maintenance.h"
#include "store/prepared.h"

#define SIZE ((size_t)3000)
#define LIMIT ((int64_t)40960)
#define PAGE ((int64_t)4096) /* that each of this size counts for */

static void mesh_of(struct fixture *fixture, const char *bytes, char id[STORE_ID_MAX])
{
    bool created;

    assert_int_equal(
        fixture_put_mesh(fixture->store, (const unsigned char *)bytes, strlen(bytes), id, &created),
        STORE_OK);
}

static int put(struct fixture *fixture, const char *mesh, const char *sphere, int number)
{
    const struct store_prepared_key key = {mesh, sphere, number % 2 ? "odd" : "even"};
    unsigned char *value = fixture_bytes(SIZE, (unsigned)number);
    const struct store_part parts[] = {{value, 1000}, {value, 0}, {value + 1000, SIZE - 1000}};
    int status = store_prepared_put(fixture->store, &key, parts, 3);

    free(value);
    return status;
}

/* STORE_OK only where what comes back is what was put. */
static int find(struct fixture *fixture, const char *mesh, const char *sphere, int number)
{
    const struct store_prepared_key key = {mesh, sphere, number % 2 ? "odd" : "even"};
    unsigned char *expected = fixture_bytes(SIZE, (unsigned)number), *value;
    size_t size;
    int status = store_prepared_get(fixture->store, &key, &value, &size);

    if (status == STORE_OK) {
        assert_int_equal(size, SIZE);
        assert_memory_equal(value, expected, SIZE);
    } else {
        assert_null(value);
    }
    free(value);
    free(expected);
    return status;
}

/* The only file of a folder below DIR/prepared. */
static void file_in(const struct fixture *fixture, const char *folder, char path[600])
{
    char name[400];
    DIR *entries;
    int n = 0;

    (void)snprintf(name, sizeof name, "%s/prepared/%s", fixture->path, folder);
    entries = opendir(name);
    assert_non_null(entries);
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        if (entry->d_name[0] != '.') {
            (void)snprintf(path, 600, "%s/%.180s", name, entry->d_name);
            n++;
        }
    }
    closedir(entries);
    assert_int_equal(n, 1);
}

static void file_of(const struct fixture *fixture, const char *mesh, char path[600])
{
    file_in(fixture, mesh + strlen(mesh) - 2, path);
}

static void prepared_meshes_come_back(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX], sphere[STORE_ID_MAX];

    mesh_of(fixture, "mesh", mesh);
    mesh_of(fixture, "sphere", sphere);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND); /* no limit was set */
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, mesh, "", 3), STORE_OK);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(find(fixture, mesh, "", 2), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, mesh, sphere, 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, mesh, sphere, 2), STORE_OK);
    assert_int_equal(find(fixture, mesh, sphere, 2), STORE_OK);
    fixture_reopen(fixture);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(find(fixture, mesh, sphere, 2), STORE_OK);
    assert_int_equal(store_prepared_bytes(fixture->store), 2 * PAGE);
    store_prepared_limit(fixture->store, 0, 0);
    assert_int_equal(store_prepared_bytes(fixture->store), 0);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND);
}

static void strangers_are_not_kept(void **state)
{
    static const char nobody[] = "mesh-00000000000000000000000000000000";
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX];

    mesh_of(fixture, "mesh", mesh);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(put(fixture, nobody, "", 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, mesh, nobody, 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, "mesh-../../../0000000000000000000000", "", 1), STORE_OK);
    assert_int_equal(find(fixture, "mesh-../../../0000000000000000000000", "", 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, nobody, "", 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, mesh, nobody, 1), STORE_NOT_FOUND);
}

static void damage_is_absence(void **state)
{
    struct fixture *fixture = *state;
    struct store_report report;
    char mesh[STORE_ID_MAX], other[STORE_ID_MAX], path[600], stolen[700], message[300];
    int fd;

    mesh_of(fixture, "mesh", mesh);
    mesh_of(fixture, "other", other);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    file_of(fixture, mesh, path);
    assert_int_equal(truncate(path, 1500), 0);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND);
    assert_int_not_equal(access(path, F_OK), 0);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    fd = open(path, O_WRONLY);
    assert_int_equal(pwrite(fd, "x", 1, 2000), 1);
    close(fd);
    /* It is no damage to the data: what is there to be made again is waste. */
    assert_int_equal(store_verify(fixture->path, false, NULL, &report, message, sizeof message),
                     STORE_OK);
    assert_int_equal(report.orphans, 0); /* a daemon runs, and it is young */
    store_close(fixture->store);
    assert_int_equal(store_verify(fixture->path, true, NULL, &report, message, sizeof message),
                     STORE_OK);
    assert_int_equal(report.orphans, 1);
    assert_int_equal(report.removed, 1);
    fixture->store = fixture_store(fixture->path);
    store_prepared_limit(fixture->store, LIMIT, 0);
    /* Another's file under this name is none of this one. */
    assert_int_equal(put(fixture, other, "", 1), STORE_OK);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    file_of(fixture, other, stolen);
    assert_int_equal(rename(stolen, path), 0);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND);
}

static void what_was_not_read_gives_way(void **state)
{
    struct fixture *fixture = *state;
    char meshes[20][STORE_ID_MAX];
    int kept = 0;

    store_prepared_limit(fixture->store, LIMIT, 0);
    for (int i = 0; i < 20; i++) {
        char bytes[24];

        (void)snprintf(bytes, sizeof bytes, "mesh %d", i);
        mesh_of(fixture, bytes, meshes[i]);
        assert_int_equal(put(fixture, meshes[i], "", i), STORE_OK);
        assert_in_range(store_prepared_bytes(fixture->store), 1, LIMIT);
        usleep(2000); /* the clock of files has a coarse step */
        assert_int_equal(find(fixture, meshes[0], "", 0), STORE_OK);
        usleep(8000);
    }
    for (int i = 0; i < 20; i++) {
        kept += find(fixture, meshes[i], "", i) == STORE_OK;
    }
    assert_in_range(kept, 8, LIMIT / PAGE);
    assert_int_equal(find(fixture, meshes[0], "", 0), STORE_OK);
    assert_int_equal(find(fixture, meshes[1], "", 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, meshes[19], "", 19), STORE_OK);
}

static void put_encoding(struct fixture *fixture, const char *mesh, const char *sphere, char letter)
{
    char name[65];

    store_sha256_hex(name, &letter, 1);
    assert_int_equal(store_encoding_put(fixture->store, name, mesh, sphere, "value", 5, 1000),
                     STORE_OK);
}

static int find_encoding(struct fixture *fixture, char letter)
{
    unsigned char *value;
    char name[65];
    size_t size;
    int status;

    store_sha256_hex(name, &letter, 1);
    status = store_encoding_get(fixture->store, name, &value, &size);
    free(value);
    return status;
}

static void all_that_is_derived_goes(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX], other[STORE_ID_MAX], sphere[STORE_ID_MAX];

    mesh_of(fixture, "mesh", mesh);
    mesh_of(fixture, "other", other);
    mesh_of(fixture, "sphere", sphere);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(put(fixture, mesh, sphere, 1), STORE_OK);
    assert_int_equal(put(fixture, other, "", 1), STORE_OK);
    assert_int_equal(put(fixture, other, sphere, 1), STORE_OK);
    put_encoding(fixture, mesh, "", 'a');
    put_encoding(fixture, mesh, sphere, 'b');
    put_encoding(fixture, other, sphere, 'c');
    put_encoding(fixture, other, "", 'd');
    assert_int_equal(store_mesh_drop_derived(fixture->store, mesh), STORE_OK);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, mesh, sphere, 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, other, sphere, 1), STORE_OK);
    assert_int_equal(find_encoding(fixture, 'a'), STORE_NOT_FOUND);
    assert_int_equal(find_encoding(fixture, 'b'), STORE_NOT_FOUND);
    assert_int_equal(find_encoding(fixture, 'c'), STORE_OK);
    assert_int_equal(store_mesh_drop_derived(fixture->store, sphere), STORE_OK);
    assert_int_equal(find(fixture, other, sphere, 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, other, "", 1), STORE_OK);
    assert_int_equal(find_encoding(fixture, 'c'), STORE_NOT_FOUND);
    assert_int_equal(find_encoding(fixture, 'd'), STORE_OK);
    assert_int_equal(store_prepared_bytes(fixture->store), PAGE);
}

/* As after a crash between the deletion of a mesh and that of what was derived of it. */
static void the_sweep_finds_what_was_left(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX], other[STORE_ID_MAX], path[600], copy[700];
    size_t removed;

    mesh_of(fixture, "mesh", mesh);
    mesh_of(fixture, "other", other);
    store_prepared_limit(fixture->store, LIMIT, 0);
    assert_int_equal(put(fixture, mesh, "", 1), STORE_OK);
    assert_int_equal(store_sweep_files(fixture->store, &removed), STORE_OK);
    assert_int_equal(removed, 0);
    assert_int_equal(put(fixture, mesh, other, 1), STORE_OK);
    file_in(fixture, "pairs", path);
    (void)snprintf(copy, sizeof copy, "%s/prepared/pairs/mesh-%032d-%s", fixture->path, 0,
                   strrchr(path, '/') + 1);
    assert_int_equal(rename(path, copy), 0);
    assert_int_equal(store_sweep_files(fixture->store, &removed), STORE_OK);
    assert_int_equal(removed, 1);
    assert_int_equal(find(fixture, mesh, "", 1), STORE_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(prepared_meshes_come_back, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(strangers_are_not_kept, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(damage_is_absence, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(what_was_not_read_gives_way, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(all_that_is_derived_goes, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(the_sweep_finds_what_was_left, fixture_setup,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
