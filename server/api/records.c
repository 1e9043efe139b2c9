/*
 * records.c - what meshes, surfaces and models have in common: DELETE, with or without what needs
 * them; and PATCH of their names and tags, and those of jobs.
 *
 * Both hold to If-Match and If-None-Match of the owner's record. What If-Match names is asked for
 * again in the transaction that changes it, so that nothing comes between.
 *
 * Content belongs to its owner: what is removed is the caller's, and what others have of it stays
 * (store/erase.c). An admin says by ?owner= whose is meant where it is not the own one.
 *
 * Jobs that wait or run with what goes are canceled first. They end within milliseconds as a rule;
 * the request waits for that, up to CANCEL_SECONDS.
 */
#include "api/routes.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "api/changes.h"
#include "api/job_answers.h"
#include "api/labels.h"
#include "api/models.h"
#include "store/erase.h"
#include "store/holdings.h"
#include "store/job.h"

#define CANCEL_SECONDS 20
#define LOOK_MS 20
#define OWNERS_TOLD 5

/* By the pattern of their routes. A new kind is a row here, one of the store (erase.c), and its
   routes. */
static const struct record_kind {
    const char *pattern, *prefix, *missing;
    api_handler *get; /* answers with the record */
} kinds[] = {
    {"/v1/meshes/{id}", "mesh-", "no-such-mesh", meshes_get},
    {"/v1/volumes/{id}", "vol-", "no-such-volume", volumes_get},
    {"/v1/surfaces/{id}", "surf-", "no-such-surface", surfaces_get},
    {"/v1/models/{id}", "model-", "no-such-model", models_get},
    {"/v1/jobs/{id}", "job-", "no-such-job", jobs_get_one},
};

static const struct record_kind *kind_of(const struct api_call *call)
{
    const struct api_route *route = call->request->route;
    size_t i = 0;

    while (strcmp(kinds[i].pattern, route->pattern) != 0) {
        i++;
    }
    return &kinds[i];
}

/* ---- Whose ----------------------------------------------------------------------------------- */

static void ask_for_owner(struct api_call *call, char owners[OWNERS_TOLD][STORE_OWNER_MAX],
                          size_t count)
{
    char list[OWNERS_TOLD * (STORE_OWNER_MAX + 4) + 8] = "";

    for (size_t i = 0; i < count && i < OWNERS_TOLD; i++) {
        size_t used = strlen(list);

        (void)snprintf(list + used, sizeof list - used, "%s\"%s\"", i ? ", " : "", owners[i]);
    }
    (void)problem_respond(call, "owner-required",
                          "%s is not yours, but %zu other%s it: %s%s. Say whose you mean by "
                          "?owner=.",
                          call->parameters[0], count, count == 1 ? " has" : "s have", list,
                          count > OWNERS_TOLD ? ", .." : "");
}

/* Whose is meant. False when a problem was answered. */
static bool find_owner(struct api_call *call, const struct record_kind *kind,
                       char owner[STORE_OWNER_MAX])
{
    const struct api_caller *caller = &call->request->caller;
    char owners[OWNERS_TOLD][STORE_OWNER_MAX];
    bool refused = false;
    size_t count = 0;
    int status;

    if (query_get(call, "owner", owner, STORE_OWNER_MAX, &refused)) {
        if (caller->restricted && strcmp(owner, caller->name) != 0) {
            (void)problem_respond_store(call, STORE_NOT_FOUND, kind->missing, call->parameters[0]);
            return false;
        }
        return true;
    }
    memcpy(owner, caller->name, STORE_OWNER_MAX);
    if (refused || caller->restricted ||
        store_owner_has(call->api->config.store, owner, call->parameters[0]) == STORE_OK) {
        return !refused;
    }
    status = store_owner_names(call->api->config.store, call->parameters[0], owners, OWNERS_TOLD,
                               &count);
    if (status != 0 || count == 0) {
        (void)problem_respond_store(call, status ? status : STORE_NOT_FOUND, kind->missing,
                                    call->parameters[0]);
    } else {
        ask_for_owner(call, owners, count);
    }
    return false;
}

/* ---- Conditions ------------------------------------------------------------------------------ */

/* What If-Match and If-None-Match say of the owner's record, and what the change must still find
   there. tagged: it has a tag. False when a problem was answered. */
struct condition {
    struct store_labels_held held;
    struct store_labels seen;
    bool names; /* If-Match has tags: the change is of what they stand for, and of nothing else */
};

static bool meet_condition(struct api_call *call, const struct record_kind *kind, const char *owner,
                           bool tagged, struct condition *condition)
{
    const char *wanted = api_request_header(call->request, "If-Match");
    const char *id = call->parameters[0];
    char tag[MODEL_ETAG_MAX];
    int status;

    *condition = (struct condition){.names = wanted && !list_has_exactly(wanted, "*")};
    if (!wanted && !api_request_header(call->request, "If-None-Match")) {
        return true;
    }
    status = strncmp(id, kind->prefix, strlen(kind->prefix)) == 0
                 ? store_labels_get(call->api->config.store, owner, id, &condition->held)
                 : STORE_NOT_FOUND;
    if (status == STORE_OK && kind->get == models_get) {
        status = model_tag(call, owner, &condition->held, tag);
    } else if (status == STORE_OK) {
        labels_etag(tag, id, condition->held.name, condition->held.tags);
    }
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, kind->missing, id);
        return false;
    }
    condition->seen.name = condition->held.name;
    condition->seen.tags = condition->held.tags;
    return !respond_precondition_failed(call, tagged ? tag : NULL);
}

