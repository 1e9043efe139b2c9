/* srnfd-test: timeout 300
 * srnfd-test: slow
 *
 * Backups of a daemon at work, the drill of restoring one, and what `srnfd check` finds: every
 * backup taken while three clients upload, compute and delete is a data directory without a flaw,
 * from which a daemon serves all that was acknowledged before the backup began; damage is told and
 * mended by sending the same content again; what nothing needs is removed.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
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

#define CLIENTS 3
#define BACKUPS 2

struct drill {
    char folder[SCRATCH_MAX], text[8192];
    struct daemon daemon, restored;
    struct ledger *ledger;
};

static int setup(void **state)
{
    struct drill *drill = calloc(1, sizeof *drill);

    assert_true(scratch_make(drill->folder, "backup"));
    daemon_prepare(&drill->daemon, drill->folder, "data");
    daemon_prepare(&drill->restored, drill->folder, "restored");
    drill->ledger = calloc(1, sizeof *drill->ledger);
    drill->ledger->daemon = &drill->daemon;
    pthread_mutex_init(&drill->ledger->mutex, NULL);
    *state = drill;
    return 0;
}

static int teardown(void **state)
{
    struct drill *drill = *state;

    daemon_release(&drill->daemon);
    daemon_release(&drill->restored);
    pthread_mutex_destroy(&drill->ledger->mutex);
    free(drill->ledger);
    scratch_remove(drill->folder);
    free(drill);
    return 0;
}

/* Runs srnfd with these arguments; its output is in drill->text. */
static int command(struct drill *drill, const char *const *arguments)
{
    return daemon_command(arguments, drill->text, sizeof drill->text);
}

static void tells(const struct drill *drill, const char *what)
{
    if (!strstr(drill->text, what)) {
        fail_msg("\"%s\" is not in: %s", what, drill->text);
    }
}

/* ---- Under load ------------------------------------------------------------------------------ */

/* What was known before a backup is in what was restored from it, unless it was being deleted. */
static void check_restored(struct drill *drill, size_t n_jobs, size_t n_meshes)
{
    struct ledger *ledger = drill->ledger;
    struct answer answer;
    char path[128];
    size_t size;

    for (size_t i = 0; i < n_jobs; i++) {
        bool kept;

        pthread_mutex_lock(&ledger->mutex);
        kept = ledger->jobs[i].id[0] && ledger->jobs[i].promise < DELETING;
        snprintf(path, sizeof path, "/v1/jobs/%s", ledger->jobs[i].id);
        pthread_mutex_unlock(&ledger->mutex);
        if (kept) {
            assert_int_equal(daemon_status(&drill->restored, "GET", path, ""), 200);
        }
    }
    for (size_t i = 0; i < n_meshes; i++) {
        char *text = ledger_mesh_text(ledger->meshes[i].seed, ledger->meshes[i].large, &size);

        snprintf(path, sizeof path, "/v1/meshes/%s/content", ledger->meshes[i].id);
        assert_int_equal(daemon_request(&drill->restored, "GET", path, "", "", 0, &answer), 200);
        assert_int_equal(answer.size, size);
        assert_memory_equal(answer.body, text, size);
        answer_clear(&answer);
        free(text);
    }
}

static void back_up_and_restore(struct drill *drill, int number)
{
    const char *back_up[] = {"backup",           drill->restored.data,         "--data",
                             drill->daemon.data, number % 2 ? "--link" : NULL, NULL};
    const char *check[] = {"check", "--data", drill->restored.data, NULL};
    size_t n_jobs, n_meshes;

    pthread_mutex_lock(&drill->ledger->mutex);
    n_jobs = drill->ledger->n_jobs > CLIENTS ? drill->ledger->n_jobs - CLIENTS : 0;
    n_meshes = drill->ledger->n_meshes;
    pthread_mutex_unlock(&drill->ledger->mutex);
    if (command(drill, back_up) != 0) {
        fail_msg("backup: %s", drill->text);
    }
    if (command(drill, check) != 0) {
        fail_msg("check: %s", drill->text);
    }
    tells(drill, "orphans: 0");
    assert_int_equal(command(drill, back_up), 2);
    tells(drill, "not empty");
    assert_true(daemon_start(&drill->restored));
    check_restored(drill, n_jobs, n_meshes);
    assert_int_equal(daemon_stop(&drill->restored), 0);
    scratch_remove(drill->restored.data);
}

static void a_backup_of_a_daemon_at_work_can_be_restored(void **state)
{
    struct drill *drill = *state;
    struct timespec time = {.tv_nsec = 300000000};
    struct ledger_client clients[CLIENTS];

    assert_true(daemon_start(&drill->daemon));
    assert_true(ledger_begin(drill->ledger));
    for (unsigned i = 0; i < CLIENTS; i++) {
        clients[i] = (struct ledger_client){drill->ledger, i, 77 * i + 1, 0};
        assert_int_equal(pthread_create(&clients[i].thread, NULL, ledger_client_main, &clients[i]),
                         0);
    }
    for (int i = 0; i < BACKUPS; i++) {
        nanosleep(&time, NULL);
        back_up_and_restore(drill, i);
    }
    atomic_store(&drill->ledger->stop, true);
    for (unsigned i = 0; i < CLIENTS; i++) {
        pthread_join(clients[i].thread, NULL);
    }
    assert_int_equal(atomic_load(&drill->ledger->wrong), 0);
    assert_int_equal(daemon_stop(&drill->daemon), 0);
}

