/*
 * list_filters.c - what the query of a list asks for: ?name=, ?tag=, ?process=, ?cohort=, ?mesh=,
 * ?since=, ?until= and ?sort=. Which of them a list has its route says (routes.c); here is what
 * they may be. What cannot be is refused, with what is known where that is a list. job_filters.c
 * has what only jobs have.
 */
#include "api/lists.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api/cohorts.h"
#include "api/near.h"
#include "api/routes.h"

static bool refuse(struct api_call *call, const char *name, const char *detail)
{
    struct problem_list problems = {.errors = NULL};
    char pointer[24];

    (void)snprintf(pointer, sizeof pointer, "/%s", name);
    problem_add(&problems, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &problems);
    return false;
}

bool list_refuse_unknown(struct api_call *call, const char *name, const char *given,
                         const char *const *known)
{
    char begin[120], text[NEAR_SENTENCE_MAX];

    (void)snprintf(begin, sizeof begin, "\"%.60s\" is no known %s", given, name);
    near_sentence(text, begin, given, known);
    return refuse(call, name, text);
}

/* One parameter into text, "" where it is not given; *given is NULL then. False when a problem was
   answered. */
static bool read(struct api_call *call, const char *name, char *text, size_t size,
                 const char **given)
{
    bool refused = false;

    text[0] = '\0';
    *given = query_get(call, name, text, size, &refused) ? text : NULL;
    return !refused;
}

/* ---- Names and ids --------------------------------------------------------------------------- */

static bool read_name(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    const char *problem = NULL, *given;
    json_t *utf8;

    if (!read(call, "name", filters->name, sizeof filters->name, &given)) {
        return false;
    }
    if (given) {
        utf8 = json_string(given);
        problem = utf8 ? name_problem(given) : "must be UTF-8";
        json_decref(utf8);
    }
    page->name = given && given[0] ? given : NULL; /* the empty text is part of any name */
    return !problem || refuse(call, "name", problem);
}

static bool read_tag(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    const char *problem;

    if (!read(call, "tag", filters->tag, sizeof filters->tag, &page->tag)) {
        return false;
    }
    problem = page->tag ? label_tag_problem(page->tag) : NULL;
    return !problem || refuse(call, "tag", problem);
}

static bool read_mesh(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    if (!read(call, "mesh", filters->mesh, sizeof filters->mesh, &page->mesh)) {
        return false;
    }
    return !page->mesh || (cohort_member_id(page->mesh) && strncmp(page->mesh, "mesh-", 5) == 0) ||
           refuse(call, "mesh", "mesh must be the id of a mesh: mesh- and 32 hexadecimal digits.");
}

static bool read_cohort(struct api_call *call, struct list_filters *filters,
                        struct store_page *page)
{
    if (!read(call, "cohort", filters->cohort, sizeof filters->cohort, &page->cohort)) {
        return false;
    }
    return !page->cohort || cohort_name_valid(page->cohort) ||
           refuse(call, "cohort", "cohort must be the name of a cohort.");
}

/* ---- Words ----------------------------------------------------------------------------------- */

static bool read_process(struct api_call *call, struct list_filters *filters,
                         struct store_page *page)
{
    const char *known[API_PROCESSES_MAX];

    if (!read(call, "process", filters->process, sizeof filters->process, &page->process)) {
        return false;
    }
    api_process_names(call->api, known);
    return !page->process || api_process_find(call->api, page->process) ||
           list_refuse_unknown(call, "process", page->process, known);
}

/* By what a list is sorted: by process and status where it is filtered by them. */
static bool read_sort(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    static const struct {
        const char *word, *parameter;
        enum store_page_key key;
    } keys[] = {{"created", "sort", STORE_PAGE_CREATED},
                {"name", "name", STORE_PAGE_NAME},
                {"process", "process", STORE_PAGE_PROCESS},
                {"status", "status", STORE_PAGE_STATUS}};
    const struct api_route *route = call->request->route;
    const char *known[5] = {NULL}, *given, *word;
    size_t n = 0;

    if (!read(call, "sort", filters->sort, sizeof filters->sort, &given)) {
        return false;
    }
    if (!given) {
        (void)snprintf(filters->sort, sizeof filters->sort, "-created");
    }
    page->rising = filters->sort[0] != '-';
    word = filters->sort + !page->rising;
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if (!list_has_exactly(route->query, keys[i].parameter)) {
            continue;
        }
        known[n++] = keys[i].word;
        if (strcmp(keys[i].word, word) == 0) {
            page->key = keys[i].key;
            return true;
        }
    }
    return list_refuse_unknown(call, "sort", word, known);
}

