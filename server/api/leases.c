/*
 * leases.c - the routes of workers: POST /v1/leases and what follows from a lease, and, for
 * administrators, GET /v1/workers.
 *
 * A request for a lease waits where there is nothing to lease, on the connection and not on a
 * thread, as executions wait for their jobs (API_WAIT_TASKS). Whoever has a lease proves it by its
 * secret, in the header Lease-Secret: without it, or when the lease is no longer the current one,
 * everything is answered with lease-lost, and the worker drops the task. A result comes with the
 * digest of its bytes (RFC 9530), is checked, and is taken once.
 *
 * Inputs are what somebody has sent, and a token goes along: nothing of it is taken or given in
 * clear text beyond this machine.
 */
#include "api/auth.h"
#include "api/respond.h"
#include "api/routes.h"

#include "build.h"
#include "jobs/tasks.h"
#include "log.h"
#include "store/task.h"
#include "text.h"

#include <math.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>

#define WAIT_MAX 30.0 /* seconds that a request for a lease may wait */
#define REASON_MAX 240
#define BAR_DIGITS ((size_t)18)
#define DIGEST_TEXT_MAX 64
#define QUOTE_BEFORE 60 /* bytes of a text before what differs */

/* ---- What holds for all ---------------------------------------------------------------------- */

static bool refuse_clear_text(struct api_call *call)
{
    if (call->request->secure || call->request->local) {
        return false;
    }
    (void)problem_respond(call, "forbidden",
                          "Workers of other machines are served over TLS alone: start the service "
                          "with --tls-certificate and --tls-key, and the worker with https.");
    return true;
}

/* By whom the lease is said to be held; the secret is "" without one. */
static struct jobs_proof proof_of(const struct api_call *call)
{
    const char *secret = api_request_header(call->request, "Lease-Secret");

    return (struct jobs_proof){.secret = secret && strlen(secret) < JOBS_SECRET_SIZE ? secret : "",
                               .owner = call->request->caller.name,
                               .job = call->request->caller.job};
}

/* Answers with the problem that a status of the engine means. */
static void respond_status(struct api_call *call, int status)
{
    if (status == STORE_CONFLICT) {
        (void)problem_respond(call, "lease-lost",
                              "This is not, or no longer, the lease of the task: it has expired, "
                              "its job has ended, or its secret is another. Drop the task.");
    } else if (status == STORE_CORRUPT) {
        (void)problem_respond(call, "invalid-result",
                              "The bytes are no result of this task; the attempt is lost.");
    } else {
        (void)problem_respond_store(call, status, "no-such-content", call->parameters[1]);
    }
}

static void respond_nothing(struct api_call *call, int status)
{
    if (status == STORE_OK) {
        call->response->status = 204;
    } else {
        respond_status(call, status);
    }
}

/* ---- Asking for a lease ---------------------------------------------------------------------- */

/* Names go into logs, tables and pages. */
static bool is_plain(const char *text)
{
    for (const char *at = text; *at; at++) {
        if (*at < ' ' || *at > '~' || strchr("<>&\"'", *at)) {
            return false;
        }
    }
    return true;
}

static bool read_text(struct api_call *call, const json_t *body, const char *member,
                      char text[JOBS_REMOTE_NAME_MAX])
{
    const char *value = json_string_value(json_object_get(body, member));
    size_t length = value ? strlen(value) : 0;

    if (length == 0 || length >= JOBS_REMOTE_NAME_MAX || !is_plain(value)) {
        (void)problem_respond(call, "invalid-input",
                              "%s must be a text of 1 to %d printable ASCII characters without "
                              "<, >, & and quotes.",
                              member, JOBS_REMOTE_NAME_MAX - 1);
        return false;
    }
    memcpy(text, value, strlen(value) + 1);
    return true;
}

/* From where on two builds are to be quoted so that the reader sees what differs. */
static size_t text_from(const char *a, const char *b)
{
    size_t same = 0;

    while (a[same] && a[same] == b[same]) {
        same++;
    }
    return same > QUOTE_BEFORE + 20 ? same - QUOTE_BEFORE : 0;
}

static void respond_mismatch(struct api_call *call, const char *host, const char *given,
                             const char *own)
{
    size_t from = text_from(given, own);

    (void)problem_respond(call, "build-mismatch",
                          "The worker on %s is of the build \"%s%.150s\", the service of "
                          "\"%s%.150s\": their results can differ in the last bits. Install the "
                          "same package on a machine of the same kind.",
                          host, from > 0 ? ".." : "", given + from, from > 0 ? ".." : "",
                          own + from);
}

