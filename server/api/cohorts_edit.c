/*
 * cohorts_edit.c - cohorts that are changed.
 *
 * A change reads the text of the cohort member by member, writes a new one, and replaces the old in
 * one transaction, if it is still the one that was read. Where another change came between, it is
 * done again on what there is then; with If-Match it is 412 instead, so that two who edit what they
 * have seen do not undo each other's work.
 *
 *   PATCH  adds members at the end, removes those with an id, changes what is said of those with
 *          an id, renames
 *   PUT    replaces the members by a list, as JSON or as a table with a column id
 */
#include "api/cohorts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/study_table.h"
#include "store/cohort.h"

#define ATTEMPTS 5 /* at a change that others come before */

/* Makes the new text from the old; false when a problem was answered. */
typedef bool edit_function(struct api_call *call, const void *what, const struct store_cohort *old,
                           struct cohort_text *text, char name[STORE_COHORT_NAME_MAX]);

static bool refuse_memory(struct api_call *call)
{
    (void)problem_respond(call, "out-of-memory", "The cohort does not fit into memory now.");
    return false;
}

/* What a failed replacement means. */
static void respond_failed(struct api_call *call, struct store_cohort *cohort, int status,
                           bool changed, size_t missing)
{
    if (status == STORE_CONFLICT && changed) {
        (void)problem_respond(call, "server-busy",
                              "Others change the cohort all the time; try again in a moment.");
    } else if (status == STORE_NOT_FOUND && cohort->created_ms == 0) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
    } else {
        cohort_respond_refused(call, cohort, status, missing);
    }
}

static void respond_changed(struct api_call *call, const struct store_cohort *cohort,
                            const json_t *warnings)
{
    json_t *record = cohort_record(call, cohort, true);
    char tag[120];

    cohort_tag(cohort, tag);
    if (warnings) {
        (void)json_object_set(record, "warnings", (json_t *)(uintptr_t)warnings);
    }
    (void)api_response_header(call->response, "ETag", "\"%s\"", tag);
    (void)api_response_header(call->response, "Location", "/v1/cohorts/%s", cohort->name);
    respond_json(call, 200, record);
}

/* One attempt; *again: another change came before it. */
static void attempt(struct api_call *call, edit_function *edit, const void *what, const char *owner,
                    const json_t *warnings, bool last, bool *again)
{
    struct store *store = call->api->config.store;
    struct store_cohort old, cohort = {.view = call_view(call)};
    struct cohort_text text = {.text = NULL};
    bool changed = false;
    size_t missing = 0;
    char tag[120];
    int status = store_cohort_get_as(store, owner, call->parameters[0], &old);

    *again = false;
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
        return;
    }
    cohort_tag(&old, tag);
    memcpy(cohort.name, old.name, sizeof cohort.name);
    memcpy(cohort.owner, old.owner, sizeof cohort.owner);
    if (respond_precondition_failed(call, tag) || !edit(call, what, &old, &text, cohort.name)) {
        goto out;
    }
    if (!cohort_text_finish(&text, &cohort)) {
        (void)refuse_memory(call);
        goto out;
    }
    status = store_cohort_replace(store, &old, &cohort, &changed, &missing);
    *again = status == STORE_CONFLICT && changed && !last;
    if (status == STORE_OK) {
        respond_changed(call, &cohort, warnings);
    } else if (!*again) {
        respond_failed(call, &cohort, status, changed, missing);
    }
out:
    cohort_text_clear(&text);
    store_cohort_clear(&cohort);
    store_cohort_clear(&old);
}

/* warnings: that the answer is to have; NULL: none. */
static void change(struct api_call *call, edit_function *edit, const void *what,
                   const json_t *warnings)
{
    char owner[STORE_OWNER_MAX];
    bool again = true;

    if (!cohort_find_owner(call, owner)) {
        return;
    }
    for (int i = 0; again && i < ATTEMPTS; i++) {
        attempt(call, edit, what, owner, warnings, i == ATTEMPTS - 1, &again);
    }
}

static bool check_count(const struct cohort_text *text, struct problem_list *list)
{
    if (text->count > COHORT_MEMBERS_MAX) {
        problem_add(list, "/members", "a cohort has at most %d members", COHORT_MEMBERS_MAX);
    } else if (text->count == 0 && !text->failed) {
        problem_add(list, "/members", "no member would be left; delete the cohort instead");
    }
    return !list->errors;
}

/* Ends an edit: false when a problem was answered. */
static bool conclude(struct api_call *call, struct cohort_text *text, struct problem_list *list)
{
    if (text->failed || json_memory_failed()) {
        json_decref(list->errors);
        list->errors = NULL;
        return refuse_memory(call);
    }
    if (!check_count(text, list)) {
        (void)problem_respond_list(call, "invalid-input", list);
        return false;
    }
    return true;
}

/* ---- PATCH ----------------------------------------------------------------------------------- */

static const char *const patch_names[] = {"name", "add", "remove", "change", NULL};
static const char *const change_names[] = {"id",     "label", "subject", "covariates",
                                           "mirror", "time",  "side",    NULL};

