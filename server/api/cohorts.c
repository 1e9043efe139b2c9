/*
 * cohorts.c - the cohort resource: named by its user, an ordered list of meshes and surfaces with
 * what is known of them.
 *
 * The members are brought into one spelling (every member has id, label, subject and covariates,
 * and mirror only where it is true, so that texts kept before there was a mirror stay what they
 * are; keys sorted) and kept as that text: the same content sent again is the same text, and so 200
 * instead of 201. A cohort does not change; another content under its name is 409. What it names
 * must exist, and stays as long as the cohort does.
 *
 * Names are each owner's own. An admin, who sees all, says whose is meant by ?owner= where it is
 * not the own one: nothing of another is given, or deleted, because it has the same name.
 */
#include "api/cohorts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/routes.h"
#include "store/cohort.h"

#define POINTER_MAX 200

static const char *const body_names[] = {"name", "members", NULL};
static const char *const member_names[] = {"id", "label", "subject", "covariates", "mirror", NULL};

bool cohort_name_valid(const char *name)
{
    size_t length = name ? strlen(name) : 0;

    return length > 0 && length < STORE_COHORT_NAME_MAX && strcmp(name, ".") != 0 &&
           strcmp(name, "..") != 0 &&
           strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") ==
               length;
}

bool cohort_member_id(const char *id)
{
    bool known = id && (strncmp(id, "mesh-", 5) == 0 || strncmp(id, "surf-", 5) == 0);

    return known && strlen(id) == 37 && strspn(id + 5, "0123456789abcdef") == 32;
}

json_t *cohort_members(const struct store_cohort *cohort)
{
    json_t *members = json_loads(cohort->record ? cohort->record : "[]", 0, NULL);

    if (!json_is_array(members)) {
        json_decref(members);
        return NULL;
    }
    for (size_t i = 0; i < json_array_size(members); i++) {
        json_t *member = json_array_get(members, i);

        if (!json_object_get(member, "mirror")) {
            (void)json_object_set_new(member, "mirror", json_false());
        }
    }
    return members;
}

/* ---- POST: reading --------------------------------------------------------------------------- */

static void check_names(const json_t *value, const char *const *names, const char *pointer,
                        struct problem_list *list)
{
    json_t *object = (json_t *)(uintptr_t)value;
    char text[POINTER_MAX];

    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        size_t i = 0;
        while (names[i] && strcmp(names[i], json_object_iter_key(at)) != 0) {
            i++;
        }
        if (!names[i]) {
            (void)snprintf(text, sizeof text, "%s/%.80s", pointer, json_object_iter_key(at));
            problem_add(list, text, "there is no such member here");
        }
    }
}

static bool is_short_text(const json_t *value)
{
    return json_is_string(value) && json_string_length(value) <= COHORT_TEXT_MAX &&
           strlen(json_string_value(value)) == json_string_length(value);
}

/* label or subject: a text or nothing. */
static void read_text(const json_t *member, const char *name, const char *pointer, json_t *out,
                      struct problem_list *list)
{
    json_t *value = json_object_get(member, name);
    char text[POINTER_MAX];

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(out, name, json_null());
    } else if (is_short_text(value)) {
        (void)json_object_set(out, name, value);
    } else {
        (void)snprintf(text, sizeof text, "%s/%s", pointer, name);
        problem_add(list, text, "must be a text of at most %d bytes", COHORT_TEXT_MAX);
    }
}

static void read_covariates(const json_t *member, const char *pointer, json_t *out,
                            struct problem_list *list)
{
    json_t *value = json_object_get(member, "covariates"), *one;
    char text[POINTER_MAX];
    const char *name;

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(out, "covariates", json_object());
        return;
    }
    (void)snprintf(text, sizeof text, "%s/covariates", pointer);
    if (!json_is_object(value) || json_object_size(value) > COHORT_COVARIATES_MAX) {
        problem_add(list, text, "must be an object of at most %d members", COHORT_COVARIATES_MAX);
        return;
    }
    json_object_foreach(value, name, one)
    {
        if (strlen(name) > COHORT_TEXT_MAX || !(json_is_number(one) || json_is_boolean(one) ||
                                                json_is_null(one) || is_short_text(one))) {
            (void)snprintf(text, sizeof text, "%s/covariates/%.80s", pointer, name);
            problem_add(list, text,
                        "must be a number, true, false, null or a text of at most %d bytes",
                        COHORT_TEXT_MAX);
        }
    }
    (void)json_object_set(out, "covariates", value);
}

static void read_mirror(const json_t *member, const char *pointer, json_t *out,
                        struct problem_list *list)
{
    json_t *value = json_object_get(member, "mirror");
    char text[POINTER_MAX];

    if (value && !json_is_boolean(value)) {
        (void)snprintf(text, sizeof text, "%s/mirror", pointer);
        problem_add(list, text, "must be true or false");
    } else if (json_is_true(value)) {
        (void)json_object_set_new(out, "mirror", json_true());
    }
}

/* One member in its canonical spelling (new reference); its id goes into the cohort. */
static json_t *read_member(const json_t *member, size_t index, char id[STORE_ID_MAX],
                           struct problem_list *list)
{
    json_t *out = json_object();
    const char *text = json_string_value(json_object_get(member, "id"));
    char pointer[64], at[POINTER_MAX];

