/*
 * Lists: every filter and order against what a plain search over all rows gives, page by page, for
 * one owner and for all; and that each is answered from an index that has all it needs, so that a
 * page stays fast however much there is.
 *
 * SRNFD_LIST_ROWS=100000 makes as many of each kind and prints what a page with its total takes.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <time.h>

#include "fixture.h"
#include "store/cohort.h"
#include "store/fold.h"
#include "store/internal.h"
#include "store/model.h"
#include "store/page.h"
#include "store/surface.h"
#include "store/volume.h"

#define HASH "1111111111111111111111111111111111111111111111111111111111111111"
#define MESH_3 "mesh-00000003"

static size_t rows_wanted(void)
{
    const char *text = getenv("SRNFD_LIST_ROWS");
    long rows = text ? strtol(text, NULL, 10) : 0;

    return rows > 0 ? (size_t)rows : 120;
}

static void execute(sqlite3 *db, const char *sql)
{
    char *message = NULL;

    if (sqlite3_exec(db, sql, NULL, NULL, &message) != SQLITE_OK) {
        fail_msg("%s: %.200s", message, sql);
    }
}

static sqlite3 *open_database(const struct fixture *fixture)
{
    char path[512];
    sqlite3 *db = NULL;

    snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    return db;
}

/* So many of each kind: every third is ben's alone, every fifth belongs to both, the others are
   ada's. Three are created in the same millisecond. */
