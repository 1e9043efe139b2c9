/*
 * executions.c - POST /v1/processes/{id}/execution.
 *
 * The inputs are brought into canonical form by the process (references resolved, defaults filled
 * in), dumped with sorted keys, and submitted: equal texts are equal jobs, which is what the cache,
 * joining and the digest live on. Then the answer: with respond-async 201 and the job at once;
 * otherwise, or with wait=N, the connection waits for the job, not a thread: the handler fills
 * response->wait and returns, and executions_resume is called when the job changed or the time is
 * over. A job that ended answers as its results do, one that did not 201 with the job.
 *
 * An Idempotency-Key is "in flight" from here to the answer; the durable part (the same key names
 * the same job for a day) belongs to the engine, which compares a digest of the path and the body.
 */
#include "api/job_answers.h"
#include "api/json_memory.h"
#include "api/labels.h"
#include "api/prefer.h"
#include "api/respond.h"
#include "api/routes.h"

#include "api/auth.h"
#include "api/executions.h"
#include "api/framing.h"
#include "api/inflight.h"
#include "api/references.h"
#include "jobs/submit.h"
#include "log.h"
#include "store/digest.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KEY_MAX 200
#define WAIT_MAX 300.0 /* seconds; of a wait=N that asks for more */

struct execution_wait {
    struct api *api;
    struct auth_account *account; /* whose streams this is one of; NULL: of none */
    struct prefer prefer;
    enum jobs_submission how;
    struct framing framing;
    /* In flight until the answer, after the caller's name and a newline; "" where there is none. */
    char key[STORE_OWNER_MAX + KEY_MAX + 1];
};

static void execution_wait_free(void *state)
{
    struct execution_wait *wait = state;

    if (!wait) {
        return;
    }
    if (wait->key[0]) {
        inflight_leave(wait->api->inflight, wait->key);
    }
    stream_leave(wait->api->auth, wait->account);
    free(wait);
}

/* ---- The answer ------------------------------------------------------------------------------ */

static const struct {
    const char *job, *header; /* the member of the job document; RFC 9211 */
} cache_names[] = {
    [JOBS_NEW] = {"miss", "srnfd; fwd=miss"},
    [JOBS_JOINED] = {"joined", "srnfd; fwd=miss; collapsed"},
    [JOBS_CACHED] = {"hit", "srnfd; hit"},
};

static void set_execution_headers(struct api_call *call, const struct execution_wait *wait,
                                  const char *job_id)
{
    struct api_response *response = call->response;

    (void)api_response_header(response, "Link", "</v1/jobs/%s>; rel=\"monitor\"", job_id);
    (void)api_response_header_text(response, "Cache-Status", cache_names[wait->how].header);
    if (wait->prefer.respond_async && wait->prefer.has_wait) {
        (void)api_response_header(response, "Preference-Applied", "respond-async, wait=%.0f",
                                  wait->prefer.wait);
    } else if (wait->prefer.respond_async) {
        (void)api_response_header_text(response, "Preference-Applied", "respond-async");
    } else if (wait->prefer.has_wait) {
        (void)api_response_header(response, "Preference-Applied", "wait=%.0f", wait->prefer.wait);
    }
}

static void answer_with_job(struct api_call *call, const struct execution_wait *wait,
                            const struct store_job *job)
{
    struct store_job placed = *job;

    (void)jobs_place(call->api->config.jobs, &placed); /* where that fails it is not known */
    respond_json(call, 201, job_record(&placed, cache_names[wait->how].job));
    (void)api_response_header(call->response, "Location", "/v1/jobs/%s", job->id);
    set_execution_headers(call, wait, job->id);
}

static void answer_with_results(struct api_call *call, const struct execution_wait *wait,
                                const struct store_job *job)
{
    job_respond_results(call, job, &wait->framing);
    set_execution_headers(call, wait, job->id);
}

/* The job was there, and another request has deleted it since: as with one that was cancelled. */
static void answer_deleted(struct api_call *call, const char *job_id)
{
    (void)problem_respond(call, "job-dismissed",
                          "%s was deleted by another request before this one was answered.",
                          job_id);
}

