/*
 * process_fixture.h - a store with one good mesh, one with a hole, one surface, a model and a
 * cohort, and a call that canonicalizes inputs against it. For the tests of the processes; no job
 * engine runs.
 */
#ifndef TEST_PROCESS_FIXTURE_H
#define TEST_PROCESS_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "processes/processes.h"
#include "store/store.h"
#include "toolkit/process.h"
#include "support/scratch.h"
#include "store/cohort.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"
#include "store/volume.h"

#define GOOD_MESH "mesh-00000000000000000000000000000001"
#define OPEN_MESH "mesh-00000000000000000000000000000002"
#define STARLESS_MESH "mesh-00000000000000000000000000000003" /* with a report of old */
#define VOLUME "vol-00000000000000000000000000000001"
#define ABSENT_MESH "mesh-000000000000000000000000000000ff"
#define ABSENT_SURFACE "surf-000000000000000000000000000000ff"
#define DONE_JOB "job-00000000-0000-7000-8000-000000000001" /* successful, named */
#define WAITING_JOB "job-00000000-0000-7000-8000-000000000002"
#define ABSENT_JOB "job-00000000-0000-7000-8000-0000000000ff"
#define SURFACE_DEGREE 9

struct fixture {
    char directory[SCRATCH_MAX];
    struct store *store;
    char surface[STORE_ID_MAX], model[STORE_ID_MAX], classifier[STORE_ID_MAX];
    struct api api;
};

static void put_mesh(struct fixture *fixture, const char *id, const char *report)
{
    struct store_mesh mesh = {.bytes = 3, .created_ms = 1};
    bool created;

    memcpy(mesh.id, id, strlen(id) + 1);
    mesh.name = strdup("a mesh");
    mesh.format = strdup("ply");
    mesh.report = strdup(report);
    assert_int_equal(store_mesh_put(fixture->store, &mesh, "ply", &created), 0);
    store_mesh_clear(&mesh);
}

/* Of label 1 alone. */
static void put_volume(struct fixture *fixture)
{
    struct store_volume volume = {.id = VOLUME, .bytes = 4, .created_ms = 1};
    bool created;

    volume.name = strdup("a volume");
    volume.record = strdup("{\"shape\":[2,2,2],\"labels\":[{\"value\":1,\"voxels\":4}]}");
    assert_int_equal(store_volume_put(fixture->store, &volume, "nrrd", &created), 0);
    store_volume_clear(&volume);
}

static void put_surface(struct fixture *fixture)
{
    struct store_surface surface = {.lmax = SURFACE_DEGREE, .created_ms = 1};
    bool created;

    surface.coefficient_count = 3 * srnf_coefficient_count(SURFACE_DEGREE);
    surface.coefficients = calloc(surface.coefficient_count, sizeof(double));
    assert_non_null(surface.coefficients);
    surface.coefficients[3] = 1.0;
    store_surface_id(surface.id, surface.lmax, surface.coefficients, 1.0);
    surface.name = strdup("");
    surface.record = strdup("{}");
    memcpy(fixture->surface, surface.id, sizeof surface.id);
    assert_int_equal(store_surface_put(fixture->store, &surface, &created), 0);
    store_surface_clear(&surface);
}

/* A model of MODEL_COMPONENTS components about the surface, and a cohort "group" of the surface and
   the good mesh. */
#define MODEL_COMPONENTS 3
static void put_model(struct fixture *fixture, const char *record, long components,
                      char id[STORE_ID_MAX])
{
    struct store_model model = {.lmax = SURFACE_DEGREE,
                                .n_theta = 15,
                                .n_phi = 30,
                                .subjects = components + 1,
                                .components = components};
    bool created;

    memcpy(model.mean, fixture->surface, sizeof model.mean);
    model.record = strdup(record);
    for (size_t a = 0; a < STORE_MODEL_ARRAYS; a++) {
        model.arrays[a] =
            calloc(store_model_count(&model, (enum store_model_array)a), sizeof(double));
        assert_non_null(model.arrays[a]);
    }
    assert_int_equal(store_model_put(fixture->store, &model, &created), 0);
    memcpy(id, model.id, sizeof model.id);
    store_model_clear(&model);
}

