/*
 * problem.c - problem documents (RFC 9457): one table of codes with their status and title, the
 * documents made from it, and the codes that failures of the store stand for (those of the core are
 * in compute/compute.c).
 *
 * A problem's type is "urn:srnfd:problem:" and the code, but for the three that OGC API - Processes
 * 1.0 has a type for, which ends in our code too. Its title is the table's, its detail a
 * sentence about this occurrence, its instance the path asked for (or the job that failed). Clients
 * decide by code.
 */
#include "api/handler.h"

#include "api/respond.h"
#include "text.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define BYTES_RETRY_SECONDS 3600
#define DETAIL_MAX 512
#define QUEUE_RETRY_SECONDS 5 /* until one who has a full queue may try again */

struct problem_kind {
    const char *code;
    int status;
    const char *title;
};

static const struct problem_kind kinds[] = {
    {"malformed-request", 400, "The request is malformed"},
    {"unknown-parameter", 400, "The query has a parameter that is not known here"},
    {"malformed-json", 400, "The body is not the JSON that is expected"},
    {"token-required", 401, "A token is required"},
    {"token-invalid", 401, "The token is not valid"},
    {"forbidden", 403, "The request is not allowed here"},
    {"not-found", 404, "There is nothing here"},
    {"no-such-mesh", 404, "There is no such mesh"},
    {"no-such-volume", 404, "There is no such volume"},
    {"no-such-surface", 404, "There is no such surface"},
    {"no-such-cohort", 404, "There is no such cohort"},
    {"no-such-model", 404, "There is no such model"},
    {"no-such-job", 404, "There is no such job"},
    {"no-such-content", 404, "The task has no such content"},
    {"no-such-bar", 404, "There is no such bar"},
    {"no-such-output", 404, "The job has no such output"},
    {"no-such-process", 404, "There is no such process"},
    {"method-not-allowed", 405, "The resource does not have this method"},
    {"not-acceptable", 406, "No representation fits the Accept header"},
    {"request-timeout", 408, "The request did not arrive in time"},
    {"cohort-exists", 409, "The name is taken by another cohort"},
    {"in-use", 409, "Something else needs it"},
    {"owner-required", 409, "The name stands for what others have"},
    {"result-not-ready", 409, "The job has not ended yet"},
    {"idempotency-key-in-flight", 409, "A request with this Idempotency-Key is being answered"},
    {"lease-lost", 409, "The lease of the task is not the current one"},
    {"tasks-not-offered", 409, "The service computes its jobs by itself"},
    {"build-mismatch", 409, "The worker has another numeric build"},
    {"job-dismissed", 410, "The job was dismissed"},
    {"range-not-satisfiable", 416, "The content has no such bytes"},
    {"precondition-failed", 412, "The resource is not what the request's conditions say"},
    {"body-too-large", 413, "The body is too large"},
    {"uri-too-long", 414, "The request target is too long"},
    {"unsupported-media-type", 415, "The body's media type is not supported here"},
    {"invalid-input", 422, "An input is not valid"},
    {"link-failed", 422, "What a link leads to cannot be fetched"},
    {"unparsable-mesh", 422, "The body is not a mesh that can be read"},
    {"unparsable-archive", 422, "The body is no archive or form that can be read"},
    {"import-refused", 422, "Files of the import were refused, and nothing was kept"},
    {"unparsable-volume", 422, "The body is not a label volume that can be read"},
    {"mesh-not-closed", 422, "The mesh has a boundary"},
    {"mesh-not-manifold", 422, "The mesh is not a manifold"},
    {"mesh-not-oriented", 422, "The faces are not consistently oriented"},
    {"multiple-components", 422, "The mesh has more than one component"},
    {"not-genus-zero", 422, "The mesh is not of genus zero"},
    {"mesh-degenerate", 422, "The mesh is degenerate"},
    {"not-star-shaped", 422, "The surface is not star-shaped"},
    {"mixed-routes", 422, "The surfaces came to their sphere by different routes"},
    {"mixed-scales", 422, "The surfaces are of two scales"},
    {"surface-inside-out", 422, "The surface has its normals inwards"},
    {"encoding-unfaithful", 422, "The surface is another shape than its mesh"},
    {"not-converged", 422, "The computation did not converge"},
    {"not-certified", 422, "The surface is not proved to be the only one"},
    {"landmarks-not-matched", 422, "The landmarks were not met"},
    {"numerical-failure", 422, "A numerical step broke down"},
    {"time-limit", 422, "The job took longer than is allowed"},
    {"memory-limit", 422, "The job needs more memory than is allowed"},
    {"limit-exceeded", 422, "The input exceeds a limit"},
    {"labels-within-subject", 422, "Labels differ within a subject"},
    {"idempotency-key-reused", 422, "The Idempotency-Key was used with another request"},
    {"digest-mismatch", 422, "The body is not what its digest says"},
    {"invalid-result", 422, "The body cannot be the result of this task"},
    {"quota-exceeded", 429, "A quota is used up"},
    {"headers-too-large", 431, "The header fields are too large"},
    {"internal-error", 500, "The service failed"},
    {"out-of-memory", 503, "The service is short of memory"},
    {"queue-full", 503, "The queue of jobs is full"},
    {"server-busy", 503, "The service is busy"},
    {"shutting-down", 503, "The service is shutting down"},
    {"not-ready", 503, "The service is not ready"},
    {"http-version-not-supported", 505, "The version of HTTP is not supported"},
    {"task-failed", 500, "A task of the job could not be computed by workers"},
    {"attempts-exhausted", 500, "The job was interrupted too often"},
    {"job-crashed", 500, "The service died of this job"},
    {"data-damaged", 500, "Stored data are damaged"},
    {"storage-unavailable", 503, "The storage cannot be read or written"},
    {"storage-full", 507, "There is no space left for what should be stored"},
    {"storage-quota-exceeded", 507, "The owner holds as many bytes as it may"},
};

