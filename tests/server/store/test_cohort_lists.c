/*
 * test_cohort_lists.c - long cohorts: they are written and removed in pieces between which others
 * write, nobody sees a part of one, a failure leaves nothing behind, and what is said of members
 * changes without writing them again.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <sqlite3.h>
#include <stdatomic.h>

#include "server/store/fixture.h"
#include "store/cohort.h"
#include "store/erase.h"
#include "store/holdings.h"
#include "store/usage.h"

#define LONG 20000 /* members */
#define MESHES 3

/* The first column of the first row, as another program would read it; 0 where there is none. */
static int64_t ask(const struct fixture *fixture, const char *sql)
{
    char path[512];
    sqlite3 *db = NULL;
    sqlite3_stmt *row = NULL;
    int64_t value = 0;

    (void)snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    (void)sqlite3_busy_timeout(db, 5000);
    assert_int_equal(sqlite3_prepare_v2(db, sql, -1, &row, NULL), SQLITE_OK);
    if (sqlite3_step(row) == SQLITE_ROW) {
        value = sqlite3_column_int64(row, 0);
    }
    sqlite3_finalize(row);
    sqlite3_close(db);
    return value;
}

static int64_t members(const struct fixture *fixture)
{
    return ask(fixture, "SELECT count(*) FROM cohort_member");
}

static int64_t loose(const struct fixture *fixture)
{
    return ask(fixture, "SELECT count(*) FROM loose_list");
}

static void put_meshes(struct store *store, char ids[MESHES][STORE_ID_MAX])
{
    for (unsigned i = 0; i < MESHES; i++) {
        unsigned char *bytes = fixture_bytes(100, i);
        bool created;

        assert_int_equal(fixture_put_mesh(store, bytes, 100, ids[i], &created), STORE_OK);
        free(bytes);
    }
}

/* A cohort that names the meshes in turn. */
static struct store_cohort make_cohort(const char *name, const char *record,
                                       char ids[MESHES][STORE_ID_MAX], size_t n)
{
    struct store_cohort cohort = {.record = strdup(record), .n_members = n};

    (void)snprintf(cohort.name, sizeof cohort.name, "%s", name);
    cohort.members = calloc(n, sizeof *cohort.members);
    assert_non_null(cohort.members);
    for (size_t i = 0; i < n; i++) {
        memcpy(cohort.members[i], ids[i % MESHES], STORE_ID_MAX);
    }
    return cohort;
}

static void put_long(struct store *store, char ids[MESHES][STORE_ID_MAX])
{
    struct store_cohort cohort = make_cohort("long", "[1]", ids, LONG);
    size_t missing;
    bool created;

    assert_int_equal(store_cohort_put(store, &cohort, &created, &missing), STORE_OK);
    assert_true(created);
    assert_int_equal(store_cohort_put(store, &cohort, &created, &missing), STORE_OK);
    assert_false(created);
    store_cohort_clear(&cohort);
}

static void long_cohorts_come_and_go(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_cohort cohort;
    int64_t before, after;

    put_meshes(fixture->store, ids);
    assert_int_equal(store_owner_bytes(fixture->store, "", &before, NULL), STORE_OK);
    put_long(fixture->store, ids);
    assert_int_equal(store_owner_bytes(fixture->store, "", &after, NULL), STORE_OK);
    assert_int_equal(after - before, 1024 + 512 * LONG + 3);
    assert_int_equal(store_cohort_get(fixture->store, "long", &cohort), STORE_OK);
    assert_int_equal(cohort.n_members, LONG);
    for (size_t i = 0; i < LONG; i++) {
        assert_string_equal(cohort.members[i], ids[i % MESHES]);
    }
    store_cohort_clear(&cohort);
    assert_int_equal(loose(fixture), 0);
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "long", NULL), STORE_OK);
    assert_int_equal(members(fixture), 0);
    assert_int_equal(loose(fixture), 0);
    assert_int_equal(store_owner_bytes(fixture->store, "", &after, NULL), STORE_OK);
    assert_int_equal(after, before);
}

