/*
 * models.h - models in the api layer: their record, and how a model that was made comes into the
 * store.
 */
#ifndef SRNFD_API_MODELS_H
#define SRNFD_API_MODELS_H

#include "api/handler.h"

struct store_model; /* store/model.h */

/* The full record (new reference): the arrays of eigenvalues and scores must have been read.
   mean is the record of the mean surface, taken over. */
json_t *model_record(const struct store_model *model, json_t *mean);

/* The member "madeFrom" of a stored model's record (new reference), an object. */
json_t *model_made_from(const struct store_model *model);

#endif