static void fill(const struct fixture *fixture, size_t rows)
{
    sqlite3 *db = open_database(fixture);
    char sql[2048];

    execute(db, "PRAGMA synchronous = OFF; BEGIN; INSERT INTO owner (name) VALUES ('ada'), ('ben');"
                "INSERT INTO blob VALUES ('" HASH "', 0, x'')");
    snprintf(
        sql, sizeof sql,
        "CREATE TEMP TABLE n AS WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n "
        "WHERE i + 1 < %zu) SELECT i, printf('%%08x', i) AS x, 1000 + i / 3 AS ms, "
        "iif(i %% 3 = 0, 'ben', 'ada') AS owner, iif(i %% 7 = 0, 'Größe ', 'a ') || "
        "iif(i %% 2, 'Left', 'RIGHT') || ' ' || (i * 7919 %% 1000) AS name, "
        "iif(i %% 4 = 0, 'mirror', '') AS process FROM n",
        rows);
    execute(db, sql);
    execute(db,
            "INSERT INTO mesh SELECT 'mesh-' || x, name, 'ply', '{}', 1, 1, 1, ms, '" HASH
            "', '' FROM n;"
            "INSERT INTO surface SELECT 'surf-' || x, name, '{}', 4, ms, '" HASH "' FROM n;"
            "INSERT INTO model SELECT 'model-' || x, '{}', 'surf-' || x, 4, 1, 1, 1, 1, ms FROM n;"
            "INSERT INTO volume SELECT 'vol-' || x, name, '{}', 1, ms, '" HASH "' FROM n;"
            "CREATE TEMP TABLE kinds (kind, prefix); INSERT INTO kinds VALUES ('mesh', 'mesh-'), "
            "('surface', 'surf-'), ('model', 'model-'), ('volume', 'vol-');"
            "INSERT INTO owned (owner, id, kind, name, bytes, created_ms, first, process, cohort) "
            "SELECT owner, prefix || x, kind, name, 1, ms, 1, process, iif(kind = 'model' AND "
            "i % 6 = 1, 'group', '') FROM n, kinds;"
            "INSERT INTO owned (owner, id, kind, name, bytes, created_ms, first, process, cohort) "
            "SELECT iif(owner = 'ada', 'ben', 'ada'), prefix || x, kind, 'other ' || name, 1, "
            "ms + 5, 0, process, '' FROM n, kinds WHERE i % 5 = 0;"
            "INSERT INTO job (id, process, status, inputs, digest, numeric_build, message, "
            "progress, created_ms, updated_ms, owner, title, cohort, started_ms, finished_ms) "
            "SELECT 'job-' || x, iif(i % 2, 'encode', 'pca'), CASE i % 9 WHEN 0 THEN 'accepted' "
            "WHEN 1 THEN 'running' ELSE 'dismissed' END, '{}', printf('%064x', i), 'b', '', 0, "
            "ms, ms, owner, name, iif(i % 6 = 1, 'group', ''), iif(i % 5, ms + 1, 0), "
            "iif(i % 9 > 1, ms + 1 + i % 8, 0) FROM n;");
    execute(db,
            "INSERT INTO cohort (list, owner, name, record, digest, members, created_ms) SELECT "
            "i, owner, iif(i = 1, 'group', 'Group.' || x), '[]', '" HASH "', 1, ms FROM n;"
            "INSERT INTO cohort_member SELECT 1, i, 'mesh-' || x, NULL FROM n "
            "WHERE i % 8 = 1 AND i < 400;"
            "INSERT INTO cohort_member SELECT 1, 1000 + i, NULL, 'surf-' || x "
            "FROM n WHERE i % 8 = 1 AND i < 400;"
            "INSERT INTO tag SELECT owner, 'rare', id FROM owned WHERE CAST('0x' || "
            "substr(id, -2) AS TEXT) = '0x05';"
            "INSERT INTO tag SELECT owner, 'rare', id FROM job WHERE substr(id, -2) = '05';"
            "INSERT INTO need SELECT owner, id, '" MESH_3 "', 0 FROM owned WHERE "
            "substr(id, -1) = '7';"
            "INSERT INTO need SELECT owner, id, '" MESH_3 "', 0 FROM job WHERE "
            "substr(id, -1) = '7';"
            "INSERT OR IGNORE INTO cohort_member SELECT list, 0, '" MESH_3
            "', NULL FROM cohort WHERE substr(name, -1) = '7'; COMMIT");
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

/* ---- What is seen ---------------------------------------------------------------------------- */

#define SEEN_MAX 2000
struct seen {
    const struct store_page *page;
    size_t count;
    char ids[SEEN_MAX][200], text[1024];
    int64_t ms;
};

static bool note(void *user, const char *id, const char *name, const char *process,
                 const char *status, int64_t created_ms)
{
    struct seen *seen = user;
    const char *const keys[] = {"", name, process, status};

    assert_true(seen->count < SEEN_MAX);
    snprintf(seen->ids[seen->count++], sizeof seen->ids[0], "%s", id);
    snprintf(seen->text, sizeof seen->text, "%s", keys[seen->page->key]);
    seen->ms = created_ms;
    return true;
}

static bool note_mesh(void *user, const struct store_mesh *mesh)
{
    bool mirrored = strtol(mesh->id + 5, NULL, 16) % 4 == 0;

    return note(user, mesh->id, mesh->name, mirrored ? "mirror" : "", "", mesh->created_ms);
}
static bool note_surface(void *user, const struct store_surface *surface)
{
    bool mirrored = strtol(surface->id + 5, NULL, 16) % 4 == 0;

    return note(user, surface->id, surface->name, mirrored ? "mirror" : "", "",
                surface->created_ms);
}
static bool note_model(void *user, const struct store_model *model)
{
    bool mirrored = strtol(model->id + 6, NULL, 16) % 4 == 0;

    return note(user, model->id, model->name, mirrored ? "mirror" : "", "", model->created_ms);
}
static bool note_volume(void *user, const struct store_volume *volume)
{
    return note(user, volume->id, volume->name, "", "", volume->created_ms);
}
static bool note_cohort(void *user, const struct store_cohort *cohort)
{
    char id[200];

    snprintf(id, sizeof id, "%s/%s", cohort->name, cohort->owner);
    return note(user, id, cohort->name, "", "", cohort->created_ms);
}
static bool note_job(void *user, const struct store_job *job)
{
    return note(user, job->id, job->name, job->process, store_job_status_name(job->status),
                job->created_ms);
}

static int list_meshes(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_mesh_list(store, page, note_mesh, seen);
}
static int list_surfaces(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_surface_list(store, page, note_surface, seen);
}
static int list_models(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_model_list(store, page, note_model, seen);
}
static int list_volumes(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_volume_list(store, page, note_volume, seen);
}
static int list_cohorts(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_cohort_list(store, page, note_cohort, seen);
}
static int list_jobs(struct store *store, const struct store_page *page, struct seen *seen)
{
    return store_job_list(store, page, note_job, seen);
}

static const struct kind {
    const char *name;
    int (*list)(struct store *store, const struct store_page *page, struct seen *seen);
    const struct store_listing *listing;
    const char *id, *table; /* the plain search */
} kinds[] = {
    {"mesh", list_meshes, &store_mesh_listing, "id", "owned"},
    {"surface", list_surfaces, &store_surface_listing, "id", "owned"},
    {"model", list_models, &store_model_listing, "id", "owned"},
    {"volume", list_volumes, &store_volume_listing, "id", "owned"},
    {"cohort", list_cohorts, &store_cohort_listing, "name || '/' || owner", "cohort"},
    {"job", list_jobs, &store_job_listing, "id", "job"},
};
#define KINDS (sizeof kinds / sizeof kinds[0])

/* ---- The plain search ------------------------------------------------------------------------ */

struct request {
    struct store_page page;
    const char *plain; /* a condition on the row's number and columns; kinds without it get none */
    const char *kinds; /* that can be asked so */
};

static const struct request requests[] = {
    {{.limit = 7}, "1", "mesh surface model volume cohort job"},
    {{.limit = 7, .rising = true}, "1", "mesh surface model volume cohort job"},
    {{.limit = 7, .name = "lEFT"}, "named LIKE '%left%'", "mesh surface model volume cohort job"},
    {{.limit = 7, .name = "GRÖSSE"}, "0", "mesh surface model volume job"},
    {{.limit = 7, .name = "GRÖ"}, "named LIKE '%Grö%'", "mesh surface model volume job"},
    {{.limit = 7, .name = "%"}, "0", "mesh surface model volume job"},
    {{.limit = 7, .key = STORE_PAGE_NAME, .rising = true},
     "1",
     "mesh surface model volume cohort job"},
    {{.limit = 7, .key = STORE_PAGE_NAME}, "1", "mesh surface model volume cohort job"},
    {{.limit = 7, .key = STORE_PAGE_PROCESS}, "1", "mesh surface model job"},
    {{.limit = 7, .key = STORE_PAGE_STATUS, .rising = true}, "1", "job"},
    {{.limit = 7, .process = "mirror"}, "process = 'mirror'", "mesh surface model"},
    {{.limit = 7, .process = "encode"}, "process = 'encode'", "job"},
    {{.limit = 7, .status = "accepted"}, "status = 'accepted'", "job"},
    {{.limit = 7, .status = "running,failed,accepted"}, "status <> 'dismissed'", "job"},
    {{.limit = 7, .process = "mean,encode"}, "process = 'encode'", "job"},
    {{.limit = 7, .nothing = true}, "0", "mesh surface model volume cohort job"},
    {{.limit = 7, .by_duration = true, .shortest_ms = 3, .longest_ms = 50, .now_ms = 1100},
     "started_ms > 0 AND (status = 'running' AND 1100 - started_ms BETWEEN 3 AND 50 OR "
     "status = 'dismissed' AND finished_ms - started_ms BETWEEN 3 AND 50)",
     "job"},
    {{.limit = 7, .tag = "rare"}, "substr(id, -2) = '05'", "mesh surface model volume job"},
    {{.limit = 7, .mesh = MESH_3}, "substr(id, -1) = '7'", "mesh surface model job"},
    {{.limit = 7, .mesh = MESH_3}, "substr(name, -1) = '7'", "cohort"},
    {{.limit = 7, .cohort = "group"}, "cohort = 'group'", "model job"},
    {{.limit = 7, .since_ms = 1010, .until_ms = 1020},
     "created_ms >= 1010 AND created_ms < 1020",
     "mesh surface model volume cohort job"},
    {{.limit = 7, .name = "right", .tag = "rare", .process = "mirror", .since_ms = 1001},
     "named LIKE '%right%' AND substr(id, -2) = '05' AND process = 'mirror' AND created_ms >= 1001",
     "mesh surface model"},
};
#define REQUESTS (sizeof requests / sizeof requests[0])

static size_t search_plainly(sqlite3 *db, const struct kind *kind, const struct request *request,
                             const char *owner, char (*ids)[200])
{
    const bool owned = strcmp(kind->table, "owned") == 0, job = strcmp(kind->name, "job") == 0;
    const char *direction = request->page.rising ? "ASC" : "DESC";
    const char *const keys[] = {"created_ms", "folded(named)", "process", "status"};
    sqlite3_stmt *rows = NULL;
    char sql[1024];
    size_t n = 0;

    snprintf(sql, sizeof sql,
             "SELECT %s FROM (SELECT *, %s AS named FROM %s) WHERE (%s) AND %s AND %s%s%s "
             "ORDER BY %s %s, %s %s",
             kind->id, job ? "title" : "name", kind->table, request->plain,
             owner   ? "owner = ?1"
             : owned ? "first = 1"
                     : "1",
             owned ? "kind = '" : "1", owned ? kind->name : "", owned ? "'" : "",
             keys[request->page.key], direction, kind->id, direction);
    if (sqlite3_prepare_v2(db, sql, -1, &rows, NULL) != SQLITE_OK) {
        fail_msg("%s: %s", sqlite3_errmsg(db), sql);
    }
    if (owner) {
        sqlite3_bind_text(rows, 1, owner, -1, SQLITE_STATIC);
    }
    while (sqlite3_step(rows) == SQLITE_ROW) {
        assert_true(n < SEEN_MAX);
        snprintf(ids[n++], 200, "%s", (const char *)sqlite3_column_text(rows, 0));
    }
    sqlite3_finalize(rows);
    return n;
}

/* All pages of the list; what does not end in time repeats itself. */
static int64_t walk(struct store *store, const struct kind *kind, const struct request *request,
                    const char *owner, struct seen *seen)
{
    struct store_page page = request->page;
    char id[200], text[1024];
    int64_t total = -1;
    size_t before;

    seen->count = 0;
    seen->page = &page;
    page.owner = owner;
    page.total = &total;
    do {
        before = seen->count;
        assert_int_equal(kind->list(store, &page, seen), STORE_OK);
        if (seen->count > before) {
            snprintf(id, sizeof id, "%s", seen->ids[seen->count - 1]);
            snprintf(text, sizeof text, "%s", seen->text);
            page.after_id = id;
            page.after_text = text;
            page.after_ms = seen->ms;
        }
    } while (seen->count > before);
    return total;
}

static void lists_are_what_a_plain_search_finds(void **state)
{
    struct fixture *fixture = *state;
    static char wanted[SEEN_MAX][200];
    static struct seen seen;
    static const char *const owners[] = {NULL, "ada", "ben"};
    sqlite3 *db;

    fill(fixture, 120);
    fixture_reopen(fixture);
    db = open_database(fixture);
    assert_int_equal(store_fold_define(db), SQLITE_OK);
    for (size_t r = 0; r < REQUESTS; r++) {
        for (size_t k = 0; k < KINDS; k++) {
            for (size_t o = 0; o < 3 && strstr(requests[r].kinds, kinds[k].name); o++) {
                size_t n = search_plainly(db, &kinds[k], &requests[r], owners[o], wanted);
                int64_t total = walk(fixture->store, &kinds[k], &requests[r], owners[o], &seen);

                if (seen.count != n || (size_t)total != n) {
                    fail_msg("request %zu of %s for %s: %zu found, total %lld, of %zu", r,
                             kinds[k].name, owners[o] ? owners[o] : "all", seen.count,
                             (long long)total, n);
                }
                for (size_t i = 0; i < n; i++) {
                    assert_string_equal(seen.ids[i], wanted[i]);
                }
            }
        }
    }
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

static void members_of_a_cohort_are_listed(void **state)
{
    struct fixture *fixture = *state;
    const struct request request = {.page = {.limit = 4, .cohort = "group"}};
    static struct seen seen;

    fill(fixture, 120);
    fixture_reopen(fixture);
    /* of 1, 9, .. 113 every third is ben's */
    assert_int_equal(walk(fixture->store, &kinds[0], &request, NULL, &seen), 15);
    assert_int_equal(walk(fixture->store, &kinds[1], &request, NULL, &seen), 15);
    assert_string_equal(seen.ids[14], "surf-00000001");
    assert_int_equal(walk(fixture->store, &kinds[0], &request, "ada", &seen), 11);
    assert_int_equal(walk(fixture->store, &kinds[0], &request, "ben", &seen), 0);
    /* what has no such filter has nothing that passes it */
    assert_int_equal(walk(fixture->store, &kinds[3], &request, NULL, &seen), 0);
}

/* ---- Plans and times ------------------------------------------------------------------------- */

/* Whether the plan reads what is listed from a covering index, or goes by the ids that a tag or
   mesh has, and sorts no rows where the index has the order. */
static void check_plan(sqlite3 *db, const struct kind *kind, const struct store_page *page,
                       const char *sql, bool ordered)
{
    sqlite3_stmt *rows = NULL;
    char *explain = sqlite3_mprintf("EXPLAIN QUERY PLAN %s", sql), plan[4096] = "";
    const char *inner;

    if (sqlite3_prepare_v2(db, explain, -1, &rows, NULL) != SQLITE_OK) {
        fail_msg("%s: %s", sqlite3_errmsg(db), sql);
    }
    while (sqlite3_step(rows) == SQLITE_ROW) {
        size_t used = strlen(plan);

        snprintf(plan + used, sizeof plan - used, "%s\n",
                 (const char *)sqlite3_column_text(rows, 3));
    }
    sqlite3_finalize(rows);
    sqlite3_free(explain);
    inner = strstr(plan, "listed");
    inner = inner ? inner + strlen("listed") : "";
    if (strncmp(inner, " USING COVERING INDEX ", 22) != 0 && !strstr(inner, "(id=?)") &&
        !strstr(inner, "PRIMARY KEY (rowid=?)")) {
        fail_msg("%s of %s:\n%s\n%s", kind->name, page->owner ? page->owner : "all", sql, plan);
    }
    if (ordered && !page->tag && !page->mesh) {
        const char *sorted = strstr(plan, "USE TEMP B-TREE FOR ORDER BY");

        /* that of the page itself comes last */
        if (sorted && strstr(sorted + 1, "USE TEMP B-TREE FOR ORDER BY")) {
            fail_msg("%s is sorted:\n%s\n%s", kind->name, sql, plan);
        }
    }
}

static double milliseconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static void tell_time(struct store *store, const struct kind *kind, const struct request *request,
                      const char *owner)
{
    static struct seen seen;
    struct store_page page = request->page;
    double began = milliseconds();
    int64_t total = 0;

    page.limit = 51;
    page.owner = owner;
    page.total = &total;
    for (int i = 0; i < 5; i++) {
        seen = (struct seen){.page = &page};
        assert_int_equal(kind->list(store, &page, &seen), STORE_OK);
    }
    print_message("%-8s %-4s request %2zu: %6.1f ms, total %lld\n", kind->name,
                  owner ? owner : "all", (size_t)(request - requests), (milliseconds() - began) / 5,
                  (long long)total);
}

static void pages_come_from_indexes(void **state)
{
    struct fixture *fixture = *state;
    static const char *const owners[] = {NULL, "ada"};
    char sql[STORE_PAGE_SQL_MAX];
    size_t rows = rows_wanted();
    sqlite3 *db;

    fill(fixture, rows);
    fixture_reopen(fixture);
    db = open_database(fixture);
    assert_int_equal(store_fold_define(db), SQLITE_OK);
    for (size_t r = 0; r < REQUESTS; r++) {
        for (size_t k = 0; k < KINDS; k++) {
            for (size_t o = 0; o < 2 && strstr(requests[r].kinds, kinds[k].name); o++) {
                struct store_page page = requests[r].page;
                bool cohort = strcmp(kinds[k].name, "cohort") == 0;

                page.owner = owners[o];
                page.after_id = r % 2 ? "x" : NULL;
                page.after_text = "x";
                page.after_ms = 1015;
                store_page_sql(kinds[k].listing, &page, sql);
                check_plan(db, &kinds[k], &page, sql, page.key == STORE_PAGE_CREATED && !cohort);
                store_page_count_sql(kinds[k].listing, &page, sql);
                check_plan(db, &kinds[k], &page, sql, false);
                if (rows > 120) {
                    tell_time(fixture->store, &kinds[k], &requests[r], owners[o]);
                }
            }
        }
    }
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(lists_are_what_a_plain_search_finds, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(members_of_a_cohort_are_listed, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(pages_come_from_indexes, fixture_setup, fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
