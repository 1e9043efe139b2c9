/*
 * cohorts_pages.c - GET /v1/cohorts/{name}/members: the members of a cohort, page by page, or all
 * of them as CSV.
 *
 * A cursor is the place of the next member and the first digits of the cohort's digest: a page of a
 * cohort that was changed since is refused, not put together from two states.
 */
#include "api/cohorts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/json_memory.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/tables.h"
#include "store/cohort.h"

#define PAGE_DEFAULT 200
#define PAGE_MAX 10000
#define DIGEST_DIGITS 16

struct page {
    size_t first, limit; /* limit 0: all */
    char label[COHORT_TEXT_MAX + 1], subject[COHORT_TEXT_MAX + 1], side[32];
    bool by_label, by_subject, by_side;
};

/* ?cursor=: false when a problem was answered. */
static bool read_cursor(struct api_call *call, const struct store_cohort *cohort, struct page *page)
{
    char text[64], *end = NULL;
    bool refused;

    if (!query_get(call, "cursor", text, sizeof text, &refused)) {
        return !refused;
    }
    if (strlen(text) > DIGEST_DIGITS + 1 && text[DIGEST_DIGITS] == '.') {
        page->first = strtoull(text + DIGEST_DIGITS + 1, &end, 10);
    }
    if (!end || *end || end == text + DIGEST_DIGITS + 1) {
        (void)problem_respond(call, "invalid-input", "/cursor: this is no cursor of members.");
        return false;
    }
    if (strncmp(text, cohort->digest, DIGEST_DIGITS) != 0) {
        (void)problem_respond(call, "precondition-failed",
                              "The cohort was changed since the page before; begin again without a "
                              "cursor.");
        return false;
    }
    return true;
}

static bool read_query(struct api_call *call, bool csv, const struct store_cohort *cohort,
                       struct page *page)
{
    char text[24];
    long limit = csv ? 0 : PAGE_DEFAULT;
    bool refused;

    if (query_get(call, "limit", text, sizeof text, &refused) &&
        (!query_whole(text, &limit) || limit < 1 || limit > PAGE_MAX)) {
        (void)problem_respond(call, "invalid-input", "/limit: must be from 1 to %d.", PAGE_MAX);
        return false;
    }
    page->limit = (size_t)limit;
    if (refused) {
        return false;
    }
    page->by_label = query_get(call, "label", page->label, sizeof page->label, &refused);
    if (!refused) {
        page->by_subject =
            query_get(call, "subject", page->subject, sizeof page->subject, &refused);
    }
    if (!refused) {
        page->by_side = query_get(call, "side", page->side, sizeof page->side, &refused);
    }
    if (page->by_side && page->side[0] && strcmp(page->side, "left") != 0 &&
        strcmp(page->side, "right") != 0) {
        (void)problem_respond(call, "invalid-input",
                              "/side: must be left or right, or empty for members without one.");
        return false;
    }
    return !refused && read_cursor(call, cohort, page);
}

static bool is_text(const json_t *member, const char *name, bool asked, const char *wanted)
{
    const char *text = json_string_value(json_object_get(member, name));

    return !asked || strcmp(text ? text : "", wanted) == 0;
}

/* Goes on to the next member of the page (new reference); NULL at its end. */
static json_t *next_member(const struct page *page, const char **at, size_t *place)
{
    const char *text;
    size_t length;

    while (cohort_text_next(at, &text, &length)) {
        json_t *member = ++*place > page->first ? cohort_text_member(text, length) : NULL;

        if (member && is_text(member, "label", page->by_label, page->label) &&
            is_text(member, "subject", page->by_subject, page->subject) &&
            is_text(member, "side", page->by_side, page->side)) {
            return member;
        }
        json_decref(member);
    }
    return NULL;
}

static void respond_page(struct api_call *call, const struct store_cohort *cohort,
                         const struct page *page)
{
    json_t *answer = json_object(), *items = json_array(), *next = NULL;
    const char *at = cohort->record;
    size_t place = 0, last = page->first;
    json_t *member = NULL;

    while ((member = next_member(page, &at, &place)) != NULL &&
           json_array_size(items) < page->limit) {
        (void)json_array_append_new(items, member);
        last = place;
    }
    if (member) {
        char cursor[64];

        json_decref(member);
        (void)snprintf(cursor, sizeof cursor, "%.*s.%zu", DIGEST_DIGITS, cohort->digest, last);
        next = json_string(cursor);
    }
    (void)json_object_set_new(answer, "items", items);
    (void)json_object_set_new(answer, "next", next ? next : json_null());
    (void)json_object_set_new(answer, "total", json_integer((json_int_t)cohort->n_members));
    respond_json(call, 200, answer);
}

