/*
 * lists.h - pages of a collection: filtered, sorted, newest first where nothing else is asked for.
 */
#ifndef SRNFD_API_LISTS_H
#define SRNFD_API_LISTS_H

#include "api/handler.h"
#include "api/labels.h"
#include "api/respond.h"
#include "store/page.h"

#define LIST_ITEMS_MAX 32 /* values of a parameter that is a list */
#define LIST_ITEM_MAX 64  /* characters of each */
#define LIST_WORDS_MAX (LIST_ITEMS_MAX * (LIST_ITEM_MAX + 1)) /* all of them, with commas */

/* What the query of a list asks for (list_filters.c); "" where it does not. */
struct list_filters {
    char name[NAME_SIZE], tag[LABELS_TAG_MAX + 1], process[LIST_WORDS_MAX], status[LIST_WORDS_MAX];
    char cohort[STORE_COHORT_NAME_MAX], mesh[STORE_ID_MAX], sort[16];
};

/* Reads the parameters that the route knows, and ?limit= and ?cursor= (a cursor is good only for
   the kind and the order that gave it), and collects a page: pass &list->page to the store's list
   function with list as user, call list_add from its visitor and return what it returns, then
   list_respond with the path of the collection. It must not be moved in between. */
#define LIST_ID_MAX (STORE_COHORT_NAME_MAX + STORE_OWNER_MAX) /* the longest id in a cursor */
struct list {
    struct store_page page; /* limit is one more than asked for, to know whether there is a next
    page */
    struct list_filters filters;
    const char *kind;   /* "meshes", "surfaces", "cohorts", "models", "jobs" */
    const char *member; /* of the answer, with the items: "items", or what list_open is
                               followed by; then next is left out at the end, and there are links */
    size_t limit;
    json_t *items;
    bool more;
    int64_t total, last_ms;
    char after_id[LIST_ID_MAX], last_id[LIST_ID_MAX], after_text[NAME_SIZE];
};
/* False when a problem was answered. */
bool list_open(struct api_call *call, const char *kind, struct list *list);
/* ?limit= alone. False when a problem was answered. */
bool list_limit(struct api_call *call, size_t *limit);
/* Answers that a parameter of the query is wrong; false. */
bool list_refuse(struct api_call *call, const char *pointer, const char *detail);
/* The same of a word that is none of those known, with the nearest of these. */
bool list_refuse_unknown(struct api_call *call, const char *name, const char *given,
                         const char *const *known);
/* Adds the link to the page itself. */
void list_self(struct api_call *call, json_t *links, const char *path);
/* Takes over the item. */
bool list_add(struct list *list, json_t *item, int64_t created_ms, const char *id);
/* Answers {"items", "total", "next"}, or member in the place of items with links, and Link
   rel="next"; status is that of the store's list function. Frees the list. */
void list_respond(struct api_call *call, struct list *list, const char *path, int status);

/* Reads the filters and the order into page, whose texts are those of filters. False when a problem
   was answered. */
bool list_filters_read(struct api_call *call, struct list_filters *filters,
                       struct store_page *page);
/* Milliseconds of a date ("2026-01-31": its midnight, UTC) or an instant of RFC 3339; false where
   it is none, or before 1970. */
bool list_time(const char *text, int64_t *ms);
/* The parameters that lists of jobs alone have, those of OGC API - Processes among them
   (job_filters.c): as list_filters_read. */
bool job_filters_read(struct api_call *call, struct list_filters *filters, struct store_page *page);

#endif