struct patch {
    const json_t *body;
    json_t *remove, *change; /* by id: the place in the list, and what is changed */
    json_t *places;          /* of the changes in their list */
    const char *name;
};

/* "change": by id. */
static void read_changes(const json_t *changes, struct patch *patch, struct problem_list *list)
{
    char pointer[64];

    for (size_t i = 0; i < json_array_size(changes); i++) {
        json_t *one = json_array_get(changes, i);
        const char *id = json_string_value(json_object_get(one, "id"));

        (void)snprintf(pointer, sizeof pointer, "/change/%zu", i);
        if (!cohort_member_id(id)) {
            problem_add(list, pointer, "must be an object with the id of a member");
        } else if (json_object_get(patch->change, id)) {
            problem_add(list, pointer, "changes the same members as another one");
        } else {
            cohort_check_names(one, change_names, pointer, list);
            (void)json_object_set(patch->change, id, one);
            (void)json_object_set_new(patch->places, id, json_integer((json_int_t)i));
        }
    }
}

static void read_patch(const json_t *body, struct patch *patch, struct problem_list *list)
{
    const json_t *remove = json_object_get(body, "remove"),
                 *change = json_object_get(body, "change");
    const json_t *name = json_object_get(body, "name"), *add = json_object_get(body, "add");
    char pointer[64];

    cohort_check_names(body, patch_names, "", list);
    if (name && !cohort_name_valid(json_string_value(name))) {
        problem_add(list, "/name", COHORT_NAME_SENTENCE);
    }
    patch->name = json_string_value(name);
    for (size_t i = 0; i < json_array_size(remove); i++) {
        const char *id = json_string_value(json_array_get(remove, i));

        (void)snprintf(pointer, sizeof pointer, "/remove/%zu", i);
        if (cohort_member_id(id)) {
            (void)json_object_set_new(patch->remove, id, json_integer((json_int_t)i));
        } else {
            problem_add(list, pointer, "must be the id of a member");
        }
    }
    read_changes(change, patch, list);
    if ((remove && !json_is_array(remove)) || (change && !json_is_array(change)) ||
        (add && !json_is_array(add))) {
        problem_add(list, "", "add, remove and change are arrays");
    }
}

/* The member with what a change says of it; null takes away. */
static json_t *changed_member(const json_t *member, json_t *change, const char *pointer,
                              struct problem_list *list)
{
    json_t *given = json_deep_copy(member), *result, *value;
    json_t *covariates = json_object_get(given, "covariates");
    const char *name;

    json_object_foreach(change, name, value)
    {
        if (strcmp(name, "covariates") != 0 || !json_is_object(value)) {
            (void)json_object_set(given, name, value);
        }
    }
    if (json_is_object(json_object_get(change, "covariates"))) {
        (void)json_object_update(covariates, json_object_get(change, "covariates"));
        json_object_foreach(json_object_get(change, "covariates"), name, value)
        {
            if (json_is_null(value)) {
                (void)json_object_del(covariates, name);
            }
        }
    }
    if (json_is_null(json_object_get(given, "mirror"))) {
        (void)json_object_del(given, "mirror");
    }
    result = cohort_read_member(given, pointer, list);
    json_decref(given);
    return result;
}

/* The pointer to where the patch names the id; places: of ids in that list. */
static void point_at(const char *list, const json_t *places, const char *id, char pointer[64])
{
    (void)snprintf(pointer, 64, "/%s/%" JSON_INTEGER_FORMAT, list,
                   json_integer_value(json_object_get(places, id)));
}

/* What the list of the patch names and no member has. */
static void note_absent(const json_t *places, const json_t *seen, const char *what,
                        struct problem_list *list)
{
    union {
        const json_t *constant;
        json_t *object;
    } of = {places};
    json_t *value;
    const char *id;
    char pointer[64];

    json_object_foreach(of.object, id, value)
    {
        if (!json_object_get(seen, id)) {
            point_at(what, places, id, pointer);
            problem_add(list, pointer, "the cohort has no member %s", id);
        }
    }
}

static bool edit_patch(struct api_call *call, const void *what, const struct store_cohort *old,
                       struct cohort_text *text, char name[STORE_COHORT_NAME_MAX])
{
    const struct patch *patch = what;
    const json_t *add = json_object_get(patch->body, "add");
    struct problem_list list = {.errors = NULL};
    const char *at = old->record, *member_text;
    json_t *seen = json_object();
    char pointer[64];
    size_t length;

