/*
 * mesh.h - meshes in the store.
 */
#ifndef SRNFD_STORE_MESH_H
#define SRNFD_STORE_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "owner.h"
#include "store_status.h"

struct store;
struct store_page; /* store/page.h */

struct store_mesh {
    char id[STORE_ID_MAX]; /* mesh-..., of the bytes and the format */
    char *name;            /* may be empty */
    char *format;
    char *report; /* JSON text, opaque here */
    char *tags;   /* JSON array; not set for put */
    char *source; /* JSON text of what made it; NULL or empty: it was uploaded */
    int64_t bytes, vertices, faces, created_ms;
    struct store_owner owner; /* to be set for put; not set by get */
};

/* Stores the mesh for its owner, unless the owner has it; *created says which. Where the owner has
   it and its content is damaged, the content is replaced. content has mesh->bytes bytes, mesh->id
   is set. On return mesh->created_ms, mesh->name and mesh->source are what the store holds for that
   owner. */
int store_mesh_put(struct store *store, struct store_mesh *mesh, const void *content,
                   bool *created);
/* For a mesh that is there: content replaces what is stored of it, where that is damaged. */
int store_mesh_mend(struct store *store, const void *content, size_t size);
int store_mesh_get(struct store *store, const char *id, struct store_mesh *mesh);
/* The same as this owner (NULL: nobody) knows it: with the owner's name and time, where the owner
   has it. Whether the owner may see it is not asked: store_owner_has does. */
int store_mesh_get_as(struct store *store, const char *owner, const char *id,
                      struct store_mesh *mesh);
/* content is allocated with malloc. */
int store_mesh_content(struct store *store, const char *id, unsigned char **content, size_t *size);
void store_mesh_clear(struct store_mesh *mesh);
/* Drops all that the service has derived from a mesh, for whomever: prepared meshes and encodings
   of it, and those of others with it as their sphere. For after the deletion of a mesh, once that
   is committed: from then on nothing more is kept of it. */
int store_mesh_drop_derived(struct store *store, const char *id);
/* Newest first: see store_page. */
int store_mesh_list(struct store *store, const struct store_page *page,
                    bool (*visit)(void *user, const struct store_mesh *mesh), void *user);

#endif
