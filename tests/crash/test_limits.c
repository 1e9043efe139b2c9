/* srnfd-test: release-only
 * srnfd-test: timeout 120
 *
 * What a daemon refuses and what it lets go: databases that are newer or damaged stay as they are,
 * a second daemon on the directory goes away, a job that takes too long fails with time-limit,
 * ended jobs go after their days, and a wall clock that jumps, shifted by the shim, neither takes
 * jobs along nor turns the order of ids.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "store/store.h"
#include "store/digest.h"
#include "support/ledger.h"
#include "support/scratch.h"

#define DAY_MS ((int64_t)86400000)
#define JSON_BODY "Content-Type: application/json\r\n"

struct scene {
    char folder[SCRATCH_MAX], mesh[64];
    struct daemon daemon;
};

static void pause_ms(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    nanosleep(&time, NULL);
}

static int setup(void **state)
{
    struct scene *scene = calloc(1, sizeof *scene);

    assert_true(scratch_make(scene->folder, "limits"));
    daemon_prepare(&scene->daemon, scene->folder, "data");
    *state = scene;
    return 0;
}

static int teardown(void **state)
{
    struct scene *scene = *state;

    daemon_release(&scene->daemon);
    scratch_remove(scene->folder);
    free(scene);
    return 0;
}

static void upload(struct scene *scene, unsigned seed, bool large)
{
    struct answer answer;
    size_t size;
    char *text = ledger_mesh_text(seed, large, &size);
    int status =
        daemon_request(&scene->daemon, "POST", "/v1/meshes?format=off", "", text, size, &answer);

    assert_true(status == 200 || status == 201);
    answer_member(&answer, "id", scene->mesh, sizeof scene->mesh);
    answer_clear(&answer);
    free(text);
}

/* Queues a job; more are its inputs after the mesh. */
static void submit(struct scene *scene, const char *process, const char *inputs, char id[64])
{
    struct answer answer;
    char path[128];

    snprintf(path, sizeof path, "/v1/processes/%s/execution", process);
    if (daemon_request(&scene->daemon, "POST", path, JSON_BODY "Prefer: respond-async\r\n", inputs,
                       strlen(inputs), &answer) != 201) {
        fail_msg("%s: %s", inputs, answer.body ? answer.body : "no answer");
    }
    answer_member(&answer, "id", id, 64);
    answer_clear(&answer);
}

static void encode(struct scene *scene, int number, char id[64])
{
    char inputs[200];

    snprintf(inputs, sizeof inputs, "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":4,\"smoothing\":%.9f}}",
             scene->mesh, 1e-9 * number);
    submit(scene, "encode", inputs, id);
}

/* Status and code of a job; the status is "" where there is no such job. */
static void look(const struct scene *scene, const char *id, char status[32], char code[64])
{
    struct answer answer;
    char path[128];

    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    status[0] = code[0] = '\0';
    if (daemon_request(&scene->daemon, "GET", path, "", "", 0, &answer) == 200) {
        answer_member(&answer, "status", status, 32);
        answer_member(&answer, "code", code, 64);
    }
    answer_clear(&answer);
}

static void wait_for_end(const struct scene *scene, const char *id, char status[32], char code[64])
{
    for (int i = 0; i < 3000; i++) {
        look(scene, id, status, code);
        if (strcmp(status, "accepted") != 0 && strcmp(status, "running") != 0) {
            return;
        }
        pause_ms(10);
    }
    fail_msg("%s does not end", id);
}

static bool log_has(const struct scene *scene, const char *what)
{
    FILE *log = fopen(scene->daemon.log, "r");
    char line[4200];
    bool found = false;

    while (log && !found && fgets(line, sizeof line, log)) {
        found = strstr(line, what) != NULL;
    }
    if (log) {
        fclose(log);
    }
    return found;
}

/* ---- Databases that are not taken ------------------------------------------------------------ */

static void database_digest(const struct scene *scene, char digest[65])
{
    static char bytes[4 << 20];
    char path[400];
    FILE *file;

    snprintf(path, sizeof path, "%s/srnfd.db", scene->daemon.data);
    file = fopen(path, "rb");
    assert_non_null(file);
    store_sha256_hex(digest, bytes, fread(bytes, 1, sizeof bytes, file));
    fclose(file);
}

/* The daemon ends by itself, says why, and has written nothing. */
static void is_refused(struct scene *scene, const char *reason)
{
    char before[65], after[65];

    database_digest(scene, before);
    assert_false(daemon_start(&scene->daemon));
    database_digest(scene, after);
    assert_string_equal(before, after);
    if (!log_has(scene, reason)) {
        fail_msg("the log does not say: %s", reason);
    }
}

static void databases_that_are_not_ours_stay_as_they_are(void **state)
{
    struct scene *scene = *state;
    char path[400];
    sqlite3 *db;
    FILE *file;

    assert_true(daemon_start(&scene->daemon));
    upload(scene, 1, false);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    snprintf(path, sizeof path, "%s/srnfd.db", scene->daemon.data);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "PRAGMA user_version = 9999", NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
    is_refused(scene, "written by a newer one");

    file = fopen(path, "r+b");
    assert_non_null(file);
    for (long page = 1; page < 20; page++) {
        fseek(file, page * 4096, SEEK_SET);
        fputs("what a disk may make of a page", file);
    }
    fclose(file);
    is_refused(scene, "not an intact SQLite database");
}