/* Replaces the cohort "long" as it is by one with this text. */
static int replace(struct store *store, struct store_cohort *cohort, size_t *missing)
{
    struct store_cohort old;
    bool changed;
    int status;

    assert_int_equal(store_cohort_get(store, "long", &old), STORE_OK);
    status = store_cohort_replace(store, &old, cohort, &changed, missing);
    assert_false(changed);
    store_cohort_clear(&old);
    return status;
}

static void what_is_said_changes_alone(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_cohort cohort;
    int64_t list, before, after;
    size_t missing;

    put_meshes(fixture->store, ids);
    put_long(fixture->store, ids);
    list = ask(fixture, "SELECT list FROM cohort");
    assert_int_equal(store_owner_bytes(fixture->store, "", &before, NULL), STORE_OK);
    cohort = make_cohort("long", "[1,22]", ids, LONG);
    assert_int_equal(replace(fixture->store, &cohort, &missing), STORE_OK);
    store_cohort_clear(&cohort);
    assert_int_equal(ask(fixture, "SELECT list FROM cohort"), list);
    assert_int_equal(store_owner_bytes(fixture->store, "", &after, NULL), STORE_OK);
    assert_int_equal(after - before, 3);
    /* Other members are another list, and of the old one nothing is left. */
    for (size_t n = LONG + 1; n > 1; n -= LONG) {
        cohort = make_cohort("long", "[3]", ids, n);
        assert_int_equal(replace(fixture->store, &cohort, &missing), STORE_OK);
        store_cohort_clear(&cohort);
        assert_true(ask(fixture, "SELECT list FROM cohort") != list);
        assert_int_equal(members(fixture), n);
        assert_int_equal(loose(fixture), 0);
        assert_int_equal(store_owner_bytes(fixture->store, "", &after, NULL), STORE_OK);
        assert_int_equal(after - before, 512 * ((int64_t)n - LONG));
    }
}

static void a_missing_member_leaves_nothing(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_cohort cohort;
    size_t missing = 0;
    bool created;

    put_meshes(fixture->store, ids);
    cohort = make_cohort("long", "[1]", ids, LONG);
    (void)snprintf(cohort.members[LONG - 7], STORE_ID_MAX, "mesh-none");
    assert_int_equal(store_cohort_put(fixture->store, &cohort, &created, &missing),
                     STORE_NOT_FOUND);
    assert_int_equal(missing, LONG - 7);
    assert_int_equal(members(fixture), 0);
    assert_int_equal(loose(fixture), 0);
    put_long(fixture->store, ids);
    missing = 0;
    cohort.record[1] = '2';
    assert_int_equal(replace(fixture->store, &cohort, &missing), STORE_NOT_FOUND);
    assert_true(cohort.created_ms > 0);
    assert_int_equal(missing, LONG - 7);
    assert_int_equal(members(fixture), LONG);
    assert_int_equal(loose(fixture), 0);
    store_cohort_clear(&cohort);
}

static void a_quota_refuses_first(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_cohort cohort;
    size_t missing = 0;
    bool created;

    put_meshes(fixture->store, ids);
    cohort = make_cohort("long", "[1]", ids, LONG);
    cohort.bytes_max = 512 * LONG;
    assert_int_equal(store_cohort_put(fixture->store, &cohort, &created, &missing), STORE_QUOTA);
    assert_int_equal(members(fixture), 0);
    assert_int_equal(loose(fixture), 0);
    store_cohort_clear(&cohort);
}

/* What a kill leaves: a list half filled, and one that is half removed. Neither keeps what it
   names. */
