/*
 * cohorts.c - the cohort resource: named by its user, an ordered list of meshes and surfaces with
 * what is known of them.
 *
 * The members are brought into one spelling and kept as that text (cohorts_members.c): the same
 * content sent again is the same text, and so 200 instead of 201. Another content under its name is
 * 409. What it names must exist, and stays as long as the cohort does.
 *
 * Names are each owner's own. An admin, who sees all, says whose is meant by ?owner= where it is
 * not the own one: nothing of another is given, or deleted, because it has the same name.
 */
#include "api/cohorts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/lists.h"
#include "api/routes.h"
#include "store/cohort.h"
#include "store/page.h"

static const char *const body_names[] = {"name", "members", NULL};
static const char *const copy_names[] = {"name", "from", "where", NULL};

/* ---- POST: reading --------------------------------------------------------------------------- */

/* False when a problem was answered. */
static bool read_cohort(struct api_call *call, const json_t *body, struct store_cohort *cohort)
{
    const char *name = json_string_value(json_object_get(body, "name"));
    bool copies = json_object_get(body, "from") != NULL, kept = false;
    struct problem_list list = {.errors = NULL};
    struct cohort_text text = {.text = NULL};

    cohort_check_names(body, copies ? copy_names : body_names, "", &list);
    if (cohort_name_valid(name)) {
        memcpy(cohort->name, name, strlen(name) + 1);
    } else {
        problem_add(&list, "/name", COHORT_NAME_SENTENCE);
    }
    if (copies && !cohort_read_copy(call, body, &text, &list)) {
        json_decref(list.errors);
        cohort_text_clear(&text);
        return false;
    }
    if (!copies) {
        (void)cohort_read_members(json_object_get(body, "members"), &text, &list);
    }
    kept = !list.errors && cohort_text_finish(&text, cohort);
    if (list.errors) {
        (void)problem_respond_list(call, "invalid-input", &list);
    } else if (!kept) {
        (void)problem_respond(call, "out-of-memory", "The cohort does not fit into memory now.");
    }
    cohort_text_clear(&text);
    return kept;
}

/* ---- Whose ----------------------------------------------------------------------------------- */

#define OWNERS_TOLD 5

/* Tells the owners of cohorts of that name. */
static void ask_for_owner(struct api_call *call, const char *name,
                          char owners[OWNERS_TOLD][STORE_OWNER_MAX], size_t count)
{
    char list[OWNERS_TOLD * (STORE_OWNER_MAX + 4) + 8] = "";

    for (size_t i = 0; i < count && i < OWNERS_TOLD; i++) {
        size_t used = strlen(list);

        (void)snprintf(list + used, sizeof list - used, "%s\"%s\"", i ? ", " : "", owners[i]);
    }
    (void)problem_respond(call, "owner-required",
                          "You have no cohort \"%s\", but %zu other%s: %s%s. Say whose you mean by "
                          "?owner= in a request for the cohort; a process takes your own, or the "
                          "only one of its name.",
                          name, count, count == 1 ? " has" : "s have", list,
                          count > OWNERS_TOLD ? ", .." : "");
}

bool cohort_owner(struct api_call *call, const char *name, bool any, char owner[STORE_OWNER_MAX])
{
    const struct api_caller *caller = &call->request->caller;
    char owners[OWNERS_TOLD][STORE_OWNER_MAX];
    struct store_cohort own;
    size_t count = 0;
    int status;

    memcpy(owner, caller->name, STORE_OWNER_MAX);
    if (caller->restricted) {
        return true;
    }
    status = store_cohort_get_as(call->api->config.store, owner, name, &own);
    store_cohort_clear(&own);
    if (status == STORE_NOT_FOUND) {
        status = store_cohort_owners(call->api->config.store, name, owners, OWNERS_TOLD, &count);
    }
    if (status) {
        (void)problem_respond_store(call, status, NULL, "finding the cohort");
    } else if (count == 1 && any) {
        memcpy(owner, owners[0], STORE_OWNER_MAX);
    } else if (count > 0) {
        ask_for_owner(call, name, owners, count);
    }
    return status == 0 && (count == 0 || (count == 1 && any));
}

/* The same for a request that may have ?owner=. What a caller may not see is not there. */
bool cohort_find_owner(struct api_call *call, char owner[STORE_OWNER_MAX])
{
    const struct api_caller *caller = &call->request->caller;
    const char *name = call->parameters[0];
    bool refused = false;

    if (!query_get(call, "owner", owner, STORE_OWNER_MAX, &refused)) {
        return !refused && cohort_owner(call, name, false, owner);
    }
    if (caller->restricted && strcmp(owner, caller->name) != 0) {
        (void)problem_respond_store(call, STORE_NOT_FOUND, "no-such-cohort", name);
        return false;
    }
    return true;
}

/* ---- Records --------------------------------------------------------------------------------- */

json_t *cohort_record(const struct api_call *call, const struct store_cohort *cohort,
                      bool with_members)
{
    bool own = strcmp(cohort->owner, call->request->caller.name) == 0;
    json_t *record = json_object(), *links = json_object();
    char path[STORE_COHORT_NAME_MAX + STORE_OWNER_MAX + 48];

    (void)snprintf(path, sizeof path, "/v1/cohorts/%s%s%s", cohort->name,
                   own ? "" : "?owner=", own ? "" : cohort->owner);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/cohorts/%s/members%s%s", cohort->name,
                   own ? "" : "?owner=", own ? "" : cohort->owner);
    (void)json_object_set_new(links, "members", json_string(path));
    (void)json_object_set_new(record, "name", json_string(cohort->name));
    (void)json_object_set_new(record, "owner",
                              cohort->owner[0] ? json_string(cohort->owner) : json_null());
    (void)json_object_set_new(record, "memberCount", json_integer((json_int_t)cohort->n_members));
    if (with_members && cohort->n_members <= COHORT_MEMBERS_SHOWN) {
        (void)json_object_set_new(record, "members", cohort_members(cohort));
    }
    (void)json_object_set_new(record, "created", json_time(cohort->created_ms));
    (void)json_object_set_new(record, "links", links);
    return record;
}

