/*
 * labels.h - names and tags, which an owner gives to what it has.
 */
#ifndef SRNFD_STORE_LABELS_H
#define SRNFD_STORE_LABELS_H

#include "ids.h"
#include "store_status.h"

struct store;

/* What is to change; NULL stays as it is. Both are UTF-8; tags is a JSON array of different
   strings. */
struct store_labels {
    const char *name, *tags;
    const struct store_labels *seen; /* where not NULL: both as they must be before the change */
};

/* Both as an owner has them (malloc). */
struct store_labels_held {
    char *name, *tags;
};
void store_labels_clear(struct store_labels_held *held);
/* Of a mesh, surface, model, volume or job. STORE_NOT_FOUND: it is not the owner's. */
int store_labels_get(struct store *store, const char *owner, const char *id,
                     struct store_labels_held *held);

/*
 * Changes them for a mesh, surface, model, volume or job of its owner (NULL: ""). What others call
 * the same content stays. STORE_NOT_FOUND: it is not the owner's. STORE_CONFLICT: they are not what
 * `seen` says. STORE_QUOTA: the owner may not hold as many bytes.
 */
int store_label(struct store *store, const char *owner, const char *id,
                const struct store_labels *labels);

#endif
