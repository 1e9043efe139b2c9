/*
 * lists.c - pages of a collection, newest first where nothing else is asked for, and the cursors
 * between them.
 *
 * A cursor is the text "kind:order:id:key:check" in hexadecimal: the last item that the client has
 * seen, by its id and by what the list is sorted by, and eight digits of a SHA-256 over the rest.
 * So a cursor of another list or order, a mistyped or an invented one is told from ours instead of
 * answering a page from nowhere. It is no secret and grants nothing. A page reads one row more than
 * was asked for, which says whether there is a next one.
 */
#include "api/respond.h"

#include "api/links.h"
#include "api/lists.h"
#include "api/routes.h"
#include "store/cohort.h"
#include "store/digest.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LIMIT_DEFAULT 50
#define LIMIT_MAX 200
#define CHECK_DIGITS 8
#define CURSOR_TEXT (NAME_SIZE + LIST_ID_MAX + 64)
#define CURSOR_MAX (2 * CURSOR_TEXT)

static void cursor_check(const char *text, size_t length, char check[CHECK_DIGITS + 1])
{
    char hex[65];

    store_sha256_hex(hex, text, length);
    memcpy(check, hex, CHECK_DIGITS);
    check[CHECK_DIGITS] = '\0';
}

/* What the list is sorted by, of the last item; buffer holds numbers. */
static const char *last_key(const struct list *list, char buffer[24])
{
    static const char *const members[] = {
        [STORE_PAGE_NAME] = "name",
        [STORE_PAGE_PROCESS] = "process",
        [STORE_PAGE_STATUS] = "status",
    };
    const json_t *item = json_array_get(list->items, json_array_size(list->items) - 1);
    const json_t *value;

    if (list->page.key == STORE_PAGE_CREATED) {
        (void)snprintf(buffer, 24, "%" PRId64, list->last_ms);
        return buffer;
    }
    value = json_object_get(item, members[list->page.key]);
    if (list->page.key == STORE_PAGE_PROCESS && !value) { /* of jobs, models, and all others */
        static const char *const owners[] = {"madeFrom", "source"};

        value = json_object_get(item, "processID");
        for (size_t i = 0; i < 2 && !value; i++) {
            value = json_object_get(json_object_get(item, owners[i]), "process");
        }
    }
    return json_string_value(value) ? json_string_value(value) : "";
}

static void cursor_write(const struct list *list, char cursor[CURSOR_MAX])
{
    static const char digits[] = "0123456789abcdef";
    char text[CURSOR_TEXT], check[CHECK_DIGITS + 1], buffer[24];
    int length = snprintf(text, sizeof text, "%s:%s:%s:%s:", list->kind, list->filters.sort,
                          list->last_id, last_key(list, buffer));

    cursor_check(text, (size_t)length, check);
    (void)snprintf(text + length, sizeof text - (size_t)length, "%s", check);
    for (size_t i = 0; i <= strlen(text); i++) {
        unsigned char c = (unsigned char)text[i];

        cursor[2 * i] = c ? digits[c >> 4] : '\0';
        cursor[2 * i + 1] = digits[c & 15];
    }
}

/* Back from digits to text; false where they are none. */
static bool cursor_text(const char *cursor, char *text, size_t size)
{
    size_t length = strlen(cursor);

    if (length % 2 != 0 || length / 2 >= size || strspn(cursor, "0123456789abcdef") != length) {
        return false;
    }
    for (size_t i = 0; i < length / 2; i++) {
        char pair[3] = {cursor[2 * i], cursor[2 * i + 1], '\0'};

        text[i] = (char)strtol(pair, NULL, 16);
    }
    text[length / 2] = '\0';
    return true;
}

/* The next part of the text up to its colon, which becomes its end; NULL: there is none. */
static char *next_part(char **text)
{
    char *part = *text, *colon = part + strcspn(part, ":");

    if (!*colon) {
        return NULL;
    }
    *colon = '\0';
    *text = colon + 1;
    return part;
}

/* Where the page starts. *order: the one of the cursor, where it is of this list. */
static bool cursor_read(const char *cursor, struct list *list, char order[16])
{
    char text[CURSOR_TEXT], check[CHECK_DIGITS + 1], *rest = text, *kind, *sort, *id, *end;
    size_t length;

    if (!cursor_text(cursor, text, sizeof text)) {
        return false;
    }
    length = strlen(text);
    if (length <= CHECK_DIGITS) {
        return false;
    }
    cursor_check(text, length - CHECK_DIGITS, check);
    if (strcmp(text + length - CHECK_DIGITS, check) != 0) {
        return false;
    }
    text[length - CHECK_DIGITS - 1] = '\0'; /* the colon before the check */
    kind = next_part(&rest);
    sort = kind ? next_part(&rest) : NULL;
    id = sort ? next_part(&rest) : NULL;
    if (!id || strcmp(kind, list->kind) != 0 || strlen(id) >= sizeof list->after_id ||
        strlen(rest) >= sizeof list->after_text) {
        return false;
    }
    (void)snprintf(order, 16, "%s", sort);
    (void)snprintf(list->after_id, sizeof list->after_id, "%s", id);
    (void)snprintf(list->after_text, sizeof list->after_text, "%s", rest);
    list->page.after_ms = strtoll(rest, &end, 10);
    list->page.after_id = list->after_id;
    list->page.after_text = list->after_text;
    return list->page.key != STORE_PAGE_CREATED || strcmp(order, list->filters.sort) != 0 || !*end;
}

bool list_refuse(struct api_call *call, const char *pointer, const char *detail)
{
    struct problem_list problems = {.errors = NULL};

    problem_add(&problems, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &problems);
    return false;
}

