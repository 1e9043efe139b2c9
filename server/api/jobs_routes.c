/*
 * jobs_routes.c - the job resource: status, results, cancel, delete.
 *
 * A job's state is the engine's; here it only becomes JSON. Results are stored as the text that the
 * process wrote and are handed on unparsed, but for those of which there are tables: they are
 * served as CSV, and a matrix of distances as .npy too. Asking for the results of a job that has
 * not ended is 409 with Retry-After, of one that failed its problem with that problem's status, of
 * one that was dismissed 410.
 *
 * DELETE is a dismissal. Of a job that has ended nothing but name and tags can change, so its
 * entity tag is of these; one that has not ended changes by the moment, and has none.
 */
#include "api/respond.h"
#include "api/routes.h"

#include "api/changes.h"
#include "api/framing.h"
#include "api/job_answers.h"
#include "api/tables.h"
#include "api/labels.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/task.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define INPUTS_MAX ((size_t)64 << 10) /* bytes of inputs that a record shows */
#define CANCEL_SECONDS 20             /* that a job which was dismissed may take to stop */
#define LOOK_MS 20                    /* between two looks whether it has */

static void respond_successful(struct api_call *call, const struct store_job *job,
                               const struct framing *framing)
{
    char *results = NULL;
    size_t size = 0;
    int status = store_job_results(call->api->config.store, job->id, &results, &size);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", job->id);
        return;
    }
    framing_respond(call, job->id, framing, results, size);
}

static void respond_not_ready(struct api_call *call, const struct store_job *job,
                              const struct framing *framing)
{
    char detail[160];

    (void)snprintf(detail, sizeof detail, "%s is %s; its results come when it ends.", job->id,
                   store_job_status_name(job->status));
    /* 404 is what the standard has. */
    api_problem(call->request, call->response, framing_is_plain(framing) ? 409 : 404,
                "result-not-ready", detail);
    (void)api_response_header_text(call->response, "Retry-After", "1");
}

void job_respond_results(struct api_call *call, const struct store_job *job,
                         const struct framing *framing)
{
    json_t *problem;

    switch (job->status) {
    case STORE_JOB_SUCCESSFUL:
        respond_successful(call, job, framing);
        break;
    case STORE_JOB_FAILED:
        problem = job_problem(job, call->request->id);
        response_json(call->response,
                      problem_status(job->problem_code ? job->problem_code : "internal-error"),
                      "application/problem+json", problem);
        break;
    case STORE_JOB_DISMISSED:
        (void)problem_respond(call, "job-dismissed", "%s was dismissed and has no results.",
                              job->id);
        break;
    case STORE_JOB_ACCEPTED:
    case STORE_JOB_RUNNING:
        respond_not_ready(call, job, framing);
        break;
    }
}

/* Reads the job of the path. False when a problem was answered. */
static bool find_job(struct api_call *call, struct store_job *job)
{
    int status = jobs_get(call->api->config.jobs, call->parameters[0], job);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", call->parameters[0]);
    }
    return status == 0;
}

static void add_executor(void *user, const struct store_maker *maker, int64_t tasks)
{
    (void)json_array_append_new(user, json_pack("{s:s, s:s, s:s, s:I}", "host", maker->host, "cpu",
                                                maker->cpu, "build", maker->build, "tasks",
                                                (json_int_t)tasks));
}

/* The record of a job with those that have computed its tasks; without, where there are none. */
static json_t *with_executors(struct api_call *call, json_t *record, const char *job)
{
    json_t *executors = json_array();

    if (store_task_makers(call->api->config.store, job, add_executor, executors) == STORE_OK &&
        json_array_size(executors) > 0) {
        (void)json_object_set(record, "executors", executors);
    }
    json_decref(executors);
    return record;
}