static const struct store_labels *seen_of(const struct condition *condition)
{
    return condition->names ? &condition->seen : NULL;
}

static void respond_relabelled(struct api_call *call)
{
    (void)problem_respond(call, "precondition-failed",
                          "Another request has changed %s meanwhile: it is another one than you "
                          "have seen.",
                          call->parameters[0]);
}

/* ---- DELETE ---------------------------------------------------------------------------------- */

/* ?cascade=: false when a problem was answered. */
static bool read_cascade(struct api_call *call, bool *cascade)
{
    struct problem_list problems = {.errors = NULL};
    char text[16];
    bool refused = false;

    *cascade = false;
    if (!query_get(call, "cascade", text, sizeof text, &refused)) {
        return !refused;
    }
    *cascade = strcmp(text, "true") == 0;
    if (!*cascade && strcmp(text, "false") != 0) {
        problem_add(&problems, "/cascade", "cascade must be true or false.");
        (void)problem_respond_list(call, "invalid-input", &problems);
        return false;
    }
    return true;
}

/* How a cohort that needs it can do without; nothing where none of those that are told does. */
static void tell_cohort(const struct store_erasure *erasure, size_t own, char *text, size_t size)
{
    for (size_t i = 0; i < own && i < STORE_ERASE_LISTED; i++) {
        if (strcmp(erasure->needed_by[i].kind, "cohort") == 0) {
            (void)snprintf(text, size,
                           " The cohort %s can stay: PATCH /v1/cohorts/%s with the member's id in "
                           "\"remove\".",
                           erasure->needed_by[i].id, erasure->needed_by[i].id);
            return;
        }
    }
}

/* The problem, with what needs it as its members. */
static void respond_in_use(struct api_call *call, const struct store_erasure *erasure)
{
    size_t own = erasure->needing - erasure->foreign;
    bool restricted = call->request->caller.restricted, one = erasure->needing == 1;
    json_t *needed = json_array(), *document;
    char detail[640], way[320] = "";

    for (size_t i = 0; i < own && i < STORE_ERASE_LISTED; i++) {
        (void)json_array_append_new(needed,
                                    json_pack("{s:s, s:s}", "kind", erasure->needed_by[i].kind,
                                              "id", erasure->needed_by[i].id));
    }
    tell_cohort(erasure, own, way, sizeof way);
    if (erasure->foreign > 0 && restricted) {
        (void)snprintf(detail, sizeof detail,
                       "%s is in use by what an administrator made of it: ask for that to be "
                       "deleted first.",
                       erasure->id);
    } else if (erasure->cascade) {
        (void)snprintf(detail, sizeof detail,
                       "%zu jobs that use %s were canceled and have not ended yet: try again.",
                       erasure->n_unended, erasure->id);
    } else {
        (void)snprintf(detail, sizeof detail,
                       "%zu other %s %s, the first of them %s %s. Delete %s first, or all with it "
                       "by ?cascade=true.%s",
                       erasure->needing, one ? "thing needs" : "things need", erasure->id,
                       own ? erasure->needed_by[0].kind : "another owner's",
                       own ? erasure->needed_by[0].id : "things", one ? "that" : "these", way);
    }
    document = problem_json("in-use", detail, call->request->path, call->request->id);
    (void)json_object_set_new(document, "neededBy", needed);
    (void)json_object_set_new(document, "neededByCount",
                              json_integer((json_int_t)(restricted ? own : erasure->needing)));
    problem_respond_document(call, document);
    if (erasure->cascade && erasure->n_unended > 0) {
        (void)api_response_header_text(call->response, "Retry-After", "1");
    }
}

/* Asks the jobs to end, and gives them a moment. */
static int cancel_jobs(struct api_call *call, const struct store_erasure *erasure)
{
    const struct timespec pause = {.tv_nsec = LOOK_MS * 1000000L};
    int status = 0;

    for (size_t i = 0; i < erasure->n_unended && i < STORE_ERASE_RUNNING && status == 0; i++) {
        struct store_job job = {0};

        status = jobs_cancel(call->api->config.jobs, erasure->unended[i], &job);
        status = status == STORE_NOT_FOUND ? 0 : status;
        store_job_clear(&job);
    }
    (void)nanosleep(&pause, NULL);
    return status;
}

