/*
 * batch.h - several puts as one: all of them are stored, or none.
 */
#ifndef SRNFD_STORE_BATCH_H
#define SRNFD_STORE_BATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "store_status.h"

struct store;

struct store_batch;
struct store_cohort; /* store/cohort.h */
struct store_mesh;   /* store/mesh.h */

/* NULL without memory. */
struct store_batch *store_batch_create(struct store *store);
/* Forgets what was added; what was not committed leaves nothing behind. */
void store_batch_destroy(struct store_batch *batch);

/*
 * Adds what store_mesh_put would store; its row is taken over (and cleared), also on failure.
 *   content [in]  mesh->bytes bytes
 *   kept    [out] the batch reads content until it is destroyed; otherwise it has a copy on the
 *                 disk and is done with it
 * Content that is damaged in the store is mended at once.
 */
int store_batch_add_mesh(struct store_batch *batch, struct store_mesh *mesh, const void *content,
                         bool *kept);
/* Adds what store_cohort_put would store, with the meaning of created and missing; all three are
   borrowed until the batch is destroyed. */
int store_batch_add_cohort(struct store_batch *batch, struct store_cohort *cohort, bool *created,
                           size_t *missing);

/* Puts added so far; the next one gets this number. */
size_t store_batch_count(const struct store_batch *batch);
/* Leaves out the put of this number. */
void store_batch_drop(struct store_batch *batch, size_t index);

/* Stores all, in the order in which they were added, in one transaction. On failure nothing is
   stored, and *failed is the number of the put that could not be done: its status is returned, as
   of the function that stores one alone. */
int store_batch_commit(struct store_batch *batch, size_t *failed);

#endif