void jobs_get_one(struct api_call *call)
{
    struct store_job job = {0};
    char etag[LABELS_ETAG_MAX];

    if (!find_job(call, &job)) {
        return;
    }
    labels_etag(etag, job.id, job.name, job.tags);
    if (!job_ended(&job)) {
        (void)api_response_header_text(call->response, "Retry-After", "1");
    }
    if (!job_ended(&job) || !respond_not_modified(call, etag)) {
        json_t *record = job_with_inputs(job_record(&job, NULL), &job, INPUTS_MAX);

        respond_json(call, 200, with_executors(call, record, job.id));
    }
    store_job_clear(&job);
}

/* Whether the query may have `condensed`: where there is a condensed form. False when a problem was
   answered. */
static bool condensed_fits(struct api_call *call, const struct store_job *job, enum table_form form)
{
    struct problem_list problems = {.errors = NULL};
    bool refused = false;
    char text[8];

    if (!query_get(call, "condensed", text, sizeof text, &refused)) {
        return !refused;
    }
    if (form == TABLE_NPY && api_process_find(call->api, job->process)->condensed) {
        return true;
    }
    problem_add(&problems, "/condensed", "only symmetric matrices as .npy have a condensed form");
    (void)problem_respond_list(call, "invalid-input", &problems);
    return false;
}

/* The results of a successful job in the form asked for. */
static void respond_form(struct api_call *call, const struct store_job *job, enum table_form form,
                         const struct framing *framing)
{
    char tag[STORE_ID_MAX + 24], text[STORE_FRAMING_MAX], digest[65] = "";

    if (!condensed_fits(call, job, form)) {
        return;
    }
    framing_write(framing, text);
    if (text[0]) {
        store_sha256_hex(digest, text, strlen(text));
    }
    (void)api_response_header_text(call->response, "Vary", "Accept");
    (void)snprintf(tag, sizeof tag, "%s.%s%.12s", job->id, table_form_name(form), digest);
    if (respond_not_modified(call, tag)) {
        return;
    }
    if (form == TABLE_JSON) {
        respond_successful(call, job, framing);
    } else {
        api_process_find(call->api, job->process)->respond_table(call, job, (int)form);
    }
}

/* The results as JSON from memory, if they are there; then they are of a successful job. */
static bool respond_recent(struct api_call *call)
{
    static const char ending[] = ".json";
    const char *id = call->parameters[0];
    char *results = NULL, tag[STORE_ID_MAX + sizeof ending];
    size_t size = 0, length = strlen(id);

    if (store_job_results_recent(call->api->config.store, id, &results, &size) != STORE_OK) {
        return false;
    }
    (void)api_response_header_text(call->response, "Vary", "Accept");
    memcpy(tag, id, length); /* the store's ids are shorter than STORE_ID_MAX */
    memcpy(tag + length, ending, sizeof ending);
    if (respond_not_modified(call, tag)) {
        free(results);
    } else {
        respond_bytes(call, 200, "application/json", (unsigned char *)results, size);
    }
    return true;
}

/* Whether the results have a form as a table. */
static bool has_table(const struct api *api, const struct store_job *job)
{
    const struct api_process *process = api_process_find(api, job->process);

    return process && process->respond_table;
}

/* How the job's results are framed: as the query says, or as its last execution asked. False when a
   problem was answered. */
static bool find_framing(struct api_call *call, const struct store_job *job,
                         struct framing *framing)
{
    char text[STORE_FRAMING_MAX];
    int status = store_framing_get(call->api->config.store, job->id, text);

    framing_parse(text, framing);
    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", job->id);
        return false;
    }
    return framing_query(call, api_process_find(call->api, job->process), framing);
}

