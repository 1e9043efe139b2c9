/*
 * cohorts_copy.c - POST /v1/cohorts with "from": a copy of another cohort, of all its members or of
 * those that "where" describes.
 *
 * What "where" says is checked before any member is looked at: a condition that means nothing would
 * otherwise hold for everybody, or for nobody, without a word.
 */
#include "api/cohorts.h"

#include <stdio.h>
#include <string.h>

#include "api/routes.h"
#include "store/cohort.h"

#define NAMES_SEEN 64 /* covariates that a problem may name */
#define NAMES_SHOWN 400
#define POINTER_MAX 200

static const char *const where_names[] = {"label", "subject", "side", "time", "covariates", NULL};

/* ---- What "where" says ----------------------------------------------------------------------- */

/* What a member can say, and so what may be asked for. */
enum condition { OF_TEXT, OF_SIDE, OF_NUMBER, OF_ANY };

static const char *const condition_sentences[] = {
    [OF_TEXT] = "must be a text or null, or an array of them",
    [OF_SIDE] = "must be \"left\", \"right\" or null, or an array of them",
    [OF_NUMBER] = "must be a number, a range {\"min\", \"max\"} or null, or an array of them",
    [OF_ANY] = ("must be a number, true, false, a text, a range {\"min\", \"max\"} or null, or an "
                "array of them"),
};

/* {min, max}: one of them at least, and numbers. */
static void check_range(json_t *range, const char *pointer, struct problem_list *list)
{
    char text[POINTER_MAX];
    const char *name;
    json_t *bound;

    if (json_object_size(range) == 0) {
        problem_add(list, pointer, "is an empty range: give \"min\", \"max\" or both");
    }
    json_object_foreach(range, name, bound)
    {
        (void)snprintf(text, sizeof text, "%.120s/%.40s", pointer, name);
        if (strcmp(name, "min") != 0 && strcmp(name, "max") != 0) {
            problem_add(list, text, "a range has \"min\" and \"max\", and nothing else");
        } else if (!json_is_number(bound)) {
            problem_add(list, text, "must be a number");
        }
    }
}

static bool is_side(const json_t *value)
{
    const char *side = json_string_value(value);

    return side && (strcmp(side, "left") == 0 || strcmp(side, "right") == 0);
}

/* One value, or one of those in an array. */
static void check_value(json_t *value, enum condition condition, const char *pointer,
                        struct problem_list *list)
{
    bool ranges = condition == OF_NUMBER || condition == OF_ANY;
    bool good = json_is_null(value) || (ranges && json_is_number(value)) ||
                (condition == OF_SIDE && is_side(value)) ||
                (condition == OF_TEXT && json_is_string(value)) ||
                (condition == OF_ANY && (json_is_string(value) || json_is_boolean(value)));

    if (ranges && json_is_object(value)) {
        check_range(value, pointer, list);
    } else if (!good) {
        problem_add(list, pointer, "%s", condition_sentences[condition]);
    }
}

static void check_condition(json_t *wanted, enum condition condition, const char *pointer,
                            struct problem_list *list)
{
    char text[POINTER_MAX];

    if (!json_is_array(wanted)) {
        check_value(wanted, condition, pointer, list);
        return;
    }
    for (size_t i = 0; i < json_array_size(wanted); i++) {
        (void)snprintf(text, sizeof text, "%.160s/%zu", pointer, i);
        check_value(json_array_get(wanted, i), condition, text, list);
    }
}

static void check_where(json_t *where, struct problem_list *list)
{
    static const enum condition conditions[] = {OF_TEXT, OF_TEXT, OF_SIDE, OF_NUMBER};
    json_t *covariates = json_object_get(where, "covariates"), *wanted;
    char pointer[POINTER_MAX];
    const char *name;

    cohort_check_names(where, where_names, "/where", list);
    for (size_t i = 0; i < sizeof conditions / sizeof conditions[0]; i++) {
        wanted = json_object_get(where, where_names[i]);
        (void)snprintf(pointer, sizeof pointer, "/where/%s", where_names[i]);
        if (wanted) {
            check_condition(wanted, conditions[i], pointer, list);
        }
    }
    if (covariates && !json_is_object(covariates)) {
        problem_add(list, "/where/covariates", "must be an object");
    }
    json_object_foreach(covariates, name, wanted)
    {
        (void)snprintf(pointer, sizeof pointer, "/where/covariates/%.80s", name);
        check_condition(wanted, OF_ANY, pointer, list);
    }
}

