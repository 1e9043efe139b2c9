/*
 * prepared.h - prepared meshes that are kept for later jobs, as files beside the blobs.
 */
#ifndef SRNFD_STORE_PREPARED_H
#define SRNFD_STORE_PREPARED_H

#include <stdbool.h>

#include "store/store.h"

/* Which one: of a mesh by itself, or with a sphere for it. */
struct store_prepared_key {
    const char *mesh, *sphere; /* ids; sphere "": none */
    const char *made;          /* all else that decides it: owner, numeric build, .. */
};

struct store_part {
    const void *bytes;
    size_t size;
};

/* From now on so many bytes are kept at most, as the files take them on the disk; 0, as after
   store_open: nothing is kept, and nothing found. What is there beyond the limit goes; so does, as
   long as there is any, what a write needs that finds no room, and what leaves less than least_free
   bytes free on the disk, those not read for longest first. */
void store_prepared_limit(struct store *store, int64_t limit, int64_t least_free);
/* Keeps the parts, one after the other, of a mesh and a sphere that are in the store
   (STORE_NOT_FOUND). Not synced: what a crash leaves unfinished is damaged, and so not there. */
int store_prepared_put(struct store *store, const struct store_prepared_key *key,
                       const struct store_part *parts, size_t n_parts);
/* value is allocated with malloc. STORE_NOT_FOUND: there is none, or it was damaged. */
int store_prepared_get(struct store *store, const struct store_prepared_key *key,
                       unsigned char **value, size_t *size);
/* Removes those of meshes and spheres that the store does not have, which a crash after their
   deletion has left; adds their number to *removed. */
int store_prepared_sweep(struct store *store, size_t *removed);
/* For a write that found no room: removes those not read for longest until so many bytes are free
   on the disk beside what is to be left. False: none was removed, as there are none, or so much is
   free. */
bool store_prepared_give_way(struct store *store, int64_t bytes);
/* Bytes that all together take. */
int64_t store_prepared_bytes(const struct store *store);

#endif
