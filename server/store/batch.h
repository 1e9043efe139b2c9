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
struct store_cohort;  /* store/cohort.h */
struct store_job;     /* store/job.h */
struct store_labels;  /* store/labels.h */
struct store_mesh;    /* store/mesh.h */
struct store_model;   /* store/model.h */
struct store_surface; /* store/surface.h */
struct store_volume;  /* store/volume.h */

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
/* The same of a volume (volume.c). */
int store_batch_add_volume(struct store_batch *batch, struct store_volume *volume,
                           const void *content, bool *kept);
/* Adds what store_cohort_put would store, with the meaning of created and missing; all three are
   borrowed until the batch is destroyed. */
int store_batch_add_cohort(struct store_batch *batch, struct store_cohort *cohort, bool *created,
                           size_t *missing);

/* Adds what store_surface_put and store_model_put would store; the row is taken over as a mesh's
   is. id: that a model must have; STORE_CORRUPT: it has another one. */
int store_batch_add_surface(struct store_batch *batch, struct store_surface *surface);
int store_batch_add_model(struct store_batch *batch, struct store_model *model, const char *id);
/* Adds a successful job, with id, process, inputs, digest, build, owner and times set, name and
   tags unless they are NULL, and its results; bytes_max as of struct store_owner. The job is taken
   over. Where the id is taken it gets another; where its owner has the digest, nothing is done. */
int store_batch_add_job(struct store_batch *batch, struct store_job *job, const char *results,
                        size_t size, int64_t bytes_max);

/* Adds what store_label does, of something that is stored by then; id and labels are copied. */
int store_batch_add_labels(struct store_batch *batch, const char *owner, const char *id,
                           const struct store_labels *labels);

/* Puts added so far; the next one gets this number. */
size_t store_batch_count(const struct store_batch *batch);
/* Leaves out the put of this number. */
void store_batch_drop(struct store_batch *batch, size_t index);

/* Stores all, each after what it may rest on, in one transaction. On failure nothing is
   stored, and *failed is the number of the put that could not be done: its status is returned, as
   of the function that stores one alone. owner: what was stored may say that it was made of things
   that only others have, and does not hold these; NULL: of whatever it says. */
int store_batch_commit(struct store_batch *batch, const char *owner, size_t *failed);

#endif