/* False when a problem was answered: of the body, or because the worker computes other bits. */
static bool read_worker(struct api_call *call, const json_t *body, struct jobs_remote *remote,
                        double *wait)
{
    const char *build = json_string_value(json_object_get(body, "numericBuild"));
    const char *given = build ? build : "";
    const json_t *slots = json_object_get(body, "slots"), *seconds = json_object_get(body, "wait");
    char own[BUILD_ARITHMETIC_SIZE];

    *remote = (struct jobs_remote){.slots = (size_t)json_integer_value(slots)};
    memcpy(remote->owner, call->request->caller.name, sizeof remote->owner);
    memcpy(remote->job, call->request->caller.job, sizeof remote->job);
    if (!read_text(call, body, "worker", remote->name) ||
        !read_text(call, body, "host", remote->host) ||
        !read_text(call, body, "cpu", remote->cpu)) {
        return false;
    }
    if (!json_is_integer(slots) || remote->slots < 1 || remote->slots > 1024 ||
        !json_is_number(seconds) || !(json_number_value(seconds) >= 0.0)) {
        (void)problem_respond(call, "invalid-input",
                              "slots must be a whole number from 1 to 1024, and wait a number of "
                              "seconds.");
        return false;
    }
    *wait = remote->wait = fmin(json_number_value(seconds), WAIT_MAX);
    jobs_remote_who(remote->owner, remote->job, remote->name, remote->who);
    build_arithmetic_id(own);
    if (strcmp(given, own) != 0) {
        respond_mismatch(call, remote->host, given, own);
        return false;
    }
    return true;
}

/* JSON of a lease; its inputs go along, as base64. */
static json_t *lease_json(const struct jobs_lease *lease)
{
    size_t size =
        sodium_base64_encoded_len(lease->what.inputs.size, sodium_base64_VARIANT_ORIGINAL);
    char *inputs = malloc(size);
    json_t *contents = json_array(), *document = NULL;

    for (size_t i = 0; i < lease->what.n_contents; i++) {
        (void)json_array_append_new(contents, json_string(lease->what.contents[i].digest));
    }
    if (inputs) {
        (void)sodium_bin2base64(inputs, size, lease->what.inputs.bytes, lease->what.inputs.size,
                                sodium_base64_VARIANT_ORIGINAL);
        document =
            json_pack("{s:s, s:s, s:I, s:s, s:f, s:s, s:O}", "task", lease->task, "kind",
                      lease->kind, "attempt", (json_int_t)lease->attempt, "secret", lease->secret,
                      "expiresInSeconds", lease->seconds, "inputs", inputs, "contents", contents);
    }
    json_decref(contents);
    free(inputs);
    return document;
}

/* Tries to lease. False: there is nothing now, and nothing was answered. */
static bool answer_lease(struct api_call *call, const struct jobs_remote *remote)
{
    struct jobs_lease lease;
    int status = jobs_lease(call->api->config.jobs, remote, &lease);

    if (status == STORE_NOT_FOUND) {
        return false;
    }
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "lease-lost", "lease");
    } else {
        respond_json(call, 201, lease_json(&lease));
        (void)api_response_header_text(call->response, "Cache-Control", "no-store");
    }
    jobs_task_clear(&lease.what);
    return true;
}

void leases_create(struct api_call *call)
{
    struct jobs_remote remote, *state;
    json_t *body;
    double wait = 0.0;
    bool good;

    if (refuse_clear_text(call)) {
        return;
    }
    if (!jobs_offers_tasks(call->api->config.jobs)) {
        (void)problem_respond(call, "tasks-not-offered",
                              "The service computes its jobs by itself; with --executor workers it "
                              "offers them.");
        return;
    }
    body = body_json(call);
    good = body && read_worker(call, body, &remote, &wait);
    json_decref(body);
    if (!good || answer_lease(call, &remote)) {
        return;
    }
    state = wait > 0.0 ? malloc(sizeof *state) : NULL;
    if (!state) {
        call->response->status = 204;
        return;
    }
    *state = remote;
    (void)snprintf(call->response->wait.job_id, sizeof call->response->wait.job_id, "%s",
                   API_WAIT_TASKS);
    call->response->wait.seconds = wait;
    call->response->wait.state = state;
    call->response->wait.free_state = free;
}

void leases_resume(struct api *api, const struct api_request *request,
                   struct api_response *response)
{
    struct api_call call = {.api = api, .request = request, .response = response};
    struct jobs_remote *remote = response->wait.state;
    bool answered = !request->gone; /* a lease for nobody would be lost */

