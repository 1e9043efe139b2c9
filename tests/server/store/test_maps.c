/*
 * test_maps.c - scalar maps of a surface: what is put comes back, maps are part of the id, and a
 * damaged row is told.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <sqlite3.h>

#include "server/store/fixture.h"
#include "store/surface.h"

#define LMAX 4

/* A surface with maps of n_theta rows; 0: without. */
static void put(struct store *store, int64_t n_theta, double value, char id[STORE_ID_MAX],
                bool *created)
{
    struct store_surface surface = {.lmax = LMAX, .coefficient_count = 3 * (LMAX + 1) * (LMAX + 1)};

    surface.coefficients = calloc(surface.coefficient_count, sizeof(double));
    assert_non_null(surface.coefficients);
    surface.name = strdup("");
    surface.record = strdup("{}");
    store_surface_id(surface.id, surface.lmax, surface.coefficients, 1.0);
    if (n_theta) {
        surface.maps = (struct store_maps){.count = 2, .n_theta = n_theta, .n_phi = 2 * n_theta};
        snprintf(surface.maps.names[0], STORE_MAP_NAME_MAX, "significance");
        snprintf(surface.maps.names[1], STORE_MAP_NAME_MAX, "effect");
        surface.maps.values = calloc(store_maps_values(&surface.maps), sizeof(double));
        assert_non_null(surface.maps.values);
        surface.maps.values[3] = value;
        store_surface_id_maps(surface.id, &surface.maps);
    }
    memcpy(id, surface.id, STORE_ID_MAX);
    assert_int_equal(store_surface_put(store, &surface, created), STORE_OK);
    store_surface_clear(&surface);
}

static void maps_come_back(void **state)
{
    struct fixture *fixture = *state;
    char plain[STORE_ID_MAX];
    char first[STORE_ID_MAX];
    char second[STORE_ID_MAX];
    char large[STORE_ID_MAX];
    struct store_maps maps;
    bool created;

    put(fixture->store, 0, 0.0, plain, &created);
    put(fixture->store, 8, 1.5, first, &created);
    put(fixture->store, 8, 2.5, second, &created);
    put(fixture->store, 150, 3.5, large, &created); /* beyond what lies in the database */
    assert_string_not_equal(plain, first);
    assert_string_not_equal(first, second);
    put(fixture->store, 8, 1.5, first, &created);
    assert_false(created);

    assert_int_equal(store_surface_maps(fixture->store, plain, &maps), STORE_NOT_FOUND);
    assert_int_equal(store_surface_maps(fixture->store, "surf-none", &maps), STORE_NOT_FOUND);
    assert_int_equal(store_surface_maps(fixture->store, first, &maps), STORE_OK);
    assert_int_equal(maps.count, 2);
    assert_int_equal(maps.n_theta, 8);
    assert_int_equal(maps.n_phi, 16);
    assert_string_equal(maps.names[0], "significance");
    assert_string_equal(maps.names[1], "effect");
    assert_true(maps.values[3] == 1.5 && maps.values[4] == 0.0);
    store_maps_clear(&maps);
    assert_int_equal(store_surface_maps(fixture->store, large, &maps), STORE_OK);
    assert_true(maps.values[3] == 3.5);
    store_maps_clear(&maps);
}

static void damage_is_told(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    char path[512];
    struct store_maps maps;
    sqlite3 *db = NULL;
    bool created;

    put(fixture->store, 8, 1.5, id, &created);
    snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "UPDATE surface_maps SET names = 'one'", NULL, NULL, NULL),
                     SQLITE_OK);
    assert_int_equal(store_surface_maps(fixture->store, id, &maps), STORE_CORRUPT);
    assert_null(maps.values);
    assert_int_equal(sqlite3_exec(db, "UPDATE surface_maps SET names = 'one,two', n_theta = 9",
                                  NULL, NULL, NULL),
                     SQLITE_OK);
    assert_int_equal(store_surface_maps(fixture->store, id, &maps), STORE_CORRUPT);
    sqlite3_close(db);
}

static void the_same_maps_mend(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    struct store_maps maps;
    bool created;

    put(fixture->store, 8, 1.5, id, &created);
    fixture_damage_inline(fixture);
    assert_int_equal(store_surface_maps(fixture->store, id, &maps), STORE_CORRUPT);
    put(fixture->store, 8, 1.5, id, &created);
    assert_false(created);
    assert_int_equal(store_surface_maps(fixture->store, id, &maps), STORE_OK);
    assert_true(maps.values[3] == 1.5);
    store_maps_clear(&maps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(maps_come_back, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(damage_is_told, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(the_same_maps_mend, fixture_setup, fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
