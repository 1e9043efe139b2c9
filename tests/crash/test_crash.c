/* srnfd-test: release-only
 * srnfd-test: timeout 600
 *
 * A daemon that is killed again and again under a stream of requests. Three clients upload meshes,
 * queue, read, cancel and delete jobs and write down every answer (ledger.h); the daemon dies by
 * kill -9 at a moment left to chance, or at a point with a name: before, in the middle of or after
 * the n-th of the calls that write to one kind of file, found by the shim (fault_shim.c). After
 * each start every promise is looked at; after CYCLES_PER_DIRECTORY deaths the queue drains, and
 *
 *   nothing is lost        every promise of the ledger holds, results and meshes byte for byte
 *   nothing is doubled     there is no job that no key names, none succeeds twice, none runs again
 *                          after its success was told
 *   the store is intact    integrity_check and foreign_key_check; each blob with a row has its file
 *                          with the right bytes, and each file is named by a row or is waste that
 *                          `srnfd check --repair` removes
 *
 *   CYCLES=12          kills; `make crash` takes 50
 *   SRNFD_CRASH_SEED   to repeat the choices of a run (not the moments)
 * srnfd-test: slow
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

#include "support/ledger.h"
#include "support/scratch.h"

#define CYCLES_PER_DIRECTORY 25
#define CLIENTS 3

/* Where the daemon dies: the kinds of calls on the kinds of files. */
static const struct point {
    const char *name;
    int kinds, files, action, reach; /* at one of the first so many such calls */
} points[] = {
    {"before the log is written", FAULT_WRITE, FAULT_LOG, FAULT_KILL_BEFORE, 200},
    {"within a write to the log", FAULT_WRITE, FAULT_LOG, FAULT_KILL_HALF, 200},
    {"before a commit is synced", FAULT_SYNC, FAULT_LOG, FAULT_KILL_BEFORE, 40},
    {"after a commit is synced", FAULT_SYNC, FAULT_LOG, FAULT_KILL_AFTER, 40},
    {"within a checkpoint", FAULT_WRITE, FAULT_DATABASE, FAULT_KILL_HALF, 30},
    {"after a checkpoint is synced", FAULT_SYNC, FAULT_DATABASE, FAULT_KILL_AFTER, 2},
    {"within a staged file", FAULT_WRITE, FAULT_STAGED, FAULT_KILL_HALF, 4},
    {"after a staged file is synced", FAULT_SYNC, FAULT_STAGED, FAULT_KILL_AFTER, 4},
    {"before a file gets its name", FAULT_RENAME, FAULT_BLOB, FAULT_KILL_BEFORE, 4},
    {"after a file got its name", FAULT_RENAME, FAULT_BLOB, FAULT_KILL_AFTER, 4},
    {"before a folder is synced", FAULT_SYNC, FAULT_BLOB, FAULT_KILL_BEFORE, 4},
    {"at a folder that is made", FAULT_MKDIR, FAULT_BLOB, FAULT_KILL_AFTER, 4},
    {"when the index of the log grows", FAULT_ALL_KINDS, FAULT_INDEX, FAULT_KILL_BEFORE, 3},
    {"at any call", FAULT_ALL_KINDS, FAULT_ALL_FILES, FAULT_KILL_BEFORE, 400},
    {"after any call", FAULT_ALL_KINDS, FAULT_ALL_FILES, FAULT_KILL_AFTER, 400},
};
#define N_POINTS (sizeof points / sizeof points[0])

struct run {
    struct daemon daemon;
    struct ledger *ledger;
    unsigned random;
    int at_points, starts_cut_short;
};

static unsigned roll(struct run *run, unsigned sides)
{
    run->random = run->random * 1664525u + 1013904223u;
    return (run->random >> 8) % sides;
}

static void pause_ms(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    nanosleep(&time, NULL);
}

/* Chooses a point to die at. */
static void arm(struct run *run)
{
    const struct point *point = &points[roll(run, N_POINTS)];
    int number = 1 + (int)roll(run, (unsigned)point->reach);

    daemon_fault(&run->daemon, point->kinds, point->files, number, number, point->action);
}

