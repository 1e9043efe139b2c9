/* srnfd-test: release-only
 * srnfd-test: timeout 600
 *
 * A real daemon whose storage fails under it. First each call that changes the data directory fails
 * once, in turn, with ENOSPC and with EIO, found by the shim (fault_shim.c): every answer is then
 * what it would have been, or 503 or 507 with a code that says why, and the same daemon goes on
 * working. Then on a file system that is really full, which needs the right to mount one: nothing
 * new is taken, reading, cancelling and deleting go on, also after a kill and a start on the full
 * disk, and with room again everything goes on without a restart. A limit on the sizes of files is
 * the same.
 *
 *   STRIDE=19   of the calls every nineteenth is made to fail; `make faults` takes each
 * srnfd-test: slow
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "support/ledger.h"
#include "support/scratch.h"
#include "support/small_disk.h"

#define JSON_BODY "Content-Type: application/json\r\n"
#define CANNOT_MOUNT 77

struct scene {
    struct daemon daemon;
    char folder[SCRATCH_MAX], mesh[64], last_mesh[64];
    unsigned number; /* of the act: what makes its content new */
    int refused;     /* answers 503 and 507 */
};

static void pause_ms(long ms)
{
    struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

    nanosleep(&time, NULL);
}

/* One request; true if it has this status. Otherwise it must be a refusal that says why. */
static bool ask(struct scene *scene, const char *method, const char *path, const char *headers,
                const void *body, size_t size, int wanted, char id[64])
{
    struct answer answer;
    char code[64];
    int status = daemon_request(&scene->daemon, method, path, headers, body, size, &answer);

    answer_member(&answer, "code", code, sizeof code);
    if (id) {
        answer_member(&answer, "id", id, 64);
    }
    if (status != wanted && status != (wanted == 201 ? 200 : wanted) &&
        !(status == 507 && strcmp(code, "storage-full") == 0) &&
        !(status == 503 && strcmp(code, "storage-unavailable") == 0)) {
        fail_msg("%s %s: %d %s", method, path, status, answer.body ? answer.body : "");
    }
    answer_clear(&answer);
    scene->refused += status == 503 || status == 507;
    return status == wanted || (wanted == 201 && status == 200);
}

static bool upload(struct scene *scene, unsigned seed, bool large, char id[64])
{
    size_t size;
    char *text = ledger_mesh_text(seed, large, &size);
    bool done = ask(scene, "POST", "/v1/meshes?format=off", "", text, size, 201, id);

    free(text);
    return done;
}

static bool submit(struct scene *scene, unsigned number, char id[64])
{
    char body[200];

    snprintf(body, sizeof body, "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":4,\"smoothing\":%.9f}}",
             scene->mesh, 1e-9 * number);
    return ask(scene, "POST", "/v1/processes/encode/execution",
               JSON_BODY "Prefer: respond-async\r\n", body, strlen(body), 201, id);
}

static bool job_request(struct scene *scene, const char *method, const char *id, const char *what,
                        int wanted)
{
    char path[128];

    snprintf(path, sizeof path, "/v1/jobs/%.63s%s", id, what);
    return ask(scene, method, path, "", "", 0, wanted, NULL);
}

/* Waits for the end of a job, which is a success or a failure of the storage; true for success. */
static bool job_ends(struct scene *scene, const char *id)
{
    char path[128], state[32] = "", code[64];
    struct answer answer;

    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    for (int i = 0; i < 3000; i++) {
        assert_int_equal(daemon_request(&scene->daemon, "GET", path, "", "", 0, &answer), 200);
        answer_member(&answer, "status", state, sizeof state);
        answer_member(&answer, "code", code, sizeof code);
        answer_clear(&answer);
        if (strcmp(state, "accepted") != 0 && strcmp(state, "running") != 0) {
            break;
        }
        pause_ms(2);
    }
    if (strcmp(state, "failed") == 0) {
        assert_true(strcmp(code, "storage-full") == 0 || strcmp(code, "storage-unavailable") == 0);
    }
    assert_true(strcmp(state, "failed") == 0 || strcmp(state, "successful") == 0);
    return strcmp(state, "successful") == 0;
}