static void a_crash_leaves_nothing(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_erasure erasure = {.owner = "", .id = ids[1]};

    put_meshes(fixture->store, ids);
    put_long(fixture->store, ids);
    (void)ask(fixture, "INSERT INTO loose_list VALUES (70, 0), (71, 1)");
    (void)ask(fixture, "INSERT INTO cohort_member SELECT 70 + position % 2, position, mesh, NULL "
                       "FROM cohort_member WHERE position < 9000");
    assert_int_equal(members(fixture), LONG + 9000);
    assert_int_equal(store_erase(fixture->store, &erasure), STORE_CONFLICT);
    fixture_reopen(fixture);
    assert_int_equal(members(fixture), LONG);
    assert_int_equal(loose(fixture), 0);

    (void)ask(fixture, "INSERT INTO loose_list VALUES (71, 1)");
    (void)ask(fixture, "INSERT INTO cohort_member SELECT 71, position, mesh, NULL "
                       "FROM cohort_member WHERE position < 9000");
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "long", NULL), STORE_OK);
    assert_int_equal(members(fixture), 9000);
    assert_int_equal(store_erase(fixture->store, &erasure), STORE_OK);
    assert_int_equal(members(fixture), 6000);
    fixture_reopen(fixture);
    assert_int_equal(members(fixture), 0);
    assert_int_equal(ask(fixture, "SELECT count(*) FROM pragma_foreign_key_check"), 0);
}

/* ---- Beside others --------------------------------------------------------------------------- */

struct other {
    struct store *store;
    atomic_bool end;
    atomic_int writes;
};

static void *write_on(void *user)
{
    struct other *other = user;
    bool answered;

    while (!atomic_load(&other->end)) {
        if (store_probe(other->store, 60000, &answered) != STORE_OK || !answered) {
            break;
        }
        (void)atomic_fetch_add(&other->writes, 1);
    }
    return NULL;
}

/* Ten pieces: between any two of them one who writes all the time gets through. */
static void others_write_meanwhile(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct other other = {.store = fixture->store};
    pthread_t thread;
    int before;

    put_meshes(fixture->store, ids);
    assert_int_equal(pthread_create(&thread, NULL, write_on, &other), 0);
    while (atomic_load(&other.writes) == 0) {
    }
    before = atomic_load(&other.writes);
    put_long(fixture->store, ids);
    assert_true(atomic_load(&other.writes) >= before + 5);
    before = atomic_load(&other.writes);
    assert_int_equal(store_cohort_delete_as(fixture->store, "", "long", NULL), STORE_OK);
    assert_true(atomic_load(&other.writes) >= before + 5);
    atomic_store(&other.end, true);
    assert_int_equal(pthread_join(thread, NULL), 0);
}

struct late {
    struct store *store;
    struct store_cohort cohort;
    size_t missing;
    int status;
};

static void *put_late(void *user)
{
    struct late *late = user;
    bool created;

    late->status = store_cohort_put(late->store, &late->cohort, &created, &late->missing);
    return NULL;
}

/* While a list is filled a mesh goes that it names: then there is no cohort; or the cohort was
   first, and keeps the mesh. */
static void an_erasure_meanwhile_is_seen(void **state)
{
    struct fixture *fixture = *state;
    char ids[MESHES][STORE_ID_MAX];
    struct store_erasure erasure = {.owner = "", .id = ids[1]};
    struct late late = {.store = fixture->store};
    pthread_t thread;
    int status;

    put_meshes(fixture->store, ids);
    late.cohort = make_cohort("long", "[1]", ids, LONG);
    assert_int_equal(pthread_create(&thread, NULL, put_late, &late), 0);
    while (loose(fixture) == 0 && members(fixture) < LONG) {
    }
    status = store_erase(fixture->store, &erasure);
    assert_int_equal(pthread_join(thread, NULL), 0);
    if (status == STORE_OK) {
        assert_int_equal(late.status, STORE_NOT_FOUND);
        assert_int_equal(late.missing % MESHES, 1);
        assert_int_equal(members(fixture), 0);
    } else {
        assert_int_equal(status, STORE_CONFLICT);
        assert_int_equal(late.status, STORE_OK);
        assert_int_equal(members(fixture), LONG);
    }
    assert_int_equal(loose(fixture), 0);
    store_cohort_clear(&late.cohort);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)
    const struct CMUnitTest tests[] = {
        TEST(long_cohorts_come_and_go),        TEST(what_is_said_changes_alone),
        TEST(a_missing_member_leaves_nothing), TEST(a_quota_refuses_first),
        TEST(a_crash_leaves_nothing),          TEST(others_write_meanwhile),
        TEST(an_erasure_meanwhile_is_seen),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