json_t *cohort_summary(const struct api_call *call, const struct store_cohort *cohort)
{
    return cohort_record(call, cohort, false);
}

/* ---- Handlers -------------------------------------------------------------------------------- */

void cohort_respond_refused(struct api_call *call, const struct store_cohort *cohort, int status,
                            size_t missing)
{
    struct problem_list list = {.errors = NULL};
    char pointer[64];

    if (status == STORE_CONFLICT) {
        (void)problem_respond(call, "cohort-exists",
                              "There is a cohort %s with other members: change it by PATCH "
                              "/v1/cohorts/%s, replace its members by PUT /v1/cohorts/%s/members, "
                              "delete it, or take another name.",
                              cohort->name, cohort->name, cohort->name);
    } else if (status == STORE_NOT_FOUND) {
        (void)snprintf(pointer, sizeof pointer, "/members/%zu/id", missing);
        problem_add(&list, pointer, "there is no %s", cohort->members[missing]);
        (void)problem_respond_list(call, "invalid-input", &list);
    } else {
        (void)problem_respond_store(call, status, NULL, "keeping the cohort");
    }
}

void cohorts_create(struct api_call *call)
{
    struct store_cohort cohort = {.record = NULL};
    json_t *body = body_json(call);
    bool created = false;
    size_t missing = 0;
    int status;

    if (!body || !read_cohort(call, body, &cohort)) {
        goto out;
    }
    cohort.view = call_view(call);
    cohort.bytes_max = call_owner(call).bytes_max;
    status = store_cohort_put(call->api->config.store, &cohort, &created, &missing);
    if (status) {
        cohort_respond_refused(call, &cohort, status, missing);
        goto out;
    }
    (void)api_response_header(call->response, "Location", "/v1/cohorts/%s", cohort.name);
    memcpy(cohort.owner, call->request->caller.name, sizeof cohort.owner);
    respond_json(call, created ? 201 : 200, cohort_record(call, &cohort, true));
out:
    store_cohort_clear(&cohort);
    json_decref(body);
}

/* The same name may stand for another cohort later: the tag is of the content. */
void cohort_tag(const struct store_cohort *cohort, char tag[120])
{
    (void)snprintf(tag, 120, "%s.%lld", cohort->digest, (long long)cohort->created_ms);
}

void cohorts_get(struct api_call *call)
{
    struct store_cohort cohort;
    char owner[STORE_OWNER_MAX], tag[120];
    int status;

    if (!cohort_find_owner(call, owner)) {
        return;
    }
    status = store_cohort_get_as(call->api->config.store, owner, call->parameters[0], &cohort);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
        return;
    }
    cohort_tag(&cohort, tag);
    if (!respond_not_modified(call, tag)) {
        respond_json(call, 200, cohort_record(call, &cohort, true));
    }
    store_cohort_clear(&cohort);
}

struct listing {
    struct api_call *call;
    struct list list;
};

static bool add_cohort(void *user, const struct store_cohort *cohort)
{
    struct listing *listing = user;
    char id[LIST_ID_MAX];

    (void)snprintf(id, sizeof id, "%s/%s", cohort->name, cohort->owner);
    return list_add(&listing->list, cohort_record(listing->call, cohort, false), cohort->created_ms,
                    id);
}

/* ?owner= of a list: false when a problem was answered. */
static bool filter_owner(struct api_call *call, struct store_page *page,
                         char owner[STORE_OWNER_MAX])
{
    const struct api_caller *caller = &call->request->caller;
    bool refused = false;

    if (!query_get(call, "owner", owner, STORE_OWNER_MAX, &refused)) {
        return !refused;
    }
    if (caller->restricted && strcmp(owner, caller->name) != 0) {
        (void)problem_respond(call, "forbidden",
                              "Only an admin may ask for what belongs to another owner.");
        return false;
    }
    page->owner = owner;
    return true;
}

void cohorts_list(struct api_call *call)
{
    struct listing listing = {.call = call};
    char owner[STORE_OWNER_MAX];

    if (!list_open(call, "cohorts", &listing.list)) {
        return;
    }
    if (filter_owner(call, &listing.list.page, owner)) {
        list_respond(
            call, &listing.list, "/v1/cohorts",
            store_cohort_list(call->api->config.store, &listing.list.page, add_cohort, &listing));
    } else {
        json_decref(listing.list.items);
    }
}

/* With If-Match only what has that tag is removed, whatever happens meanwhile. */
void cohorts_delete(struct api_call *call)
{
    bool matched = api_request_header(call->request, "If-Match") != NULL;
    struct store *store = call->api->config.store;
    struct store_cohort cohort = {.record = NULL};
    char owner[STORE_OWNER_MAX], tag[120];
    int status;

    if (!cohort_find_owner(call, owner)) {
        return;
    }
    status = store_cohort_get_as(store, owner, call->parameters[0], &cohort);
    if (status == 0) {
        cohort_tag(&cohort, tag);
        if (respond_precondition_failed(call, tag)) {
            goto out;
        }
        status = store_cohort_delete_as(store, owner, call->parameters[0],
                                        matched ? cohort.digest : NULL);
    }
    if (status) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
    } else {
        call->response->status = 204;
    }
out:
    store_cohort_clear(&cohort);
}