/* Something of everything that writes. True if all of it was done. */
static bool act(struct scene *scene)
{
    unsigned number = ++scene->number;
    char id[64], body[200], path[128];
    bool all = upload(scene, 3 * number, true, id);

    all &= upload(scene, 3 * number + 1, false, id);
    snprintf(body, sizeof body, "{\"name\":\"c%u\",\"members\":[{\"id\":\"%s\"}]}", number,
             scene->mesh);
    all &= ask(scene, "POST", "/v1/cohorts", JSON_BODY, body, strlen(body), 201, NULL);
    snprintf(path, sizeof path, "/v1/cohorts/c%u", number);
    if (daemon_status(&scene->daemon, "GET", path, "") == 200) {
        all &= ask(scene, "DELETE", path, "", "", 0, 204, NULL);
    }
    if (submit(scene, 2 * number, id)) {
        all &= job_ends(scene, id);
        all &= job_request(scene, "POST", id, "/cancel", 200);
        all &= job_request(scene, "DELETE", id, "", 200);
    } else {
        all = false;
    }
    snprintf(path, sizeof path, "/v1/meshes/%s/content", scene->mesh);
    assert_int_equal(daemon_status(&scene->daemon, "GET", path, ""), 200);
    assert_int_equal(daemon_status(&scene->daemon, "GET", "/v1/jobs?limit=3", ""), 200);
    return all;
}