/* Until it has gone, or something else than a job that can be canceled is in the way. */
static int erase(struct api_call *call, struct store_erasure *erasure)
{
    int status = store_erase(call->api->config.store, erasure);

    for (int look = 0; look < CANCEL_SECONDS * 1000 / LOOK_MS; look++) {
        bool only_jobs = status == STORE_CONFLICT && erasure->cascade && erasure->n_unended > 0 &&
                         (erasure->all || erasure->foreign == 0);

        if (!only_jobs || cancel_jobs(call, erasure) != 0) {
            break;
        }
        status = store_erase(call->api->config.store, erasure);
    }
    return status;
}

/* "mesh=1, surface=2": how much of each kind has gone. */
static void tell_erased(struct api_call *call, const struct store_erasure *erasure)
{
    char text[STORE_ERASE_KINDS * 36] = "";

    for (size_t i = 0; i < STORE_ERASE_KINDS && erasure->erased[i].count; i++) {
        size_t used = strlen(text);

        (void)snprintf(text + used, sizeof text - used, "%s%s=%zu", i ? ", " : "",
                       erasure->erased[i].kind, erasure->erased[i].count);
    }
    (void)api_response_header_text(call->response, "Srnfd-Deleted", text);
}

void records_delete(struct api_call *call)
{
    const struct record_kind *kind = kind_of(call);
    char owner[STORE_OWNER_MAX];
    struct store_erasure erasure = {
        .owner = owner, .id = call->parameters[0], .all = !call->request->caller.restricted};
    struct condition condition;
    int status = STORE_NOT_FOUND;

    if (!read_cascade(call, &erasure.cascade) || !find_owner(call, kind, owner)) {
        return;
    }
    if (!meet_condition(call, kind, owner, true, &condition)) {
        goto out;
    }
    erasure.seen = seen_of(&condition);
    /* The id of a surface at the path of meshes is none. */
    if (strncmp(erasure.id, kind->prefix, strlen(kind->prefix)) == 0) {
        status = erase(call, &erasure);
    }
    if (status == STORE_CONFLICT && erasure.relabelled) {
        respond_relabelled(call);
    } else if (status == STORE_CONFLICT) {
        respond_in_use(call, &erasure);
    } else if (status != 0) {
        (void)problem_respond_store(call, status, kind->missing, erasure.id);
    } else {
        tell_erased(call, &erasure);
        call->response->status = 204;
    }
out:
    store_labels_clear(&condition.held);
}

/* ---- PATCH ----------------------------------------------------------------------------------- */

/* The members of the body. False when a problem was answered. */
static bool read_labels(struct api_call *call, struct labels *labels)
{
    struct problem_list list = {.errors = NULL};
    json_t *body = body_json(call), *value;
    const char *name;
    char pointer[120];

    *labels = (struct labels){.tags = NULL};
    if (!body) {
        return false;
    }
    json_object_foreach(body, name, value)
    {
        if (strcmp(name, "name") != 0 && strcmp(name, "tags") != 0) {
            (void)snprintf(pointer, sizeof pointer, "/%.100s", name);
            problem_add(&list, pointer, "name and tags can be changed, and nothing else.");
        }
    }
    labels_read(body, labels, &list);
    json_decref(body);
    if (list.errors) {
        labels_clear(labels);
        (void)problem_respond_list(call, "invalid-input", &list);
        return false;
    }
    return true;
}

/* Whose job it is: there is one owner; and whether it has ended, and so a tag. False when a problem
   was answered. */
static bool find_job_owner(struct api_call *call, char owner[STORE_OWNER_MAX], bool *ended)
{
    struct store_job job = {0};
    int status = store_job_get(call->api->config.store, call->parameters[0], &job);

    if (status != 0) {
        (void)problem_respond_store(call, status, "no-such-job", call->parameters[0]);
        return false;
    }
    memcpy(owner, job.owner, STORE_OWNER_MAX);
    *ended = job_ended(&job);
    store_job_clear(&job);
    return true;
}

void records_patch(struct api_call *call)
{
    const struct record_kind *kind = kind_of(call);
    const char *id = call->parameters[0];
    char owner[STORE_OWNER_MAX];
    struct condition condition = {.names = false};
    struct labels labels;
    bool tagged = true;
    int status = STORE_NOT_FOUND;

    if (!read_labels(call, &labels)) {
        return;
    }
    if (kind->get == jobs_get_one ? !find_job_owner(call, owner, &tagged)
                                  : !find_owner(call, kind, owner)) {
        goto out;
    }
    if (!meet_condition(call, kind, owner, tagged, &condition)) {
        goto out;
    }
    labels.change.seen = seen_of(&condition);
    if (strncmp(id, kind->prefix, strlen(kind->prefix)) == 0) {
        status = store_label(call->api->config.store, owner, id, &labels.change);
    }
    if (status == STORE_CONFLICT) {
        respond_relabelled(call);
    } else if (status != 0) {
        (void)problem_respond_store(call, status, kind->missing, id);
    } else {
        if (kind->get == jobs_get_one) {
            changes_note(call->api->changes, id, owner, true);
        }
        kind->get(call);
    }
out:
    store_labels_clear(&condition.held);
    labels_clear(&labels);
}
