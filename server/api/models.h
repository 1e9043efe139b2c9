/*
 * models.h - models in the api layer: their record, and how a model that was made comes into the
 * store.
 */
#ifndef SRNFD_API_MODELS_H
#define SRNFD_API_MODELS_H

#include "api/handler.h"
#include "api/labels.h"

struct store_model; /* store/model.h */

/* The full record (new reference): the arrays of eigenvalues and scores must have been read.
   mean is the record of the mean surface, taken over. */
json_t *model_record(const struct store_model *model, json_t *mean);

/* The entity tag of a model that its owner has under these labels: its mean's are part of the
   record, and so of the tag. A status of the store. */
#define MODEL_ETAG_MAX (2 * LABELS_ETAG_MAX)
int model_tag(struct api_call *call, const char *owner, const struct store_labels_held *held,
              char etag[MODEL_ETAG_MAX]);

/* What a stored model is: "components", of pca, "parts", of pca-parts, or "classifier", of train
   or train-parts. Static. */
const char *model_kind(const struct store_model *model);

/* The member "madeFrom" of a stored model's record (new reference), an object. */
json_t *model_made_from(const struct store_model *model);

#endif