/* ---- Damage ---------------------------------------------------------------------------------- */

/* The file of a large mesh of this seed. */
static void blob_of(const struct drill *drill, unsigned seed, char path[512])
{
    size_t size;
    char *text = ledger_mesh_text(seed, true, &size), hash[65];

    store_sha256_hex(hash, text, size);
    snprintf(path, 512, "%s/blobs/%.2s/%s", drill->daemon.data, hash, hash);
    free(text);
}

static void upload(struct drill *drill, unsigned seed, int wanted)
{
    struct answer answer;
    size_t size;
    char *text = ledger_mesh_text(seed, true, &size);

    assert_int_equal(
        daemon_request(&drill->daemon, "POST", "/v1/meshes?format=off", "", text, size, &answer),
        wanted);
    answer_clear(&answer);
    free(text);
}

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "r+");

    file = file ? file : fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void damage_is_told_and_mended(void **state)
{
    struct drill *drill = *state;
    const char *check[] = {"check", "--data", drill->daemon.data, NULL};
    const char *repair[] = {"check", "--data", drill->daemon.data, "--repair", NULL};
    const char *back_up[] = {"backup", drill->restored.data, "--data", drill->daemon.data, NULL};
    char path[512], left[512];

    assert_true(daemon_start(&drill->daemon));
    upload(drill, 1, 201);
    upload(drill, 2, 201);
    upload(drill, 3, 201);
    assert_int_equal(command(drill, check), 0);
    tells(drill, "damaged: 0\nmissing: 0\norphans: 0");

    blob_of(drill, 1, path);
    write_file(path, "changed");
    blob_of(drill, 2, path);
    assert_int_equal(unlink(path), 0);
    snprintf(left, sizeof left, "%s/blobs/tmp/left", drill->daemon.data);
    write_file(left, "left by a crash long ago");
    assert_int_equal(command(drill, check), 1);
    tells(drill, "damaged: 1\nmissing: 1\n");
    tells(drill, ", mesh mesh-");
    tells(drill, "a daemon is running");
    assert_int_equal(command(drill, repair), 2);
    tells(drill, "in use by a daemon");
    assert_int_equal(command(drill, back_up), 1);
    tells(drill, "2 blobs are damaged");

    upload(drill, 1, 200);
    upload(drill, 2, 200);
    assert_int_equal(command(drill, check), 0);
    assert_int_equal(daemon_stop(&drill->daemon), 0);
    write_file(left, "left by a crash");
    assert_int_equal(command(drill, check), 0);
    tells(drill, "orphans: 1, removed: 0");
    assert_int_equal(command(drill, repair), 0);
    tells(drill, "orphans: 1, removed: 1");
    assert_int_equal(access(left, F_OK), -1);
    assert_int_equal(command(drill, check), 0);
    tells(drill, "orphans: 0");
}

/* Without the file of tokens a restored service would ask for none. */
static void tokens_are_part_of_a_backup(void **state)
{
    struct drill *drill = *state;
    const char *add[] = {"token", "add",    "--name",           "anna", "--role",
                         "user",  "--data", drill->daemon.data, NULL};
    const char *back_up[] = {"backup", drill->restored.data, "--data", drill->daemon.data, NULL};
    const char *list[] = {"token", "list", "--data", drill->restored.data, NULL};
    char path[512];
    struct stat info;

    assert_true(daemon_start(&drill->daemon));
    assert_int_equal(command(drill, add), 0);
    assert_int_equal(command(drill, back_up), 0);
    assert_int_equal(command(drill, list), 0);
    tells(drill, "anna");
    snprintf(path, sizeof path, "%s/tokens", drill->restored.data);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    assert_int_equal(daemon_stop(&drill->daemon), 0);
}

static void what_is_no_data_directory_is_refused(void **state)
{
    struct drill *drill = *state;
    const char *nowhere[] = {"check", "--data", "/nonexistent/srnfd", NULL};
    const char *no_target[] = {"backup", NULL};
    const char *from_nowhere[] = {"backup", drill->restored.data, "--data", drill->folder, NULL};

    assert_int_equal(command(drill, nowhere), 2);
    tells(drill, "is not a data directory");
    assert_int_equal(command(drill, no_target), 2);
    tells(drill, "usage");
    assert_int_equal(command(drill, from_nowhere), 2);
    assert_int_equal(access(drill->restored.data, F_OK), -1);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_backup_of_a_daemon_at_work_can_be_restored),
        TEST(damage_is_told_and_mended),
        TEST(tokens_are_part_of_a_backup),
        TEST(what_is_no_data_directory_is_refused),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
