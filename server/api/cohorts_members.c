/*
 * cohorts_members.c - the members of a cohort: what may be said of them, and the one text that they
 * are kept as.
 *
 * The canonical text is a JSON array of objects with sorted keys and no spaces. Every member has
 * id, label, subject and covariates; mirror, time and side stand only where they say something, so
 * that texts kept before there were these stay what they are. A cohort of 100,000 members is some
 * tens of MiB of it: the text is made member by member, and read so, that no document of all
 * members is needed.
 */
#include "api/cohorts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "store/cohort.h"

#define POINTER_MAX 200

static const char *const member_names[] = {"id",     "label", "subject", "covariates",
                                           "mirror", "time",  "side",    NULL};

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

/* ---- Reading --------------------------------------------------------------------------------- */

void cohort_check_names(const json_t *value, const char *const *names, const char *pointer,
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

bool cohort_says_nothing(const json_t *value)
{
    const char *text = json_string_value(value);

    return !value || json_is_null(value) ||
           (text && strlen(text) == json_string_length(value) &&
            strspn(text, " \t\r\n") == json_string_length(value));
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

    if (cohort_says_nothing(value)) {
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
    json_t *value = json_object_get(member, "covariates"), *one, *kept;
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
    kept = json_object();
    json_object_foreach(value, name, one)
    {
        (void)json_object_set(kept, name, cohort_says_nothing(one) ? json_null() : one);
        if (strlen(name) > COHORT_TEXT_MAX || !(json_is_number(one) || json_is_boolean(one) ||
                                                json_is_null(one) || is_short_text(one))) {
            (void)snprintf(text, sizeof text, "%s/covariates/%.80s", pointer, name);
            problem_add(list, text,
                        "must be a number, true, false, null or a text of at most %d bytes",
                        COHORT_TEXT_MAX);
        }
    }
    (void)json_object_set_new(out, "covariates", kept);
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

/* When, of members of one subject that were seen several times. */
static void read_time(const json_t *member, const char *pointer, json_t *out,
                      struct problem_list *list)
{
    json_t *value = json_object_get(member, "time");
    char text[POINTER_MAX];

    if (json_is_number(value) && isfinite(json_number_value(value))) {
        (void)json_object_set(out, "time", value);
    } else if (value && !json_is_null(value)) {
        (void)snprintf(text, sizeof text, "%s/time", pointer);
        if (json_is_string(value)) {
            problem_add(list, text, "must be a number, in the unit of your choice, not \"%.40s\"",
                        json_string_value(value));
        } else {
            problem_add(list, text, "must be a number, in the unit of your choice");
        }
    }
}

static void read_side(const json_t *member, const char *pointer, json_t *out,
                      struct problem_list *list)
{
    json_t *value = json_object_get(member, "side");
    const char *side = json_string_value(value);
    char text[POINTER_MAX];

    if (side && (strcmp(side, "left") == 0 || strcmp(side, "right") == 0)) {
        (void)json_object_set(out, "side", value);
    } else if (value && !json_is_null(value)) {
        (void)snprintf(text, sizeof text, "%s/side", pointer);
        problem_add(list, text, "must be \"left\" or \"right\"");
    }
}

json_t *cohort_read_member(const json_t *member, const char *pointer, struct problem_list *list)
{
    json_t *out = json_object();
    const char *text = json_string_value(json_object_get(member, "id"));
    char at[POINTER_MAX];

    if (!json_is_object(member)) {
        problem_add(list, pointer, "must be an object with the id of a mesh or surface");
        return out;
    }
    cohort_check_names(member, member_names, pointer, list);
    if (cohort_member_id(text)) {
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
    read_time(member, pointer, out, list);
    read_side(member, pointer, out, list);
    return out;
}

/* ---- Writing the text ------------------------------------------------------------------------ */

/* Room for `more` bytes after those that are used. */
static bool reserve(struct cohort_text *text, size_t more)
{
    size_t capacity = text->capacity ? text->capacity : 4096;
    char *grown;

    while (capacity - text->used < more) {
        capacity *= 2;
    }
    if (capacity > text->capacity) {
        grown = realloc(text->text, capacity);
        if (!grown) {
            return false;
        }
        text->text = grown;
        text->capacity = capacity;
    }
    return true;
}

static bool reserve_id(struct cohort_text *text)
{
    size_t capacity = text->id_capacity ? 2 * text->id_capacity : 64;
    char(*grown)[STORE_ID_MAX];

    if (text->count < text->id_capacity) {
        return true;
    }
    grown = reallocarray(text->ids, capacity, sizeof *text->ids);
    if (grown) {
        text->ids = grown;
        text->id_capacity = capacity;
    }
    return grown != NULL;
}

void cohort_text_add(struct cohort_text *text, const json_t *member)
{
    const char *id = json_string_value(json_object_get(member, "id"));
    char *one = json_memory_dumps(member, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    size_t length = one ? strlen(one) : 0;

    if (!one || !reserve(text, length + 3) || !reserve_id(text)) {
        text->failed = true;
    } else {
        text->text[text->used] = text->count ? ',' : '[';
        memcpy(text->text + text->used + 1, one, length + 1);
        text->used += length + 1;
        (void)snprintf(text->ids[text->count], STORE_ID_MAX, "%s", id ? id : "");
        text->count++;
    }
    free(one);
}

bool cohort_text_finish(struct cohort_text *text, struct store_cohort *cohort)
{
    if (text->failed || text->count == 0) {
        cohort_text_clear(text);
        return false;
    }
    memcpy(text->text + text->used, "]", 2);
    cohort->record = text->text;
    cohort->members = text->ids;
    cohort->n_members = text->count;
    *text = (struct cohort_text){.text = NULL};
    return true;
}

void cohort_text_clear(struct cohort_text *text)
{
    free(text->text);
    free(text->ids);
    *text = (struct cohort_text){.text = NULL};
}

/* ---- Reading the text ------------------------------------------------------------------------ */

bool cohort_text_next(const char **at, const char **member, size_t *length)
{
    const char *begin = *at + (**at == '[' || **at == ','), *end = begin;
    bool quoted = false;
    size_t depth = 0;

    for (; *end && (depth > 0 || quoted || (*end != ',' && *end != ']')); end++) {
        if (quoted && *end == '\\' && end[1]) {
            end++;
        } else if (*end == '"') {
            quoted = !quoted;
        } else if (!quoted) {
            depth += *end == '{' || *end == '[';
            depth -= (*end == '}' || *end == ']') && depth > 0;
        }
    }
    *member = begin;
    *length = (size_t)(end - begin);
    *at = end;
    return *length > 0;
}

json_t *cohort_text_member(const char *text, size_t length)
{
    static const char *const optional[] = {"time", "side"};
    json_t *member = json_loadb(text, length, 0, NULL);

    if (!json_is_object(member)) {
        json_decref(member);
        return NULL;
    }
    if (!json_object_get(member, "mirror")) {
        (void)json_object_set_new(member, "mirror", json_false());
    }
    for (size_t i = 0; i < sizeof optional / sizeof optional[0]; i++) {
        if (!json_object_get(member, optional[i])) {
            (void)json_object_set_new(member, optional[i], json_null());
        }
    }
    return member;
}

void cohort_list_names(const json_t *names, char *text, size_t size)
{
    json_t *object = (json_t *)(uintptr_t)names;
    size_t used = 0;

    text[0] = '\0';
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        int more = snprintf(text + used, size - used, "%s\"%.40s\"", used ? ", " : "",
                            json_object_iter_key(at));

        if (more < 0 || (size_t)more >= size - used) {
            text[used] = '\0';
            break;
        }
        used += (size_t)more;
    }
}

json_t *cohort_members(const struct store_cohort *cohort)
{
    const char *at = cohort->record ? cohort->record : "[]", *text;
    json_t *members = json_array();
    size_t length;

    while (members && cohort_text_next(&at, &text, &length)) {
        json_t *member = cohort_text_member(text, length);

        if (!member) {
            json_decref(members);
            return NULL;
        }
        (void)json_array_append_new(members, member);
    }
    return members;
}
