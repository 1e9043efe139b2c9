/*
 * model_parts.h - models of several structures: what their records tell of the parts.
 *
 * Such a record has "parts", an array of {name, weight, mean (id of the surface), ..} in the order
 * of the stacked fields, and "positions", {weight, mean} or null.
 */
#ifndef SRNFD_API_MODEL_PARTS_H
#define SRNFD_API_MODEL_PARTS_H

#include "api/cohorts.h"
#include "api/handler.h"
#include "compute/model.h"

/* What a stored model is of; one structure where its record names no parts. False: the record does
   not fit the model's sizes, which can only be of an import. */
bool model_joint(const struct store_model *model, struct compute_joint *joint);

/* The surface that a classifier registers others of one part to, from its record; NULL where the
   record names none. */
const char *model_template(const json_t *record, size_t part);

/* Names of the parts (new reference): empty of one structure. */
json_t *model_part_names(const struct store_model *model);
/* "left", "right", as sentences have it. names: an array of texts. */
#define MODEL_NAMES_MAX 400
const char *model_names_text(const json_t *names, char text[MODEL_NAMES_MAX]);
/* The place of a name in an array, or its size. */
size_t model_name_find(const json_t *names, const char *name);

/* The part that ?part= names, which models of several structures need and others must not have. */
struct model_part {
    char name[4 * COHORT_TEXT_MAX + 4]; /* "" of one structure */
    size_t index;
};
/* Chooses it, and makes the model that of it. False when a problem was answered. */
bool model_choose_part(struct api_call *call, struct store_model *model, struct model_part *part);

#endif
