/*
 * jobs_routes.c - the job resource: list, status, results, cancel, delete.
 *
 * A job's state is the engine's; here it only becomes JSON. Results are stored as the text that the
 * process wrote and are handed on unparsed, but for a matrix of distances, which is served as CSV
 * and .npy too (processes/distances.c). Asking for the results of a job that has not ended is
 * 409 with Retry-After, of one that failed its problem with that problem's status, of one that was
 * dismissed 410.
 *
 * The record is a statusInfo of OGC API - Processes 1.0 with members of our own; what is not known
 * is absent. DELETE is its dismissal. Of a job that has ended nothing but name and tags can change,
 * so its entity tag is of these; one that has not ended changes by the moment, and has none.
 */
#include "api/links.h"
#include "api/respond.h"
#include "api/lists.h"
#include "api/routes.h"

#include "api/changes.h"
#include "api/framing.h"
#include "api/job_answers.h"
#include "api/tables.h"
#include "api/json_memory.h"
#include "api/labels.h"
#include "store/digest.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Bytes of inputs that a record shows, and that its entry in a list does. */
#define INPUTS_MAX ((size_t)64 << 10)
#define INPUTS_LISTED ((size_t)2 << 10)
#define CANCEL_SECONDS 20 /* that a job which was dismissed may take to stop */
#define LOOK_MS 20        /* between two looks whether it has */

static json_t *job_links(const struct store_job *job)
{
    json_t *links = json_array();
    char path[128];

    (void)snprintf(path, sizeof path, "/v1/jobs/%s", job->id);
    link_add(links, path, "self", LINK_JSON, "The job");
    (void)snprintf(path, sizeof path, "/v1/jobs/%s/events", job->id);
    link_add(links, path, "monitor", "text/event-stream", "Its changes");
    if (job->status == STORE_JOB_SUCCESSFUL || job->status == STORE_JOB_FAILED) {
        (void)snprintf(path, sizeof path, "/v1/jobs/%s/results", job->id);
        link_add(links, path, LINK_OGC "results", LINK_JSON, "What it gave");
    }
    (void)snprintf(path, sizeof path, "/v1/processes/%s", job->process);
    link_add(links, path, LINK_OGC "process-desc", LINK_JSON, "The process");
    link_add(links, "/v1/jobs", "up", LINK_JSON, "All jobs");
    return links;
}

/* The problem of a failed job; NULL for any other. */
static json_t *job_problem(const struct store_job *job, const char *request_id)
{
    char instance[96];

    if (job->status != STORE_JOB_FAILED) {
        return NULL;
    }
    (void)snprintf(instance, sizeof instance, "/v1/jobs/%s", job->id);
    return problem_json(job->problem_code ? job->problem_code : "internal-error",
                        job->problem_detail, instance, request_id);
}

/* Sets a member unless the value is null: what is not known is absent. */
static void set_known(json_t *document, const char *name, json_t *value)
{
    if (json_is_null(value)) {
        json_decref(value);
    } else {
        (void)json_object_set_new(document, name, value);
    }
}

/* What holds at this moment, and only of jobs that wait or run. */
static void set_moment(json_t *document, const struct store_job *job)
{
    if (job->progress >= 0) {
        (void)json_object_set_new(document, "progress", json_integer((json_int_t)job->progress));
    }
    if (job->status == STORE_JOB_RUNNING && job->seconds_left >= 0) {
        (void)json_object_set_new(document, "estimatedSecondsLeft", json_real(job->seconds_left));
    }
    if (job->status == STORE_JOB_ACCEPTED && job->queue_position > 0) {
        (void)json_object_set_new(document, "queuePosition",
                                  json_integer((json_int_t)job->queue_position));
    }
}

