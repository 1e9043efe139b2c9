/*
 * holdings.h - what belongs to an owner, and what an owner may have.
 */
#ifndef SRNFD_STORE_HOLDINGS_H
#define SRNFD_STORE_HOLDINGS_H

#include <stddef.h>
#include <stdint.h>

#include "store_status.h"

struct store;

/* Whether the mesh, surface, model or job of this id belongs to the owner (NULL: ""): STORE_OK or
   STORE_NOT_FOUND. */
int store_owner_has(struct store *store, const char *owner, const char *id);
/* Bytes that the owner holds: meshes, coefficients, the arrays of models, what jobs were given,
   results and checkpoints, cohorts, and for each row something for itself. What several owners have
   counts for each. most: what it may hold, as was said last (0: any number); may be NULL. */
int store_owner_bytes(struct store *store, const char *owner, int64_t *bytes, int64_t *most);
/* Remembers when a token was last used, by its id. */
int store_token_used(struct store *store, const char *token, int64_t when_ms);

/* What an owner may have: jobs that wait and run, and bytes. 0: no limit. */
struct store_job_limits {
    size_t queued, running;
    int64_t bytes;
};

#endif