static int setup(void **state)
{
    struct scene *scene = calloc(1, sizeof *scene);

    assert_true(scratch_make(scene->folder, "storage"));
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

/* ---- Each call in turn ----------------------------------------------------------------------- */

/* With nothing failing any more, all is soon done again: what gave way, as the reserve does, is
   tried anew. */
static void recovers(struct scene *scene)
{
    bool done = act(scene);

    for (int i = 0; i < 40 && !done; i++) {
        pause_ms(100);
        done = act(scene);
    }
    assert_true(done);
}

/* Fails the calls of an act one after the other until an act has fewer. Returns how many were
   failed. After each refusal the daemon must recover, so that the next act begins anew. */
static int fail_each(struct scene *scene, int error, int stride)
{
    int tried = 0, idle = 0;

    for (int number = 1; idle < 3; number += stride) {
        bool done, hit;

        daemon_fault(&scene->daemon, FAULT_ALL_KINDS, FAULT_ALL_FILES, number, number, error);
        done = act(scene);
        hit = atomic_load(&scene->daemon.control->hits) > 0;
        daemon_fault(&scene->daemon, 0, 0, 0, 0, 0);
        tried += hit;
        idle = done && !hit ? idle + 1 : 0;
        if (!done) {
            recovers(scene);
        }
    }
    return tried;
}

static void every_failing_write_is_an_answer(void **state)
{
    static const int errors[] = {ENOSPC, EIO};
    const char *asked = getenv("STRIDE");
    int stride = asked ? (int)strtol(asked, NULL, 10) : 19;
    struct scene *scene = *state;

    daemon_prepare(&scene->daemon, scene->folder, "data");
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    assert_true(act(scene));
    for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
        int before = scene->refused, calls = fail_each(scene, errors[i], stride);

        print_message("# %s at every %d. call, %d calls: %d refusals\n", strerror(errors[i]),
                      stride, calls, scene->refused - before);
        assert_true(calls > 150 / stride && scene->refused > before);
        recovers(scene);
    }
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

/* ---- A disk that turns read-only ------------------------------------------------------------- */

/* As file systems do after an error of the device: what is there is served, the rest is refused,
   also by the probe, and the daemon still ends as it should. */
static void a_read_only_disk_serves_what_it_has(void **state)
{
    struct scene *scene = *state;
    char id[64], path[128];

    daemon_prepare(&scene->daemon, scene->folder, "data");
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    assert_true(act(scene));
    snprintf(path, sizeof path, "/v1/meshes/%.63s/content", scene->mesh);
    for (int round = 0; round < 2; round++) {
        daemon_fault(&scene->daemon, FAULT_ALL_KINDS, FAULT_ALL_FILES, 1, INT32_MAX, EROFS);
        assert_false(upload(scene, 400000 + (unsigned)round, true, id));
        assert_false(upload(scene, 500000 + (unsigned)round, false, id));
        assert_false(submit(scene, 600000 + (unsigned)round, id));
        assert_int_equal(daemon_status(&scene->daemon, "GET", path, ""), 200);
        assert_int_equal(daemon_status(&scene->daemon, "GET", "/v1/jobs?limit=3", ""), 200);
        assert_int_equal(daemon_status(&scene->daemon, "GET", "/readyz", ""), 503);
        if (round == 0) {
            daemon_fault(&scene->daemon, 0, 0, 0, 0, 0);
            recovers(scene);
        }
    }
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

/* ---- A disk that is full --------------------------------------------------------------------- */

/* Fills what is left of the file system, to the last page. */
static void fill(const char *path)
{
    static char block[65536];
    int fd = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    size_t size = sizeof block;

    assert_true(fd >= 0);
    while (size >= 512) {
        if (write(fd, block, size) != (ssize_t)size) {
            size /= 2;
        }
    }
    close(fd);
}

/* What must go on, and what must not, while there is no room. */
static void live_on_a_full_disk(struct scene *scene, char ended[][64], size_t from, size_t to)
{
    char path[128], id[64];

    assert_false(upload(scene, 100000 + (unsigned)to, true, id));
    /* Small things may still fit into what the log has of old. */
    (void)upload(scene, 200000 + (unsigned)to, false, id);
    (void)submit(scene, 300000 + (unsigned)to, id);
    for (size_t i = from; i < to; i++) {
        assert_true(job_request(scene, "GET", ended[i], "/results", 200));
        if (!job_request(scene, "DELETE", ended[i], "", 200)) {
            fail_msg("deletion %zu on a full disk", i);
        }
        assert_int_equal(daemon_status(&scene->daemon, "GET", "/v1/jobs?limit=3", ""), 200);
    }
    snprintf(path, sizeof path, "/v1/meshes/%s/content", scene->mesh);
    assert_int_equal(daemon_status(&scene->daemon, "GET", path, ""), 200);
}

static void queue_jobs(struct scene *scene, char ids[][64], size_t n, unsigned number, bool to_end)
{
    for (size_t i = 0; i < n; i++) {
        assert_true(submit(scene, number + (unsigned)i, ids[i]));
    }
    for (size_t i = 0; i < n && to_end; i++) {
        assert_true(job_ends(scene, ids[i]));
    }
}

static void wait_for_room(struct scene *scene, unsigned seed)
{
    char id[64];
    bool done = false;

    for (int i = 0; i < 100 && !done; i++) {
        pause_ms(50);
        done = upload(scene, seed, true, id);
    }
    assert_true(done);
}

static void a_full_disk_takes_nothing_and_gives_everything(void **state)
{
    static const char *const options[] = {"--workers", "1", NULL};
    struct scene *scene = *state;
    char ballast[400], disk[300], ended[60][64], id[64];

    snprintf(disk, sizeof disk, "%s/disk", scene->folder);
    snprintf(ballast, sizeof ballast, "%s/ballast", disk);
    if (mkdir(disk, 0700) != 0 || !small_disk_mount(disk, "size=256m")) {
        print_message("# no right to mount a small file system\n");
        skip();
    }
    daemon_prepare(&scene->daemon, scene->folder, "disk/data");
    scene->daemon.options = options;
    snprintf(scene->daemon.log, sizeof scene->daemon.log, "%s/log", scene->folder);
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    queue_jobs(scene, ended, 60, 1000, true);

    fill(ballast);
    live_on_a_full_disk(scene, ended, 0, 25);
    fill(ballast);
    daemon_kill(&scene->daemon);
    assert_true(daemon_start(&scene->daemon));
    live_on_a_full_disk(scene, ended, 25, 50);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    fill(ballast);
    assert_true(daemon_start(&scene->daemon));
    live_on_a_full_disk(scene, ended, 50, 60);

    assert_int_equal(unlink(ballast), 0);
    wait_for_room(scene, 400000);
    assert_true(submit(scene, 5000, id));
    assert_true(job_ends(scene, id));
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    assert_int_equal(umount2(disk, MNT_DETACH), 0);
}

/* So where the service itself has filled a disk whose reserve is smaller than its log may be, with
   meshes that lie in the database, and no pause between them. */
static void a_small_disk_that_was_filled_gives_everything(void **state)
{
    static const char *const options[] = {"--workers", "1", NULL};
    struct scene *scene = *state;
    char disk[300], ended[20][64], id[64];
    int refused = 0;

    snprintf(disk, sizeof disk, "%s/disk", scene->folder);
    if (mkdir(disk, 0700) != 0 || !small_disk_mount(disk, "size=13m")) {
        print_message("# no right to mount a small file system\n");
        skip();
    }
    daemon_prepare(&scene->daemon, scene->folder, "disk/data");
    scene->daemon.options = options;
    snprintf(scene->daemon.log, sizeof scene->daemon.log, "%s/log", scene->folder);
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    queue_jobs(scene, ended, 20, 1000, true);
    for (unsigned seed = 1; refused < 3; seed++) {
        refused += !upload(scene, seed, false, id);
    }
    live_on_a_full_disk(scene, ended, 0, 20);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    assert_int_equal(umount2(disk, MNT_DETACH), 0);
}

/* A limit on the sizes of files ends nothing either: what does not fit is refused. */
static void a_limit_on_sizes_is_a_full_disk(void **state)
{
    struct scene *scene = *state;
    struct rlimit before, limit;
    char id[64];

    daemon_prepare(&scene->daemon, scene->folder, "data");
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    assert_int_equal(prlimit(scene->daemon.pid, RLIMIT_FSIZE, NULL, &before), 0);
    limit = before;
    limit.rlim_cur = 4096;
    assert_int_equal(prlimit(scene->daemon.pid, RLIMIT_FSIZE, &limit, NULL), 0);
    assert_false(upload(scene, 1, true, id));
    assert_false(daemon_has_ended(&scene->daemon));
    assert_int_equal(daemon_status(&scene->daemon, "GET", "/v1/meshes", ""), 200);
    assert_int_equal(prlimit(scene->daemon.pid, RLIMIT_FSIZE, &before, NULL), 0);
    wait_for_room(scene, 2);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
}

/* A job that waits is cancelled while there is no room, and the rest of the queue runs to its end
   when there is. */
static void a_queue_outlives_a_full_disk(void **state)
{
    static const char *const options[] = {"--workers", "1", NULL};
    struct scene *scene = *state;
    char ballast[400], disk[300], queued[40][64];
    int successful = 0;

    snprintf(disk, sizeof disk, "%s/disk", scene->folder);
    snprintf(ballast, sizeof ballast, "%s/ballast", disk);
    if (mkdir(disk, 0700) != 0 || !small_disk_mount(disk, "size=256m")) {
        skip();
    }
    daemon_prepare(&scene->daemon, scene->folder, "disk/data");
    scene->daemon.options = options;
    snprintf(scene->daemon.log, sizeof scene->daemon.log, "%s/log", scene->folder);
    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene, 0, false, scene->mesh));
    queue_jobs(scene, queued, 40, 1000, false);
    fill(ballast);
    assert_true(job_request(scene, "POST", queued[39], "/cancel", 200));
    assert_true(job_request(scene, "GET", queued[38], "", 200));
    pause_ms(300);
    assert_int_equal(unlink(ballast), 0);
    wait_for_room(scene, 1);
    for (size_t i = 0; i < 39; i++) {
        successful += job_ends(scene, queued[i]);
    }
    print_message("# of 39 jobs %d successful, the others failed for want of room\n", successful);
    assert_true(successful > 10);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    assert_int_equal(umount2(disk, MNT_DETACH), 0);
}

