/* srnfd-test: timeout 300
 * srnfd-test: slow
 *
 * A real daemon in which the n-th allocation fails, for one n after the other, while it answers
 * one request after the other and runs a job (malloc_shim.c). It never ends, every answer is what
 * it would have been or 503, or the connection is closed where not even that could be said; with
 * memory again the same request is answered in full; and it drains with status 0, under a sanitizer
 * without a leak.
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
    unsigned number;             /* makes contents new */
    char mesh[64], computed[64]; /* the last one; the one that jobs encode */
    char surface[64];            /* the last one */
    char job[64];                /* one that has ended and is there, or "" */
    int refused, unanswered, failed_jobs;
    bool short_of_memory; /* the fault is armed */
    uint64_t *whole;      /* the shape of the answer to the request that is made; NULL: of none */
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

static uint64_t fold(uint64_t hash, const char *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        hash = (hash ^ (unsigned char)bytes[i]) * 1099511628211u; /* FNV-1a */
    }
    return hash;
}

/* What two whole answers to one request have in common: the names of the header fields and of the
   members of all objects, in their order, and all of a file. */
static uint64_t shape_of(const struct answer *answer)
{
    static const char *const files[] = {"OFF", "ply", "\x93NUMPY"};
    uint64_t hash = 14695981039346656037u;

    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        if (strncmp(answer->body, files[i], strlen(files[i])) == 0) {
            hash = fold(hash, answer->body, answer->size);
        }
    }
    for (const char *line = strstr(answer->headers, "\r\n"); line; line = strstr(line, "\r\n")) {
        line += 2;
        hash = fold(hash, line, strcspn(line, ":"));
    }
    for (const char *key = answer->body; (key = strstr(key, "\":")) != NULL; key += 2) {
        const char *start = key;

        while (start > answer->body && start[-1] != '"') {
            start--;
        }
        hash = fold(hash, start, (size_t)(key - start));
    }
    return hash;
}

/* An answer that was given although memory was short must be as whole as one that was not. */
static void look_at_shape(struct scene *scene, const char *path, const struct answer *answer)
{
    uint64_t shape;

    if (!scene->whole) {
        return;
    }
    shape = shape_of(answer);
    if (scene->short_of_memory && *scene->whole != shape) {
        fail_msg("allocation %d: %s: not the whole answer: %s\n%s",
                 (int)atomic_load(&scene->daemon.control->no_memory_first), path, answer->headers,
                 answer->body);
    }
    *scene->whole = shape;
}

/* Whether a 503 is for want of memory; /readyz tells which of its checks found that. */
static bool says_why(const char *path, const char *code)
{
    return strcmp(code, strcmp(path, "/readyz") == 0 ? "not-ready" : "out-of-memory") == 0 ||
           strcmp(code, "out-of-memory") == 0;
}

/* One request; true if it was done. While memory is short it may be refused for want of it. */
static bool ask(struct scene *scene, const char *method, const char *path, const char *headers,
                const void *body, size_t size, int wanted, char *id)
{
    struct answer answer;
    char code[64], instance[64];
    int status = daemon_request(&scene->daemon, method, path, headers, body, size, &answer);
    bool done = status == wanted || (wanted == 201 && status == 200), excused, of_job;

    answer_member(&answer, "code", code, sizeof code);
    answer_member(&answer, "instance", instance, sizeof instance);
    excused = scene->short_of_memory && (status == 0 || (status == 503 && says_why(path, code)));
    if (!done && !excused) {
        fail_msg("allocation %d: %s %s: %d %s",
                 (int)atomic_load(&scene->daemon.control->no_memory_first), method, path, status,
                 answer.body ? answer.body : "");
    }
    if (id) {
        answer_member(&answer, "id", id, 64);
    }
    if (done) {
        look_at_shape(scene, path, &answer);
    }
    /* The problem of a job is not one of the request that waited for it. */
    of_job = strncmp(instance, "/v1/jobs/", 9) == 0 && strcmp(instance, path) != 0;
    scene->failed_jobs += status == 503 && of_job;
    scene->refused += status == 503 && !of_job;
    scene->unanswered += status == 0;
    answer_clear(&answer);
    return done;
}

static bool ask_for(struct scene *scene, const char *path)
{
    return ask(scene, "GET", path, "", "", 0, 200, NULL);
}

/* GET of what is below a resource. */
static bool ask_of(struct scene *scene, const char *kind, const char *id, const char *what)
{
    char path[160];

    snprintf(path, sizeof path, "%s/%s%s", kind, id, what);
    return ask_for(scene, path);
}

