/* srnfd-test: timeout 300
 *
 * A real daemon in which the n-th allocation fails, for one n after the other, while it answers a
 * round of requests and runs a job (malloc_shim.c). It never ends, every answer is what it would
 * have been or 503, or the connection is closed where not even that could be said; with memory
 * again the same round is answered in full; and it drains with status 0, under a sanitizer without
 * a leak.
 *
 *   STRIDE=101   of the allocations each so many-th (701 under a sanitizer); `make faults`
 *                takes each
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "support/ledger.h"
#include "support/scratch.h"

#define JSON_BODY "Content-Type: application/json\r\n"

struct scene {
    char folder[SCRATCH_MAX];
    struct daemon daemon;
    unsigned number;
    int refused, unanswered, failed_jobs;
    bool short_of_memory; /* the fault is armed */
};

static int setup(void **state)
{
    struct scene *scene = calloc(1, sizeof *scene);

    assert_true(scratch_make(scene->folder, "memory"));
    daemon_prepare(&scene->daemon, scene->folder, "data");
    scene->daemon.shim = "malloc_shim.so";
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

/* One request; true if it was done. While memory is short it may be refused. */
static bool ask(struct scene *scene, const char *method, const char *path, const char *headers,
                const void *body, size_t size, int wanted, char *id)
{
    struct answer answer;
    int status = daemon_request(&scene->daemon, method, path, headers, body, size, &answer);
    bool done = status == wanted || (wanted == 201 && status == 200);

    if (!done && !(scene->short_of_memory && (status == 0 || status == 503))) {
        fail_msg("allocation %d: %s %s: %d %s",
                 (int)atomic_load(&scene->daemon.control->no_memory_first), method, path, status,
                 answer.body ? answer.body : "");
    }
    if (id) {
        answer_member(&answer, "id", id, 64);
    }
    scene->refused += status == 503;
    scene->unanswered += status == 0;
    answer_clear(&answer);
    return done;
}

/* Waits for a job; a failure must be for want of memory. */
static void wait_for_job(struct scene *scene, const char *id)
{
    struct timespec time = {.tv_nsec = 2000000};
    char path[128], state[32], code[64];
    struct answer answer;

    snprintf(path, sizeof path, "/v1/jobs/%.63s", id);
    for (int i = 0; i < 5000; i++) {
        (void)daemon_request(&scene->daemon, "GET", path, "", "", 0, &answer);
        answer_member(&answer, "status", state, sizeof state);
        answer_member(&answer, "code", code, sizeof code);
        answer_clear(&answer);
        if (strcmp(state, "successful") == 0) {
            return;
        }
        if (strcmp(state, "failed") == 0) {
            if (!scene->short_of_memory || strcmp(code, "out-of-memory") != 0) {
                fail_msg("allocation %d: a job failed: %s",
                         (int)atomic_load(&scene->daemon.control->no_memory_first), code);
            }
            scene->failed_jobs++;
            return;
        }
        nanosleep(&time, NULL);
    }
    fail_msg("the job does not end");
}

static void act(struct scene *scene)
{
    unsigned number = ++scene->number;
    char mesh[64], id[64], body[256], path[160];
    size_t size;
    char *text = ledger_mesh_text(number, false, &size);
    bool done = ask(scene, "POST", "/v1/meshes?format=off", "", text, size, 201, mesh);

    free(text);
    if (!done) {
        return;
    }
    snprintf(path, sizeof path, "/v1/meshes/%s/content", mesh);
    (void)ask(scene, "GET", path, "", "", 0, 200, NULL);
    snprintf(body, sizeof body, "{\"name\":\"c%u\",\"members\":[{\"id\":\"%s\"}]}", number, mesh);
    (void)ask(scene, "POST", "/v1/cohorts", JSON_BODY, body, strlen(body), 201, NULL);
    (void)ask(scene, "GET", "/v1/cohorts?limit=2", "", "", 0, 200, NULL);
    (void)ask(scene, "GET", "/readyz", "", "", 0, 200, NULL);
    snprintf(body, sizeof body, "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":4}}", mesh);
    snprintf(path, sizeof path, JSON_BODY "Prefer: respond-async\r\nIdempotency-Key: k%u\r\n",
             number);
    if (ask(scene, "POST", "/v1/processes/encode/execution", path, body, strlen(body), 201, id)) {
        wait_for_job(scene, id);
        (void)ask(scene, "GET", "/v1/jobs?limit=3", "", "", 0, 200, NULL);
        snprintf(path, sizeof path, "/v1/jobs/%s", id);
        (void)ask(scene, "DELETE", path, "", "", 0, 204, NULL);
    }
}

static void arm(struct scene *scene, int number)
{
    struct fault_control *control = scene->daemon.control;

    scene->short_of_memory = number > 0;
    atomic_store(&control->no_memory_last, 0);
    atomic_store(&control->allocations, 0);
    atomic_store(&control->hits, 0);
    atomic_store(&control->no_memory_first, number);
    atomic_store(&control->no_memory_last, number);
}

static void each_allocation_may_fail(void **state)
{
    const char *asked = getenv("STRIDE"), *sanitized = getenv("SRNFD_SANITIZED");
    int stride = asked                       ? (int)strtol(asked, NULL, 10)
                 : sanitized && sanitized[0] ? 701
                                             : 101,
        number = 1, tried = 0;
    struct scene *scene = *state;

    assert_true(daemon_start(&scene->daemon));
    act(scene);
    for (int idle = 0; idle < 2; number += stride) {
        arm(scene, number);
        act(scene);
        idle = atomic_load(&scene->daemon.control->hits) == 0 ? idle + 1 : 0;
        tried += idle == 0;
        arm(scene, 0);
        if (number / stride % 10 == 0) {
            act(scene);
        }
        if (daemon_has_ended(&scene->daemon)) {
            fail_msg("the daemon ended when allocation %d failed", number);
        }
    }
    act(scene);
    print_message("# %d of some %d allocations failed: %d answers 503, %d none, %d jobs failed\n",
                  tried, number, scene->refused, scene->unanswered, scene->failed_jobs);
    assert_true(tried > 10 && scene->refused + scene->unanswered + scene->failed_jobs > 0);
    if (daemon_stop(&scene->daemon) != 0) {
        fail_msg("the daemon did not drain; its log is %s", scene->daemon.log);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_allocation_may_fail, setup, teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