/* Seconds to wait for the job before 201 is the answer. */
static double seconds_to_wait(const struct api *api, const struct prefer *prefer)
{
    if (prefer->has_wait) {
        return prefer->wait < WAIT_MAX ? prefer->wait : WAIT_MAX;
    }
    return prefer->respond_async ? 0 : api->config.sync_wait_seconds;
}

/* Answers a job that was just submitted, or starts to wait for it. Takes over wait. */
static void answer_submitted(struct api_call *call, struct execution_wait *wait,
                             const struct store_job *job)
{
    struct api_response *response = call->response;
    double seconds = seconds_to_wait(call->api, &wait->prefer);
    bool at_once = wait->prefer.respond_async && !wait->prefer.has_wait;

    if (job_ended(job) && !at_once) {
        answer_with_results(call, wait, job);
    } else if (seconds > 0) {
        (void)snprintf(response->wait.job_id, sizeof response->wait.job_id, "%s", job->id);
        response->wait.seconds = seconds;
        response->wait.state = wait;
        response->wait.free_state = execution_wait_free;
        return;
    } else {
        answer_with_job(call, wait, job);
    }
    execution_wait_free(wait);
}

void executions_resume(struct api *api, const struct api_request *request,
                       struct api_response *response)
{
    struct api_call call = {.api = api, .request = request, .response = response};
    struct execution_wait *wait = response->wait.state;
    struct store_job job = {0};
    char id[STORE_ID_MAX];
    int status;

    memcpy(id, response->wait.job_id, sizeof id);
    if (!auth_holds(api->auth, request->caller.account)) {
        /* The token was revoked, or has expired, while this waited: the job goes on. */
        response->wait.state = NULL;
        response->wait.job_id[0] = '\0';
        auth_refuse_revoked(&call);
        execution_wait_free(wait);
        return;
    }
    status = jobs_get(api->config.jobs, id, &job);
    if (status == 0 && !job_ended(&job) && response->wait.seconds > 0) {
        store_job_clear(&job);
        return;
    }
    response->wait.state = NULL;
    response->wait.job_id[0] = '\0';
    if (status == STORE_NOT_FOUND) {
        answer_deleted(&call, id);
    } else if (status != 0) {
        (void)problem_respond_store(&call, status, NULL, "waiting for the job");
    } else if (job_ended(&job)) {
        answer_with_results(&call, wait, &job);
    } else {
        answer_with_job(&call, wait, &job);
    }
    store_job_clear(&job);
    execution_wait_free(wait);
}

/* ---- The request ----------------------------------------------------------------------------- */

static bool is_member(const char *name)
{
    static const char *const names[] = {"inputs",   "name",    "tags",
                                        "response", "outputs", "subscriber"};
    size_t i = 0;

    while (i < sizeof names / sizeof names[0] && strcmp(names[i], name) != 0) {
        i++;
    }
    return i < sizeof names / sizeof names[0];
}

/* The inputs member of the body (borrowed from it), with references resolved, what the job is to be
   called, and how its results are wanted; NULL when a problem was answered. */
static const json_t *body_inputs(struct api_call *call, const struct api_process *process,
                                 json_t *body, struct labels *labels, struct framing *framing)
{
    struct problem_list problems = {.errors = NULL};
    json_t *inputs = json_object_get(body, "inputs"), *value;
    const char *name;
    char pointer[120];

    json_object_foreach(body, name, value)
    {
        if (!is_member(name)) {
            (void)snprintf(pointer, sizeof pointer, "/%.100s", name);
            problem_add(&problems, pointer,
                        "the body has the members inputs, outputs, response, subscriber, name and "
                        "tags; this one is not known.");
        }
    }
    if (!json_is_object(inputs)) {
        problem_add(&problems, "/inputs", "an object with the inputs of the process is required.");
    }
    labels_read(body, labels, &problems);
    framing_read(call, process, body, framing, &problems);
    if (json_is_object(inputs) && !references_resolve(call, process, inputs, &problems)) {
        json_decref(problems.errors);
        return NULL;
    }
    if (problems.errors) {
        (void)problem_respond_list(call, "invalid-input", &problems);
        return NULL;
    }
    return inputs;
}

