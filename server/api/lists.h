/*
 * lists.h - pages of a collection, newest first.
 */
#ifndef SRNFD_API_LISTS_H
#define SRNFD_API_LISTS_H

#include "api/handler.h"
#include "store/page.h"

/* Reads ?limit= and ?cursor= (a cursor is good only for the kind that gave it) and collects a page:
   pass &list->page to the store's list function with list as user, call list_add from its visitor
   and return what it returns, then list_respond with the path of the collection. */
#define LIST_ID_MAX STORE_COHORT_NAME_MAX /* the longest id or name in a list */
struct list {
    struct store_page page; /* limit is one more than asked for, to know whether there is a next
    page */
    const char *kind;       /* "meshes", "surfaces", "cohorts", "models", "jobs" */
    const char *member;     /* of the answer, with the items: "items", or what list_open is
                               followed by; then next is left out at the end, and there are links */
    size_t limit;
    json_t *items;
    bool more;
    int64_t last_ms;
    char after_id[LIST_ID_MAX], last_id[LIST_ID_MAX];
};
/* False when a problem was answered. */
bool list_open(struct api_call *call, const char *kind, struct list *list);
/* ?limit= alone. False when a problem was answered. */
bool list_limit(struct api_call *call, size_t *limit);
/* Answers that a parameter of the query is wrong; false. */
bool list_refuse(struct api_call *call, const char *pointer, const char *detail);
/* Adds the link to the page itself. */
void list_self(struct api_call *call, json_t *links, const char *path);
/* Takes over the item. */
bool list_add(struct list *list, json_t *item, int64_t created_ms, const char *id);
/* Answers {"items", "next"}, or member in the place of items with links, and Link rel="next";
   status is that of the store's list function. Frees the list. */
void list_respond(struct api_call *call, struct list *list, const char *path, int status);

#endif