static void put_cohort(struct fixture *fixture)
{
    struct store_cohort cohort = {.name = "group", .n_members = 2};
    char record[512];
    bool created;
    size_t missing;

    (void)snprintf(record, sizeof record,
                   "[{\"covariates\":{},\"id\":\"%s\",\"label\":\"a\",\"subject\":null},"
                   "{\"covariates\":{},\"id\":\"%s\",\"label\":null,\"subject\":\"s\"}]",
                   fixture->surface, GOOD_MESH);
    cohort.record = strdup(record);
    cohort.members = calloc(2, sizeof *cohort.members);
    assert_non_null(cohort.members);
    memcpy(cohort.members[0], fixture->surface, STORE_ID_MAX);
    memcpy(cohort.members[1], GOOD_MESH, sizeof GOOD_MESH);
    assert_int_equal(store_cohort_put(fixture->store, &cohort, &created, &missing), 0);
    store_cohort_clear(&cohort);
}

/* A cohort of the surface, n times, in the groups "sick" and "well", with the
   covariates age, treated, and one that is missing for the last. */
static void put_patients(struct fixture *fixture, const char *name, size_t n)
{
    struct store_cohort cohort = {.n_members = n};
    json_t *members = json_array();
    bool created;
    size_t missing;

    (void)snprintf(cohort.name, sizeof cohort.name, "%s", name);
    cohort.members = calloc(cohort.n_members, sizeof *cohort.members);
    assert_non_null(cohort.members);
    for (size_t i = 0; i < cohort.n_members; i++) {
        json_t *member = json_pack("{s:s, s:s, s:n, s:{s:i, s:b}}", "id", fixture->surface, "label",
                                   i % 2 ? "sick" : "well", "subject", "covariates", "age",
                                   40 + (int)(i * i), "treated", i == 3);

        if (i + 1 < cohort.n_members) {
            (void)json_object_set_new(json_object_get(member, "covariates"), "volume",
                                      json_real(1.5));
        }
        (void)json_array_append_new(members, member);
        memcpy(cohort.members[i], fixture->surface, STORE_ID_MAX);
    }
    cohort.record = json_dumps(members, JSON_COMPACT | JSON_SORT_KEYS);
    json_decref(members);
    assert_int_equal(store_cohort_put(fixture->store, &cohort, &created, &missing), 0);
    store_cohort_clear(&cohort);
}

/* A mean of the cohort "group" that has ended, and one that waits. */
static void put_jobs(struct fixture *fixture)
{
    char process[] = "mean", empty[] = "", build[] = "test build";
    char inputs[] = "{\"cohort\":{\"name\":\"group\"},\"lmax\":9}";
    struct store_job job = {.process = process,
                            .inputs = inputs,
                            .message = empty,
                            .numeric_build = build,
                            .created_ms = 1000,
                            .id = DONE_JOB};
    struct store_job claimed = {0};

    store_sha256_hex(job.digest, DONE_JOB, sizeof DONE_JOB);
    assert_int_equal(store_job_insert(fixture->store, &job, NULL, NULL, NULL), 0);
    assert_int_equal(store_job_claim(fixture->store, &claimed), 0);
    assert_int_equal(store_job_transition(fixture->store, DONE_JOB, claimed.attempt,
                                          STORE_JOB_SUCCESSFUL, "{}", NULL, NULL),
                     0);
    store_job_clear(&claimed);
    memcpy(job.id, WAITING_JOB, sizeof WAITING_JOB);
    store_sha256_hex(job.digest, WAITING_JOB, sizeof WAITING_JOB);
    assert_int_equal(store_job_insert(fixture->store, &job, NULL, NULL, NULL), 0);
}