json_t *job_record(const struct store_job *job, const char *cache)
{
    json_t *document = json_object();
    json_t *problem = job_problem(job, NULL);

    (void)json_object_set_new(document, "jobID", json_string(job->id));
    (void)json_object_set_new(document, "id", json_string(job->id));
    (void)json_object_set_new(document, "type", json_string("process"));
    (void)json_object_set_new(document, "name", json_string(job->name ? job->name : ""));
    labels_set_tags(document, job->tags);
    (void)json_object_set_new(document, "processID", json_string(job->process));
    if (job->owner[0]) {
        (void)json_object_set_new(document, "owner", json_string(job->owner));
    }
    (void)json_object_set_new(document, "status", json_string(store_job_status_name(job->status)));
    (void)json_object_set_new(document, "message", json_string(job->message ? job->message : ""));
    set_moment(document, job);
    set_known(document, "created", json_time(job->created_ms));
    set_known(document, "started", json_time(job->started_ms));
    set_known(document, "finished", json_time(job->finished_ms));
    set_known(document, "updated", json_time(job->updated_ms));
    (void)json_object_set_new(document, "attempt", json_integer(job->attempt));
    (void)json_object_set_new(document, "cancelRequested", json_boolean(job->cancel_requested));
    (void)json_object_set_new(document, "cache", json_string(cache ? cache : "miss"));
    (void)json_object_set_new(document, "inputsDigest", json_string(job->digest));
    (void)json_object_set_new(document, "numericBuild",
                              json_string(job->numeric_build ? job->numeric_build : ""));
    if (problem) {
        (void)json_object_set_new(document, "exception", problem);
    }
    (void)json_object_set_new(document, "links", job_links(job));
    return document;
}

bool job_ended(const struct store_job *job)
{
    return job->status != STORE_JOB_ACCEPTED && job->status != STORE_JOB_RUNNING;
}

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

/* The record with the inputs as the job has them, unless they are long (arrays of numbers): then
   the results alone tell them. Takes over and returns the record. */
static json_t *with_inputs(json_t *record, const struct store_job *job, size_t most)
{
    size_t length = job->inputs ? strlen(job->inputs) : 0;
    json_t *inputs = length <= most ? json_memory_load(job->inputs, length, 0, NULL, NULL) : NULL;

    if (inputs) {
        (void)json_object_set_new(record, "inputs", inputs);
    }
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
        respond_json(call, 200, with_inputs(job_record(&job, NULL), &job, INPUTS_MAX));
    }
    store_job_clear(&job);
}

/* The results of a successful job in the form asked for. */
static void respond_form(struct api_call *call, const struct store_job *job, enum table_form form,
                         const struct framing *framing)
{
    char tag[STORE_ID_MAX + 24], text[STORE_FRAMING_MAX], digest[65] = "";

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
    const char *id = call->parameters[0];
    char *results = NULL, tag[STORE_ID_MAX + 8];
    size_t size = 0;

    if (store_job_results_recent(call->api->config.store, id, &results, &size) != STORE_OK) {
        return false;
    }
    (void)api_response_header_text(call->response, "Vary", "Accept");
    (void)snprintf(tag, sizeof tag, "%s.%s", id, table_form_name(TABLE_JSON));
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

/* ---- GET /v1/jobs ---------------------------------------------------------------------------- */

static bool add_job(void *user, const struct store_job *job)
{
    return list_add(user, with_inputs(job_record(job, NULL), job, INPUTS_LISTED), job->created_ms,
                    job->id);
}

/* The items of a page that wait for their place, by id; borrowed. */
struct waiting {
    json_t *items;
    size_t left;
};

static bool place_job(void *user, const char *id, size_t position)
{
    struct waiting *waiting = user;
    json_t *item = json_object_get(waiting->items, id);

    if (item) {
        (void)json_object_set_new(item, "queuePosition", json_integer((json_int_t)position));
        waiting->left--;
    }
    return waiting->left > 0;
}

/* The places of those jobs of the page that wait, in one look at the queue: not while the page is
   read, which holds the only reader that this thread may have. */
static int place_jobs(struct api_call *call, json_t *items)
{
    struct waiting waiting = {.items = json_object()};
    int status = 0;
    json_t *item;
    size_t i;

    json_array_foreach(items, i, item)
    {
        const char *name = json_string_value(json_object_get(item, "status"));

        if (name && strcmp(name, store_job_status_name(STORE_JOB_ACCEPTED)) == 0) {
            (void)json_object_set(waiting.items, json_string_value(json_object_get(item, "id")),
                                  item);
            waiting.left++;
        }
    }
    if (waiting.left > 0) {
        status = jobs_places(call->api->config.jobs, place_job, &waiting);
    }
    json_decref(waiting.items);
    return status;
}

void jobs_list(struct api_call *call)
{
    struct list list;
    int read;

    if (list_open(call, "jobs", &list)) {
        list.member = "jobs";
        read = jobs_page(call->api->config.jobs, &list.page, add_job, &list);
        list_respond(call, &list, "/v1/jobs", read ? read : place_jobs(call, list.items));
    }
}
