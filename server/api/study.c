/*
 * study.c - gathering a study: the members of a cohort and all the work that rests on nothing else,
 * or a model and the jobs that made it. A mesh takes along the volume that it was extracted from.
 *
 * A job belongs to a study if all meshes, surfaces and models that its inputs name do, and then
 * what its results name does as well. Rounds over the owner's jobs go on until one adds nothing: as
 * many as the longest chain of jobs, and one. So a study is complete: elsewhere every job's inputs
 * are there, and the same request finds the same answer.
 *
 * Who hands on a model hands on neither other models of its members nor their labels. So of these
 * jobs it takes along the makers alone: the one that made the model, and those of its members, as
 * their records tell. Its means and templates may be those of another analysis too, which made
 * them first: the job of the model stands for them.
 */
#include "api/study.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "store/digest.h"
#include "store/holdings.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/page.h"
#include "store/surface.h"

#define DIGITS 32

void study_job_digest(char digest[65], const char *process, const char *build, const char *inputs)
{
    char *text;

    digest[0] = '\0';
    if (asprintf(&text, "%s\n%s\n%s", process, build, inputs) >= 0) {
        store_sha256_hex(digest, text, strlen(text));
        free(text);
    }
}

bool study_begin(struct study *study, struct api_call *call, const char *owner)
{
    *study = (struct study){.call = call,
                            .owner = owner,
                            .ids = json_object(),
                            .jobs = json_object(),
                            .makers = json_object()};
    return study->ids && study->jobs && study->makers;
}

void study_end(struct study *study)
{
    json_decref(study->ids);
    json_decref(study->jobs);
    json_decref(study->makers);
}

/* The next id in the text, and *at behind it; false at its end. */
static bool next_id(const char **at, char id[STORE_ID_MAX])
{
    static const char *const kinds[] = {"mesh-", "surf-", "model-"};

    for (const char *text = *at; (text = strchr(text, '-')) != NULL; text++) {
        for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
            size_t length = strlen(kinds[i]);

            if (text - *at + 1 >= (ptrdiff_t)length &&
                memcmp(text + 1 - length, kinds[i], length) == 0 &&
                strspn(text + 1, "0123456789abcdef") == DIGITS) {
                memcpy(id, text + 1 - length, length + DIGITS);
                id[length + DIGITS] = '\0';
                *at = text + 1 + DIGITS;
                return true;
            }
        }
    }
    return false;
}

/* Adds all ids in a text. */
static void add_text(struct study *study, const char *text)
{
    char id[STORE_ID_MAX];

    while (study->status == STORE_OK && next_id(&text, id)) {
        study_add(study, id);
    }
}

static void note(struct study *study, int status)
{
    if (status != STORE_OK && status != STORE_NOT_FOUND && study->status == STORE_OK) {
        study->status = status;
    }
}

/* Notes the job that made the thing; job may be NULL. */
static void add_maker(struct study *study, const char *id, const json_t *job)
{
    if (json_is_string(job)) {
        (void)json_object_set_new(study->makers, id, json_string(json_string_value(job)));
    }
}

static void add_of_surface(struct study *study, const char *id)
{
    struct store_surface surface;
    int status =
        store_surface_get_as(study->call->api->config.store, study->owner, id, false, &surface);

    note(study, status);
    if (status == STORE_OK) {
        json_t *record = json_loads(surface.record ? surface.record : "{}", 0, NULL);
        const json_t *source = json_object_get(record, "source");
        const char *mesh = json_string_value(json_object_get(source, "mesh"));

        if (mesh) {
            study_add(study, mesh);
        }
        add_maker(study, id, json_object_get(source, "job"));
        json_decref(record);
        store_surface_clear(&surface);
    }
}

/* The job that made the surface stays out, unless the surface is a member of the model. */
static void forget_maker(struct study *study, const json_t *record, const json_t *surface)
{
    const json_t *members = json_object_get(json_object_get(record, "madeFrom"), "surfaces");
    const char *id = json_string_value(surface);

    for (size_t i = 0; i < json_array_size(members); i++) {
        if (json_equal(json_array_get(members, i), surface)) {
            return;
        }
    }
    (void)json_object_del(study->makers, id ? id : "");
}

/* Means and templates may be those of another analysis, which made them first. */
static void forget_makers(struct study *study, const json_t *record)
{
    const json_t *parts = json_object_get(record, "parts");
    const json_t *classifier = json_object_get(record, "classifier");

    for (size_t i = 0; i < json_array_size(parts); i++) {
        const json_t *part = json_array_get(parts, i);

        forget_maker(study, record, json_object_get(part, "mean"));
        forget_maker(study, record, json_object_get(json_object_get(part, "template"), "surface"));
    }
    forget_maker(study, record,
                 json_object_get(json_object_get(classifier, "template"), "surface"));
}

static void add_of_model(struct study *study, const char *id)
{
    struct store_model model;
    int status = store_model_get_as(study->call->api->config.store, study->owner, id, 0, &model);

    note(study, status);
    if (status == STORE_OK) {
        json_t *record = json_loads(model.record ? model.record : "{}", 0, NULL);

        add_text(study, model.record ? model.record : "");
        study_add(study, model.mean);
        (void)json_object_del(study->makers, model.mean);
        forget_makers(study, record);
        add_maker(study, id, json_object_get(json_object_get(record, "madeFrom"), "job"));
        json_decref(record);
        store_model_clear(&model);
    }
}