void jobs_results(struct api_call *call)
{
    bool bare = call->request->query[0] == '\0';
    struct store_job job = {0};
    struct framing framing;
    enum table_form form;

    if (!table_choose(call, &form) || (form == TABLE_JSON && bare && respond_recent(call)) ||
        !find_job(call, &job)) {
        return;
    }
    if (!find_framing(call, &job, &framing)) {
        store_job_clear(&job);
        return;
    }
    if (job.status != STORE_JOB_SUCCESSFUL) {
        job_respond_results(call, &job, &framing);
    } else if (form != TABLE_JSON && !has_table(call->api, &job)) {
        (void)problem_respond(call, "not-acceptable",
                              "The results of %s are served as application/json.", job.process);
    } else {
        respond_form(call, &job, form, &framing);
    }
    store_job_clear(&job);
}

void jobs_output(struct api_call *call)
{
    struct framing framing = {.response = FRAMING_RAW, .n = 1};
    struct framing_member member;
    struct store_job job = {0};
    char *results = NULL, tag[STORE_ID_MAX + FRAMING_NAME_MAX];
    size_t size = 0;
    int status;

    if (!find_job(call, &job)) {
        return;
    }
    if (job.status != STORE_JOB_SUCCESSFUL) {
        job_respond_results(call, &job, &framing);
        goto out;
    }
    (void)snprintf(tag, sizeof tag, "%s.%.40s", job.id, call->parameters[1]);
    if (respond_not_modified(call, tag)) {
        goto out;
    }
    status = store_job_results(call->api->config.store, job.id, &results, &size);
    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", job.id);
    } else if (strlen(call->parameters[1]) >= FRAMING_NAME_MAX ||
               !framing_find(results, size, call->parameters[1], &member)) {
        (void)problem_respond(call, "no-such-output", "%s has no output \"%.60s\".", job.id,
                              call->parameters[1]);
    } else if (!job_respond_content(call, &job, &member)) {
        memcpy(framing.outputs[0].name, call->parameters[1], strlen(call->parameters[1]) + 1);
        framing_respond(call, job.id, &framing, results, size);
        results = NULL;
    }
out:
    free(results);
    store_job_clear(&job);
}

void jobs_cancel_one(struct api_call *call)
{
    struct store_job job = {0};
    int status = jobs_cancel(call->api->config.jobs, call->parameters[0], &job);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", call->parameters[0]);
        return;
    }
    respond_json(call, 200, job_record(&job, NULL));
    store_job_clear(&job);
}

/* Waits until a job that was asked to stop has ended, which takes milliseconds as a rule. */
static int await_end(struct api_call *call, struct store_job *job)
{
    const struct timespec look = {.tv_nsec = LOOK_MS * 1000L * 1000L};
    char id[STORE_ID_MAX];
    int status = 0;

    memcpy(id, job->id, sizeof id);
    for (int waited = 0; status == 0 && !job_ended(job) && waited < 1000 * CANCEL_SECONDS;
         waited += LOOK_MS) {
        (void)nanosleep(&look, NULL);
        store_job_clear(job);
        status = jobs_get(call->api->config.jobs, id, job);
    }
    return status;
}

/* Dismisses the job, or removes one that has ended. Either way the answer is its record with the
   status dismissed, as the standard has it. */
void jobs_delete(struct api_call *call)
{
    struct store_job job = {0};
    char etag[LABELS_ETAG_MAX];
    int status;

    if (!find_job(call, &job)) {
        return;
    }
    labels_etag(etag, job.id, job.name, job.tags);
    if (respond_precondition_failed(call, job_ended(&job) ? etag : NULL)) {
        store_job_clear(&job);
        return;
    }
    if (job_ended(&job)) {
        status = store_job_delete(call->api->config.store, job.id);
        if (status == 0) {
            changes_note(call->api->changes, job.id, job.owner, true);
        }
        job.status = STORE_JOB_DISMISSED;
    } else {
        store_job_clear(&job);
        status = jobs_cancel(call->api->config.jobs, call->parameters[0], &job);
        status = status ? status : await_end(call, &job);
    }
    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", call->parameters[0]);
    } else {
        respond_json(call, 200, job_record(&job, NULL));
    }
    store_job_clear(&job);
}
