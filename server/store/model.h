/*
 * model.h - models in the store.
 */
#ifndef SRNFD_STORE_MODEL_H
#define SRNFD_STORE_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "owner.h"
#include "store_status.h"

struct store;
struct store_page; /* store/page.h */

/* The arrays of a model, by index. */
enum store_model_array {
    STORE_MODEL_MEAN_Q,      /* [3][n_theta][n_phi] */
    STORE_MODEL_MODES,       /* [components][3][n_theta][n_phi] */
    STORE_MODEL_EIGENVALUES, /* [components] */
    STORE_MODEL_SCORES,      /* [subjects][components] */
    STORE_MODEL_CALIBRATION, /* [STORE_CALIBRATION_VALUES][subjects] leave-one-out values */
};
#define STORE_MODEL_ARRAYS 5
#define STORE_CALIBRATION_VALUES 4

struct store_model {
    char id[STORE_ID_MAX];   /* model-..., set by put */
    char mean[STORE_ID_MAX]; /* the mean surface, which stays as long as the model */
    char *record;            /* JSON text of everything else in the record, opaque here */
    char *name, *tags;       /* the owner's, tags as a JSON array; not set for put */
    int64_t lmax, n_theta, n_phi, subjects, components, created_ms;
    /* malloc; NULL where not asked for, and the calibration also where the model has none: those
       made before migration 7 */
    double *arrays[STORE_MODEL_ARRAYS];
    /* What else the model is made of, as a text that is part of its id: two models of the same
       arrays are one only if that is the same. Borrowed by put; NULL: nothing, as of those made
       before there was this text. */
    const char *identity;
    struct store_owner owner; /* to be set for put; not set by get */
};
void store_model_clear(struct store_model *model);
/* Numbers in one of the arrays. */
size_t store_model_count(const struct store_model *model, enum store_model_array array);

/* Stores the model, with all its arrays, unless it is there. Its id is made of the canonical
   content: the sizes in the order above, the id of the mean, the doubles of the arrays (-0 as 0),
   little-endian, and the identity. On return id, record and created_ms are what the store holds.
   STORE_NOT_FOUND: there is no such mean. */
int store_model_put(struct store *store, struct store_model *model, bool *created);
/* arrays: a bit 1 << enum store_model_array for each that is wanted. */
int store_model_get(struct store *store, const char *id, unsigned arrays,
                    struct store_model *model);
/* As store_mesh_get_as: record and time are the owner's. */
int store_model_get_as(struct store *store, const char *owner, const char *id, unsigned arrays,
                       struct store_model *model);
/* Newest first: see store_page. */
int store_model_list(struct store *store, const struct store_page *page,
                     bool (*visit)(void *user, const struct store_model *model), void *user);

#endif