bool list_limit(struct api_call *call, size_t *limit)
{
    char text[24];
    long number = 0;
    bool refused;

    *limit = LIMIT_DEFAULT;
    if (!query_get(call, "limit", text, sizeof text, &refused)) {
        return !refused;
    }
    if (!query_whole(text, &number) || number < 1 || number > LIMIT_MAX) {
        return list_refuse(call, "/limit", "limit must be a whole number from 1 to 200.");
    }
    *limit = (size_t)number;
    return true;
}

static bool read_cursor(struct api_call *call, struct list *list)
{
    char text[CURSOR_MAX], order[16] = "", detail[160];
    bool refused;

    if (!query_get(call, "cursor", text, sizeof text, &refused)) {
        return !refused;
    }
    if (!cursor_read(text, list, order)) {
        return list_refuse(call, "/cursor", "cursor is not one that this list gave.");
    }
    if (strcmp(order, list->filters.sort) != 0) {
        (void)snprintf(detail, sizeof detail,
                       "cursor is of the list by sort=%s, and sort is %s here: a list is paged "
                       "through in one order.",
                       order, list->filters.sort);
        return list_refuse(call, "/cursor", detail);
    }
    return true;
}

bool list_open(struct api_call *call, const char *kind, struct list *list)
{
    memset(list, 0, sizeof *list);
    list->kind = kind;
    list->member = "items";
    list->page.total = &list->total;
    list->page.owner = call->request->caller.restricted ? call->request->caller.name : NULL;
    if (!list_limit(call, &list->limit) || !list_filters_read(call, &list->filters, &list->page) ||
        !read_cursor(call, list)) {
        return false;
    }
    list->page.limit = list->limit + 1;
    list->items = json_array();
    return true;
}

bool list_add(struct list *list, json_t *item, int64_t created_ms, const char *id)
{
    if (json_array_size(list->items) == list->limit) {
        json_decref(item);
        list->more = true;
        return false;
    }
    (void)json_array_append_new(list->items, item);
    list->last_ms = created_ms;
    (void)snprintf(list->last_id, sizeof list->last_id, "%s", id);
    return true;
}

void list_self(struct api_call *call, json_t *links, const char *path)
{
    const char *query = call->request->query;
    char href[1200];

    if (strlen(path) + strlen(query) + 2 > sizeof href) {
        query = "";
    }
    (void)snprintf(href, sizeof href, "%s%s%s", path, query[0] ? "?" : "", query);
    link_add(links, href, "self", LINK_JSON, "This page");
}

/* The query of the next page: the filters of this one, the limit and the cursor. Also as one of the
   links, if there are any. Where it is longer than a header may be there is none: next in the
   document leads on as well. */
static void link_next(struct api_call *call, const struct list *list, const char *path,
                      const char *cursor, json_t *links)
{
    const char *rest = call->request->query;
    char *href = NULL;
    size_t size = 0;
    struct query_pair pair;
    FILE *out = open_memstream(&href, &size);

    if (!out) {
        return;
    }
    (void)fprintf(out, "%s?limit=%zu", path, list->limit);
    while (query_next(&rest, &pair)) {
        bool ours = (pair.name_length == 5 && strncmp(pair.name, "limit", 5) == 0) ||
                    (pair.name_length == 6 && strncmp(pair.name, "cursor", 6) == 0);

        if (!ours) {
            (void)fprintf(out, "&%.*s=%.*s", (int)pair.name_length, pair.name,
                          (int)pair.value_length, pair.value);
        }
    }
    (void)fprintf(out, "&cursor=%s", cursor);
    if (fclose(out) == 0) {
        (void)api_response_header(call->response, "Link", "<%s>; rel=\"next\"", href);
        if (links) {
            link_add(links, href, "next", LINK_JSON, "The next page");
        }
    }
    free(href);
}

/* Is the list empty because nobody has a cohort of that name? Jobs and models of one that was
   deleted are still listed by it. */
static bool lacks_cohort(struct api_call *call, const struct list *list)
{
    struct store *store = call->api->config.store;
    const char *name = list->page.cohort, *owner = list->page.owner;
    struct store_cohort cohort = {0};
    int status;

    if (!name || list->total > 0) {
        return false;
    }
    status = owner ? store_cohort_get_as(store, owner, name, &cohort)
                   : store_cohort_get(store, name, &cohort);
    store_cohort_clear(&cohort);
    return status == STORE_NOT_FOUND;
}

void list_respond(struct api_call *call, struct list *list, const char *path, int status)
{
    bool ours = strcmp(list->member, "items") == 0;
    json_t *document, *links = NULL;
    char cursor[CURSOR_MAX];

    if (status != 0) {
        json_decref(list->items);
        (void)problem_respond_store(call, status, NULL, "listing");
        return;
    }
    if (lacks_cohort(call, list)) {
        json_decref(list->items);
        (void)list_refuse(call, "/cohort", "there is no cohort of this name; see GET /v1/cohorts");
        return;
    }
    document = json_object();
    (void)json_object_set_new(document, list->member, list->items);
    (void)json_object_set_new(document, "total", json_integer(list->total));
    if (!ours) {
        links = json_array();
        list_self(call, links, path);
        (void)json_object_set_new(document, "links", links);
    }
    if (list->more) {
        cursor_write(list, cursor);
        (void)json_object_set_new(document, "next", json_string(cursor));
        link_next(call, list, path, cursor, links);
    } else if (ours) {
        (void)json_object_set_new(document, "next", json_null());
    }
    respond_json(call, 200, document);
}