/* ---- Times ----------------------------------------------------------------------------------- */

/* So many digits, and what ends them; *at goes on behind that. */
static bool take(const char **at, int digits, const char *ends, int *value)
{
    *value = 0;
    for (int i = 0; i < digits; i++) {
        char c = *(*at)++;

        if (c < '0' || c > '9') {
            return false;
        }
        *value = 10 * *value + (c - '0');
    }
    return !ends || (**at && strchr(ends, *(*at)++));
}

/* "Z", "+01:00", or " 01:00" as the plus sign of a query reads; minutes east. */
static bool take_zone(const char *at, int *minutes)
{
    int sign = *at == '-' ? -1 : 1, hours, rest;

    *minutes = 0;
    if (strcmp(at, "Z") == 0 || strcmp(at, "z") == 0) {
        return true;
    }
    if (!*at || !strchr("+- ", *at++) || !take(&at, 2, ":", &hours) || !take(&at, 2, NULL, &rest)) {
        return false;
    }
    *minutes = sign * (60 * hours + rest);
    return !*at && hours < 24 && rest < 60;
}

/* The part of a second behind the point, in ms. */
static const char *take_fraction(const char *at, int *ms)
{
    int unit = 100;

    *ms = 0;
    if (*at != '.') {
        return at;
    }
    for (at++; *at >= '0' && *at <= '9'; at++, unit /= 10) {
        *ms += unit * (*at - '0');
    }
    return at;
}

bool list_time(const char *text, int64_t *ms)
{
    struct tm parts = {.tm_isdst = 0}, same;
    int year, month, fraction = 0, east = 0;
    const char *at = text;
    time_t seconds;

    if (!take(&at, 4, "-", &year) || !take(&at, 2, "-", &month) ||
        !take(&at, 2, NULL, &parts.tm_mday)) {
        return false;
    }
    if (*at) {
        if (!strchr("Tt ", *at++) || !take(&at, 2, ":", &parts.tm_hour) ||
            !take(&at, 2, ":", &parts.tm_min) || !take(&at, 2, NULL, &parts.tm_sec)) {
            return false;
        }
        at = take_fraction(at, &fraction);
        if (!take_zone(at, &east)) {
            return false;
        }
    }
    parts.tm_year = year - 1900;
    parts.tm_mon = month - 1;
    same = parts;
    seconds = timegm(&same);
    if (same.tm_mon != parts.tm_mon || same.tm_mday != parts.tm_mday || parts.tm_hour > 23 ||
        parts.tm_min > 59 || parts.tm_sec > 60) {
        return false;
    }
    *ms = ((int64_t)seconds - 60 * (int64_t)east) * 1000 + fraction;
    return *ms > 0;
}

static bool read_time(struct api_call *call, const char *name, int64_t *ms)
{
    char text[48], detail[160];
    const char *given;

    if (!read(call, name, text, sizeof text, &given)) {
        return false;
    }
    if (!given || list_time(given, ms)) {
        return true;
    }
    (void)snprintf(detail, sizeof detail,
                   "%s must be a date or time of RFC 3339, such as 2026-01-31 or "
                   "2026-01-31T12:00:00Z.",
                   name);
    return refuse(call, name, detail);
}

static bool read_times(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    (void)filters;
    if (!read_time(call, "since", &page->since_ms) || !read_time(call, "until", &page->until_ms)) {
        return false;
    }
    return page->until_ms == 0 || page->since_ms < page->until_ms ||
           refuse(call, "until", "until must be later than since.");
}

bool list_filters_read(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    static bool (*const readers[])(struct api_call *, struct list_filters *,
                                   struct store_page *) = {
        read_name, read_tag, read_process, read_cohort, read_mesh, read_times, read_sort,
    };
    const struct api_route *route = call->request->route;

    for (size_t i = 0; i < sizeof readers / sizeof readers[0]; i++) {
        if (!readers[i](call, filters, page)) {
            return false;
        }
    }
    return !list_has_exactly(route->query, "processID") || job_filters_read(call, filters, page);
}