static const struct {
    int status;
    const char *code, *detail;
} store_codes[] = {
    {STORE_FULL, "storage-full", "The data directory has no space left."},
    {STORE_IO, "storage-unavailable",
     "The data directory cannot be read or written at present; the log says why."},
    {STORE_CORRUPT, "data-damaged",
     "What is stored there is not what was put there; srnfd check tells what is damaged."},
    {STORE_CLOSED, "shutting-down", "The service is shutting down; try again in a moment."},
    {STORE_BUSY, "server-busy", "The store is busy; try again in a moment."},
    {STORE_NOMEM, "out-of-memory", "There is not enough memory for this; try again later."},
};

/* Codes whose type is the standard's. */
static const char *const standard_codes[] = {"no-such-process", "no-such-job", "result-not-ready"};

static const char *type_prefix(const char *code)
{
    for (size_t i = 0; i < sizeof standard_codes / sizeof standard_codes[0]; i++) {
        if (strcmp(standard_codes[i], code) == 0) {
            return "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/";
        }
    }
    return "urn:srnfd:problem:";
}

static const struct problem_kind *find_kind(const char *code)
{
    for (size_t i = 0; code && i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(kinds[i].code, code) == 0) {
            return &kinds[i];
        }
    }
    return NULL;
}

bool problem_known(const char *code)
{
    return find_kind(code) != NULL;
}

const char *problem_static_code(const char *code)
{
    const struct problem_kind *kind = find_kind(code);

    return kind ? kind->code : "internal-error";
}

int problem_status(const char *code)
{
    const struct problem_kind *kind = find_kind(code);

    return kind ? kind->status : 500;
}