static void add_results(struct study *study, const char *id);

/* The volume that the mesh was extracted from, and the job that did. Other meshes of the volume are
   no part of the study, so it takes no jobs along as other inputs do. */
static void add_of_mesh(struct study *study, const char *id)
{
    struct store *store = study->call->api->config.store;
    struct store_mesh mesh;
    int status = store_mesh_get_as(store, study->owner, id, &mesh);
    json_t *source;
    const char *volume, *job;

    note(study, status);
    if (status != STORE_OK) {
        return;
    }
    source = json_loads(mesh.source ? mesh.source : "{}", 0, NULL);
    volume = json_string_value(json_object_get(source, "volume"));
    job = json_string_value(json_object_get(source, "job"));
    if (volume) {
        study_add(study, volume);
    }
    if (volume && job && store_owner_has(store, study->owner, job) == STORE_OK) {
        add_results(study, job);
    }
    json_decref(source);
    store_mesh_clear(&mesh);
}

void study_add(struct study *study, const char *id)
{
    int status;

    if (json_object_get(study->ids, id)) {
        return;
    }
    status = store_owner_has(study->call->api->config.store, study->owner, id);
    note(study, status);
    if (status != STORE_OK) {
        return;
    }
    (void)json_object_set_new(study->ids, id, json_true());
    if (strncmp(id, "surf-", 5) == 0) {
        add_of_surface(study, id);
    } else if (strncmp(id, "model-", 6) == 0) {
        add_of_model(study, id);
    } else if (strncmp(id, "mesh-", 5) == 0) {
        add_of_mesh(study, id);
    }
}

/* ---- Jobs ------------------------------------------------------------------------------------ */

struct round {
    struct study *study;
    int64_t last_ms;
    char last_id[STORE_ID_MAX];
    size_t seen, n_found;
    char found[200][STORE_ID_MAX]; /* of one page */
};

/* Whether the inputs name something, and nothing that is not in the study. */
static bool rests_on(const struct study *study, const char *inputs)
{
    char id[STORE_ID_MAX];
    size_t count = 0;

    while (next_id(&inputs, id)) {
        if (!json_object_get(study->ids, id)) {
            return false;
        }
        count++;
    }
    return count > 0;
}

static bool visit(void *user, const struct store_job *job)
{
    struct round *round = user;

    round->seen++;
    round->last_ms = job->created_ms;
    memcpy(round->last_id, job->id, sizeof round->last_id);
    if (!json_object_get(round->study->jobs, job->id) &&
        rests_on(round->study, job->inputs ? job->inputs : "")) {
        memcpy(round->found[round->n_found++], job->id, STORE_ID_MAX);
    }
    return true;
}

static void add_results(struct study *study, const char *id)
{
    char *results;
    size_t size;
    int status = store_job_results(study->call->api->config.store, id, &results, &size);

    note(study, status);
    if (status == STORE_OK) {
        (void)json_object_set_new(study->jobs, id, json_true());
        add_text(study, results);
        free(results);
    }
}

/* One look at all jobs; whether any was added. */
static bool look(struct study *study, struct round *round)
{
    struct store_page page = {.status = "successful", .owner = study->owner};
    bool added = false;

    *round = (struct round){.study = study};
    page.limit = sizeof round->found / sizeof round->found[0];
    do {
        round->seen = round->n_found = 0;
        page.after_ms = round->last_ms;
        page.after_id = round->last_id;
        note(study, store_job_list(study->call->api->config.store, &page, visit, round));
        for (size_t i = 0; i < round->n_found && study->status == STORE_OK; i++) {
            add_results(study, round->found[i]);
            added = true;
        }
    } while (round->seen == page.limit && study->status == STORE_OK &&
             !jobs_memory_told(jobs_memory_current()));
    return added;
}

void study_add_jobs(struct study *study)
{
    struct round *round = malloc(sizeof *round);

    if (!round) {
        study->status = STORE_NOMEM;
        return;
    }
    while (study->status == STORE_OK && look(study, round) &&
           !jobs_memory_told(jobs_memory_current())) {
    }
    free(round);
}

/* Whether the job has succeeded, and its inputs are in the study. */
static bool is_of_study(struct study *study, const char *id)
{
    struct store_job job;
    bool good = false;
    int status = store_owner_has(study->call->api->config.store, study->owner, id);

    status = status ? status : store_job_get(study->call->api->config.store, id, &job);
    note(study, status);
    if (status == STORE_OK) {
        good = job.status == STORE_JOB_SUCCESSFUL && rests_on(study, job.inputs ? job.inputs : "");
        store_job_clear(&job);
    }
    return good;
}

void study_add_makers(struct study *study)
{
    size_t before;

    do { /* what a job made may have makers of its own */
        json_t *makers = json_copy(study->makers);
        const char *id;
        json_t *job;

        before = json_object_size(study->jobs);
        json_object_foreach(makers, id, job)
        {
            const char *maker = json_string_value(job);

            if (!json_object_get(study->jobs, maker) && is_of_study(study, maker) &&
                study->status == STORE_OK) {
                add_results(study, maker);
            }
        }
        json_decref(makers);
    } while (study->status == STORE_OK && json_object_size(study->jobs) > before &&
             !jobs_memory_told(jobs_memory_current()));
}