/* ---- The members ----------------------------------------------------------------------------- */

static bool equal(const json_t *value, const json_t *wanted)
{
    if (json_is_number(value) && json_is_number(wanted)) {
        return json_number_value(value) >= json_number_value(wanted) &&
               json_number_value(value) <= json_number_value(wanted);
    }
    return json_equal(value, wanted);
}

/* Whether a value is the one that is wanted, or one of them, or within {min, max}. null is what is
   not said. */
static bool fits(const json_t *value, const json_t *wanted)
{
    const json_t *low = json_object_get(wanted, "min"), *high = json_object_get(wanted, "max");

    if (json_is_object(wanted)) {
        return json_is_number(value) &&
               (!low || json_number_value(value) >= json_number_value(low)) &&
               (!high || json_number_value(value) <= json_number_value(high));
    }
    for (size_t i = 0; i < json_array_size(wanted); i++) {
        if (fits(value, json_array_get(wanted, i))) {
            return true;
        }
    }
    return !json_is_array(wanted) && (value ? equal(value, wanted) : json_is_null(wanted));
}

static bool matches(const json_t *member, json_t *where)
{
    json_t *covariates = json_object_get(where, "covariates"), *wanted;
    const char *name;

    json_object_foreach(where, name, wanted)
    {
        if (strcmp(name, "covariates") != 0 && !fits(json_object_get(member, name), wanted)) {
            return false;
        }
    }
    json_object_foreach(covariates, name, wanted)
    {
        if (!fits(json_object_get(json_object_get(member, "covariates"), name), wanted)) {
            return false;
        }
    }
    return true;
}

/* Notes the covariates that "where" names and no member has, and those that there are. */
static void note_missing(const char *cohort, json_t *missing, const json_t *seen,
                         struct problem_list *list)
{
    char pointer[POINTER_MAX], there[NAMES_SHOWN];
    const char *name;
    json_t *value;

    cohort_list_names(seen, there, sizeof there);
    json_object_foreach(missing, name, value)
    {
        (void)snprintf(pointer, sizeof pointer, "/where/covariates/%.80s", name);
        problem_add(list, pointer, "no member of %s has a covariate \"%.60s\"; %s%s", cohort, name,
                    there[0] ? "there are " : "it has none", there);
    }
}

static void copy_members(const struct store_cohort *from, json_t *where, struct cohort_text *text,
                         struct problem_list *list)
{
    json_t *missing = json_object(), *seen = json_object(), *value;
    const char *at = from->record, *member_text, *name;
    size_t length;

    (void)json_object_update(missing, json_object_get(where, "covariates"));
    while (cohort_text_next(&at, &member_text, &length)) {
        json_t *member = json_loadb(member_text, length, 0, NULL);
        json_t *covariates = json_object_get(member, "covariates");

        json_object_foreach(covariates, name, value)
        {
            (void)json_object_del(missing, name);
            if (json_object_size(seen) < NAMES_SEEN) {
                (void)json_object_set(seen, name, value);
            }
        }
        if (matches(member, where)) {
            cohort_text_add(text, member);
        }
        json_decref(member);
    }
    if (json_object_size(missing) > 0) {
        note_missing(from->name, missing, seen, list);
    } else if (text->count == 0 && !text->failed) {
        problem_add(list, "/where", "no member of %s is like this", from->name);
    }
    json_decref(missing);
    json_decref(seen);
}

bool cohort_read_copy(struct api_call *call, const json_t *body, struct cohort_text *text,
                      struct problem_list *list)
{
    const char *name = json_string_value(json_object_get(body, "from"));
    json_t *where = json_object_get(body, "where");
    struct store_cohort from;
    char owner[STORE_OWNER_MAX];
    int status;

    if (!cohort_name_valid(name)) {
        problem_add(list, "/from", "must be the name of a cohort");
        return true;
    }
    if (where && !json_is_object(where)) {
        problem_add(list, "/where", "must be an object");
        return true;
    }
    check_where(where, list);
    if (!cohort_owner(call, name, true, owner)) {
        return false;
    }
    status = store_cohort_get_as(call->api->config.store, owner, name, &from);
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "no-such-cohort", name);
        return false;
    }
    if (!list->errors) {
        copy_members(&from, where, text, list);
    }
    store_cohort_clear(&from);
    return true;
}