char *execution_inputs(struct api_call *call, const struct api_process *process,
                       struct labels *labels, struct framing *framing, double *seconds)
{
    struct problem_list problems = {.errors = NULL};
    json_t *body = body_json(call), *canonical = NULL;
    const json_t *inputs = body ? body_inputs(call, process, body, labels, framing) : NULL;
    char *text = NULL;

    if (!inputs) {
        goto out;
    }
    canonical = call->api->config.processes->canonicalize(process->table, call, inputs, &problems);
    if (problems.errors) {
        (void)problem_respond_list(call, "invalid-input", &problems);
    } else if (canonical) {
        *seconds = process->seconds(&call->work, canonical);
        text = json_memory_dumps(canonical, JSON_COMPACT | JSON_SORT_KEYS);
        if (!text) {
            (void)problem_respond(call, "out-of-memory", "The inputs could not be written.");
        }
    } else if (call->response->status == 0) {
        (void)problem_respond(call, "internal-error", "The inputs could not be read.");
    }
out:
    json_decref(canonical);
    json_decref(body);
    return text;
}

/* Reads and enters the Idempotency-Key. False when a problem was answered. */
static bool enter_key(struct api_call *call, struct execution_wait *wait)
{
    const char *key = api_request_header(call->request, "Idempotency-Key");
    char owned[sizeof wait->key];
    enum inflight_entry entry;

    if (!key) {
        return true;
    }
    if (!key[0] || strlen(key) > KEY_MAX) {
        (void)problem_respond(call, "malformed-request",
                              "Idempotency-Key must have 1 to %d characters.", KEY_MAX);
        return false;
    }
    (void)snprintf(owned, sizeof owned, "%s\n%s", call->request->caller.name, key);
    entry = inflight_enter(call->api->inflight, owned);
    if (entry == INFLIGHT_TAKEN) {
        (void)problem_respond(call, "idempotency-key-in-flight",
                              "Another request with this Idempotency-Key is not answered yet.");
        (void)api_response_header_text(call->response, "Retry-After", "1");
        return false;
    }
    if (entry == INFLIGHT_NO_MEMORY) {
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for this.");
        return false;
    }
    memcpy(wait->key, owned, sizeof wait->key);
    return true;
}

/* SHA-256 of two digests, that of the path with its zero byte and that of the body: what a repeated
   Idempotency-Key must come with again. */
static void body_digest(const struct api_request *request, char digest[65])
{
    size_t length = strlen(request->path) + 1;
    char path_digest[65], both[130];

    store_sha256_hex(path_digest, request->path, length);
    store_sha256_hex(digest, request->body, request->body_size);
    (void)snprintf(both, sizeof both, "%s%s", path_digest, digest);
    store_sha256_hex(digest, both, strlen(both));
}

static void refuse_submission(struct api_call *call, int status)
{
    if (status == JOBS_QUEUE_FULL) {
        (void)problem_respond(call, "queue-full", "The queue of jobs is full; try again later.");
    } else if (status == JOBS_IDEMPOTENCY_MISMATCH) {
        (void)problem_respond(call, "idempotency-key-reused",
                              "This Idempotency-Key was used with another request.");
    } else if (status == JOBS_CLOSED) {
        (void)problem_respond(call, "shutting-down", "The service is shutting down.");
    } else {
        (void)problem_respond_store(call, status, NULL, "accepting the job");
    }
}

/* An answer that may wait for the job counts as a stream from here on. */
static bool enter_stream(struct api_call *call, struct execution_wait *wait)
{
    if (!(seconds_to_wait(call->api, &wait->prefer) > 0)) {
        return true;
    }
    if (!stream_enter(call)) {
        return false;
    }
    wait->account = call->request->caller.account;
    return true;
}

