/*
 * model_members.h - the members that a model was made from, as its record tells of them.
 */
#ifndef SRNFD_TOOLKIT_MODEL_MEMBERS_H
#define SRNFD_TOOLKIT_MODEL_MEMBERS_H

#include <jansson.h>

#include "compute/model.h"

struct model_members {
    struct compute_subjects view;
    size_t *subjects; /* [n] numbers of theirs */
    double *weights;
    const char **contents;
    double *numbers; /* residuals, then distances */
};

/* made, the madeFrom of the model, is borrowed for as long as members is used. No contents where
   the record does not tell. 0 or SRNF_ENOMEM; model_members_clear in any case. */
int model_members_read(const json_t *made, size_t n, size_t n_parts, struct model_members *members);
void model_members_clear(struct model_members *members);

#endif