/* ---- The requests ---------------------------------------------------------------------------- */

static bool upload(struct scene *scene)
{
    char id[64];
    size_t size;
    char *text = ledger_mesh_text(++scene->number, false, &size);
    bool done = ask(scene, "POST", "/v1/meshes?format=off", "", text, size, 201, id);

    if (done) {
        memcpy(scene->mesh, id, sizeof scene->mesh);
    }
    free(text);
    return done;
}

static bool read_content(struct scene *scene)
{
    return ask_of(scene, "/v1/meshes", scene->mesh, "/content");
}

static bool make_cohort(struct scene *scene)
{
    char body[256];

    snprintf(body, sizeof body, "{\"name\":\"c%u\",\"members\":[{\"id\":\"%s\"}]}", ++scene->number,
             scene->mesh);
    return ask(scene, "POST", "/v1/cohorts", JSON_BODY, body, strlen(body), 201, NULL);
}

static bool list_cohorts(struct scene *scene)
{
    return ask_for(scene, "/v1/cohorts?limit=2");
}

static bool remove_cohort(struct scene *scene)
{
    return ask(scene, "DELETE", "/v1/cohorts/gone", "", "", 0, 204, NULL);
}

/* An ellipsoid by its coefficients of degree 4. */
static bool make_surface(struct scene *scene)
{
    char body[512], id[64];
    int n = snprintf(body, sizeof body, "{\"coefficients\":{\"lmax\":4");
    bool done;

    for (int k = 0; k < 3; k++) {
        n += snprintf(body + n, sizeof body - (size_t)n, ",\"%c\":[0", "xyz"[k]);
        for (int i = 1; i < 25; i++) {
            /* The harmonics of degree 1 are y, z, x. */
            double value = i == 1 + (k + 2) % 3 ? 1.0 + 1e-6 * ++scene->number : 0.0;

            n += snprintf(body + n, sizeof body - (size_t)n, ",%.9g", value);
        }
        n += snprintf(body + n, sizeof body - (size_t)n, "]");
    }
    (void)snprintf(body + n, sizeof body - (size_t)n, "}}");
    done = ask(scene, "POST", "/v1/surfaces", JSON_BODY, body, strlen(body), 201, id);
    if (done) {
        memcpy(scene->surface, id, sizeof scene->surface);
    }
    return done;
}

static bool read_coefficients(struct scene *scene)
{
    return ask_of(scene, "/v1/surfaces", scene->surface, "/coefficients?format=npy");
}

static bool draw_surface(struct scene *scene)
{
    return ask_of(scene, "/v1/surfaces", scene->surface, "/mesh?format=ply&resolution=8");
}

static bool ask_readiness(struct scene *scene)
{
    return ask_for(scene, "/readyz");
}

/* Executions that wait for their job have one order of allocations, to which polling would add. */
static bool execute(struct scene *scene, unsigned number, bool waits)
{
    char body[256], headers[160];

    snprintf(body, sizeof body, "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":4,\"smoothing\":%.9f}}",
             scene->computed, 1e-9 * number);
    snprintf(headers, sizeof headers, JSON_BODY "%sIdempotency-Key: k%u\r\n",
             waits ? "" : "Prefer: respond-async\r\n", ++scene->number);
    return ask(scene, "POST", "/v1/processes/encode/execution", headers, body, strlen(body),
               waits ? 200 : 201, waits ? NULL : scene->job);
}

static bool run_new_job(struct scene *scene)
{
    return execute(scene, ++scene->number, true);
}

static bool submit_what_is_known(struct scene *scene)
{
    char kept[64];
    bool done;

    memcpy(kept, scene->job, sizeof kept);
    done = execute(scene, 0, false);
    if (!done) {
        memcpy(scene->job, kept, sizeof kept);
    }
    return done;
}

static bool list_jobs(struct scene *scene)
{
    return ask_for(scene, "/v1/jobs?limit=3");
}

static bool read_results(struct scene *scene)
{
    return ask_of(scene, "/v1/jobs", scene->job, "/results");
}

static bool follow_events(struct scene *scene)
{
    return ask_of(scene, "/v1/jobs", scene->job, "/events");
}

static bool read_metrics(struct scene *scene)
{
    return ask_for(scene, "/metrics");
}

static bool remove_job(struct scene *scene)
{
    char path[128], id[64];
    bool done;

    memcpy(id, scene->job, sizeof id);
    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    done = ask(scene, "DELETE", path, "", "", 0, 200, NULL);
    /* Removed without an answer is removed, too: the next round makes another. */
    scene->job[0] = '\0';
    return done;
}