static void disarm(struct run *run)
{
    daemon_fault(&run->daemon, 0, 0, 0, 0, 0);
}

/* The clients at work until the daemon has died: every other time at a point, otherwise by chance.
   */
static void live_and_die(struct run *run, int cycle)
{
    struct ledger_client clients[CLIENTS];
    long ms = cycle % 2 == 0 ? 20 + (long)roll(run, 400) : 1000;

    atomic_store(&run->ledger->stop, false);
    if (cycle % 2 == 1) {
        arm(run);
    }
    for (unsigned i = 0; i < CLIENTS; i++) {
        clients[i] = (struct ledger_client){run->ledger, i, roll(run, 1u << 24), 0};
        assert_int_equal(pthread_create(&clients[i].thread, NULL, ledger_client_main, &clients[i]),
                         0);
    }
    for (long waited = 0; waited < ms && !daemon_has_ended(&run->daemon); waited += 5) {
        pause_ms(5);
    }
    run->at_points += daemon_has_ended(&run->daemon);
    daemon_kill(&run->daemon);
    disarm(run);
    atomic_store(&run->ledger->stop, true);
    for (unsigned i = 0; i < CLIENTS; i++) {
        pthread_join(clients[i].thread, NULL);
    }
}

/* No further call meets the point; whether one has. Then the daemon dies, be it only when that call
   is through: an fsync may take its time. */
static bool has_met_point(struct run *run)
{
    struct fault_control *control = run->daemon.control;

    atomic_store(&control->kinds, 0);
    return atomic_load(&control->first) > 0 &&
           atomic_load(&control->calls) >= atomic_load(&control->first);
}

/* Starts it; every fourth time at the risk of dying at a point before it listens, or soon after:
   then it starts once more, without one. */
static void start(struct run *run, int cycle)
{
    bool started;

    if (cycle % 4 == 3) {
        arm(run);
    }
    started = daemon_start(&run->daemon);
    run->starts_cut_short += !started;
    if (started && has_met_point(run)) {
        for (long waited = 0; waited < 30000 && !daemon_has_ended(&run->daemon); waited += 5) {
            pause_ms(5);
        }
        assert_true(daemon_has_ended(&run->daemon));
        started = false;
    }
    disarm(run);
    if (!started) {
        assert_true(daemon_start(&run->daemon));
    }
}

/* ---- What is true at the end ----------------------------------------------------------------- */

static struct ledger_job *find_job(struct ledger *ledger, const char *line)
{
    const char *id = strstr(line, "\"job\":\"");

    for (size_t i = 0; id && i < ledger->n_jobs; i++) {
        if (strncmp(id + 7, ledger->jobs[i].id, strlen(ledger->jobs[i].id)) == 0) {
            return &ledger->jobs[i];
        }
    }
    return NULL;
}

/* No job succeeds twice, and none begins after its success was told: by the log, or to a client. */
static void check_log(struct run *run)
{
    struct ledger *ledger = run->ledger;
    bool *successful = calloc(ledger->n_jobs + 1, sizeof *successful);
    FILE *log = fopen(run->daemon.log, "r");
    char line[4200];

    assert_non_null(log);
    for (long at = 0; fgets(line, sizeof line, log); at = ftell(log)) {
        bool ends = strstr(line, "\"event\":\"job-successful\"") != NULL;
        bool begins = strstr(line, "\"event\":\"job-running\"") != NULL;
        struct ledger_job *job = ends || begins ? find_job(ledger, line) : NULL;
        bool told = job && (successful[job - ledger->jobs] ||
                            (begins && job->seen_at > 0 && at > job->seen_at));

        if (told) {
            fprintf(stderr, "after its success: %s", line);
            atomic_fetch_add(&ledger->wrong, 1);
        }
        if (job && ends) {
            successful[job - ledger->jobs] = true;
        }
    }
    fclose(log);
    free(successful);
}