/* A cohort of the surface, a left one at time 0 and a right one at time 1 of each of 26
   subjects at most, which are its parts too; subjects have two labels in turn. */
static void put_pairs(struct fixture *fixture, const char *name, size_t subjects)
{
    struct store_cohort cohort = {.n_members = 2 * subjects};
    json_t *members = json_array();
    bool created;
    size_t missing;

    (void)snprintf(cohort.name, sizeof cohort.name, "%s", name);
    cohort.members = calloc(cohort.n_members, sizeof *cohort.members);
    assert_non_null(cohort.members);
    for (size_t i = 0; i < cohort.n_members; i++) {
        const char subject[3] = {'s', (char)('a' + i / 2), '\0'};

        (void)json_array_append_new(
            members,
            json_pack("{s:s, s:s, s:s, s:{s:s}, s:i, s:s}", "id", fixture->surface, "label",
                      i / 2 % 2 ? "y" : "x", "subject", subject, "covariates", "part",
                      i % 2 ? "b" : "a", "time", (int)(i % 2), "side", i % 2 ? "right" : "left"));
        memcpy(cohort.members[i], fixture->surface, STORE_ID_MAX);
    }
    cohort.record = json_dumps(members, JSON_COMPACT | JSON_SORT_KEYS);
    json_decref(members);
    assert_int_equal(store_cohort_put(fixture->store, &cohort, &created, &missing), 0);
    store_cohort_clear(&cohort);
}

static int fixture_open(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);
    char message[200] = "";

    assert_non_null(fixture);
    assert_true(scratch_make(fixture->directory, "process"));
    assert_int_equal(store_open(&fixture->store, fixture->directory, message, sizeof message), 0);
    fixture->api.config.store = fixture->store;
    fixture->api.config.processes = &processes;
    put_mesh(fixture, GOOD_MESH, "{\"analysable\":true,\"problems\":[]}");
    put_mesh(fixture, OPEN_MESH,
             "{\"analysable\":false,\"problems\":[{\"code\":\"mesh-not-closed\",\"count\":3,"
             "\"first\":17,\"detail\":\"3 boundary edges\"}]}");
    put_mesh(fixture, STARLESS_MESH,
             "{\"analysable\":false,\"route\":null,\"problems\":[{\"code\":\"not-star-shaped\","
             "\"count\":1,\"first\":null,\"detail\":\"no point sees the whole surface\"}]}");
    put_surface(fixture);
    put_model(fixture, "{}", MODEL_COMPONENTS, fixture->model);
    put_model(fixture, "{\"classifier\":{}}", MODEL_COMPONENTS - 1, fixture->classifier);
    put_cohort(fixture);
    put_patients(fixture, "patients", 6);
    put_patients(fixture, "trained", 10);
    put_pairs(fixture, "pairs", 6);
    put_pairs(fixture, "structures", 12);
    put_volume(fixture);
    put_jobs(fixture);
    *state = fixture;
    return 0;
}

static int fixture_close(void **state)
{
    struct fixture *fixture = *state;

    store_close(fixture->store);
    scratch_remove(fixture->directory);
    free(fixture);
    return 0;
}

/* What one canonicalization gave. */
struct outcome {
    json_t *canonical; /* or NULL */
    json_t *errors;    /* of the list, or NULL */
    int status;        /* of a problem that was answered, or 0 */
    char code[64];     /* of that problem */
    double seconds;    /* that a job of the canonical inputs is expected to take */
};

static void outcome_clear(struct outcome *outcome)
{
    json_decref(outcome->canonical);
    json_decref(outcome->errors);
}

