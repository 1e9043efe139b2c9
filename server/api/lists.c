/*
 * lists.c - pages of a collection, newest first, and the cursors between them.
 *
 * A cursor is the text "kind:created:id:check" in hexadecimal: the last item that the client has
 * seen, and eight digits of a SHA-256 over the rest, so that a cursor of another list, a mistyped
 * or an invented one is told from ours instead of answering a page from nowhere. It is no secret
 * and grants nothing. A page reads one row more than was asked for, which says whether there is a
 * next one.
 */
#include "api/respond.h"

#include "api/links.h"
#include "api/lists.h"
#include "store/digest.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LIMIT_DEFAULT 50
#define LIMIT_MAX 200
#define CURSOR_MAX 400
#define CHECK_DIGITS 8

static void cursor_check(const char *text, size_t length, char check[CHECK_DIGITS + 1])
{
    char hex[65];

    store_sha256_hex(hex, text, length);
    memcpy(check, hex, CHECK_DIGITS);
    check[CHECK_DIGITS] = '\0';
}

static void cursor_write(const struct list *list, char cursor[CURSOR_MAX])
{
    static const char digits[] = "0123456789abcdef";
    char text[CURSOR_MAX / 2], check[CHECK_DIGITS + 1];
    int length =
        snprintf(text, sizeof text, "%s:%" PRId64 ":%s:", list->kind, list->last_ms, list->last_id);

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

static bool cursor_read(const char *cursor, struct list *list)
{
    char text[CURSOR_MAX / 2], check[CHECK_DIGITS + 1];
    size_t kind_length = strlen(list->kind), length, id_length;
    char *end;

    if (!cursor_text(cursor, text, sizeof text)) {
        return false;
    }
    length = strlen(text);
    if (length <= kind_length + CHECK_DIGITS || strncmp(text, list->kind, kind_length) != 0 ||
        text[kind_length] != ':') {
        return false;
    }
    cursor_check(text, length - CHECK_DIGITS, check);
    if (strcmp(text + length - CHECK_DIGITS, check) != 0) {
        return false;
    }
    list->page.after_ms = strtoll(text + kind_length + 1, &end, 10);
    id_length = strcspn(end + 1, ":");
    if (*end != ':' || id_length >= sizeof list->after_id) {
        return false;
    }
    memcpy(list->after_id, end + 1, id_length);
    list->after_id[id_length] = '\0';
    list->page.after_id = list->after_id;
    return true;
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

bool list_open(struct api_call *call, const char *kind, struct list *list)
{
    char text[CURSOR_MAX];
    bool refused;

    memset(list, 0, sizeof *list);
    list->kind = kind;
    list->member = "items";
    if (!list_limit(call, &list->limit)) {
        return false;
    }
    list->page.limit = list->limit + 1;
    list->page.owner = call->request->caller.restricted ? call->request->caller.name : NULL;
    if (query_get(call, "cursor", text, sizeof text, &refused)) {
        if (!cursor_read(text, list)) {
            return list_refuse(call, "/cursor", "cursor is not one that this list gave.");
        }
    } else if (refused) {
        return false;
    }
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
   links, if there are any. */
static void link_next(struct api_call *call, const struct list *list, const char *path,
                      const char *cursor, json_t *links)
{
    char href[1000];

    const char *rest = call->request->query;
    char filters[300] = "";
    struct query_pair pair;

    while (query_next(&rest, &pair)) {
        size_t used = strlen(filters);
        bool ours = (pair.name_length == 5 && strncmp(pair.name, "limit", 5) == 0) ||
                    (pair.name_length == 6 && strncmp(pair.name, "cursor", 6) == 0);

        if (!ours && used + pair.name_length + pair.value_length + 3 < sizeof filters) {
            (void)snprintf(filters + used, sizeof filters - used, "&%.*s=%.*s",
                           (int)pair.name_length, pair.name, (int)pair.value_length, pair.value);
        }
    }
    (void)snprintf(href, sizeof href, "%s?limit=%zu%s&cursor=%s", path, list->limit, filters,
                   cursor);
    (void)api_response_header(call->response, "Link", "<%s>; rel=\"next\"", href);
    if (links) {
        link_add(links, href, "next", LINK_JSON, "The next page");
    }
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
    document = json_object();
    (void)json_object_set_new(document, list->member, list->items);
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