    if (patch->name) {
        (void)snprintf(name, STORE_COHORT_NAME_MAX, "%s", patch->name);
    }
    while (cohort_text_next(&at, &member_text, &length)) {
        json_t *member = json_loadb(member_text, length, 0, NULL);
        const char *id = json_string_value(json_object_get(member, "id"));
        json_t *change = id ? json_object_get(patch->change, id) : NULL;
        bool removed = id && json_object_get(patch->remove, id);

        if (change || removed) {
            (void)json_object_set_new(seen, id, json_true());
        }
        if (change) {
            json_t *changed;

            point_at("change", patch->places, id, pointer);
            changed = changed_member(member, change, pointer, &list);
            json_decref(member);
            member = changed;
        }
        if (!removed) {
            cohort_text_add(text, member);
        }
        json_decref(member);
    }
    for (size_t i = 0; i < json_array_size(add); i++) {
        json_t *member;

        (void)snprintf(pointer, sizeof pointer, "/add/%zu", i);
        member = cohort_read_member(json_array_get(add, i), pointer, &list);
        cohort_text_add(text, member);
        json_decref(member);
    }
    note_absent(patch->remove, seen, "remove", &list);
    note_absent(patch->places, seen, "change", &list);
    json_decref(seen);
    return conclude(call, text, &list);
}

void cohorts_patch(struct api_call *call)
{
    struct patch patch = {
        .body = NULL, .remove = json_object(), .change = json_object(), .places = json_object()};
    struct problem_list list = {.errors = NULL};
    json_t *body = body_json(call);

    if (body) {
        patch.body = body;
        read_patch(body, &patch, &list);
        if (list.errors) {
            (void)problem_respond_list(call, "invalid-input", &list);
        } else {
            change(call, edit_patch, &patch, NULL);
        }
    }
    json_decref(patch.remove);
    json_decref(patch.change);
    json_decref(patch.places);
    json_decref(body);
}

/* ---- PUT ------------------------------------------------------------------------------------- */

bool cohort_read_members(const json_t *given, struct cohort_text *text, struct problem_list *list)
{
    size_t count = json_array_size(given);
    char pointer[64];

    if (!json_is_array(given) || count < 1 || count > COHORT_MEMBERS_MAX) {
        problem_add(list, "/members", "must be an array of 1 to %d members", COHORT_MEMBERS_MAX);
        return true;
    }
    for (size_t i = 0; i < count; i++) {
        json_t *member;

        (void)snprintf(pointer, sizeof pointer, "/members/%zu", i);
        member = cohort_read_member(json_array_get(given, i), pointer, list);
        cohort_text_add(text, member);
        json_decref(member);
    }
    return !text->failed;
}

/* The members that the body is: JSON with "members", or a table. */
struct listed {
    const json_t *members;
    const struct study_table *table; /* NULL: JSON */
};

static bool edit_listed(struct api_call *call, const void *what, const struct store_cohort *old,
                        struct cohort_text *text, char name[STORE_COHORT_NAME_MAX])
{
    const struct listed *listed = what;
    struct problem_list list = {.errors = NULL};
    char pointer[64];

    (void)old;
    (void)name;
    if (!listed->table) {
        (void)cohort_read_members(listed->members, text, &list);
        return conclude(call, text, &list);
    }
    for (size_t i = 0; i < listed->table->cells.rows; i++) {
        struct problem_list row = {.errors = NULL};
        json_t *member =
            study_table_member(listed->table, i, study_table_key(listed->table, i), &row);
        const json_t *first = json_array_get(row.errors, 0);

        if (first) {
            const char *column = json_string_value(json_object_get(first, "pointer"));
            const char *detail = json_string_value(json_object_get(first, "detail"));

            (void)snprintf(pointer, sizeof pointer, "/members/%zu%.40s", i, column ? column : "");
            problem_add(&list, pointer, "line %u: %s", listed->table->cells.lines[i + 1],
                        detail ? detail : "");
        }
        json_decref(row.errors);
        cohort_text_add(text, member);
        json_decref(member);
    }
    return conclude(call, text, &list);
}

static void put_table(struct api_call *call)
{
    const struct api_request *request = call->request;
    char problem[DELIMITED_PROBLEM_MAX];
    struct study_table table;
    const struct listed listed = {.table = &table};
    json_t *warnings;

    switch (study_table_read(request->body, request->body_size, "id", &table, problem)) {
    case DELIMITED_OK:
        warnings = json_array();
        study_table_warn(&table, warnings);
        change(call, edit_listed, &listed, warnings);
        json_decref(warnings);
        break;
    case DELIMITED_WRONG:
        (void)problem_respond(call, "invalid-input", "The table cannot be read: %s.", problem);
        break;
    case DELIMITED_NO_MEMORY:
        (void)refuse_memory(call);
    }
    study_table_clear(&table);
}

void cohorts_put_members(struct api_call *call)
{
    static const char *const names[] = {"members", NULL};
    const char *type = api_request_header(call->request, "Content-Type");
    struct problem_list list = {.errors = NULL};
    struct listed listed = {.table = NULL};
    json_t *body;

    if (type && strncasecmp(type, "text/", 5) == 0) {
        put_table(call);
        return;
    }
    body = body_json(call);
    if (!body) {
        return;
    }
    cohort_check_names(body, names, "", &list);
    listed.members = json_object_get(body, "members");
    if (list.errors) {
        (void)problem_respond_list(call, "invalid-input", &list);
    } else {
        change(call, edit_listed, &listed, NULL);
    }
    json_decref(body);
}
