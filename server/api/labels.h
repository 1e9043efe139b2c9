/*
 * labels.h - names and tags in requests and records.
 */
#ifndef SRNFD_API_LABELS_H
#define SRNFD_API_LABELS_H

#include "api/handler.h"
#include "api/respond.h"
#include "store/labels.h"

#define LABELS_TAGS_MAX 64
#define LABELS_TAG_MAX 64 /* bytes */

/* The members name and tags of a body. */
struct labels {
    struct store_labels change; /* what is given, null as "" and []; borrows from the rest */
    char name[NAME_SIZE];
    char *tags; /* malloc */
};
/* Reads them; what is wrong with them goes into the list. Without memory the tags are not given. */
void labels_read(const json_t *body, struct labels *labels, struct problem_list *list);
void labels_clear(struct labels *labels);
/* What is wrong with a tag, or NULL. */
const char *label_tag_problem(const char *tag);

/* Content that is sent again with a name takes it: *held, malloc, becomes that. "" leaves it. */
int labels_rename(struct store *store, const char *owner, const char *id, const char *name,
                  char **held);

/* Sets the member tags of a record from the stored text. */
void labels_set_tags(json_t *record, const char *tags);
/* The entity tag of a record that changes with nothing but name and tags. */
#define LABELS_ETAG_MAX (STORE_ID_MAX + 16)
void labels_etag(char etag[LABELS_ETAG_MAX], const char *id, const char *name, const char *tags);

#endif
