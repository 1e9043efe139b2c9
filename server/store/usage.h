/*
 * usage.h - what the store takes and how it is doing, for monitoring.
 */
#ifndef SRNFD_STORE_USAGE_H
#define SRNFD_STORE_USAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "store_status.h"

struct store;

/* Whether a write gets through to the disk: commits one that changes nothing. Waits so long at
   most; *answered is false where others are before it. */
int store_probe(struct store *store, int64_t wait_ms, bool *answered);

struct store_usage {
    int64_t database, log, blobs, prepared; /* bytes */
    int64_t free;                           /* bytes left on the file system */
};
int store_usage(struct store *store, struct store_usage *usage);
int store_free_bytes(struct store *store, int64_t *bytes);

/* The jobs of one process that are accepted, or running. */
struct store_load {
    const char *process, *status;
    size_t count;
    int64_t oldest_ms; /* when the oldest of them was created */
};
int store_job_load(struct store *store, void (*visit)(void *user, const struct store_load *load),
                   void *user);

#endif