static struct outcome canonical_outcome_as(struct fixture *fixture,
                                           const struct api_process *process, const json_t *inputs)
{
    struct api_request request = {.method = "POST", .path = "/", .query = "", .id = "r"};
    struct api_response response = {0};
    struct api_call call = {.api = &fixture->api, .request = &request, .response = &response};
    struct problem_list list = {.errors = NULL};
    struct outcome outcome = {0};
    json_t *body;

    outcome.canonical = processes.canonicalize(process->table, &call, inputs, &list);
    outcome.errors = list.errors;
    if (outcome.canonical && !list.errors) {
        outcome.seconds = process->seconds(&call.work, outcome.canonical);
    }
    outcome.status = response.status;
    if (response.body) {
        body = json_loadb((const char *)response.body, response.body_size, 0, NULL);
        (void)snprintf(outcome.code, sizeof outcome.code, "%s",
                       json_string_value(json_object_get(body, "code")));
        json_decref(body);
    }
    api_response_clear(&response);
    /* A result, or a reason: never both, never neither. */
    assert_true((outcome.canonical != NULL) == (!outcome.errors && !outcome.status));
    return outcome;
}

static struct outcome canonical_outcome(struct fixture *fixture, const char *process,
                                        const json_t *inputs)
{
    return canonical_outcome_as(fixture, api_process_find(&fixture->api, process), inputs);
}

/* Text in which @ stands for the id of the surface, % for that of the model and # for that of the
   classifier. */
static void expand(const struct fixture *fixture, const char *text, char *out, size_t size)
{
    size_t n = 0;

    for (; *text && n < size - STORE_ID_MAX; text++) {
        const char *id = *text == '@'   ? fixture->surface
                         : *text == '%' ? fixture->model
                         : *text == '#' ? fixture->classifier
                                        : NULL;
        n += (size_t)snprintf(out + n, size - n, id ? "%s" : "%.1s", id ? id : text);
    }
}

/* The same from such a text. */
static struct outcome canonicalize_text(struct fixture *fixture, const char *process,
                                        const char *text)
{
    char whole[2048];
    json_t *inputs;
    struct outcome outcome;

    expand(fixture, text, whole, sizeof whole);
    inputs = json_loads(whole, 0, NULL);
    assert_non_null(inputs);
    outcome = canonical_outcome(fixture, process, inputs);
    json_decref(inputs);
    return outcome;
}

static bool has_error(const struct outcome *outcome, const char *pointer)
{
    for (size_t i = 0; i < json_array_size(outcome->errors); i++) {
        const json_t *error = json_array_get(outcome->errors, i);
        if (strcmp(json_string_value(json_object_get(error, "pointer")), pointer) == 0) {
            return true;
        }
    }
    return false;
}

/* Inputs that must be refused with an error at the pointer. */
__attribute__((unused)) static void refused(struct fixture *fixture, const char *process,
                                            const char *text, const char *pointer)
{
    struct outcome outcome = canonicalize_text(fixture, process, text);

    if (!has_error(&outcome, pointer)) {
        fail_msg("%s is not refused at %s", text, pointer);
    }
    outcome_clear(&outcome);
}

/* Inputs that must be answered at once with a problem of that status and code. */
__attribute__((unused)) static void answered(struct fixture *fixture, const char *process,
                                             const char *text, int status, const char *code)
{
    struct outcome outcome = canonicalize_text(fixture, process, text);

    assert_int_equal(outcome.status, status);
    assert_string_equal(outcome.code, code);
    outcome_clear(&outcome);
}

/* Two spellings of one meaning have one canonical text, which is returned by the member asked
   for. */
__attribute__((unused)) static void same(struct fixture *fixture, const char *process,
                                         const char *a, const char *b)
{
    const size_t flags = JSON_SORT_KEYS | JSON_COMPACT | JSON_REAL_PRECISION(17);
    struct outcome first = canonicalize_text(fixture, process, a);
    struct outcome second = canonicalize_text(fixture, process, b);
    char *x = first.canonical ? json_dumps(first.canonical, flags) : NULL;
    char *y = second.canonical ? json_dumps(second.canonical, flags) : NULL;

    assert_non_null(x);
    assert_non_null(y);
    assert_string_equal(x, y);
    free(x);
    free(y);
    outcome_clear(&first);
    outcome_clear(&second);
}

#endif