/* Bytes that are not UTF-8 cannot stand in JSON: each becomes a question mark. */
static json_t *lenient_string(const char *text)
{
    json_t *string = json_string(text);
    char copy[DETAIL_MAX];
    size_t n = 0;

    if (string) {
        return string;
    }
    for (; text[n] && n < sizeof copy - 1; n++) {
        copy[n] = (text[n] & 0x80) ? '?' : text[n];
    }
    copy[n] = '\0';
    return json_string(copy);
}

json_t *problem_json(const char *code, const char *detail, const char *instance,
                     const char *request_id)
{
    const struct problem_kind *kind = find_kind(code);
    json_t *document = json_object();
    char type[128];

    if (!document || !code) {
        json_decref(document);
        return NULL;
    }
    (void)snprintf(type, sizeof type, "%s%s", type_prefix(code), code);
    (void)json_object_set_new(document, "type", json_string(type));
    (void)json_object_set_new(document, "title", json_string(kind ? kind->title : code));
    (void)json_object_set_new(document, "status", json_integer(problem_status(code)));
    (void)json_object_set_new(document, "code", json_string(code));
    if (detail && detail[0]) {
        (void)json_object_set_new(document, "detail", lenient_string(detail));
    }
    if (instance) {
        (void)json_object_set_new(document, "instance", lenient_string(instance));
    }
    if (request_id) {
        (void)json_object_set_new(document, "requestId", json_string(request_id));
    }
    return document;
}

/* Replaces whatever the response held by the document; a 503 says when to come back. */
static int respond_problem(struct api_response *response, json_t *document, int status)
{
    const struct problem_kind *kind =
        find_kind(json_string_value(json_object_get(document, "code")));

    api_response_clear(response);
    response_json(response, status, "application/problem+json", document);
    response->problem = kind ? kind->code : "internal-error";
    if (status == 503) {
        (void)api_response_header_text(response, "Retry-After", "5");
    }
    return status;
}

void api_problem(const struct api_request *request, struct api_response *response, int status,
                 const char *code, const char *detail)
{
    json_t *document = problem_json(code, detail, request->path, request->id);

    if (document) {
        (void)json_object_set_new(document, "status", json_integer(status));
    }
    (void)respond_problem(response, document, status);
}

int problem_respond(struct api_call *call, const char *code, const char *format, ...)
{
    char detail[DETAIL_MAX];
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    text_trim_cut(detail);
    return respond_problem(call->response,
                           problem_json(code, detail, call->request->path, call->request->id),
                           problem_status(code));
}

int problem_respond_with(struct api_call *call, const char *code, const char *detail,
                         const char *member, json_t *value)
{
    json_t *document = problem_json(code, detail, call->request->path, call->request->id);

    (void)json_object_set_new(document, member, value);
    return respond_problem(call->response, document, problem_status(code));
}

void problem_respond_document(struct api_call *call, json_t *document)
{
    const char *code = json_string_value(json_object_get(document, "code"));

    (void)respond_problem(call->response, document, problem_status(code));
}

void problem_point(const char *at, const char *name, char *pointer, size_t size)
{
    size_t used = (size_t)snprintf(pointer, size, "%s/", at);

    for (const char *c = name; *c && used + 3 < size; c++) {
        used += (size_t)snprintf(pointer + used, size - used, "%s%.1s",
                                 *c == '~'   ? "~0"
                                 : *c == '/' ? "~1"
                                             : "",
                                 *c == '~' || *c == '/' ? "" : c);
    }
}

bool problem_list_full(const struct problem_list *list)
{
    return list->count >= PROBLEMS_MAX;
}

void problem_add(struct problem_list *list, const char *pointer, const char *format, ...)
{
    char detail[DETAIL_MAX];
    va_list arguments;
    json_t *entry;

    if (++list->count > PROBLEMS_MAX) {
        return;
    }
    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    text_trim_cut(detail);
    if (!list->errors) {
        list->errors = json_array();
    }
    entry = json_object();
    (void)json_object_set_new(entry, "pointer", lenient_string(pointer));
    (void)json_object_set_new(entry, "detail", lenient_string(detail));
    (void)json_array_append_new(list->errors, entry);
}

