/*
 * test_encodings.c - the cache of encodings: what is put comes back, damage is as if nothing were
 * there, the oldest give way, and all that is kept stays within the limit and what one round of
 * writes adds.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "server/store/fixture.h"
#include "store/digest.h"
#include "store/encoding.h"
#include "store/store.h"

#define SIZE ((size_t)1024)
#define LIMIT ((int64_t)20 * 1024)
#define ROUND 64 /* writes between two looks at the limit */

static void mesh_of(struct fixture *fixture, char id[STORE_ID_MAX])
{
    bool created;

    assert_int_equal(
        fixture_put_mesh(fixture->store, (const unsigned char *)"mesh", 4, id, &created), STORE_OK);
}

static void name_of(int number, char name[65])
{
    store_sha256_hex(name, &number, sizeof number);
}

static int put(struct fixture *fixture, const char *mesh, int number, size_t size)
{
    unsigned char *value = fixture_bytes(size, (unsigned)number);
    char name[65];
    int status;

    name_of(number, name);
    status = store_encoding_put(fixture->store, name, mesh, "", value, size, LIMIT);
    free(value);
    return status;
}

/* STORE_OK only where what comes back is what was put. */
static int find(struct fixture *fixture, int number)
{
    unsigned char *expected = fixture_bytes(SIZE, (unsigned)number), *value;
    char name[65];
    size_t size;
    int status;

    name_of(number, name);
    status = store_encoding_get(fixture->store, name, &value, &size);
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

static void encodings_come_back(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX];

    mesh_of(fixture, mesh);
    assert_int_equal(find(fixture, 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, mesh, 1, SIZE), STORE_OK);
    assert_int_equal(put(fixture, mesh, 1, SIZE), STORE_OK);
    assert_int_equal(find(fixture, 1), STORE_OK);
    assert_int_equal(find(fixture, 2), STORE_NOT_FOUND);
    fixture_reopen(fixture);
    assert_int_equal(find(fixture, 1), STORE_OK);
    assert_true(put(fixture, "mesh-of-nobody", 3, SIZE) < 0);
    assert_int_equal(find(fixture, 3), STORE_NOT_FOUND);
}

static void damage_is_absence(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX], path[512];
    sqlite3 *db;

    mesh_of(fixture, mesh);
    assert_int_equal(put(fixture, mesh, 1, SIZE), STORE_OK);
    store_close(fixture->store);
    (void)snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db,
                                  "UPDATE encoding SET value = CAST(substr(value, 1, 1000) || "
                                  "zeroblob(24) AS BLOB)",
                                  NULL, NULL, NULL),
                     SQLITE_OK);
    sqlite3_close(db);
    fixture->store = fixture_store(fixture->path);
    assert_int_equal(find(fixture, 1), STORE_NOT_FOUND);
    assert_int_equal(put(fixture, mesh, 1, SIZE), STORE_OK);
    assert_int_equal(find(fixture, 1), STORE_OK);
}

static void the_oldest_give_way(void **state)
{
    struct fixture *fixture = *state;
    char mesh[STORE_ID_MAX];
    int kept = 0;

    mesh_of(fixture, mesh);
    assert_int_equal(put(fixture, mesh, 0, (size_t)LIMIT + 1), STORE_OK);
    assert_int_equal(find(fixture, 0), STORE_NOT_FOUND); /* more than all may take */
    for (int i = 1; i <= 3 * ROUND; i++) {
        assert_int_equal(put(fixture, mesh, i, SIZE), STORE_OK);
    }
    for (int i = 1; i <= 3 * ROUND; i++) {
        kept += find(fixture, i) == STORE_OK;
    }
    assert_in_range(kept, LIMIT / (int64_t)SIZE, LIMIT / (int64_t)SIZE + ROUND);
    assert_int_equal(find(fixture, 1), STORE_NOT_FOUND);
    assert_int_equal(find(fixture, 3 * ROUND), STORE_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(encodings_come_back, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(damage_is_absence, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(the_oldest_give_way, fixture_setup, fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