static int64_t number_of(sqlite3 *db, const char *sql)
{
    sqlite3_stmt *row = NULL;
    int64_t number;

    assert_int_equal(sqlite3_prepare_v2(db, sql, -1, &row, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_step(row), SQLITE_ROW);
    number = sqlite3_column_int64(row, 0);
    sqlite3_finalize(row);
    return number;
}

/* As many jobs as keys have named and nobody has deleted. */
static void check_rows(struct run *run)
{
    int64_t known = 0;
    char path[400];
    sqlite3 *db;

    for (size_t i = 0; i < run->ledger->n_jobs; i++) {
        known += run->ledger->jobs[i].promise < DELETING;
    }
    snprintf(path, sizeof path, "%s/srnfd.db", run->daemon.data);
    assert_int_equal(sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL), SQLITE_OK);
    assert_int_equal(number_of(db, "SELECT count(*) FROM job"), known);
    assert_int_equal(number_of(db, "SELECT count(*) FROM job WHERE status IN "
                                   "('accepted', 'running')"),
                     0);
    assert_int_equal(number_of(db, "SELECT count(*) FROM checkpoint"), 0);
    sqlite3_close(db);
}

/* `srnfd check` finds no damage, and after --repair no waste either. */
static void check_store(struct run *run)
{
    const char *repair[] = {"check", "--data", run->daemon.data, "--repair", NULL};
    char text[4096];

    for (int pass = 0; pass < 2; pass++) {
        int status = daemon_command(repair, text, sizeof text);

        if (status != 0 || (pass == 1 && !strstr(text, "orphans: 0"))) {
            fail_msg("srnfd check: status %d: %s", status, text);
        }
    }
}

/* ---- Directories ----------------------------------------------------------------------------- */

static void one_directory(struct run *run, const char *folder, int number, int cycles)
{
    char name[32];

    snprintf(name, sizeof name, "data-%d", number);
    daemon_prepare(&run->daemon, folder, name);
    run->ledger = calloc(1, sizeof *run->ledger);
    run->ledger->daemon = &run->daemon;
    pthread_mutex_init(&run->ledger->mutex, NULL);
    assert_true(daemon_start(&run->daemon));
    assert_true(ledger_begin(run->ledger));
    for (int cycle = 0; cycle < cycles; cycle++) {
        live_and_die(run, cycle);
        start(run, cycle);
        ledger_resend(run->ledger);
        ledger_verify(run->ledger, false);
    }
    ledger_verify(run->ledger, true);
    assert_int_equal(daemon_stop(&run->daemon), 0);
    check_log(run);
    check_rows(run);
    check_store(run);
    print_message("# %d kills: %zu jobs, %zu meshes, %ld promises, %ld broken\n", cycles,
                  run->ledger->n_jobs, run->ledger->n_meshes,
                  atomic_load(&run->ledger->acknowledged), atomic_load(&run->ledger->wrong));
    assert_int_equal(atomic_load(&run->ledger->wrong), 0);
    daemon_release(&run->daemon);
    pthread_mutex_destroy(&run->ledger->mutex);
    free(run->ledger);
}

static void what_was_acknowledged_outlives_every_kill(void **state)
{
    const char *asked = getenv("CYCLES"), *seed = getenv("SRNFD_CRASH_SEED");
    int left = asked ? (int)strtol(asked, NULL, 10) : 12;
    struct run run = {.random = seed ? (unsigned)strtoul(seed, NULL, 10) : (unsigned)getpid()};
    char folder[SCRATCH_MAX];

    (void)state;
    print_message("# seed %u\n", run.random);
    assert_true(scratch_make(folder, "crash"));
    for (int number = 0; left > 0; number++, left -= CYCLES_PER_DIRECTORY) {
        one_directory(&run, folder, number,
                      left < CYCLES_PER_DIRECTORY ? left : CYCLES_PER_DIRECTORY);
    }
    print_message("# %d at points with a name, and %d starts cut short\n", run.at_points,
                  run.starts_cut_short);
    scratch_remove(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_acknowledged_outlives_every_kill),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