/* What the next request asks for: a job of known inputs that has ended, and a cohort to remove. */
static void provide(struct scene *scene)
{
    char body[256];
    int status;

    if (!scene->job[0]) {
        assert_true(execute(scene, 0, true));
        assert_true(submit_what_is_known(scene));
    }
    snprintf(body, sizeof body, "{\"name\":\"gone\",\"members\":[{\"id\":\"%s\"}]}",
             scene->computed);
    status = daemon_status(&scene->daemon, "POST", "/v1/cohorts", body);
    assert_true(status == 200 || status == 201);
}

static struct step {
    const char *name;
    bool (*act)(struct scene *scene);
    uint64_t whole; /* the shape of its answer */
} steps[] = {
    {"an upload", upload, 0},
    {"its content", read_content, 0},
    {"a cohort", make_cohort, 0},
    {"the list of cohorts", list_cohorts, 0},
    {"a cohort's removal", remove_cohort, 0},
    {"/readyz", ask_readiness, 0},
    {"/metrics", read_metrics, 0},
    {"a surface", make_surface, 0},
    {"its coefficients", read_coefficients, 0},
    {"its mesh", draw_surface, 0},
    {"a job", run_new_job, 0},
    {"a job from the cache", submit_what_is_known, 0},
    {"the list of jobs", list_jobs, 0},
    {"results", read_results, 0},
    {"events", follow_events, 0},
    {"a deletion", remove_job, 0},
};
#define N_STEPS (sizeof steps / sizeof steps[0])

/* ---- Each allocation ------------------------------------------------------------------------- */

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

static bool act(struct scene *scene, struct step *step)
{
    bool done;

    scene->whole = &step->whole;
    done = step->act(scene);
    scene->whole = NULL;
    return done;
}

/* With memory again all is answered in full. */
static void round_of_all(struct scene *scene)
{
    for (size_t i = 0; i < N_STEPS; i++) {
        provide(scene);
        assert_true(act(scene, &steps[i]));
    }
}

/* With memory again the request is done: at once, but that /readyz remembers for a moment that a
   write did not get through. */
static void recovers(struct scene *scene, struct step *step)
{
    struct timespec time = {.tv_nsec = 50000000};

    provide(scene);
    for (int i = 0; step->act == ask_readiness && i < 60 &&
                    daemon_status(&scene->daemon, "GET", "/readyz", "") != 200;
         i++) {
        nanosleep(&time, NULL);
    }
    assert_true(act(scene, step));
}

/* Fails every stride-th allocation of one request, and of what the daemon does meanwhile, until
   there are no more. Each that was not done is done when it is asked again. Returns how many were
   failed. */
static int fail_each(struct scene *scene, struct step *step, int stride)
{
    int tried = 0, idle = 0;

    for (int number = 1; idle < 2; number += stride) {
        bool done;

        provide(scene);
        arm(scene, number);
        done = act(scene, step);
        idle = atomic_load(&scene->daemon.control->hits) == 0 ? idle + 1 : 0;
        tried += idle == 0;
        arm(scene, 0);
        if (daemon_has_ended(&scene->daemon)) {
            fail_msg("the daemon ended when allocation %d of %s failed", number, step->name);
        }
        if (!done) {
            recovers(scene, step);
        }
    }
    return tried;
}

static void each_allocation_may_fail(void **state)
{
    const char *asked = getenv("STRIDE"), *sanitized = getenv("SRNFD_SANITIZED");
    int stride = asked ? (int)strtol(asked, NULL, 10) : sanitized && sanitized[0] ? 701 : 101;
    struct scene *scene = *state;
    int tried = 0;

    assert_true(daemon_start(&scene->daemon));
    assert_true(upload(scene));
    memcpy(scene->computed, scene->mesh, sizeof scene->computed);
    for (int i = 0; i < 4; i++) {
        round_of_all(scene); /* until the lists are as long as they get */
    }
    for (size_t i = 0; i < N_STEPS; i++) {
        int refused = scene->refused, unanswered = scene->unanswered, failed = scene->failed_jobs;
        int of_step = fail_each(scene, &steps[i], stride);

        round_of_all(scene);
        print_message("# %s: %d allocations failed: %d answers 503, %d none, %d jobs failed\n",
                      steps[i].name, of_step, scene->refused - refused,
                      scene->unanswered - unanswered, scene->failed_jobs - failed);
        tried += of_step;
    }
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
