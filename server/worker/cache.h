/*
 * cache.h - contents of tasks on the disk of a worker, by their digests.
 */
#ifndef SRNFD_WORKER_CACHE_H
#define SRNFD_WORKER_CACHE_H

#include "tasks/tasks.h"

struct cache;
/* directory: made where it is not there; NULL: nothing is kept. bytes: that its files may take
   together. NULL without memory. */
struct cache *cache_open(const char *directory, size_t bytes);
void cache_close(struct cache *cache);
/* The content with this digest (malloc); false: it is not there, or damaged, and then removed. */
bool cache_get(struct cache *cache, const char *digest, struct tasks_bytes *content);
/* Keeps a copy, as far as there is room: what cannot be kept is fetched again. */
void cache_put(struct cache *cache, const char *digest, const struct tasks_bytes *content);
/* Whether the bytes have the digest. */
bool cache_fits(const char *digest, const struct tasks_bytes *content);

#endif