/* Prepared meshes, a cache, are there for whatever finds no room: here 10 MB for an upload, and
   then for an export, which has to be written anew. */
static void a_full_disk_takes_from_the_cache_first(void **state)
{
    static const char *const options[] = {"--workers", "1", "--least-free", "0", NULL};
    struct scene *scene = *state;
    char ballast[400], disk[300], id[64], body[4000] = "{\"name\":\"all\",\"members\":[";

    snprintf(disk, sizeof disk, "%s/disk", scene->folder);
    snprintf(ballast, sizeof ballast, "%s/ballast", disk);
    if (mkdir(disk, 0700) != 0 || !small_disk_mount(disk, "size=64m")) {
        skip();
    }
    daemon_prepare(&scene->daemon, scene->folder, "disk/data");
    scene->daemon.options = options;
    snprintf(scene->daemon.log, sizeof scene->daemon.log, "%s/log", scene->folder);
    assert_true(daemon_start(&scene->daemon));
    for (unsigned seed = 0; seed < 30; seed++) {
        assert_true(upload(scene, seed, true, id));
        if (seed < 15) {
            snprintf(body + strlen(body), sizeof body - strlen(body), "%s{\"id\":\"%s\"}",
                     seed ? "," : "", id);
        }
    }
    snprintf(body + strlen(body), sizeof body - strlen(body), "]}");
    assert_true(ask(scene, "POST", "/v1/cohorts", JSON_BODY, body, strlen(body), 201, NULL));
    fill(ballast);
    assert_true(upload(scene, 31, true, id));
    fill(ballast);
    assert_int_equal(daemon_status(&scene->daemon, "GET", "/v1/cohorts/all/export", ""), 200);
    assert_int_equal(daemon_stop(&scene->daemon), 0);
    assert_int_equal(umount2(disk, MNT_DETACH), 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(every_failing_write_is_an_answer),
        TEST(a_read_only_disk_serves_what_it_has),
        TEST(a_full_disk_takes_nothing_and_gives_everything),
        TEST(a_small_disk_that_was_filled_gives_everything),
        TEST(a_limit_on_sizes_is_a_full_disk),
        TEST(a_queue_outlives_a_full_disk),
        TEST(a_full_disk_takes_from_the_cache_first),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