    response->wait.state = NULL; /* a problem clears the response */
    if (!answered) {
        jobs_remote_gone(api->config.jobs, remote);
        response->wait.seconds = 0;
    } else if (!auth_holds(api->auth, request->caller.account) ||
               (remote->job[0] && !jobs_pass_holds(api->config.jobs, remote->job))) {
        auth_refuse_revoked(&call);
    } else {
        answered = answer_lease(&call, remote);
    }
    if (!answered && response->wait.seconds > 0) {
        response->wait.state = remote;
        return;
    }
    response->wait.job_id[0] = '\0';
    free(remote);
    if (!answered) {
        response->status = 204;
    }
}

/* ---- With a lease ---------------------------------------------------------------------------- */

void leases_content(struct api_call *call)
{
    const struct jobs_proof proof = proof_of(call);
    struct tasks_bytes content;
    int status;

    if (refuse_clear_text(call)) {
        return;
    }
    status = jobs_lease_content(call->api->config.jobs, call->parameters[0], &proof,
                                call->parameters[1], &content);
    if (status != STORE_OK) {
        respond_status(call, status);
        return;
    }
    respond_bytes(call, 200, "application/octet-stream", content.bytes, content.size);
    (void)api_response_header_text(call->response, "Cache-Control", "no-store");
}

void leases_extend(struct api_call *call)
{
    const struct jobs_proof proof = proof_of(call);
    double seconds = 0.0;
    int status;

    if (refuse_clear_text(call)) {
        return;
    }
    status = jobs_lease_extend(call->api->config.jobs, call->parameters[0], &proof, &seconds);
    if (status != STORE_OK) {
        respond_status(call, status);
        return;
    }
    respond_json(call, 200, json_pack("{s:f}", "expiresInSeconds", seconds));
}

/* Whether the body is what its Content-Digest says; otherwise a problem was answered. */
static bool digest_holds(struct api_call *call)
{
    const struct api_request *request = call->request;
    const char *given = api_request_header(request, "Content-Digest");
    unsigned char digest[crypto_hash_sha256_BYTES];
    char text[DIGEST_TEXT_MAX], encoded[48];

    (void)crypto_hash_sha256(digest, request->body, request->body_size);
    (void)sodium_bin2base64(encoded, sizeof encoded, digest, sizeof digest,
                            sodium_base64_VARIANT_ORIGINAL);
    (void)snprintf(text, sizeof text, "sha-256=:%s:", encoded);
    if (given && strcmp(given, text) == 0) {
        return true;
    }
    (void)problem_respond(call, "digest-mismatch",
                          "Content-Digest must be that of the body as it came, %s: send the result "
                          "again.",
                          text);
    return false;
}

/* Who has made the result, by the headers of the request. False when a problem was answered: they
   are none, or the build is another, and then the attempt is lost. */
static bool read_maker(struct api_call *call, struct store_maker *maker)
{
    const struct {
        const char *name, **text;
        size_t most;
    } headers[] = {{"Worker-Host", &maker->host, JOBS_REMOTE_NAME_MAX},
                   {"Worker-CPU", &maker->cpu, JOBS_REMOTE_NAME_MAX},
                   {"Worker-Build", &maker->build, BUILD_ARITHMETIC_SIZE}};
    const struct jobs_proof proof = proof_of(call);
    char own[BUILD_ARITHMETIC_SIZE];
    int status;

    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
        const char *value = api_request_header(call->request, headers[i].name);

        if (!value || !value[0] || strlen(value) >= headers[i].most || !is_plain(value)) {
            (void)problem_respond(call, "invalid-input",
                                  "A result names who has made it: the header %s must be a text of "
                                  "1 to %zu printable ASCII characters without <, >, & and quotes.",
                                  headers[i].name, headers[i].most - 1);
            return false;
        }
        *headers[i].text = value;
    }
    build_arithmetic_id(own);
    if (strcmp(maker->build, own) == 0) {
        return true;
    }
    status = jobs_lease_give_back(call->api->config.jobs, call->parameters[0], &proof,
                                  "a result of another build", false);
    if (status == STORE_OK) {
        respond_mismatch(call, maker->host, maker->build, own);
    } else {
        respond_status(call, status);
    }
    return false;
}

void leases_result(struct api_call *call)
{
    const struct api_request *request = call->request;
    const struct jobs_proof proof = proof_of(call);
    struct store_maker maker;

    if (!refuse_clear_text(call) && read_maker(call, &maker) && digest_holds(call)) {
        respond_nothing(call, jobs_lease_finish(call->api->config.jobs, call->parameters[0], &proof,
                                                &maker, request->body, request->body_size));
    }
}