int problem_respond_list(struct api_call *call, const char *code, struct problem_list *list)
{
    const json_t *first = json_array_get(list->errors, 0);
    const char *pointer = json_string_value(json_object_get(first, "pointer"));
    const char *sentence = json_string_value(json_object_get(first, "detail"));
    char detail[DETAIL_MAX + 128];
    json_t *document;

    /* An empty pointer is the whole body. */
    (void)snprintf(detail, sizeof detail, "%s%s%s", pointer ? pointer : "",
                   pointer && pointer[0] ? ": " : "", sentence ? sentence : "not valid");
    document = problem_json(code, detail, call->request->path, call->request->id);
    if (document && list->errors) {
        (void)json_object_set_new(document, "errors", list->errors);
        (void)json_object_set_new(document, "errorCount", json_integer((json_int_t)list->count));
        list->errors = NULL;
    }
    json_decref(list->errors);
    list->errors = NULL;
    return respond_problem(call->response, document, problem_status(code));
}

int problem_respond_store(struct api_call *call, int store_status, const char *not_found_code,
                          const char *what)
{
    if (store_status == STORE_NOT_FOUND && not_found_code) {
        const char *noun = strncmp(not_found_code, "no-such-", 8) == 0 ? not_found_code + 8 : "";

        return problem_respond(call, not_found_code, "There is no %s \"%.100s\".", noun, what);
    }
    if (store_status == STORE_QUOTA || store_status == STORE_QUEUED) {
        quota_respond(call, store_status == STORE_QUOTA ? STORE_QUOTA_BYTES : STORE_QUOTA_QUEUED,
                      QUEUE_RETRY_SECONDS);
        return call->response->status;
    }
    for (size_t i = 0; i < sizeof store_codes / sizeof store_codes[0]; i++) {
        if (store_codes[i].status == store_status) {
            return problem_respond(call, store_codes[i].code, "%s", store_codes[i].detail);
        }
    }
    return problem_respond(call, "internal-error", "The store failed at %s: %s.", what,
                           store_strerror(store_status));
}

/* ---- Quotas ---------------------------------------------------------------------------------- */

static const struct {
    const char *code, *sentence;
} quota_problems[STORE_QUOTAS] = {
    [STORE_QUOTA_QUEUED] = {"quota-exceeded", "jobs may wait"},
    [STORE_QUOTA_RUNNING] = {"quota-exceeded", "jobs may run at once"},
    [STORE_QUOTA_BYTES] = {"storage-quota-exceeded", "bytes may be held"},
    [STORE_QUOTA_REQUESTS] = {"quota-exceeded", "requests a second may be sent"},
    [STORE_QUOTA_STREAMS] = {"quota-exceeded", "answers may wait for jobs at once"},
};

void quota_respond(struct api_call *call, enum store_quota quota, int retry_seconds)
{
    const struct api_request *request = call->request;
    const char *code = quota_problems[quota].code;
    long long limit = (long long)request->caller.quotas[quota];
    json_t *document;
    char detail[160];

    (void)snprintf(detail, sizeof detail, "The quota \"%s\" is used up: %lld %s.",
                   store_quota_name(quota), limit, quota_problems[quota].sentence);
    document = problem_json(code, detail, request->path, request->id);
    (void)json_object_set_new(document, "quota", json_string(store_quota_name(quota)));
    (void)json_object_set_new(document, "limit", json_integer(limit));
    api_response_clear(call->response);
    response_json(call->response, problem_status(code), "application/problem+json", document);
    (void)api_response_header(call->response, "Retry-After", "%d",
                              quota == STORE_QUOTA_BYTES ? BYTES_RETRY_SECONDS
                              : retry_seconds > 1        ? retry_seconds
                                                         : 1);
}