static int submit(struct api_call *call, const struct api_process *process, const char *inputs,
                  double seconds, const char *digest, struct store_job *job,
                  enum jobs_submission *how)
{
    const struct api_caller *caller = &call->request->caller;
    const struct jobs_owner owner = {
        .name = caller->name,
        .seconds = seconds,
        .trace = call->request->trace,
        .limits = {.queued = (size_t)caller->quotas[STORE_QUOTA_QUEUED],
                   .running = (size_t)caller->quotas[STORE_QUOTA_RUNNING],
                   .bytes = caller->quotas[STORE_QUOTA_BYTES]},
    };
    const char *key = api_request_header(call->request, "Idempotency-Key");

    return jobs_submit(call->api->config.jobs, &owner, process->id, inputs, key,
                       key ? digest : NULL, job, how);
}

/* Ties the request, and the trace that it is part of, to the job, whose lines follow. */
static void log_submission(const struct api_request *request, const struct store_job *job,
                           enum jobs_submission how)
{
    static const char *const names[] = {"new", "joined", "cached"};

    LOG("job-submitted", log_text("job", job->id), log_text("process", job->process),
        log_text("how", names[how]), log_text("request", request->id),
        log_text("traceparent", request->trace));
}

/* Gives the job the name and tags that it was submitted with; one that was joined, or has answered
   before, takes them. */
static int label_job(struct api_call *call, const struct labels *labels, struct store_job *job)
{
    const struct store_labels *change = &labels->change;
    char *name = change->name ? strdup(change->name) : NULL;
    char *tags = change->tags ? strdup(change->tags) : NULL;
    int status = STORE_OK;

    if ((change->name && !name) || (change->tags && !tags)) {
        status = STORE_NOMEM;
    } else if (name || tags) {
        status = store_label(call->api->config.store, job->owner, job->id, change);
    }
    if (status == STORE_OK && name) {
        free(job->name);
        job->name = name;
        name = NULL;
    }
    if (status == STORE_OK && tags) {
        free(job->tags);
        job->tags = tags;
        tags = NULL;
    }
    free(name);
    free(tags);
    return status;
}

/* Notes how the results of the job are wanted, for whoever asks for them later: the last execution
   that it answers says so. Most want them plain, and then nothing is written. */
static int frame_job(struct api_call *call, const struct framing *framing,
                     const struct store_job *job, enum jobs_submission how)
{
    struct store *store = call->api->config.store;
    char before[STORE_FRAMING_MAX] = "", text[STORE_FRAMING_MAX];
    int status = how == JOBS_NEW ? STORE_OK : store_framing_get(store, job->id, before);

    framing_write(framing, text);
    return status == STORE_OK && strcmp(before, text) != 0
               ? store_framing_set(store, job->owner, job->id, text)
               : status;
}

void executions_create(struct api_call *call)
{
    const struct api_process *process = api_process_find(call->api, call->parameters[0]);
    struct execution_wait *wait = NULL;
    struct store_job job = {0};
    struct labels labels = {.tags = NULL};
    char digest[65], *inputs = NULL;
    double seconds = 0.0;
    int status;

    if (!process) {
        api_process_missing(call);
        return;
    }
    wait = calloc(1, sizeof *wait);
    if (!wait) {
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for this.");
        return;
    }
    wait->api = call->api;
    prefer_read(call->request, &wait->prefer);
    if (!enter_key(call, wait) || !enter_stream(call, wait)) {
        goto out;
    }
    inputs = execution_inputs(call, process, &labels, &wait->framing, &seconds);
    if (!inputs) {
        goto out;
    }
    body_digest(call->request, digest);
    status = submit(call, process, inputs, seconds, digest, &job, &wait->how);
    if (status != 0) {
        refuse_submission(call, status);
        goto out;
    }
    log_submission(call->request, &job, wait->how);
    status = label_job(call, &labels, &job);
    if (status == 0) {
        status = frame_job(call, &wait->framing, &job, wait->how);
    }
    if (status == STORE_NOT_FOUND) {
        answer_deleted(call, job.id);
        goto out;
    }
    if (status != 0) {
        refuse_submission(call, status);
        goto out;
    }
    answer_submitted(call, wait, &job);
    wait = NULL;
out:
    labels_clear(&labels);
    store_job_clear(&job);
    free(inputs);
    execution_wait_free(wait);
}