void leases_failure(struct api_call *call)
{
    json_t *body = refuse_clear_text(call) ? NULL : body_json(call);
    const char *detail = json_string_value(json_object_get(body, "detail"));
    const json_t *certain = json_object_get(body, "certain");
    const struct jobs_proof proof = proof_of(call);
    char reason[REASON_MAX];

    if (body && (!detail || !detail[0] || (certain && !json_is_boolean(certain)))) {
        (void)problem_respond(
            call, "invalid-input",
            "detail must be a sentence: what went wrong; certain, if it is there, "
            "whether any attempt would end so.");
    } else if (body) {
        (void)snprintf(reason, sizeof reason, "%s", detail);
        text_trim_cut(reason);
        LOG_WARN("task-failed", log_text("task", call->parameters[0]), log_text("detail", reason));
        respond_nothing(call, jobs_lease_give_back(call->api->config.jobs, call->parameters[0],
                                                   &proof, reason, json_is_true(certain)));
    }
    json_decref(body);
}

void leases_delete(struct api_call *call)
{
    const struct jobs_proof proof = proof_of(call);

    if (!refuse_clear_text(call)) {
        respond_nothing(call, jobs_lease_give_back(call->api->config.jobs, call->parameters[0],
                                                   &proof, NULL, false));
    }
}

/* ---- Who works ------------------------------------------------------------------------------- */

static json_t *counts_json(const struct jobs_remote_counts *of)
{
    return json_pack("{s:I, s:I, s:I}", "leased", (json_int_t)of->leased, "done",
                     (json_int_t)of->done, "lost", (json_int_t)of->lost);
}

static bool add_worker(void *user, const struct jobs_remote_state *state)
{
    const struct jobs_remote *remote = &state->remote;
    struct jobs_remote_counts all = {.leased = 0};
    json_t *kinds = json_object(), *row;

    for (size_t k = 0; tasks_kind_at(k); k++) {
        const struct jobs_remote_counts *of = &state->of[k];

        all.leased += of->leased;
        all.done += of->done;
        all.lost += of->lost;
        if (of->leased + of->done + of->lost > 0) {
            (void)json_object_set_new(kinds, tasks_kind_at(k)->name, counts_json(of));
        }
    }
    row = counts_json(&all);
    (void)json_object_update_new(
        row, json_pack("{s:s, s:s, s:s, s:s, s:I, s:b, s:b, s:o, s:o, s:o}", "worker", remote->name,
                       "host", remote->host, "cpu", remote->cpu, "token", remote->owner, "slots",
                       (json_int_t)remote->slots, "alive", state->alive, "barred", state->barred,
                       "first", json_time(state->first_ms), "last", json_time(state->last_ms),
                       "kinds", kinds));
    return json_array_append_new(user, row) == 0;
}

/* Bars as JSON: whom they hold for, why, and until when. */
static json_t *bars_json(struct jobs *jobs)
{
    struct jobs_bar *bars = malloc(JOBS_BARS_MAX * sizeof *bars);
    size_t n = bars ? jobs_bars(jobs, bars) : 0;
    json_t *list = json_array();

    for (size_t i = 0; i < n; i++) {
        json_t *row =
            json_pack("{s:I, s:s, s:s, s:b, s:s, s:o, s:o}", "bar", (json_int_t)bars[i].number,
                      "worker", bars[i].worker, "token", bars[i].token, "pilots", bars[i].pilots,
                      "why", bars[i].why, "since", json_time(bars[i].since_ms), "until",
                      json_time(bars[i].since_ms + (int64_t)(1e3 * JOBS_BAR_SECONDS)));

        if (bars[i].host[0]) {
            (void)json_object_set_new(row, "host", json_string(bars[i].host));
        }
        (void)json_array_append_new(list, row);
    }
    free(bars);
    return list;
}

void workers_list(struct api_call *call)
{
    json_t *items = json_array();

    jobs_remotes(call->api->config.jobs, add_worker, items);
    respond_json(call, 200,
                 json_pack("{s:s, s:o, s:o}", "executor",
                           call->api->config.executor ? call->api->config.executor : "local",
                           "items", items, "bars", bars_json(call->api->config.jobs)));
}

/* Of a bar that has ended, or never was, there is nothing to end. */
void workers_lift(struct api_call *call)
{
    const char *text = call->parameters[0];
    size_t digits = strspn(text, "0123456789");
    int64_t number = (int64_t)strtoll(text, NULL, 10);

    if (digits == 0 || digits > BAR_DIGITS || text[digits]) {
        (void)problem_respond(call, "no-such-bar", "A bar is a number, as /v1/workers lists them.");
        return;
    }
    if (jobs_bars_lift(call->api->config.jobs, number)) {
        LOG("bar-lifted", log_number("bar", (double)number),
            log_text("by", call->request->caller.name));
    }
    call->response->status = 204;
}
