/*
 * volume.h - label volumes in the store.
 */
#ifndef SRNFD_STORE_VOLUME_H
#define SRNFD_STORE_VOLUME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "owner.h"
#include "store_status.h"

struct store;
struct store_page; /* store/page.h */

struct store_volume {
    char id[STORE_ID_MAX]; /* vol-..., of the bytes and the format */
    char *name;            /* may be empty */
    char *record;          /* JSON text of what was read of it, opaque here */
    char *tags;            /* the owner's, a JSON array; not set for put */
    int64_t bytes, created_ms;
    struct store_owner owner; /* to be set for put; not set by get */
};

/* Stores the volume for its owner, unless the owner has it; *created says which. content has
   volume->bytes bytes, volume->id is set. On return name, tags and created_ms are what the store
   holds for that owner. */
int store_volume_put(struct store *store, struct store_volume *volume, const void *content,
                     bool *created);
/* As this owner (NULL: nobody) knows it, as store_mesh_get_as. */
int store_volume_get_as(struct store *store, const char *owner, const char *id,
                        struct store_volume *volume);
/* content is allocated with malloc. */
int store_volume_content(struct store *store, const char *id, unsigned char **content,
                         size_t *size);
void store_volume_clear(struct store_volume *volume);
/* Newest first: see store_page. */
int store_volume_list(struct store *store, const struct store_page *page,
                      bool (*visit)(void *user, const struct store_volume *volume), void *user);

#endif