    (void)snprintf(pointer, sizeof pointer, "/members/%zu", index);
    if (!json_is_object(member)) {
        problem_add(list, pointer, "must be an object with the id of a mesh or surface");
        return out;
    }
    check_names(member, member_names, pointer, list);
    if (cohort_member_id(text)) {
        memcpy(id, text, strlen(text) + 1);
        (void)json_object_set_new(out, "id", json_string(text));
    } else {
        (void)snprintf(at, sizeof at, "%s/id", pointer);
        problem_add(list, at,
                    "must be the id of a mesh or surface: mesh- or surf- and 32 hexadecimal "
                    "digits");
    }
    read_text(member, "label", pointer, out, list);
    read_text(member, "subject", pointer, out, list);
    read_covariates(member, pointer, out, list);
    read_mirror(member, pointer, out, list);
    return out;
}

static bool read_members(const json_t *given, struct store_cohort *cohort,
                         struct problem_list *list)
{
    size_t count = json_array_size(given);
    json_t *members;

    if (!json_is_array(given) || count < 1 || count > COHORT_MEMBERS_MAX) {
        problem_add(list, "/members", "must be an array of 1 to %d members", COHORT_MEMBERS_MAX);
        return true;
    }
    cohort->members = calloc(count, sizeof *cohort->members);
    cohort->n_members = count;
    members = json_array();
    for (size_t i = 0; cohort->members && i < count; i++) {
        (void)json_array_append_new(
            members, read_member(json_array_get(given, i), i, cohort->members[i], list));
    }
    cohort->record =
        json_memory_dumps(members, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    json_decref(members);
    return cohort->members && cohort->record;
}

/* False when a problem was answered. */
static bool read_cohort(struct api_call *call, const json_t *body, struct store_cohort *cohort)
{
    const char *name = json_string_value(json_object_get(body, "name"));
    struct problem_list list = {.errors = NULL};

    check_names(body, body_names, "", &list);
    if (cohort_name_valid(name)) {
        memcpy(cohort->name, name, strlen(name) + 1);
    } else {
        problem_add(&list, "/name",
                    "must be 1 to 100 letters, digits, dots, hyphens or underscores, and not . or "
                    "..");
    }
    if (!read_members(json_object_get(body, "members"), cohort, &list)) {
        json_decref(list.errors);
        (void)problem_respond(call, "out-of-memory", "The cohort does not fit into memory now.");
        return false;
    }
    if (list.errors) {
        (void)problem_respond_list(call, "invalid-input", &list);
        return false;
    }
    return true;
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
static bool find_owner(struct api_call *call, char owner[STORE_OWNER_MAX])
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

static json_t *cohort_record(const struct api_call *call, const struct store_cohort *cohort,
                             bool with_members)
{
    bool own = strcmp(cohort->owner, call->request->caller.name) == 0;
    json_t *record = json_object(), *links = json_object();
    char path[STORE_COHORT_NAME_MAX + STORE_OWNER_MAX + 40];

    (void)snprintf(path, sizeof path, "/v1/cohorts/%s%s%s", cohort->name,
                   own ? "" : "?owner=", own ? "" : cohort->owner);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)json_object_set_new(record, "name", json_string(cohort->name));
    (void)json_object_set_new(record, "owner",
                              cohort->owner[0] ? json_string(cohort->owner) : json_null());
    (void)json_object_set_new(record, "memberCount", json_integer((json_int_t)cohort->n_members));
    if (with_members) {
        (void)json_object_set_new(record, "members", cohort_members(cohort));
    }
    (void)json_object_set_new(record, "created", json_time(cohort->created_ms));
    (void)json_object_set_new(record, "links", links);
    return record;
}

/* ---- Handlers -------------------------------------------------------------------------------- */

static void answer_refused(struct api_call *call, const struct store_cohort *cohort, int status,
                           size_t missing)
{
    struct problem_list list = {.errors = NULL};
    char pointer[64];

    if (status == STORE_CONFLICT) {
        (void)problem_respond(call, "cohort-exists",
                              "There is a cohort %s with other members; delete it first, or take "
                              "another name.",
                              cohort->name);
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
        answer_refused(call, &cohort, status, missing);
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
static void cohort_tag(const struct store_cohort *cohort, char tag[120])
{
    (void)snprintf(tag, 120, "%s.%lld", cohort->digest, (long long)cohort->created_ms);
}

void cohorts_get(struct api_call *call)
{
    struct store_cohort cohort;
    char owner[STORE_OWNER_MAX], tag[120];
    int status;

    if (!find_owner(call, owner)) {
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

    return list_add(&listing->list, cohort_record(listing->call, cohort, false), cohort->created_ms,
                    cohort->name);
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

/* A cohort never changes; one of another content may only take its name between this look and the
   deletion when it was deleted by somebody else meanwhile. */
void cohorts_delete(struct api_call *call)
{
    struct store *store = call->api->config.store;
    struct store_cohort cohort;
    char owner[STORE_OWNER_MAX], tag[120];
    bool refused = false;
    int status;

    if (!find_owner(call, owner)) {
        return;
    }
    status = store_cohort_get_as(store, owner, call->parameters[0], &cohort);
    if (status == 0) {
        cohort_tag(&cohort, tag);
        refused = respond_precondition_failed(call, tag);
        store_cohort_clear(&cohort);
    }
    if (refused) {
        return;
    }
    if (status == 0) {
        status = store_cohort_delete_as(store, owner, call->parameters[0]);
    }
    if (status) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
    } else {
        call->response->status = 204;
    }
}