/* The names of all covariates, as keys. */
static json_t *covariate_names(const struct store_cohort *cohort, const struct page *page)
{
    json_t *names = json_object(), *member;
    const char *at = cohort->record;
    size_t place = 0;

    while ((member = next_member(page, &at, &place)) != NULL) {
        (void)json_object_update_missing(names, json_object_get(member, "covariates"));
        json_decref(member);
    }
    return names;
}

static void write_value(FILE *out, const json_t *value)
{
    if (json_is_real(value)) {
        csv_number(out, false, json_real_value(value));
    } else if (json_is_integer(value)) {
        (void)fprintf(out, ",%lld", (long long)json_integer_value(value));
    } else if (json_is_boolean(value)) {
        csv_text(out, false, json_is_true(value) ? "true" : "false");
    } else {
        csv_text(out, false, json_is_string(value) ? json_string_value(value) : "");
    }
}

static const char *const columns[] = {"id", "label", "subject", "time", "side", "mirror"};
#define COLUMNS (sizeof columns / sizeof columns[0])
#define SUBJECT_TOO "participant_id" /* what study_table.c reads as the subject as well */

/* The head of a covariate's column. One that is called as another column is, or has no name, is
   told apart: readers of CSV would take the second of two columns for the first. */
static void write_head(FILE *out, const char *name)
{
    char text[4 * COHORT_TEXT_MAX + 16];
    bool taken = !*name || strcasecmp(name, SUBJECT_TOO) == 0;

    for (size_t i = 0; i < COLUMNS; i++) {
        taken = taken || strcasecmp(name, columns[i]) == 0;
    }
    (void)snprintf(text, sizeof text, "%s%s", taken ? "covariate " : "", name);
    csv_text(out, false, text);
}

static void write_page(FILE *out, const struct store_cohort *cohort, const struct page *page)
{
    json_t *names = covariate_names(cohort, page), *member, *value;
    const char *at = cohort->record, *name;
    size_t place = 0, written = 0;

    for (size_t i = 0; i < COLUMNS; i++) {
        csv_text(out, i == 0, columns[i]);
    }
    json_object_foreach(names, name, value)
    {
        write_head(out, name);
    }
    csv_end_line(out);
    while ((page->limit == 0 || written < page->limit) &&
           (member = next_member(page, &at, &place)) != NULL) {
        csv_text(out, true, json_string_value(json_object_get(member, columns[0])));
        for (size_t i = 1; i < COLUMNS; i++) {
            write_value(out, json_object_get(member, columns[i]));
        }
        json_object_foreach(names, name, value)
        {
            write_value(out, json_object_get(json_object_get(member, "covariates"), name));
        }
        csv_end_line(out);
        json_decref(member);
        written++;
    }
    json_decref(names);
}

void cohort_write_table(FILE *out, const struct store_cohort *cohort)
{
    const struct page all = {.first = 0};

    write_page(out, cohort, &all);
}

void cohorts_members(struct api_call *call)
{
    struct store_cohort cohort;
    struct page page = {.first = 0};
    struct table_text text;
    enum table_form form;
    char owner[STORE_OWNER_MAX], tag[120];
    int status;

    if (!table_choose(call, &form) || !cohort_find_owner(call, owner)) {
        return;
    }
    status = store_cohort_get_as(call->api->config.store, owner, call->parameters[0], &cohort);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
        return;
    }
    cohort_tag(&cohort, tag);
    if (respond_not_modified(call, tag) || !read_query(call, form == TABLE_CSV, &cohort, &page)) {
        store_cohort_clear(&cohort);
        return;
    }
    if (form == TABLE_NPY) {
        (void)problem_respond(call, "not-acceptable", "Members are served as JSON or CSV.");
    } else if (form == TABLE_JSON) {
        respond_page(call, &cohort, &page);
    } else if (table_open(call, &text)) {
        write_page(text.out, &cohort, &page);
        table_respond_csv(call, &text, cohort.name);
    }
    store_cohort_clear(&cohort);
}