static void a_second_daemon_goes_away(void **state)
{
    struct scene *scene = *state;
    struct daemon second = scene->daemon;

    assert_true(daemon_start(&scene->daemon));
    assert_false(daemon_start(&second));
    assert_true(log_has(scene, "in use by another daemon"));
    upload(scene, 1, true);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

/* ---- Time ------------------------------------------------------------------------------------ */

static void a_job_that_takes_too_long_fails(void **state)
{
    static const char *const options[] = {"--job-seconds", "0.4", NULL};
    struct scene *scene = *state;
    char id[64], inputs[300], status[32], code[64], first[64];

    scene->daemon.options = options;
    assert_true(daemon_start(&scene->daemon));
    upload(scene, 2, true);
    memcpy(first, scene->mesh, sizeof first);
    upload(scene, 3, true);
    snprintf(inputs, sizeof inputs,
             "{\"inputs\":{\"template\":\"%s\",\"moving\":\"%s\",\"degree\":31}}", first,
             scene->mesh);
    submit(scene, "register", inputs, id);
    wait_for_end(scene, id, status, code);
    assert_string_equal(status, "failed");
    assert_string_equal(code, "time-limit");

    /* The limit is by the monotonic clock, and the worker is free for others. */
    atomic_store(&scene->daemon.control->clock_ms, 400 * DAY_MS);
    encode(scene, 1, id);
    wait_for_end(scene, id, status, code);
    assert_string_equal(status, "successful");
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

static void ids_keep_their_order_when_the_clock_goes_back(void **state)
{
    struct scene *scene = *state;
    char ids[8][64], status[32], code[64];

    assert_true(daemon_start(&scene->daemon));
    upload(scene, 4, false);
    for (int i = 0; i < 8; i++) {
        encode(scene, i, ids[i]);
        if (i == 2 || i == 4) {
            atomic_fetch_sub(&scene->daemon.control->clock_ms, 30 * DAY_MS);
        }
        if (i == 5) {
            assert_int_equal(daemon_stop(&scene->daemon), 0);
            assert_true(daemon_start(&scene->daemon));
        }
    }
    for (int i = 0; i < 8; i++) {
        assert_true(i == 0 || strcmp(ids[i - 1], ids[i]) < 0);
        wait_for_end(scene, ids[i], status, code);
        assert_string_equal(status, "successful");
    }
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

static void ended_jobs_go_after_their_days(void **state)
{
    static const char *const options[] = {"--retention-days", "5", "--sweep-seconds", "0.3", NULL};
    struct scene *scene = *state;
    char id[64], status[32], code[64], path[128];

    scene->daemon.options = options;
    assert_true(daemon_start(&scene->daemon));
    upload(scene, 5, true);
    encode(scene, 1, id);
    wait_for_end(scene, id, status, code);
    pause_ms(1000);
    look(scene, id, status, code);
    assert_string_equal(status, "successful");

    /* A jump alone removes nothing at once; a clock that stays there does. */
    atomic_store(&scene->daemon.control->clock_ms, 6 * DAY_MS);
    for (int i = 0; i < 100 && !log_has(scene, "clock-jumped"); i++) {
        pause_ms(10);
    }
    look(scene, id, status, code);
    assert_string_equal(status, "successful");
    for (int i = 0; i < 300 && status[0]; i++) {
        pause_ms(10);
        look(scene, id, status, code);
    }
    assert_string_equal(status, "");
    for (int i = 0; i < 300 && !log_has(scene, "jobs-expired"); i++) {
        pause_ms(10);
    }
    assert_true(log_has(scene, "jobs-expired"));
    snprintf(path, sizeof path, "/v1/meshes/%s/content", scene->mesh);
    assert_int_equal(daemon_status(&scene->daemon, "GET", path, ""), 200);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

static void files_without_a_row_are_swept(void **state)
{
    static const char *const options[] = {"--sweep-seconds", "0.2", NULL};
    struct scene *scene = *state;
    char orphan[600], folder[400], path[128];
    FILE *file;

    scene->daemon.options = options;
    assert_true(daemon_start(&scene->daemon));
    upload(scene, 6, true);
    snprintf(folder, sizeof folder, "%s/blobs/ab", scene->daemon.data);
    (void)mkdir(folder, 0700);
    snprintf(orphan, sizeof orphan, "%s/ab%062d", folder, 7);
    file = fopen(orphan, "w");
    assert_non_null(file);
    fclose(file);
    for (int i = 0; i < 300 && access(orphan, F_OK) == 0; i++) {
        pause_ms(10);
    }
    assert_int_equal(access(orphan, F_OK), -1);
    snprintf(path, sizeof path, "/v1/meshes/%s/content", scene->mesh);
    assert_int_equal(daemon_status(&scene->daemon, "GET", path, ""), 200);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(databases_that_are_not_ours_stay_as_they_are),
        TEST(a_second_daemon_goes_away),
        TEST(a_job_that_takes_too_long_fails),
        TEST(ids_keep_their_order_when_the_clock_goes_back),
        TEST(ended_jobs_go_after_their_days),
        TEST(files_without_a_row_are_swept),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
